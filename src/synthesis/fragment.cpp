#include "synthesis/fragment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/index.h"
#include "base/smooth_step.h"
#include "motion/resample.h"

namespace mouthpiece {
namespace {

/// How much of a pause between two words of a take still belongs to the word beside it; the rest leads to the other.
constexpr double kOwnPartOfPause = 0.75;
constexpr Seconds kComeToRest = 0.030;  ///< time constant with which movement dies out where the capture ends
constexpr Seconds kRelax = 0.400;       ///< from there to the neutral pose

bool isSilent(const LabelledPhone& phone) { return phone.phone == Phone::kSil; }

/// The stretch around the lips' tightest moment that runs at the captured speed: its middle and half its length, in the
/// take and in the line. Onsets and releases are as fast in a long M as in a short one.
struct ClosurePace {
  Seconds source, target, reach;
};

ClosurePace closurePace(Phone phone, const TimeSpan& source, const TimeSpan& target) {
  // The lips are tightest that long before the middle of the label, which holds a stop's burst.
  const Seconds before_middle = isStop(phone) ? 0.020 : 0.0;
  constexpr Seconds kReach = 0.030;
  constexpr double kEarliest = 0.25, kPartOfRoom = 0.7;  // of the label; of what lies between the moment and its ends
  const double share = std::max(kEarliest, 0.5 - before_middle / source.duration());
  const Seconds room = share * std::min(source.duration(), target.duration());
  return {std::lerp(source.start, source.end, share), std::lerp(target.start, target.end, share),
          std::min(kReach, kPartOfRoom * room)};
}

/// A knot at each boundary that has speech beside it; beyond the outer ones the map runs at the capture's speed. A
/// phone too short to hold a movement moves nothing: its boundaries count as one.
TimeWarp warpOf(const SpeechLabels& line, const PhoneRange& target, const SpeechLabels& take, PhoneIndex source_first,
                bool keep_closure_pace, bool stretch_silences) {
  constexpr Seconds kShortest = 0.001;
  std::vector<TimeKnot> knots;
  const auto add = [&](Seconds source, Seconds wanted) {
    if (!knots.empty() && (source < knots.back().source + kShortest || wanted < knots.back().target + kShortest))
      return;
    knots.push_back({source, wanted});
  };
  const std::size_t count = target.last.value - target.first.value + 1;
  for (std::size_t i = 0; i < count; ++i) {
    const LabelledPhone& wanted = line.phones[target.first.value + i];
    const LabelledPhone& found = take.phones[source_first.value + i];
    if (i == 0 && (stretch_silences || !isSilent(found))) add(found.span.start, wanted.span.start);
    if (keep_closure_pace && isBilabial(found.phone)) {
      const ClosurePace pace = closurePace(found.phone, found.span, wanted.span);
      add(pace.source - pace.reach, pace.target - pace.reach);
      add(pace.source + pace.reach, pace.target + pace.reach);
    }
    if (i == 0 || stretch_silences || !isSilent(found)) add(found.span.end, wanted.span.end);
  }
  return TimeWarp(std::move(knots));
}

/// The seconds of the take that this fragment may show.
TimeSpan usableSource(Seconds captured, const std::vector<LabelledPhone>& phones, std::size_t first, std::size_t last) {
  TimeSpan usable{0, captured};
  if (isSilent(phones[first]) && first > 0) {
    usable.start = phones[first].span.end - kOwnPartOfPause * phones[first].span.duration();
  }
  if (isSilent(phones[last]) && last + 1 < phones.size()) {
    usable.end = phones[last].span.start + kOwnPartOfPause * phones[last].span.duration();
  }
  usable.end = std::max(usable.start, usable.end);
  return usable;
}

}  // namespace

std::shared_ptr<const LinePrediction> TakePredictions::of(const UnitDatabase& database, TakeIndex take) {
  constexpr std::size_t kMost = 16;
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) { return kept.take == take; });
  Kept wanted = found != kept_.end() ? *found : Kept{take, nullptr};
  if (found != kept_.end()) kept_.erase(found);
  if (!wanted.prediction)
    wanted.prediction =
        std::make_shared<LinePrediction>(*database.corpus().trajectory_model, database.takeOf(take).labels);
  if (kept_.size() >= kMost) kept_.erase(kept_.begin());
  kept_.push_back(wanted);
  return wanted.prediction;
}

