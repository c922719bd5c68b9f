// Sound recorded by another device, laid beside a motion by the lips.
#include "corpus_tools/takes/lip_sync.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "corpus_tools/takes/take_files.h"
#include "motion/formats/c3d_file.h"
#include "support/error_of.h"
#include "support/run_program.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

struct Recorded {
  MotionClip motion;
  AudioClip sound{8000, {}};
};

/// Lips that open at random, and noise that is as loud as they are open. The sound has `late` s less, or silence first.
Recorded recorded(Seconds length, Seconds late, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> some(0, 1);
  std::normal_distribution<double> noise;
  std::vector<double> openings;
  for (Seconds time = 0; time < length + 1; time += 0.12) openings.push_back(14 * some(random));
  const auto openingAt = [&](Seconds time) {
    const auto before = static_cast<std::size_t>(time / 0.12);
    return std::lerp(openings[before], openings[before + 1], time / 0.12 - asReal(before));
  };
  Recorded both;
  both.motion = {50, {"LIP_UP_MID", "LIP_LO_MID"}, PositionMatrix::Zero(std::lround(50 * length), 6)};
  for (Eigen::Index frame = 0; frame < both.motion.positions_mm.rows(); ++frame)
    both.motion.positions_mm(frame, 1) = 10 + openingAt(asReal(frame) / 50) + 0.5 * noise(random);
  for (Seconds time = late; time < length; time += 1.0 / 8000)
    both.sound.samples.push_back(asFloat(1e-3 * noise(random) * (time < 0 ? 1 : std::pow(10, openingAt(time) / 14))));
  return both;
}

const LipGauge kLips({"LIP_UP_MID", "LIP_LO_MID"});

