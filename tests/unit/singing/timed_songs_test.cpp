// Songs of files that say when each note begins: MIDI with lyrics, UST, subtitles; and packed MusicXML.
#include <gtest/gtest.h>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/zip.h"
#include "singing/song.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

/// A MIDI file of one track, put together event by event; 480 ticks a quarter.
class Midi {
 public:
  Midi& meta(int delta, int kind, std::string_view data) {
    length(delta);
    track_ += {'\xFF', static_cast<char>(kind), static_cast<char>(data.size())};
    track_ += data;
    return *this;
  }
  Midi& word(std::string_view text, int delta = 0) { return meta(delta, 5, text); }
  Midi& on(int pitch, int channel = 0) { return event(0, 0x90 + channel, pitch, 0x40); }
  Midi& off(int pitch, int delta, int channel = 0) { return event(delta, 0x80 + channel, pitch, 0); }
  Midi& note(int pitch, int ticks, int rest = 0) {
    track_ += {'\0', '\x90', static_cast<char>(pitch), '\x40'};
    length(ticks);
    track_ += {'\x80', static_cast<char>(pitch), '\0'};
    return rest > 0 ? meta(rest, 6, "") : *this;
  }
  [[nodiscard]] std::string bytes() const {
    ByteWriter file(ByteOrder::kBig);
    file.writeBytes("MThd");
    file.writeU32(6);
    for (const int value : {0, 1, 480}) file.writeU16(value);
    file.writeBytes("MTrk");
    file.writeU32(track_.size() + 4);
    file.writeBytes(track_);
    file.writeBytes(std::string("\0\xFF\x2F\0", 4));
    return file.takeBytes();
  }

 private:
  Midi& event(int delta, int status, int pitch, int value) {
    length(delta);
    track_ += {static_cast<char>(status), static_cast<char>(pitch), static_cast<char>(value)};
    return *this;
  }
  void length(int ticks) {
    if (ticks >= 128) track_ += static_cast<char>(0x80 | ticks >> 7);
    track_ += static_cast<char>(ticks & 0x7F);
  }
  std::string track_;
};

std::string wordsOf(const Song& song) {
  std::string words;
  for (const SongWord& word : song.words)
    words += (words.empty() ? "" : " ") + word.text + "/" + std::to_string(word.syllables.size());
  return words;
}

TEST(MidiSong, ARhythmGamesVocalsAreWords) {
  // Hyphens go on with the word, + with the syllable; note 105 marks a phrase, # what is spoken.
  const std::string bytes = Midi()
                                .meta(0, 3, "PART VOCALS")
                                .meta(0, 0x51, std::string("\x07\xA1\x20", 3))  // 120 quarters a minute
                                .word("[play]")
                                .word("Twin-")
                                .note(60, 240)
                                .word("kle")
                                .note(62, 240)
                                .word("+")
                                .note(64, 240, 480)
                                .word("star#")
                                .note(65, 480)
                                .note(105, 240)
                                .bytes();
  const Song song = parseMidi(bytes, "a.mid");
  EXPECT_EQ(wordsOf(song), "twinkle/2 star/1");
  EXPECT_EQ(song.words[0].syllables[1].notes.size(), 2U) << "a melisma";
  EXPECT_NEAR(song.words[0].span().start, 0, 1e-9);
  EXPECT_NEAR(song.words[0].syllables[1].notes[0].span.start, 0.25, 1e-6);
  EXPECT_NEAR(song.words[0].end(), 0.75, 1e-6);
  EXPECT_NEAR(song.words[1].span().start, 1.25, 1e-6) << "after a quarter's rest";
  EXPECT_NEAR(song.words[1].syllables[0].notes[0].hz, hzOfMidiPitch(65), 1e-6);
}

