#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "base/errors.h"
#include "singing/song.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

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
  EXPECT_DOUBLE_EQ(song.words[0].span().start, 60.0 / 90) << "a beat of rest at 90 a minute";
  ASSERT_EQ(song.words.size(), 2U);
  EXPECT_EQ(song.words[0].text, "twinkle");
  EXPECT_EQ(song.words[0].syllables.size(), 2U);
  EXPECT_EQ(song.words[1].text, "star");
  ASSERT_EQ(song.words[1].syllables.size(), 1U);
  const std::vector<Note>& star = song.words[1].syllables[0].notes;
  ASSERT_EQ(star.size(), 2U) << "the tie is one note; the A is a melisma";
  EXPECT_DOUBLE_EQ(star[0].span.duration(), 3 * 60.0 / 90);
  EXPECT_DOUBLE_EQ(star[1].hz, 440);
}

TEST(MusicXml, KanaAreSungByTheirSounds) {
  const Song song = parseMusicXml(score(note("C", 4, 2, lyric("begin", "さ")) + note("D", 4, 2, lyric("end", "き")) +
                                        note("E", 4, 2, lyric("single", "ゆ"))),
                                  "x");
  ASSERT_EQ(song.words.size(), 2U);
  EXPECT_EQ(song.words[0].text, "さき");
  EXPECT_EQ(song.words[0].said.ipa, (std::vector<std::string>{"s", "a", "kʲ", "i"}));
  EXPECT_EQ(song.words[0].syllables.size(), 2U);
  EXPECT_THROW(parseMusicXml(score(note("C", 4, 2, lyric("single", "桜"))), "x"), InputError);
}

TEST(MusicXml, ATieEndsWhereARestBegins) {
  const std::string rest = "<note><rest/><duration>2</duration></note>";
  const Song song = parseMusicXml(score(note("C", 4, 2, lyric("single", "la") + "<tie type=\"start\"/>") + rest +
                                        note("C", 4, 2, "<tie type=\"stop\"/>") + note("D", 4, 2, lyric("end", "lo"))),
                                  "x");
  ASSERT_EQ(song.words.size(), 2U);
  EXPECT_DOUBLE_EQ(song.words[0].end(), 60.0 / 90);
  EXPECT_DOUBLE_EQ(song.words[1].span().start, 3 * 60.0 / 90) << "a note without a word after a rest is no one's";
}

TEST(MusicXml, TemposHoldFromWhereTheyStand) {
  const std::string later = "<direction><sound tempo=\"200\"/></direction>";
  const Song song = parseMusicXml(score(note("C", 4, 2, lyric("single", "la")) + later + note("D", 4, 2, "")), "x");
  EXPECT_DOUBLE_EQ(song.duration, 60.0 / 90 + 60.0 / 200);
}

/// A score of parts, each of measures, as notation programs write them.
std::string parts(const std::vector<std::vector<std::string>>& measures_of) {
  std::string xml = "<score-partwise>";
  for (const std::vector<std::string>& measures : measures_of) {
    xml += "<part>";
    for (const std::string& measure : measures) {
      xml += "<measure>" +
             std::string(&measure == &measures.front() ? "<attributes><divisions>1</divisions></attributes>" : "") +
             measure + "</measure>";
    }
    xml += "</part>";
  }
  return xml + "</score-partwise>";
}

std::string sungOn(const std::string& word, int quarters, const std::string& more = "") {
  return note("C", 4, quarters, more + lyric("single", word));
}

std::string verses(const std::string& first, const std::string& second) {
  return note(
      "C", 4, 1,
      "<lyric number=\"1\"><text>" + first + "</text></lyric><lyric number=\"2\"><text>" + second + "</text></lyric>");
}

const std::string kRepeatBegins = "<barline location=\"left\"><repeat direction=\"forward\"/></barline>";
const std::string kRepeatEnds = "<barline location=\"right\"><repeat direction=\"backward\"/></barline>";

std::string ending(const std::string& number, const std::string& type, const std::string& more = "") {
  return "<barline><ending number=\"" + number + "\" type=\"" + type + "\"/>" + more + "</barline>";
}

TEST(MusicXml, AnotherPartTellsTheTempo) {
  const std::string tempo =
      "<direction><direction-type><metronome><beat-unit>half</beat-unit><beat-unit-dot/>"
      "<per-minute>c. 40</per-minute></metronome></direction-type></direction>";
  const Song song = parseMusicXml(parts({{tempo + note("C", 4, 4, "")}, {sungOn("la", 4)}}), "x");
  EXPECT_DOUBLE_EQ(song.duration, 4 * 60.0 / 120) << "three quarters forty times a minute";
}

TEST(MusicXml, ThePlaceOfANoteIsWhereTheScoreIs) {
  const std::string tempo = "<sound tempo=\"60\"/>";
  const Song forward = parseMusicXml(
      parts({{tempo + sungOn("la", 1) + "<forward><duration>2</duration></forward>" + sungOn("le", 1)}}), "x");
  ASSERT_EQ(forward.words.size(), 2U);
  EXPECT_NEAR(forward.words[1].span().start, 3, 1e-9);
  const Song cue = parseMusicXml(
      parts({{tempo + "<note><cue/><pitch><step>C</step><octave>4</octave></pitch><duration>3</duration></note>" +
              sungOn("la", 1)}}),
      "x");
  EXPECT_NEAR(cue.words[0].span().start, 3, 1e-9) << "behind another's cue";
}

