// `corpus track` on clips of a real camera, where they are here, and on what is no clip.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "audio/audio_clip.h"
#include "base/child_process.h"
#include "base/files.h"
#include "motion/formats/c3d_file.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using test::ScratchFolder;

const fs::path kClips = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1_video/tracked";
const fs::path kGiven = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/takes";

test::ProgramResult track(const std::vector<std::string>& arguments) {
  std::vector<std::string> all{"track"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return test::runProgram("corpus", all);
}

class TrackProgram : public testing::Test {
 protected:
  void SetUp() override {
    if (!findProgram("ffmpeg")) GTEST_SKIP() << "no ffmpeg; get it with: sudo apt-get install ffmpeg";
    if (!fs::exists(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "face_tracker")) GTEST_SKIP() << "build viewer_page first";
  }
  ScratchFolder scratch;
};

/// Lips relative to the nose, which takes the head's place off; a constant offset of each coordinate taken off, mm RMS.
double lipDistance(const MotionClip& ours, const MotionClip& theirs) {
  double sum = 0;
  std::size_t markers = 0;
  for (const std::string& name : ours.marker_names) {
    if (!name.starts_with("LIP_")) continue;
    const auto a = *ours.findMarker(name), b = *theirs.findMarker(name);
    const auto nose_a = *ours.findMarker("NOSE_BASE"), nose_b = *theirs.findMarker("NOSE_BASE");
    Eigen::MatrixXd difference(signedIndex(ours.frameCount()), 3);
    for (std::size_t frame = 0; frame < ours.frameCount(); ++frame) {
      const FrameIndex f(frame);
      difference.row(signedIndex(frame)) =
          ((ours.position(f, a) - ours.position(f, nose_a)) - (theirs.position(f, b) - theirs.position(f, nose_b)))
              .transpose();
    }
    sum += (difference.rowwise() - difference.colwise().mean()).squaredNorm() / asReal(ours.frameCount());
    ++markers;
  }
  return std::sqrt(sum / asReal(markers));
}

TEST_F(TrackProgram, FindsWhatMediaPipeFinds) {
  if (!fs::exists(kClips)) GTEST_SKIP() << "no clips in ../shared";
  const fs::path clip = kClips / "pwbd7s.mpg";
  const auto result = track({clip.string(), "--out", scratch.path().string(), "--eye-corners-mm", "90", "--plain"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const MotionClip ours = readC3d(scratch.path() / "pwbd7s.c3d"), theirs = readC3d(kGiven / "pwbd7s.c3d");
  ASSERT_EQ(ours.frameCount(), theirs.frameCount());
  EXPECT_EQ(ours.frame_rate_hz, 25);
  // 0.35 mm is asked for after a rigid fit; the nose's own noise stands in for the fit's here.
  EXPECT_LT(lipDistance(ours, theirs), 0.35);
  const AudioClip sound = readAudio(scratch.path() / "pwbd7s.wav"), given = readAudio(kGiven / "pwbd7s.wav");
  EXPECT_EQ(sound.sample_rate_hz, 16000);
  ASSERT_EQ(sound.samples.size(), given.samples.size());
  for (std::size_t i = 0; i < sound.samples.size(); i += 97) EXPECT_NEAR(sound.samples[i], given.samples[i], 1e-3) << i;
}

TEST_F(TrackProgram, DoesNothingTwice) {
  if (!fs::exists(kClips)) GTEST_SKIP() << "no clips in ../shared";
  const std::string clip = (kClips / "lgas2n.mpg").string(), folder = scratch.path().string();
  ASSERT_EQ(track({clip, "--out", folder}).exit_code, 0);
  const auto made = fs::last_write_time(scratch.path() / "lgas2n.c3d");
  const auto second = track({clip, "--out", folder});
  EXPECT_NE(second.out.find("1 done before"), std::string::npos) << second.out;
  EXPECT_EQ(fs::last_write_time(scratch.path() / "lgas2n.c3d"), made);
  EXPECT_NE(track({clip, "--out", folder, "--again"}).out.find("0 done before"), std::string::npos);
}

TEST_F(TrackProgram, SaysWhyAClipIsLeftOut) {
  writeFileAtomically(scratch.path() / "text.mp4", "this is no video");
  const auto result = track({(scratch.path() / "text.mp4").string(), "--out", (scratch.path() / "out").string()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("left out text: "), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("shows no picture"), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(scratch.path() / "out" / "text.c3d"));
}

TEST_F(TrackProgram, RefusesTwoClipsOfOneName) {
  for (const char* name : {"a.mp4", "a.mov"}) writeFileAtomically(scratch.path() / name, "x");
  const auto result = track({(scratch.path() / "a.mp4").string(), (scratch.path() / "a.mov").string(), "--out",
                             (scratch.path() / "out").string()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("same take"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace mouthpiece
