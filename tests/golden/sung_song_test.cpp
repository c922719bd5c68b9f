// Songs that Festival sings, whose times are known, given back as recordings with their lyrics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <tuple>

#include "audio/audio_clip.h"
#include "phonetics/labels/textgrid.h"
#include "support/run_program.h"
#include "vocal/animation_curve.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const fs::path kSongs = fs::path(MOUTHPIECE_SOURCE_DIR) / "sample_data/songs";

/// Vowel onsets of a word. A word may be said in several ways; its vowels are as many in most.
std::vector<Seconds> vowelOnsets(const SpeechLabels& labels, std::size_t word) {
  std::vector<Seconds> onsets;
  const PhoneRange phones = labels.words[word].phones;
  for (std::size_t i = phones.first.value; i <= phones.last.value; ++i) {
    if (isVowel(labels.phones[i].phone)) onsets.push_back(labels.phones[i].span.start);
  }
  return onsets;
}

std::string lyricsOf(const json& song) {
  std::string lyrics;
  for (const json& word : song.at("words")) {
    if (word.contains("word")) lyrics += word.at("word").get<std::string>() + "\n";
  }
  return lyrics;
}

/// Every note three tied ones with vibrato.
json withMelisma(json song) {
  for (json& word : song.at("words")) {
    if (!word.contains("notes")) continue;
    json notes = json::array();
    for (const json& note : word.at("notes")) {
      for (int part = 0; part < 3; ++part) {
        json tied = note;
        tied["beats"] = note.at("beats").get<double>() / 3;
        tied["vibrato"] = true;
        if (part > 0 || note.value("tie", false)) tied["tie"] = true;
        notes.push_back(tied);
      }
    }
    word["notes"] = notes;
  }
  return song;
}