TEST(MusicXml, TheVoiceWithTheWordsSings) {
  const Song song = parseMusicXml(parts({{"<sound tempo=\"60\"/>" + note("G", 5, 2, "<voice>1</voice>") +
                                          "<backup><duration>2</duration></backup>" +
                                          sungOn("la", 1, "<voice>2</voice>") + sungOn("le", 1, "<voice>2</voice>")}}),
                                  "x");
  EXPECT_EQ(song.lyrics(), "la le");
  EXPECT_NEAR(song.words[1].span().start, 1, 1e-9);
}

TEST(MusicXml, TransposingPartsSoundAsTheySound) {
  const Song song = parseMusicXml(
      parts({{"<attributes><transpose><chromatic>-2</chromatic><octave-change>-1</octave-change></transpose>"
              "</attributes>" +
              sungOn("la", 1)}}),
      "x");
  EXPECT_NEAR(song.notes()[0].hz, hzOfMidiPitch(60 - 14), 1e-9);
}

TEST(MusicXml, RepeatsAreSungWithTheNextVerse) {
  const auto lyrics = [](const std::vector<std::string>& measures) {
    return parseMusicXml(parts({measures}), "x").lyrics();
  };
  EXPECT_EQ(lyrics({sungOn("in", 1), kRepeatBegins + verses("one", "two") + kRepeatEnds, sungOn("out", 1)}),
            "in one two out");
  EXPECT_EQ(lyrics({verses("one", "two"), sungOn("again", 1) + kRepeatEnds}), "one again two again")
      << "a refrain has one verse";
  const auto second = [](const std::string& word) {
    return note("C", 4, 1, "<lyric number=\"2\"><text>" + word + "</text></lyric>");
  };
  EXPECT_EQ(lyrics({verses("one", "two"), second("more") + kRepeatEnds}), "one two more")
      << "what the second verse alone has is not of the first";
  EXPECT_EQ(lyrics({verses("one", "two") + kRepeatEnds, kRepeatBegins + second("later") + kRepeatEnds}),
            "one two later later")
      << "a part of the song may have one verse, whatever its number";
  EXPECT_EQ(lyrics({second("alone")}), "alone");
  EXPECT_EQ(lyrics({verses("one", "two"), ending("1", "start") + sungOn("a", 1) + ending("1", "stop") + kRepeatEnds,
                    ending("2", "start") + sungOn("b", 1) + ending("2", "stop"), sungOn("c", 1)}),
            "one a two b c");
  EXPECT_EQ(lyrics({sungOn("v", 1), ending("1, 2", "start") + sungOn("a", 1) + ending("1, 2", "stop") + kRepeatEnds,
                    ending("3", "start") + sungOn("b", 1) + ending("3", "discontinue")}),
            "v a v a v b");
  EXPECT_EQ(lyrics({sungOn("a", 1) + "<direction><sound fine=\"yes\"/></direction>",
                    sungOn("b", 1) + "<direction><sound dacapo=\"yes\"/></direction>"}),
            "a b a");
  EXPECT_EQ(
      lyrics({sungOn("a", 1), "<sound segno=\"s\"/>" + sungOn("b", 1) + "<direction><sound tocoda=\"c\"/></direction>",
              sungOn("c", 1) + "<direction><sound dalsegno=\"s\"/></direction>",
              "<sound coda=\"c\"/>" + sungOn("d", 1)}),
      "a b c b d");
  // What lies behind a jump was not played before: its repeats and endings are.
  const std::string jump = "<direction><sound dalsegno=\"s\"/></direction>";
  EXPECT_EQ(lyrics({"<sound segno=\"s\"/>" + sungOn("a", 1) + "<direction><sound tocoda=\"c\"/></direction>",
                    sungOn("b", 1) + jump, "<sound coda=\"c\"/>" + kRepeatBegins + sungOn("c", 1),
                    ending("1", "start") + sungOn("d", 1) + ending("1", "stop") + kRepeatEnds,
                    ending("2", "start") + sungOn("e", 1) + ending("2", "stop")}),
            "a b a c d c e");
  // A last ending without an end of its own.
  EXPECT_EQ(
      lyrics({sungOn("a", 1), ending("1", "start") + sungOn("b", 1) + ending("1", "stop") + kRepeatEnds,
              ending("2", "start") + sungOn("c", 1), kRepeatBegins + sungOn("d", 1) + kRepeatEnds, sungOn("e", 1)}),
      "a b a c d d e");
  const Song slow = parseMusicXml(
      parts({{"<sound tempo=\"60\"/>" + sungOn("a", 1), "<sound tempo=\"30\"/>" + sungOn("b", 1) + kRepeatEnds}}), "x");
  EXPECT_NEAR(slow.duration, 1 + 2 + 1 + 2, 1e-9) << "the first measure has its own tempo again";
}

