#include "synthesis/join.h"

#include <gtest/gtest.h>

#include <array>

#include "support/tiny_corpus.h"

namespace mouthpiece {
namespace {

/// "DH-AH T-AY-M IH-Z T-EH-N" from takes that lie 4 mm apart.
class JoinOffsets : public ::testing::Test {
 protected:
  JoinOffsets() : corpus_(samples::tinyCorpus()) {
    for (std::size_t take = 0; take < corpus_.takes.size(); ++take) {
      corpus_.takes[take].motion.positions_mm.array() += take % 2 == 0 ? 4 : 0;
    }
    database_ = std::make_unique<UnitDatabase>(corpus_);
    join("DH-AH T-AY-M IH-Z T-EH-N");
  }

  void join(const std::string& words) {
    line_ = samples::tinyLabels(words, 6);
    fragments_ = cutIntoFragments(line_, *database_, selectUnits(line_, *database_, {}));
    joins_.clear();
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

/// A piece of a line has its own clock: the same fragments join where they did on that of all pieces, others anew.
TEST_F(JoinOffsets, JoinsOfAnEarlierPieceStay) {
  constexpr Seconds kLater = 1.5, kExact = 1e-9;
  RecentJoins recent;
  const JoinOptions options{.overlap = 0.06, .frame_rate_hz = 60, .search_coupling = true};
  const auto expectPlaced = [&](Seconds origin) {
    for (std::size_t i = 0; i + 1 < fragments_.size(); ++i) {
      const Fragment &before = fragments_[i].fragment, &after = fragments_[i + 1].fragment;
      const JoinSpans placed = recent.place(line_, origin, before, after, options);
      const JoinSpans anew = placeJoin(line_, before, after, options);
      EXPECT_NEAR(placed.lips.start, anew.lips.start, kExact);
      EXPECT_NEAR(placed.lips.end, anew.lips.end, kExact);
      EXPECT_NEAR(placed.upper_face.start, anew.upper_face.start, kExact);
      EXPECT_NEAR(placed.upper_face.end, anew.upper_face.end, kExact);
    }
  };
  ASSERT_GT(fragments_.size(), 1U);
  expectPlaced(kLater);
  const std::vector<SelectedUnit> units = selectUnits(line_, *database_, {});
  const auto moveBy = [&](Seconds by, std::size_t first) {
    for (std::size_t i = first; i < line_.phones.size(); ++i) {
      TimeSpan& span = line_.phones[i].span;
      span = {span.start + (i == first ? 0 : by), span.end + by};
    }
    fragments_ = cutIntoFragments(line_, *database_, units);
  };
  moveBy(0.030, 0);
  moveBy(0.050, line_.phones.size() / 2);
  expectPlaced(kLater - 0.030);  // what lies before is known, what follows lasts longer
}

TEST_F(JoinOffsets, OnlyThoseBesideTheFragmentsSeenAreFound) {
  join("DH-AH T-AY-M IH-Z T-EH-N T-AY-M IH-Z DH-AH T-EH-N IH-Z T-AY-M");
  ASSERT_GT(joins_.size(), 3U);
  std::vector<Seconds> times;
  for (int i = 0; i < 60; ++i) times.push_back(line_.duration() * i / 60);
  std::size_t all_left_out = 0;
  for (Eigen::Index first = 0; first < 60; first += 3) {
    const Eigen::Index end = first + 3;
    const JoinRange range = joinsWithin(joins_, times, first, end);
    const std::vector<JoinOffset> some = findJoinOffsets(line_, fragments_, joins_, range);
    ASSERT_EQ(some.size(), joins_.size());
    std::size_t left_out = 0;
    for (const JoinOffset& offset : some) left_out += offset.offset_mm.size() == 0 ? 1U : 0U;
    EXPECT_EQ(left_out, joins_.size() - (range.end - range.first));
    all_left_out += left_out;
    const auto rows = [&](const std::vector<JoinOffset>& offsets) {
      return blendFragments(fragments_, joins_, offsets, times, BlendKind::kSmooth, corpus_.layout, first, end);
    };
    EXPECT_EQ(rows(some), rows(offsets_)) << first;
  }
  EXPECT_GT(all_left_out, 0U);
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
