// C3D files that lie: every one must end in InputError, quickly and without a large allocation.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <random>

#include "base/errors.h"
#include "base/files.h"
#include "c3d_by_hand.h"
#include "motion/formats/c3d_file.h"

namespace mouthpiece {
namespace {

std::string failureOf(const std::string& bytes) {
  try {
    readC3dBytes(bytes, "bad.c3d");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

bool mentions(const std::string& message, const std::string& what) { return message.find(what) != std::string::npos; }

TEST(HostileC3d, CutOffAtEveryLength) {
  const std::string whole = C3dByHand().bytes();
  ASSERT_EQ(failureOf(whole), "");
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const std::string message = failureOf(whole.substr(0, length));
    ASSERT_NE(message, "") << "accepted the first " << length << " of " << whole.size() << " bytes";
    ASSERT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST(HostileC3d, EveryByteChangedEndsInAClipOrAnInputError) {
  const std::string whole = C3dByHand().bytes();
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const int value : {0x00, 0x01, 0x7F, 0x80, 0xFF}) {
      std::string changed = whole;
      changed[i] = static_cast<char>(value);
      try {
        const MotionClip clip = readC3dBytes(changed, "changed.c3d");
        ASSERT_EQ(static_cast<std::size_t>(clip.positions_mm.cols()), 3 * clip.markerCount());
      } catch (const InputError&) {
      }
    }
  }
}

TEST(HostileC3d, NamesWhatAParameterCannotBe) {
  const std::string whole = C3dByHand().bytes();
  // Behind a parameter's name stand two bytes of offset, its type, and the number of its dimensions.
  const std::size_t type = whole.find("USED") + 6;
  for (const int other : {0, 3, 5, -2}) {
    std::string changed = whole;
    changed[type] = static_cast<char>(other);
    EXPECT_TRUE(mentions(failureOf(changed), "parameter USED")) << other;
    EXPECT_TRUE(mentions(failureOf(changed), "found type " + std::to_string(other) + "; expected -1, 1, 2 or 4"));
  }
  std::string changed = whole;
  changed[type + 1] = 8;
  EXPECT_TRUE(mentions(failureOf(changed), "found 8 dimensions; expected at most 7"));
}

TEST(HostileC3d, NamesWhatIsWrong) {
  C3dByHand file;
  file.points.clear();
  EXPECT_TRUE(mentions(failureOf(file.bytes()), "no points"));

  file = C3dByHand();
  file.last_frame = 60000;
  EXPECT_EQ(failureOf(file.bytes()).substr(0, 13), "bad.c3d:byte ");
  EXPECT_TRUE(mentions(failureOf(file.bytes()), "the file ends after 3 frames of points; expected 60000"));

  file = C3dByHand();
  file.last_frame = 65535;
  file.trial_start = 1;
  file.trial_end = 0x7FFFFFFF;
  EXPECT_TRUE(mentions(failureOf(file.bytes()), "the file ends after 3 frames"));

  file = C3dByHand();
  file.analog_values_per_frame = 65535;
  file.frames_in_data = 0;
  EXPECT_TRUE(mentions(failureOf(file.bytes()), "the file ends after 0 frames"));

  file = C3dByHand();
  file.last_frame = 0;
  EXPECT_TRUE(mentions(failureOf(file.bytes()), "no frames"));

  for (const int processor : {83, 87, 99}) {
    file = C3dByHand();
    file.processor = processor;
    EXPECT_TRUE(mentions(failureOf(file.bytes()), "found processor type " + std::to_string(processor)));
  }

  file = C3dByHand();
  file.scale = 0.0F;
  EXPECT_TRUE(mentions(failureOf(file.bytes()), "POINT:SCALE"));

  for (const float rate : {0.0F, -25.0F, std::numeric_limits<float>::infinity(), std::nanf("")}) {
    file = C3dByHand();
    file.rate_hz = rate;
    EXPECT_TRUE(mentions(failureOf(file.bytes()), "POINT:RATE")) << rate;
  }
  EXPECT_TRUE(mentions(failureOf("RIFF....WAVE"), "is no C3D file"));
  EXPECT_TRUE(mentions(failureOf(""), "is empty"));
}

TEST(HostileC3d, PositionsMustBeFiniteAndSane) {
  C3dByHand file;
  file.points[0][1] = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(mentions(failureOf(file.bytes()), "found a position of inf mm"));
  file.points[0][1] = 3e30;
  EXPECT_TRUE(mentions(failureOf(file.bytes()), "found a position of 3e+30 mm"));
  file.points[0][1] = std::numeric_limits<double>::quiet_NaN();
  const MotionClip clip = readC3dBytes(file.bytes(), "nan.c3d");
  EXPECT_FALSE(clip.isSeen(FrameIndex(0), MarkerIndex(0))) << "a coordinate that is no number was not seen";
  EXPECT_TRUE(clip.isSeen(FrameIndex(0), MarkerIndex(1)));
}

TEST(HostileC3d, ParameterEntriesThatPointNowhere) {
  const std::string whole = C3dByHand().bytes();
  const std::size_t first_offset = 512 + 4 + 2 + 5;  // behind the name POINT
  for (const int offset : {1, 0x7FFF, 0xFFFF}) {
    std::string changed = whole;
    changed[first_offset] = static_cast<char>(offset & 0xFF);
    changed[first_offset + 1] = static_cast<char>(offset >> 8);
    EXPECT_TRUE(mentions(failureOf(changed), "found an entry \"POINT\"")) << offset;
  }
  std::string changed = whole;
  changed[0] = static_cast<char>(0xFF);  // the parameter section far behind the end
  EXPECT_TRUE(mentions(failureOf(changed), "points to byte"));
  changed[0] = 0;
  EXPECT_TRUE(mentions(failureOf(changed), "parameter block 0"));
}

TEST(HostileC3d, FindingsOfTheFuzzer) {
  const std::filesystem::path folder = MOUTHPIECE_SOURCE_DIR "/tests/fuzz/findings/c3d";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no findings in " << folder;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    try {
      readC3dBytes(readFile(entry.path()), entry.path().string());
    } catch (const InputError& error) {
      EXPECT_STRNE(error.what(), "");
    }
  }
}

}  // namespace
}  // namespace mouthpiece
