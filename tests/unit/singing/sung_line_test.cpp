#include "singing/sung_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "audio/pitch_track.h"
#include "base/errors.h"
#include "phonetics/language/phone.h"
#include "support/sung_words.h"

namespace mouthpiece {
namespace {

using samples::SungWords;

Song gloria() {
  return SungWords()
      .rest(0.4)
      .word("gloria", {{{196, 1.0}, {220, 0.5}}, {{147, 0.5}}, {{131, 0.5}}})
      .rest(0.5)
      .word("star", {{{262, 1.5, true}}})
      .song();
}

TEST(FestivalSingingXml, HasANoteASyllableAndSlurs) {
  const std::string xml = festivalSingingXml(gloria(), {});
  EXPECT_NE(xml.find("<REST SECONDS=\"0.4000\">"), std::string::npos);
  EXPECT_NE(
      xml.find(
          "<DURATION SECONDS=\"1.00000+0.50000,0.50000,0.50000\"><PITCH FREQ=\"196.00+220.00,147.00,131.00\">gloria<"),
      std::string::npos);
  EXPECT_EQ(std::count(xml.begin(), xml.end(), '+'), 2 * 1 + 2 * 74) << "1.5 s of vibrato in steps of 20 ms";
}

TEST(FestivalSingingXml, RestsAreWhatLiesBetweenWords) {
  const auto rests = [](const Song& song) {
    const std::string xml = festivalSingingXml(song, {});
    std::vector<std::string> found;
    for (std::size_t at = 0; (at = xml.find("<REST SECONDS=\"", at)) != std::string::npos; ++at)
      found.push_back(xml.substr(at + 15, 6));
    return found;
  };
  const SungWords la = SungWords().word("la", {{{200, 1}}});
  EXPECT_TRUE(rests(la.song()).empty());
  EXPECT_TRUE(rests(SungWords(la).word("la", {{{200, 1.0 / 3}}}).word("la", {{{200, 1}}}).song()).empty());
  EXPECT_EQ(rests(SungWords(la).rest(2).word("la", {{{200, 1}}}).rest(0.25).song()),
            (std::vector<std::string>{"2.0000", "0.2500"}));
}

TEST(FestivalSingingXml, LeavesOutApostrophesAtAWordsEnds) {
  const std::string xml = festivalSingingXml(SungWords().word("'tis'", {{{200, 1}}}).song(), {});
  EXPECT_NE(xml.find(">tis<"), std::string::npos);
}

TEST(FestivalSingingXml, VibratoSwingsAboutItsNoteAndKeepsItsLength) {
  const SungVibrato vibrato{.rate_hz = 5, .depth_semitones = 1, .delay = 0.1};
  for (const Seconds length : {0.03, 0.5, 1.25, 1.27, 20.0}) {
    const std::string xml = festivalSingingXml(SungWords().word("la", {{{300, length, true}}}).song(), vibrato);
    const auto numbers = [&](const std::string& attribute) {
      const std::size_t begin = xml.find(attribute + "=\"", xml.find("<DURATION")) + attribute.size() + 2;
      std::string text = xml.substr(begin, xml.find('"', begin) - begin);
      std::vector<double> values;
      for (std::size_t at = 0; at < text.size();
           at = text.find('+', at) == std::string::npos ? text.size() : text.find('+', at) + 1)
        values.push_back(std::stod(text.substr(at)));
      return values;
    };
    const std::vector<double> hz = numbers("FREQ"), lengths = numbers("SECONDS");
    ASSERT_EQ(hz.size(), lengths.size());
    EXPECT_LE(hz.size(), 400U) << "Festival's lists are recursive";
    double sum = 0;
    for (const double each : lengths) sum += each;
    EXPECT_NEAR(sum, length, 1e-5 * static_cast<double>(lengths.size()));
    Seconds at = 0;
    for (std::size_t i = 0; i < hz.size(); at += lengths[i++]) {
      EXPECT_LE(std::abs(12 * std::log2(hz[i] / 300)), 1 + 1e-3) << "at " << at << " s";
      const bool is_before = at + lengths[i] < vibrato.delay;
      EXPECT_TRUE(!is_before || std::abs(hz[i] - 300) < 0.01) << "it comes after its delay";
    }
  }
}

TEST(SungVoices, AreNamedOnceAndTheOthersRefused) {
  ASSERT_FALSE(sungVoices().empty());
  for (const SungVoice& voice : sungVoices()) {
    EXPECT_EQ(std::count_if(sungVoices().begin(), sungVoices().end(),
                            [&](const SungVoice& other) { return other.name == voice.name; }),
              1);
    EXPECT_FALSE(voice.what.empty());
  }
  try {
    singSong(gloria(), {.voice = "flite:slt"});
    FAIL() << "a voice that cannot sing sang";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("flite:slt"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find(sungVoices()[0].name), std::string::npos) << "one that sings is named";
  }
}

TEST(SungVoices, RefuseWhatIsNoSongBeforeTheyStart) {
  EXPECT_THROW(singSong(Song{}), InputError);
  Song hostile = gloria();
  hostile.words[0].text = "a\" (quit)";
  EXPECT_THROW(singSong(hostile), InputError);
  EXPECT_THROW(singWithFestival(hostile, {}), InputError);
}

class SungLineTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!festivalAvailable()) GTEST_SKIP() << "Festival is not installed: nothing is sung";
  }
};

