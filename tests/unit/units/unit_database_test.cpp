#include "units/selection/unit_database.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <thread>

#include "support/random_corpus.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/selection/selection.h"

namespace mouthpiece {
namespace {

using samples::Chance;
using samples::tinyCorpus;

/// Whether every frame from the one at or before the first phone's start to the one at or after the last one's end has
/// all markers, and the motion lasts as long as what is said.
bool isSeenByLooking(const CorpusTake& take, std::size_t first, std::size_t count) {
  const double rate = take.motion.frame_rate_hz;
  const LabelledPhone& last = take.labels.phones[first + count - 1];
  const Seconds needed = last.phone == Phone::kSil ? last.span.start : last.span.end;
  if (needed * rate > static_cast<double>(take.motion.frameCount())) return false;
  for (Eigen::Index frame = 0; frame < take.motion.positions_mm.rows(); ++frame) {
    const auto at = static_cast<double>(frame);
    if (at < std::floor(take.labels.phones[first].span.start * rate) || at > std::ceil(last.span.end * rate)) continue;
    if (!take.motion.positions_mm.row(frame).allFinite()) return false;
  }
  return true;
}

TEST(UnitDatabase, OfManyPlacesOfAPairSomeEvenlySpread) {
  const Corpus corpus = tinyCorpus(std::vector<std::string>(9, "T-EH-N"), 5);
  const UnitDatabase database(corpus);
  const std::vector<PhonePlace> all = database.diphones(Phone::kT, Phone::kEH);
  ASSERT_EQ(all.size(), 9U);
  EXPECT_TRUE(database.hasDiphone(Phone::kT, Phone::kEH));
  EXPECT_FALSE(database.hasDiphone(Phone::kEH, Phone::kT));
  EXPECT_EQ(database.diphones(Phone::kT, Phone::kEH, 10), all);
  EXPECT_EQ(database.diphones(Phone::kT, Phone::kEH, 4), (std::vector<PhonePlace>{all[0], all[3], all[6]}));
}

TEST(UnitDatabase, SaysWhatWasSeenAsLookingAtEveryFrameDoes) {
  const std::uint64_t first_seed = samples::firstSeed();
  std::size_t unseen = 0, seen = 0;
  for (std::uint64_t seed = first_seed; seed < first_seed + 60; ++seed) {
    SCOPED_TRACE("MOUTHPIECE_SEED=" + std::to_string(seed));
    Chance chance(seed);
    Corpus corpus = samples::randomCorpus(chance);
    if (chance.oneIn(4)) {  // a capture that ends before the speech does
      MotionClip& motion = corpus.takes[0].motion;
      motion.positions_mm.conservativeResize(motion.positions_mm.rows() * 2 / 3, Eigen::NoChange);
    }
    const UnitDatabase database(corpus);
    for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
      const std::size_t phones = corpus.takes[take].labels.phones.size();
      for (std::size_t first = 0; first < phones; ++first) {
        for (std::size_t count = 1; first + count <= phones; ++count) {
          const bool is_seen = database.isSeen({TakeIndex(take), PhoneIndex(first)}, count);
          ASSERT_EQ(is_seen, isSeenByLooking(corpus.takes[take], first, count)) << take << " " << first << " " << count;
          ++(is_seen ? seen : unseen);
        }
      }
    }
  }
  EXPECT_GT(unseen, 100U);
  EXPECT_GT(seen, 100U);
}

TEST(UnitDatabase, FindsEveryDiphoneOnce) {
  Chance chance(samples::firstSeed());
  for (int round = 0; round < 20; ++round) {
    const Corpus corpus = samples::randomCorpus(chance);
    const UnitDatabase database(corpus);
    std::size_t pairs = 0, listed = 0;
    for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
      const auto& phones = corpus.takes[take].labels.phones;
      for (std::size_t i = 0; i + 1 < phones.size(); ++i, ++pairs) {
        const auto& places = database.diphones(phones[i].phone, phones[i + 1].phone);
        EXPECT_EQ(std::count(places.begin(), places.end(), PhonePlace{TakeIndex(take), PhoneIndex(i)}), 1);
        EXPECT_TRUE(std::is_sorted(places.begin(), places.end()));
      }
    }
    for (std::size_t a = 0; a < kPhoneCount; ++a) {
      for (std::size_t b = 0; b < kPhoneCount; ++b)
        listed += database.diphones(static_cast<Phone>(a), static_cast<Phone>(b)).size();
    }
    EXPECT_EQ(listed, pairs);
  }
}

