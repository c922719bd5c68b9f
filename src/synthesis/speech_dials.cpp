// Strength, jaw, lips, hold, lead and smoothing of a line's motion, and what keeps them within what a face can do.
#include "synthesis/speech_dials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/index.h"
#include "base/smooth_step.h"
#include "synthesis/stages.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {
namespace {

constexpr double kMostGain = 2;       ///< of all dials together
constexpr double kMostReach = 2;      ///< of the widest viseme's pose
constexpr double kMostBeyond = 1.25;  ///< of the farthest that the chin sinks in the line

/// Row at a time between the frames, evenly spaced.
Eigen::RowVectorXd rowAt(const PositionMatrix& rows, double frame) {
  const double at = std::clamp(frame, 0.0, asReal(rows.rows() - 1));
  const auto first = static_cast<Eigen::Index>(at);
  const Eigen::Index second = std::min(first + 1, rows.rows() - 1);
  const double part = at - asReal(first);
  return (1 - part) * rows.row(first) + part * rows.row(second);
}

/// From the middle of one phone to the middle of the next time runs slow, quick, slow.
Seconds heldTime(const std::vector<Seconds>& middles, Seconds time, double hold) {
  const auto next = std::upper_bound(middles.begin(), middles.end(), time);
  if (next == middles.begin() || next == middles.end()) return time;
  const Seconds before = *(next - 1), step = *next - before;
  const double share = (time - before) / step;
  const double held = smoothStep(smoothStep(share));
  return before + step * std::lerp(share, held, hold);
}

/// When what each frame shows is said, with a lead and a hold.
std::vector<Seconds> shownTimes(const SpeechDials& dials, const LineToRender& line) {
  std::vector<Seconds> middles, shown;
  for (const LabelledPhone& phone : line.labels.phones) middles.push_back(phone.span.middle());
  for (const Seconds time : line.times)
    shown.push_back(heldTime(middles, time + dials.lead_ms.at(time) / 1000, dials.hold.at(time)));
  return shown;
}

PositionMatrix retimed(const PositionMatrix& positions, std::span<const Seconds> shown, double rate_hz) {
  PositionMatrix moved = positions;
  for (std::size_t k = 0; k < shown.size(); ++k) moved.row(signedIndex(k)) = rowAt(positions, shown[k] * rate_hz);
  return moved;
}

PositionMatrix smoothed(const PositionMatrix& positions, const StyleSignal& smooth_ms, const LineToRender& line) {
  constexpr double kDeviations = 3;
  PositionMatrix calm = positions;
  for (Eigen::Index k = 0; k < positions.rows(); ++k) {
    const double frames = smooth_ms.at(line.times[unsignedIndex(k)]) / 1000 * line.options.frame_rate_hz;
    if (!(frames > 0.05)) continue;
    const auto reach = static_cast<Eigen::Index>(std::ceil(kDeviations * frames));
    double weight = 0;
    calm.row(k).setZero();
    for (Eigen::Index other = k - reach; other <= k + reach; ++other) {
      const double away = asReal(other - k) / frames;
      const double own = std::exp(-0.5 * away * away);
      calm.row(k) += own * positions.row(std::clamp<Eigen::Index>(other, 0, positions.rows() - 1));
      weight += own;
    }
    calm.row(k) /= weight;
  }
  return calm;
}

/// How far the chin sinks, of a displacement.
double chinDropOf(const VisemePoses& poses, const Eigen::RowVectorXd& displacement) {
  return poses.mouth.has(MarkerRole::kChin) ? poses.mouth.chinDrop(displacement) : 0;
}

void scale(const SpeechDials& dials, const LineToRender& line, const VisemePoses* poses,
           PositionMatrix& displacements) {
  for (Eigen::Index k = 0; k < displacements.rows(); ++k) {
    const Seconds time = line.times[unsignedIndex(k)];
    const double strength = dials.strength.at(time);
    const double jaw_gain = std::min(kMostGain, strength * dials.jaw.at(time));
    const double lip_gain = std::min(kMostGain, strength * dials.lips.at(time));
    Eigen::RowVectorXd jaw = Eigen::RowVectorXd::Zero(displacements.cols());
    if (poses != nullptr) jaw = chinDropOf(*poses, displacements.row(k)) * poses->jaw_direction;
    displacements.row(k) = jaw_gain * jaw + lip_gain * (displacements.row(k) - jaw);
  }
}

/// How much of F and V is said at a time, coming and going within 40 ms.
double labiodentalAt(const SpeechLabels& labels, Seconds time) {
  constexpr Seconds kRamp = 0.040;
  double most = 0;
  const std::vector<LabelledPhone>& phones = labels.phones;
  auto near = std::partition_point(phones.begin(), phones.end(),
                                   [&](const LabelledPhone& phone) { return phone.span.end <= time - kRamp; });
  for (; near != phones.end() && near->span.start < time + kRamp; ++near) {
    const LabelledPhone& phone = *near;
    if (!isLabiodental(phone.phone)) continue;
    const Seconds outside = std::max({0.0, phone.span.start - time, time - phone.span.end});
    most = std::max(most, 1 - smoothStep(outside / kRamp));
  }
  return most;
}

/// How much of a contact there is, of lips `open_mm` apart: 1 where they are closed or the lower one is at the teeth,
/// 0 from 3 mm of opening on. One a frame, which shows what is said at its time of `shown`.
Eigen::VectorXd contactShares(const Eigen::VectorXd& open_mm, const SpeechLabels& labels,
                              std::span<const Seconds> shown, const VisemePoses& poses) {
  constexpr double kOpenMm = 3;
  const double closed = std::max(poses.bilabial_mm, poses.contact_mm);
  Eigen::VectorXd shares(open_mm.size());
  for (Eigen::Index k = 0; k < shares.size(); ++k)
    shares(k) =
        std::max(1 - smoothStep((open_mm(k) - closed) / kOpenMm), labiodentalAt(labels, shown[unsignedIndex(k)]));
  return shares;
}

/// Lips that met, or touched the teeth, in `before` are as far apart in `displacements` as they were there: wholly so
/// where they were closed, not at all from 3 mm of opening on.
void keepContactsOf(const PositionMatrix& before, const SpeechLabels& labels, std::span<const Seconds> shown,
                    const VisemePoses& poses, PositionMatrix& displacements) {
  const Eigen::VectorXd was = poses.mouth.verticalOpenings(before);
  const Eigen::VectorXd is = poses.mouth.verticalOpenings(displacements);
  displacements +=
      (contactShares(was, labels, shown, poses).array() * (was - is).array()).matrix() * poses.opening_direction;
}

/// The same of the lips in `before`; 1 where nothing tells how far they are open.
Eigen::VectorXd lipsTogether(const PositionMatrix& before, const LineToRender& line) {
  if (!line.model.isPossible() || !line.model.poses().mouth.hasLips()) return Eigen::VectorXd::Ones(before.rows());
  return contactShares(line.model.poses().mouth.verticalOpenings(before), line.labels, line.times, line.model.poses());
}

/// Columns of the upper and the lower of two lip markers that face each other, by their names.
std::vector<std::pair<Eigen::Index, Eigen::Index>> facingLips(const MarkerLayout& layout) {
  constexpr std::string_view kUpper = "LIP_UP_", kLower = "LIP_LO_";
  std::vector<std::pair<Eigen::Index, Eigen::Index>> pairs;
  for (std::size_t u = 0; u < layout.markers.size(); ++u) {
    const std::string_view upper = layout.markers[u].name;
    for (std::size_t l = 0; l < layout.markers.size() && upper.starts_with(kUpper); ++l) {
      const std::string_view lower = layout.markers[l].name;
      if (lower.starts_with(kLower) && lower.substr(kLower.size()) == upper.substr(kUpper.size()))
        pairs.emplace_back(signedIndex(3 * u), signedIndex(3 * l));
    }
  }
  return pairs;
}

/// The farthest that each marker goes with the lips alone, and the chin, in any viseme.
struct Reach {
  Eigen::RowVectorXd lips_mm;  ///< a marker
  double chin_mm = 0;

