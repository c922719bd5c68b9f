#include "retarget/rig/lopsidedness.h"

#include <algorithm>

#include "base/parallel_for.h"
#include "deform/mesh/triangle_tree.h"
#include "retarget/placing/even_head.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kPoses = 12;
/// A few places may lie on something else than their mirror image does: where lips touch, on the other lip.
constexpr double kMostPlaces = 0.9;
// Shares of the mouth's width.
constexpr double kAround = 0.3;    ///< skin that is looked at is no further from the line between the lips
constexpr double kOffLine = 0.03;  ///< nor nearer to it: there the other lip may be what is nearest to a mirror image
constexpr double kImage = 0.03;    ///< skin without skin so near to its mirror image is not looked at

std::optional<Vector3d> restOf(const FaceFile& face, const std::string& name) {
  const auto marker = std::find(face.marker_names.begin(), face.marker_names.end(), name);
  if (marker == face.marker_names.end()) return std::nullopt;
  return face.marker_targets.row(marker - face.marker_names.begin()).transpose();
}

std::optional<EvenHead> evenHeadOf(const FaceMesh& mesh, const FaceFile& face) {
  const auto eye_right = restOf(face, "CANTHUS_OUT_R"), eye_left = restOf(face, "CANTHUS_OUT_L"),
             mouth_right = restOf(face, "LIP_CORNER_R"), mouth_left = restOf(face, "LIP_CORNER_L");
  if (!eye_right || !eye_left || !mouth_right || !mouth_left) return std::nullopt;
  return EvenHead::of(mesh, {*eye_right, *eye_left, 0.5 * (*mouth_right + *mouth_left)});
}

/// Rows of x y z side by side, markers named `names`, each averaged with the other side's mirror image across x = 0.
PositionMatrix evened(const PositionMatrix& rows, const std::vector<std::string>& names) {
  PositionMatrix even = rows;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto found = std::find(names.begin(), names.end(), otherSideOf(names[i]));
    if (found == names.end()) continue;
    const Eigen::Index here = 3 * signedIndex(i), there = 3 * (found - names.begin());
    even.middleCols(here, 3) = 0.5 * (rows.middleCols(here, 3) + rows.middleCols(there, 3));
    even.col(here) = 0.5 * (rows.col(here) - rows.col(there));
  }
  return even;
}

/// Of every so many poses the one with the mouth widest open.
std::vector<std::size_t> widestRows(const MotionClip& motion) {
  const auto upper = motion.findMarker("LIP_UP_MID"), lower = motion.findMarker("LIP_LO_MID");
  std::vector<std::size_t> rows;
  if (!upper || !lower) return rows;
  const auto opening = [&](std::size_t row) {
    return (motion.position(FrameIndex{row}, *upper) - motion.position(FrameIndex{row}, *lower)).norm();
  };
  const std::size_t count = motion.frameCount(), pieces = std::min(kPoses, count);
  for (std::size_t k = 0; k < pieces; ++k) {
    std::size_t widest = k * count / pieces;
    for (std::size_t row = widest; row < (k + 1) * count / pieces; ++row) {
      if (opening(row) > opening(widest)) widest = row;
    }
    rows.push_back(widest);
  }
  return rows;
}

}  // namespace