TEST(MidiSong, KaraokesWordsAreToldByBlanks) {
  const std::string bytes = Midi()
                                .word("@TTitle")
                                .word("\\Twin")
                                .note(60, 480)
                                .word("kle")
                                .note(62, 480)
                                .word(" lit")
                                .note(64, 480)
                                .word("tle")
                                .note(65, 480)
                                .word("/star")
                                .note(67, 480)
                                .bytes();
  EXPECT_EQ(wordsOf(parseMidi(bytes, "a.kar")), "twinkle/2 little/2 star/1");
}

TEST(MidiSong, WordsMayBeBesideTheirNotes) {
  const std::string bytes = Midi()
                                .word("one ", 10)
                                .note(60, 470)
                                .word("two ", 470)
                                .note(62, 480, 8)
                                .word("three ", 500)
                                .note(64, 480, 9)
                                .bytes();
  EXPECT_EQ(wordsOf(parseMidi(bytes, "a.kar")), "one/1 two/1 three/1");
}

TEST(MidiSong, NotesWithoutWordsBehindAPauseAreAnothers) {
  Midi midi;
  midi.word("one ").note(60, 480).word("two ").note(62, 480).note(64, 480).note(65, 480, 960);
  const Song song = parseMidi(midi.note(67, 480).note(69, 480).word("three ").note(64, 480).bytes(), "a.kar");
  ASSERT_EQ(wordsOf(song), "one/1 two/1 three/1");
  EXPECT_NEAR(song.words[1].end(), 2.0, 0.02) << "its melisma, and nothing behind the pause";
  EXPECT_NEAR(song.words[2].span().start, 4.0, 0.02);
}

TEST(MidiSong, AWordPartsANoteThatGoesOn) {
  const std::string bytes = Midi().word("hap").on(60).word("py ", 480).off(60, 480).bytes();
  const Song song = parseMidi(bytes, "a.kar");
  ASSERT_EQ(wordsOf(song), "happy/2");
  EXPECT_NEAR(song.words[0].syllables[1].notes[0].span.start, 0.5, 1e-6);
}

TEST(MidiSong, ALinesEndEndsAWord) {
  EXPECT_EQ(
      wordsOf(parseMidi(Midi().word("lit").note(60, 480).word("tle\r").note(60, 480).word("star").note(60, 480).bytes(),
                        "a.kar")),
      "little/2 star/1");
  EXPECT_EQ(
      wordsOf(parseMidi(
          Midi().word("a ").note(60, 480).word("lit").note(60, 470).word("\r", 10).word("star").note(60, 480).bytes(),
          "a.kar")),
      "a/1 lit/1 star/1");
}

/// A file whose words go on by hyphens stays one where its lines end.
TEST(MidiSong, ALinesEndMakesNoWordsOfHyphens) {
  const Song song = parseMidi(Midi()
                                  .word("hel-")
                                  .note(60, 480)
                                  .word("lo")
                                  .note(60, 480)
                                  .word("sun\r")
                                  .note(60, 480)
                                  .word("and")
                                  .note(60, 480)
                                  .bytes(),
                              "a.mid");
  EXPECT_EQ(song.words.size(), 3U);
}

TEST(MidiSong, TheMelodyIsAChannelOfItsOwn) {
  // All in one track, as format 0 has it: drums on every word, chords that end first, and the melody.
  Midi file;
  for (const char* word : {"one ", "two ", "three "}) {
    file.word(word).on(36, 9).on(48, 1).on(52, 1).on(64, 3).off(48, 120, 1).off(52, 0, 1).off(36, 0, 9);
    file.on(48, 1).off(48, 120, 1).off(64, 240, 3);
  }
  const Song song = parseMidi(file.bytes(), "a.mid");
  ASSERT_EQ(wordsOf(song), "one/1 two/1 three/1");
  for (const Note& note : song.notes()) EXPECT_NEAR(note.hz, hzOfMidiPitch(64), 1e-9);
}