Fragment::Fragment(const SpeechLabels& line, const PhoneRange& target, const UnitDatabase& database,
                   const PhonePlace& source, std::shared_ptr<const LinePrediction> prediction, bool stretch_silences)
    : database_(&database),
      take_index_(source.take),
      take_(&database.takeOf(source)),
      target_(target),
      source_first_(source.phone),
      warp_(warpOf(line, target, take_->labels, source.phone, prediction != nullptr, stretch_silences)),
      prediction_(std::move(prediction)) {
  rate_hz_ = take_->motion.frame_rate_hz;
  const Seconds captured = (asReal(database.frameCount(take_index_)) - 1) / rate_hz_;
  const std::size_t last = source.phone.value + target.last.value - target.first.value;
  TimeSpan usable = usableSource(captured, take_->labels.phones, source.phone.value, last);
  if (stretch_silences) {
    usable.start = std::min(usable.start, take_->labels.phones[source.phone.value].span.start);
    usable.end = std::max(usable.start, captured);
  }
  usable_ = {warp_.targetFromSource(usable.start), warp_.targetFromSource(usable.end)};
}

const LabelledPhone& Fragment::sourcePhone(PhoneIndex target) const {
  return take_->labels.phones[source_first_.value + target.value - target_.first.value];
}

Eigen::RowVectorXd Fragment::lipsAt(Seconds time) const {
  const std::array<Seconds, 1> times{time};
  return lipsAt(times).row(0);
}

PositionMatrix Fragment::lipsAt(std::span<const Seconds> times) const {
  return lipsOfCaptured(capturedLipsAt(times), times);
}

PositionMatrix Fragment::lipsOfCaptured(PositionMatrix lips, std::span<const Seconds> times) const {
  if (prediction_ == nullptr) return lips;
  const std::vector<Eigen::Index>& columns = database_->lipColumns();
  const auto& neutral = database_->corpus().neutral_pose_mm;
  lips -= predictedComponents(withinUsable(times)) * database_->corpus().trajectory_model->shapes(Eigen::all, columns);
  lips.rowwise() -= Eigen::Map<const Eigen::RowVectorXd>(neutral.data(), neutral.size())(columns);
  return lips;
}

PositionMatrix Fragment::capturedLipsAt(std::span<const Seconds> times) const {
  const std::vector<Seconds> within = withinUsable(times);
  const std::shared_ptr<const MotionClip> motion = this->motion();
  PositionMatrix lips(std::ssize(times), std::ssize(database_->lipColumns()));
  for (std::size_t i = 0; i < within.size(); ++i)
    lips.row(signedIndex(i)) = poseAt(*motion, database_->lipColumns(), warp_.sourceFromTarget(within[i]));
  return lips;
}

std::vector<Seconds> Fragment::withinUsable(std::span<const Seconds> times) const {
  std::vector<Seconds> within(times.begin(), times.end());
  for (Seconds& time : within) time = std::clamp(time, usable_.start, usable_.end);
  return within;
}

Eigen::MatrixXd Fragment::predictedComponents(std::span<const Seconds> times) const {
  std::vector<Seconds> source;
  for (const Seconds time : times) source.push_back(warp_.sourceFromTarget(time));
  return prediction_->at(source);
}

PositionMatrix Fragment::predictedPoses(std::span<const Seconds> times) const {
  const auto& neutral = database_->corpus().neutral_pose_mm;
  PositionMatrix poses = predictedComponents(times) * database_->corpus().trajectory_model->shapes;
  poses.rowwise() += Eigen::Map<const Eigen::RowVectorXd>(neutral.data(), neutral.size());
  return poses;
}

