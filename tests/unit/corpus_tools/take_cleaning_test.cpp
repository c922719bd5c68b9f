// The neutral pose, the alignment of takes by their phones, and words found by a lexicon.
#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "corpus_tools/building/corpus_facts.h"
#include "corpus_tools/takes/pose_fit.h"
#include "corpus_tools/takes/take_files.h"
#include "corpus_tools/takes/take_poses.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

TEST(NeutralPose, BreathingInSilenceIsNotRest) {
  CorpusTake take = SyntheticTake{}.clean();
  const MarkerLayout& layout = defaultLayout();
  // Two thirds of the silence before the word with the mouth wide open.
  const auto column = static_cast<Eigen::Index>(3 * layout.indexOf("LIP_LO_MID").value + 1);
  take.motion.positions_mm.col(column).head(27).array() -= 15;
  take.motion.positions_mm.col(column).tail(30).array() -= 15;
  const NeutralPose neutral = neutralPose({take}, layout);
  EXPECT_NEAR(neutral.pose_mm(static_cast<Eigen::Index>(layout.indexOf("LIP_LO_MID").value), 1), -75, 0.5);
  EXPECT_LT(neutral.frames, 30U);
}

TEST(NeutralPose, AMarkerNeverSeenIsNamed) {
  CorpusTake take = SyntheticTake{}.clean();
  const auto column = static_cast<Eigen::Index>(3 * defaultLayout().indexOf("NOSE_TIP").value);
  take.motion.positions_mm.middleCols(column, 3).setConstant(std::nan(""));
  try {
    neutralPose({take}, defaultLayout());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("NOSE_TIP is seen in no take"), std::string::npos);
  }
}

TEST(NeutralPose, AMarkerHiddenAtRestIsTakenFromElsewhere) {
  CorpusTake take = SyntheticTake{}.clean();
  const auto column = static_cast<Eigen::Index>(3 * defaultLayout().indexOf("NOSE_TIP").value);
  take.motion.positions_mm.middleCols(column, 3).topRows(50).setConstant(std::nan(""));
  take.motion.positions_mm.middleCols(column, 3).bottomRows(50).setConstant(std::nan(""));
  EXPECT_TRUE(neutralPose({take}, defaultLayout()).pose_mm.allFinite());
}

TEST(TakeAlignment, BringsADisplacedTakeBackAndKeepsDistances) {
  std::vector<CorpusTake> takes(6, SyntheticTake{}.clean());
  RigidMotion slip = SyntheticTake{}.worldFromHead(0.1);
  slip.translation_mm = {1, -2, 0.5};
  slip.rotation = Eigen::Matrix3d::Identity();
  transform(takes[2].motion, slip);
  const std::vector<double> moves = alignTakesByPhones(takes);
  EXPECT_LT((takes[2].motion.positions_mm - takes[0].motion.positions_mm).array().abs().maxCoeff(), 1e-6);
  EXPECT_GT(moves[2], 1.5);
  EXPECT_LT(moves[0], 0.5);
}

TEST(TakeAlignment, NothingToCompareLeavesTheTakeAlone) {
  std::vector<CorpusTake> takes = {SyntheticTake{}.clean()};
  takes[0].motion.positions_mm.setConstant(std::nan(""));
  EXPECT_EQ(alignTakesByPhones(takes).at(0), 0.0);
}

TEST(WordMatching, TriesEveryPronunciation) {
  SyntheticTake take;
  take.phones = {"sil", "DH", "IY", "sil", "AE", "P", "AX", "L", "sil"};
  take.words = {"x"};
  const Lexicon lexicon = Lexicon::parse("the DH AH\nthe(2) DH IY\napple AE P AH L\nbin B IH N\n", "lexicon");
  const auto labels = withWords(take.labels(), "The \"apple\".", lexicon);
  ASSERT_TRUE(labels);
  ASSERT_EQ(labels->words.size(), 2U);
  EXPECT_EQ(labels->words[0].text, "The");
  EXPECT_EQ(labels->words[1].text, "apple");
  EXPECT_EQ(labels->phones.size(), take.labels().phones.size());
  EXPECT_FALSE(withWords(take.labels(), "the bin", lexicon));
  EXPECT_FALSE(withWords(take.labels(), "the", lexicon));
  EXPECT_FALSE(withWords(take.labels(), "the unheard", lexicon));
  EXPECT_FALSE(withWords(take.labels(), " ,. ", lexicon));
}

Corpus oneTake() {
  Corpus corpus;
  corpus.name = "one";
  corpus.layout = defaultLayout();
  corpus.neutral_pose_mm = syntheticNeutral();
  corpus.takes = {SyntheticTake{}.clean()};
  return corpus;
}

TEST(CorpusCheck, ASoundCorpusHasNoProblem) {
  const CorpusCheck check = checkCorpus(oneTake());
  EXPECT_TRUE(check.problems.empty());
  EXPECT_TRUE(check.remarks.empty());
  EXPECT_NE(corpusFactsText(oneTake()).find("takes           1 (1.1 s, 0.3 s of speech)"), std::string::npos);
}

TEST(CorpusCheck, LooksIntoTheVisemePoses) {
  Corpus corpus = oneTake();
  corpus.viseme_poses = "{}";
  const CorpusCheck check = checkCorpus(corpus);
  ASSERT_EQ(check.problems.size(), 1U);
  EXPECT_EQ(check.problems[0], "one.corpus:markers: is missing; expected a list of 1 to 1000");
}

TEST(CorpusCheck, NamesWhatIsWrong) {
  Corpus corpus = oneTake();
  corpus.neutral_pose_mm /= 1000;
  corpus.takes[0].audio.samples.resize(10);
  corpus.takes[0].motion.positions_mm(40, 4) += 200;
  corpus.takes[0].motion.positions_mm.block(10, 30, 40, 6).setConstant(std::nan(""));
  const CorpusCheck check = checkCorpus(corpus);
  ASSERT_EQ(check.problems.size(), 2U);
  EXPECT_NE(check.problems[0].find("not the size of a face"), std::string::npos);
  EXPECT_NE(check.problems[1].find("sound ends at 0.00 s"), std::string::npos);
  ASSERT_EQ(check.remarks.size(), 2U);
  EXPECT_NE(check.remarks[0].find("and 1 more missing"), std::string::npos);
  EXPECT_NE(check.remarks[1].find("FOREHEAD_MID faster than"), std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
