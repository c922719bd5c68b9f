#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <set>
#include <utility>
#include <vector>

namespace mouthpiece {

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

  Channels vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
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

}  // namespace mouthpiece
