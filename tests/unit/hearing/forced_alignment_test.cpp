#include "hearing/alignment/forced_alignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "base/errors.h"
#include "hearing/alignment/pronouncer.h"
#include "phonetics/labels/label_files.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr double kMedianErrorS = 0.010;  // what was promised; all voices together: 8 ms
const fs::path kGridTakes = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/takes";

/// The words of a spoken line with just the phones that the voice said.
std::vector<TranscriptWord> wordsSaid(const SpeechLabels& labels) {
  std::vector<TranscriptWord> words;
  for (const LabelledWord& word : labels.words) {
    Pronunciation way;
    for (std::size_t i = word.phones.first.value; i <= word.phones.last.value; ++i) {
      way.phones.push_back(labels.phones[i].phone);
      way.stress.push_back(-1);
    }
    words.push_back({word.text, {way}});
  }
  return words;
}

TEST(ForcedAligner, FindsThePhonesOfAVoice) {
  const SpokenLine line = makeVoice("flite:slt")->speak("the birch canoe slid on the smooth planks");
  const ForcedAlignment alignment = ForcedAligner().align(line.audio, wordsSaid(line.labels), "line");
  ASSERT_EQ(alignment.labels.words.size(), line.labels.words.size());
  EXPECT_NEAR(alignment.labels.duration(), line.audio.duration(), 1e-6);
  std::vector<double> errors;
  for (std::size_t w = 0; w < line.labels.words.size(); ++w) {
    const PhoneRange said = line.labels.words[w].phones, found = alignment.labels.words[w].phones;
    ASSERT_EQ(said.last.value - said.first.value, found.last.value - found.first.value);
    for (std::size_t i = 0; i <= said.last.value - said.first.value; ++i) {
      errors.push_back(std::abs(line.labels.phones[said.first.value + i].span.end -
                                alignment.labels.phones[found.first.value + i].span.end));
    }
  }
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  EXPECT_LT(errors[errors.size() / 2], kMedianErrorS);
  EXPECT_LE(alignment.doubtfulWords().size(), 1U);  // 2 of 100 words are doubted without cause
}

/// One hearing ticks in 10 ms: a sound that comes 5 ms later would be found 0 or 10 ms later.
TEST(ForcedAligner, FollowsASoundByLessThanTheDecodersStep) {
  const SpokenLine line = makeVoice("flite:rms")->speak("four hours of steady work faced us");
  const std::vector<TranscriptWord> words = wordsSaid(line.labels);
  AudioClip later = line.audio;
  constexpr double kLater = 0.005;
  later.samples.insert(later.samples.begin(), static_cast<std::size_t>(std::lround(kLater * later.sample_rate_hz)),
                       0.0F);
  ForcedAligner aligner;
  const SpeechLabels a = aligner.align(line.audio, words, "a").labels, b = aligner.align(later, words, "b").labels;
  ASSERT_EQ(a.phones.size(), b.phones.size());
  std::vector<double> off;
  for (std::size_t i = 0; i + 1 < a.phones.size(); ++i)
    off.push_back(std::abs(b.phones[i].span.end - a.phones[i].span.end - kLater));
  std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
  EXPECT_LT(off[off.size() / 2], 0.0025) << "s, half a hearing's step";
}

/// What doubts labels that came with a sound goes by: enough to see that words lie a fifth of a second beside it.
TEST(ForcedAligner, BordersAsFirstHeardAreAsSureAndHardlyLessNear) {
  const SpokenLine line = makeVoice("flite:rms")->speak("four hours of steady work faced us");
  const std::vector<TranscriptWord> words = wordsSaid(line.labels);
  ForcedAligner aligner;
  const ForcedAlignment fine = aligner.align(line.audio, words, "fine");
  const ForcedAlignment first =
      aligner.align(line.audio, words, "first", SpeechKind::kSpoken, BorderTimes::kFirstHeard);
  EXPECT_EQ(first.confidence, fine.confidence);
  EXPECT_EQ(first.line_confidence, fine.line_confidence);
  ASSERT_EQ(first.labels.words.size(), fine.labels.words.size());
  bool is_same = true;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const Seconds found = first.labels.spanOf(first.labels.words[i].phones).start;
    const Seconds finer = fine.labels.spanOf(fine.labels.words[i].phones).start;
    EXPECT_NEAR(found, finer, 0.05) << words[i].text;
    is_same = is_same && found == finer;
  }
  EXPECT_FALSE(is_same) << "heard once";
}

