// Markers that a motion lacks: completedMarkers() of face_rig.h.
#include <fmt/format.h>

#include <array>

#include "base/errors.h"
#include "base/rbf.h"
#include "retarget/rig/face_rig.h"

namespace mouthpiece {
namespace {

using Rows = std::vector<Eigen::Index>;

/// Fewer tell too little of a face.
constexpr std::size_t kFewestMarkers = 12;
constexpr std::array<const char*, 4> kAlwaysNeeded = {"LIP_UP_MID", "LIP_LO_MID", "LIP_CORNER_R", "LIP_CORNER_L"};
constexpr RbfOptions kByPlace{.kernel = RbfKernel::kBiharmonic, .polynomial = RbfPolynomial::kLinear};
/// What is far from all markers moves as they do in the mean, not ever more.
constexpr RbfOptions kByNeighbours{.kernel = RbfKernel::kBiharmonic, .polynomial = RbfPolynomial::kConstant};

bool areOnBothLips(LipSide a, LipSide b) { return a != LipSide::kNone && b != LipSide::kNone && a != b; }

/// Displacements of `lacking` (rows) from those of `drivers` (columns).
Eigen::MatrixXd shares(const MarkerPositions& neutral, const Rows& lacking, const Rows& drivers) {
  const auto count = signedIndex(drivers.size());
  const MarkerPositions places = neutral(drivers, Eigen::all), wanted = neutral(lacking, Eigen::all);
  return RbfInterpolant::fit(places, RbfInterpolant::Matrix::Identity(count, count), kByNeighbours).evaluate(wanted);
}

void moveAlong(CompletedMarkers& completed, const Rows& lacking, const Rows& drivers) {
  if (lacking.empty()) return;
  const Eigen::MatrixXd weights = shares(completed.neutral_mm, lacking, drivers);
  for (std::size_t i = 0; i < lacking.size(); ++i) {
    auto columns = completed.positions_mm.middleCols<3>(3 * lacking[i]);
    columns.rowwise() = completed.neutral_mm.row(lacking[i]);
    for (std::size_t k = 0; k < drivers.size(); ++k) {
      const double weight = weights(signedIndex(i), signedIndex(k));
      const auto from = completed.positions_mm.middleCols<3>(3 * drivers[k]);
      columns += weight * (from.rowwise() - completed.neutral_mm.row(drivers[k]));
    }
  }
}

}  // namespace

CompletedMarkers completedMarkers(const MotionClip& motion, const MarkerPositions& motion_neutral_mm,
                                  const ControlMesh& control, const MarkerPositions& face_neutral_mm) {
  const auto count = signedIndex(control.marker_count);
  CompletedMarkers completed{PositionMatrix(motion.positions_mm.rows(), 3 * count), face_neutral_mm};
  Rows present, lacking;
  for (Eigen::Index to = 0; to < count; ++to) {
    const auto marker = motion.findMarker(control.points[unsignedIndex(to)].name);
    (marker ? present : lacking).push_back(to);
    if (!marker) continue;
    const auto from = signedIndex(marker->value);
    completed.positions_mm.middleCols<3>(3 * to) = motion.positions_mm.middleCols<3>(3 * from);
    completed.neutral_mm.row(to) = motion_neutral_mm.row(from);
  }
  if (lacking.empty()) return completed;
  for (const char* name : kAlwaysNeeded) {
    if (!motion.findMarker(name))
      throw InputError(fmt::format("the motion lacks the marker {}, which moves every face's lips", name));
  }
  if (present.size() < kFewestMarkers) {
    throw InputError(fmt::format("the motion has {} of the face's {} markers; expected at least {}", present.size(),
                                 count, kFewestMarkers));
  }
  // Where the markers that are not there would lie on this actor.
  const MarkerPositions known = face_neutral_mm(present, Eigen::all), wanted = face_neutral_mm(lacking, Eigen::all);
  const MarkerPositions found = completed.neutral_mm(present, Eigen::all);
  completed.neutral_mm(lacking, Eigen::all) = RbfInterpolant::fit(known, found, kByPlace).evaluate(wanted);
  for (const LipSide side : {LipSide::kNone, LipSide::kUpper, LipSide::kLower}) {
    const auto sideOf = [&](Eigen::Index row) { return control.points[unsignedIndex(row)].side; };
    Rows of_side, drivers;
    for (const Eigen::Index row : lacking) {
      if (sideOf(row) == side) of_side.push_back(row);
    }
    for (const Eigen::Index row : present) {
      if (!areOnBothLips(sideOf(row), side)) drivers.push_back(row);
    }
    moveAlong(completed, of_side, drivers);
  }
  return completed;
}

}  // namespace mouthpiece
