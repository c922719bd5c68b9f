#include "corpus_tools/research/tuning/tuning.h"

#include <gtest/gtest.h>

#include <limits>

#include "base/errors.h"
#include "corpus_tools/building/trajectory_fit.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kTakes = 16;

/// Takes of four syllables from a few, so that every fold can speak the others' words.
Corpus speakingCorpus() {
  const std::vector<std::vector<std::string>> syllables = {{"B", "IY"}, {"M", "AA"}, {"N", "IY"}, {"P", "AA"}};
  Corpus corpus;
  corpus.name = "speaking";
  corpus.layout = defaultLayout();
  corpus.neutral_pose_mm = syntheticNeutral();
  for (std::size_t i = 0; i < kTakes; ++i) {
    SyntheticTake take;
    take.name = "take" + std::to_string(i);
    take.phones = {"sil"};
    for (const std::size_t which : {i % 4, (i / 4) % 4, (i + i / 4) % 4, (3 * i + 1) % 4})
      take.phones.insert(take.phones.end(), syllables[which].begin(), syllables[which].end());
    take.phones.emplace_back("sil");
    take.words = {take.name};
    corpus.takes.push_back(take.clean());
  }
  corpus.trajectory_model = fitTrajectoryModel(corpus);
  return corpus;
}

TEST(TuningScore, CountsErrorAndClosures) {
  LipMeasures measures;
  measures.squared_error_mm2 = 8;
  measures.squared_errors = 2;
  EXPECT_DOUBLE_EQ(tuningScore(measures), 2);
  measures.closures = 4;
  measures.closures_kept = 3;
  measures.open_phones = 10;
  measures.false_closures = 1;
  EXPECT_DOUBLE_EQ(tuningScore(measures), 2 + 0.25 + 0.1);
}

TEST(WeightTuning, NeverGivesWorseWeightsThanItFound) {
  const Corpus corpus = speakingCorpus();
  ASSERT_NE(corpus.trajectory_model, nullptr);
  const TunedWeights tuned = tuneLatticeWeights(corpus, {.folds = 4, .jobs = 1});
  EXPECT_EQ(tuned.search_takes + tuned.judge_takes, kTakes);
  EXPECT_LE(tuned.search_after, tuned.search_before);
  EXPECT_GT(tuned.settings, 24U);
  if (tuned.helps) {
    EXPECT_LT(tuned.judge_after, tuned.judge_before);
  } else {
    EXPECT_EQ(tuned.weights, corpus.lattice_weights);
  }
  const TunedWeights threaded = tuneLatticeWeights(corpus, {.folds = 4, .jobs = 3});
  EXPECT_EQ(describeTuning(threaded), describeTuning(tuned));
}

TEST(WeightTuning, KeepsHowTheyWereLearntInTheCorpus) {
  Corpus corpus = speakingCorpus();
  TunedWeights tuned;
  tuned.helps = tuned.taken = true;
  tuned.weights["duration"] = 0.5;
  tuned.changes = "duration 1 -> 0.5";
  storeTuning(corpus, tuned);
  EXPECT_EQ(corpus.lattice_weights["duration"], 0.5);
  EXPECT_NE(corpus.build_log.at("lattice_weights").find("duration 1 -> 0.5"), std::string::npos);
}

TEST(WeightTuning, RefusesWhatItCannotLearnFrom) {
  Corpus corpus = speakingCorpus();
  EXPECT_THROW(tuneLatticeWeights(corpus, {.folds = 3}), InputError);
  EXPECT_THROW(tuneLatticeWeights(corpus, {.folds = 5}), InputError);
  constexpr std::size_t kWrapsWhenMultiplied = std::numeric_limits<std::size_t>::max() / 2 + 1;
  EXPECT_THROW(tuneLatticeWeights(corpus, {.folds = kWrapsWhenMultiplied}), InputError);
  corpus.trajectory_model = nullptr;
  EXPECT_THROW(tuneLatticeWeights(corpus, {.folds = 4}), InputError);
}

}  // namespace
}  // namespace mouthpiece