TEST(MusicXml, AVerseIsNotMixedWithAnother) {
  const Song song = parseMusicXml(
      parts({{verses("one", "two") + note("D", 4, 1, "<lyric number=\"2\"><text>more</text></lyric>")}}), "x");
  EXPECT_EQ(song.lyrics(), "one");
}

TEST(MusicXml, WordsMayShareANote) {
  const Song song = parseMusicXml(
      parts(
          {{"<sound tempo=\"60\"/>" + note("C", 4, 1, lyric("begin", "glo")) + note("C", 4, 1, lyric("middle", "ri")) +
            note("C", 4, 2,
                 "<lyric><syllabic>end</syllabic><text>a</text><elision>_</elision><text>in</text></lyric>") +
            sungOn("1. oh\xC2\xA0my", 2)}}),
      "x");
  EXPECT_EQ(song.lyrics(), "gloria in oh my");
  EXPECT_NEAR(song.words[1].span().start, 3, 1e-9);
  EXPECT_NEAR(song.words[3].span().start, 5, 1e-9);
}

TEST(MusicXml, AWordIsSungThroughARest) {
  const std::string rest = "<note><rest/><duration>1</duration></note>";
  const Song song = parseMusicXml(parts({{"<sound tempo=\"60\"/>" + note("C", 4, 1, lyric("begin", "hap")) + rest +
                                          note("C", 4, 1, lyric("end", "py"))}}),
                                  "x");
  ASSERT_EQ(song.lyrics(), "happy");
  EXPECT_NEAR(song.words[0].syllables[1].notes[0].span.start, 2, 1e-9);
}

TEST(MusicXml, RapHasNoPitch) {
  const std::string spoken = "<note><unpitched/><duration>1</duration>" + lyric("single", "yo") + "</note>";
  EXPECT_EQ(parseMusicXml(parts({{spoken}}), "x").lyrics(), "yo");
}

TEST(MusicXml, LettersOfOtherAlphabets) {
  EXPECT_EQ(
      parseMusicXml(parts({{sungOn("F\xC3\xBCr", 1) + sungOn("wei\xC3\x9F", 1) + sungOn("cafe\xCC\x81", 1)}}), "x")
          .lyrics(),
      "fur weiss cafe");
  EXPECT_EQ(errorOf([] { parseMusicXml(parts({{sungOn("\xD0\xBB\xD1\x8E", 1)}}), "x"); }),
            "x:measure ?: found the lyric '\xD0\xBB\xD1\x8E'; expected Latin letters or kana");
}

TEST(MusicXml, NotesBeforeTheFirstWordAreRest) {
  const Song song = parseMusicXml(score(note("G", 3, 4, "") + note("C", 4, 2, lyric("single", "la"))), "x");
  ASSERT_EQ(song.notes().size(), 1U);
  EXPECT_DOUBLE_EQ(song.notes()[0].span.start, 2 * 60.0 / 90);
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

TEST(MusicXml, SaysWhatIsWrongAndInWhichMeasure) {
  const auto said = [](const std::string& notes) { return errorOf([&] { parseMusicXml(score(notes), "a.xml"); }); };
  const std::string la = note("C", 4, 2, lyric("single", "la"));
  ASSERT_EQ(said(la), "no error");
  EXPECT_EQ(said(note("C", 4, 2, "")), "a.xml: has no part with lyrics; expected one voice with lyrics");
  EXPECT_EQ(said(la + "<note><duration>2</duration></note>"),
            "a.xml:measure 1: has a note without pitch; expected a pitch or a rest");
  EXPECT_EQ(said(la + "<note><rest/></note>"), "a.xml:measure 1: has a note without duration; expected one");
  EXPECT_EQ(said(la + note("C", 4, 30000, "")), "a.xml:measure 1: has a note of 15000 beats");
  EXPECT_EQ(said(la + "<attributes><divisions>0</divisions></attributes>"),
            "a.xml:measure 1: has 0 divisions; expected 1 or more");
  EXPECT_EQ(said(la + "<attributes><divisions>few</divisions></attributes>"),
            "a.xml:measure 1: has divisions 'few'; expected a number");
  EXPECT_EQ(said(note("C", 4, 2, lyric("single", "la") + "<tie type=\"start\"/>")), "no error") << "it rings on";
  EXPECT_EQ(said(la + note("C", 4, 2, "<alter>x</alter>")), "no error") << "an alteration is the pitch's";
  const auto file = [](const std::string& text) { return errorOf([&] { parseMusicXml(text, "a.xml"); }); };
  EXPECT_EQ(file("<score-timewise/>"), "a.xml: is score-timewise; expected score-partwise");
  EXPECT_EQ(file("<html/>"), "a.xml: is no MusicXML score; expected score-partwise");
  EXPECT_EQ(file("<!ENTITY b \"c\">"), "a.xml: defines entities; expected plain MusicXML");
  EXPECT_EQ(file("<score-partwise>").substr(0, 11), "a.xml:byte ");
}

}  // namespace
}  // namespace mouthpiece