TEST(MidiSong, TheTempoMayChange) {
  const std::string bytes = Midi()
                                .word("one")
                                .note(60, 480)  // half a second at the usual 120
                                .meta(0, 0x51, std::string("\x0F\x42\x40", 3))
                                .word("two")
                                .note(60, 480)
                                .bytes();
  const Song song = parseMidi(bytes, "a.mid");
  EXPECT_NEAR(song.words[1].span().start, 0.5, 1e-6);
  EXPECT_NEAR(song.words[1].end(), 1.5, 1e-6);
}

TEST(MidiSong, RefusesWhatItCannotSing) {
  const std::string whole = Midi().word("one").note(60, 480).bytes();
  for (std::size_t size = 0; size < whole.size() - 6; ++size)
    EXPECT_THROW(parseMidi(whole.substr(0, size), "cut.mid"), InputError) << size;
  EXPECT_THROW(parseMidi(Midi().note(60, 480).bytes(), "mute.mid"), InputError);
  EXPECT_THROW(parseMidi(Midi().word("one").bytes(), "still.mid"), InputError);
  EXPECT_THROW(parseMidi(Midi().word("\xFE\xFF").note(60, 480).bytes(), "empty.mid"), InputError);
  std::string film = whole;
  film[12] = '\xE7';
  EXPECT_THROW(parseMidi(film, "film.mid"), InputError);
}

/// What is wrong is told with its place, as in every other file.
TEST(MidiSong, SaysWhatIsWrongWithAFile) {
  const std::string whole = Midi().word("one").note(60, 480).bytes();
  const auto with = [&](std::size_t at, std::string_view bytes) {
    std::string changed = whole;
    changed.replace(at, bytes.size(), bytes);
    return errorOf([&] { parseMidi(changed, "a.mid"); });
  };
  using namespace std::string_view_literals;
  constexpr std::size_t kEvents = 22;  // behind both chunks' heads
  EXPECT_EQ(with(0, "RIFF"), "a.mid: is no standard MIDI file");
  EXPECT_EQ(with(4, "\0\0\0\5"sv), "a.mid:byte 8: found a header that is too short");
  EXPECT_EQ(with(8, "\0\2"sv), "a.mid:byte 10: found format 2; expected 0 or 1");
  EXPECT_EQ(with(12, "\xE7"), "a.mid:byte 14: found times by film frames; expected ticks a quarter");
  EXPECT_EQ(with(12, "\0\0"sv), "a.mid:byte 14: found times by film frames; expected ticks a quarter");
  EXPECT_EQ(with(kEvents, "\xFF\xFF\xFF\xFF"), "a.mid:byte 26: found a length of over four bytes");
  EXPECT_EQ(with(kEvents + 1, "\x40"), "a.mid:byte 24: found data without a status");
  EXPECT_EQ(errorOf([] { parseMidi(Midi().note(60, 480).bytes(), "a.mid"); }),
            "a.mid: holds no lyrics; expected a MIDI file with words on its notes");
  EXPECT_EQ(errorOf([] { parseMidi(Midi().word("one").bytes(), "a.mid"); }),
            "a.mid: has no note that begins with a word; expected a melody with its lyrics");
  EXPECT_EQ(errorOf([] { parseMidi(Midi().word("one").note(100, 480).bytes(), "a.mid"); }),
            "a.mid: has no note that begins with a word; expected a melody with its lyrics")
      << "a mark of a rhythm game";
}

TEST(MidiSong, WhatIsNeitherNoteNorWordIsPassedOver) {
  // A controller, a program, a system message, running status, and a chunk of another kind behind the track.
  using namespace std::string_literals;
  const std::string events =
      "\0\xB0\x07\x64\0\xC0\x05\0\xF0\x02\x01\xF7\0\xFF\x05\x02la\0\x90\x3C\x40\x60\x3C\0\0\xFF\x2F\0"s;
  ByteWriter file(ByteOrder::kBig);
  file.writeBytes("MThd");
  file.writeU32(6);
  for (const int value : {1, 1, 480}) file.writeU16(value);
  file.writeBytes("MTrk");
  file.writeU32(events.size());
  file.writeBytes(events);
  file.writeBytes("XFIH");
  file.writeU32(100);
  const Song song = parseMidi(file.takeBytes(), "a.mid");
  EXPECT_EQ(wordsOf(song), "la/1");
  EXPECT_NEAR(song.words[0].span().duration(), 0.1, 1e-6) << "96 ticks of 480 at 120 quarters a minute";
}

