#include "singing/song.h"

#include <gtest/gtest.h>

#include "base/errors.h"

namespace mouthpiece {
namespace {

TEST(Song, NamesOfPitches) {
  EXPECT_DOUBLE_EQ(midiPitchFromName("C4", "", ""), 60);
  EXPECT_DOUBLE_EQ(midiPitchFromName("A4", "", ""), 69);
  EXPECT_DOUBLE_EQ(midiPitchFromName("F#3", "", ""), 54);
  EXPECT_DOUBLE_EQ(midiPitchFromName("Bb4", "", ""), 70);
  EXPECT_DOUBLE_EQ(midiPitchFromName("A4+20", "", ""), 69.2);
  EXPECT_DOUBLE_EQ(hzOfMidiPitch(69), 440);
  for (const char* bad : {"", "C", "H4", "C#", "c4", "C4x", "C44", "C4+", "C4+200", "C4+nan"}) {
    EXPECT_THROW(midiPitchFromName(bad, "", ""), InputError) << bad;
  }
}

TEST(Song, ReadsTiesRestsAndVibrato) {
  const Song song = parseSongJson(R"({"title":"t","tempo":120,"words":[{"rest":1},
      {"word":"Glory","notes":[{"pitch":"C4","beats":1},{"pitch":"D4","beats":1,"tie":true},
                               {"pitch":62,"beats":2,"vibrato":true}]},{"rest":0.5}]})",
                                  "s");
  ASSERT_EQ(song.words.size(), 1U);
  EXPECT_EQ(song.words[0].text, "glory");
  ASSERT_EQ(song.words[0].syllables.size(), 2U);
  EXPECT_EQ(song.words[0].syllables[0].size(), 2U);
  EXPECT_TRUE(song.words[0].syllables[1][0].vibrato);
  EXPECT_DOUBLE_EQ(song.duration(), 5.5 * 0.5);
  EXPECT_EQ(song.lyrics(), "glory");
}

TEST(Song, RefusesWhatCannotBeSung) {
  const auto with = [](const std::string& words) { return R"({"tempo":100,"words":[)" + words + "]}"; };
  for (const std::string& bad :
       {std::string("["), std::string("[]"), std::string("{}"), with(""), with("{}"), with("1"),
        with(R"({"word":"a"})"), with(R"({"word":"a","notes":[]})"),
        with(R"({"word":"","notes":[{"pitch":60,"beats":1}]})"),
        with(R"({"word":"a (quit","notes":[{"pitch":60,"beats":1}]})"),
        with(R"({"word":"a<b>","notes":[{"pitch":60,"beats":1}]})"),
        with(R"({"word":"a","notes":[{"pitch":60,"beats":0}]})"),
        with(R"({"word":"a","notes":[{"pitch":60,"beats":-1}]})"),
        with(R"({"word":"a","notes":[{"pitch":600,"beats":1}]})"),
        with(R"({"word":"a","notes":[{"pitch":60,"beats":1e9}]})"),
        with(R"({"word":"a","notes":[{"pitch":60,"beats":1,"tie":true}]})"), with(R"({"rest":-1})"),
        std::string(R"({"tempo":0,"words":[{"word":"a","notes":[{"pitch":60,"beats":1}]}]})"),
        std::string(10000, '[')}) {
    EXPECT_THROW(parseSongJson(bad, "s"), InputError) << bad.substr(0, 80);
  }
}

TEST(Song, ShippedSongsAreFine) {
  for (const char* name : {"twinkle", "gloria"}) {
    const Song song = readSong(std::string(MOUTHPIECE_SOURCE_DIR "/sample_data/songs/") + name + ".json");
    EXPECT_GT(song.duration(), 15);
    EXPECT_FALSE(song.title.empty());
  }
}

std::string score(const std::string& notes) {
  return "<?xml version=\"1.0\"?><!DOCTYPE score-partwise PUBLIC \"-//Recordare//DTD MusicXML 3.1 Partwise//EN\" "
         "\"http://www.musicxml.org/dtds/partwise.dtd\"><score-partwise><part id=\"P1\"><measure number=\"1\">"
         "<attributes><divisions>2</divisions></attributes><direction><sound tempo=\"90\"/></direction>" +
         notes + "</measure></part></score-partwise>";
}

std::string note(const std::string& step, int octave, int duration, const std::string& more) {
  return "<note><pitch><step>" + step + "</step><octave>" + std::to_string(octave) + "</octave></pitch><duration>" +
         std::to_string(duration) + "</duration>" + more + "</note>";
}

std::string lyric(const std::string& syllabic, const std::string& text) {
  return "<lyric><syllabic>" + syllabic + "</syllabic><text>" + text + "</text></lyric>";
}

TEST(MusicXml, ReadsOneVoiceWithLyrics) {
  const Song song = parseMusicXml(
      score("<note><rest/><duration>2</duration></note>" + note("C", 4, 2, lyric("begin", "Twin")) +
            note("C", 4, 2, lyric("end", "kle,")) + note("G", 4, 2, lyric("single", "star") + "<tie type=\"start\"/>") +
            note("G", 4, 4, "<tie type=\"stop\"/>") + note("A", 4, 1, "") + "<note><chord/>" +
            "<pitch><step>E</step><octave>5</octave></pitch><duration>1</duration></note>"),
      "x");
  EXPECT_DOUBLE_EQ(song.beats_per_minute, 90);
  EXPECT_DOUBLE_EQ(song.first_rest_beats, 1);
  ASSERT_EQ(song.words.size(), 2U);
  EXPECT_EQ(song.words[0].text, "twinkle");
  EXPECT_EQ(song.words[0].syllables.size(), 2U);
  EXPECT_EQ(song.words[1].text, "star");
  ASSERT_EQ(song.words[1].syllables.size(), 1U);
  ASSERT_EQ(song.words[1].syllables[0].size(), 2U);  // the tie is one note; the A is a melisma
  EXPECT_DOUBLE_EQ(song.words[1].syllables[0][0].beats, 3);
  EXPECT_DOUBLE_EQ(song.words[1].syllables[0][1].midi_pitch, 69);
}

TEST(MusicXml, ANoteThatNamesNoVoiceIsOfTheFirst) {
  const Song song = parseMusicXml(
      score("<note><rest/><duration>2</duration></note>" + note("C", 4, 2, "<voice>1</voice>" + lyric("single", "la")) +
            note("E", 4, 2, "<voice>2</voice>" + lyric("single", "no"))),
      "x");
  EXPECT_EQ(song.lyrics(), "la");
}

TEST(MusicXml, RefusesHostileInput) {
  std::string deep = "<score-partwise>";
  for (int i = 0; i < 100; ++i) deep += "<a>";
  for (int i = 0; i < 100; ++i) deep += "</a>";
  deep += "</score-partwise>";
  for (const std::string& bad :
       {std::string(""), std::string("<"), std::string("<a/>"), std::string("<score-timewise/>"),
        std::string("<score-partwise/>"), deep,
        std::string("<!DOCTYPE a [<!ENTITY b \"bbbb\"><!ENTITY c \"&b;&b;\">]><score-partwise>&c;</score-partwise>"),
        score(""), score(note("H", 4, 1, lyric("single", "a"))), score(note("C", 4, 0, lyric("single", "a"))),
        score(note("C", 4, 99999999, lyric("single", "a"))), score("<note>" + lyric("single", "a") + "</note>")}) {
    EXPECT_THROW(parseMusicXml(bad, "x"), InputError) << bad.substr(0, 100);
  }
}

}  // namespace
}  // namespace mouthpiece
