// `corpus track` on clips of a real camera, where they are here, and on what is no clip.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

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
  const MotionClip theirs = readC3d(kGiven / "pwbd7s.c3d");
  for (const char* markers : {"--plain", "--again"}) {  // as the networks give them, then refined
    const auto result = track({clip.string(), "--out", scratch.path().string(), "--eye-corners-mm", "90", markers});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const MotionClip ours = readC3d(scratch.path() / "pwbd7s.c3d");
    ASSERT_EQ(ours.frameCount(), theirs.frameCount());
    EXPECT_EQ(ours.frame_rate_hz, 25);
    // 0.35 mm is asked for after a rigid fit; the nose's own noise stands in for the fit's here.
    EXPECT_LT(lipDistance(ours, theirs), 0.35) << markers;
  }
  const AudioClip sound = readAudio(scratch.path() / "pwbd7s.wav"), given = readAudio(kGiven / "pwbd7s.wav");
  EXPECT_EQ(sound.sample_rate_hz, 16000);
  ASSERT_EQ(sound.samples.size(), given.samples.size());
  for (std::size_t i = 0; i < sound.samples.size(); i += 97) EXPECT_NEAR(sound.samples[i], given.samples[i], 1e-3) << i;
}

/// How far apart the lips are up and down, straight between the frames.
double openingAt(const MotionClip& clip, Seconds time) {
  const auto upper = *clip.findMarker("LIP_UP_MID"), lower = *clip.findMarker("LIP_LO_MID");
  const auto opening = [&](std::size_t frame) {
    return clip.position(FrameIndex(frame), upper).y() - clip.position(FrameIndex(frame), lower).y();
  };
  const double at = std::clamp(time * clip.frame_rate_hz, 0.0, asReal(clip.frameCount() - 1));
  const auto before = std::min(static_cast<std::size_t>(at), clip.frameCount() - 2);
  return std::lerp(opening(before), opening(before + 1), at - asReal(before));
}

/// By how much `late`, whose time goes `pace` times as fast, is behind `early`, in whole milliseconds: the least
/// squares of the lips' opening.
int latenessMs(const MotionClip& late, const MotionClip& early, double pace) {
  int best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int ms = -100; ms <= 100; ++ms) {
    double error = 0;
    for (Seconds time = 0.2; time < 2.7; time += 0.005) {
      const double off = openingAt(late, time / pace + 0.001 * ms) - openingAt(early, time);
      error += off * off;
    }
    if (error < least) {
      least = error;
      best = ms;
    }
  }
  return best;
}

/// A clip of 25 pictures a second: played at another pace, so that every picture stays; brought to film's rate by
/// ffmpeg's filter `fps`, which shows what was seen nearest to a time; with pictures missing; with every other one from
/// some time on, as cameras do when it gets dark. (ffmpeg's option `-r` lets pictures come up to 1.1 frames late before
/// it drops one: 46 ms, which are then in the video.)
TEST_F(TrackProgram, KeepsTimeAtOtherRates) {
  if (!fs::exists(kClips)) GTEST_SKIP() << "no clips in ../shared";
  struct Made {
    std::string name, filter;
    double rate_hz, pace;
    int most_ms;
  };
  const auto paced = [](std::string name, const std::string& rate, double rate_hz) {
    return Made{std::move(name), "setpts=PTS*25/(" + rate + ")", rate_hz, rate_hz / 25, 2};
  };
  const std::vector<Made> all{paced("film", "24000/1001", 24000.0 / 1001),
                              paced("tv", "30000/1001", 30000.0 / 1001),
                              paced("web", "30", 30),
                              paced("sports", "50", 50),
                              paced("fast", "60", 60),
                              {"thinned", "fps=24000/1001", 24000.0 / 1001, 1, 10},
                              {"uneven", "select='not(eq(mod(n,11),3))'", 25, 1, 10},
                              {"halved", "select='lt(n,30)+not(mod(n,2))'", 25, 1, 10}};
  const fs::path clip = kClips / "pwbd7s.mpg";
  std::vector<std::string> clips{clip.string()};
  for (const Made& made : all) {
    clips.push_back((scratch.path() / (made.name + ".mkv")).string());
    const ChildResult result =
        runChild(*findProgram("ffmpeg"),
                 {"-v", "error", "-i", fs::absolute(clip).string(), "-vf", made.filter, "-fps_mode", "passthrough",
                  "-enc_time_base", "1:1000", "-c:v", "libx264", "-qp", "6", "-c:a", "pcm_s16le", clips.back()},
                 scratch.path(), 60);
    ASSERT_EQ(result.exit_code, 0) << result.output;
  }
  clips.insert(clips.end(), {"--plain", "--out", (scratch.path() / "out").string()});
  const auto result = track(clips);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const MotionClip given = readC3d(scratch.path() / "out" / "pwbd7s.c3d");
  for (const Made& made : all) {
    const MotionClip found = readC3d(scratch.path() / "out" / (made.name + ".c3d"));
    EXPECT_NEAR(found.frame_rate_hz, made.rate_hz, 1e-3) << made.name;
    EXPECT_LE(std::abs(latenessMs(found, given, made.pace)), made.most_ms) << made.name;
  }
}

