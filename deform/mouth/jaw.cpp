#include "deform/mouth/jaw.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

/// How far a marker's skin follows the bone.
constexpr std::pair<const char*, double> kGuides[] = {{"CHIN_UP", 0.25},    {"CHIN_MID", 1},      {"CHIN_LOW", 1},
                                                      {"JAW_FRONT_R", 0.5}, {"JAW_FRONT_L", 0.5}, {"JAW_MID_R", 0.15},
                                                      {"JAW_MID_L", 0.15}};
constexpr int kSteps = 4;
/// Against turning sideways and sliding where the markers do not ask for it, as a share of the guides' weight.
constexpr double kReluctance = 0.05;

Eigen::Matrix3d turnOf(double open, double sideways) {
  return (Eigen::AngleAxisd(sideways, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(open, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

}  // namespace

JawHinge::JawHinge(const ControlMesh& mesh) {
  const auto rest = [&](const char* name) -> Eigen::Vector3d {
    return mesh.rest.row(findPoint(mesh, name)).transpose();
  };
  for (const auto& [name, weight] : kGuides) {
    if (const int point = findPoint(mesh, name); point >= 0) guides_.push_back({point, weight, rest(name)});
  }
  if (guides_.empty()) return;
  Eigen::Vector3d chin = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const Guide& guide : guides_) {
    chin += guide.weight * guide.rest;
    weights += guide.weight;
  }
  chin /= weights;
  bool has_sides = true;
  for (const char* name : {"TEMPLE_R", "TEMPLE_L", "JAW_BACK_R", "JAW_BACK_L"}) has_sides &= findPoint(mesh, name) >= 0;
  if (has_sides) {
    // The joint lies in front of the ear, between temple and jaw angle.
    pivot_ = 0.25 * (rest("TEMPLE_R") + rest("TEMPLE_L") + rest("JAW_BACK_R") + rest("JAW_BACK_L"));
  } else {
    const Eigen::Vector3d mouth = 0.5 * (rest("LIP_CORNER_R") + rest("LIP_CORNER_L"));
    pivot_ = mouth + mesh.mouth_width * Eigen::Vector3d(0, 0.8, -1.3);
  }
  lever_ = (chin - pivot_).norm();
}

AddedMotion JawHinge::motion(const MarkerPositions& control_points) const {
  AddedMotion added;
  if (guides_.empty()) return added;
  Eigen::Vector3d state = Eigen::Vector3d::Zero();  // opening, sideways (radians), forward (levers)
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const Eigen::Matrix3d turn = turnOf(state[0], state[1]);
    const Eigen::Matrix3d sideways = turnOf(0, state[1]);
    double weights = 0;
    for (const Guide& guide : guides_) {
      const Eigen::Vector3d arm = turn * (guide.rest - pivot_);
      const Eigen::Vector3d there = pivot_ + arm + Eigen::Vector3d(0, 0, state[2] * lever_);
      const Eigen::Vector3d miss = (control_points.row(guide.point).transpose() - there) / lever_;
      Eigen::Matrix3d slope;
      slope << (sideways * Eigen::Vector3d::UnitX()).cross(arm) / lever_, Eigen::Vector3d::UnitY().cross(arm) / lever_,
          Eigen::Vector3d::UnitZ();
      matrix += guide.weight * slope.transpose() * slope;
      right += guide.weight * slope.transpose() * miss;
      weights += guide.weight;
    }
    const Eigen::Vector3d reluctance = kReluctance * weights * Eigen::Vector3d(0, 1, 1);
    matrix.diagonal() += reluctance;
    right -= reluctance.cwiseProduct(state);
    state += matrix.ldlt().solve(right);
  }
  const Eigen::Matrix3d turn = turnOf(state[0], state[1]);
  added.turn = turn - Eigen::Matrix3d::Identity();
  added.shift = Eigen::Vector3d(0, 0, state[2] * lever_) - added.turn * pivot_;
  return added;
}

}  // namespace mouthpiece