std::optional<Lopsidedness> Lopsidedness::of(const JudgedHead& head, const FaceRig& rig, const FaceFile& face,
                                             const JudgedPoses& poses, const ActorPose& actor) {
  const auto even = evenHeadOf(head.mesh(), face);
  if (!even) return std::nullopt;
  Lopsidedness found;
  found.mirror_ = Eigen::Matrix3d::Identity() - 2 * even->normal() * even->normal().transpose();
  found.findCompared(head.mesh(), face, *even);
  found.rows_ = widestRows(poses.motion);
  if (found.compared_.empty() || found.rows_.empty()) return std::nullopt;
  const CompletedMarkers moved = completedMarkers(poses.motion, actor.neutral_mm, face.control, face.actor_neutral_mm);
  MotionClip motion{poses.motion.frame_rate_hz, face.marker_names, {}};
  motion.positions_mm.resize(signedIndex(found.rows_.size()), moved.positions_mm.cols());
  std::vector<LipPose> lips;
  for (std::size_t i = 0; i < found.rows_.size(); ++i) {
    motion.positions_mm.row(signedIndex(i)) = moved.positions_mm.row(signedIndex(found.rows_[i]));
    lips.push_back(poses.lips[found.rows_[i]]);
    found.tongue_.push_back(poses.tongue[found.rows_[i]]);
  }
  motion.positions_mm = evened(motion.positions_mm, face.marker_names);
  ActorPose both = actor;
  const PositionMatrix neutral =
      evened(Eigen::Map<const Eigen::RowVectorXd>(moved.neutral_mm.data(), moved.neutral_mm.size()), face.marker_names);
  both.neutral_mm = Eigen::Map<const MarkerPositions>(neutral.data(), moved.neutral_mm.rows(), 3);
  found.even_ = rig.retarget(motion, &both, lips);
  return found;
}

void Lopsidedness::findCompared(const FaceMesh& mesh, const FaceFile& face, const EvenHead& even) {
  const double width = face.control.mouth_width;
  const std::vector<Vector3d> lip_line = openingsOf(face.control).lip_line;
  const std::vector<Triangle> skin = trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips});
  const VertexPositions normals = vertexNormals(mesh.vertices, mesh.triangles);
  const TriangleTree tree(mesh.vertices, skin);
  std::vector<bool> is_seen(mesh.vertexCount(), false);
  for (const Triangle& triangle : skin) {
    for (const std::uint32_t v : triangle) {
      if (is_seen[v]) continue;
      is_seen[v] = true;
      const double away = distanceToLine(pointAt(mesh.vertices, v), lip_line) / width;
      if (away < kOffLine || away > kAround || normals(v, 2) <= 0) continue;
      const Vector3d image = even.mirrored(pointAt(mesh.vertices, v));
      const auto foot = tree.closest(image);
      if (!foot || (foot->point - image).norm() > kImage * width) continue;
      Vector3d facing = Vector3d::Zero(), wanted = normals.row(v).cast<double>().transpose();
      for (const std::uint32_t corner : skin[foot->triangle]) facing += normals.row(corner).cast<double>().transpose();
      if (facing.dot(mirror_ * wanted) > 0) compared_.push_back({v, skin[foot->triangle], foot->weights});
    }
  }
}

Lopsidedness::Seen Lopsidedness::look(const JudgedHead& head, const FaceRig& rig) const {
  std::vector<double> off(rows_.size(), 0.0);
  std::vector<std::vector<std::uint32_t>> vertices(rows_.size());
  parallelFor(rows_.size(), [&](std::size_t i) {
    VertexPositions deformed;
    rig.deform(even_->pose(FrameIndex{i}), tongue_[i], deformed);
    const VertexPositions now = head.welded(std::move(deformed));
    const auto moveOf = [&](std::uint32_t v) -> Vector3d {
      return (now.row(v) - head.mesh().vertices.row(v)).cast<double>().transpose();
    };
    std::vector<double> away;
    for (const Compared& place : compared_) {
      Vector3d there = Vector3d::Zero();
      for (std::size_t k = 0; k < 3; ++k) there += place.weights[signedIndex(k)] * moveOf(place.image[k]);
      away.push_back((moveOf(place.vertex) - mirror_ * there).norm());
    }
    std::vector<double> sorted = away;
    const auto most = sorted.begin() + signedIndex(wholePart(kMostPlaces * asReal(sorted.size() - 1)));
    std::nth_element(sorted.begin(), most, sorted.end());
    off[i] = *most;
    for (std::size_t k = 0; k < away.size(); ++k) {
      if (away[k] >= off[i]) vertices[i].push_back(compared_[k].vertex);
    }
  });
  const std::size_t worst = unsignedIndex(std::max_element(off.begin(), off.end()) - off.begin());
  return {off[worst], rows_[worst], vertices[worst]};
}

}  // namespace mouthpiece
