// A song's score laid beside a sound in which somebody sings it.
#include "singing/song_beside_sound.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "base/errors.h"
#include "base/index.h"
#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

constexpr Seconds kStep = 0.01;

/// Eight words of one note, half a second each, with a rest in the middle.
std::vector<Note> tune() {
  std::vector<Note> notes;
  Seconds at = 0.5;
  for (const double pitch : {60, 60, 67, 67, 69, 64, 62, 60}) {
    if (notes.size() == 4) at += 0.8;
    notes.push_back({{at, at + 0.5}, 440 * std::exp2((pitch - 69) / 12)});
    at += 0.5;
  }
  return notes;
}

/// What is heard of notes that begin `offset` later, `factor` times as high; each note's first 60 ms have no pitch.
PitchTrack heardAs(const std::vector<Note>& notes, Seconds offset, double factor, Seconds lasts) {
  PitchTrack track{.step = kStep, .frames = std::vector<PitchFrame>(unsignedIndex(std::lround(lasts / kStep)))};
  for (std::size_t i = 0; i < track.frames.size(); ++i) {
    const Seconds time = asReal(i) * kStep - offset;
    for (const Note& note : notes) {
      if (time >= note.span.start + 0.06 && time < note.span.end) track.frames[i] = {note.hz * factor, 1};
    }
  }
  return track;
}

TEST(FindSong, TellsWhenTheSongsClockBegins) {
  for (const Seconds offset : {0.0, 1.37, 12.5, -0.4}) {
    for (const double factor : {1.0, 2.0, 0.5, std::exp2(5 / 12.0)}) {
      const auto place = findSong(tune(), heardAs(tune(), offset, factor, 20));
      ASSERT_TRUE(place);
      EXPECT_NEAR(place->offset, offset, 0.061) << factor << " times as high; the first 60 ms of a note have no pitch";
      EXPECT_GT(place->agreement, 0.8) << offset;
    }
  }
}

/// What another song's agreement is not (docs/formats/song.md).
TEST(FindSong, DoesNotBelieveAnotherSong) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> pitch(55, 74);
  for (int i = 0; i < 20; ++i) {
    std::vector<Note> other;
    for (Seconds at = 0; at < 19; at += 0.4)
      other.push_back({{at, at + 0.4}, 440 * std::exp2((pitch(random) - 69) / 12.0)});
    std::vector<Note> ours;
    for (Seconds at = 0; at < 19; at += 0.5)
      ours.push_back({{at, at + 0.5}, 440 * std::exp2((pitch(random) - 69) / 12.0)});
    const auto place = findSong(ours, heardAs(other, 0, 1, 20));
    ASSERT_TRUE(place);
    EXPECT_LT(place->agreement, kLeastAgreement);
  }
}

TEST(FindSong, FindsNothingWhereThereIsNoPitchOrNoNote) {
  EXPECT_FALSE(findSong(tune(), heardAs({}, 0, 1, 5)));
  EXPECT_FALSE(findSong({}, heardAs(tune(), 0, 1, 5)));
}

/// Hears every word `late` later than the score has it with its clock at `offset`; the one of `wrong` 0.3 s later
/// still.
class FakeAligner : public Aligner {
 public:
  FakeAligner(SpeechLabels score, Seconds late, std::size_t wrong)
      : score_(std::move(score)), late_(late), wrong_(wrong) {}

  ForcedAlignment align(const AudioClip& audio, const std::vector<TranscriptWord>& words, std::string_view,
                        SpeechKind kind, BorderTimes) override {
    EXPECT_EQ(kind, SpeechKind::kSung);
    words_asked = words.size();
    std::vector<PhoneSegment> phones;
    std::vector<std::string> texts;
    for (const LabelledWord& word : score_.words) {
      if (texts.size() == words.size()) break;
      const Seconds more = texts.size() == wrong_ ? 0.3 : 0;
      for (std::size_t i = word.phones.first.value; i <= word.phones.last.value; ++i) {
        PhoneSegment phone{.phone = score_.phones[i].phone, .span = score_.phones[i].span};
        phone.span.start += late_ + (i == word.phones.first.value ? more : more * 1.05);
        phone.span.end += late_ + (i == word.phones.last.value ? 0 : more * 1.05);
        phone.word = texts.size();
        phones.push_back(phone);
      }
      texts.push_back(word.text);
    }
    return {buildSpeechLabels(phones, texts, audio.duration()), std::vector<double>(texts.size(), 1.0)};
  }
  std::size_t words_asked = 0;

 private:
  SpeechLabels score_;
  Seconds late_;
  std::size_t wrong_;
};