  explicit Reach(const VisemePoses& poses) : lips_mm(Eigen::RowVectorXd::Zero(poses.lips.cols() / 3)) {
    for (Eigen::Index v = 0; v < poses.lips.rows(); ++v) {
      for (Eigen::Index m = 0; m < lips_mm.size(); ++m)
        lips_mm(m) = std::max(lips_mm(m), poses.lips.row(v).segment<3>(3 * m).norm());
    }
    chin_mm = *std::max_element(poses.jaw_drop.begin(), poses.jaw_drop.end());
  }
};

}  // namespace

std::size_t keepWithinReach(const PositionMatrix& before, const LineToRender& line, PositionMatrix& positions) {
  if (!line.model.isPossible()) return 0;
  const VisemePoses& poses = line.model.poses();
  Reach reach(poses);
  reach.chin_mm *= kMostReach;
  for (Eigen::Index k = 0; k < before.rows(); ++k)
    reach.chin_mm = std::max(reach.chin_mm, kMostBeyond * chinDropOf(poses, before.row(k) - line.rest()));
  std::size_t held = 0;
  for (Eigen::Index k = 0; k < positions.rows(); ++k) {
    if (positions.row(k) == before.row(k)) continue;
    const Eigen::RowVectorXd was = before.row(k) - line.rest();
    Eigen::RowVectorXd now = positions.row(k) - line.rest();
    const double drop = chinDropOf(poses, now), was_drop = chinDropOf(poses, was);
    const double most = std::max(was_drop, reach.chin_mm);
    bool is_held = drop > most;
    if (is_held) now -= (drop - most) * poses.jaw_direction;
    const double left = std::min(drop, most);
    for (Eigen::Index m = 0; m < reach.lips_mm.size(); ++m) {
      Eigen::RowVector3d jaw = left * poses.jaw_direction.segment<3>(3 * m);
      const Eigen::RowVector3d lips = now.segment<3>(3 * m) - jaw;
      const double was_lips = (was.segment<3>(3 * m) - was_drop * poses.jaw_direction.segment<3>(3 * m)).norm();
      const double farthest = std::max(kMostGain * was_lips, kMostReach * std::max(reach.lips_mm(m), 1.0));
      if (lips.norm() <= farthest) continue;
      now.segment<3>(3 * m) = jaw + lips * (farthest / lips.norm());
      is_held = true;
    }
    if (is_held) positions.row(k) = now + line.rest();
    held += is_held ? 1 : 0;
  }
  return held;
}

