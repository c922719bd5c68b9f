#include "retarget/rig/face_fit.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <set>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/surface/bezier_surface.h"
#include "deform/topology/welding.h"
#include "retarget/rig/face_judge.h"

namespace mouthpiece {
namespace {

/// A unit that is off by more than this from what the head's size says is a mistake.
constexpr double kUnitsAgree = 4;

/// Root mean square distance from the mean.
double spread(const MarkerPositions& points) {
  const Eigen::RowVector3d mean = points.colwise().mean();
  return std::sqrt((points.rowwise() - mean).rowwise().squaredNorm().mean());
}

MarkerPositions placesOf(const FaceMesh& mesh, const Anchors& anchors, const std::string& file,
                         const std::vector<std::string>& names) {
  MarkerPositions places(signedIndex(names.size()), 3);
  for (std::size_t i = 0; i < names.size(); ++i)
    places.row(signedIndex(i)) = placeOf(anchors, names[i], mesh, file).value().transpose();
  return places;
}

/// Sets the mesh upright, its anchors with it.
void setUpright(const Eigen::Matrix3d& upright_from_mesh, FaceMesh& mesh, Anchors& anchors) {
  turnMesh(upright_from_mesh, mesh);
  for (auto& [name, place] : anchors.markers) {
    if (auto* point = std::get_if<Eigen::Vector3d>(&place)) *point = upright_from_mesh * *point;
  }
}

std::map<std::string, Eigen::Vector3d> placeVirtualPoints(const FaceMesh& mesh, const Anchors& anchors,
                                                          const std::string& file) {
  std::map<std::string, Eigen::Vector3d> known;
  for (const VirtualPointPlace& point : virtualPointPlaces()) {
    if (const auto place = placeOf(anchors, point.name, mesh, file)) known.emplace(point.name, *place);
  }
  return known;
}

void refuseUnknownNames(const FaceMesh& mesh, const Anchors& anchors, const std::string& file,
                        const std::vector<std::string>& names) {
  std::set<std::string> known(names.begin(), names.end());
  for (const VirtualPointPlace& point : virtualPointPlaces()) known.insert(point.name);
  for (const auto& [name, place] : anchors.markers) {
    if (!known.contains(name)) {
      throw InputError(file, "markers." + printable(name, 60),
                       "is no marker of the corpus and no point of the control surface");
    }
  }
  for (const auto& [name, kind] : anchors.part_kinds) {
    const bool is_part = std::any_of(mesh.parts.begin(), mesh.parts.end(),
                                     [&wanted = name](const MeshPart& part) { return part.name == wanted; });
    if (!is_part) throw InputError(file, "parts." + printable(name, 60), "is no part of the mesh");
  }
}

}  // namespace

double metresPerUnit(const MarkerPositions& actor_neutral_mm, const MarkerPositions& target) {
  constexpr std::array kUsualUnits{1.0, 0.1, 0.0254, 0.01, 0.001};
  // Heads differ in size by a quarter at most; tracked captures are off by some per cent more.
  constexpr double kNear = 1.5;
  const double metres = 0.001 * spread(actor_neutral_mm) / spread(target);
  for (const double unit : kUsualUnits) {
    if (metres < unit * kNear && metres > unit / kNear) return unit;
  }
  return metres;
}

namespace {

/// Where a warp turns space inside out.
struct WarpFolds {
  std::size_t sampled = 0, count = 0;
  std::string marker;  ///< next to the first of them
};

/// At a sample of the vertices that the surface moves. They are carried back into the actor's space by a warp fitted
/// the other way round: near enough to look at the Jacobian's sign there.
WarpFolds foldsOf(const FaceFile& face, const FaceMesh& mesh, const RbfWarp& warp) {
  constexpr std::size_t kSamples = 4000;
  std::vector<Eigen::Index> moved;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    if (face.binding.patch[unsignedIndex(v)] >= 0) moved.push_back(v);
  }
  const std::size_t stride = std::max<std::size_t>(1, moved.size() / kSamples);
  MarkerPositions points(signedIndex((moved.size() + stride - 1) / stride), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    points.row(i) = mesh.vertices.row(moved[unsignedIndex(i) * stride]).cast<double>();
  const RbfWarp back = RbfWarp::fit(face.marker_targets, face.actor_neutral_mm, warp.options());
  const MarkerPositions actor_points = back.targetFromActor(points);
  // A target that is the actor's mirror image would be negative everywhere: count what differs from the markers' own
  // middle.
  const double usual = warp.jacobian(face.actor_neutral_mm.colwise().mean().transpose()).determinant();
  WarpFolds folds;
  folds.sampled = unsignedIndex(points.rows());
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (warp.jacobian(actor_points.row(i).transpose()).determinant() * usual > 0) continue;
    if (folds.count++ > 0) continue;
    Eigen::Index nearest = 0;
    (face.marker_targets.rowwise() - points.row(i)).rowwise().squaredNorm().minCoeff(&nearest);
    folds.marker = face.marker_names[unsignedIndex(nearest)];
  }
  return folds;
}

/// Takes the least smooth warp that folds no skin over, where the fit may choose: places that are millimetres off, as
/// between brows that a head has narrower than the actor, are not met exactly then.
void smoothFolds(const FitRequest& request, const FaceMesh& mesh, FaceFile& face) {
  if (!request.warp.any_kernel || request.warp.regularization != 0) return;
  const auto warpOf = [&](const WarpOptions& options) {
    return RbfWarp::fit(face.actor_neutral_mm, face.marker_targets, options);
  };
  if (foldsOf(face, mesh, warpOf(face.warp)).count == 0) return;
  WarpOptions smoother = request.warp;
  for (const double regularization : regularizationCandidates()) {
    if (regularization <= face.warp.regularization) continue;
    smoother.regularization = regularization;
    const RbfWarp warp = warpOf(smoother);
    if (foldsOf(face, mesh, warp).count > 0) continue;
    face.warp = warp.options();
    return;
  }
}

FaceFile fitWelded(FaceMesh& mesh, const Anchors& given, const std::string& anchors_file, const FitRequest& request) {
  refuseUnknownNames(mesh, given, anchors_file, request.marker_names);
  FaceFile face;
  face.name = request.name;
  face.mesh_file = request.mesh_file;
  face.mesh_sha256 = request.mesh_sha256;
  face.mesh_object = request.mesh_object;
  face.corpus = request.corpus;
  face.marker_names = request.marker_names;
  face.actor_neutral_mm = request.actor_neutral_mm;
  face.actor_closed_lips_mm = request.actor_closed_lips_mm;
  face.actor_unseen = request.actor_unseen;
  face.part_kinds = given.part_kinds;
  for (const auto& [name, kind] : skinUnderAnchors(mesh, given, anchors_file)) face.part_kinds.try_emplace(name, kind);
  for (MeshPart& part : mesh.parts) {
    if (const auto kind = face.part_kinds.find(part.name); kind != face.part_kinds.end()) part.kind = kind->second;
  }
  Anchors anchors = given;
  face.upright_from_mesh =
      uprightFromMesh(meshFromActor(mesh, anchors, anchors_file, request.marker_names, request.actor_neutral_mm));
  setUpright(face.upright_from_mesh, mesh, anchors);
  std::optional<HeadTopology> topology;
  if (leavesPlacesOpen(anchors, request.marker_names)) {
    topology.emplace(mesh, openingsOf(mesh, anchors, anchors_file));
    anchors =
        placeMarkers(mesh, *topology, anchors, anchors_file, request.marker_names, request.actor_neutral_mm).anchors;
  }
  face.marker_targets = placesOf(mesh, anchors, anchors_file, request.marker_names);
  const double by_size = metresPerUnit(face.actor_neutral_mm, face.marker_targets);
  face.metres_per_unit = anchors.metres_per_unit.value_or(by_size);
  if (face.metres_per_unit > kUnitsAgree * by_size || by_size > kUnitsAgree * face.metres_per_unit) {
    throw InputError(anchors_file, "metres_per_unit",
                     fmt::format("found {}; by the head's size it is about {:.3g} (leave the key out to take that)",
                                 face.metres_per_unit, by_size));
  }
  mesh.metres_per_unit = face.metres_per_unit;
  try {
    face.warp = RbfWarp::fit(face.actor_neutral_mm, face.marker_targets, request.warp).options();
  } catch (const InputError& error) {
    if (request.warp.shape_factor <= 0) throw InputError(anchors_file, "markers", error.what());
    throw InputError(fmt::format("shape factor {:g}: {}", request.warp.shape_factor, error.what()));
  }
  try {
    face.control = buildControlMesh(face.marker_names, face.marker_targets,
                                    placeVirtualPoints(mesh, anchors, anchors_file), nullptr, request.surface);
    const FaceOpenings openings = openingsOf(face.control);
    topology = topology ? topology->openedAt(openings) : HeadTopology(mesh, openings);
    face.control = fittedToMesh(face.control, mesh, *topology);
  } catch (const InputError& error) {
    throw InputError(anchors_file, "markers", error.what());
  }
  // The surface has got points on the lips since.
  face.binding = bindFace(mesh, topology->openedAt(openingsOf(face.control)), face.control, request.binding);
  smoothFolds(request, mesh, face);
  return face;
}

}  // namespace

