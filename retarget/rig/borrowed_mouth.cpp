#include "retarget/rig/borrowed_mouth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "deform/surface/virtual_points.h"
#include "deform/topology/head_topology.h"
#include "deform/topology/lip_cut.h"
#include "deform/topology/skin_layers.h"
#include "retarget/placing/anchors.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

// Lengths as shares of the mouth's width.
constexpr double kBehindLips = 0.03;  ///< teeth are put so far behind the inside of the lips
constexpr double kLipThick = 0.12;    ///< where a head has no inside of lips
constexpr double kThickest = 0.35;    ///< what is further behind the skin's front, or behind the rims, is no lip
constexpr double kInView = 0.3;       ///< teeth this far around the lips' middle lie behind lips
constexpr double kSmallest = 0.5, kSmaller = 0.05;  ///< of the size that the mouth asks for: the least, a step
constexpr double kLipsRed = 0.06;                   ///< skin so far behind the rims looks as the mouth's inside does

bool isTeeth(PartKind kind) { return kind == PartKind::kUpperTeeth || kind == PartKind::kLowerTeeth; }

bool has(const FaceMesh& mesh, bool (*is)(PartKind)) {
  return std::any_of(mesh.parts.begin(), mesh.parts.end(),
                     [&](const MeshPart& part) { return is(part.kind) && part.triangle_count > 0; });
}

/// The middle of a face's mouth, the mesh's unit.
struct MouthPlace {
  Vector3d rim;  ///< where the upper lip ends, in the middle between the corners
  double width;

  MouthPlace(const ControlMesh& control, const Eigen::Matrix3d& turn) {
    const auto at = [&](const char* name) -> Vector3d {
      return turn * control.rest.row(findPoint(control, name)).transpose();
    };
    const Vector3d right = at("RIM_CORNER_R"), left = at("RIM_CORNER_L");
    rim = at("RIM_UP_MID");
    rim.x() = 0.5 * (right + left).x();
    width = (left - right).norm();
  }
};

/// The similarity that takes the donor's markers nearest to those of the head that has them too.
Similarity headFromDonor(const FaceFile& donor, const FaceFile& face) {
  std::vector<Eigen::Index> from, to;
  for (std::size_t i = 0; i < donor.marker_names.size(); ++i) {
    const auto other = std::find(face.marker_names.begin(), face.marker_names.end(), donor.marker_names[i]);
    if (other == face.marker_names.end()) continue;
    from.push_back(signedIndex(i));
    to.push_back(other - face.marker_names.begin());
  }
  return similarityBetween(donor.marker_targets(from, Eigen::all), face.marker_targets(to, Eigen::all));
}

/// Where the flesh before `place` ends: the inside of the lips, or of what lies over and under them. nullopt between
/// parted lips, where one looks into the mouth.
std::optional<double> insideBefore(const SkinLayers& skin, const MouthPlace& mouth, const Vector3d& place) {
  const std::vector<double> layers = skin.at(place.x(), place.y());
  if (layers.empty() || layers[0] < mouth.rim.z() - kThickest * mouth.width) return std::nullopt;
  const bool has_inside = layers.size() > 1 && layers[1] > layers[0] - kThickest * mouth.width;
  return has_inside ? layers[1] : layers[0] - kLipThick * mouth.width;
}

/// How far what is to lie in `mouth` must go back to be behind the lips.
double wayBehindLips(const SkinLayers& skin, const MouthPlace& mouth, const MarkerPositions& teeth) {
  double back = -std::numeric_limits<double>::infinity();
  for (const auto& row : teeth.rowwise()) {
    const Vector3d p = row.transpose();
    if ((p - mouth.rim).head<2>().cwiseAbs().maxCoeff() > kInView * mouth.width) continue;
    if (const auto inside = insideBefore(skin, mouth, p))
      back = std::max(back, p.z() + kBehindLips * mouth.width - *inside);
  }
  return std::isfinite(back) ? back : 0;
}

/// The donor's mouth in that of the head, both turned as the donor stands: as wide as the mouth, as high and deep as
/// the face is large but no more than that, behind the lips, and smaller where it would look out of the skin. `teeth`:
/// rows of `places`.
MarkerPositions seated(const MarkerPositions& places, const std::vector<Eigen::Index>& teeth, const MouthPlace& from,
                       const MouthPlace& to, double face_scale, const SkinLayers& skin) {
  const double wide = to.width / from.width, high = std::min(wide, face_scale);
  const auto isInside = [&](const Vector3d& p) {
    const Vector3d off = (p - to.rim).cwiseAbs() / to.width;
    return (off.x() < 0.5 && off.y() < kInView) || skin.isBehind(p, kBehindLips * to.width);
  };
  MarkerPositions made;
  for (double share = 1; share > kSmallest; share -= kSmaller) {
    made = (places.rowwise() - from.rim.transpose()) * (share * Vector3d(wide, high, high)).asDiagonal();
    made.rowwise() += to.rim.transpose();
    made.col(2).array() -= wayBehindLips(skin, to, made(teeth, Eigen::all));
    if (std::all_of(teeth.begin(), teeth.end(), [&](Eigen::Index i) { return isInside(made.row(i).transpose()); }))
      break;
  }
  return made;
}

