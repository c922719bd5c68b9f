#include "vocal/pose_motion.h"

#include <cmath>

#include "base/errors.h"
#include "base/smooth_step.h"

namespace mouthpiece {
namespace {

/// The values of a viseme's curve over which its contact is made: with ramps of 120 ms, over the 16 ms before the
/// phone, and let go in 7 ms after it was held, before the phone ends. (From 0.75 to 0.97 on, a vowel beside a closure
/// was shut at its edge, which those of GRID s1 are not.)
constexpr double kContactFrom = 0.95, kContactBy = 1.0;

std::vector<double> sampled(const CurveSet& curves, std::string_view name, const std::vector<Seconds>& times) {
  const AnimationCurve* curve = findCurve(curves, name);
  return curve == nullptr ? std::vector<double>() : sampleCurve(*curve, times);
}

/// `value`, but never under `floor`, with a soft approach over 1 mm above it.
double softFloor(double value, double floor) {
  constexpr double kSoft = 0.5;  // mm either side of the floor
  const double above = value - floor;
  if (above >= kSoft) return value;
  if (above <= -kSoft) return floor;
  // The parabola that leaves the floor with slope 0 and reaches the diagonal with slope 1.
  return floor + (above + kSoft) * (above + kSoft) / (4 * kSoft);
}

std::vector<double> sampledSignal(const StyleSignal& signal, const std::vector<Seconds>& times) {
  std::vector<double> values;
  values.reserve(times.size());
  for (const Seconds time : times) values.push_back(signal.at(time));
  return values;
}

/// Lip poses of the action units: how round and spread lips differ from the neutral vowel's.
Eigen::RowVectorXd actionUnitPose(const VisemePoses& poses, Viseme shaped) {
  return poses.lips.row(static_cast<Eigen::Index>(shaped)) - poses.lips.row(static_cast<Eigen::Index>(Viseme::kUh));
}

void addLips(const std::vector<double>& values, const std::vector<double>& li, const Eigen::RowVectorXd& pose,
             PositionMatrix& displacements) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (values[k] != 0) displacements.row(static_cast<Eigen::Index>(k)) += values[k] * li[k] * pose;
  }
}

}  // namespace

PositionMatrix displacementsFromCurves(const CurveSet& curves, const VisemePoses& poses, const StyleSignal& ja,
                                       const StyleSignal& li, const std::vector<Seconds>& times) {
  MOUTHPIECE_EXPECT(poses.lips.cols() == static_cast<Eigen::Index>(3 * poses.marker_names.size()));
  PositionMatrix displacements = PositionMatrix::Zero(static_cast<Eigen::Index>(times.size()), poses.lips.cols());
  const std::vector<double> ja_values = sampledSignal(ja, times), li_values = sampledSignal(li, times);
  std::vector<double> chin(times.size(), 0.0);
  for (std::size_t v = 1; v < kVisemeCount; ++v) {
    const auto viseme = static_cast<Viseme>(v);
    const std::vector<double> lips = sampled(curves, visemeName(viseme), times);
    std::vector<double> jaw = sampled(curves, jawCurveName(viseme), times);
    if (jaw.empty()) jaw = lips;
    addLips(lips, li_values, poses.lips.row(static_cast<Eigen::Index>(v)), displacements);
    for (std::size_t k = 0; k < jaw.size(); ++k) chin[k] += jaw[k] * ja_values[k] * poses.jaw_drop[v];
  }
  for (std::size_t k = 0; k < times.size(); ++k)
    displacements.row(static_cast<Eigen::Index>(k)) += chin[k] * poses.jaw_direction;
  addLips(sampled(curves, "lipSpread", times), li_values, actionUnitPose(poses, Viseme::kEe), displacements);
  addLips(sampled(curves, "lipRound", times), li_values, actionUnitPose(poses, Viseme::kOo), displacements);
  keepContacts(curves, poses, times, displacements);
  return displacements;
}

void keepContacts(const CurveSet& curves, const VisemePoses& poses, const std::vector<Seconds>& times,
                  PositionMatrix& displacements) {
  if (!poses.mouth.hasLips()) return;
  const std::vector<double> bilabial = sampled(curves, visemeName(Viseme::kMBP), times);
  const std::vector<double> labiodental = sampled(curves, visemeName(Viseme::kFV), times);
  for (std::size_t k = 0; k < times.size(); ++k) {
    auto row = displacements.row(static_cast<Eigen::Index>(k));
    double opening = poses.mouth.verticalOpening(row);
    const double before = opening;
    const auto lead = [&](const std::vector<double>& curve, double contact_mm) {
      if (curve.empty() || opening <= contact_mm) return;
      opening += smoothStep(kContactFrom, kContactBy, curve[k]) * (contact_mm - opening);
    };
    lead(labiodental, poses.labiodental_mm);
    lead(bilabial, poses.bilabial_mm);
    opening = softFloor(opening, poses.contact_mm);
    if (opening != before) row += (opening - before) * poses.opening_direction;
  }
}

}  // namespace mouthpiece
