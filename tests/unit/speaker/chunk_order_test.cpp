// Chunks of sound as a network brings them, against a plain model of what was heard and when.
#include "speaker/live_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "base/errors.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

constexpr int kRateHz = 100;  // small, so that seconds are short

/// What comes out: a sample a number, the place it was sent with; -1 for silence.
struct Heard {
  std::vector<int> samples;
  LiveCounts counts;
  ChunkOrder order{kRateHz};

  void chunk(std::uint64_t at, std::size_t count) {
    const ChunkOrder::Place place = order.place(at, count, counts);
    ASSERT_LE(place.skipped, count);
    samples.insert(samples.end(), place.silence, -1);
    for (std::size_t i = place.skipped; i < count; ++i) samples.push_back(static_cast<int>(at + i));
  }
};

TEST(ChunkOrder, InOrderAllIsHeardOnce) {
  std::mt19937 random(1);
  Heard heard;
  for (std::uint64_t at = 0; at < 500;) {
    const std::size_t count = random() % 12;
    heard.chunk(at, count);
    at += count;
  }
  for (std::size_t i = 0; i < heard.samples.size(); ++i) ASSERT_EQ(heard.samples[i], static_cast<int>(i));
  EXPECT_EQ(heard.counts.dropped + heard.counts.late + heard.counts.doubled + heard.counts.restarts, 0U);
  EXPECT_EQ(heard.counts.missing, 0);
}

/// Lost, doubled, late, overlapping: as long as the clock is right a sample is heard at its own place or not at all.
TEST(ChunkOrder, WhateverTheNetworkDoesASampleIsAtItsPlaceOrMissing) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    struct Chunk {
      std::uint64_t at;
      std::size_t count;
    };
    std::vector<Chunk> sent, arriving;
    for (std::uint64_t at = 0; at < 900;) {
      const std::size_t count = 1 + random() % 20;
      sent.push_back({at, count});
      at += count;
    }
    std::size_t late_in_a_row = 0;
    for (std::size_t i = 0; i < sent.size(); ++i) {
      if (random() % 8 == 0) continue;  // lost
      arriving.push_back(sent[i]);
      if (random() % 10 == 0) arriving.push_back(sent[i]);
      if (random() % 10 == 0 && i > 0 && late_in_a_row == 0) {
        arriving.push_back(sent[i - 1 - random() % std::min<std::size_t>(i, 3)]);  // an old one, again or late
      }
    }
    Heard heard;
    double missing = 0;
    for (const Chunk& chunk : arriving) {
      const std::size_t before = heard.samples.size();
      heard.chunk(chunk.at, chunk.count);
      for (std::size_t i = before; i < heard.samples.size(); ++i) {
        ASSERT_TRUE(heard.samples[i] == -1 || heard.samples[i] == static_cast<int>(i)) << i;
        missing += heard.samples[i] == -1 ? 1 : 0;
      }
      ASSERT_GE(heard.samples.size(), chunk.at + chunk.count) << "what came is behind us now";
    }
    EXPECT_NEAR(heard.counts.missing, missing / kRateHz, 1e-9);
    EXPECT_EQ(heard.counts.restarts, 0U);
    EXPECT_GT(heard.counts.dropped, 0U);
    // A sample that came before anything later did is heard.
    std::vector<bool> came(1000, false);
    std::uint64_t furthest = 0;
    for (const Chunk& chunk : arriving) {
      if (chunk.at >= furthest) std::fill_n(came.begin() + static_cast<std::ptrdiff_t>(chunk.at), chunk.count, true);
      furthest = std::max(furthest, chunk.at + chunk.count);
    }
    for (std::size_t i = 0; i < heard.samples.size(); ++i) {
      if (came[i]) {
        EXPECT_EQ(heard.samples[i], static_cast<int>(i));
      }
    }
  }
}

