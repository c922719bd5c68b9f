#include "synthesis/join.h"

#include <gtest/gtest.h>

#include <array>

#include "support/tiny_corpus.h"

namespace mouthpiece {
namespace {

/// "DH-AH T-AY-M IH-Z T-EH-N" from takes that lie 4 mm apart.
class JoinOffsets : public ::testing::Test {
 protected:
  JoinOffsets() : corpus_(samples::tinyCorpus()), line_(samples::tinyLabels("DH-AH T-AY-M IH-Z T-EH-N", 6)) {
    for (std::size_t take = 0; take < corpus_.takes.size(); ++take) {
      corpus_.takes[take].motion.positions_mm.array() += take % 2 == 0 ? 4 : 0;
    }
    database_ = std::make_unique<UnitDatabase>(corpus_);
    fragments_ = cutIntoFragments(line_, *database_, selectUnits(line_, *database_, {}));
    for (std::size_t i = 0; i + 1 < fragments_.size(); ++i) {
      joins_.push_back(placeJoin(line_, fragments_[i].fragment, fragments_[i + 1].fragment, {0.06, 60}));
    }
    offsets_ = findJoinOffsets(line_, fragments_, joins_);
  }

  Corpus corpus_;
  SpeechLabels line_;
  std::unique_ptr<UnitDatabase> database_;
  std::vector<UnitFragment> fragments_;
  std::vector<JoinSpans> joins_;
  std::vector<JoinOffset> offsets_;
};

TEST_F(JoinOffsets, BothSidesMeetAtTheJoin) {
  ASSERT_EQ(offsets_.size(), joins_.size());
  ASSERT_FALSE(offsets_.empty());
  std::size_t led = 0;
  for (std::size_t i = 0; i < offsets_.size(); ++i) {
    const JoinOffset& offset = offsets_[i];
    if (offset.reach_before + offset.reach_after < 0.02) continue;
    const std::array<Seconds, 1> at{offset.time};
    const Eigen::RowVectorXd before = fragments_[i].fragment.posesAt(at).row(0) + offset.shiftOfBefore(offset.time);
    const Eigen::RowVectorXd after = fragments_[i + 1].fragment.posesAt(at).row(0) + offset.shiftOfAfter(offset.time);
    EXPECT_LT((before - after).cwiseAbs().maxCoeff(), 1e-9) << "join " << i;
    EXPECT_LT(offset.shiftOfBefore(offset.time - offset.reach_before).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT(offset.shiftOfAfter(offset.time + offset.reach_after).cwiseAbs().maxCoeff(), 1e-12);
    ++led;
  }
  EXPECT_GT(led, 0U);
}

TEST_F(JoinOffsets, LipsThatMustTouchAreLeftAlone) {
  for (const JoinOffset& offset : offsets_) {
    for (const LabelledPhone& phone : line_.phones) {
      if (!isBilabial(phone.phone)) continue;
      for (const double u : {0.01, 0.5, 0.99}) {
        const Seconds time = std::lerp(phone.span.start, phone.span.end, u);
        const Eigen::RowVectorXd shift = time < offset.time ? offset.shiftOfBefore(time) : offset.shiftOfAfter(time);
        EXPECT_LT(shift.cwiseAbs().maxCoeff(), 1e-12);
      }
    }
  }
}

TEST_F(JoinOffsets, JoinsLieInOrderAndTheLipsWithinTheUpperFace) {
  for (std::size_t i = 0; i < joins_.size(); ++i) {
    EXPECT_LE(joins_[i].upper_face.start, joins_[i].lips.start);
    EXPECT_GE(joins_[i].upper_face.end, joins_[i].lips.end);
    if (i == 0) continue;
    EXPECT_LT(joins_[i - 1].lips.middle(), joins_[i].lips.middle());
  }
}

}  // namespace
}  // namespace mouthpiece