/// A sentence over and over, behind some seconds of silence.
struct LongSound {
  AudioClip audio;
  std::vector<TranscriptWord> words;
  Seconds sentence_s = 0;
  std::size_t sentence_words = 0;

  LongSound(std::size_t times, Seconds silence_s, const char* text = "four hours of steady work faced us") {
    constexpr std::size_t kHop = 160;  // samples of the decoder's 10 ms
    SpokenLine line = makeVoice("flite:rms")->speak(text);
    line.audio.samples.resize((line.audio.samples.size() + kHop - 1) / kHop * kHop, 0.0F);
    sentence_s = line.audio.duration();
    audio = {line.audio.sample_rate_hz, {}};
    audio.samples.resize(static_cast<std::size_t>(silence_s * line.audio.sample_rate_hz), 0.0F);
    for (std::size_t i = 0; i < times; ++i) {
      audio.samples.insert(audio.samples.end(), line.audio.samples.begin(), line.audio.samples.end());
      for (const TranscriptWord& word : wordsSaid(line.labels)) words.push_back(word);
    }
    sentence_words = words.size() / times;
  }
};

/// A long sound is heard again in pieces, and one of over a minute at first, too: a sentence said over and over has the
/// same times each time.
TEST(ForcedAligner, ALongSoundsBordersAreThoseOfItsSentences) {
  for (const auto& [times, least_s] : {std::pair(std::size_t{16}, 31.0), std::pair(std::size_t{48}, 95.0)}) {
    const LongSound sound(times, 0);
    ASSERT_GT(sound.audio.duration(), least_s) << "s, or it is heard whole";
    const SpeechLabels found = ForcedAligner().align(sound.audio, sound.words, "long").labels;
    ASSERT_EQ(found.words.size(), sound.words.size());
    // The first and the last stand apart.
    for (std::size_t i = 2 * sound.sentence_words; i + sound.sentence_words < sound.words.size(); ++i) {
      const TimeSpan word = found.spanOf(found.words[i].phones),
                     before = found.spanOf(found.words[i - sound.sentence_words].phones);
      EXPECT_NEAR(word.start - before.start, sound.sentence_s, 0.011) << i;
      EXPECT_NEAR(word.end - before.end, sound.sentence_s, 0.011) << i;
    }
  }
}

TEST(ForcedAligner, WordsOfALongSoundMayAllBeAtItsEnd) {
  constexpr Seconds kSilence = 55;
  const LongSound sound(8, kSilence);
  ASSERT_GT(sound.audio.duration(), 61) << "s, or it is heard whole";
  const SpeechLabels found = ForcedAligner().align(sound.audio, sound.words, "late").labels;
  ASSERT_EQ(found.words.size(), sound.words.size());
  for (std::size_t i = 0; i < found.words.size(); i += sound.sentence_words)
    EXPECT_NEAR(found.spanOf(found.words[i].phones).start,
                kSilence + sound.sentence_s * static_cast<double>(i / sound.sentence_words), 0.25);
}