FaceFile fitFace(FaceMesh& mesh, const Anchors& anchors, const std::string& anchors_file, const FitRequest& request) {
  Welding welding = weldSplitTriangles(mesh);
  if (welding.isNothing()) return fitWelded(mesh, anchors, anchors_file, request);
  Anchors welded = anchors;
  for (auto& [name, place] : welded.markers) {
    auto* vertex = std::get_if<std::uint32_t>(&place);
    if (vertex != nullptr && *vertex < welding.welded_of.size()) *vertex = welding.welded_of[*vertex];
  }
  FaceFile face = fitWelded(welding.mesh, welded, anchors_file, request);
  face.binding = givenBinding(face.binding, welding);
  turnMesh(face.upright_from_mesh, mesh);
  mesh.parts = welding.mesh.parts;
  mesh.metres_per_unit = face.metres_per_unit;
  return face;
}

namespace {

void checkMarkerPlaces(const FaceFile& face, const FaceMesh& mesh, double mm_per_unit, FaceCheck& check) {
  const TriangleTree skin(mesh.vertices, trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips}));
  for (std::size_t i = 0; i < face.marker_names.size(); ++i) {
    const Eigen::Vector3d marker = face.marker_targets.row(signedIndex(i)).transpose();
    const auto foot = skin.closest(marker);
    const double distance =
        foot ? mm_per_unit * (foot->point - marker).norm() : std::numeric_limits<double>::infinity();
    if (distance < check.marker_to_surface_max_mm && !check.farthest_marker.empty()) continue;
    check.marker_to_surface_max_mm = distance;
    check.farthest_marker = face.marker_names[i];
  }
}

