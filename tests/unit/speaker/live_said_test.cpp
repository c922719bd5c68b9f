// What a stream is told: phones, words, texts.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "phonetics/labels/phone_lengths.h"
#include "speaker/speaker_data.h"
#include "support/error_of.h"
#include "support/live_fixture.h"

namespace mouthpiece {
namespace {

/// The root mean square of how far a marker is from where the line as a whole has it.
double markersApartMm(const Pulled& pulled, const Performance& line) {
  const std::vector<double>& whole = line.motion().positions_mm;
  const std::size_t both = std::min(whole.size(), pulled.markers_mm.size());
  double squares = 0;
  for (std::size_t i = 0; i < both; ++i) squares += std::pow(pulled.markers_mm[i] - whole[i], 2);
  return std::sqrt(3 * squares / static_cast<double>(both));
}

double openingsApartMm(const std::vector<double>& live, const std::vector<double>& whole) {
  const std::size_t both = std::min(live.size(), whole.size());
  double squares = 0;
  for (std::size_t i = 0; i < both; ++i) squares += std::pow(live[i] - whole[i], 2);
  return std::sqrt(squares / static_cast<double>(both));
}

TEST_F(Live, WithoutArkitsWeightsMarkersAreTheSame) {
  std::array<Pulled, 2> pulled;
  for (const bool arkit : {false, true}) {
    LiveStream stream = speaker().live({.source = LiveOptions::Source::kLabels, .arkit = arkit});
    pushLabels(stream, pulled[arkit ? 1 : 0]);
  }
  EXPECT_EQ(pulled[0].markers_mm, pulled[1].markers_mm);
  const auto most = [](const Pulled& one) { return *std::max_element(one.arkit.begin(), one.arkit.end()); };
  EXPECT_EQ(most(pulled[0]), 0);
  EXPECT_GT(most(pulled[1]), 0.1F);
}

TEST_F(Live, WithASecondAheadItIsTheLineAsAWhole) {
  LiveStream stream = speaker().live({.look_ahead = 1.0});
  Pulled pulled;
  pushLabels(stream, pulled);
  const std::vector<double>& whole = line().motion().positions_mm;
  ASSERT_NEAR(static_cast<double>(pulled.frames), static_cast<double>(line().frameCount()), 1);
  EXPECT_LT(markersApartMm(pulled, line()), 0.1);
  EXPECT_GT(correlation(openings(pulled.markers_mm), openings(whole)), 0.995);
}

TEST_F(Live, WithTheUsualLookAheadItIsNearAndLipsThatTouchDo) {
  LiveStream stream = speaker().live();
  Pulled pulled;
  pushLabels(stream, pulled);
  const std::vector<double> live = openings(pulled.markers_mm), whole = openings(line().motion().positions_mm);
  EXPECT_GT(correlation(live, whole), 0.9);
  EXPECT_LT(markersApartMm(pulled, line()), 0.4);  // 0.30 and 0.63 when they were written
  EXPECT_LT(openingsApartMm(live, whole), 0.8);
  const auto least = [&](const std::vector<double>& opening, const TimeSpan& span) {
    const auto frame = [&](Seconds time) {
      return std::clamp<std::ptrdiff_t>(std::lround(60 * time), 0, std::ssize(opening) - 1);
    };
    return *std::min_element(opening.begin() + frame(span.start - 0.02), opening.begin() + frame(span.end + 0.02) + 1);
  };
  const double quarter =
      *std::min_element(whole.begin(), whole.end()) +
      0.25 * (*std::max_element(whole.begin(), whole.end()) - *std::min_element(whole.begin(), whole.end()));
  std::size_t closures = 0;
  for (const PhoneLabel& phone : line().labels().phones) {
    if (phone.viseme != "MBP" || least(whole, phone.span) > quarter) continue;
    ++closures;
    EXPECT_LT(least(live, phone.span), quarter) << phone.phone << " at " << phone.span.start;
  }
  EXPECT_GE(closures, 5U);
}

TEST_F(Live, LabelsThatComeTwiceOrTooLateAreCountedAndPassedOver) {
  LiveStream stream = speaker().live({.source = LiveOptions::Source::kLabels});
  stream.push(LivePhone{"sil", {0, 0.5}});
  Pulled pulled;
  for (int i = 0; i < 90; ++i) pulled.add(*stream.nextNow());  // to 1.5 s, a second of it unknown
  stream.push(LivePhone{"AA", {0.1, 0.4}});                    // said before
  stream.push(LivePhone{"AA", {0.7, 1.2}});                    // shown without it
  EXPECT_EQ(stream.counts().doubled, 1U);
  EXPECT_EQ(stream.counts().late, 1U);
  stream.push(LivePhone{"AA", {1.9, 2.3}});
  stream.silence(3);
  stream.finish();
  pulled.addAll(stream);
  EXPECT_EQ(pulled.frames, 180U) << "what was late took no time of its own";
  const std::vector<double> opening = openings(pulled.markers_mm);
  const auto most = [&](int first, int end) {
    return *std::max_element(opening.begin() + first, opening.begin() + end) - opening.front();
  };
  EXPECT_LT(most(0, 90), 0.5);
  EXPECT_GT(most(114, 138), 3);
}

TEST_F(Live, WordsAndTextAreSaid) {
  LiveStream words = speaker().live();
  words.push("mama", TimeSpan{0.5, 0.9});
  words.push("7", TimeSpan{0.9, 1.3});
  words.silence(2.5);
  words.finish();
  Pulled pulled;
  pulled.addAll(words);
  EXPECT_EQ(pulled.frames, 150U);
  const std::vector<double> opening = openings(pulled.markers_mm);
  EXPECT_GT(*std::max_element(opening.begin() + 30, opening.begin() + 80) - opening.back(), 2);

  LiveStream text = speaker().live();
  const Sound first = text.say("my name is bob.");
  const double until = text.saidUntil();
  EXPECT_NEAR(until, first.duration(), 0.05);
  Pulled spoken;
  spoken.addAll(text);
  EXPECT_NEAR(static_cast<double>(spoken.frames) / 60, until, 0.02) << "a line said waits for nothing";
  for (int i = 0; i < 60; ++i) text.nextNow();  // a second in which nobody speaks
  text.say("and yours?");
  text.finish();
  EXPECT_GT(text.saidUntil(), until + 1);
}

/// A text's frames can be had before the first piece of its sound is; both are those of a text that is said whole.
TEST_F(Live, ATextIsSaidInPieces) {
  const char* const text = "my mother's friend bought a very big blue boat from bob, and it's here.";
  const LiveOptions options{.source = LiveOptions::Source::kText};
  LiveStream whole = speaker().live(options), parts = speaker().live(options);
  const Sound sound = whole.say(text);
  whole.finish();
  Pulled of_whole, of_parts;
  of_whole.addAll(whole);
  Sound joined{sound.sample_rate_hz, {}};
  std::size_t pieces = 0;
  parts.say(text, [&](Seconds begin, const Sound& piece) {
    if (pieces++ == 0) of_parts.addAll(parts);
    EXPECT_EQ(of_parts.frames, of_whole.frames) << "all are there with the first piece";
    EXPECT_NEAR(begin, joined.duration(), 1e-9);
    joined.samples.insert(joined.samples.end(), piece.samples.begin(), piece.samples.end());
  });
  parts.finish();
  of_parts.addAll(parts);
  EXPECT_GT(pieces, 10U);
  EXPECT_EQ(joined.samples, sound.samples);
  EXPECT_EQ(of_parts, of_whole);
}

TEST_F(Live, ALanguageIsSaidByItsVoice) {
  SpeakerOptions options = optionsOf(false);
  options.voice = SpeakerOptions().voice;
  options.language = "de";
  LiveStream stream = Speaker(options).live({.source = LiveOptions::Source::kText});
  EXPECT_GT(stream.say("guten Morgen").duration(), 0.5);
}

/// Utterance after utterance, each from the first frame on that was not made for the one before.
TEST_F(Live, TextsInPiecesFollowEachOther) {
  LiveStream stream = speaker().live({.source = LiveOptions::Source::kText});
  constexpr Seconds kTwoFrames = 2.0 / 60;
  Seconds sounded_until = 0;
  for (const char* text : {"my name is bob. and yours?", "Oh. No."}) {
    stream.say(text, [&](Seconds begin, const Sound& piece) {
      EXPECT_GE(begin, sounded_until - 1e-4);
      EXPECT_LE(begin, sounded_until + kTwoFrames);
      sounded_until = begin + piece.duration();
    });
    EXPECT_NEAR(stream.saidUntil(), sounded_until, kTwoFrames);
  }
  EXPECT_GT(sounded_until, 2);
  EXPECT_NE(errorOf([&] { stream.say("...", [](Seconds, const Sound&) {}); }).find("nothing to say"),
            std::string::npos);
  EXPECT_EQ(errorOf([&] { stream.say("hello", [](Seconds, const Sound&) { throw InputError("full"); }); }), "full");
  stream.say("and on we go", [&](Seconds begin, const Sound&) { EXPECT_GT(begin, sounded_until); });
  stream.finish();
}

TEST_F(Live, PhonesOfAWordShareItsTimeAsInTheCorpus) {
  const SharedCorpus corpus(kLiveShare / "sample.corpus");
  PhoneLengths lengths;
  const Corpus& own = corpus.data().corpus;
  for (std::size_t take = 0; take < takeCount(own); ++take) lengths.add(takeOf(own, TakeIndex(take)).labels);
  const std::array<Phone, 3> bob{Phone::kB, Phone::kAA, Phone::kB};
  const Seconds all = 2 * lengths.of(Phone::kB) + lengths.of(Phone::kAA);
  LiveStream phones = speaker().live(), words = speaker().live();
  Seconds start = 0.5;
  for (const Phone phone : bob) {
    const Seconds end = start + 0.4 * lengths.of(phone) / all;
    phones.push(LivePhone{phoneName(phone), {start, end}, 0});
    start = end;
  }
  words.push("bob", {0.5, 0.9});
  for (LiveStream* stream : {&phones, &words}) {
    stream->silence(1.5);
    stream->finish();
  }
  Pulled by_phones, by_words;
  by_phones.addAll(phones);
  by_words.addAll(words);
  ASSERT_EQ(by_words.frames, by_phones.frames);
  for (std::size_t i = 0; i < by_words.markers_mm.size(); ++i)
    ASSERT_NEAR(by_words.markers_mm[i], by_phones.markers_mm[i], 1e-6);
}

}  // namespace
}  // namespace mouthpiece
