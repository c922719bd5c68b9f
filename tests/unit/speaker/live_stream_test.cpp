// A line followed while it is being said, with the sample corpus.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include "mouthpiece/mouthpiece.h"
#include "mouthpiece/speaker.h"
#include "phonetics/labels/phone_lengths.h"
#include "speaker/speaker_data.h"
#include "support/allocations.h"
#include "support/error_of.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
const fs::path kLiveShare = MOUTHPIECE_BUILD_SHARE_DIR;

/// Frames as they came, copied.
struct Pulled {
  std::vector<double> markers_mm;
  std::vector<float> arkit;
  std::size_t frames = 0;

  void add(const Frame& frame) {
    EXPECT_EQ(frame.index, frames++);
    markers_mm.insert(markers_mm.end(), frame.markers_mm.begin(), frame.markers_mm.end());
    arkit.insert(arkit.end(), frame.arkit.begin(), frame.arkit.end());
  }
  void addAll(LiveStream& stream) {
    while (const Frame* frame = stream.next()) add(*frame);
  }
  bool operator==(const Pulled&) const = default;
};

class Live : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kLiveShare / "default.face"))
      GTEST_SKIP() << "no sample corpus in " << kLiveShare << ": run `make data`";
  }
  static Speaker& speaker() {
    static Speaker shared(optionsOf(false));
    return shared;
  }
  static SpeakerOptions optionsOf(bool with_face) {
    SpeakerOptions options;
    options.corpus = kLiveShare / "sample.corpus";
    options.face = kLiveShare / "default.face";
    options.with_face = with_face;
    options.voice = "flite:slt";
    return options;
  }
  static const Performance& line() {
    static const Performance said = speaker().perform("my mother bought a very big blue boat from bob");
    return said;
  }
  static const std::vector<float>& sound() {
    EXPECT_EQ(line().sound().sample_rate_hz, 16000);
    return line().sound().samples;
  }
  static Pulled heardInChunks(const std::function<std::size_t()>& size) {
    LiveStream stream = speaker().live();
    Pulled pulled;
    for (std::size_t at = 0; at < sound().size();) {
      const std::size_t count = std::min(size(), sound().size() - at);
      stream.push(std::span(sound()).subspan(at, count));
      pulled.addAll(stream);
      at += count;
    }
    stream.finish();
    pulled.addAll(stream);
    EXPECT_TRUE(stream.isFinished());
    return pulled;
  }
  static void pushLabels(LiveStream& stream, Pulled& pulled) {
    for (const PhoneLabel& phone : line().labels().phones) {
      stream.push(LivePhone{phone.phone, phone.span, phone.word});
      pulled.addAll(stream);
    }
    stream.finish();
    pulled.addAll(stream);
  }
  /// LIP_UP_MID to LIP_LO_MID.
  static std::vector<double> openings(const std::vector<double>& markers_mm) {
    const std::vector<std::string>& names = line().motion().marker_names;
    const auto at = [&](const char* name) {
      return 3 * static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    const std::size_t upper = at("LIP_UP_MID"), lower = at("LIP_LO_MID");
    std::vector<double> opening;
    for (std::size_t row = 0; row < markers_mm.size(); row += 3 * names.size()) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) sum += std::pow(markers_mm[row + upper + k] - markers_mm[row + lower + k], 2);
      opening.push_back(std::sqrt(sum));
    }
    return opening;
  }
  static double correlation(const std::vector<double>& a, const std::vector<double>& b) {
    const std::size_t n = std::min(a.size(), b.size());
    double mean_a = 0, mean_b = 0, ab = 0, aa = 0, bb = 0;
    for (std::size_t i = 0; i < n; ++i) {
      mean_a += a[i] / static_cast<double>(n);
      mean_b += b[i] / static_cast<double>(n);
    }
    for (std::size_t i = 0; i < n; ++i) {
      ab += (a[i] - mean_a) * (b[i] - mean_b);
      aa += (a[i] - mean_a) * (a[i] - mean_a);
      bb += (b[i] - mean_b) * (b[i] - mean_b);
    }
    return ab / std::sqrt(aa * bb);
  }
};

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

