// A stream's chunks, frames, threads and what goes wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include "mouthpiece/mouthpiece.h"
#include "support/allocations.h"
#include "support/error_of.h"
#include "support/live_fixture.h"

namespace mouthpiece {
namespace {

TEST_F(Live, ChunksOfAnySizeGiveTheSameBytes) {
  const Pulled whole = heardInChunks([] { return std::numeric_limits<std::size_t>::max(); });
  EXPECT_EQ(whole.frames, line().frameCount());
  EXPECT_TRUE(whole == heardInChunks([] { return 160U; }));
  EXPECT_TRUE(whole == heardInChunks([] { return 1U; }));
  std::mt19937 random(3);
  EXPECT_TRUE(whole == heardInChunks([&] { return 1 + random() % 3000; }));
}

/// All of a stream of the line said twice, in chunks of `chunk` samples.
Pulled withExpression(const SpeakerOptions& options, const std::vector<float>& sound, std::size_t chunk) {
  Speaker speaker(options);
  LiveStream stream = speaker.live();
  Pulled pulled;
  for (int again = 0; again < 2; ++again) {
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
  options.manner.seed = 4;
  const Pulled made = withExpression(options, sound(), 700);
  EXPECT_EQ(made, withExpression(options, sound(), 16001)) << "the chunks do not matter";
  EXPECT_GT(most(made, shape("EyeBlinkLeft")), 0.7F);
  EXPECT_GT(most(made, shape("EyeLookOutLeft")) + most(made, shape("EyeLookInLeft")), 0.05F);
  EXPECT_EQ(openings(made.markers_mm), openings(plain.markers_mm)) << "the mouth is as it was";
  options.manner.seed = 5;
  EXPECT_NE(made, withExpression(options, sound(), 700));
}

TEST_F(Live, WhatNeedsTheWholeLineIsRefused) {
  for (const auto& ask : std::vector<std::function<void(Manner&)>>{
           [](Manner& manner) { manner.upper_face = Manner::UpperFace::kCaptured; },
           [](Manner& manner) { manner.head_motion = true; }, [](Manner& manner) { manner.mood = "joy"; },
           [](Manner& manner) { manner.strength.constant = 2; }, [](Manner& manner) { manner.jaw.constant = 0; },
           [](Manner& manner) { manner.lips.constant = 0; }, [](Manner& manner) { manner.hold.constant = 1; },
           [](Manner& manner) { manner.lead_ms.constant = 80; }, [](Manner& manner) { manner.smooth_ms.constant = 40; },
           [](Manner& manner) { manner.ja.constant = 2; }, [](Manner& manner) { manner.li.constant = 2; },
           [](Manner& manner) { manner.ma.constant = 1; }}) {
    SpeakerOptions options = optionsOf(false);
    ask(options.manner);
    Speaker speaker(options);
    EXPECT_NE(errorOf([&] { static_cast<void>(speaker.live()); }).find("for a stream"), std::string::npos);
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

/// A network may hand on one packet before the one that was sent before it: what is heard is the same.
TEST_F(Live, ChunksThatChangePlacesAreHeardInOrder) {
  constexpr std::size_t kChunk = 320;
  const auto pulled = [&](bool swapped) {
    LiveStream stream = speaker().live();
    const std::span<const float> all(sound());
    const std::size_t chunks = all.size() / kChunk;
    for (std::size_t i = 0; i < chunks; ++i) {
      const std::size_t chunk = swapped && i % 2 == 1 && i + 1 < chunks ? i + 1
                                : swapped && i % 2 == 0 && i > 0        ? i - 1
                                                                        : i;
      stream.push(all.subspan(chunk * kChunk, kChunk), chunk * kChunk);
    }
    stream.finish();
    EXPECT_EQ(stream.counts().chunks, chunks);
    EXPECT_EQ(stream.counts().dropped + stream.counts().late + stream.counts().doubled, 0U) << swapped;
    Pulled all_frames;
    all_frames.addAll(stream);
    return all_frames;
  };
  EXPECT_EQ(pulled(true), pulled(false));
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
    EXPECT_EQ(mouthpiece_live_push_phone(live, "", 0.8, 0.9, error, sizeof error), MOUTHPIECE_BAD_INPUT);
    EXPECT_EQ(mouthpiece_live_push_phone(live, "AA", 0.8, 1e300, error, sizeof error), MOUTHPIECE_BAD_INPUT);
    EXPECT_NE(std::string(error).find("before 31536000 s"), std::string::npos) << error;
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
  mouthpiece_live_options_init(&wanted);
  wanted.source = MOUTHPIECE_LIVE_TEXT;
  ASSERT_EQ(mouthpiece_live_open(speaking, &wanted, &live, error, sizeof error), MOUTHPIECE_OK) << error;
  std::vector<float> joined;
  const auto take = [](void* context, double, const float* samples, size_t count, int) {
    auto& all = *static_cast<std::vector<float>*>(context);
    all.insert(all.end(), samples, samples + count);
  };
  ASSERT_EQ(mouthpiece_live_say_in_pieces(live, "hello bob", take, &joined, error, sizeof error), MOUTHPIECE_OK);
  const float* samples = nullptr;
  std::size_t sample_count = 0;
  ASSERT_EQ(mouthpiece_live_say(live, "hello bob", &samples, &sample_count, nullptr, error, sizeof error),
            MOUTHPIECE_OK);
  EXPECT_EQ(joined, std::vector<float>(samples, samples + sample_count));
  EXPECT_EQ(mouthpiece_live_say_in_pieces(live, nullptr, take, nullptr, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  mouthpiece_live_free(live);
  ASSERT_EQ(mouthpiece_live_new(speaking, 0.2, 16000, &live, error, sizeof error), MOUTHPIECE_OK) << error;
  mouthpiece_speaker_free(speaking);
  EXPECT_EQ(mouthpiece_live_push_float(live, nullptr, 5, MOUTHPIECE_FOLLOWS, error, sizeof error),
            MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(mouthpiece_live_push_float(live, sound().data(), SIZE_MAX, 0, error, sizeof error), MOUTHPIECE_BAD_INPUT);
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
