#pragma once

// The default face under construction: what its makers hand to each other.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "deform/mesh/triangles.h"

namespace mouthpiece {

struct FaceMesh;

/// What a vertex of a mesh under construction carries; Loop's rules smooth all channels alike.
enum ModelChannel : int {
  kX,
  kY,
  kZ,
  kVermilion,   ///< 1 on the red of the lips
  kMouthDepth,  ///< 0 outside, 1 deep in the mouth
  kFlush,       ///< 1 where skin is thin and red: the edge of the lids and behind it; less in the bowl of the ears
  kShell,       ///< 0 on the face, 1 on the head behind it
  kChannelCount
};

/// A mesh under construction: vertices with channels, triangles with the number of their part.
struct ModelMesh {
  using Channels = Eigen::Matrix<double, Eigen::Dynamic, kChannelCount, Eigen::RowMajor>;
  using Edge = std::pair<std::uint32_t, std::uint32_t>;  ///< smaller index first
  using Ring = std::vector<std::uint32_t>;

  Channels vertices;
  std::vector<Triangle> triangles;
  std::vector<int> part_of_triangle;
  std::set<Edge> creases;  ///< edges that keep their fold; a boundary always does

  static Edge edge(std::uint32_t a, std::uint32_t b) { return a < b ? Edge{a, b} : Edge{b, a}; }
  [[nodiscard]] Eigen::Vector3d point(std::uint32_t vertex) const { return vertices.row(vertex).head<3>().transpose(); }
  void setPoint(std::uint32_t vertex, const Eigen::Vector3d& point) {
    vertices.row(vertex).head<3>() = point.transpose();
  }
  std::uint32_t addVertex(const Eigen::Vector3d& point);
  void addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, int part);
  /// Two triangles between a, b (near) and c, d (far): corners a b d c in order around, cut from a to d or from b to c.
  enum class Cut { kFromFirst, kFromSecond };
  void addQuad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d, int part, Cut cut = Cut::kFromFirst);
  /// A closed band of quadrilaterals between two rings of as many vertices, and a fan from a ring to its tip.
  void addBand(const Ring& near, const Ring& far, int part, bool inside_out = false);
  void addFan(const Ring& ring, std::uint32_t tip, int part, bool inside_out = false);
  /// The longest edge of a triangle.
  [[nodiscard]] double longestEdge(std::size_t triangle) const;
  [[nodiscard]] Eigen::Vector3d centroid(std::size_t triangle) const;
  /// Copies `other` behind this mesh.
  void append(const ModelMesh& other);
};

/// One step of Loop subdivision with creases and boundaries; old vertices keep their numbers. Connectivity by OpenMesh.
/// (C. Loop, "Smooth subdivision surfaces based on triangles", 1987; creases: Hoppe et al., SIGGRAPH 1994.)
ModelMesh loopSubdivided(const ModelMesh& mesh);

/// The same where `wants` says so of a triangle; neighbours are cut so that no gap opens. Vertices at the region's edge
/// stay.
ModelMesh loopSubdividedWhere(const ModelMesh& mesh, const std::function<bool(std::size_t triangle)>& wants);

/// Where each vertex would end after infinitely many steps.
ModelMesh::Channels loopLimit(const ModelMesh& mesh);

/// Moves the first `count` vertices so that their limit positions approach where they are now: the smoothed surface
/// then passes near the given points. `share` of the way, in `iterations` steps.
void fitLimitToVertices(ModelMesh& mesh, std::size_t count, double share, int iterations);

/// Parts of the default face, in the order they are written.
enum DefaultPart : int {
  kPartSkin,
  kPartLips,
  kPartMouth,
  kPartEyes,
  kPartUpperGums,
  kPartUpperTeeth,
  kPartLowerGums,
  kPartLowerTeeth,
  kPartTongue,
  kPartLashes,
  kPartHair,
  kDefaultPartCount
};

/// Vertices of MediaPipe's canonical face (468 vertices; a vertex' number is its landmark's).
inline constexpr std::size_t kCanonicalVertexCount = 468;

/// One half of the line where the lips meet, right to left, without the corners: kInnerUpperLip[i] faces
/// kInnerLowerLip[i].
inline constexpr std::array<std::uint32_t, 9> kInnerUpperLip{191, 80, 81, 82, 13, 312, 311, 310, 415};
inline constexpr std::array<std::uint32_t, 9> kInnerLowerLip{95, 88, 178, 87, 14, 317, 402, 318, 324};
inline constexpr std::uint32_t kInnerCornerRight = 78;
inline constexpr std::uint32_t kInnerCornerLeft = 308;

/// Edges of the eyes' openings, around: outer corner, upper lid, inner corner, lower lid.
inline constexpr std::array<std::uint32_t, 16> kEyeRight{33,  246, 161, 160, 159, 158, 157, 173,
                                                         133, 155, 154, 153, 145, 144, 163, 7};
inline constexpr std::array<std::uint32_t, 16> kEyeLeft{263, 466, 388, 387, 386, 385, 384, 398,
                                                        362, 382, 381, 380, 374, 373, 390, 249};

/// The face's outline from the forehead's middle over the subject's left side, the chin and the right side.
inline constexpr std::array<std::uint32_t, 36> kFaceOutline{10,  338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288,
                                                            397, 365, 379, 378, 400, 377, 152, 148, 176, 149, 150, 136,
                                                            172, 58,  132, 93,  234, 127, 162, 21,  54,  103, 67,  109};

struct EyeBall {
  Eigen::Vector3d centre;
  double radius = 0;
};

/// The canonical face made ready: millimetres, mouth and eyes opened, lips meeting along one line and rolled inward
/// into a closed mouth bag, lids with an edge that lies on the eyeballs. Vertices below 468 are the landmarks.
struct OpenedFace {
  ModelMesh mesh;
  std::array<EyeBall, 2> eyes;  ///< right, left
};

/// `canonical`: mind-ar's canonical-face-model.obj (centimetres). Throws InputError when it is another mesh.
OpenedFace openCanonicalFace(const FaceMesh& canonical, std::string_view file);

/// Closes the canonical face to a head: skull, jaw's underside and neck, joined to the face's outline. Open at the
/// neck's foot.
void addHeadShell(ModelMesh& face);

/// Two ears, closed surfaces set into the head.
ModelMesh makeEars();

/// A cap of short hair over the skull of the finished head: the shell's triangles where hair grows, lifted.
ModelMesh makeHair(const ModelMesh& head);

/// Two rows of teeth with gums and a tongue, fitted behind the lips of an opened canonical face. The teeth of both rows
/// are closed a millimetre apart at rest.
ModelMesh makeMouthParts(const OpenedFace& face);

/// Eyeballs with iris and pupil rings; channel kMouthDepth holds the angle from the front, in units of pi.
ModelMesh makeEyeBall(const EyeBall& eye);

/// Lashes along the upper lids of the finished face, thin blades.
ModelMesh makeLashes(const OpenedFace& face);

/// Linear RGB a vertex of the finished model: skin with blush and brows, lips, lids, nostrils, the mouth's dark, teeth,
/// eyes. A pure function of places and channels, so that the same mesh always gets the same colours.
std::vector<std::array<float, 3>> paintFace(const ModelMesh& model);

/// Pushes the nostrils' openings in; vertices below 468 stay where they are.
void carveNostrils(ModelMesh& model);

}  // namespace mouthpiece
