#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "base/errors.h"
#include "base/files.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_file.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

MotionClip clipWithGap(std::size_t marker_count, std::size_t frame_count) {
  MotionClip clip = SyntheticMotion(21, marker_count).clip(120.0, frame_count);
  clip.positions_mm.block(frame_count > 2 ? 1 : 0, 0, 1, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  return clip;
}

TEST(C3dWriter, WriteReadWriteIsByteIdentical) {
  for (const std::size_t markers : {1U, 66U, 73U, 300U, 1000U}) {
    const std::string once = writeC3dBytes(clipWithGap(markers, 25));
    const MotionClip back = readC3dBytes(once, "once.c3d");
    EXPECT_EQ(back.markerCount(), markers);
    EXPECT_EQ(writeC3dBytes(back), once) << markers << " markers";
  }
}

TEST(C3dWriter, KeepsPositionsAsFloatsAndGapsAsGaps) {
  const MotionClip clip = clipWithGap(66, 40);
  const MotionClip back = readC3dBytes(writeC3dBytes(clip), "back.c3d");
  EXPECT_EQ(back.marker_names, clip.marker_names);
  EXPECT_EQ(back.frame_rate_hz, 120.0);
  ASSERT_EQ(back.frameCount(), 40U);
  for (Eigen::Index i = 0; i < clip.positions_mm.size(); ++i) {
    const double value = clip.positions_mm.data()[i];
    if (std::isnan(value)) {
      EXPECT_TRUE(std::isnan(back.positions_mm.data()[i]));
    } else {
      EXPECT_EQ(back.positions_mm.data()[i], static_cast<double>(static_cast<float>(value)));
    }
  }
}

TEST(C3dWriter, WritesOneFrame) {
  const MotionClip clip = SyntheticMotion(22, 3).clip(100.0, 1);
  EXPECT_EQ(readC3dBytes(writeC3dBytes(clip), "one.c3d").frameCount(), 1U);
}

TEST(C3dWriter, WritesMoreThan65535Frames) {
  const MotionClip clip = SyntheticMotion(22, 1).clip(1000.0, 70001);
  EXPECT_EQ(readC3dBytes(writeC3dBytes(clip), "long.c3d").frameCount(), 70001U);
}

TEST(C3dWriter, Labels127BytesLongAreKept) {
  MotionClip clip = clipWithGap(2, 5);
  clip.marker_names[1] = std::string(127, 'x');
  EXPECT_EQ(readC3dBytes(writeC3dBytes(clip), "long.c3d").marker_names, clip.marker_names);
}

TEST(C3dWriter, RefusesWhatTheFormatCannotHold) {
  EXPECT_THROW(writeC3dBytes(MotionClip{}), InputError);
  MotionClip clip = clipWithGap(2, 5);
  clip.marker_names[1] = std::string(128, 'x');
  EXPECT_THROW(writeC3dBytes(clip), InputError);
  clip.marker_names[1] = "";
  EXPECT_THROW(writeC3dBytes(clip), InputError);
  clip.marker_names[1] = "B";
  clip.frame_rate_hz = 0.0;
  EXPECT_THROW(writeC3dBytes(clip), InputError);
  MotionClip many{120.0, std::vector<std::string>(2000, std::string(120, 'x')), PositionMatrix::Zero(1, 6000)};
  EXPECT_THROW(writeC3dBytes(many), InputError);
}

TEST(MotionFile, GoesByTheEnding) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("mouthpiece_motion_file_" + std::to_string(::getpid()));
  const MotionClip clip = clipWithGap(3, 30);
  for (const char* name : {"a.c3d", "b.CSV", "c.trc"}) {
    writeMotion(folder / name, clip);
    const MotionClip back = readMotion(folder / name);
    EXPECT_EQ(back.marker_names, clip.marker_names) << name;
    EXPECT_EQ(back.frame_rate_hz, 120.0) << name;
    EXPECT_FALSE(back.isSeen(FrameIndex(1), MarkerIndex(0))) << name;
    EXPECT_LT((back.positions_mm.bottomRows(20) - clip.positions_mm.bottomRows(20)).cwiseAbs().maxCoeff(), 1e-4)
        << name;
    EXPECT_TRUE(isMotionFileName(folder / name));
  }
  EXPECT_THROW(readMotion(folder / "d.bvh"), InputError);
  EXPECT_THROW(writeMotion(folder / "d.bvh", clip), InputError);
  EXPECT_THROW(readMotion(folder / "missing.c3d"), InputError);
  EXPECT_FALSE(isMotionFileName("x.wav"));
  std::filesystem::remove_all(folder);
}

/// Other programs read the header, ours its parameters: both tell the same.
TEST(C3dWriter, TheHeaderTellsWhatTheParametersTell) {
  for (const std::size_t markers : {1U, 13U, 66U, 400U}) {
    SCOPED_TRACE(markers);
    const MotionClip clip = clipWithGap(markers, 17);
    const std::string bytes = writeC3dBytes(clip);
    const auto word = [&](std::size_t at) {
      return static_cast<unsigned char>(bytes[at]) + 256U * static_cast<unsigned char>(bytes[at + 1]);
    };
    const auto real = [&](std::size_t at) {
      float value = 0;
      std::memcpy(&value, bytes.data() + at, sizeof value);
      return value;
    };
    EXPECT_EQ(word(0), 0x5002U);
    EXPECT_EQ(word(2), markers);
    EXPECT_EQ(word(4), 0U) << "no analog values";
    EXPECT_EQ(word(6), 1U);
    EXPECT_EQ(word(8), 17U);
    EXPECT_EQ(real(12), -1) << "floats, in millimetres";
    EXPECT_EQ(real(20), 120);
    const std::size_t data = 512 * (word(16) - 1);
    EXPECT_EQ(bytes[512], 1);
    EXPECT_EQ(static_cast<unsigned char>(bytes[514]) + 2U, word(16)) << "the data come right behind the parameters";
    EXPECT_EQ(static_cast<unsigned char>(bytes[515]), 84) << "Intel";
    ASSERT_EQ((data + 17 * 16 * markers + 511) / 512 * 512, bytes.size()) << "not a block more";
    for (Eigen::Index frame = 0; frame < 17; ++frame) {
      for (Eigen::Index marker = 0; marker < signedIndex(markers); ++marker) {
        const std::size_t at =
            data + 16 * (static_cast<std::size_t>(frame) * markers + static_cast<std::size_t>(marker));
        const bool is_seen = !std::isnan(clip.positions_mm(frame, 3 * marker));
        ASSERT_EQ(real(at + 12), is_seen ? 0 : -1) << "the residual";
        ASSERT_EQ(real(at), is_seen ? static_cast<float>(clip.positions_mm(frame, 3 * marker)) : 0);
      }
    }
  }
}

}  // namespace
}  // namespace mouthpiece