/// Also after a rest, for which Festival has a word of its own.
TEST_F(SungLineTest, KanaAreSungWithTheirOwnSounds) {
  const std::string rest = "[#0009]\nLength=480\nLyric=R\nNoteNum=60\n";
  for (const Seconds begin : {0.0, 1.0}) {
    SCOPED_TRACE(begin);
    const Song song =
        parseUst("[#SETTING]\nTempo=60\n" + (begin > 0 ? rest : "") +
                     "[#0000]\nLength=240\nLyric=か\nNoteNum=57\n[#0001]\nLength=240\nLyric=ん\nNoteNum=59\n"
                     "[#0002]\nLength=480\nLyric=ぱ\nNoteNum=60\n[#0003]\nLength=240\nLyric=R\nNoteNum=60\n"
                     "[#0004]\nLength=480\nLyric=ふー\nNoteNum=57\n",
                 "a.ust");
    const SungLine sung = singSong(song);
    EXPECT_EQ(sung.line.text, "か ん ぱ ふー");
    const SpeechLabels& labels = sung.line.labels;
    std::string said, words;
    for (const LabelledPhone& phone : labels.phones) {
      if (phone.phone != Phone::kSil) said += std::string(phone.name()) + " ";
    }
    for (const LabelledWord& word : labels.words) words += word.text + " ";
    EXPECT_EQ(said, "k a m p a ɸ ɯː ");
    ASSERT_EQ(words, "か ん ぱ ふー ");
    // Vowels begin on their notes, consonants before them.
    const auto vowelOf = [&](std::size_t word) {
      return labels.phones[labels.words[word].phones.last.value].span.start;
    };
    EXPECT_NEAR(vowelOf(2), begin + 1.0, 0.04);
    EXPECT_NEAR(vowelOf(3), begin + 2.5, 0.04);
    EXPECT_NEAR(labels.spanOf(labels.words[1].phones).start, begin + 0.5, 0.06);
  }
}

TEST_F(SungLineTest, NotesAreSungAtTheirTimes) {
  const SungLine sung = singSong(gloria());
  EXPECT_NEAR(sung.line.audio.duration(), 0.4 + 2.5 + 0.5 + 1.5, 0.1);
  ASSERT_EQ(sung.line.labels.words.size(), 2U);
  EXPECT_EQ(sung.line.labels.words[1].text, "star");
  EXPECT_EQ(sung.line.text, "gloria star");
  const std::vector<Note>& notes = sung.tags.notes;
  ASSERT_EQ(notes.size(), 5U);
  EXPECT_NEAR(notes[4].span.start, 3.4, 1e-9);
  const PitchTrack pitch = trackPitch(sung.line.audio);
  for (std::size_t i = 0; i < 4; ++i) {
    // Consonants stand before the beat: the middle of a note is surely its own.
    EXPECT_NEAR(pitch.hzAt(notes[i].span.middle()), notes[i].hz, 0.02 * notes[i].hz) << i;
  }
  std::vector<double> semitones;
  for (Seconds t = 4.0; t < 4.6; t += 0.01) {
    const double hz = pitch.hzAt(t);
    // Single frames may be taken for an octave above or below.
    if (hz > 200 && hz < 340) semitones.push_back(12 * std::log2(hz / 262));
  }
  ASSERT_GT(semitones.size(), 50U);
  const auto [low, high] = std::minmax_element(semitones.begin(), semitones.end());
  EXPECT_NEAR(*high - *low, 1.0, 0.35) << "twice half a semitone";
}

