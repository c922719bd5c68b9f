#include "corpus_tools/research/tuning/tuning.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "base/errors.h"
#include "corpus_tools/building/trajectory_fit.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

/// Takes of a few syllables, so that either half can speak the other's.
Corpus talkingCorpus() {
  const std::vector<std::vector<std::string>> syllables = {{"B", "IY"}, {"M", "AA"}, {"N", "IY"}, {"P", "AA"}};
  std::vector<CorpusTake> takes;
  for (std::size_t i = 0; i < 8; ++i) {
    SyntheticTake take;
    take.name = "take" + std::to_string(i);
    take.phones = {"sil"};
    for (const std::size_t which : {i % 4, (i / 2) % 4, (i + i / 4) % 4})
      take.phones.insert(take.phones.end(), syllables[which].begin(), syllables[which].end());
    take.phones.emplace_back("sil");
    take.words = {take.name};
    takes.push_back(take.clean());
    takes.back().audio = take.audio();
  }
  Corpus corpus = corpusOf("talking", std::move(takes));
  corpus.trajectory_model = fitTrajectoryModel(corpus);
  return corpus;
}

TEST(VoiceTuning, NeverGivesWorseWeightsThanItFound) {
  const Corpus corpus = talkingCorpus();
  ASSERT_NE(corpus.trajectory_model, nullptr);
  const TunedVoice tuned = tuneCorpusVoice(corpus, {.folds = 2, .jobs = 1});
  EXPECT_EQ(tuned.search_takes + tuned.judge_takes, corpus.takes.size());
  EXPECT_GT(tuned.search_before, 0);
  EXPECT_LE(tuned.search_after, tuned.search_before);
  EXPECT_GT(tuned.settings, 16U);
  if (tuned.helps) {
    EXPECT_LT(tuned.judge_after.sum(), tuned.judge_before.sum());
  } else {
    EXPECT_EQ(tuned.weights, corpus.sound_cut_weights);
  }
}

TEST(VoiceTuning, TheCorpusFileKeepsTheWeightsAndHowTheyWereLearnt) {
  Corpus corpus = talkingCorpus();
  TunedVoice tuned;
  tuned.helps = tuned.taken = true;
  tuned.weights.per_octave = 3;
  tuned.weights.in_join = 0.25;
  tuned.changes = "octave 6 -> 3";
  storeTuning(corpus, tuned);
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("voice_tuning." + std::to_string(::getpid()) + ".corpus");
  writeCorpus(path, corpus);
  const Corpus read = readCorpus(path);
  EXPECT_TRUE(checkCorpus(path).empty());
  std::filesystem::remove(path);
  EXPECT_EQ(read.sound_cut_weights.per_octave, 3);
  EXPECT_EQ(read.sound_cut_weights.in_join, 0.25);
  EXPECT_EQ(read.trajectory_model->targets.size(), corpus.trajectory_model->targets.size());
  EXPECT_NE(read.build_log.at("sound_cut_weights").find("octave 6 -> 3"), std::string::npos);
}

TEST(VoiceTuning, RefusesWhatItCannotLearnFrom) {
  Corpus corpus = talkingCorpus();
  EXPECT_THROW(tuneCorpusVoice(corpus, {.folds = 1}), InputError);
  EXPECT_THROW(tuneCorpusVoice(corpus, {.folds = 3}), InputError);
  const AudioClip audio = std::exchange(corpus.takes[3].audio, {});
  EXPECT_THROW(tuneCorpusVoice(corpus, {.folds = 2}), InputError) << "no sound";
  corpus.takes[3].audio = audio;
  corpus.trajectory_model = nullptr;
  EXPECT_THROW(tuneCorpusVoice(corpus, {.folds = 2}), InputError);
}

}  // namespace
}  // namespace mouthpiece