/// A stretch of a long sound with more speech than its words, or with less, does not go on as the one before: the two
/// are heard anew as one, and the rest is where it is.
TEST(ForcedAligner, ALongTextThatLacksASentenceOrHasOneTooManyFitsAllElse) {
  const LongSound sound(6, 0,
                        "four hours of steady work faced us. a large size in stockings is hard to sell. the boy was "
                        "there when the sun rose. a rod is used to catch pink salmon. the source of the huge river is "
                        "the clear spring. kick the ball straight and follow through.");
  ASSERT_GT(sound.audio.duration(), 61) << "s, or it is heard whole";
  constexpr std::size_t kRound = 3, kSentence = 7;
  const std::size_t changed = kRound * sound.sentence_words;
  const auto word = [&](std::size_t i) { return sound.words.begin() + static_cast<std::ptrdiff_t>(i); };
  std::vector<TranscriptWord> without(word(0), word(changed)), with = without;
  without.insert(without.end(), word(changed + kSentence), sound.words.end());
  with.insert(with.end(), word(kSentence), word(kSentence + 9));  // another sentence
  with.insert(with.end(), word(changed), sound.words.end());
  for (const std::vector<TranscriptWord>& words : {without, with}) {
    const SpeechLabels found = ForcedAligner().align(sound.audio, words, "long").labels;
    ASSERT_EQ(found.words.size(), words.size());
    for (std::size_t round = 1; round < 6; ++round) {
      if (round == kRound) continue;
      const std::size_t first = round * sound.sentence_words + (round < kRound ? 0 : words.size() - sound.words.size());
      EXPECT_NEAR(found.spanOf(found.words[first].phones).start - found.spanOf(found.words[0].phones).start,
                  static_cast<double>(round) * sound.sentence_s, 0.25)
          << round;
    }
  }
}

/// No beam keeps a path through a whole sentence that nobody says, even where it is the last of many.
TEST(ForcedAligner, ALongTextMayEndInASentenceThatNobodySays) {
  const LongSound sound(48, 0);
  std::vector<TranscriptWord> words = sound.words;
  for (int i = 0; i < 2; ++i) words.insert(words.end(), sound.words.begin(), sound.words.begin() + 7);
  const ForcedAlignment found = ForcedAligner().align(sound.audio, words, "long");
  EXPECT_EQ(found.labels.words.size(), words.size());
  EXPECT_FALSE(found.doubtfulWords().empty());
}

TEST(ForcedAligner, TriesEveryWayAndAllowsPauses) {
  const SpokenLine line = makeVoice("flite:rms")->speak("read, tomato");
  using enum Phone;
  const std::vector<TranscriptWord> words = {
      {"read", {{{kR, kEH, kD}, {-1, 1, -1}}, {{kR, kIY, kD}, {-1, 1, -1}}}},
      {"tomato",
       {{{kT, kAH, kM, kAA, kT, kOW}, {-1, 0, -1, 1, -1, 0}}, {{kT, kAH, kM, kEY, kT, kOW}, {-1, 0, -1, 1, -1, 0}}}}};
  const ForcedAlignment alignment = ForcedAligner().align(line.audio, words, "line");
  const auto& labels = alignment.labels;
  const LabelledWord& tomato = labels.words.at(1);
  EXPECT_EQ(labels.phones[tomato.phones.first.value + 3].phone, kEY);
  EXPECT_EQ(labels.phones[tomato.phones.first.value - 1].phone, kSil) << "the comma is a pause";
  std::vector<int> stress;
  for (const LabelledSyllable& syllable : labels.syllables) stress.push_back(syllable.stress);
  EXPECT_EQ(stress, (std::vector<int>{1, 0, 1, 0}));
}

TEST(ForcedAligner, DoubtsWordsThatAreNotThere) {
  const SpokenLine line = makeVoice("flite:slt")->speak("the time is now ten past nine");
  const Pronouncer pronouncer;
  ForcedAligner aligner;
  EXPECT_TRUE(
      aligner.align(line.audio, pronouncer.wordsOf("the time is now ten past nine"), "right").doubtfulWords().empty());
  const auto doubtful =
      aligner.align(line.audio, pronouncer.wordsOf("the time is purple elephant nine"), "wrong").doubtfulWords();
  EXPECT_FALSE(doubtful.empty());
}

TEST(ForcedAligner, RefusesWhatCannotFit) {
  ForcedAligner aligner;
  const AudioClip blink{16000, std::vector<float>(1600, 0.0F)};
  const Pronouncer pronouncer;
  EXPECT_THROW(aligner.align(blink, pronouncer.wordsOf("this is far too long for a tenth of a second"), "blink.wav"),
               InputError);
  EXPECT_THROW(aligner.align(blink, {}, "blink.wav"), InputError);
  EXPECT_THROW(ForcedAligner("/no/model/here"), InputError);
  // And goes on working.
  const SpokenLine line = makeVoice("flite:slt")->speak("now");
  EXPECT_EQ(aligner.align(line.audio, pronouncer.wordsOf("now"), "now").labels.words.size(), 1U);
}