constexpr const char* kUst =
    "[#VERSION]\nUST Version1.2\n[#SETTING]\nTempo=120.00\nProjectName=Mine\n"
    "[#0000]\nLength=480\nLyric=R\nNoteNum=60\n[#0001]\nLength=240\nLyric=hap\nNoteNum=60\n"
    "[#0002]\nLength=240\nLyric=+py\nNoteNum=62\nVBR=65,180\n[#0003]\nLength=480\nLyric=-\n"
    "NoteNum=64\n[#0004]\nLength=960\nLyric=day\nNoteNum=65\nTempo=60\n[#TRACKEND]\n";

TEST(UstSong, ReadsNotesRestsAndWords) {
  const Song song = parseUst(kUst, "a.ust");
  EXPECT_EQ(song.title, "Mine");
  EXPECT_EQ(wordsOf(song), "happy/2 day/1");
  EXPECT_NEAR(song.words[0].span().start, 0.5, 1e-6);
  EXPECT_TRUE(song.words[0].syllables[1].notes[0].vibrato);
  EXPECT_EQ(song.words[0].syllables[1].notes.size(), 2U);
  EXPECT_NEAR(song.words[1].span().duration(), 2, 1e-6) << "960 ticks at 60 quarters a minute";
  for (const char* bad : {"", "[#0000]\nLength=x\nLyric=a\nNoteNum=60\n", "[#0000]\nLength=-1\nLyric=a\nNoteNum=60\n",
                          "[#SETTING]\nTempo=0\n[#0000]\nLength=480\nLyric=a\nNoteNum=60\n",
                          "[#0000]\nLength=480\nLyric=a\nNoteNum=999\n"})
    EXPECT_THROW(parseUst(bad, "bad.ust"), InputError) << bad;
}

TEST(UstSong, SaysWhatIsWrongWithAFile) {
  const auto said = [](const std::string& text) { return errorOf([&] { parseUst(text, "a.ust"); }); };
  const std::string note = "[#0000]\nLength=480\nLyric=a\nNoteNum=60\n";
  EXPECT_EQ(said(note), "no error");
  EXPECT_EQ(said("[#SETTING]\nTempo=5\n" + note), "a.ust:2: found a tempo of 5; expected 10 to 600");
  EXPECT_EQ(said("[#SETTING]\nTempo=601\n" + note), "a.ust:2: found a tempo of 601; expected 10 to 600");
  EXPECT_EQ(said("[#SETTING]\nTempo=120,5\n" + note), "no error") << "an early UTAU's comma";
  EXPECT_EQ(said("[#0000]\nLength=many\n"), "a.ust:2: found 'many'; expected a number");
  EXPECT_EQ(said("[#0000]\nLength=480\nLyric=a\nNoteNum=1e99\n"), "a.ust:4: found '1e99'; expected a number");
  EXPECT_EQ(said(note + "[#0001]\nLyric=b\nNoteNum=60\n"), "a.ust:5: found a length of 0 ticks");
  EXPECT_EQ(said("[#0000]\nLength=480\nLyric=R\nNoteNum=60\n"),
            "a.ust: holds no sung note; expected sections [#0000] with Length, Lyric and NoteNum");
}

/// A UST of notes of half a second each, in Japanese.
std::string ustOf(const std::vector<std::string>& lyrics) {
  std::string ust = "[#SETTING]\nTempo=60.00\n";
  for (const std::string& lyric : lyrics) ust += "[#0000]\nLength=240\nLyric=" + lyric + "\nNoteNum=60\n";
  return ust + "[#TRACKEND]\n";
}