/// The rest pose and random poses with markers some millimetres away, further than speech moves neighbours apart.
double largestEdgeAngle(const FaceFile& face, double mm_per_unit) {
  constexpr int kPoses = 12;
  constexpr double kMarkerNoiseMm = 2;
  const BezierSurface surface(face.control);
  double largest = surface.maxNormalAngleAcrossEdges(surface.restPose());
  std::mt19937 random(66);
  std::normal_distribution<double> noise(0, kMarkerNoiseMm / mm_per_unit);
  for (int i = 0; i < kPoses; ++i) {
    MarkerPositions markers = face.marker_targets;
    for (Eigen::Index k = 0; k < markers.size(); ++k) markers.data()[k] += noise(random);
    largest = std::max(largest, surface.maxNormalAngleAcrossEdges(surface.pose(controlPoints(face.control, markers))));
  }
  return largest;
}

}  // namespace

FaceCheck checkFace(const FaceFile& face, const FaceMesh& mesh) {
  if (const Welding welding = weldSplitTriangles(mesh); !welding.isNothing()) {
    FaceFile welded = face;
    welded.binding = weldedBinding(face.binding, welding);
    return checkFace(welded, welding.mesh);
  }
  const double mm_per_unit = 1000 * face.metres_per_unit;
  FaceCheck check;
  check.markers = face.marker_names.size();
  const RbfWarp warp = RbfWarp::fit(face.actor_neutral_mm, face.marker_targets, face.warp);
  check.landmark_rms_mm = mm_per_unit * warp.summary().landmark_rms;
  check.landmark_max_mm = mm_per_unit * warp.summary().landmark_max;
  check.leave_one_out_rms_mm = mm_per_unit * leaveOneOutRms(face.actor_neutral_mm, face.marker_targets, face.warp);
  check.kernel = face.warp.kernel;
  check.shape_factor = face.warp.shape_factor;
  checkMarkerPlaces(face, mesh, mm_per_unit, check);
  const WarpFolds folds = foldsOf(face, mesh, warp);
  check.sampled_points = folds.sampled;
  check.fold_overs = folds.count;
  check.fold_over_marker = folds.marker;
  check.binding = inspectBinding(face.binding, mesh, face.control);
  check.binding.largest_offset *= mm_per_unit;
  if (100 * check.binding.coverage < limitNamed("bound"))
    check.left_out = skinLeftOut(face.binding, mesh, face.control);
  check.patch_edge_angle_max_deg = largestEdgeAngle(face, mm_per_unit);
  return check;
}

