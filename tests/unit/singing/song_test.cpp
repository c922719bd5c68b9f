#include "singing/song.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "base/errors.h"
#include "support/error_of.h"
#include "support/sung_words.h"

namespace mouthpiece {
namespace {

using samples::HeldNote;
using samples::SungWords;

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
  EXPECT_EQ(song.words[0].syllables[0].notes.size(), 2U);
  const Note last = song.words[0].syllables[1].notes[0];
  EXPECT_TRUE(last.vibrato);
  EXPECT_DOUBLE_EQ(last.span.start, 1.5) << "half a second a beat, after a rest";
  EXPECT_DOUBLE_EQ(last.span.end, 2.5);
  EXPECT_DOUBLE_EQ(last.hz, hzOfMidiPitch(62));
  EXPECT_DOUBLE_EQ(song.duration, 5.5 * 0.5) << "with the rest at its end";
  EXPECT_EQ(song.lyrics(), "glory");
  EXPECT_EQ(song.notes().size(), 3U);
}

TEST(Song, RefusesWhatCannotBeSung) {
  const auto with = [](const std::string& words) { return R"({"tempo":100,"words":[)" + words + "]}"; };
  for (const std::string& bad : {std::string("["),
                                 std::string("[]"),
                                 std::string("{}"),
                                 with(""),
                                 with("{}"),
                                 with("1"),
                                 with(R"({"word":"a"})"),
                                 with(R"({"word":"a","notes":[]})"),
                                 with(R"({"word":"","notes":[{"pitch":60,"beats":1}]})"),
                                 with(R"({"word":"a (quit","notes":[{"pitch":60,"beats":1}]})"),
                                 with(R"({"word":"a<b>","notes":[{"pitch":60,"beats":1}]})"),
                                 with(R"({"word":"a","notes":[{"pitch":60,"beats":0}]})"),
                                 with(R"({"word":"a","notes":[{"pitch":60,"beats":-1}]})"),
                                 with(R"({"word":"a","notes":[{"pitch":600,"beats":1}]})"),
                                 with(R"({"word":"a","notes":[{"pitch":60,"beats":1e9}]})"),
                                 with(R"({"word":"a","notes":[{"pitch":60,"beats":1,"tie":true}]})"),
                                 with(R"({"rest":-1})"),
                                 with(R"({"word":"a","notes":[{"pitch":60,"beats":1,"vibrato":1}]})"),
                                 with(R"({"word":"a","notes":[{"pitch":[60],"beats":1}]})"),
                                 with(R"({"word":7,"notes":[{"pitch":60,"beats":1}]})"),
                                 with(R"({"rest":300},{"word":"a","notes":[{"pitch":60,"beats":1}]})"),
                                 with(R"({"word":"a","notes":[{"pitch":60,"beats":1}]},{"rest":1e308},{"rest":1e308})"),
                                 with(R"({"word":"'","notes":[{"pitch":60,"beats":1}]})"),
                                 std::string(R"({"tempo":0,"words":[{"word":"a","notes":[{"pitch":60,"beats":1}]}]})"),
                                 std::string(10000, '[')}) {
    EXPECT_THROW(parseSongJson(bad, "s"), InputError) << bad.substr(0, 80);
  }
}

TEST(Song, ComplaintsNameFileAndPlace) {
  const auto complaint = [](const std::string& notes) -> std::string {
    try {
      parseSongJson(
          R"({"words":[{"word":"la","notes":[{"pitch":60,"beats":1}]},{"word":"la","notes":[)" + notes + "]}]}",
          "s.json");
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing";
  };
  EXPECT_NE(complaint(R"({"pitch":60})").find("s.json:words[1].notes[0].beats: "), std::string::npos)
      << complaint(R"({"pitch":60})");
  EXPECT_NE(complaint(R"({"pitch":"H4","beats":1})").find("s.json:words[1].notes[0].pitch: "), std::string::npos);
  EXPECT_NE(complaint(R"({"pitch":99,"beats":1})").find("s.json:words[1]: has pitch 99"), std::string::npos);
  EXPECT_NE(complaint(R"({"pitch":60,"beats":0.001})").find("0.02"), std::string::npos) << "what was expected";
}

TEST(CheckSong, RefusesWhatNoVoiceSings) {
  const auto with = [](std::string text, HeldNote note) { return SungWords().word(std::move(text), {{note}}).song(); };
  EXPECT_NO_THROW(checkSong(with("a", {200, 1}), "s"));
  for (const Song& bad :
       {with("a\" (quit)", {200, 1}), with("A", {200, 1}), with("'", {200, 1}), with("", {200, 1}),
        with(std::string(41, 'a'), {200, 1}), with("a", {NAN, 1}), with("a", {-200, 1}), with("a", {200, NAN}),
        with("a", {200, 1e9}), with("a", {200, 0}), with("a", {200, -1}), with("a", {20, 1}), with("a", {20000, 1}),
        SungWords().rest(-1).word("a", {{{200, 1}}}).song(), SungWords().rest(NAN).word("a", {{{200, 1}}}).song(),
        SungWords().rest(1).song(), SungWords().word("a", {}).song(), SungWords().word("a", {{}}).song(),
        SungWords().word("a", {{{200, 1}}}).rest(121).song()}) {
    EXPECT_THROW(checkSong(bad, "s"), InputError);
  }
}

TEST(CheckSong, RefusesNotesThatDoNotFollowEachOther) {
  Song song = SungWords().word("la", {{{200, 1}, {220, 1}}}).song();
  song.words[0].syllables[0].notes[1].span.start = 1.1;
  EXPECT_THROW(checkSong(song, "s"), InputError) << "a rest within a word";
  song.words[0].syllables[0].notes[1].span.start = 0.9;
  EXPECT_THROW(checkSong(song, "s"), InputError) << "two notes at once";
  song.words[0].syllables[0].notes[1].span.start = 1;
  EXPECT_NO_THROW(checkSong(song, "s"));
  song.duration = 1.5;
  EXPECT_THROW(checkSong(song, "s"), InputError) << "shorter than its notes";
}

/// A song of random words, on a grid of beats that both kinds of files can write.
struct RandomSong {
  struct Note {
    int midi;
    int quarters;  ///< of a beat
    bool vibrato;
  };
  struct Word {
    int rest;  ///< quarters of a beat before it
    std::vector<std::string> texts;
    std::vector<std::vector<Note>> syllables;
  };
  int tempo;
  std::vector<Word> words;
};

RandomSong randomSong(unsigned seed) {
  std::mt19937 random(seed);
  const auto upTo = [&](int most) { return std::uniform_int_distribution<int>(0, most)(random); };
  RandomSong song{60 + upTo(120), {}};
  for (int words = 1 + upTo(5); words > 0; --words) {
    RandomSong::Word word{upTo(1) * upTo(6), {}, {}};
    for (int syllables = 1 + upTo(2); syllables > 0; --syllables) {
      word.texts.push_back({static_cast<char>('a' + upTo(25)), static_cast<char>('a' + upTo(25))});
      std::vector<RandomSong::Note> notes;
      int last = -1;
      for (int count = 1 + upTo(2); count > 0; --count) {
        int midi = 48 + upTo(24);
        if (midi == last) ++midi;  // one pitch tied to itself is one note in MusicXML
        notes.push_back({last = midi, 1 + upTo(8), upTo(3) == 0});
      }
      word.syllables.push_back(notes);
    }
    song.words.push_back(word);
  }
  return song;
}

std::string jsonOf(const RandomSong& song) {
  std::string json = fmt::format(R"({{"tempo": {}, "words": [)", song.tempo);
  const char* comma = "";
  for (const RandomSong::Word& word : song.words) {
    if (word.rest > 0) json += fmt::format(R"({}{{"rest": {}}})", comma, word.rest / 4.0);
    if (word.rest > 0) comma = ",";
    json += fmt::format(R"({}{{"word": "{}", "notes": [)", comma, fmt::join(word.texts, ""));
    const char* note_comma = "";
    for (const auto& notes : word.syllables) {
      for (const RandomSong::Note& note : notes) {
        json += fmt::format(R"({}{{"pitch": {}, "beats": {}, "tie": {}, "vibrato": {}}})", note_comma, note.midi,
                            note.quarters / 4.0, &note != &notes.front(), note.vibrato);
        note_comma = ",";
      }
    }
    json += "]}";
    comma = ",";
  }
  return json + "]}";
}

std::string musicXmlOf(const RandomSong& song) {
  constexpr std::array<const char*, 12> kSteps{"C", "C", "D", "D", "E", "F", "F", "G", "G", "A", "A", "B"};
  constexpr std::array<int, 12> kAlters{0, 1, 0, 1, 0, 0, 1, 0, 1, 0, 1, 0};
  std::string xml = fmt::format(
      "<score-partwise><part><measure number='1'><attributes><divisions>4</divisions></attributes><sound tempo='{}'/>",
      song.tempo);
  for (const RandomSong::Word& word : song.words) {
    if (word.rest > 0) xml += fmt::format("<note><rest/><duration>{}</duration></note>", word.rest);
    for (std::size_t s = 0; s < word.syllables.size(); ++s) {
      const char* syllabic = word.syllables.size() == 1       ? "single"
                             : s == 0                         ? "begin"
                             : s + 1 == word.syllables.size() ? "end"
                                                              : "middle";
      for (const RandomSong::Note& note : word.syllables[s]) {
        const auto step = static_cast<std::size_t>(note.midi % 12);
        xml += fmt::format(
            "<note><pitch><step>{}</step><alter>{}</alter><octave>{}</octave></pitch><duration>{}</duration>",
            kSteps[step], kAlters[step], note.midi / 12 - 1, note.quarters);
        if (&note == &word.syllables[s].front())
          xml += fmt::format("<lyric><syllabic>{}</syllabic><text>{}</text></lyric>", syllabic, word.texts[s]);
        if (note.vibrato) xml += "<notations><ornaments><wavy-line type='start'/></ornaments></notations>";
        xml += "</note>";
      }
    }
  }
  return xml + "</measure></part></score-partwise>";
}

void expectAlike(const Song& a, const Song& b) {
  EXPECT_EQ(a.lyrics(), b.lyrics());
  EXPECT_NEAR(a.duration, b.duration, 1e-9);
  ASSERT_EQ(a.words.size(), b.words.size());
  for (std::size_t w = 0; w < a.words.size(); ++w) {
    ASSERT_EQ(a.words[w].syllables.size(), b.words[w].syllables.size()) << "word " << w;
    for (std::size_t s = 0; s < a.words[w].syllables.size(); ++s)
      ASSERT_EQ(a.words[w].syllables[s].notes.size(), b.words[w].syllables[s].notes.size()) << "word " << w;
  }
  const std::vector<Note> ours = a.notes(), theirs = b.notes();
  for (std::size_t i = 0; i < ours.size(); ++i) {
    EXPECT_NEAR(ours[i].span.start, theirs[i].span.start, 1e-9);
    EXPECT_NEAR(ours[i].span.end, theirs[i].span.end, 1e-9);
    EXPECT_NEAR(ours[i].hz, theirs[i].hz, 1e-9);
    EXPECT_EQ(ours[i].vibrato, theirs[i].vibrato);
  }
}

TEST(SongReaders, ReadTheSameSongFromBothKindsOfFiles) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const RandomSong written = randomSong(seed);
    const Song json = parseSongJson(jsonOf(written), "s.json");
    expectAlike(json, parseMusicXml(musicXmlOf(written), "s.xml"));
    // And it is the song that was written.
    int quarters = 0;
    std::size_t note = 0;
    const std::vector<Note> read = json.notes();
    for (const RandomSong::Word& word : written.words) {
      quarters += word.rest;
      for (const auto& notes : word.syllables) {
        for (const RandomSong::Note& each : notes) {
          ASSERT_LT(note, read.size());
          EXPECT_NEAR(read[note].span.start, quarters * 15.0 / written.tempo, 1e-9);
          EXPECT_NEAR(read[note++].hz, hzOfMidiPitch(each.midi), 1e-9);
          quarters += each.quarters;
        }
      }
    }
    EXPECT_EQ(note, read.size());
  }
}

TEST(SongReaders, StandDamage) {
  const RandomSong written = randomSong(3);
  for (const SongFormat& format : songFormats()) {
    const std::string good = format.ending == ".json" ? jsonOf(written) : musicXmlOf(written);
    std::mt19937 random(11);
    for (int round = 0; round < 300; ++round) {
      std::string bad = good;
      for (int changes = 0; changes < 3; ++changes) {
        const std::size_t at = random() % bad.size();
        if (round % 3 == 0)
          bad.erase(at, 1 + random() % 20);
        else
          bad[at] = static_cast<char>(random() % 256);
        if (bad.empty()) break;
      }
      try {
        checkSong(format.parse(bad, "bad"), "what was read");
      } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()).rfind("bad", 0), 0U) << error.what();
      }
    }
  }
}