/// The sounds of each word between blanks.
std::string soundsOf(const Song& song) {
  std::string sounds;
  for (const SongWord& word : song.words) {
    sounds += sounds.empty() ? "" : " ";
    for (const std::string& symbol : word.said.ipa) sounds += symbol;
  }
  return sounds;
}

TEST(UstSong, KanaAreWordsOfTheirSounds) {
  const Song song = parseUst(ustOf({"き", "ら", "キ", "ラ", "R", "ほ", "し"}), "a.ust");
  EXPECT_EQ(wordsOf(song), "き/1 ら/1 キ/1 ラ/1 ほ/1 し/1");
  EXPECT_EQ(soundsOf(song), "kʲi ɾa kʲi ɾa ho ɕi");
  EXPECT_NEAR(song.words[4].span().start, 2.5, 1e-6) << "after a rest";
  EXPECT_EQ(song.words[0].said.heard.size(), song.words[0].said.phones.size());
}

TEST(UstSong, RestIsAWordOfEnglish) {
  EXPECT_EQ(wordsOf(parseUst(ustOf({"let", "it", "rest", "R", "now"}), "a.ust")), "let/1 it/1 rest/1 now/1");
}

TEST(UstSong, WhatVoiceBanksWriteAroundKanaIsLeftOut) {
  EXPECT_EQ(soundsOf(parseUst(ustOf({"- か", "a き", "i く↑", "u けA4", "e R", "息", "_さ2"}), "a.ust")),
            "ka kʲi kɯ ke sa");
}

TEST(UstSong, NAndDoubledConsonantsGoByWhatFollows) {
  EXPECT_EQ(soundsOf(parseUst(ustOf({"さ", "ん", "ぽ", "R", "ほ", "ん"}), "a.ust")), "sa m po ho ɴ");
  EXPECT_EQ(soundsOf(parseUst(ustOf({"か", "ん", "た", "ん"}), "a.ust")), "ka n ta ɴ");
  EXPECT_EQ(soundsOf(parseUst(ustOf({"き", "っ", "と"}), "a.ust")), "kʲi tːo") << "the closing is a rest";
  EXPECT_NEAR(parseUst(ustOf({"き", "っ", "と"}), "a.ust").words[1].span().start, 1.0, 1e-6);
  EXPECT_EQ(soundsOf(parseUst(ustOf({"きっ", "と", "きっ", "R", "と"}), "a.ust")), "kʲi tːo kʲi to");
}

TEST(UstSong, ALongVowelIsAMelisma) {
  const Song song = parseUst(ustOf({"そ", "ー", "ら", "あー"}), "a.ust");
  EXPECT_EQ(soundsOf(song), "so ɾa aː");
  EXPECT_EQ(song.words[0].syllables[0].notes.size(), 2U);
}

TEST(UstSong, ShiftJisIsRead) {
  const std::string kana =
      "[#SETTING]\nTempo=60\n[#0000]\nLength=240\nLyric=\x82\xA9\nNoteNum=60\n"
      "[#0001]\nLength=240\nLyric=\x83\x6C\nNoteNum=62\n";
  EXPECT_EQ(wordsOf(parseUst(kana, "a.ust")), "か/1 ネ/1");
  EXPECT_EQ(wordsOf(parseUst("[#0000]\nLength=240\nLyric=ol\xE9\nNoteNum=60\n", "a.ust")), "ole/1")
      << "Latin-1, its accent left out";
}

TEST(UstSong, IdeographsAreNotGuessed) {
  EXPECT_EQ(errorOf([] {
              parseUst(ustOf({"さ", "桜"}), "a.ust");
            }),
            "a.ust:note at 0.50 s: found the lyric '桜'; expected it in kana");
  EXPECT_EQ(errorOf([] { parseSubtitleSong("1\n00:00:01,000 --> 00:00:03,000\n桜が咲く\n", "a.srt"); }),
            "a.srt:subtitle at 1.00 s: found the lyric '桜が咲く'; expected it in kana");
}