namespace {

/// Of a face that is bound too little: what is left out, and what may be done.
std::string whyLeftOut(const SkinLeftOut& left) {
  constexpr double kFar = 0.3;  // mouth widths, from which the surface holds less (deform/surface/binding.cpp)
  if (left.vertices == 0) return "";
  const bool is_turned = left.median_angle_deg > BindingOptions().max_normal_angle_deg;
  const std::string_view remedy = !left.is_of_face ? "if that is no skin, say what it is in the anchors file's `parts`"
                                  : left.median_distance > kFar ? "check the anchors there"
                                  : left.median_angle_deg > 90  ? "do its normals point inward?"
                                  : is_turned                   ? "check the anchors there, or allow a larger angle"
                                              : "check the anchors, or whether the largest angle allowed is too small";
  return fmt::format(
      ": of {} vertices that it leaves out {} are of '{}', half of them over {:.2f} mouth widths off it or turned by "
      "over "
      "{:.0f} degrees against it; {}",
      left.all, left.vertices, left.part, left.median_distance, left.median_angle_deg, remedy);
}

}  // namespace

std::vector<std::string> faultsOf(const FaceCheck& check) {
  constexpr double kMarkerReachMm = 5;
  constexpr double kSmoothDeg = 1;
  // Measured: 1.00 to 1.06 on four heads whose lips part, 0.20 to 0.72 on five whose lips are one surface.
  constexpr double kLipsPart = 0.85;
  std::vector<std::string> faults;
  // Before what comes of it: the warp that folds, lips that seem to be one.
  if (check.marker_to_surface_max_mm > kMarkerReachMm) {
    faults.push_back(fmt::format("{} lies {:.1f} mm off the skin; check its anchor", check.farthest_marker,
                                 check.marker_to_surface_max_mm));
  }
  if (check.fold_overs > 0) {
    faults.push_back(fmt::format("the warp folds over at {} of {} points, first beside {}; check the anchors there",
                                 check.fold_overs, check.sampled_points, check.fold_over_marker));
  }
  if (check.binding.lip_side_errors > 0) {
    faults.push_back(
        fmt::format("{} vertices of one lip hang on the other; check the lip markers", check.binding.lip_side_errors));
  }
  if (check.binding.way_between_lips < kLipsPart) {
    faults.push_back(fmt::format(
        "the lips are one surface and cannot part: the way from LIP_UP_MID to LIP_LO_MID along the mesh is "
        "{:.0f} % of that around the mouth's corner; `retarget cut` opens the mesh along the line between the lips",
        100 * check.binding.way_between_lips));
  }
  if (100 * check.binding.coverage < limitNamed("bound")) {
    faults.push_back(fmt::format("the surface moves {:.1f} % of the face; expected {:.0f} %{}",
                                 100 * check.binding.coverage, limitNamed("bound"), whyLeftOut(check.left_out)));
  }
  if (check.patch_edge_angle_max_deg > kSmoothDeg) {
    faults.push_back(fmt::format("the control surface has a kink of {:.1f} degrees", check.patch_edge_angle_max_deg));
  }
  return faults;
}

}  // namespace mouthpiece
