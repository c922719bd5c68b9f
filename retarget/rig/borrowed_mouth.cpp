#include "retarget/rig/borrowed_mouth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "deform/mesh/head_topology.h"
#include "deform/mesh/lip_cut.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

// Lengths as shares of the mouth's width.
constexpr double kBehindLips = 0.03;  ///< teeth are put so far behind the inside of the lips
constexpr double kLipThick = 0.12;    ///< where a head has no inside of lips
constexpr double kThickest = 0.35;    ///< what is further behind the skin's front is no lip's inside
constexpr double kFurthest = 0.6;     ///< nothing is put further back
constexpr double kInView = 0.35;      ///< teeth this far to both sides of the middle lie behind lips

bool isTeeth(PartKind kind) { return kind == PartKind::kUpperTeeth || kind == PartKind::kLowerTeeth; }

bool has(const FaceMesh& mesh, bool (*is)(PartKind)) {
  return std::any_of(mesh.parts.begin(), mesh.parts.end(),
                     [&](const MeshPart& part) { return is(part.kind) && part.triangle_count > 0; });
}

/// The warp that takes the donor's markers to those of the head that has them too.
RbfWarp warpBetween(const FaceFile& donor, const FaceFile& face) {
  std::vector<Eigen::Index> from, to;
  for (std::size_t i = 0; i < donor.marker_names.size(); ++i) {
    const auto other = std::find(face.marker_names.begin(), face.marker_names.end(), donor.marker_names[i]);
    if (other == face.marker_names.end()) continue;
    from.push_back(signedIndex(i));
    to.push_back(other - face.marker_names.begin());
  }
  WarpOptions options;
  options.kernel = RbfKernel::kBiharmonic;
  return RbfWarp::fit(donor.marker_targets(from, Eigen::all), face.marker_targets(to, Eigen::all), options);
}

/// How far what is to lie in the mouth must go back to be behind the lips.
double wayBehindLips(const FaceMesh& head, const FaceFile& face, const MarkerPositions& teeth) {
  const double width = face.control.mouth_width;
  const double middle = 0.5 * (face.control.rest(findPoint(face.control, "LIP_CORNER_R"), 0) +
                               face.control.rest(findPoint(face.control, "LIP_CORNER_L"), 0));
  // The tree looks along y: the head lies on its back for it.
  VertexPositions lying(head.vertices.rows(), 3);
  lying.col(0) = head.vertices.col(0);
  lying.col(1) = head.vertices.col(2);
  lying.col(2) = head.vertices.col(1);
  const TriangleTree tree(lying, trianglesOf(head, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside}));
  double back = 0;
  for (Eigen::Index i = 0; i < teeth.rows(); ++i) {
    const Vector3d p = teeth.row(i).transpose();
    if (std::abs(p.x() - middle) > kInView * width) continue;
    double front = -std::numeric_limits<double>::infinity(), inside = front;
    const auto crossings = tree.crossings(p.x(), p.y());
    for (const auto& crossing : crossings) front = std::max(front, crossing.height);
    if (!std::isfinite(front)) continue;
    for (const auto& crossing : crossings) {
      if (crossing.height < front && crossing.height > front - kThickest * width)
        inside = std::max(inside, crossing.height);
    }
    if (!std::isfinite(inside)) inside = front - kLipThick * width;
    back = std::max(back, p.z() + kBehindLips * width - inside);
  }
  return std::min(back, kFurthest * width);
}

/// Adds parts of `donor`, whose vertices lie at `places` now.
void addParts(const FaceMesh& donor, const std::vector<const MeshPart*>& parts, const MarkerPositions& places,
              FaceMesh& mesh) {
  std::map<std::uint32_t, std::uint32_t> numbers;
  std::vector<std::uint32_t> added;
  const auto old = static_cast<std::uint32_t>(mesh.vertexCount());
  for (const MeshPart* part : parts) {
    MeshPart& made = mesh.parts.emplace_back(*part);
    made.first_triangle = mesh.triangles.size();
    made.material = -1;
    for (Triangle t : trianglesOf(donor, *part)) {
      for (std::uint32_t& v : t) {
        const auto [at, is_new] = numbers.try_emplace(v, old + static_cast<std::uint32_t>(added.size()));
        if (is_new) added.push_back(v);
        v = at->second;
      }
      mesh.triangles.push_back(t);
    }
  }
  mesh.vertices.conservativeResize(old + signedIndex(added.size()), Eigen::NoChange);
  for (std::size_t i = 0; i < added.size(); ++i)
    mesh.vertices.row(old + signedIndex(i)) = places.row(added[i]).cast<float>();
  if (!mesh.texture_coordinates.empty()) mesh.texture_coordinates.resize(mesh.vertexCount(), {0, 0});
  if (mesh.vertex_colors.empty()) return;
  for (const std::uint32_t v : added)
    mesh.vertex_colors.push_back(donor.vertex_colors.empty() ? std::array<float, 3>{1, 1, 1} : donor.vertex_colors[v]);
}

}  // namespace

std::optional<FaceMesh> withBorrowedMouth(const FaceMesh& head, const FaceFile& face, const FaceMesh& donor_mesh,
                                          const FaceFile& donor) {
  const bool has_teeth = has(head, isTeeth), has_tongue = has(head, [](PartKind k) { return k == PartKind::kTongue; });
  FaceMesh made = head;
  const HeadTopology topology(head, openingsOf(face.control));
  if (const auto& line = topology.lipLine(); line && line->is_parted) made = withMouthBag(head, *line);
  std::vector<const MeshPart*> parts;
  for (const MeshPart& part : donor_mesh.parts) {
    if ((isTeeth(part.kind) && !has_teeth) || (part.kind == PartKind::kTongue && !has_tongue)) parts.push_back(&part);
  }
  if (!parts.empty()) {
    MarkerPositions places = warpBetween(donor, face).targetFromActor(donor_mesh.vertices.cast<double>());
    std::vector<Eigen::Index> teeth;
    for (const MeshPart* part : parts) {
      for (const Triangle& t : trianglesOf(donor_mesh, *part)) teeth.insert(teeth.end(), t.begin(), t.end());
    }
    places.col(2).array() -= wayBehindLips(made, face, places(teeth, Eigen::all));
    addParts(donor_mesh, parts, places, made);
  }
  if (made.parts.size() == head.parts.size()) return std::nullopt;
  return made;
}

}  // namespace mouthpiece
