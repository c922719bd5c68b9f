// Motion and sound as the corpus file packs them: the same again, smaller, and nothing else is taken for it.
#include "units/file/packed_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr float kUnseen = std::numeric_limits<float>::quiet_NaN();

/// Lips that move as in speech, with the noise that cleaning leaves, in whole steps of the file.
FloatMatrix smoothMotion(Eigen::Index frames, Eigen::Index columns) {
  std::mt19937 random(7);
  FloatMatrix positions(frames, columns);
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    for (Eigen::Index column = 0; column < columns; ++column) {
      const double wave = std::sin(2 * std::numbers::pi * 3 * asReal(frame) / 120 + asReal(column));
      const double noise = asReal(random() % 21) - 10;
      positions(frame, column) = asFloat(std::round(1024 * (5 * wave - 40) + noise) / 1024);
    }
  }
  return positions;
}

bool isSame(const FloatMatrix& a, const FloatMatrix& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         ((a.array() == b.array()) || (a.array().isNaN() && b.array().isNaN())).all();
}

TEST(PackedPositions, AreTheSameAgainAndSmaller) {
  FloatMatrix positions = smoothMotion(300, 12);
  positions.block(40, 3, 25, 3).setConstant(kUnseen);
  positions.block(0, 6, 10, 3).setConstant(kUnseen);
  const std::optional<std::string> packed = packedPositions(positions);
  ASSERT_TRUE(packed);
  EXPECT_LT(packed->size(), sizeof(float) * 300 * 12 / 3);
  const std::optional<FloatMatrix> again = unpackedPositions(*packed, 300, 12);
  ASSERT_TRUE(again);
  EXPECT_TRUE(isSame(positions, *again));
}

TEST(PackedPositions, TellWhichFramesWereNotWhollySeen) {
  FloatMatrix positions = smoothMotion(300, 12);
  positions.block(40, 3, 25, 3).setConstant(kUnseen);
  positions.block(299, 9, 1, 3).setConstant(kUnseen);
  const std::string packed = packedPositions(positions).value();
  const std::optional<std::vector<bool>> unseen = unpackedUnseen(packed, 300, 12);
  ASSERT_TRUE(unseen);
  ASSERT_EQ(unseen->size(), 300U);
  for (Eigen::Index frame = 0; frame < 300; ++frame)
    EXPECT_EQ((*unseen)[unsignedIndex(frame)], positions.row(frame).hasNaN()) << frame;
  EXPECT_FALSE(unpackedUnseen("", 300, 12));
  EXPECT_FALSE(unpackedUnseen(packed.substr(0, 8), 300, 12));
  EXPECT_FALSE(unpackedUnseen("no stream at all, but long enough for one", 300, 12));
  EXPECT_FALSE(unpackedUnseen(packed, 10'000'000, 300'000)) << "no memory for what it cannot hold";
}

TEST(PackedPositions, TellThatAllWasSeenOrThatOneMarkerWasNot) {
  const FloatMatrix positions = smoothMotion(300, 12);
  const std::vector<bool> none(300, false);
  EXPECT_EQ(unpackedUnseen(packedPositions(positions).value(), 300, 12), none);
  for (const Eigen::Index marker : {0, 1, 3}) {
    for (const Eigen::Index frame : {0, 1, 150, 299}) {
      FloatMatrix seen = positions;
      seen.block(frame, 3 * marker, 1, 3).setConstant(kUnseen);
      std::vector<bool> unseen = none;
      unseen[unsignedIndex(frame)] = true;
      EXPECT_EQ(unpackedUnseen(packedPositions(seen).value(), 300, 12), unseen) << marker << " in frame " << frame;
    }
  }
}

TEST(PackedPositions, ReachAsFarAsAPositionMay) {
  FloatMatrix positions = FloatMatrix::Zero(400, 3);
  positions(100, 0) = 1e7F;
  positions(101, 0) = -1e7F;
  positions(102, 0) = 1e7F;
  positions(103, 1) = -0x1.0p-10F;
  const std::optional<std::string> packed = packedPositions(positions);
  ASSERT_TRUE(packed);
  const std::optional<FloatMatrix> again = unpackedPositions(*packed, 400, 3);
  ASSERT_TRUE(again);
  EXPECT_TRUE(isSame(positions, *again));
}

TEST(PackedPositions, WhatLiesBetweenTheStepsStaysAsItIs) {
  FloatMatrix positions = smoothMotion(300, 12);
  positions(5, 5) += 0x1.0p-12F;
  EXPECT_FALSE(packedPositions(positions));
}

TEST(PackedPositions, NothingElseIsTakenForThem) {
  const FloatMatrix positions = smoothMotion(300, 12);
  const std::string packed = packedPositions(positions).value();
  EXPECT_FALSE(unpackedPositions(packed.substr(0, packed.size() - 1), 300, 12));
  EXPECT_FALSE(unpackedPositions(packed + "x", 300, 12));
  EXPECT_FALSE(unpackedPositions(packed, 299, 12));
  EXPECT_FALSE(unpackedPositions(packed, 300, 15));
  EXPECT_FALSE(unpackedPositions("", 300, 12));
  EXPECT_FALSE(unpackedPositions(packed, 10'000'000, 300'000)) << "no memory for what it cannot hold";
  for (std::size_t at = 0; at < packed.size(); at += 7) {
    std::string damaged = packed;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x40);
    const std::optional<FloatMatrix> read = unpackedPositions(damaged, 300, 12);
    // The first bytes tell the window and the level, the fifth to last has bits that nothing uses.
    EXPECT_FALSE(read && isSame(*read, positions) && at > 2 && at + 5 != packed.size()) << at;
  }
}

TEST(PackedSamples, AreTheSameAgainAndSmaller) {
  std::vector<std::int16_t> samples;
  for (int i = 0; i < 20000; ++i) samples.push_back(static_cast<std::int16_t>(9000 * std::sin(0.02 * i) + i % 5));
  samples[77] = -32768;
  samples[78] = 32767;
  const std::optional<std::string> packed = packedSamples(samples);
  ASSERT_TRUE(packed);
  EXPECT_LT(packed->size(), samples.size());
  const std::optional<std::vector<float>> again = unpackedSamples(*packed, samples.size());
  ASSERT_TRUE(again);
  for (std::size_t i = 0; i < samples.size(); ++i)
    ASSERT_EQ((*again)[i], static_cast<float>(samples[i]) / 32768.0F) << i;
  EXPECT_FALSE(unpackedSamples(*packed, samples.size() - 1));
  EXPECT_FALSE(unpackedSamples(packed->substr(0, packed->size() / 2), samples.size()));
  EXPECT_FALSE(unpackedSamples("RIFF", samples.size()));
  EXPECT_FALSE(packedSamples({}));
  EXPECT_FALSE(packedSamples({1, 2, 3})) << "smaller as it is";
}

}  // namespace
}  // namespace mouthpiece
