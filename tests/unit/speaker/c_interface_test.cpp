// The C interface: codes and texts instead of exceptions, whatever it is given.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "mouthpiece/mouthpiece.h"
#include "support/run_program.h"

namespace {

namespace fs = std::filesystem;
const std::string kCorpus = MOUTHPIECE_BUILD_SHARE_DIR "/sample.corpus";
const std::string kFace = MOUTHPIECE_BUILD_SHARE_DIR "/default.face";

mouthpiece_options sampleOptions(bool with_face) {
  mouthpiece_options options;
  mouthpiece_options_init(&options);
  options.corpus = kCorpus.c_str();
  options.face = kFace.c_str();
  options.with_face = with_face ? 1 : 0;
  return options;
}

TEST(CInterface, NullIsRefusedAndFreedWithoutHarm) {
  char error[200] = "";
  mouthpiece_speaker* speaker = nullptr;
  mouthpiece_performance* line = nullptr;
  EXPECT_EQ(mouthpiece_speaker_new(nullptr, nullptr, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  EXPECT_NE(std::strstr(error, "null speaker"), nullptr) << error;
  EXPECT_EQ(mouthpiece_speak(speaker, "now", &line, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(line, nullptr);
  EXPECT_EQ(mouthpiece_speak(speaker, "now", nullptr, nullptr, 0), MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(mouthpiece_save(nullptr, "a.wav", error, sizeof error), MOUTHPIECE_BAD_INPUT);
  mouthpiece_stream* stream = nullptr;
  EXPECT_EQ(mouthpiece_stream_new(nullptr, &stream, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(mouthpiece_stream_next(nullptr, nullptr, nullptr, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(mouthpiece_frame_count(nullptr), 0U);
  EXPECT_EQ(mouthpiece_marker_name(nullptr, 0), nullptr);
  EXPECT_EQ(mouthpiece_warning(nullptr, 0), nullptr);
  size_t samples = 7;
  mouthpiece_sound(nullptr, &samples, nullptr);
  EXPECT_EQ(samples, 0U);
  mouthpiece_speaker_free(nullptr);
  mouthpiece_performance_free(nullptr);
  mouthpiece_stream_free(nullptr);
}

TEST(CInterface, ErrorsAreCutToTheRoomThereIs) {
  mouthpiece_options options = sampleOptions(false);
  options.corpus = "/nowhere/x.corpus";
  mouthpiece_speaker* speaker = nullptr;
  char error[300];
  EXPECT_EQ(mouthpiece_speaker_new(&options, &speaker, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  EXPECT_NE(std::strstr(error, "/nowhere/x.corpus"), nullptr) << error;
  char small[12];
  std::memset(small, 'x', sizeof small);
  EXPECT_EQ(mouthpiece_speaker_new(&options, &speaker, small, 8), MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(std::strlen(small), 7U);
  EXPECT_EQ(small[8], 'x') << "beyond the room";
  EXPECT_EQ(mouthpiece_speaker_new(&options, &speaker, nullptr, 0), MOUTHPIECE_BAD_INPUT);
}

TEST(CInterface, OptionsOfAnOddSizeAreRefused) {
  mouthpiece_options options = sampleOptions(false);
  options.size = 3;
  mouthpiece_speaker* speaker = nullptr;
  EXPECT_EQ(mouthpiece_speaker_new(&options, &speaker, nullptr, 0), MOUTHPIECE_BAD_INPUT);
  options.size = 1 << 20;
  EXPECT_EQ(mouthpiece_speaker_new(&options, &speaker, nullptr, 0), MOUTHPIECE_BAD_INPUT);
}

TEST(CInterface, SpeaksStreamsAndSaves) {
  if (!fs::exists(kFace)) GTEST_SKIP() << "no " << kFace << ": run `make data`";
  const mouthpiece_options options = sampleOptions(true);
  char error[300];
  mouthpiece_speaker* speaker = nullptr;
  ASSERT_EQ(mouthpiece_speaker_new(&options, &speaker, error, sizeof error), MOUTHPIECE_OK) << error;
  mouthpiece_performance* line = nullptr;
  EXPECT_EQ(mouthpiece_speak(speaker, "", &line, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  ASSERT_EQ(mouthpiece_speak(speaker, "now", &line, error, sizeof error), MOUTHPIECE_OK) << error;
  EXPECT_STREQ(error, "");
  mouthpiece_stream* stream = nullptr;
  ASSERT_EQ(mouthpiece_stream_new(line, &stream, error, sizeof error), MOUTHPIECE_OK);
  mouthpiece_frame frame;
  int has_frame = 1;
  size_t count = 0;
  while (mouthpiece_stream_next(stream, &frame, &has_frame, error, sizeof error) == MOUTHPIECE_OK && has_frame != 0) {
    EXPECT_EQ(frame.index, count++);
    EXPECT_EQ(frame.marker_count, mouthpiece_marker_count(line));
    EXPECT_GT(frame.vertex_count, 0U);
  }
  EXPECT_EQ(count, mouthpiece_frame_count(line));
  size_t samples = 0;
  int rate = 0;
  EXPECT_NE(mouthpiece_sound(line, &samples, &rate), nullptr);
  EXPECT_NEAR(static_cast<double>(samples) / rate, static_cast<double>(count) / mouthpiece_frame_rate(line), 0.05);
  const mouthpiece::test::ScratchFolder scratch;
  EXPECT_EQ(mouthpiece_save(line, (scratch.path() / "a.wav").c_str(), error, sizeof error), MOUTHPIECE_OK);
  EXPECT_TRUE(fs::exists(scratch.path() / "a.wav"));
  EXPECT_EQ(mouthpiece_save(line, (scratch.path() / "a.avi").c_str(), error, sizeof error), MOUTHPIECE_BAD_INPUT);
  EXPECT_STREQ(mouthpiece_arkit_name(0), "EyeBlinkLeft");
  EXPECT_EQ(mouthpiece_arkit_name(52), nullptr);
  // The stream keeps the performance alive, and either may go first.
  mouthpiece_performance_free(line);
  mouthpiece_stream_free(stream);
  mouthpiece_speaker_free(speaker);
}

}  // namespace