TEST(UnitDatabase, LipsAreThoseOfTheTakeAtEightPoints) {
  const Corpus corpus = tinyCorpus();
  const UnitDatabase database(corpus);
  ASSERT_EQ(database.lipColumns().size(), 9U) << "both lips and the chin";
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    const CorpusTake& own = corpus.takes[take];
    for (std::size_t phone = 0; phone < own.labels.phones.size(); ++phone) {
      const PhoneLips& lips = database.lipsOf({TakeIndex(take), PhoneIndex(phone)});
      const TimeSpan& span = own.labels.phones[phone].span;
      for (Eigen::Index k = 0; k < PhoneLips::kPoints; ++k) {
        const double frame = std::min((span.start + (static_cast<double>(k) + 0.5) / 8 * span.duration()) * 120,
                                      static_cast<double>(own.motion.frameCount() - 1));
        const auto before = static_cast<Eigen::Index>(frame);
        const Eigen::Index after = std::min(before + 1, own.motion.positions_mm.rows() - 1);
        const double part = frame - static_cast<double>(before);
        const Eigen::RowVectorXd expected =
            (1 - part) * own.motion.positions_mm.row(before) + part * own.motion.positions_mm.row(after);
        EXPECT_LT((lips.positions_mm.row(k).cast<double>() - expected.head(9)).cwiseAbs().maxCoeff(), 1e-4);
      }
    }
  }
}

/// Lips that part by 60 mm/s: over a phone of any length the change per phone is 60 mm/s times its length.
TEST(UnitDatabase, StepsAreTheChangeOverAWholePhone) {
  Corpus corpus = tinyCorpus({"T-AE-T"});
  MotionClip& motion = corpus.takes[0].motion;
  for (Eigen::Index frame = 0; frame < motion.positions_mm.rows(); ++frame)
    motion.positions_mm(frame, 4) = -60 * static_cast<double>(frame) / motion.frame_rate_hz;
  const UnitDatabase database(corpus);
  for (const std::size_t phone : {1U, 2U, 3U}) {
    const PhonePlace place{TakeIndex(0), PhoneIndex(phone)};
    const double expected = -60 * database.phoneAt(place).span.duration();
    for (Eigen::Index k = 0; k < PhoneLips::kPoints; ++k)
      EXPECT_NEAR(database.lipsOf(place).steps_mm(k, 4), expected, 1e-3);
  }
}

TEST(UnitDatabase, OpeningLeftIsTheLeastOfThePhoneAndItsSurroundings) {
  Corpus corpus = tinyCorpus({"AE-M-AE"});
  MotionClip& motion = corpus.takes[0].motion;
  motion.positions_mm.leftCols(6).setZero();
  motion.positions_mm.col(4).setConstant(-8);  // 8 mm open, 7 beyond the neutral pose
  const TimeSpan closure = corpus.takes[0].labels.phones[2].span;
  motion.positions_mm(static_cast<Eigen::Index>(closure.middle() * 120), 4) = -3;
  const UnitDatabase database(corpus);
  const auto left = [&](std::size_t phone) { return database.openingLeft({TakeIndex(0), PhoneIndex(phone)}); };
  EXPECT_NEAR(left(2), 2, 1e-9);
  EXPECT_NEAR(left(1), 7, 1e-9);
  motion.positions_mm(static_cast<Eigen::Index>((closure.start - 0.015) * 120), 4) = -1;  // labels are that uncertain
  const UnitDatabase again(corpus);
  EXPECT_NEAR(again.openingLeft({TakeIndex(0), PhoneIndex(2)}), 0, 1e-9);
}