class SungSong : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "sample.corpus"))
      GTEST_SKIP() << "no sample corpus: run `make data`";
    if (std::system("command -v festival > /dev/null 2>&1") != 0) GTEST_SKIP() << "no Festival: nothing is sung";
  }

  static json song(const std::string& name) { return json::parse(readAll(kSongs / (name + ".json"))); }

  /// Sound and true labels in song.wav, song.TextGrid.
  void sing(const json& song) {
    const fs::path file = scratch_.write("song.json", song.dump());
    std::ignore = scratch_.write("lyrics.txt", lyricsOf(song));
    const ProgramResult result =
        runProgram("synth", {"--song", file.string(), "-o", path("song.wav"), "-o", path("song.TextGrid"), "--quiet"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  /// The errors of the vowels' onsets, s, of the song that was sung last.
  std::vector<double> onsetErrors() {
    const ProgramResult result = runProgram("corpus", {"align", path("song.wav"), "--sung", "--transcript-file",
                                                       path("lyrics.txt"), "--out", path("found.TextGrid"), "--quiet"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<double> errors;
    const SpeechLabels sung = readTextGrid(path("song.TextGrid")), found = readTextGrid(path("found.TextGrid"));
    EXPECT_EQ(sung.words.size(), found.words.size());
    for (std::size_t word = 0; word < std::min(sung.words.size(), found.words.size()); ++word) {
      const auto wanted = vowelOnsets(sung, word), got = vowelOnsets(found, word);
      for (std::size_t i = 0; i < std::min(wanted.size(), got.size()); ++i)
        errors.push_back(std::abs(got[i] - wanted[i]));
    }
    return errors;
  }

  void changeSound(const std::function<void(AudioClip&)>& change) {
    AudioClip clip = readAudio(path("song.wav"));
    change(clip);
    writeWav(path("song.wav"), clip);
  }

  /// The warnings of report.json, in one line.
  std::string warnings() {
    const ProgramResult result = runProgram(
        "synth", {"--audio", path("song.wav"), "--lyrics", path("lyrics.txt"), "-o", path("report.json"), "--quiet"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? json::parse(readAll(path("report.json"))).at("warnings").dump() : result.err;
  }

  [[nodiscard]] std::string path(const std::string& name) const { return (scratch_.path() / name).string(); }

  ScratchFolder scratch_;
};

TEST_F(SungSong, VowelsAreFoundWhereTheyBegin) {
  std::vector<double> errors;
  const auto judge = [&](const json& sung, const std::function<void(AudioClip&)>& change) {
    sing(sung);
    changeSound(change);
    const std::vector<double> more = onsetErrors();
    errors.insert(errors.end(), more.begin(), more.end());
  };
  const auto as_it_is = [](AudioClip&) {};
  const auto add_noise = [](AudioClip& clip) {  // 20 dB under the voice
    double squares = 0;
    for (const float sample : clip.samples) squares += static_cast<double>(sample) * sample;
    std::mt19937 random(1);
    std::normal_distribution<float> noise(
        0, static_cast<float>(0.1 * std::sqrt(squares / static_cast<double>(clip.samples.size()))));
    for (float& sample : clip.samples) sample += noise(random);
  };
  json slow = song("twinkle");
  slow["tempo"] = 60;
  judge(song("gloria"), as_it_is);
  judge(slow, as_it_is);
  judge(withMelisma(song("gloria")), as_it_is);
  judge(song("twinkle"), add_noise);
  ASSERT_GT(errors.size(), 120U);
  std::sort(errors.begin(), errors.end());
  EXPECT_LE(errors[errors.size() / 2], 0.015) << "median";
  EXPECT_LE(errors[errors.size() * 9 / 10], 0.060) << "90 %";
}

TEST_F(SungSong, LabelsMadeElsewhereAreTakenAsTheyAreAndTheNotesAreHeard) {
  sing(song("gloria"));
  const ProgramResult result =
      runProgram("synth", {"--audio", path("song.wav"), "--phones", path("song.TextGrid"), "--style", "sing", "--ps",
                           "1", "-o", path("again.TextGrid"), "-o", path("curves.json"), "--quiet"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const SpeechLabels given = readTextGrid(path("song.TextGrid")), used = readTextGrid(path("again.TextGrid"));
  ASSERT_EQ(used.phones.size(), given.phones.size());
  for (std::size_t i = 0; i < used.phones.size(); ++i)
    EXPECT_NEAR(used.phones[i].span.start, given.phones[i].span.start, 1e-6) << i;
  const CurveSet curves = readCurves(path("curves.json"));
  ASSERT_NE(findCurve(curves, "larynx"), nullptr) << "the pitch was heard";
  double highest = 0;
  for (const CurveKey& key : findCurve(curves, "Oh")->keys) highest = std::max(highest, key.value);
  EXPECT_GT(highest, 0.8) << "a high note: more than a long spoken vowel";
}

/// Every note and rest up to a fifth longer or shorter, as a person sings to a score.
json withRubato(json song) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> factor(0.8, 1.2);
  for (json& word : song.at("words")) {
    if (word.contains("rest")) word["rest"] = word["rest"].get<double>() * factor(random);
    if (!word.contains("notes")) continue;
    for (json& note : word["notes"]) note["beats"] = note["beats"].get<double>() * factor(random);
  }
  return song;
}

TEST_F(SungSong, AScoreGoesWithTheSoundOfWhoSingsIt) {
  constexpr Seconds kBefore = 1.3;
  for (const bool is_live : {false, true}) {
    sing(is_live ? withRubato(song("twinkle")) : song("twinkle"));
    const SpeechLabels sung = readTextGrid(path("song.TextGrid"));
    changeSound([&](AudioClip& clip) {
      clip.samples.insert(clip.samples.begin(), static_cast<std::size_t>(kBefore * clip.sample_rate_hz), 0.0F);
    });
    const fs::path score = scratch_.write("score.json", song("twinkle").dump());
    const ProgramResult result =
        runProgram("synth", {"--song", score.string(), "--audio", path("song.wav"), "-o", path("beside.TextGrid"), "-o",
                             path("report.json"), "-o", path("speech.wav"), "--quiet"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(readAudio(path("speech.wav")).samples, readAudio(path("song.wav")).samples);
    const SpeechLabels beside = readTextGrid(path("beside.TextGrid"));
    ASSERT_EQ(beside.words.size(), sung.words.size());
    std::vector<double> errors;
    for (std::size_t word = 0; word < sung.words.size(); ++word) {
      const auto wanted = vowelOnsets(sung, word), got = vowelOnsets(beside, word);
      ASSERT_EQ(wanted.size(), got.size()) << "the score's sounds";
      for (std::size_t i = 0; i < wanted.size(); ++i) errors.push_back(std::abs(got[i] - wanted[i] - kBefore));
    }
    std::sort(errors.begin(), errors.end());
    EXPECT_LE(errors[errors.size() / 2], 0.020) << (is_live ? "live" : "to the score");
    EXPECT_LE(errors[errors.size() * 9 / 10], 0.060);
    const json report = json::parse(readAll(path("report.json")));
    EXPECT_NE(report.at("notices").dump().find("the song's clock begins at +1."), std::string::npos)
        << report.at("notices");
    EXPECT_EQ(report.at("style"), "sing");
  }
  // Another song: told, and no error.
  const fs::path other = scratch_.write("other.json", song("gloria").dump());
  const ProgramResult result = runProgram(
      "synth", {"--song", other.string(), "--audio", path("song.wav"), "-o", path("report.json"), "--quiet"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(json::parse(readAll(path("report.json"))).at("warnings").dump().find("are not heard in the sound"),
            std::string::npos);
  const ProgramResult missing =
      runProgram("synth", {"--song", other.string(), "--audio", path("none.wav"), "-o", path("report.json")});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(missing.err.find("none.wav"), std::string::npos) << missing.err;
}

TEST_F(SungSong, WhatIsWrongWithARecordingIsSaid) {
  sing(song("gloria"));
  const AudioClip sung = readAudio(path("song.wav"));
  // The right words of a voice alone: nothing but what Festival's 16 kHz cannot tell.
  const nlohmann::json said = nlohmann::json::parse(warnings());
  ASSERT_EQ(said.size(), 1U) << said;
  EXPECT_NE(said[0].get<std::string>().find("nothing above 8 kHz"), std::string::npos);

  changeSound([](AudioClip& clip) {  // a chord that goes on through the rests
    for (std::size_t i = 0; i < clip.samples.size(); ++i) {
      const double t = static_cast<double>(i) / clip.sample_rate_hz;
      for (const double hz : {131.0, 165.0, 196.0}) {
        for (int harmonic = 1; harmonic <= 4; ++harmonic)
          clip.samples[i] += static_cast<float>(0.04 / harmonic * std::sin(2 * std::numbers::pi * hz * harmonic * t));
      }
    }
  });
  EXPECT_NE(warnings().find("instruments"), std::string::npos);

  writeWav(path("song.wav"), sung);
  changeSound([](AudioClip& clip) {
    for (float& sample : clip.samples) sample = std::clamp(8 * sample, -1.0F, 1.0F);
  });
  EXPECT_NE(warnings().find("clipped"), std::string::npos);

  writeWav(path("song.wav"), sung);
  changeSound([](AudioClip& clip) { std::fill(clip.samples.begin(), clip.samples.end(), 0.0F); });
  const ProgramResult silent =
      runProgram("synth", {"--audio", path("song.wav"), "--lyrics", path("lyrics.txt"), "-o", path("report.json")});
  EXPECT_EQ(silent.exit_code, 1);
  EXPECT_NE(silent.err.find("holds silence only"), std::string::npos) << silent.err;

  writeWav(path("song.wav"), sung);
  std::ignore = scratch_.write("lyrics.txt", lyricsOf(song("twinkle")));
  EXPECT_NE(warnings().find("the words do not fit the sound"), std::string::npos);

  changeSound([](AudioClip& clip) { clip.samples.resize(static_cast<std::size_t>(clip.sample_rate_hz / 2)); });
  const ProgramResult result =
      runProgram("synth", {"--audio", path("song.wav"), "--lyrics", path("lyrics.txt"), "-o", path("report.json")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("does not fit its 32 words"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace mouthpiece::test
