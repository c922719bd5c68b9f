#include "deform/tongue.h"

#include <algorithm>
#include <cmath>

namespace mouthpiece {
namespace {

/// Along the tongue, 0 at the root, 1 at the tip: where the tip's movement begins, where the back's is strongest and
/// how wide.
constexpr double kTipFrom = 0.35;
constexpr double kBackAt = 0.4;
constexpr double kBackWidth = 0.4;
/// No part moves further than this share of the tongue's length.
constexpr double kFurthest = 0.45;

double smooth(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// The upper front teeth's lower edge, if the mesh has upper teeth.
bool upperEdge(const FaceMesh& mesh, Eigen::Vector3d& edge, double& height) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = -low;
  for (const MeshPart& part : mesh.parts) {
    if (part.kind != PartKind::kUpperTeeth) continue;
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) {
        const Eigen::Vector3d p = mesh.vertices.row(v).transpose().cast<double>();
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
    }
  }
  if (low.x() > high.x()) return false;
  edge = {0.5 * (low.x() + high.x()), low.y(), high.z()};
  height = high.y() - low.y();
  return true;
}

Eigen::Vector3d atMost(const Eigen::Vector3d& move, double length) {
  const double norm = move.norm();
  return norm > length ? Eigen::Vector3d(move * (length / norm)) : move;
}

}  // namespace

TongueMorph::TongueMorph(const FaceMesh& mesh, std::vector<std::uint32_t> vertices) {
  if (vertices.empty()) return;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = -low;
  for (const std::uint32_t v : vertices) {
    const Eigen::Vector3d p = mesh.vertices.row(v).transpose().cast<double>();
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  length_ = high.z() - low.z();
  const double length = std::max(length_, 1e-12);
  const double middle_x = 0.5 * (low.x() + high.x());
  tip_ = {middle_x, 0.5 * (low.y() + high.y()), high.z()};
  double tip_height = -1e30, back_height = -1e30;
  for (const std::uint32_t v : vertices) {
    const Eigen::Vector3d p = mesh.vertices.row(v).transpose().cast<double>();
    const double along = (p.z() - low.z()) / length;
    if (along > 0.9) tip_height = std::max(tip_height, p.y());
    if (std::abs(along - kBackAt) < 0.15) back_height = std::max(back_height, p.y());
    const double tip = std::pow(smooth((along - kTipFrom) / (1 - kTipFrom)), 1.5);
    const double bump = 1 - smooth(std::abs(along - kBackAt) / kBackWidth);
    // The underside and the root stay with the jaw.
    const double upper = smooth((p.y() - low.y()) / std::max(0.6 * (high.y() - low.y()), 1e-12));
    items_.push_back(
        {v, mesh.vertices.row(v).transpose(), static_cast<float>(tip), static_cast<float>(bump * (0.3 + 0.7 * upper))});
  }
  if (tip_height > -1e29) tip_.y() = tip_height;
  back_ = {middle_x, back_height > -1e29 ? back_height : high.y(), low.z() + kBackAt * length};
  Eigen::Vector3d edge;
  double height = 0;
  if (!upperEdge(mesh, edge, height)) {
    edge = tip_ + length * Eigen::Vector3d(0, 0.12, 0.08);
    height = 0.2 * length;
  }
  ridge_ = edge + Eigen::Vector3d(0, 0.45 * height, -0.15 * length);
  between_ = edge + Eigen::Vector3d(0, 0, 0.06 * length);
  palate_ = {back_.x(), edge.y() + 1.1 * height, back_.z()};
}

void TongueMorph::deform(const AddedMotion& jaw, const TonguePose& pose, float* out) const {
  const auto moved = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return p + jaw.turn * p + jaw.shift; };
  const Eigen::Vector3d to_ridge = static_cast<double>(pose.tip_up) * (ridge_ - moved(tip_));
  const Eigen::Vector3d to_gap = static_cast<double>(pose.tip_forward) * (between_ - moved(tip_));
  const Eigen::Vector3d to_palate = static_cast<double>(pose.back_up) * (palate_ - moved(back_));
  const Eigen::Vector3f tip = atMost(to_ridge + to_gap, kFurthest * length_).cast<float>();
  const Eigen::Vector3f back = atMost(to_palate, kFurthest * length_).cast<float>();
  const Eigen::Matrix3f turn = jaw.turn.cast<float>();
  const Eigen::Vector3f shift = jaw.shift.cast<float>();
  for (const Item& item : items_) {
    Eigen::Map<Eigen::Vector3f>(out + 3 * static_cast<std::size_t>(item.vertex)) =
        item.rest + turn * item.rest + shift + item.tip * tip + item.back * back;
  }
}

}  // namespace mouthpiece