TEST(UnitDatabase, ALayoutWithoutLipsHasNoOpening) {
  Corpus corpus = tinyCorpus({"AE-M-AE"});
  for (LayoutMarker& marker : corpus.layout.markers) {
    if (marker.name == "LIP_LO_MID") marker.name = "LIP_OTHER";
  }
  for (CorpusTake& take : corpus.takes) take.motion.marker_names = corpus.layout.markerNames();
  const UnitDatabase database(corpus);
  EXPECT_EQ(database.openingLeft({TakeIndex(0), PhoneIndex(2)}), 0);
  EXPECT_EQ(selectUnits(corpus.takes[0].labels, database, {}).size(), 1U);
}

/// One database serves many threads: each line is selected as it is alone.
TEST(UnitDatabase, ThreadsSelectAsOneAfterTheOtherDo) {
  Corpus corpus = tinyCorpus();
  corpus.trajectory_model = samples::tinyModel(corpus);
  const std::vector<const char*> lines = {"T-AY-M IH-Z T-EH-N", "M-AE-N IH-Z N-AW", "N-UW-N | DH-AH M-AE-P",
                                          "T-EH-N M-EH-N"};
  const auto select = [&](const UnitDatabase& database, std::size_t i) {
    const SelectionMethod method = i % 2 == 0 ? SelectionMethod::kGreedy : SelectionMethod::kViterbi;
    return selectUnits(samples::tinyLabels(lines[i % lines.size()], i + 1), database, {.method = method});
  };
  constexpr std::size_t kRuns = 16;
  std::vector<std::vector<SelectedUnit>> alone(kRuns), together(kRuns);
  const UnitDatabase one(corpus), shared(corpus);
  for (std::size_t i = 0; i < kRuns; ++i) alone[i] = select(one, i);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < kRuns; ++i) threads.emplace_back([&, i] { together[i] = select(shared, i); });
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < kRuns; ++i) {
    ASSERT_EQ(alone[i].size(), together[i].size());
    for (std::size_t u = 0; u < alone[i].size(); ++u) {
      EXPECT_EQ(alone[i][u].source, together[i][u].source);
      EXPECT_EQ(alone[i][u].target_cost, together[i][u].target_cost);
    }
  }
}

/// Between two frames it is their mean by time, and beyond the ends of a clip what these show.
/// Counts what is loaded.
class CountingSource : public TakeSource {
 public:
  explicit CountingSource(Corpus corpus) : corpus_(std::move(corpus)) {}
  [[nodiscard]] MotionClip load(TakeIndex take) const override {
    ++loads;
    return corpus_.takes[take.value].motion;
  }
  [[nodiscard]] AudioClip loadAudio(TakeIndex /*take*/) const override { return {}; }
  mutable int loads = 0;

 private:
  Corpus corpus_;
};

/// Tells what was seen without being loaded.
class TellingSource final : public CountingSource {
 public:
  using CountingSource::CountingSource;
  [[nodiscard]] std::optional<std::vector<bool>> loadUnseen(TakeIndex take) const override {
    std::vector<bool> unseen;
    const MotionClip clip = load(take);
    --loads;
    for (const auto& frame : clip.positions_mm.rowwise()) unseen.push_back(frame.hasNaN());
    return unseen;
  }
};