/// The head's skin further behind the rims than kLipsRed as a part of its own.
FaceMesh withInsideTold(const FaceMesh& head, const HeadTopology& topology, double width) {
  const LipLine& line = *topology.lipLine();
  FaceMesh made = head;
  made.triangles.clear();
  made.parts.clear();
  std::vector<Triangle> inside;
  const auto isInside = [&](const Triangle& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) {
      const Vector3d p = pointAt(head.vertices, v);
      const auto offFrom = [&](const std::vector<Vector3d>& rim) {
        double off = std::numeric_limits<double>::infinity();
        for (const Vector3d& place : rim) off = std::min(off, (place - p).norm());
        return off;
      };
      return topology.isInMouth(v) && std::min(offFrom(line.upper), offFrom(line.lower)) > kLipsRed * width;
    });
  };
  for (const MeshPart& part : head.parts) {
    MeshPart& kept = made.parts.emplace_back(part);
    kept.first_triangle = made.triangles.size();
    for (const Triangle& t : trianglesOf(head, part))
      (isSkin(part.kind) && isInside(t) ? inside : made.triangles).push_back(t);
    kept.triangle_count = made.triangles.size() - kept.first_triangle;
  }
  if (inside.empty()) return head;
  made.parts.push_back({.name = "mouth_inside",
                        .kind = PartKind::kMouthInside,
                        .first_triangle = made.triangles.size(),
                        .triangle_count = inside.size()});
  made.triangles.insert(made.triangles.end(), inside.begin(), inside.end());
  return made;
}

/// The skin that moves as the bones behind it do: what upper teeth go with, and what lower ones and the tongue do.
struct SkinOverBone {
  std::uint32_t upper, lower;

  SkinOverBone(const HeadTopology& head, const ControlMesh& control)
      : upper(nearest(head, control, "NOSE_TIP")), lower(nearest(head, control, "CHIN_LOW")) {}

  static std::uint32_t nearest(const HeadTopology& head, const ControlMesh& control, const char* name) {
    return head.nearestSkin(control.rest.row(findPoint(control, name)).transpose()).value_or(0);
  }
};

/// Adds parts of `donor`, whose vertices lie at `places` now.
void addParts(const FaceMesh& donor, const std::vector<const MeshPart*>& parts, const MarkerPositions& places,
              const SkinOverBone& skin, GrownMesh& grown) {
  FaceMesh& mesh = grown.mesh;
  std::map<std::uint32_t, std::uint32_t> numbers;
  std::vector<std::uint32_t> added;
  const auto old = static_cast<std::uint32_t>(mesh.vertexCount());
  for (const MeshPart* part : parts) {
    MeshPart& made = mesh.parts.emplace_back(*part);
    made.first_triangle = mesh.triangles.size();
    made.material = -1;
    if (mesh.vertex_colors.empty()) made.base_color = meanColor(donor, *part);
    for (Triangle t : trianglesOf(donor, *part)) {
      for (std::uint32_t& v : t) {
        const auto [at, is_new] = numbers.try_emplace(v, old + static_cast<std::uint32_t>(added.size()));
        if (is_new) {
          added.push_back(v);
          grown.parents.push_back(part->kind == PartKind::kUpperTeeth ? skin.upper : skin.lower);
        }
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

std::optional<GrownMesh> withBorrowedMouth(const FaceMesh& head, const FaceFile& face, const FaceMesh& donor_mesh,
                                           const FaceFile& donor) {
  const bool has_teeth = has(head, isTeeth), has_tongue = has(head, [](PartKind k) { return k == PartKind::kTongue; });
  GrownMesh made{head, {}};
  const HeadTopology topology(head, openingsOf(face.control));
  const auto& line = topology.lipLine();
  if (line && line->is_parted) made = withMouthBag(head, *line);
  std::vector<const MeshPart*> parts;
  for (const MeshPart& part : donor_mesh.parts) {
    if ((isTeeth(part.kind) && !has_teeth) || (part.kind == PartKind::kTongue && !has_tongue)) parts.push_back(&part);
  }
  if (parts.empty() && made.parents.empty()) return std::nullopt;
  if (parts.empty()) return made;
  const Similarity head_from_donor = headFromDonor(donor, face);
  const MouthPlace from(donor.control, Eigen::Matrix3d::Identity());
  const MouthPlace to(face.control, head_from_donor.turn.transpose());
  std::vector<Eigen::Index> teeth;
  for (const MeshPart* part : parts) {
    if (!isTeeth(part->kind)) continue;
    for (const Triangle& t : trianglesOf(donor_mesh, *part)) teeth.insert(teeth.end(), t.begin(), t.end());
  }
  const SkinLayers skin(made.mesh.vertices * head_from_donor.turn.cast<float>(),
                        trianglesOf(made.mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside}));
  const MarkerPositions places =
      seated(donor_mesh.vertices.cast<double>(), teeth, from, to, head_from_donor.scale, skin);
  addParts(donor_mesh, parts, places * head_from_donor.turn.transpose(), SkinOverBone(topology, face.control), made);
  return made;
}

FaceMesh withInsideTold(const FaceMesh& whole, const FaceMesh& head, const FaceFile& face) {
  const HeadTopology topology(head, openingsOf(face.control));
  const auto& line = topology.lipLine();
  return line && line->is_parted ? withInsideTold(whole, topology, face.control.mouth_width) : whole;
}

}  // namespace mouthpiece
