#include "synthesis/join.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <memory>

#include "support/tiny_corpus.h"
#include "support/tiny_model.h"

namespace mouthpiece {
namespace {

constexpr double kRateHz = 120;
constexpr std::size_t kLowerLip = 1;

/// Two takes of "N-AE-T", every phone 100 ms from 0.2 s, whose lips rest but for what they are given.
class Coupling : public ::testing::Test {
 protected:
  Coupling() : corpus_(samples::tinyCorpus({"N-AE-T", "N-AE-T"}, kRateHz)), line_(samples::tinyLabels("N-AE-T", 0)) {
    const Eigen::Map<const Eigen::RowVectorXd> rest(corpus_.neutral_pose_mm.data(), corpus_.neutral_pose_mm.size());
    for (CorpusTake& take : corpus_.takes) {
      take.labels = line_;
      take.motion.positions_mm = rest.replicate(take.motion.positions_mm.rows(), 1);
    }
  }

  /// The lower lip of a take falls by `open_mm` of the time.
  void move(std::size_t take, const std::function<double(Seconds)>& open_mm) {
    MotionClip& motion = corpus_.takes[take].motion;
    for (Eigen::Index frame = 0; frame < motion.positions_mm.rows(); ++frame)
      motion.positions_mm(frame, 3 * kLowerLip + 1) -= open_mm(static_cast<double>(frame) / kRateHz);
  }

  /// The first take up to AE, the second from there.
  TimeSpan couple(TimeSpan middles, std::span<const Seconds> lengths) {
    database_ = std::make_unique<UnitDatabase>(corpus_);
    const Fragment before(line_, {PhoneIndex(0), PhoneIndex(2)}, *database_, {TakeIndex(0), PhoneIndex(0)});
    const Fragment after(line_, {PhoneIndex(2), PhoneIndex(4)}, *database_, {TakeIndex(1), PhoneIndex(2)});
    return cheapestCoupling(before, after, {middles, lengths});
  }

  Corpus corpus_;
  SpeechLabels line_;
  std::unique_ptr<UnitDatabase> database_;
};

constexpr TimeSpan kInVowel{0.31, 0.39};
constexpr std::array<Seconds, 1> kOneLength{0.03};

TEST_F(Coupling, TakesThePlaceWhereBothAgree) {
  for (const double sign : {-1, 1}) {  // apart by 3 mm before, or after, the middle of the phone
    corpus_.takes[1].motion.positions_mm = corpus_.takes[0].motion.positions_mm;
    move(1, [&](Seconds time) { return 3 / (1 + std::exp(-sign * (time - 0.35) / 0.004)); });
    EXPECT_GT(-sign * (couple(kInVowel, kOneLength).middle() - 0.35), 0.015);
  }
}

TEST_F(Coupling, TakesThePlaceWhereBothMoveAlike) {
  // Always 1 mm apart in size, alternately above and below, but for a stretch that keeps its distance.
  move(1, [](Seconds time) { return time < 0.355 ? std::cos(2 * M_PI * time / 0.06) : 1.0; });
  EXPECT_GT(couple(kInVowel, kOneLength).middle(), 0.36);
}

TEST_F(Coupling, TakesThePlaceWhereTheLipsAreSlow) {
  const auto opens = [](Seconds time) { return 8 / (1 + std::exp(-(time - 0.33) / 0.005)); };
  move(0, opens);
  move(1, opens);
  EXPECT_GT(couple(kInVowel, kOneLength).middle(), 0.36);
}

/// The corpus' own voice joins where its sound is cut, whatever is seen there.
TEST_F(Coupling, AMarkerThatIsNotSeenDoesNotCount) {
  PositionMatrix& positions = corpus_.takes[1].motion.positions_mm;
  for (Eigen::Index frame = std::lround(0.33 * kRateHz); frame < std::lround(0.37 * kRateHz); ++frame)
    positions.row(frame).segment<3>(3 * kLowerLip).setConstant(std::nan(""));
  EXPECT_NEAR(couple({0.35, 0.35}, kOneLength).middle(), 0.35, 1e-9);
  EXPECT_NEAR(couple(kInVowel, kOneLength).middle(), 0.35, 1e-9) << "all else agrees everywhere";
}

TEST_F(Coupling, IsShortBetweenPosesThatDifferAndLongWhereOnlySpeedsDo) {
  constexpr std::array<Seconds, 2> kLengths{0.03, 0.06};
  constexpr TimeSpan kMiddle{0.35, 0.35};
  move(1, [](Seconds) { return 4.0; });
  EXPECT_NEAR(couple(kMiddle, kLengths).duration(), kLengths[0], 1e-9);
  move(1, [](Seconds time) { return -4.0 + 20 * (time - 0.35); });
  EXPECT_NEAR(couple(kMiddle, kLengths).duration(), kLengths[1], 1e-9);
}

TEST_F(Coupling, FragmentsTellTheirLipsAsCapturedAndLessThePrediction) {
  move(0, [](Seconds time) { return 5 * time; });
  corpus_.trajectory_model = samples::tinyModel(corpus_);
  database_ = std::make_unique<UnitDatabase>(corpus_);
  const Fragment fragment(line_, {PhoneIndex(0), PhoneIndex(4)}, *database_, {TakeIndex(0), PhoneIndex(0)},
                          std::make_shared<LinePrediction>(*corpus_.trajectory_model, line_));
  const std::array<Seconds, 2> times{0.3, 0.35};
  const PositionMatrix captured = fragment.capturedLipsAt(times), left = fragment.lipsAt(times);
  const PositionMatrix predicted = corpus_.trajectory_model->predict(line_, times) * corpus_.trajectory_model->shapes;
  const std::vector<Eigen::Index>& columns = database_->lipColumns();
  ASSERT_EQ(captured.cols(), static_cast<Eigen::Index>(columns.size()));
  constexpr double kRounding = 1e-5;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const double rest = corpus_.neutral_pose_mm.data()[columns[i]];
    const auto column = static_cast<Eigen::Index>(i);
    for (Eigen::Index row = 0; row < 2; ++row) {
      const bool falls = columns[i] == 3 * kLowerLip + 1;
      const double moved = falls ? -5 * times[static_cast<std::size_t>(row)] : 0;
      EXPECT_NEAR(captured(row, column), rest + moved, kRounding);
      EXPECT_NEAR(left(row, column), moved - predicted(row, columns[i]), kRounding);
    }
  }
}

}  // namespace
}  // namespace mouthpiece
