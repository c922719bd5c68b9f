#include <algorithm>

#include "base/errors.h"
#include "base/index.h"
#include "base/smooth_step.h"
#include "vocal/viseme_curves.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {
namespace {

/// The values of a viseme's curve over which its contact is made: with ramps of 120 ms, over the 16 ms before the
/// phone, and let go in 7 ms after it was held, before the phone ends. (From 0.75 to 0.97 on, a vowel beside a closure
/// was shut at its edge, which those of GRID s1 are not.)
constexpr double kContactFrom = 0.95, kContactBy = 1.0;

/// `value`, but never under `floor`, with a soft approach over 1 mm above it.
double softFloor(double value, double floor) {
  constexpr double kSoft = 0.5;  // mm either side of the floor
  const double above = value - floor;
  if (above >= kSoft) return value;
  if (above <= -kSoft) return floor;
  // The parabola that leaves the floor with slope 0 and reaches the diagonal with slope 1.
  return floor + (above + kSoft) * (above + kSoft) / (4 * kSoft);
}

/// Values at `times`; of a curve that is not there all 0.
Eigen::ArrayXd sampled(const CurveSet& curves, std::string_view name, const std::vector<Seconds>& times) {
  const AnimationCurve* curve = findCurve(curves, name);
  if (curve == nullptr) return Eigen::ArrayXd::Zero(signedIndex(times.size()));
  const std::vector<double> values = sampleCurve(*curve, times);
  return Eigen::Map<const Eigen::ArrayXd>(values.data(), signedIndex(values.size()));
}

Eigen::ArrayXd sampledSignal(const StyleSignal& signal, const std::vector<Seconds>& times) {
  Eigen::ArrayXd values(signedIndex(times.size()));
  std::transform(times.begin(), times.end(), values.begin(), [&](Seconds time) { return signal.at(time); });
  return values;
}

Eigen::Index rowOfPose(Viseme viseme) { return static_cast<Eigen::Index>(viseme); }

/// Lip poses of the action units: how round and spread lips differ from the neutral vowel's.
Eigen::RowVectorXd actionUnitPose(const VisemePoses& poses, Viseme shaped) {
  return poses.lips.row(rowOfPose(shaped)) - poses.lips.row(rowOfPose(Viseme::kUh));
}

}  // namespace

PositionMatrix displacementsFromCurves(const CurveSet& curves, const VisemePoses& poses, const StyleSignal& ja,
                                       const StyleSignal& li, const std::vector<Seconds>& times) {
  MOUTHPIECE_EXPECT(poses.lips.cols() == signedIndex(3 * poses.marker_names.size()));
  PositionMatrix displacements = PositionMatrix::Zero(signedIndex(times.size()), poses.lips.cols());
  const Eigen::ArrayXd ja_values = sampledSignal(ja, times), li_values = sampledSignal(li, times);
  const auto add_lips = [&](const Eigen::ArrayXd& values, const Eigen::RowVectorXd& pose) {
    for (Eigen::Index k = 0; k < values.size(); ++k) {
      if (values(k) != 0) displacements.row(k) += values(k) * li_values(k) * pose;
    }
  };
  Eigen::ArrayXd chin = Eigen::ArrayXd::Zero(displacements.rows());
  for (std::size_t v = 1; v < kVisemeCount; ++v) {
    const auto viseme = static_cast<Viseme>(v);
    const Eigen::ArrayXd lips = sampled(curves, visemeName(viseme), times);
    const bool has_jaw = findCurve(curves, jawCurveName(viseme)) != nullptr;
    const Eigen::ArrayXd jaw = has_jaw ? sampled(curves, jawCurveName(viseme), times) : lips;
    add_lips(lips, poses.lips.row(signedIndex(v)));
    chin += jaw * ja_values * poses.jaw_drop[v];
  }
  displacements += chin.matrix() * poses.jaw_direction;
  add_lips(sampled(curves, "lipSpread", times), actionUnitPose(poses, Viseme::kEe));
  add_lips(sampled(curves, "lipRound", times), actionUnitPose(poses, Viseme::kOo));
  return withContacts(curves, poses, times, std::move(displacements));
}

PositionMatrix withContacts(const CurveSet& curves, const VisemePoses& poses, const std::vector<Seconds>& times,
                            PositionMatrix displacements) {
  if (!poses.mouth.hasLips()) return displacements;
  const Eigen::ArrayXd bilabial = sampled(curves, visemeName(Viseme::kMBP), times);
  const Eigen::ArrayXd labiodental = sampled(curves, visemeName(Viseme::kFV), times);
  for (Eigen::Index k = 0; k < displacements.rows(); ++k) {
    auto row = displacements.row(k);
    const double before = poses.mouth.verticalOpening(row);
    double opening = before;
    const auto lead = [&](double reached, double contact_mm) {
      if (opening > contact_mm) opening += smoothStep(kContactFrom, kContactBy, reached) * (contact_mm - opening);
    };
    lead(labiodental(k), poses.labiodental_mm);
    lead(bilabial(k), poses.bilabial_mm);
    opening = softFloor(opening, poses.contact_mm);
    if (opening != before) row += (opening - before) * poses.opening_direction;
  }
  return displacements;
}

}  // namespace mouthpiece