TEST_F(Live, ChunksOfAnySizeGiveTheSameBytes) {
  const Pulled whole = heardInChunks([] { return std::numeric_limits<std::size_t>::max(); });
  EXPECT_EQ(whole.frames, line().frameCount());
  EXPECT_TRUE(whole == heardInChunks([] { return 160U; }));
  EXPECT_TRUE(whole == heardInChunks([] { return 1U; }));
  std::mt19937 random(3);
  EXPECT_TRUE(whole == heardInChunks([&] { return 1 + random() % 3000; }));
}

/// All of a stream of four times the line, in chunks of `chunk` samples.
Pulled withExpression(const SpeakerOptions& options, const std::vector<float>& sound, std::size_t chunk) {
  Speaker speaker(options);
  LiveStream stream = speaker.live();
  Pulled pulled;
  for (int again = 0; again < 4; ++again) {
    for (std::size_t at = 0; at < sound.size(); at += chunk) {
      stream.push(std::span(sound).subspan(at, std::min(chunk, sound.size() - at)));
      pulled.addAll(stream);
    }
  }
  stream.finish();
  pulled.addAll(stream);
  return pulled;
}

/// The largest weight of a shape.
float most(const Pulled& pulled, std::size_t shape) {
  float largest = 0;
  for (std::size_t i = shape; i < pulled.arkit.size(); i += kArkitShapes) largest = std::max(largest, pulled.arkit[i]);
  return largest;
}

TEST_F(Live, EyesBlinkAndLookByTheSeedAlone) {
  const auto shape = [](const char* name) {
    for (std::size_t i = 0; i < kArkitShapes; ++i) {
      if (arkitName(i) == name) return i;
    }
    throw std::logic_error(name);
  };
  SpeakerOptions options = optionsOf(false);
  const Pulled plain = withExpression(options, sound(), 700);
  EXPECT_EQ(most(plain, shape("EyeLookOutLeft")), 0);
  options.manner.upper_face = Manner::UpperFace::kRules;
  options.manner.gaze = true;
  options.manner.seed = 3;
  const Pulled made = withExpression(options, sound(), 700);
  EXPECT_EQ(made, withExpression(options, sound(), 16001)) << "the chunks do not matter";
  EXPECT_GT(most(made, shape("EyeBlinkLeft")), 0.7F);
  EXPECT_GT(most(made, shape("EyeLookOutLeft")) + most(made, shape("EyeLookInLeft")), 0.05F);
  EXPECT_EQ(openings(made.markers_mm), openings(plain.markers_mm)) << "the mouth is as it was";
  options.manner.seed = 4;
  EXPECT_NE(made, withExpression(options, sound(), 700));
}