TEST(SubtitleSong, WordsShareTheirTimeByTheirLetters) {
  const Song song = parseSubtitleSong(
      "1\n00:00:01,000 --> 00:00:03,000\nTwinkle star\n\n2\n00:00:04,500 --> 00:00:05,000\nhow\n", "a.srt");
  EXPECT_EQ(wordsOf(song), "twinkle/1 star/1 how/1");
  EXPECT_NEAR(song.words[0].span().start, 1, 1e-6);
  EXPECT_NEAR(song.words[1].span().start, 1 + 2.0 * 8 / 13, 1e-6);
  EXPECT_NEAR(song.words[2].span().start, 4.5, 1e-6);
  const Song marked = parseSubtitleSong(
      "1\n00:00:01,000 --> 00:00:03,000\n<i>Twinkle</i> {\\an8}star [music]\n\n2\n00:00:04,500 --> 00:00:05,000\nhow\n",
      "a.srt");
  EXPECT_EQ(wordsOf(marked), "twinkle/1 star/1 how/1") << "mark-up is not sung";
  EXPECT_THROW(parseSubtitleSong("1\n00:00:03,000 --> 00:00:01,000\na\n", "a.srt"), InputError);
  EXPECT_THROW(parseSubtitleSong("", "a.srt"), InputError);
}

TEST(SubtitleSong, SaysWhichTimesAreNone) {
  for (const char* times : {"00:00:03,000 --> 00:00:01,000", "00:00:01,000 --> 00:00:01,000", "1 --> 2",
                            "0:0:0:1 --> 0:0:0:2", "00:-1:00 --> 00:02:00", "00:0x --> 00:02", "00:01 -->"}) {
    EXPECT_EQ(errorOf([&] { parseSubtitleSong(std::string("1\n") + times + "\nla\n", "a.srt"); }),
              std::string("a.srt:2: found the times '") + times + "'; expected 00:00:01,000 --> 00:00:02,500");
  }
  EXPECT_EQ(wordsOf(parseSubtitleSong("00:01.5 --> 00:02\nla 12 lo\n", "a.vtt")), "la/1 lo/1");
  EXPECT_EQ(errorOf([] { parseSubtitleSong("00:01.5 --> 00:02\n12\n", "a.vtt"); }),
            "a.vtt: holds no words; expected subtitles with letters a to z");
}

constexpr const char* kScore = R"(<?xml version="1.0"?><score-partwise><part id="P1"><measure number="1"><attributes>
  <divisions>1</divisions></attributes><note><pitch><step>C</step><octave>4</octave></pitch><duration>1</duration>
  <lyric><text>la</text></lyric></note></measure></part></score-partwise>)";

TEST(PackedMusicXml, IsTheScoreThatItsContainerNames) {
  ZipWriter zip;
  zip.add("META-INF/container.xml",
          R"(<container><rootfiles><rootfile full-path="song.xml"/></rootfiles></container>)");
  zip.add("song.xml", kScore);
  const std::string whole = std::move(zip).finish();
  EXPECT_EQ(wordsOf(parsePackedMusicXml(whole, "a.mxl")), "la/1");
  ZipWriter lost;
  lost.add("META-INF/container.xml",
           R"(<container><rootfiles><rootfile full-path="gone.xml"/></rootfiles></container>)");
  EXPECT_THROW(parsePackedMusicXml(std::move(lost).finish(), "a.mxl"), InputError);
  EXPECT_THROW(parsePackedMusicXml(ZipWriter().finish(), "a.mxl"), InputError);
  for (std::size_t i = 0; i < whole.size(); i += 7) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x55);
    try {
      (void)parsePackedMusicXml(damaged, "damaged.mxl");
    } catch (const InputError&) {
    }
    EXPECT_THROW(parsePackedMusicXml(whole.substr(0, i), "cut.mxl"), InputError);
  }
}

}  // namespace
}  // namespace mouthpiece
