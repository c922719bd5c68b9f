#include "synthesis/context_transfer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {
namespace {

using samples::lipOpening;
using samples::tinyCorpus;
using samples::tinyLabels;

class ContextTransfer : public ::testing::Test {
 protected:
  ContextTransfer() : corpus_(tinyCorpus()) { corpus_.trajectory_model = samples::tinyModel(corpus_); }

  [[nodiscard]] UtteranceAnimation speak(const SpeechLabels& line) const {
    SynthesisRequest request;
    request.labels = line;
    request.options.frame_rate_hz = 120;
    request.options.selection.method = SelectionMethod::kViterbi;
    return synthesise(request, corpus_);
  }

  Corpus corpus_;
};

TEST_F(ContextTransfer, ATakesOwnSentenceComesBackAsItWas) {
  for (const CorpusTake& take : corpus_.takes) {
    const UtteranceAnimation made = speak(take.labels);
    const Eigen::Index rows = std::min(made.motion.positions_mm.rows(), take.motion.positions_mm.rows());
    const double worst =
        (made.motion.positions_mm.topRows(rows) - take.motion.positions_mm.topRows(rows)).cwiseAbs().maxCoeff();
    constexpr double kReproducedMm = 1e-3;
    EXPECT_LT(worst, kReproducedMm) << take.name;
  }
}

TEST_F(ContextTransfer, LipsCloseInEveryBilabial) {
  const SpeechLabels line = tinyLabels("M-AE-N IH-Z N-UW-N AE-M", 77);
  const UtteranceAnimation made = speak(line);
  const std::vector<double> opening = lipOpening(made.motion);
  std::size_t bilabials = 0;
  for (const LabelledPhone& phone : line.phones) {
    if (!isBilabial(phone.phone)) continue;
    ++bilabials;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t frame = 0; frame < opening.size(); ++frame) {
      const Seconds time = made.motion.timeOf(FrameIndex(frame));
      if (time >= phone.span.start - 0.02 && time <= phone.span.end + 0.02) least = std::min(least, opening[frame]);
    }
    constexpr double kRounding = 1e-6;
    EXPECT_LE(least, corpus_.trajectory_model->closed_opening_mm + kRounding);
  }
  EXPECT_EQ(bilabials, 2U);
}

TEST_F(ContextTransfer, TheLowerLipComesAsNearToTheTeethAsItWas) {
  Corpus corpus = samples::tinyCorpus({"F-AE-N", "N-AE-N"});
  corpus.trajectory_model = samples::tinyModel(corpus);
  const UnitDatabase database(corpus);
  const CorpusTake& take = corpus.takes[0];
  const SelectedUnit unit{{PhoneIndex(0), PhoneIndex(take.labels.phones.size() - 1)}, {TakeIndex(0), PhoneIndex(0)}};
  std::vector<Seconds> times;
  for (std::size_t frame = 0; frame < take.motion.frameCount(); ++frame)
    times.push_back(take.motion.timeOf(FrameIndex(frame)));
  constexpr Eigen::Index kLowerLipY = 4;
  const auto highestInF = [&](const PositionMatrix& positions) {
    double highest = -std::numeric_limits<double>::infinity();
    for (Eigen::Index row = 0; row < positions.rows(); ++row) {
      if (take.labels.phones[1].span.contains(times[static_cast<std::size_t>(row)]))
        highest = std::max(highest, positions(row, kLowerLipY));
    }
    return highest;
  };
  const auto kept = [&](double lowered_mm) {
    PositionMatrix positions = take.motion.positions_mm;
    positions.col(kLowerLipY).array() -= lowered_mm;
    return keepContacts(std::move(positions), take.labels, database, {unit}, times);
  };
  constexpr double kLoweredMm = 2, kRounding = 1e-6;
  const double captured = highestInF(take.motion.positions_mm);
  EXPECT_LT(captured - highestInF(kept(kLoweredMm)), 0.5 * kLoweredMm);
  EXPECT_GE(highestInF(kept(kLoweredMm)), captured - kLoweredMm);
  // What is there already is left alone, and so is what lies far from the phone.
  EXPECT_NEAR(highestInF(kept(-1)), captured + 1, kRounding);
  const PositionMatrix lowered = kept(kLoweredMm);
  const Eigen::Index last = lowered.rows() - 1;
  EXPECT_NEAR(lowered(last, kLowerLipY), take.motion.positions_mm(last, kLowerLipY) - kLoweredMm, kRounding);
}

