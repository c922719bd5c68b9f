// What holds for any clip in any of our formats: random clips, the seed in the trace.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "base/errors.h"
#include "c3d_by_hand.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_csv.h"

namespace mouthpiece {
namespace {

constexpr unsigned kSeeds = 60;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kTextStepMm = 0.5e-4 + 1e-9;  ///< four decimals

std::string randomName(std::mt19937& random, std::size_t longest) {
  const std::string letters = "ABCdef_0189.-";
  std::string name;
  for (std::size_t n = 1 + random() % longest; n > 0; --n) name += letters[random() % letters.size()];
  return name;
}

/// 1 to 300 markers, so that labels now and then fill a second parameter; a sixth of the samples is missing.
MotionClip randomClip(unsigned seed) {
  std::mt19937 random(seed);
  MotionClip clip;
  const std::vector<double> rates{25, 30000.0 / 1001.0, 50, 59.94, 100, 119.88, 120, 500};
  clip.frame_rate_hz = rates[random() % rates.size()];
  const std::size_t markers = seed % 10 == 0 ? 240 + random() % 60 : 1 + random() % 8;
  std::set<std::string> used;
  while (clip.marker_names.size() < markers) {
    const std::string name = randomName(random, 20);
    if (used.insert(name).second) clip.marker_names.push_back(name);
  }
  std::uniform_real_distribution<double> place(-2000, 2000);
  clip.positions_mm =
      PositionMatrix::NullaryExpr(2 + static_cast<Eigen::Index>(random() % 40), static_cast<Eigen::Index>(3 * markers),
                                  [&] { return place(random); });
  for (Eigen::Index frame = 0; frame < clip.positions_mm.rows(); ++frame) {
    for (Eigen::Index column = 0; column < clip.positions_mm.cols(); column += 3) {
      if (random() % 6 == 0) clip.positions_mm.block<1, 3>(frame, column).setConstant(kNan);
    }
  }
  return clip;
}

std::vector<MotionEvent> randomEvents(unsigned seed) {
  std::mt19937 random(seed);
  std::vector<MotionEvent> events(random() % 4 == 0 ? 256 + random() % 20 : random() % 5);
  for (MotionEvent& event : events) {
    event.label = randomName(random, 30);
    event.context = randomName(random, 12);
    event.time = std::uniform_real_distribution<double>(0, 7000)(random);
  }
  return events;
}

/// The same markers, rate, gaps and places within `tolerance_mm`.
void expectSame(const MotionClip& read, const MotionClip& clip, double tolerance_mm) {
  EXPECT_EQ(read.marker_names, clip.marker_names);
  EXPECT_NEAR(read.frame_rate_hz, clip.frame_rate_hz, 1e-5 * clip.frame_rate_hz);
  ASSERT_EQ(read.positions_mm.rows(), clip.positions_mm.rows());
  ASSERT_EQ(read.positions_mm.cols(), clip.positions_mm.cols());
  for (Eigen::Index i = 0; i < clip.positions_mm.size(); ++i) {
    const double was = clip.positions_mm.data()[i], is = read.positions_mm.data()[i];
    ASSERT_EQ(std::isnan(is), std::isnan(was)) << i;
    if (std::isnan(was)) continue;
    ASSERT_NEAR(is, was, tolerance_mm + 1e-7 * std::abs(was)) << i;
  }
}

TEST(MotionFilesLaws, C3dKeepsClipsAndEvents) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const MotionClip clip = randomClip(seed);
    const std::vector<MotionEvent> events = randomEvents(seed);
    const std::string bytes = writeC3dBytes(clip, events);
    EXPECT_EQ(bytes.size() % 512, 0U);
    expectSame(readC3dBytes(bytes, "x.c3d"), clip, 0);
    const std::vector<MotionEvent> read = readC3dEventsBytes(bytes, "x.c3d");
    ASSERT_EQ(read.size(), events.size());
    for (std::size_t i = 0; i < events.size(); ++i) {
      EXPECT_EQ(read[i].label, events[i].label);
      EXPECT_EQ(read[i].context, events[i].context);
      EXPECT_NEAR(read[i].time, events[i].time, 1e-5) << "seconds under 60 as a float";
    }
  }
}

