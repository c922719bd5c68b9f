#include "singing/song_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "base/errors.h"
#include "singing/song.h"
#include "singing/singing_voice.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// 120 beats a minute: half a second a beat.
constexpr const char* kSong = R"({"title": "t", "tempo": 120, "words": [
  {"rest": 1},
  {"word": "me", "notes": [{"pitch": "C3", "beats": 2}, {"pitch": "E3", "beats": 2, "tie": true}]},
  {"rest": 1},
  {"word": "far", "notes": [{"pitch": "G3", "beats": 3, "vibrato": true}]}]})";

class SongSourceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!festivalAvailable()) GTEST_SKIP() << "Festival is not installed: nothing is sung";
    file_ = fs::path(::testing::TempDir()) / "mouthpiece_song_source.json";
    std::ofstream(file_) << kSong;
  }
  void TearDown() override { fs::remove(file_); }
  fs::path file_;
};

TEST_F(SongSourceTest, NotesAndVibratoAreThoseThatWereWritten) {
  const SungSource sung = singSong(file_, nullptr);
  ASSERT_EQ(sung.tags.notes.size(), 3U);
  const std::vector<TimeSpan> spans = {{0.5, 1.5}, {1.5, 2.5}, {3.0, 4.5}};
  const std::vector<double> pitches = {48, 52, 55};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(sung.tags.notes[i].span.start, spans[i].start, 1e-9) << i;
    EXPECT_NEAR(sung.tags.notes[i].span.end, spans[i].end, 1e-9) << i;
    EXPECT_NEAR(sung.tags.notes[i].hz, hzOfMidiPitch(pitches[i]), 1e-9) << i;
  }
  ASSERT_EQ(sung.tags.vibrato.size(), 1U);
  EXPECT_NEAR(sung.tags.vibrato[0].span.start, 3.0 + SungVibrato().delay, 1e-9) << "vibrato comes after the tone";
  EXPECT_NEAR(sung.tags.vibrato[0].span.end, 4.5, 1e-9);
  EXPECT_TRUE(sung.warnings.empty());
}

TEST_F(SongSourceTest, WhatIsHeardIsWhatWasWritten) {
  const SungSource sung = singSong(file_, nullptr);
  const SungSource heard = hearSong(sung.line);
  for (const SungNote& written : sung.tags.notes) {
    const auto found = std::find_if(heard.tags.notes.begin(), heard.tags.notes.end(), [&](const SungNote& note) {
      return note.span.contains(written.span.middle()) && std::abs(12 * std::log2(note.hz / written.hz)) < 0.3;
    });
    EXPECT_NE(found, heard.tags.notes.end()) << "no note of " << written.hz << " Hz at " << written.span.middle();
  }
  EXPECT_FALSE(heard.tags.vibrato.empty());
  EXPECT_TRUE(heard.warnings.empty()) << heard.warnings.front();
  EXPECT_EQ(heard.line.labels.phones.size(), sung.line.labels.phones.size());
}

TEST_F(SongSourceTest, AVowelLiesWhereItsNotesDo) {
  const SungSource sung = singSong(file_, nullptr);
  for (const LabelledPhone& phone : sung.line.labels.phones) {
    if (phone.phone == Phone::kIY) {
      EXPECT_NEAR(phone.span.start, 0.5, 0.15) << "the M before the beat";
      EXPECT_NEAR(phone.span.end, 2.5, 0.05);
    }
  }
}

TEST(SongSource, RefusesWhatIsNoSong) { EXPECT_THROW(singSong("/nonexistent/song.json", nullptr), InputError); }

}  // namespace
}  // namespace mouthpiece