/// A mouth that stays open in M closes there for as long as the settings say, and nowhere else.
TEST_F(ContextTransfer, ContactsLastAsLongAsTheCorpusLearnt) {
  const UnitDatabase database(corpus_);
  const CorpusTake& take = corpus_.takes[0];
  const auto bilabial = std::find_if(take.labels.phones.begin(), take.labels.phones.end(),
                                     [](const LabelledPhone& phone) { return isBilabial(phone.phone); });
  ASSERT_NE(bilabial, take.labels.phones.end());
  constexpr double kRateHz = 1000;
  std::vector<Seconds> times;
  for (Seconds time = 0; time < take.labels.duration(); time += 1 / kRateHz) times.push_back(time);
  PositionMatrix open(static_cast<Eigen::Index>(times.size()), take.motion.positions_mm.cols());
  open.rowwise() = take.motion.positions_mm.row(0);
  open.col(4).array() -= 10;  // the lower lip
  const auto framesMoved = [&](const MotionSettings& settings) {
    const PositionMatrix made = keepContacts(open, take.labels, database, {}, times, settings);
    return ((made - open).cwiseAbs().rowwise().maxCoeff().array() > 1e-6).count();
  };
  const auto bilabials = std::count_if(take.labels.phones.begin(), take.labels.phones.end(),
                                       [](const LabelledPhone& phone) { return isBilabial(phone.phone); });
  ASSERT_EQ(bilabials, 1);
  const auto usual = framesMoved({});
  EXPECT_GT(usual, 60);
  MotionSettings longer;
  longer.lips_held_ms += 10;
  EXPECT_GT(framesMoved(longer), usual);
  longer = {};
  longer.lips_fall_ms += 20;
  EXPECT_GT(framesMoved(longer), usual);
  MotionSettings teeth;
  teeth.teeth_fall_ms += 20;
  EXPECT_EQ(framesMoved(teeth), usual) << "no F, no V";
}

TEST_F(ContextTransfer, WhatWasNotSeenIsPredicted) {
  const SpeechLabels line = tinyLabels("M-AE-N", 5);
  const UnitDatabase database(corpus_);
  std::vector<Seconds> times;
  for (int frame = 0; frame < 60; ++frame) times.push_back(frame / 100.0);
  PositionMatrix residuals = PositionMatrix::Constant(60, 12, std::numeric_limits<double>::quiet_NaN());
  ContextOptions options;
  options.average = options.restore_variance = options.keep_contacts = false;
  const PositionMatrix positions = transferContext(residuals, line, database, {}, times, options).positions_mm;
  ASSERT_TRUE(positions.allFinite());
  const Eigen::Map<const Eigen::RowVectorXd> neutral(corpus_.neutral_pose_mm.data(), corpus_.neutral_pose_mm.size());
  const TrajectoryModel& model = *corpus_.trajectory_model;
  const Eigen::MatrixXd predicted = (model.predict(line, times) * model.shapes).rowwise() + neutral;
  EXPECT_LT((positions - predicted).cwiseAbs().maxCoeff(), 1e-9);
}

/// Pairs that nobody said are predicted to move too little: their movement is brought back, and theirs alone; and lips
/// that are to stay apart are not brought together by it.
TEST_F(ContextTransfer, TheMovementOfAPairThatNobodySaidIsBroughtBack) {
  const SpeechLabels line = tinyLabels("M-AE-N IY-T AE-M", 0);
  const UnitDatabase database(corpus_);
  std::vector<bool> is_unsaid(line.phones.size(), false);
  for (std::size_t i = 1; i < line.phones.size(); ++i) {
    if (database.diphones(line.phones[i - 1].phone, line.phones[i].phone).empty())
      is_unsaid[i - 1] = is_unsaid[i] = true;
  }
  const auto first = std::find(is_unsaid.begin(), is_unsaid.end(), true);
  ASSERT_NE(first, is_unsaid.end()) << "the little corpus says all of it";
  ASSERT_NE(std::find(is_unsaid.begin() + 1, is_unsaid.end(), false), is_unsaid.end());
  constexpr double kRateHz = 100;
  std::vector<Seconds> times;
  for (Seconds time = 0; time < line.duration(); time += 1 / kRateHz) times.push_back(time);
  const auto frames = static_cast<Eigen::Index>(times.size());
  const PositionMatrix nothing = PositionMatrix::Zero(frames, 12);
  ContextOptions options;
  options.average = options.keep_contacts = options.fragments = false;
  const PositionMatrix with = transferContext(nothing, line, database, {}, times, options).predicted_mm;
  options.restore_unsaid = false;
  const PositionMatrix without = transferContext(nothing, line, database, {}, times, options).predicted_mm;
  const auto chin = [](const PositionMatrix& motion) { return motion.col(7); };
  double more = 0, moved = 0;
  for (Eigen::Index row = 0; row < frames; ++row) {
    const Seconds time = times[static_cast<std::size_t>(row)];
    std::size_t phone = 0;
    while (phone + 1 < line.phones.size() && line.phones[phone].span.end <= time) ++phone;
    const bool is_beside = is_unsaid[phone] || (phone > 0 && is_unsaid[phone - 1]) ||
                           (phone + 1 < is_unsaid.size() && is_unsaid[phone + 1]);
    const double changed = (with.row(row) - without.row(row)).cwiseAbs().maxCoeff();
    if (!is_beside) {
      EXPECT_LT(changed, 1e-9) << "said by somebody, at " << time;
    }
    const double opening = with(row, 1) - with(row, 4), before = without(row, 1) - without(row, 4);
    const bool is_apart = is_unsaid[phone] && !isBilabial(line.phones[phone].phone) &&
                          std::abs(time - line.phones[phone].span.middle()) < 0.5 / kRateHz;
    if (is_apart) {
      EXPECT_GE(opening, before - 1e-6) << "brought together at " << time;
    }
    more += is_unsaid[phone] ? changed : 0;
    moved += is_unsaid[phone] ? 1 : 0;
  }
  EXPECT_GT(more / moved, 0.02) << "mm";
  const auto spread = [&](const PositionMatrix& motion) {
    return (chin(motion).array() - chin(motion).mean()).matrix().norm();
  };
  EXPECT_GT(spread(with), spread(without));
}