TEST_F(Live, WhatNeedsTheWholeLineIsRefused) {
  for (const auto& ask : std::vector<std::function<void(Manner&)>>{
           [](Manner& manner) { manner.upper_face = Manner::UpperFace::kCaptured; },
           [](Manner& manner) { manner.head_motion = true; }, [](Manner& manner) { manner.mood = "joy"; }}) {
    SpeakerOptions options = optionsOf(false);
    ask(options.manner);
    Speaker speaker(options);
    EXPECT_NE(errorOf([&] { static_cast<void>(speaker.live()); }).find("for a stream"), std::string::npos);
  }
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

TEST_F(Live, HearsWordsASecondAheadUnlessPhonesAreWanted) {
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
  const Pulled by_words = heardBy(SpeakerOptions::Hear::kAuto), by_phones = heardBy(SpeakerOptions::Hear::kPhones);
  EXPECT_EQ(by_words.frames, by_phones.frames);
  EXPECT_NE(by_words, by_phones);
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
  double squares = 0;
  const std::size_t both = std::min(whole.size(), pulled.markers_mm.size());
  for (std::size_t i = 0; i < both; ++i) squares += std::pow(pulled.markers_mm[i] - whole[i], 2);
  EXPECT_LT(std::sqrt(3 * squares / static_cast<double>(both)), 0.1);
  EXPECT_GT(correlation(openings(pulled.markers_mm), openings(whole)), 0.995);
}

TEST_F(Live, WithTheUsualLookAheadItIsNearAndLipsThatTouchDo) {
  LiveStream stream = speaker().live();
  Pulled pulled;
  pushLabels(stream, pulled);
  const std::vector<double> live = openings(pulled.markers_mm), whole = openings(line().motion().positions_mm);
  EXPECT_GT(correlation(live, whole), 0.9);
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

TEST_F(Live, PullingAllocatesNothingAfterTheFirstFrame) {
  const Speaker with_face(optionsOf(true));
  LiveStream stream = with_face.live();
  stream.push(std::span(sound()).first(sound().size() / 2));
  ASSERT_NE(stream.next(), nullptr);
  std::size_t frames = 0;
  EXPECT_EQ(test::allocationsIn([&] {
              while (stream.next() != nullptr) ++frames;
            }),
            0U);
  EXPECT_GT(frames, 30U);
  EXPECT_EQ(test::allocationsIn([&] {
              for (int i = 0; i < 30; ++i) ASSERT_FALSE(stream.nextNow()->vertices.empty());
            }),
            0U);
  EXPECT_GT(test::allocationsIn([&] { stream.push(std::span(sound()).last(1600)); }), 0U) << "the counter counts";
}

TEST_F(Live, AStalledStreamComesToRestAndGoesOn) {
  LiveStream stream = speaker().live();
  stream.push(std::span(sound()).first(sound().size() / 2));
  while (stream.next() != nullptr) {
  }
  const Frame* frame = nullptr;
  std::vector<double> before;
  for (int i = 0; i < 60; ++i) {
    frame = stream.nextNow();
    ASSERT_NE(frame, nullptr);
    if (!before.empty()) {
      for (std::size_t k = 0; k < before.size(); ++k) ASSERT_LT(std::abs(frame->markers_mm[k] - before[k]), 2.5);
    }
    before.assign(frame->markers_mm.begin(), frame->markers_mm.end());
  }
  LiveStream silent = speaker().live();
  const Frame* rest = silent.nextNow();
  for (std::size_t k = 0; k < before.size(); ++k) EXPECT_NEAR(before[k], rest->markers_mm[k], 1e-9);
  EXPECT_EQ(stream.counts().frames_at_rest, 60U);
  // What follows is said after the pause, all of it.
  stream.push(std::span(sound()).subspan(sound().size() / 2));
  stream.finish();
  double widest = 0;
  std::size_t frames = 0;
  while ((frame = stream.next()) != nullptr) {
    ++frames;
    for (std::size_t k = 0; k < before.size(); ++k)
      widest = std::max(widest, std::abs(frame->markers_mm[k] - before[k]));
  }
  EXPECT_GT(widest, 3);
  EXPECT_GT(frames, line().frameCount() / 2 - 20);
}

TEST_F(Live, LostDoubledAndLateChunksAreCounted) {
  LiveStream stream = speaker().live();
  const std::span<const float> all(sound());
  constexpr std::size_t kChunk = 1600;
  const auto push = [&](std::size_t chunk) { stream.push(all.subspan(chunk * kChunk, kChunk), chunk * kChunk); };
  push(0);
  push(1);
  push(1);  // twice
  push(3);  // 2 is lost
  push(2);  // and comes too late
  push(4);
  LiveCounts counts = stream.counts();
  EXPECT_EQ(counts.chunks, 6U);
  EXPECT_EQ(counts.doubled, 1U);
  EXPECT_EQ(counts.dropped, 1U);
  EXPECT_EQ(counts.late, 1U);
  EXPECT_NEAR(counts.missing, 0.1, 1e-9);
  EXPECT_EQ(errorOf([&] { stream.push(all.first(10), 1'000'000'000); }),
            "found a chunk of sound 62499.5 s ahead of what came before; expected at most 10 s");
  EXPECT_NE(errorOf([&] { stream.push(all.first(10), std::numeric_limits<std::uint64_t>::max()); }), "no error");
  // Half of a chunk is new.
  stream.push(all.subspan(5 * kChunk - kChunk / 2, kChunk), 5 * kChunk - kChunk / 2);
  stream.finish();
  Pulled pulled;
  pulled.addAll(stream);
  EXPECT_EQ(pulled.frames, static_cast<std::size_t>(std::ceil(5.5 * 0.1 * 60)));
}

TEST_F(Live, ASenderWhoseClockStoodStillIsHeardAgain) {
  LiveStream stream = speaker().live();
  const std::vector<float> chunk(1600, 0.01F);
  stream.push(chunk, 0);
  for (int i = 0; i < 180; ++i) stream.nextNow();  // three seconds without it
  std::uint64_t at = 1600;
  for (int i = 0; i < 30; ++i, at += 1600) stream.push(chunk, at);
  const LiveCounts counts = stream.counts();
  EXPECT_EQ(counts.restarts, 1U);
  EXPECT_LE(counts.late, 12U);
  EXPECT_GE(counts.late, 9U);
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

TEST_F(Live, BadInputIsRefusedOrCounted) {
  EXPECT_NE(errorOf([&] { (void)speaker().live({.look_ahead = 0.01}); }), "no error");
  EXPECT_NE(errorOf([&] { (void)speaker().live({.look_ahead = std::nan("")}); }), "no error");
  EXPECT_EQ(errorOf([&] { (void)speaker().live({.look_ahead = 0.2, .sample_rate_hz = 8000}); }),
            "found sound at 8000 Hz; expected 16,000 to 48,000 Hz");
  SpeakerOptions curves = optionsOf(false);
  curves.manner.method = Manner::Method::kCurves;
  EXPECT_NE(errorOf([&] { (void)Speaker(curves).live(); }), "no error");

  LiveStream labels = speaker().live();
  EXPECT_EQ(errorOf([&] {
              labels.push(LivePhone{"QQQ", {0, 1}});
            }),
            "found the phone 'QQQ'; expected ARPAbet, IPA or sil");
  EXPECT_NE(errorOf([&] { labels.push(LivePhone{"AA", {1, 1}}); }), "no error");
  EXPECT_NE(errorOf([&] { labels.push(LivePhone{"AA", {std::nan(""), 1}}); }), "no error");
  EXPECT_NE(errorOf([&] { labels.push(LivePhone{"AA", {0, 1e300}}); }), "no error");
  labels.push(LivePhone{"AA", {0, 0.1}});
  labels.push(LivePhone{"AA", {0, 0.1}});
  EXPECT_EQ(labels.counts().doubled, 1U);
  EXPECT_NE(errorOf([&] { labels.push(std::span(sound())); }), "no error");
  labels.finish();
  labels.finish();
  EXPECT_NE(errorOf([&] { labels.push(LivePhone{"AA", {0.1, 0.2}}); }), "no error");

  LiveStream noise = speaker().live();
  std::mt19937 random(5);
  std::vector<float> samples(32000);
  for (float& sample : samples) {
    const auto kind = random() % 50;
    sample = kind == 0   ? std::numeric_limits<float>::quiet_NaN()
             : kind == 1 ? std::numeric_limits<float>::infinity()
             : kind == 2 ? -1e30F
                         : static_cast<float>(random() % 2001) / 1000 - 1;
  }
  noise.push(samples);
  noise.finish();
  EXPECT_GT(noise.counts().unusable_samples, 1000U);
  while (const Frame* frame = noise.next()) {
    for (const double mm : frame->markers_mm) ASSERT_LT(std::abs(mm), 200);
    for (const float weight : frame->arkit) ASSERT_TRUE(weight >= 0 && weight <= 1);
  }
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

TEST_F(Live, OneThreadPushesWhileAnotherPulls) {
  LiveStream stream = speaker().live();
  std::thread pushing([&] {
    for (std::size_t at = 0; at < sound().size(); at += 640)
      stream.push(std::span(sound()).subspan(at, std::min<std::size_t>(640, sound().size() - at)));
    stream.finish();
  });
  Pulled pulled;
  while (!stream.isFinished()) {
    pulled.addAll(stream);
    std::this_thread::yield();
  }
  pushing.join();
  EXPECT_TRUE(pulled == heardInChunks([] { return 640U; }));
}

TEST_F(Live, APacketIsThatOfLiveLinkFace) {
  Frame frame;
  frame.index = 258;
  frame.arkit[17] = 0.5F;
  const std::string packet = liveLinkPacket(frame, 60, "Bob");
  ASSERT_EQ(packet.size(), 4U + 37 + 4 + 3 + 17 + 4 * 61);
  EXPECT_EQ(packet.substr(0, 5), std::string("\x06\0\0\0$", 5));
  EXPECT_EQ(packet.substr(41, 7), std::string("\0\0\0\x03"
                                              "Bob",
                                              7));
  EXPECT_EQ(packet.substr(48, 17), std::string("\0\0\x01\x02"
                                               "\0\0\0\0"
                                               "\0\0\0\x3C"
                                               "\0\0\0\x01"
                                               "\x3D",
                                               17));
  EXPECT_EQ(packet.substr(65 + 4 * 17, 4), std::string("\x3F\0\0\0", 4)) << "big-endian 0.5 for JawOpen";
  EXPECT_EQ(liveLinkPacket(frame, 60, std::string(1000, 'x')).size(), packet.size() + 61);
}

TEST_F(Live, CStreamsToo) {
  char error[200] = "";
  mouthpiece_options options;
  mouthpiece_options_init(&options);
  const std::string corpus = (kLiveShare / "sample.corpus").string();
  options.corpus = corpus.c_str();
  options.with_face = 0;
  options.voice = "flite:slt";
  mouthpiece_speaker* speaking = nullptr;
  ASSERT_EQ(mouthpiece_speaker_new(&options, &speaking, error, sizeof error), MOUTHPIECE_OK) << error;
  mouthpiece_live* live = nullptr;
  EXPECT_EQ(mouthpiece_live_new(speaking, 0.001, 16000, &live, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  mouthpiece_live_options wanted;
  mouthpiece_live_options_init(&wanted);
  wanted.source = 7;
  EXPECT_EQ(mouthpiece_live_open(speaking, &wanted, &live, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  wanted.source = MOUTHPIECE_LIVE_LABELS;
  wanted.size = 1;
  EXPECT_EQ(mouthpiece_live_open(speaking, &wanted, &live, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  mouthpiece_frame frame;
  for (const int arkit : {0, 1}) {
    mouthpiece_live_options_init(&wanted);
    wanted.source = MOUTHPIECE_LIVE_LABELS;
    wanted.arkit = arkit;
    ASSERT_EQ(mouthpiece_live_open(speaking, &wanted, &live, error, sizeof error), MOUTHPIECE_OK) << error;
    ASSERT_EQ(mouthpiece_live_push_phone(live, "AA", 0.1, 0.8, error, sizeof error), MOUTHPIECE_OK) << error;
    float most = 0;
    for (int has_frame = 1; has_frame != 0;) {
      ASSERT_EQ(mouthpiece_live_next(live, 0, &frame, &has_frame, error, sizeof error), MOUTHPIECE_OK);
      if (has_frame != 0) most = std::max(most, *std::max_element(std::begin(frame.arkit), std::end(frame.arkit)));
    }
    EXPECT_EQ(most > 0, arkit != 0) << most;
    EXPECT_EQ(mouthpiece_live_words_missed(live), 0U);
    mouthpiece_live_free(live);
  }
  EXPECT_EQ(mouthpiece_live_words_missed(nullptr), 0U);
  ASSERT_EQ(mouthpiece_live_new(speaking, 0.2, 16000, &live, error, sizeof error), MOUTHPIECE_OK) << error;
  mouthpiece_speaker_free(speaking);
  EXPECT_EQ(mouthpiece_live_push_float(live, nullptr, 5, MOUTHPIECE_FOLLOWS, error, sizeof error),
            MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(mouthpiece_live_push_float(live, sound().data(), sound().size(), 0, error, sizeof error), MOUTHPIECE_OK);
  int has_frame = 0;
  std::size_t frames = 0;
  do {
    ASSERT_EQ(mouthpiece_live_next(live, 0, &frame, &has_frame, error, sizeof error), MOUTHPIECE_OK);
    frames += has_frame != 0 ? 1U : 0U;
  } while (has_frame != 0);
  EXPECT_GT(frames, 60U);
  EXPECT_EQ(mouthpiece_live_next(live, 1, &frame, &has_frame, error, sizeof error), MOUTHPIECE_OK);
  EXPECT_EQ(has_frame, 1);
  EXPECT_EQ(mouthpiece_live_push_phone(live, "AA", 0, 1, error, sizeof error), MOUTHPIECE_BAD_INPUT) << "sound it is";
  EXPECT_EQ(mouthpiece_live_finish(live, error, sizeof error), MOUTHPIECE_OK);
  EXPECT_EQ(mouthpiece_live_is_finished(live), 0);
  mouthpiece_live_counts counts;
  mouthpiece_live_counts_of(live, &counts);
  EXPECT_EQ(counts.frames, frames + 1);
  EXPECT_EQ(counts.frames_at_rest, 1U);
  mouthpiece_live_free(live);
  mouthpiece_live_free(nullptr);
}

}  // namespace
}  // namespace mouthpiece