TEST_F(SungLineTest, WhatIsTooHighForTheVoiceIsSungLower) {
  const SungLine high = singSong(SungWords().word("star", {{{1047, 0.6}}}).word("me", {{{494, 0.6}}}).song());
  ASSERT_EQ(high.tags.notes.size(), 2U);
  EXPECT_DOUBLE_EQ(high.tags.notes[0].hz, 1047) << "what the face sings is what is written";
  ASSERT_EQ(high.notices.size(), 1U);
  EXPECT_NE(high.notices[0].find("2 octaves lower"), std::string::npos);
  EXPECT_TRUE(singSong(SungWords().word("me", {{{494, 0.6, true}}}).song()).notices.empty()) << "B4 is sung";
}

TEST_F(SungLineTest, NamesTheWordItCannotSay) {
  try {
    singSong(SungWords().word("o'er", {{{200, 1}}}).song());
    FAIL() << "a word without phones was sung";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("o'er"), std::string::npos);
  }
}

/// Two words of held vowels; the second with vibrato.
Song meFar() {
  return SungWords()
      .rest(0.5)
      .word("me", {{{130.81, 1}, {164.81, 1}}})
      .rest(0.5)
      .word("far", {{{196, 1.5, true}}})
      .song();
}

TEST_F(SungLineTest, TagsAreTheNotesAndVibratoThatWereWritten) {
  const SungLine sung = singSong(meFar());
  ASSERT_EQ(sung.tags.notes.size(), 3U);
  const std::vector<TimeSpan> spans = {{0.5, 1.5}, {1.5, 2.5}, {3.0, 4.5}};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(sung.tags.notes[i].span.start, spans[i].start, 1e-9) << i;
    EXPECT_NEAR(sung.tags.notes[i].span.end, spans[i].end, 1e-9) << i;
    EXPECT_EQ(sung.tags.notes[i].hz, meFar().notes()[i].hz) << i;
  }
  ASSERT_EQ(sung.tags.vibrato.size(), 1U);
  EXPECT_NEAR(sung.tags.vibrato[0].span.start, 3.0 + SungVibrato().delay, 1e-9) << "vibrato comes after the note";
  EXPECT_NEAR(sung.tags.vibrato[0].span.end, 4.5, 1e-9);
  EXPECT_TRUE(sung.warnings.empty());
}

TEST_F(SungLineTest, WhatIsHeardIsWhatWasWritten) {
  const SungLine sung = singSong(meFar());
  const SungLine heard = hearSong(sung.line);
  for (const Note& written : sung.tags.notes) {
    const auto found = std::find_if(heard.tags.notes.begin(), heard.tags.notes.end(), [&](const Note& note) {
      return note.span.contains(written.span.middle()) && std::abs(12 * std::log2(note.hz / written.hz)) < 0.3;
    });
    EXPECT_NE(found, heard.tags.notes.end()) << "no note of " << written.hz << " Hz at " << written.span.middle();
  }
  EXPECT_FALSE(heard.tags.vibrato.empty());
  EXPECT_TRUE(heard.warnings.empty()) << heard.warnings.front();
  EXPECT_EQ(heard.line.labels.phones.size(), sung.line.labels.phones.size());
}

TEST_F(SungLineTest, AVowelLiesWhereItsNotesDo) {
  for (const LabelledPhone& phone : singSong(meFar()).line.labels.phones) {
    if (phone.phone != Phone::kIY) continue;
    EXPECT_NEAR(phone.span.start, 0.5, 0.15) << "the M before the beat";
    EXPECT_NEAR(phone.span.end, 2.5, 0.05);
  }
}

}  // namespace
}  // namespace mouthpiece