TEST(ChunkOrder, CountsLateAndDoubledApart) {
  Heard heard;
  heard.chunk(0, 10);
  heard.chunk(20, 10);  // 10 to 20 are missing
  EXPECT_EQ(heard.counts.dropped, 1U);
  EXPECT_NEAR(heard.counts.missing, 0.1, 1e-12);
  heard.chunk(10, 10);
  EXPECT_EQ(heard.counts.late, 1U);
  EXPECT_EQ(heard.counts.doubled, 0U);
  heard.chunk(0, 10);
  heard.chunk(20, 10);
  EXPECT_EQ(heard.counts.late, 1U);
  EXPECT_EQ(heard.counts.doubled, 2U);
  heard.chunk(25, 10);  // half of it is new
  EXPECT_EQ(heard.counts.doubled, 2U);
  EXPECT_EQ(heard.samples.size(), 35U);
  EXPECT_EQ(heard.samples.back(), 34);
  // What was shown without its sound is late when it comes.
  heard.order.passOver(5);
  heard.chunk(35, 5);
  EXPECT_EQ(heard.counts.late, 2U);
  EXPECT_EQ(heard.samples.size(), 35U);
  heard.chunk(3, 0);
  EXPECT_EQ(heard.counts.late + heard.counts.doubled, 4U) << "nothing tells nothing";
}

/// A sender that was held up goes on where its clock stood: after a second of it his clock is moved, and all is heard.
TEST(ChunkOrder, ASenderThatStoodStillIsHeardAgainWithinASecond) {
  for (const std::size_t length : {5U, 10U, 40U}) {
    Heard heard;
    heard.chunk(0, 100);
    heard.order.passOver(500);  // five seconds went by
    std::uint64_t at = 100;
    std::size_t unheard = 0;
    while (heard.counts.restarts == 0 && unheard < 1000) {
      const std::size_t before = heard.samples.size();
      heard.chunk(at, length);
      if (heard.samples.size() == before) unheard += length;
      at += length;
    }
    EXPECT_EQ(heard.counts.restarts, 1U);
    EXPECT_LE(unheard, static_cast<std::size_t>(kRateHz));
    EXPECT_GT(unheard + length, static_cast<std::size_t>(kRateHz)) << "not before";
    EXPECT_EQ(heard.samples.back(), static_cast<int>(at - 1)) << "the chunk that moved the clock is heard";
    const std::size_t before = heard.samples.size();
    for (int i = 0; i < 20; ++i, at += length) heard.chunk(at, length);
    EXPECT_EQ(heard.samples.size(), before + 20 * length) << "and all that follows";
    EXPECT_EQ(heard.counts.restarts, 1U);
  }
}

TEST(ChunkOrder, RefusesWhatIsFarAheadInOneLine) {
  Heard heard;
  heard.chunk(0, 10);
  EXPECT_EQ(errorOf([&] { heard.chunk(1011, 5); }),
            "found a chunk of sound 10.0 s ahead of what came before; expected at most 10 s");
  EXPECT_EQ(heard.samples.size(), 10U) << "and nothing is changed by it";
  heard.chunk(1010, 5);  // just ten seconds
  EXPECT_EQ(heard.samples.size(), 1015U);
  EXPECT_NE(errorOf([&] { heard.chunk(~std::uint64_t{0}, 1); }).find("expected places that rise"), std::string::npos);
}

TEST(ChunkOrder, WhatIsALittleAheadMayWait) {
  Heard heard;
  heard.chunk(0, 10);
  EXPECT_FALSE(heard.order.isAhead(10));
  EXPECT_FALSE(heard.order.mayWait(10, 5)) << "it follows";
  EXPECT_TRUE(heard.order.mayWait(15, 5));
  EXPECT_FALSE(heard.order.mayWait(15, 6)) << "over a tenth of a second";
  EXPECT_FALSE(heard.order.mayWait(~std::uint64_t{0}, 5));
  EXPECT_FALSE(heard.order.mayWait(5, 5)) << "it was there";
}

}  // namespace
}  // namespace mouthpiece
