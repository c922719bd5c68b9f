// The actor's face as placing takes it, and the maps from it to a head.
#include "retarget/placing/actor_places.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "retarget/placing/anchors.h"
#include "retarget/placing/even_head.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

/// A head within this angle of a quarter turn was modelled that way and merely tilts.
constexpr double kAskewDeg = 35;
/// How far to the side it looks or leans is told better, by its two sides: beyond this its teeth would be put askew.
constexpr double kAsideDeg = 10;

double degrees(double radians) { return radians * 180 / std::numbers::pi; }

}  // namespace

ActorPlaces::ActorPlaces(const std::vector<std::string>& marker_names, const MarkerPositions& neutral) {
  for (std::size_t i = 0; i < marker_names.size(); ++i)
    places_[marker_names[i]] = neutral.row(signedIndex(i)).transpose();
  addEyeCorners();
  double middle = 0, count = 0;
  for (const auto& [name, place] : places_) {
    if (otherSideOf(name) != name) continue;
    middle += place.x();
    count += 1;
  }
  const double plane = count > 0 ? middle / count : 0;
  std::map<std::string, Vector3d> even;
  for (const auto& [name, place] : places_) {
    const auto partner = places_.find(otherSideOf(name));
    const Vector3d other = partner == places_.end() ? place : partner->second;
    even[name] = partner == places_.end() ? place
                                          : Vector3d(0.5 * (place.x() + 2 * plane - other.x()),
                                                     0.5 * (place.y() + other.y()), 0.5 * (place.z() + other.z()));
  }
  places_ = std::move(even);
}

void ActorPlaces::addEyeCorners() {
  for (const std::string end : {"_R", "_L"}) {
    const auto up = places_.find("LID_UP" + end), low = places_.find("LID_LO" + end),
               outer = places_.find("CANTHUS_OUT" + end);
    if (up == places_.end() || low == places_.end() || outer == places_.end()) continue;
    const Vector3d middle = 0.5 * (up->second + low->second);
    places_["EYE_IN" + end] = middle + 0.9 * (middle - outer->second);
  }
}

SmoothedMoves::SmoothedMoves(MarkerPositions places, const MarkerPositions& displacements,
                             const Eigen::VectorXd& stiffness)
    : places_(std::move(places)) {
  const Eigen::Index n = places_.rows();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 1, n + 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) system(i, j) = -(places_.row(i) - places_.row(j)).norm();
    system(i, i) += stiffness[i];
    system(i, n) = system(n, i) = 1;
  }
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n + 1, 3);
  right.topRows(n) = displacements;
  weights_ = system.partialPivLu().solve(right);
  if (!weights_.allFinite()) throw InputError("found two anchors in one place; expected each in its own");
}

MarkerPositions SmoothedMoves::at(const MarkerPositions& queries) const {
  MarkerPositions result(queries.rows(), 3);
  for (Eigen::Index q = 0; q < queries.rows(); ++q) {
    const Eigen::VectorXd kernel = -(places_.rowwise() - queries.row(q)).rowwise().norm();
    result.row(q) = kernel.transpose() * weights_.topRows(places_.rows()) + weights_.bottomRows(1);
  }
  return result;
}

Similarity similarityBetween(const MarkerPositions& from, const MarkerPositions& to) {
  MOUTHPIECE_EXPECT(from.rows() == to.rows() && from.rows() >= 3);
  const Eigen::Matrix3Xd sources = from.transpose(), targets = to.transpose();
  const Eigen::Matrix4d all = Eigen::umeyama(sources, targets, true);
  Similarity similarity;
  similarity.scale = std::cbrt(all.topLeftCorner<3, 3>().determinant());
  similarity.turn = all.topLeftCorner<3, 3>() / similarity.scale;
  similarity.shift = all.topRightCorner<3, 1>();
  return similarity;
}

Eigen::Matrix3d uprightFromMesh(const Similarity& mesh_from_actor) {
  const Eigen::Matrix3d upright = mesh_from_actor.turn.transpose();
  Eigen::Matrix3d quarter = Eigen::Matrix3d::Zero();
  for (Eigen::Index row = 0; row < 3; ++row) {
    Eigen::Index column = 0;
    upright.row(row).cwiseAbs().maxCoeff(&column);
    quarter(row, column) = upright(row, column) < 0 ? -1 : 1;
  }
  if (std::abs(quarter.determinant() - 1) > 0.5) return upright;
  if (std::abs(degrees(Eigen::AngleAxisd(Eigen::Matrix3d(upright * quarter.transpose())).angle())) >= kAskewDeg)
    return upright;
  if (degrees(std::acos(std::min(1.0, upright.row(0).dot(quarter.row(0))))) < kAsideDeg) return quarter;
  // What it nods stays its own.
  Eigen::Matrix3d ahead;
  ahead.row(0) = upright.row(0);
  ahead.row(2) = upright.row(0).cross(quarter.row(1)).normalized();
  ahead.row(1) = ahead.row(2).cross(ahead.row(0));
  return ahead;
}

}  // namespace mouthpiece