TEST_F(ContextTransfer, SlowDifferencesGoAndFastOnesStay) {
  const SpeechLabels line = tinyLabels("M-AE-N", 5);
  const UnitDatabase database(corpus_);
  std::vector<Seconds> times;
  for (int frame = 0; frame < 200; ++frame) times.push_back(frame / 100.0);
  ContextOptions options;
  options.keep_contacts = false;
  const auto leftOf = [&](double rate_hz, std::size_t column) {
    PositionMatrix residuals = PositionMatrix::Zero(200, 12);
    for (Eigen::Index row = 0; row < 200; ++row)
      residuals(row, static_cast<Eigen::Index>(column)) =
          std::sin(2 * M_PI * rate_hz * times[static_cast<std::size_t>(row)]);
    const PositionMatrix with = transferContext(residuals, line, database, {}, times, options).positions_mm;
    const PositionMatrix without =
        transferContext(PositionMatrix::Zero(200, 12), line, database, {}, times, options).positions_mm;
    return (with - without).col(static_cast<Eigen::Index>(column)).segment(50, 100).cwiseAbs().maxCoeff();
  };
  constexpr std::size_t kChinY = 7, kBrowY = 10;
  EXPECT_LT(leftOf(0.5, kChinY), 0.1);
  EXPECT_NEAR(leftOf(12, kChinY), MotionSettings().other_detail, 0.05);
  EXPECT_NEAR(leftOf(0.5, kBrowY), 1, 0.01);  // no component moves it: as captured
}

/// Pearson's.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const Eigen::Map<const Eigen::ArrayXd> x(a.data(), std::ssize(a)), y(b.data(), std::ssize(b));
  const Eigen::ArrayXd u = x - x.mean(), v = y - y.mean();
  return (u * v).sum() / std::sqrt(u.square().sum() * v.square().sum());
}

/// The lips' opening in `made` where `unit` is heard, and in its take at the same moments of the recording.
double likenessToSource(const UtteranceAnimation& made, const SelectedUnit& unit, const Corpus& corpus) {
  const CorpusTake& take = corpus.takes[unit.source.take.value];
  const std::vector<double> opening = lipOpening(made.motion), source = lipOpening(take.motion);
  std::vector<double> a, b;
  const Seconds shift = take.labels.phones[unit.source.phone.value].span.start - unit.sound.start;
  for (std::size_t frame = 0; frame < opening.size(); ++frame) {
    const Seconds time = made.motion.timeOf(FrameIndex(frame));
    const double place = (time + shift) * take.motion.frame_rate_hz;
    if (!unit.sound.contains(time) || place < 0 || place + 1 >= static_cast<double>(source.size())) continue;
    const auto before = static_cast<std::size_t>(place);
    a.push_back(opening[frame]);
    b.push_back(std::lerp(source[before], source[before + 1], place - static_cast<double>(before)));
  }
  return correlation(a, b);
}

TEST_F(ContextTransfer, AFragmentThatIsHeardKeepsItsCapturedLips) {
  // The whole of take 0 but its last phones, heard at its own pace, then a stretch of another that is not heard.
  const CorpusTake& take = corpus_.takes[0];
  SynthesisRequest request;
  request.labels = take.labels;
  request.options.frame_rate_hz = 120;
  request.options.selection.method = SelectionMethod::kViterbi;
  request.labels.phones.back().span.end += 0.5;  // no longer the take as it was
  request.labels.phones.back().phone = Phone::kAA;
  request.labels.phones.push_back(
      {Phone::kSil, {request.labels.phones.back().span.end, request.labels.phones.back().span.end + 0.3}, {}, {}});
  const std::size_t last = take.labels.phones.size() - 2;
  SelectedUnit heard{{PhoneIndex(0), PhoneIndex(last)}, {TakeIndex(0), PhoneIndex(0)}};
  heard.sound = take.labels.spanOf(heard.phones);
  SelectedUnit unheard{{PhoneIndex(last), PhoneIndex(last + 2)}, {TakeIndex(1), PhoneIndex(0)}};
  request.units = {heard, unheard};
  auto model = std::make_shared<TrajectoryModel>(*corpus_.trajectory_model);
  for (auto& [feature, target] : model->targets) target *= 0.3;  // one that would show
  corpus_.trajectory_model = model;
  EXPECT_GT(likenessToSource(synthesise(request, corpus_), heard, corpus_), 0.98);
  request.units[0].sound = {};
  EXPECT_LT(likenessToSource(synthesise(request, corpus_), heard, corpus_), 0.98);
}

}  // namespace
}  // namespace mouthpiece