std::size_t turnDials(const SpeechDials& dials, const LineToRender& line, PositionMatrix& positions) {
  if (areUsual(dials)) return 0;
  PositionMatrix moved = positions;
  const auto turned = [&](std::size_t dial) { return !isUsual(kSpeechDials[dial], dials); };
  const bool is_retimed = turned(3) || turned(4);
  const std::vector<Seconds> shown =
      is_retimed ? shownTimes(dials, line) : std::vector<Seconds>(line.times.begin(), line.times.end());
  if (is_retimed) moved = retimed(moved, shown, line.options.frame_rate_hz);
  const PositionMatrix as_timed = moved;
  const PositionMatrix in_time = moved.rowwise() - Eigen::RowVectorXd(line.rest());
  if (turned(5)) moved = smoothed(moved, dials.smooth_ms, line);
  const VisemePoses* poses = line.model.isPossible() ? &line.model.poses() : nullptr;
  PositionMatrix displacements = moved.rowwise() - Eigen::RowVectorXd(line.rest());
  scale(dials, line, poses, displacements);
  moved = displacements.rowwise() + Eigen::RowVectorXd(line.rest());
  const std::size_t held = keepWithinReach(as_timed, line, moved);
  if (poses != nullptr && poses->mouth.hasLips()) {
    displacements = moved.rowwise() - Eigen::RowVectorXd(line.rest());
    keepContactsOf(in_time, line.labels, shown, *poses, displacements);
    moved = displacements.rowwise() + Eigen::RowVectorXd(line.rest());
  }
  const std::vector<bool> upper = upperFaceColumns(line.database.corpus().layout);
  for (std::size_t i = 0; i < upper.size(); ++i) {
    if (!upper[i]) positions.col(signedIndex(i)) = moved.col(signedIndex(i));
  }
  return held;
}

namespace {

/// How far the lids of a side are open, of how far they are at rest: 0 in a blink, 1. One a frame.
Eigen::VectorXd lidsOpen(const Corpus& corpus, Side side, const PositionMatrix& positions) {
  const auto height = [&](std::string_view name) -> std::optional<Eigen::Index> {
    const auto& markers = corpus.layout.markers;
    const auto found = std::find_if(markers.begin(), markers.end(), [&](const LayoutMarker& marker) {
      return marker.side == side && marker.name.starts_with(name);
    });
    if (found == markers.end()) return std::nullopt;
    return 3 * (found - markers.begin()) + 1;
  };
  const auto upper = height("LID_UP"), lower = height("LID_LO");
  if (!upper || !lower) return Eigen::VectorXd::Ones(positions.rows());
  const double rest = corpus.neutral_pose_mm.data()[*upper] - corpus.neutral_pose_mm.data()[*lower];
  if (!(rest > 0)) return Eigen::VectorXd::Ones(positions.rows());
  return ((positions.col(*upper) - positions.col(*lower)) / rest).cwiseMax(0).cwiseMin(1);
}

}  // namespace

void addMood(const MoodPose& mood, const LineToRender& line, PositionMatrix& positions) {
  const Corpus& corpus = line.database.corpus();
  const PositionMatrix weights = Eigen::Map<const Eigen::RowVectorXd>(mood.data(), std::ssize(mood));
  const Eigen::RowVectorXd pose = shapeDisplacements(weights, corpus.layout, corpus.neutral_pose_mm).row(0);
  const PositionMatrix before = positions.rowwise() - Eigen::RowVectorXd(line.rest());
  PositionMatrix displacements = before.rowwise() + pose;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const Eigen::VectorXd open = lidsOpen(corpus, side, positions);
    for (std::size_t m = 0; m < corpus.layout.markers.size(); ++m) {
      if (corpus.layout.markers[m].region != "lid" || corpus.layout.markers[m].side != side) continue;
      const Eigen::Index column = signedIndex(3 * m);
      displacements.middleCols<3>(column) = before.middleCols<3>(column) + open * pose.segment<3>(column);
    }
  }
  // What meets goes one way: lips that are drawn apart by different ways would part.
  const Eigen::VectorXd together = lipsTogether(before, line);
  for (const auto& [upper, lower] : facingLips(corpus.layout)) {
    const Eigen::RowVector3d apart = 0.5 * (pose.segment<3>(upper) - pose.segment<3>(lower));
    displacements.middleCols<3>(upper) -= together * apart;
    displacements.middleCols<3>(lower) += together * apart;
  }
  positions = displacements.rowwise() + Eigen::RowVectorXd(line.rest());
}

}  // namespace mouthpiece