TEST(UnitDatabase, AsksTheSourceWhatWasSeenBeforeItLoads) {
  Corpus corpus = samples::tinyCorpus();
  corpus.takes[0].motion.positions_mm.block(20, 3, 2, 3).setConstant(std::nan(""));
  const UnitDatabase in_memory(corpus);
  for (const bool tells : {true, false}) {
    const std::shared_ptr<CountingSource> source =
        tells ? std::make_shared<TellingSource>(corpus) : std::make_shared<CountingSource>(corpus);
    Corpus on_demand = corpus;
    on_demand.take_source = source;
    const UnitDatabase database(on_demand);
    for (std::size_t first = 0; first < corpus.takes[0].labels.phones.size(); ++first) {
      const PhonePlace place{TakeIndex(0), PhoneIndex(first)};
      EXPECT_EQ(database.isSeen(place, 1), in_memory.isSeen(place, 1)) << first;
    }
    EXPECT_EQ(database.frameCount(TakeIndex(0)), corpus.takes[0].motion.frameCount());
    EXPECT_EQ(source->loads, tells ? 0 : 1);
  }
}

TEST(UnitDatabase, ForgetsTakesAndLoadsThemAgain) {
  Corpus corpus = samples::tinyCorpus();
  const auto source = std::make_shared<CountingSource>(corpus);
  corpus.take_source = source;
  UnitDatabase database(corpus);
  const PhonePlace place{TakeIndex(1), PhoneIndex(1)};
  const PositionMatrix motion = database.motionOf(place.take)->positions_mm;
  const PhoneLips::Matrix lips = database.lipsOf(place).positions_mm;
  ASSERT_GT(motion.rows(), 0);
  EXPECT_EQ(source->loads, 1);
  database.forgetTakes();
  EXPECT_EQ(database.lipsOf(place).positions_mm, lips);
  EXPECT_EQ(database.motionOf(place.take)->positions_mm, motion);
  EXPECT_EQ(source->loads, 2);
}

TEST(UnitDatabase, KeepsTheMotionThatWasAskedForLast) {
  Corpus corpus = samples::tinyCorpus();
  corpus.takes.resize(2);
  for (CorpusTake& take : corpus.takes)
    take.motion.positions_mm =
        PositionMatrix::Zero(2'500'000 / take.motion.positions_mm.cols(), take.motion.positions_mm.cols());
  const auto source = std::make_shared<CountingSource>(corpus);
  corpus.take_source = source;
  const UnitDatabase database(corpus);
  std::weak_ptr<const MotionClip> first = database.motionOf(TakeIndex(0));
  EXPECT_EQ(database.motionOf(TakeIndex(0)), first.lock()) << "the same";
  EXPECT_EQ(source->loads, 1);
  const std::shared_ptr<const MotionClip> second = database.motionOf(TakeIndex(1));
  EXPECT_TRUE(first.expired()) << "both are more than 32 MB";
  EXPECT_EQ(database.motionOf(TakeIndex(1)), second);
  EXPECT_EQ(source->loads, 2);
  EXPECT_NE(database.motionOf(TakeIndex(0)), nullptr) << "loaded again";
  EXPECT_EQ(source->loads, 3);
}

TEST(PoseAt, IsBetweenItsFramesAndHeldBeyondThem) {
  CorpusTake take = samples::tinyTake("a", "DH-AH T-AY-M", 3, 50);
  take.motion.positions_mm.setRandom();
  const std::vector<Eigen::Index> columns{1, 4, 7};
  const auto frame = [&](Eigen::Index k) -> Eigen::RowVectorXd { return take.motion.positions_mm(k, columns); };
  const Eigen::Index last = take.motion.positions_mm.rows() - 1;
  for (Eigen::Index k = 0; k < last; ++k) {
    for (const double part : {0.0, 0.25, 0.9}) {
      EXPECT_LT((poseAt(take.motion, columns, (asReal(k) + part) / 50) - (1 - part) * frame(k) - part * frame(k + 1))
                    .cwiseAbs()
                    .maxCoeff(),
                1e-9)
          << k << " " << part;
    }
  }
  for (const double beyond : {0.0, 0.5, 100.0}) {
    EXPECT_EQ(poseAt(take.motion, columns, (asReal(last) + beyond) / 50), frame(last));
    EXPECT_EQ(poseAt(take.motion, columns, -beyond / 50), frame(0));
  }
}

}  // namespace
}  // namespace mouthpiece
