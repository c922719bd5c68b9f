// The C interface: codes and texts instead of exceptions, whatever it is given.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "audio/audio_clip.h"
#include "base/files.h"
#include "mouthpiece/mouthpiece.h"
#include "support/run_program.h"
#include "voices/voice.h"

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
  EXPECT_EQ(mouthpiece_sing_recording(speaker, "a.json", "a.wav", nullptr, &line, error, sizeof error),
            MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(mouthpiece_perform_heard(speaker, "a.wav", nullptr, &line, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(mouthpiece_perform_timed(speaker, "a.wav", "a.json", &line, error, sizeof error), MOUTHPIECE_BAD_INPUT);
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

/// A recording without its words, and with what another program told of it.
TEST(CInterface, HearsARecordingAndTakesTimesOfOthers) {
  if (!fs::exists(kCorpus)) GTEST_SKIP() << "no " << kCorpus << ": run `make data`";
  const mouthpiece::test::ScratchFolder scratch;
  const std::string sound = (scratch.path() / "a.wav").string();
  const std::string times = scratch.write("a.srt", "1\n00:00:00,000 --> 00:00:01,500\nthe time is now\n");
  mouthpiece::writeWav(sound, mouthpiece::makeVoice("flite:slt")->speak("the time is now").audio);
  const mouthpiece_options options = sampleOptions(false);
  char error[300];
  mouthpiece_speaker* speaker = nullptr;
  ASSERT_EQ(mouthpiece_speaker_new(&options, &speaker, error, sizeof error), MOUTHPIECE_OK) << error;
  mouthpiece_performance* line = nullptr;
  for (const char* hint : {static_cast<const char*>(nullptr), "the time is now"}) {
    ASSERT_EQ(mouthpiece_perform_heard(speaker, sound.c_str(), hint, &line, error, sizeof error), MOUTHPIECE_OK)
        << error;
    EXPECT_GT(mouthpiece_frame_count(line), 30U);
    mouthpiece_performance_free(line);
  }
  ASSERT_EQ(mouthpiece_perform_timed(speaker, sound.c_str(), times.c_str(), &line, error, sizeof error), MOUTHPIECE_OK)
      << error;
  const std::string report = (scratch.path() / "report.json").string();
  ASSERT_EQ(mouthpiece_save(line, report.c_str(), error, sizeof error), MOUTHPIECE_OK) << error;
  EXPECT_NE(mouthpiece::readFile(report).find("the time is now"), std::string::npos);
  mouthpiece_performance_free(line);
  EXPECT_EQ(mouthpiece_perform_timed(speaker, sound.c_str(), nullptr, &line, error, sizeof error),
            MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(mouthpiece_perform_heard(speaker, nullptr, nullptr, &line, error, sizeof error), MOUTHPIECE_BAD_INPUT);
  mouthpiece_speaker_free(speaker);
}

/// Sung, and its own sound given back a second late: the song is found there, or lies where it is told.
TEST(CInterface, SingsASongBesideItsSound) {
  if (!fs::exists(kCorpus)) GTEST_SKIP() << "no " << kCorpus << ": run `make data`";
  if (std::system("command -v festival > /dev/null 2>&1") != 0) GTEST_SKIP() << "no Festival: nothing is sung";
  const mouthpiece::test::ScratchFolder scratch;
  const std::string song = scratch.write("a.json", R"({"tempo": 100, "words": [
      {"word": "the", "notes": [{"pitch": "C4", "beats": 1}]}, {"word": "bread", "notes": [{"pitch": "G4", "beats": 1}]},
      {"word": "is", "notes": [{"pitch": "A4", "beats": 1}]}, {"word": "warm", "notes": [{"pitch": "E4", "beats": 2}]}]})");
  const std::string sound = (scratch.path() / "a.wav").string();
  const mouthpiece_options options = sampleOptions(false);
  char error[300];
  mouthpiece_speaker* speaker = nullptr;
  ASSERT_EQ(mouthpiece_speaker_new(&options, &speaker, error, sizeof error), MOUTHPIECE_OK) << error;
  mouthpiece_performance* line = nullptr;
  ASSERT_EQ(mouthpiece_sing(speaker, song.c_str(), &line, error, sizeof error), MOUTHPIECE_OK) << error;
  size_t count = 0;
  int rate_hz = 0;
  const float* samples = mouthpiece_sound(line, &count, &rate_hz);
  mouthpiece::AudioClip late{rate_hz, std::vector<float>(static_cast<size_t>(rate_hz))};
  late.samples.insert(late.samples.end(), samples, samples + count);
  mouthpiece::writeWav(sound, late);
  mouthpiece_performance_free(line);
  for (const double told : {0.0, 1.0}) {
    ASSERT_EQ(mouthpiece_sing_recording(speaker, song.c_str(), sound.c_str(), told > 0 ? &told : nullptr, &line, error,
                                        sizeof error),
              MOUTHPIECE_OK)
        << error;
    const char* notice = mouthpiece_notice(line, 0);
    ASSERT_NE(notice, nullptr);
    double begins = 0;
    ASSERT_EQ(std::sscanf(notice, "the song's clock begins at %lf", &begins), 1) << notice;
    EXPECT_NEAR(begins, 1, told > 0 ? 0.006 : 0.061) << "a vowel's pitch begins after its note";
    EXPECT_EQ(std::strstr(notice, "as told") != nullptr, told > 0) << notice;
    mouthpiece_performance_free(line);
  }
  const double far = 1e300;
  EXPECT_EQ(mouthpiece_sing_recording(speaker, song.c_str(), sound.c_str(), &far, &line, error, sizeof error),
            MOUTHPIECE_BAD_INPUT);
  EXPECT_EQ(mouthpiece_sing_recording(speaker, song.c_str(), nullptr, nullptr, &line, error, sizeof error),
            MOUTHPIECE_BAD_INPUT);
  mouthpiece_speaker_free(speaker);
}

}  // namespace