TEST(SongReaders, AreChosenByTheEnding) {
  EXPECT_EQ(songFormats().front().ending, ".json") << "what other endings stand for";
  EXPECT_THROW(readSong("/nonexistent/song.json"), InputError);
  const auto folder = std::filesystem::path(::testing::TempDir()) / "mouthpiece_songs";
  std::filesystem::create_directories(folder);
  const RandomSong written = randomSong(1);
  for (const auto& [name, text] : {std::pair{"a.json", jsonOf(written)},
                                   {"a.song", jsonOf(written)},
                                   {"a.musicxml", musicXmlOf(written)},
                                   {"a.xml", musicXmlOf(written)}}) {
    std::ofstream(folder / name) << text;
    expectAlike(readSong(folder / name), parseSongJson(jsonOf(written), "s.json"));
  }
  std::ofstream(folder / "a.mxl") << "PK";
  EXPECT_THROW(readSong(folder / "a.mxl"), InputError);
  const std::string sound("RIFF\x24\0\0\0WAVEfmt ", 16), midi("MThd\0\0\0\6", 8);
  for (const char* name : {"a.wav", "a.json", "a.mxl", "a.mid", "a.ust"}) {
    std::ofstream(folder / name) << sound;
    EXPECT_EQ(errorOf([&] { readSong(folder / name); }),
              (folder / name).string() +
                  ": is a sound (WAV); expected a written song, whose sound may go beside it as audio");
  }
  std::ofstream(folder / "words.txt") << "twinkle, twinkle\n";
  EXPECT_NE(errorOf([&] {
              readSong(folder / "words.txt");
            }).find("expected one that ends in .json .musicxml .xml .mxl .mid .kar .ust .srt"),
            std::string::npos);
  std::ofstream(folder / "b.json") << midi;
  EXPECT_NE(errorOf([&] { readSong(folder / "b.json"); }).find("MIDI"), std::string::npos) << "by its first bytes";
  std::filesystem::remove_all(folder);
}

