#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "deform/surface/face_motion.h"
#include "deform/topology/head_topology.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

struct FaceMesh;

/// How a control point moves. The markers move themselves; the others are virtual and follow from the markers.
enum class PointRule : std::uint8_t {
  kMarker,    ///< column of the marker row
  kFollow,    ///< rest + sum of weight * (driver - its rest); no drivers: it never moves
  kInnerLip,  ///< rim of the mouth behind one outer lip marker; drivers: it, its neighbours along the lip to the right,
              ///< to the left
};

struct PointDriver {
  int point = 0;  ///< a marker or an earlier virtual point
  double weight = 0;
};

/// A point of the control mesh.
struct ControlPoint {
  std::string name;
  PointRule rule = PointRule::kMarker;
  LipSide side = LipSide::kNone;  ///< no triangle has points of both lips
  std::vector<PointDriver> drivers;
  int opposite = -1;  ///< kInnerLip: the point of the other lip that it meets when the mouth closes
  bool fixed =
      false;  ///< on the ring outside the markers: neither moves nor turns, so that motion fades to nothing there
};

/// The control mesh of EDGE 6, figure 4: the markers plus virtual points, triangulated in a plane with the mouth
/// and the eyes as holes. Plain data; `.face` files hold it as it is.
struct ControlMesh {
  double mouth_width = 0;        ///< between the lip corners at rest
  std::size_t marker_count = 0;  ///< the first points are the markers, in the row's order
  std::vector<ControlPoint> points;
  MarkerPositions rest;  ///< points x 3, the mesh's unit
  Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>
      domain;                                        ///< points x 2: the plane the surface is parametrised over
  std::vector<std::array<int, 3>> wanted_triangles;  ///< while it is built: their edges are kept
  std::vector<std::array<int, 3>> triangles;         ///< counter-clockwise in the plane and seen from outside
  /// 2 points x 3: derivatives of the surface at rest along the plane's axes, rows 2 i and 2 i + 1 for point i. Fitted
  /// to a mesh; empty: those that bend the surface least.
  MarkerPositions rest_slopes;

  [[nodiscard]] LipSide sideOf(std::size_t triangle) const;
  /// The places of the markers at rest: markers x 3.
  [[nodiscard]] auto markerRest() const { return rest.topRows(signedIndex(marker_count)); }
};

/// A virtual point whose rest position a face may know (from landmarks of its mesh).
struct VirtualPointPlace {
  std::string name;
  int mediapipe_landmark = -1;  ///< FaceMesh landmark id = vertex id of the canonical face
};

/// Inner lips (upper, lower, corners), inner eye corners and lid arcs.
const std::vector<VirtualPointPlace>& virtualPointPlaces();

/// What a marker layout says of its surface; the rest follows from names and places.
struct SurfacePlan {
  std::vector<LipSide> lips;  ///< of each marker; empty: lipSideOf()
  std::vector<std::array<std::string, 3>> triangles;
};
SurfacePlan surfacePlanOf(const MarkerLayout& layout);

/// Triangulates the markers of `marker_names` at `marker_rest` (markers x 3, the mesh's unit, Y up, Z out of the face).
/// `known`: rest positions of points of virtualPointPlaces() by name; those left out are estimated from the markers.
/// `mesh`: where given, the surface at rest is laid along its skin, with points added where markers are too few; give
/// it, a surface close to the skin deforms it better. `plan`: what the layout says. Throws InputError when a lip marker
/// is missing, a coordinate is not finite, or the markers do not lie like a face's.
ControlMesh buildControlMesh(const std::vector<std::string>& marker_names, const MarkerPositions& marker_rest,
                             const std::map<std::string, Eigen::Vector3d>& known = {}, const FaceMesh* mesh = nullptr,
                             const SurfacePlan& plan = {});

/// Lays the surface at rest of a mesh that was built without one along the skin of `mesh`: sets rest_slopes, and adds
/// points on the skin where that is not enough. Added points move as the surface through the other points does: they
/// say where the face is, never how it moves. Throws InputError as buildControlMesh does.
ControlMesh fittedToMesh(const ControlMesh& control, const FaceMesh& mesh, const HeadTopology& topology);

/// Where mouth and eyes are, as the points of a control mesh tell.
FaceOpenings openingsOf(const ControlMesh& control);
/// SideBits of each triangle, from its points.
std::vector<std::uint32_t> triangleSides(const ControlMesh& control);

/// Checks indices, sizes, finiteness, orientation and that the lips are apart: for meshes read from a file. Throws
/// InputError that begins with `file`.
void checkControlMesh(const ControlMesh& mesh, const std::string& file);

/// What to add to the markers (markers x 3) of a mesh whose lips are apart at rest, so that they meet where the actor's
/// do: the actor's neutral mouth is closed. Zero where the lips touch at rest.
MarkerPositions closingOffsets(const ControlMesh& mesh);

/// Two points of the mouth's rim that meet when it closes, and the outer lip markers in front of them.
struct LipPair {
  int upper_rim, lower_rim, upper_marker, lower_marker;
};
std::vector<LipPair> lipPairs(const ControlMesh& mesh);

/// How much of their gap lips have opened that stretch by up to `slack` before they part: 0 where they touch, 1 once
/// they have caught up with their outer markers, which they do at less than twice these' speed. Both are shares of the
/// closed lips' height. Continuous in value and slope.
double partedShare(double stretch, double slack);

/// All control points of a frame: points x 3. Where the pose tells of the lips, those that are apart at rest are taken
/// to have been brought together by closingOffsets. Lips that would pass through each other meet in between instead.
MarkerPositions controlPoints(const ControlMesh& mesh, const FacePose& pose);

}  // namespace mouthpiece