/// The clip's first key frame is missing: until the next, at 0.48 s, its pictures are grey, with outlines of a face.
TEST_F(TrackProgram, TakesNoGhostForAFace) {
  if (!fs::exists(kClips)) GTEST_SKIP() << "no clips in ../shared";
  for (const char* markers : {"--plain", "--again"}) {
    const auto result = track({(kClips / "bbizzn.mpg").string(), "--out", scratch.path().string(), markers});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const MotionClip found = readC3d(scratch.path() / "bbizzn.c3d");
    ASSERT_EQ(found.frameCount(), 75);
    for (std::size_t frame = 0; frame < 75; ++frame)
      EXPECT_EQ(found.positions_mm.row(signedIndex(frame)).allFinite(), frame >= 12) << markers << " " << frame;
    EXPECT_EQ(readAudio(scratch.path() / "bbizzn.wav").samples.size(), readAudio(kGiven / "bbizzn.wav").samples.size());
  }
}

/// The same picture three times: in the first the face was looked for, in the others followed.
TEST_F(TrackProgram, SeesAFaceAsWellWhereItWasLookedFor) {
  if (!fs::exists(kClips)) GTEST_SKIP() << "no clips in ../shared";
  const std::string still = (scratch.path() / "still.mkv").string();
  const ChildResult made = runChild(*findProgram("ffmpeg"),
                                    {"-v", "error", "-i", fs::absolute(kClips / "pwbd7s.mpg").string(), "-vf",
                                     "tpad=start_mode=clone:start=2", "-c:v", "libx264", "-qp", "1", still},
                                    scratch.path(), 60);
  ASSERT_EQ(made.exit_code, 0) << made.output;
  const auto result = track({still, "--out", scratch.path().string(), "--eye-corners-mm", "90", "--plain"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const MotionClip found = readC3d(scratch.path() / "still.c3d");
  double sum = 0;
  int lips = 0;
  for (std::size_t i = 0; i < found.markerCount(); ++i) {
    if (!found.marker_names[i].starts_with("LIP_")) continue;
    const MarkerIndex marker(i);
    sum += (found.position(FrameIndex(0), marker) - found.position(FrameIndex(2), marker)).squaredNorm();
    ++lips;
  }
  // 0.76 mm by the detector's crop.
  EXPECT_LT(std::sqrt(sum / lips), 0.5);
}

/// Two cameras, one switched on 0.4 s later, and a recorder that had run for 1.234 s.
TEST_F(TrackProgram, TakesARecordersSoundForTheCameras) {
  if (!fs::exists(kClips)) GTEST_SKIP() << "no clips in ../shared";
  const std::string clip = fs::absolute(kClips / "pwbd7s.mpg").string();
  const auto path = [&](const char* name) { return (scratch.path() / name).string(); };
  const std::vector<std::vector<std::string>> made{
      {"-i", clip, "-vn", "-af", "adelay=1234:all=1,aecho=0.8:0.6:23|41:0.4|0.2,highpass=150", path("recorder.wav")},
      {"-i", clip, "-vf", "trim=start=0.4,setpts=PTS-STARTPTS", "-af", "atrim=start=0.4,asetpts=PTS-STARTPTS", "-c:v",
       "libx264", "-qp", "6", "-c:a", "pcm_s16le", path("side.mkv")},
      {"-i", clip, "-an", "-c:v", "copy", path("silent.mkv")}};
  for (const auto& wanted : made) {
    std::vector<std::string> arguments{"-v", "error", "-y"};
    arguments.insert(arguments.end(), wanted.begin(), wanted.end());
    const ChildResult result = runChild(*findProgram("ffmpeg"), arguments, scratch.path(), 60);
    ASSERT_EQ(result.exit_code, 0) << result.output;
  }
  const auto result =
      track({clip, path("side.mkv"), path("silent.mkv"), "--sound", path("recorder.wav"), "--out", path("out")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto begins = [&](const std::string& name) {
    const std::string start = name + ": " + path("recorder.wav") + " begins ";
    const auto at = result.out.find(start);
    return at == std::string::npos ? 0.0 : std::stod(result.out.substr(at + start.size()));
  };
  EXPECT_NEAR(begins("pwbd7s"), 1.234, 0.005) << result.out;
  EXPECT_NEAR(begins("side"), 1.634, 0.005) << result.out;
  // Three seconds of lips do not tell.
  EXPECT_NE(result.err.find("left out silent"), std::string::npos) << result.err;
  EXPECT_NEAR(readAudio(scratch.path() / "out" / "pwbd7s.wav").duration(),
              readC3d(scratch.path() / "out" / "pwbd7s.c3d").duration(), 1e-3);
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
  const fs::path sound = scratch.path() / "sound.wav";
  writeWav(sound, {16000, std::vector<float>(16000, 0.1F)});
  const auto heard = track({sound.string(), "--out", (scratch.path() / "out").string()});
  EXPECT_NE(heard.err.find("has no pictures; expected a video"), std::string::npos) << heard.err;
}

TEST_F(TrackProgram, MakesNoTakeOfHalfAFile) {
  if (!fs::exists(kClips)) GTEST_SKIP() << "no clips in ../shared";
  for (const std::string ending : {"mp4", "mkv"}) {
    const fs::path whole = scratch.path() / ("whole." + ending),
                   half = scratch.path() / ("half_" + ending + "." + ending);
    const ChildResult made = runChild(
        *findProgram("ffmpeg"),
        {"-v", "error", "-i", fs::absolute(kClips / "lgas2n.mpg").string(), "-movflags", "faststart", whole.string()},
        scratch.path(), 60);
    ASSERT_EQ(made.exit_code, 0) << made.output;
    const std::string bytes = readFile(whole, std::size_t{1} << 30U);
    writeFileAtomically(half, bytes.substr(0, bytes.size() / 2));
    const auto result = track({half.string(), "--out", (scratch.path() / "out").string()});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find("breaks off behind"), std::string::npos) << result.err;
    EXPECT_FALSE(fs::exists(scratch.path() / "out" / ("half_" + ending + ".c3d")));
  }
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