/// The tune with "la" on each note, as a voice gives it.
SungLine sungTune() {
  SungLine sung;
  sung.tags.notes = tune();
  std::vector<PhoneSegment> phones;
  std::vector<std::string> texts;
  for (const Note& note : tune()) {
    phones.push_back({.phone = Phone::kL, .span = {note.span.start, note.span.start + 0.1}, .word = texts.size()});
    phones.push_back({.phone = Phone::kAA, .span = {note.span.start + 0.1, note.span.end}, .word = texts.size()});
    texts.emplace_back("la");
  }
  sung.line.labels = buildSpeechLabels(phones, texts, tune().back().span.end + 0.2);
  return sung;
}

/// The tune as it sounds, its clock at `offset`.
AudioClip soundOf(Seconds offset, Seconds lasts) {
  AudioClip clip{16000, std::vector<float>(unsignedIndex(std::lround(lasts * 16000)))};
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    const Seconds time = asReal(i) / 16000 - offset;
    for (const Note& note : tune()) {
      if (!note.span.contains(time)) continue;
      for (int harmonic = 1; harmonic < 8; ++harmonic)
        clip.samples[i] += static_cast<float>(
            0.2 / harmonic * std::sin(2 * std::numbers::pi * note.hz * harmonic * (time - note.span.start)));
    }
  }
  return clip;
}

TEST(BesideSound, MovesWordsWhereTheyAreHeard) {
  const SungLine sung = sungTune();
  constexpr std::size_t kWrong = 5;
  FakeAligner aligner(sung.line.labels, 1.3 + 0.07, kWrong);
  const AudioClip sound = soundOf(1.3, 8);
  const SungLine beside = besideSound(sung, sound, std::nullopt, aligner, "a.wav");
  EXPECT_EQ(beside.line.audio.samples, sound.samples) << "the given sound is what is heard";
  EXPECT_NEAR(beside.line.labels.duration(), 8, 1e-9);
  ASSERT_EQ(beside.line.labels.words.size(), 8U);
  for (std::size_t i = 0; i < 8; ++i) {
    const TimeSpan score = sung.line.labels.spanOf(sung.line.labels.words[i].phones);
    const TimeSpan got = beside.line.labels.spanOf(beside.line.labels.words[i].phones);
    EXPECT_NEAR(got.start, score.start + 1.37, 1e-6)
        << i << (i == kWrong ? ": not believed, so by its neighbours" : "");
    EXPECT_NEAR(beside.tags.notes[i].span.start, score.start + 1.37, 1e-6) << i;
  }
  EXPECT_FALSE(beside.tags.f0.empty()) << "pitch is the sound's";
  ASSERT_EQ(beside.notices.size(), 1U);
  EXPECT_NE(beside.notices[0].find("7 of 8 words"), std::string::npos) << beside.notices[0];
  EXPECT_NE(beside.notices[0].find("at +1.3"), std::string::npos) << beside.notices[0];
}

TEST(BesideSound, TellsWhatOneHasAndTheOtherLacks) {
  const SungLine sung = sungTune();
  FakeAligner aligner(sung.line.labels, 0, 99);
  SungLine beside = besideSound(sung, soundOf(0, 3.0), std::nullopt, aligner, "a.wav");
  EXPECT_EQ(aligner.words_asked, 5U) << "a second's slack";
  EXPECT_EQ(beside.line.labels.words.size(), 4U);
  ASSERT_FALSE(beside.warnings.empty());
  EXPECT_EQ(beside.warnings[0], "4 of the song's 8 words come after the sound's end at 3.00 s: they are left out");

  // The tune twice, the score once.
  AudioClip twice = soundOf(0, 6);
  const AudioClip again = twice;
  twice.samples.insert(twice.samples.end(), again.samples.begin(), again.samples.end());
  beside = besideSound(sung, twice, 0.0, aligner, "a.wav");
  ASSERT_FALSE(beside.warnings.empty());
  EXPECT_NE(beside.warnings[0].find("s of voice come after the song's last word"), std::string::npos)
      << beside.warnings[0];
  EXPECT_NE(beside.notices[0].find("as told"), std::string::npos) << beside.notices[0];
}

TEST(BesideSound, RefusesASoundThatHoldsNothingOfTheSong) {
  const SungLine sung = sungTune();
  FakeAligner aligner(sung.line.labels, 0, 99);
  EXPECT_THROW(besideSound(sung, AudioClip{16000, std::vector<float>(16000)}, std::nullopt, aligner, "a.wav"),
               InputError);
  EXPECT_THROW(besideSound(sung, soundOf(0, 3), 60.0, aligner, "a.wav"), InputError);
  for (const Seconds offset : {std::nan(""), 1e300, -14'401.0})
    EXPECT_THROW(besideSound(sung, soundOf(0, 3), offset, aligner, "a.wav"), InputError) << offset;
}

}  // namespace
}  // namespace mouthpiece
