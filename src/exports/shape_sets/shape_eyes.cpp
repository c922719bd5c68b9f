#include "exports/shape_sets/shape_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <optional>
#include <utility>

#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "motion/arkit_shapes.h"
#include "retarget/rig/ball_fit.h"

namespace mouthpiece {
namespace {

/// Turns of the eyes: up and to the subject's left, degrees.
std::optional<std::pair<double, double>> gazeOf(std::string_view arkit, bool left_eye) {
  constexpr double kWhole = double{kWholeLook} * 180 / std::numbers::pi;
  if (!arkit.starts_with("EyeLook") || arkit.ends_with("Left") != left_eye) return std::nullopt;
  if (arkit.starts_with("EyeLookUp")) return std::pair(kWhole, 0.0);
  if (arkit.starts_with("EyeLookDown")) return std::pair(-kWhole, 0.0);
  const bool to_nose = arkit.starts_with("EyeLookIn");
  return std::pair(0.0, to_nose == left_eye ? -kWhole : kWhole);
}

ShapeEyes::Eyeball eyeballOf(const FaceMesh& mesh, bool is_left) {
  std::vector<bool> is_eye(mesh.vertexCount(), false);
  for (const Triangle& triangle : trianglesOf(mesh, {PartKind::kEye})) {
    for (const std::uint32_t vertex : triangle) is_eye[vertex] = true;
  }
  ShapeEyes::Eyeball eye;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    if (is_eye[unsignedIndex(v)] && (mesh.vertices(v, 0) > 0) == is_left) eye.vertices.push_back(v);
  }
  if (eye.vertices.size() < 4) return {};
  std::vector<Eigen::Vector3d> places;
  for (const Eigen::Index v : eye.vertices) places.emplace_back(mesh.vertices.row(v).transpose().cast<double>());
  eye.middle = sphereThrough(places).middle.transpose().cast<float>();
  std::vector<float> front;
  for (const Eigen::Index v : eye.vertices) {
    if (mesh.vertices(v, 2) > eye.middle.z()) front.push_back((mesh.vertices.row(v) - eye.middle).norm());
  }
  if (front.empty()) return {};
  constexpr std::size_t kOfTwenty = 19;
  const auto most = front.begin() + signedIndex(front.size() * kOfTwenty / 20);
  std::nth_element(front.begin(), most, front.end());
  eye.radius = *most;
  return eye;
}

void slideOver(const FaceMesh& mesh, const ShapeEyes::Eyeball& eye, VertexPositions& moves) {
  constexpr double kLidMm = 0.7;
  if (eye.vertices.empty()) return;
  const float clear = eye.radius + asFloat(kLidMm / (1000 * mesh.metres_per_unit));
  std::vector<bool> is_eye(mesh.vertexCount(), false);
  for (const Eigen::Index v : eye.vertices) is_eye[unsignedIndex(v)] = true;
  for (Eigen::Index v = 0; v < moves.rows(); ++v) {
    if (is_eye[unsignedIndex(v)] || moves.row(v).isZero(0)) continue;
    const Eigen::RowVector3f before = mesh.vertices.row(v) - eye.middle, now = before + moves.row(v);
    const float wanted = std::min(before.norm(), clear), distance = now.norm();
    if (before.z() > 0 && distance > 0 && distance < wanted) moves.row(v) += (wanted / distance - 1) * now;
  }
}

void turnEye(const FaceMesh& mesh, const ShapeEyes::Eyeball& eye, const std::pair<double, double>& degrees,
             VertexPositions& moves) {
  constexpr double kRadians = std::numbers::pi / 180;
  const Eigen::Matrix3f turn = (Eigen::AngleAxisd(degrees.second * kRadians, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(-degrees.first * kRadians, Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix()
                                   .cast<float>();
  for (const Eigen::Index v : eye.vertices) {
    const Eigen::RowVector3f from_middle = mesh.vertices.row(v) - eye.middle;
    moves.row(v) = from_middle * turn.transpose() - from_middle;
  }
}

}  // namespace

ShapeEyes::ShapeEyes(const FaceMesh& mesh)
    : mesh_(mesh), left_(eyeballOf(mesh, true)), right_(eyeballOf(mesh, false)) {}

void ShapeEyes::look(std::string_view arkit, VertexPositions& moves) const {
  if (const auto gaze = gazeOf(arkit, true)) turnEye(mesh_, left_, *gaze, moves);
  if (const auto gaze = gazeOf(arkit, false)) turnEye(mesh_, right_, *gaze, moves);
}

void ShapeEyes::slideLids(VertexPositions& moves) const {
  slideOver(mesh_, left_, moves);
  slideOver(mesh_, right_, moves);
}

}  // namespace mouthpiece