TEST(MotionFilesLaws, TextKeepsClipsToATenthOfAMicrometre) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const MotionClip clip = randomClip(seed);
    expectSame(readMotionCsvText(writeMotionCsvText(clip), "x.csv"), clip, kTextStepMm);
    expectSame(readTrcText(writeTrcText(clip, "x"), "x.trc"), clip, kTextStepMm);
  }
}

TEST(MotionFilesLaws, AllFormatsAgreeWithEachOther) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const MotionClip floats = readC3dBytes(writeC3dBytes(randomClip(seed)), "x.c3d");
    expectSame(readMotionCsvText(writeMotionCsvText(floats), "x.csv"), readTrcText(writeTrcText(floats, "x"), "x.trc"),
               0);
  }
}

/// Files put together byte by byte by the test, for all processors, points as floats and as integers.
TEST(MotionFilesLaws, EveryProcessorTellsTheSamePoints) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    C3dByHand file;
    file.labels.clear();
    file.points.clear();
    const int points = 1 + static_cast<int>(random() % 6);
    for (int i = 0; i < points; ++i) {
      file.labels.push_back("P" + std::to_string(i));
      // Quarters of a millimetre: whole numbers of the integer files' scale, exact in every float.
      const auto coordinate = [&] { return 0.25 * (static_cast<int>(random() % 8000) - 4000); };
      file.points.push_back({coordinate(), coordinate(), coordinate(), random() % 5 == 0 ? -1.0 : 0.0});
    }
    file.frames_in_data = 1 + random() % 9;
    file.last_frame = static_cast<int>(file.frames_in_data);
    file.analog_values_per_frame = static_cast<int>(random() % 4);
    file.groups_last = random() % 2 == 0;
    file.with_frames = random() % 2 == 0;
    for (const int processor : {84, 85, 86}) {
      for (const bool is_float : {true, false}) {
        file.processor = processor;
        file.is_float = is_float;
        file.scale = is_float ? -1.0F : 0.25F;
        const MotionClip clip = readC3dBytes(file.bytes(), "x.c3d");
        ASSERT_EQ(clip.frameCount(), file.frames_in_data);
        ASSERT_EQ(clip.marker_names, file.labels);
        for (std::size_t frame = 0; frame < clip.frameCount(); ++frame) {
          for (std::size_t i = 0; i < file.points.size(); ++i) {
            const std::vector<double>& point = file.points[i];
            const Eigen::Vector3d place = clip.position(FrameIndex(frame), MarkerIndex(i));
            EXPECT_EQ(place.hasNaN(), point[3] < 0);
            if (point[3] < 0) continue;
            EXPECT_EQ(place, Eigen::Vector3d(point[0] + static_cast<double>(frame), point[1], point[2]))
                << "processor " << processor << ", float " << is_float;
          }
        }
      }
    }
  }
}

/// Whatever stands in a file: a clip of finite places, or an InputError.
template <typename Read>
void expectCalm(const std::string& bytes, const Read& read) {
  try {
    const MotionClip clip = read(bytes, "x");
    EXPECT_EQ(clip.positions_mm.cols(), static_cast<Eigen::Index>(3 * clip.marker_names.size()));
    EXPECT_GT(clip.frame_rate_hz, 0);
    EXPECT_FALSE(clip.positions_mm.array().isInf().any());
  } catch (const InputError&) {
  }
}

TEST(MotionFilesLaws, DamageEndsInAClipOrAnInputError) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const MotionClip clip = randomClip(seed);
    const std::string c3d = writeC3dBytes(clip), csv = writeMotionCsvText(clip), trc = writeTrcText(clip, "x");
    for (int round = 0; round < 20; ++round) {
      const auto damaged = [&](std::string bytes, std::size_t reach) {
        for (std::size_t n = 1 + random() % 4; n > 0; --n)
          bytes[random() % std::min(reach, bytes.size())] = static_cast<char>(random() % 256);
        if (random() % 4 == 0) bytes.resize(random() % bytes.size());
        return bytes;
      };
      expectCalm(damaged(c3d, 2048), readC3dBytes);
      expectCalm(damaged(csv, 4096), readMotionCsvText);
      expectCalm(damaged(trc, 4096), readTrcText);
    }
  }
}

}  // namespace
}  // namespace mouthpiece