TEST(WithSyllables, GathersNotesAndPartsTheLast) {
  const Song song = SungWords()
                        .rest(0.4)
                        .word("gloria", {{{196, 1.0}, {220, 0.5}}, {{147, 0.5}}, {{131, 0.5}}})
                        .rest(0.5)
                        .word("star", {{{262, 1.5, true}}})
                        .song();
  const std::vector<std::size_t> fewer{2, 1}, more{3, 3};
  const Song gathered = withSyllables(song, fewer);
  ASSERT_EQ(gathered.words[0].syllables.size(), 2U);
  EXPECT_EQ(gathered.words[0].syllables[1].notes.size(), 2U);
  const Song parted = withSyllables(song, more);
  ASSERT_EQ(parted.words[1].syllables.size(), 3U);
  EXPECT_DOUBLE_EQ(parted.words[1].syllables[2].notes[0].span.duration(), 0.5);
  EXPECT_TRUE(parted.words[1].syllables[2].notes[0].vibrato);
}

TEST(WithSyllables, KeepsTimeAndPitchWhateverTheCounts) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    const Song song = parseSongJson(jsonOf(randomSong(seed)), "s.json");
    std::mt19937 random(seed);
    std::vector<std::size_t> counts;
    for (std::size_t w = 0; w < song.words.size(); ++w) counts.push_back(random() % 6);
    const Song fitted = withSyllables(song, counts);
    EXPECT_NO_THROW(checkSong(fitted, "fitted"));
    EXPECT_EQ(fitted.duration, song.duration);
    const auto hzAt = [](const std::vector<Note>& notes, Seconds time) {
      for (const Note& note : notes) {
        if (note.span.contains(time)) return note.hz;
      }
      return 0.0;
    };
    const std::vector<Note> before = song.notes(), after = fitted.notes();
    for (Seconds time = 0.0013; time < song.duration; time += 0.05)
      EXPECT_EQ(hzAt(before, time), hzAt(after, time)) << time;
    for (std::size_t w = 0; w < counts.size(); ++w) {
      EXPECT_EQ(fitted.words[w].syllables.size(), std::max<std::size_t>(1, counts[w]));
      EXPECT_NEAR(fitted.words[w].end(), song.words[w].end(), 1e-12);
    }
    std::vector<std::size_t> own;
    for (const SongWord& word : song.words) own.push_back(word.syllables.size());
    expectAlike(withSyllables(song, own), song);
  }
}

TEST(Song, ShippedSongsAreFine) {
  for (const char* name : {"twinkle", "gloria"}) {
    const Song song = readSong(std::string(MOUTHPIECE_SOURCE_DIR "/sample_data/songs/") + name + ".json");
    EXPECT_GT(song.duration, 15);
    EXPECT_FALSE(song.title.empty());
  }
}

}  // namespace
}  // namespace mouthpiece
