#include "retarget/sample_head/default_face.h"

#include <algorithm>
#include <cmath>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/control_surface.h"
#include "motion/marker_layout.h"
#include "retarget/sample_head/head_model.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

struct PartLook {
  const char* name;
  PartKind kind;
  float roughness;
};
constexpr std::array<PartLook, kDefaultPartCount> kLooks{{{"Skin", PartKind::kSkin, 0.58F},
                                                          {"Lips", PartKind::kLips, 0.38F},
                                                          {"Mouth_inside", PartKind::kMouthInside, 0.5F},
                                                          {"Eyes", PartKind::kEye, 0.12F},
                                                          {"Gums_upper", PartKind::kUpperTeeth, 0.3F},
                                                          {"Teeth_upper", PartKind::kUpperTeeth, 0.2F},
                                                          {"Gums_lower", PartKind::kLowerTeeth, 0.3F},
                                                          {"Teeth_lower", PartKind::kLowerTeeth, 0.2F},
                                                          {"Tongue", PartKind::kTongue, 0.35F},
                                                          {"Eyelashes", PartKind::kSkin, 0.7F},
                                                          {"Hair", PartKind::kHair, 0.7F}}};

/// How far the smoothed surface goes back towards the canonical face's own points: all the way makes ripples.
constexpr double kFitShare = 0.85;
constexpr int kFitIterations = 12;

/// Longest edges that are left, millimetres: on the head behind, on the face, and where its movement is looked at.
constexpr double kShellEdgeMm = 20;
constexpr double kFaceEdgeMm = 6.4;
constexpr double kMouthEdgeMm = 9;
constexpr double kDetailEdgeMm = 2.0;

/// The longest edge that a triangle may keep.
double wantedEdge(const ModelMesh& model, std::size_t triangle, const std::array<EyeBall, 2>& eyes) {
  const Vector3d p = model.centroid(triangle);
  const auto within = [&](const Vector3d& centre, double rx, double ry, double rz) {
    return (p - centre).cwiseQuotient(Vector3d(rx, ry, rz)).squaredNorm() < 1;
  };
  const auto behind = [&](ModelChannel channel, double least) {
    const auto& corners = model.triangles[triangle];
    return std::all_of(corners.begin(), corners.end(),
                       [&](auto corner) { return model.vertices(corner, channel) > least; });
  };
  if (behind(kShell, 0.6)) return kShellEdgeMm;
  if (model.part_of_triangle[triangle] == kPartMouth || behind(kMouthDepth, 0.3)) return kMouthEdgeMm;
  const bool is_detail = within({0, -43, 50}, 30, 16, 30) || within({0, -13, 62}, 19, 11, 18) ||
                         within({0, 47, 45}, 60, 7, 30) || within(eyes[0].centre, 18, 10, 30) ||
                         within(eyes[1].centre, 18, 10, 30);
  return is_detail ? kDetailEdgeMm : kFaceEdgeMm;
}

FaceMesh finished(const ModelMesh& model) {
  FaceMesh mesh;
  mesh.metres_per_unit = 0.001;
  mesh.vertices.resize(model.vertices.rows(), 3);
  // A ten-thousandth of a millimetre keeps the file short; positions are floats anyway.
  for (Eigen::Index i = 0; i < model.vertices.rows(); ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      mesh.vertices(i, axis) = asFloat(std::round(model.vertices(i, axis) * 1e4) / 1e4);
  }
  mesh.vertex_colors = paintFace(model);
  for (int part = 0; part < kDefaultPartCount; ++part) {
    const PartLook& look = kLooks[unsignedIndex(part)];
    MeshPart entry{.name = look.name,
                   .kind = look.kind,
                   .first_triangle = mesh.triangles.size(),
                   .base_color = {1, 1, 1, 1},
                   .roughness = look.roughness};
    for (std::size_t i = 0; i < model.triangles.size(); ++i) {
      if (model.part_of_triangle[i] == part) mesh.triangles.push_back(model.triangles[i]);
    }
    entry.triangle_count = mesh.triangles.size() - entry.first_triangle;
    if (entry.triangle_count > 0) mesh.parts.push_back(std::move(entry));
  }
  return mesh;
}

/// The red of the lips becomes a part of its own: it shines more than skin.
void separateLips(ModelMesh& model) {
  for (std::size_t i = 0; i < model.triangles.size(); ++i) {
    if (model.part_of_triangle[i] != kPartSkin) continue;
    const auto& [a, b, c] = model.triangles[i];
    if (model.vertices(a, kVermilion) + model.vertices(b, kVermilion) + model.vertices(c, kVermilion) > 1.5)
      model.part_of_triangle[i] = kPartLips;
  }
}

Anchors landmarkAnchors() {
  Anchors anchors;
  anchors.metres_per_unit = 0.001;
  for (const LayoutMarker& marker : defaultLayout().markers) {
    if (marker.mediapipe_landmark >= 0)
      anchors.markers.emplace(marker.name, static_cast<std::uint32_t>(marker.mediapipe_landmark));
  }
  for (const VirtualPointPlace& place : virtualPointPlaces()) {
    if (place.mediapipe_landmark >= 0)
      anchors.markers.emplace(place.name, static_cast<std::uint32_t>(place.mediapipe_landmark));
  }
  for (const PartLook& look : kLooks) anchors.part_kinds.emplace(look.name, look.kind);
  return anchors;
}

}  // namespace

DefaultFace makeDefaultFace(const FaceMesh& canonical, std::string_view file) {
  OpenedFace face = openCanonicalFace(canonical, file);
  ModelMesh model = face.mesh;
  addHeadShell(model);
  fitLimitToVertices(model, kCanonicalVertexCount, kFitShare, kFitIterations);
  model = loopSubdivided(model);
  for (int level = 0; level < 2; ++level) {
    model = loopSubdividedWhere(model, [&](std::size_t triangle) {
      return model.longestEdge(triangle) > wantedEdge(model, triangle, face.eyes);
    });
  }
  carveNostrils(model);
  separateLips(model);
  face.mesh = model;  // the parts behind the lips are placed by the finished lips
  model.append(makeHair(model));
  model.append(loopSubdivided(makeEars()));
  for (const EyeBall& eye : face.eyes) model.append(makeEyeBall(eye));
  model.append(makeMouthParts(face));
  model.append(makeLashes(face));
  return {finished(model), landmarkAnchors()};
}

}  // namespace mouthpiece
