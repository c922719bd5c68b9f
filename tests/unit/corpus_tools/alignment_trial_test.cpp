#include "corpus_tools/research/evaluation/hearing_trials.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/errors.h"
#include "corpus_tools/research/evaluation/noises.h"
#include "hearing/alignment/forced_alignment.h"
#include "phonetics/labels/label_files.h"
#include "synthetic_takes.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

const fs::path kGridTakes = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/takes";

/// Takes with a voice's sound and its labels; no face is asked for.
Corpus spokenCorpus() {
  Corpus corpus;
  corpus.name = "spoken";
  const auto voice = makeVoice("flite:slt");
  for (const char* text : {"four hours of steady work", "the birch canoe slid"}) {
    SpokenLine line = voice->speak(text);
    CorpusTake& take = corpus.takes.emplace_back();
    take.name = take.text = text;
    take.labels = std::move(line.labels);
    take.audio = std::move(line.audio);
  }
  return corpus;
}

TEST(AlignmentTrial, FindsWordsInNoiseAndTellsWrongTexts) {
  const AlignmentTrial trial = tryAlignment(spokenCorpus(), {.jobs = 1});
  ASSERT_EQ(trial.noise.size(), 3 * kNoises.size() + 1);
  EXPECT_EQ(trial.noise[0].under, "office, 20 dB");
  EXPECT_GT(trial.noise[0].start_errors_ms.size(), 20U);
  std::vector<double> errors = trial.noise[0].start_errors_ms;
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 20) << "ms";
  ASSERT_EQ(trial.doubt.size(), 28U) << "four texts, alone and in office and street noise of three levels";
  EXPECT_EQ(trial.doubt[0].lines, 2U);
  EXPECT_LE(trial.doubt[0].doubted, 1U) << "the right text: one word in forty is doubted without cause";
  EXPECT_EQ(trial.doubt[1].doubted, 2U) << "another's text";
  const AlignmentTrial again = tryAlignment(spokenCorpus(), {.jobs = 2});
  for (std::size_t i = 0; i < trial.noise.size(); ++i)
    EXPECT_EQ(again.noise[i].start_errors_ms, trial.noise[i].start_errors_ms) << "threads change nothing";
  EXPECT_NE(alignmentTable(trial).find("street, 5 dB"), std::string::npos);
}

/// Words do not go where only music is: what is heard before and after them is learnt as silence.
TEST(AlignmentTrial, TheRealSpeakersWordsStayTogetherInMusic) {
  if (!fs::exists(kGridTakes)) GTEST_SKIP() << "no real capture in " << kGridTakes;
  ForcedAligner aligner;
  std::size_t torn = 0;
  const std::vector<std::pair<std::string, std::uint64_t>> torn_before{
      {"bwis9s", 1008}, {"lbwk8n", 1009}, {"prwd7a", 1020}, {"brbt2p", 1005},
      {"lgal8n", 1010}, {"pgby4n", 1017}, {"sgbp7a", 1026}, {"srab3a", 1027}};
  for (const auto& [name, seed] : torn_before) {
    const fs::path take = kGridTakes / name;
    const AudioClip sound = readAudio(fs::path(take).replace_extension(".wav"));
    std::vector<TranscriptWord> words;
    const SpeechLabels labels = readLabels(fs::path(take).replace_extension(".TextGrid"));
    for (const LabelledWord& word : labels.words) {
      Pronunciation& way = words.emplace_back(TranscriptWord{word.text, {{}}}).ways.front();
      for (std::size_t i = word.phones.first.value; i <= word.phones.last.value; ++i)
        way.phones.push_back(labels.phones[i].phone);
      way.stress.assign(way.phones.size(), -1);
    }
    const SpeechLabels found = aligner.align(inNoise(sound, Noise::kMusic, 5, {}, seed), words, name).labels;
    Seconds longest = 0;
    for (std::size_t i = 1; i + 1 < found.phones.size(); ++i) {
      if (found.phones[i].phone == Phone::kSil) longest = std::max(longest, found.phones[i].span.duration());
    }
    torn += longest > 0.3 ? 1U : 0U;
  }
  EXPECT_LE(torn, 1U) << "of eight";
}

TEST(AlignmentTrial, RefusesACorpusWithoutSound) {
  Corpus corpus = spokenCorpus();
  for (CorpusTake& take : corpus.takes) take.audio = {};
  EXPECT_THROW(tryAlignment(corpus), InputError);
}

TEST(Noises, HaveTheLevelThatWasAskedFor) {
  constexpr int kRateHz = 16000;
  AudioClip tone{kRateHz, std::vector<float>(kRateHz)};
  for (std::size_t i = 0; i < tone.samples.size(); ++i)
    tone.samples[i] = static_cast<float>(0.1 * std::sin(0.3 * static_cast<double>(i)));
  for (const Noise noise : kNoises) {
    const AudioClip noisy = inNoise(tone, noise, 10, {tone}, 1);
    ASSERT_EQ(noisy.samples.size(), tone.samples.size());
    double speech = 0, added = 0;
    for (std::size_t i = 0; i < tone.samples.size(); ++i) {
      const double more = double{noisy.samples[i]} - double{tone.samples[i]};
      speech += double{tone.samples[i]} * double{tone.samples[i]};
      added += more * more;
    }
    EXPECT_NEAR(10 * std::log10(speech / added), 10, 0.1) << noiseName(noise);
    EXPECT_EQ(inNoise(tone, noise, 10, {tone}, 1).samples, noisy.samples);
    EXPECT_NE(inNoise(tone, noise, 10, {tone}, 2).samples, noisy.samples);
  }
  AudioClip click{kRateHz, std::vector<float>(kRateHz)};
  click.samples[100] = 1;
  const AudioClip echoed = inRoom(click, 0.4, 1);
  const auto power = [&](std::size_t first, std::size_t end) {
    double sum = 0;
    for (std::size_t i = first; i < end; ++i) sum += double{echoed.samples[i]} * double{echoed.samples[i]};
    return sum;
  };
  EXPECT_NEAR(power(101, kRateHz), 1, 1e-3) << "as loud as the sound itself";
  EXPECT_NEAR(10 * std::log10(power(1700, 2500) / power(3300, 4100)), 60 * 0.1 / 0.4, 2) << "dB in 0.1 s";
}

TEST(HearingTable, HasNoRowOfAWayThatNobodyAskedFor) {
  HearingScore asked{"asked for", {}, {}, {}, 1, 0, 2, 1};
  asked.phones.right = 10;
  const std::vector<HearingScore> scores{asked, {"not asked for", {}, {}, {}, 0, 0, 0, 0}};
  for (const std::string& told : {hearingTable(scores), hearingJson(scores)}) {
    EXPECT_NE(told.find("asked for"), std::string::npos);
    EXPECT_EQ(told.find("not asked for"), std::string::npos) << told;
  }
}

}  // namespace
}  // namespace mouthpiece