TEST(LipSync, FindsWhereTheSoundBegins) {
  for (const Seconds late : {-3.21, -0.5, 0.0, 0.13, 4.44}) {
    const Recorded both = recorded(30, late);
    const SoundPlace place = placeOfSound(both.motion, both.sound, kLips);
    EXPECT_NEAR(place.late, late, 0.015);
    EXPECT_TRUE(place.is_sure) << place.likeness << " " << place.likeness_apart;
    const AudioClip beside = soundBeside(both.motion.duration(), both.sound, place.late);
    EXPECT_EQ(beside.samples.size(), 240'000U);
    constexpr std::ptrdiff_t kAt = 8000 * 10;
    EXPECT_EQ(beside.samples[kAt], both.sound.samples[unsignedIndex(kAt - std::lround(8000 * place.late))]);
  }
}

TEST(LipSync, IsNotSureOfAnotherSound) {
  EXPECT_FALSE(placeOfSound(recorded(30, 0, 1).motion, recorded(30, 0, 2).sound, kLips).is_sure);
  Recorded still = recorded(30, 0);
  still.motion.positions_mm.setZero();
  EXPECT_FALSE(placeOfSound(still.motion, still.sound, kLips).is_sure);
}

TEST(LipSync, SaysWhatItNeeds) {
  EXPECT_NE(errorOf([] { placeOfSound(recorded(3, 0).motion, recorded(30, 0).sound, kLips); }).find("3.0 s of motion"),
            std::string::npos);
  EXPECT_NE(errorOf([] { placeOfSound(recorded(30, 0).motion, recorded(30, 0).sound, LipGauge()); }).find("lips"),
            std::string::npos);
}

/// Ten takes of a real speaker end to end, their sound cut.
TEST(LipSync, HoldsForARealSpeaker) {
  const fs::path takes = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/takes";
  if (!fs::exists(takes)) GTEST_SKIP() << "no takes in ../shared";
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(takes)) {
    if (entry.path().extension() == ".c3d") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (std::size_t first = 0; first < 50; first += 10) {
    MotionClip motion;
    AudioClip sound;
    for (std::size_t i = first; i < first + 10; ++i) {
      const MotionClip more = readC3d(files[i]);
      const AudioClip said = readAudio(fs::path(files[i]).replace_extension(".wav"), {.most = 60});
      const Eigen::Index rows = motion.positions_mm.rows();
      motion.frame_rate_hz = more.frame_rate_hz;
      motion.marker_names = more.marker_names;
      motion.positions_mm.conservativeResize(rows + more.positions_mm.rows(), more.positions_mm.cols());
      motion.positions_mm.bottomRows(more.positions_mm.rows()) = more.positions_mm;
      sound.sample_rate_hz = said.sample_rate_hz;
      sound.samples.insert(sound.samples.end(), said.samples.begin(), said.samples.end());
      sound.samples.resize(static_cast<std::size_t>(std::lround(motion.duration() * said.sample_rate_hz)));
    }
    sound.samples.erase(sound.samples.begin(), sound.samples.begin() + 2 * sound.sample_rate_hz);
    const SoundPlace place = placeOfSound(motion, sound, LipGauge(motion.marker_names));
    EXPECT_NEAR(place.late, 2, 0.045) << first;
    EXPECT_TRUE(place.is_sure) << place.likeness << " " << place.likeness_apart;
  }
}

TEST(LipSync, TheProgramShowsThePlaceAndWritesTheSound) {
  const test::ScratchFolder scratch;
  const Recorded both = recorded(30, 1.5);
  const fs::path motion = scratch.path() / "phone.c3d", sound = scratch.path() / "recorder.wav";
  writeC3d(motion, both.motion);
  writeWav(sound, both.sound);
  const std::string take = (scratch.path() / "take.c3d").string();
  const auto converted = test::runProgram("corpus", {"convert", motion.string(), take, "--sound", sound.string()});
  ASSERT_EQ(converted.exit_code, 0) << converted.err;
  EXPECT_NE(converted.out.find("begins 1.500 s after the motion"), std::string::npos) << converted.out;
  EXPECT_NEAR(readAudio(scratch.path() / "take.wav", {.most = 60}).duration(), 30, 1e-3);
  // Told by a clap, or by what the motion's own device heard.
  const fs::path own = scratch.path() / "phone.wav";
  AudioClip heard = both.sound;
  heard.samples.insert(heard.samples.begin(), 12'000, 0.0F);
  writeWav(own, heard);
  const auto beside = test::runProgram(
      "corpus", {"convert", motion.string(), take, "--sound", sound.string(), "--own-sound", own.string()});
  ASSERT_EQ(beside.exit_code, 0) << beside.err;
  EXPECT_NE(beside.out.find("begins 1.500 s after the motion (both sounds agree"), std::string::npos) << beside.out;
  // A recorder whose clock runs fast has more samples of the same time.
  const Recorded longer = recorded(90, 1.5);
  const fs::path long_motion = scratch.path() / "long.c3d", fast = scratch.path() / "fast.wav";
  writeC3d(long_motion, longer.motion);
  AudioClip long_heard = longer.sound;
  long_heard.samples.insert(long_heard.samples.begin(), 12'000, 0.0F);
  writeWav(own, long_heard);
  writeWav(fast, stretchAudio(longer.sound, 1 + 100e-6));
  const auto drifting = test::runProgram(
      "corpus", {"convert", long_motion.string(), take, "--sound", fast.string(), "--own-sound", own.string()});
  ASSERT_EQ(drifting.exit_code, 0) << drifting.err;
  EXPECT_NE(drifting.out.find("begins 1.500 s after the motion"), std::string::npos) << drifting.out;
  EXPECT_NE(drifting.out.find("its clock 100 millionths fast: shortened by 6.0 ms a minute"), std::string::npos)
      << drifting.out;
  AudioClip clapped = both.sound;
  for (std::size_t i = 0; i < 80; ++i) clapped.samples[16'000 + i] = i % 2 == 0 ? 0.9F : -0.9F;
  writeWav(sound, clapped);
  const auto clap =
      test::runProgram("corpus", {"convert", motion.string(), take, "--sound", sound.string(), "--clap-at", "3.25"});
  ASSERT_EQ(clap.exit_code, 0) << clap.err;
  EXPECT_NE(clap.out.find("begins 1.25"), std::string::npos) << clap.out;
  writeWav(sound, recorded(30, 0, 5).sound);
  EXPECT_NE(
      test::runProgram("corpus", {"convert", motion.string(), take, "--sound", sound.string(), "--clap-at", "3.25"})
          .err.find("no clap"),
      std::string::npos);
  const auto other = test::runProgram("corpus", {"convert", motion.string(), take, "--sound", sound.string()});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.err.find("--sound-late"), std::string::npos) << other.err;
  EXPECT_EQ(
      test::runProgram("corpus", {"convert", motion.string(), take, "--sound", sound.string(), "--sound-late", "0.2"})
          .exit_code,
      0);
}

}  // namespace
}  // namespace mouthpiece
