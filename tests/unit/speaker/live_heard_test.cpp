// What a stream hears.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "support/error_of.h"
#include "support/live_fixture.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

/// Of words with their times the sound tells what they do not say: when each phone is said.
TEST_F(Live, SoundTellsWhenThePhonesOfWordsAreSaid) {
  Pulled by_phones;
  LiveStream phones = speaker().live({.look_ahead = 1, .source = LiveOptions::Source::kLabels});
  pushLabels(phones, by_phones);
  enum class Comes { kNever, kBefore, kTooLate };
  const auto byWords = [&](Comes comes) {
    LiveStream stream = speaker().live({.look_ahead = 1, .source = LiveOptions::Source::kLabels});
    Pulled pulled;
    std::size_t come = 0;
    for (const WordLabel& word : line().labels().words) {
      if (comes == Comes::kTooLate) stream.push(word.text, word.span);
      const auto until = std::min(
          sound().size(), static_cast<std::size_t>(16000 * (word.span.end + (comes == Comes::kBefore ? 0.05 : 0))));
      if (comes != Comes::kNever) stream.pushSoundOfWords(std::span(sound()).subspan(come, until - come));
      come = until;
      if (comes != Comes::kTooLate) stream.push(word.text, word.span);
      pulled.addAll(stream);
    }
    stream.silence(line().labels().phones.back().span.end);
    stream.finish();
    pulled.addAll(stream);
    return pulled;
  };
  const auto differs = [&](const Pulled& pulled) {
    double sum = 0;
    EXPECT_EQ(pulled.markers_mm.size(), by_phones.markers_mm.size());
    for (std::size_t i = 0; i < std::min(pulled.markers_mm.size(), by_phones.markers_mm.size()); ++i)
      sum += std::pow(pulled.markers_mm[i] - by_phones.markers_mm[i], 2);
    return std::sqrt(sum / static_cast<double>(by_phones.markers_mm.size()));
  };
  const Pulled without = byWords(Comes::kNever);
  EXPECT_LT(differs(byWords(Comes::kBefore)), 0.6 * differs(without));
  EXPECT_EQ(byWords(Comes::kTooLate), without) << "a word's sound that comes after it";
}

TEST_F(Live, SoundOfWordsIsNotSoundAlone) {
  LiveStream stream = speaker().live();
  stream.push(std::span<const float>());  // no sound has come yet: labels still may
  stream.silence(0.1);
  EXPECT_THROW(stream.push(std::span(sound()).first(1600)), InputError);
  stream = speaker().live();
  stream.push(std::span(sound()).first(1600));
  EXPECT_EQ(errorOf([&] { stream.pushSoundOfWords(sound()); }),
            "found labels and sound in one stream; expected one of them");
  LiveStream words = speaker().live({.source = LiveOptions::Source::kLabels});
  const std::vector<float> odd{std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -9.0F};
  words.pushSoundOfWords(odd);
  words.push("boat", {0, 0.0001});
  words.pushSoundOfWords(sound());
  words.push("boat", {0.1, 0.5});
  words.push("boat", {0.5, 0.9});
  words.push("boat", {0.1, 0.5});  // once more
  words.push("boat", {0.9, 99});   // longer than the sound
  words.finish();
  EXPECT_NE(words.next(), nullptr);
}

TEST_F(Live, SixteenBitsAndFloatsAreHeardAlike) {
  std::vector<std::int16_t> integers;
  std::vector<float> floats;
  for (const float sample : sound()) {
    integers.push_back(static_cast<std::int16_t>(std::lround(32767 * sample)));
    floats.push_back(static_cast<float>(integers.back()) / 32768.0F);
  }
  LiveStream a = speaker().live(), b = speaker().live();
  a.push(std::span<const std::int16_t>(integers));
  b.push(std::span<const float>(floats));
  a.finish();
  b.finish();
  Pulled from_integers, from_floats;
  from_integers.addAll(a);
  from_floats.addAll(b);
  EXPECT_TRUE(from_integers == from_floats);
}

TEST_F(Live, SoundAloneOpensTheMouthAsTheRecordingHeardAsPhonesDoes) {
  const test::ScratchFolder scratch;
  const fs::path recording = scratch.path() / "line.wav";
  save(line(), recording);
  SpeakerOptions options = optionsOf(false);
  options.hear = SpeakerOptions::Hear::kPhones;
  const std::vector<double> whole = openings(Speaker(options).perform(Line::heard(recording)).motion().positions_mm);
  const Pulled heard = heardInChunks([] { return 800U; });
  EXPECT_GT(correlation(openings(heard.markers_mm), whole), 0.75);
  // The same at another rate: every sample three times.
  LiveStream stream = speaker().live({.look_ahead = 0.2, .sample_rate_hz = 48000});
  std::vector<float> fast;
  for (const float sample : sound()) fast.insert(fast.end(), 3, sample);
  stream.push(std::span<const float>(fast));
  stream.finish();
  Pulled at_48;
  at_48.addAll(stream);
  EXPECT_NEAR(static_cast<double>(at_48.frames), static_cast<double>(heard.frames), 1);
  EXPECT_GT(correlation(openings(at_48.markers_mm), whole), 0.7);
}

TEST_F(Live, HearsWordsWhereTheyAreWanted) {
  constexpr std::size_t kSamples = 19200;
  const auto heardBy = [&](SpeakerOptions::Hear hear) {
    SpeakerOptions options = optionsOf(false);
    options.hear = hear;
    LiveStream stream = Speaker(options).live({.look_ahead = 1, .arkit = false});
    stream.push(std::span(sound()).first(kSamples));
    stream.finish();
    EXPECT_EQ(stream.counts().words_missed, 0U);
    Pulled pulled;
    pulled.addAll(stream);
    return pulled;
  };
  const Pulled by_words = heardBy(SpeakerOptions::Hear::kWords), by_phones = heardBy(SpeakerOptions::Hear::kPhones);
  EXPECT_EQ(by_words.frames, by_phones.frames);
  EXPECT_NE(by_words, by_phones);
  EXPECT_EQ(heardBy(SpeakerOptions::Hear::kAuto), by_phones);
}

TEST_F(Live, AFrameComesNoLaterThanItsLookAheadAndAHop) {
  LiveStream stream = speaker().live();
  constexpr std::size_t kChunk = 160;  // 10 ms
  for (std::size_t at = 0; at + kChunk <= sound().size(); at += kChunk) {
    stream.push(std::span(sound()).subspan(at, kChunk));
    while (stream.next() != nullptr) {
    }
    const double heard = static_cast<double>(at + kChunk) / 16000;
    EXPECT_GE(static_cast<double>(stream.counts().frames) / 60, heard - 0.200 - 0.041 - 1e-9);
  }
}

}  // namespace
}  // namespace mouthpiece