TEST(ForcedAligner, TheSameSoundGivesTheSameLabelsAgain) {
  const SpokenLine line = makeVoice("flite:awb")->speak("glue the sheet");
  const Pronouncer pronouncer;
  ForcedAligner aligner;
  const auto words = pronouncer.wordsOf("glue the sheet");
  const SpeechLabels first = aligner.align(line.audio, words, "a").labels;
  aligner.align(line.audio, pronouncer.wordsOf("blue sheep"), "other");
  const SpeechLabels again = aligner.align(line.audio, words, "a").labels;
  ASSERT_EQ(first.phones.size(), again.phones.size());
  const SpeechLabels unjudged = aligner.labelsOf(line.audio, words, "a");
  ASSERT_EQ(first.phones.size(), unjudged.phones.size());
  for (std::size_t i = 0; i < first.phones.size(); ++i) {
    EXPECT_EQ(first.phones[i].span, again.phones[i].span);
    EXPECT_EQ(first.phones[i].span, unjudged.phones[i].span);
    EXPECT_EQ(first.phones[i].phone, unjudged.phones[i].phone);
  }
}

TEST(ForcedAligner, AgreesWithTheRealSpeakersLabels) {
  if (!fs::exists(kGridTakes)) GTEST_SKIP() << "no real capture in " << kGridTakes;
  const Lexicon lexicon = Lexicon::read(kGridTakes / "../lexicon.txt");
  const Pronouncer pronouncer(&lexicon);
  ForcedAligner aligner;
  int words = 0, alike = 0;
  for (const char* name : {"bbaf2n", "bbal7s", "bbbm3a", "bgan6p"}) {
    std::ifstream stream(kGridTakes / (std::string(name) + ".txt"));
    const std::string text((std::istreambuf_iterator<char>(stream)), {});
    const SpeechLabels given = readLabels(kGridTakes / (std::string(name) + ".TextGrid"));
    const SpeechLabels found =
        aligner.align(readAudio(kGridTakes / (std::string(name) + ".wav")), pronouncer.wordsOf(text), name).labels;
    ASSERT_EQ(found.words.size(), given.words.size());
    for (std::size_t w = 0; w < given.words.size(); ++w) {
      ++words;
      alike += std::abs(found.spanOf(found.words[w].phones).start - given.spanOf(given.words[w].phones).start) < 0.02;
    }
  }
  EXPECT_GE(alike, words * 9 / 10);
}

TEST(Pronouncer, TheUsersLexiconGoesFirst) {
  const Lexicon lexicon = Lexicon::parse("now N UW1\nG JH IY1\n", "mine.txt");
  const Pronouncer pronouncer(&lexicon);
  const auto words = pronouncer.wordsOf("G now!");
  ASSERT_EQ(words.size(), 2U);
  EXPECT_EQ(words[0].ways.size(), 1U);
  EXPECT_EQ(words[1].ways[0].phones, (std::vector<Phone>{Phone::kN, Phone::kUW}));
}

TEST(Pronouncer, KnowsTheDictionaryNumbersAndStrangeWords) {
  const Pronouncer pronouncer;
  const auto words = pronouncer.wordsOf("read 25 blorptastic twenty-five (o'clock)");
  std::vector<std::string> texts;
  for (const TranscriptWord& word : words) texts.push_back(word.text);
  EXPECT_EQ(texts, (std::vector<std::string>{"read", "twenty", "five", "blorptastic", "twenty", "five", "o'clock"}));
  EXPECT_EQ(words[0].ways.size(), 2U);
  EXPECT_FALSE(words[3].ways.at(0).phones.empty());
  // "twenty": stress from Flite.
  EXPECT_TRUE(std::find(words[1].ways[0].stress.begin(), words[1].ways[0].stress.end(), 1) !=
              words[1].ways[0].stress.end());
  EXPECT_THROW(static_cast<void>(pronouncer.wordsOf("...")), InputError);
}

}  // namespace
}  // namespace mouthpiece