/// `times` where the capture may be read.
PositionMatrix Fragment::capturedPoses(std::span<const Seconds> times) const {
  PositionMatrix poses = resampleWarped(*motion(), warp_, times);
  if (prediction_ != nullptr) poses -= predictedPoses(times);
  return poses;
}

PositionMatrix Fragment::posesAt(std::span<const Seconds> times) const {
  PositionMatrix poses = capturedPoses(withinUsable(times));
  relaxBeyond(times, poses);
  return poses;
}

/// Velocity at an edge of the usable stretch, from one capture interval inside it; zero where that was not seen.
Eigen::RowVectorXd Fragment::edgeVelocity(Seconds edge, double inward) const {
  const Seconds step = 1 / rate_hz_;
  const Seconds inside = std::clamp(edge + inward * step, usable_.start, usable_.end);
  std::vector<Seconds> pair{std::min(edge, inside), std::max(edge, inside)};
  const PositionMatrix poses = capturedPoses(pair);
  const Eigen::RowVectorXd velocity = (poses.row(1) - poses.row(0)) / step;
  return velocity.unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; });
}

void Fragment::relaxBeyond(std::span<const Seconds> times, PositionMatrix& poses) const {
  const auto& neutral = database_->corpus().neutral_pose_mm;
  Eigen::RowVectorXd rest = Eigen::Map<const Eigen::RowVectorXd>(neutral.data(), neutral.size());
  if (prediction_ != nullptr) rest.setZero();
  const auto relax = [&](std::size_t i, Seconds beyond, const Eigen::RowVectorXd& velocity) {
    const Eigen::Index row = signedIndex(i);
    const Eigen::RowVectorXd held = poses.row(row) + velocity * (kComeToRest * (1 - std::exp(-beyond / kComeToRest)));
    poses.row(row) = held + smoothStep(beyond / kRelax) * (rest - held);
  };
  if (!times.empty() && times.front() < usable_.start) {
    const Eigen::RowVectorXd backwards = -edgeVelocity(usable_.start, 1);
    for (std::size_t i = 0; i < times.size() && times[i] < usable_.start; ++i)
      relax(i, usable_.start - times[i], backwards);
  }
  if (!times.empty() && times.back() > usable_.end) {
    const Eigen::RowVectorXd forwards = edgeVelocity(usable_.end, -1);
    for (std::size_t i = times.size(); i-- > 0 && times[i] > usable_.end;) relax(i, times[i] - usable_.end, forwards);
  }
}

std::vector<UnitFragment> cutIntoFragments(const SpeechLabels& line, const UnitDatabase& database,
                                           const std::vector<SelectedUnit>& units, bool residual, bool stretch_silences,
                                           TakePredictions* predictions) {
  std::map<TakeIndex, std::shared_ptr<const LinePrediction>> of_takes;
  const auto prediction_of = [&](TakeIndex take) -> std::shared_ptr<const LinePrediction> {
    if (!residual) return nullptr;
    if (predictions != nullptr) return predictions->of(database, take);
    std::shared_ptr<const LinePrediction>& known = of_takes[take];
    if (!known)
      known = std::make_shared<LinePrediction>(*database.corpus().trajectory_model, database.takeOf(take).labels,
                                               LinePrediction::Keeps::kNothing);
    return known;
  };
  std::vector<UnitFragment> fragments;
  for (std::size_t u = 0; u < units.size(); ++u) {
    const SelectedUnit& unit = units[u];
    std::size_t begin = unit.phones.first.value;
    for (std::size_t i = begin + 1; i <= unit.phones.last.value; ++i) {
      const bool is_pause = line.phones[i].phone == Phone::kSil && !stretch_silences;
      if (i < unit.phones.last.value && !is_pause) continue;
      const PhonePlace source{unit.source.take, PhoneIndex(unit.source.phone.value + begin - unit.phones.first.value)};
      fragments.push_back({Fragment(line, {PhoneIndex(begin), PhoneIndex(i)}, database, source,
                                    prediction_of(source.take), stretch_silences),
                           u});
      begin = i;
    }
  }
  return fragments;
}

}  // namespace mouthpiece
