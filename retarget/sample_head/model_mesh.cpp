#include "retarget/sample_head/head_model.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

using Connectivity = OpenMesh::TriMesh_ArrayKernelT<>;
using OpenMesh::EdgeHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;
using Row = Eigen::Matrix<double, 1, kChannelCount>;

std::uint32_t indexOf(VertexHandle vertex) { return static_cast<std::uint32_t>(vertex.idx()); }
VertexHandle handleOf(std::integral auto vertex) { return VertexHandle(static_cast<int>(vertex)); }

/// Loop's rules on one mesh. Positions stay in the ModelMesh; OpenMesh knows who neighbours whom.
class LoopRules {
 public:
  explicit LoopRules(const ModelMesh& mesh) : mesh_(mesh) {
    for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) net_.add_vertex(Connectivity::Point(0, 0, 0));
    for (const auto& [a, b, c] : mesh.triangles) {
      const auto face = net_.add_face(handleOf(a), handleOf(b), handleOf(c));
      MOUTHPIECE_EXPECT(face.is_valid());  // two surfaces share an edge otherwise
    }
  }

  [[nodiscard]] const Connectivity& net() const { return net_; }

  [[nodiscard]] bool isCrease(EdgeHandle edge) const {
    const HalfedgeHandle half = net_.halfedge_handle(edge, 0);
    return net_.is_boundary(edge) || mesh_.creases.contains(ModelMesh::edge(indexOf(net_.from_vertex_handle(half)),
                                                                            indexOf(net_.to_vertex_handle(half))));
  }

  [[nodiscard]] Row edgePoint(EdgeHandle edge) const {
    const HalfedgeHandle one = net_.halfedge_handle(edge, 0);
    const HalfedgeHandle other = net_.halfedge_handle(edge, 1);
    const Row ends = rowOf(net_.from_vertex_handle(one)) + rowOf(net_.to_vertex_handle(one));
    if (isCrease(edge)) return 0.5 * ends;
    const Row sides = rowOf(net_.to_vertex_handle(net_.next_halfedge_handle(one))) +
                      rowOf(net_.to_vertex_handle(net_.next_halfedge_handle(other)));
    return 3.0 / 8.0 * ends + 1.0 / 8.0 * sides;
  }

  /// A vertex after one step (`limit` false) or after infinitely many.
  [[nodiscard]] Row vertexPoint(VertexHandle vertex, bool limit) const {
    Row creased = Row::Zero();
    Row ring = Row::Zero();
    int creases = 0;
    int valence = 0;
    for (auto half = net_.cvoh_begin(vertex); half != net_.cvoh_end(vertex); ++half) {
      const Row neighbour = rowOf(net_.to_vertex_handle(*half));
      ring += neighbour;
      ++valence;
      if (!isCrease(net_.edge_handle(*half))) continue;
      creased += neighbour;
      ++creases;
    }
    const Row old = rowOf(vertex);
    if (valence == 0 || creases > 2) return old;
    if (creases == 2) return limit ? Row(2.0 / 3.0 * old + 1.0 / 6.0 * creased) : Row(0.75 * old + 0.125 * creased);
    const double n = valence;
    const double c = 3.0 / 8.0 + 0.25 * std::cos(2.0 * std::numbers::pi / n);
    const double step = (5.0 / 8.0 - c * c) / n;  // Loop's beta
    const double weight = limit ? 1.0 / (3.0 / (8.0 * step) + n) : step;
    return (1.0 - n * weight) * old + weight * ring;
  }

 private:
  [[nodiscard]] Row rowOf(VertexHandle vertex) const { return mesh_.vertices.row(vertex.idx()); }

  const ModelMesh& mesh_;
  Connectivity net_;
};

/// The triangles that replace one whose edges `mid` are split (kNone: not split).
constexpr std::uint32_t kNone = 0xFFFFFFFFU;

void addSplitTriangle(ModelMesh& mesh, const std::array<std::uint32_t, 3>& corner,
                      const std::array<std::uint32_t, 3>& mid, int part) {
  const int splits =
      (mid[0] != kNone) + (mid[1] != kNone) + (mid[2] != kNone);  // mid[k] lies between corner k and k + 1
  if (splits == 0) return mesh.addTriangle(corner[0], corner[1], corner[2], part);
  if (splits == 3) {
    for (std::size_t k = 0; k < 3; ++k) mesh.addTriangle(corner[k], mid[k], mid[(k + 2) % 3], part);
    return mesh.addTriangle(mid[0], mid[1], mid[2], part);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    const std::size_t last = (k + 2) % 3;
    if (splits == 1 && mid[k] != kNone) {
      mesh.addTriangle(corner[k], mid[k], corner[last], part);
      return mesh.addTriangle(mid[k], corner[next], corner[last], part);
    }
    if (splits == 2 && mid[k] == kNone) {  // the edge k .. next is whole
      mesh.addTriangle(mid[last], mid[next], corner[last], part);
      mesh.addTriangle(corner[k], corner[next], mid[next], part);
      return mesh.addTriangle(corner[k], mid[next], mid[last], part);
    }
  }
}

}  // namespace

ModelMesh loopSubdividedWhere(const ModelMesh& mesh, const std::function<bool(std::size_t triangle)>& wants) {
  const LoopRules rules(mesh);
  const Connectivity& net = rules.net();
  std::vector<bool> is_split(net.n_edges(), false);
  std::vector<bool> moves(net.n_vertices(), true);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto face = Connectivity::FaceHandle(static_cast<int>(f));
    const bool wanted = wants(f);
    for (auto edge = net.cfe_begin(face); edge != net.cfe_end(face); ++edge) {
      if (wanted) is_split[unsignedIndex(edge->idx())] = true;
    }
    for (auto vertex = net.cfv_begin(face); vertex != net.cfv_end(face); ++vertex) {
      if (!wanted) moves[unsignedIndex(vertex->idx())] = false;
    }
  }

  ModelMesh result;
  const auto old_count = signedIndex(net.n_vertices());
  result.vertices.resize(old_count + std::count(is_split.begin(), is_split.end(), true), kChannelCount);
  for (Eigen::Index v = 0; v < old_count; ++v) {
    result.vertices.row(v) =
        moves[unsignedIndex(v)] ? rules.vertexPoint(handleOf(v), false) : Row(mesh.vertices.row(v));
  }
  std::vector<std::uint32_t> middle(net.n_edges(), kNone);
  auto next = static_cast<std::uint32_t>(old_count);
  for (std::size_t e = 0; e < net.n_edges(); ++e) {
    const EdgeHandle edge(static_cast<int>(e));
    const HalfedgeHandle half = net.halfedge_handle(edge, 0);
    const std::uint32_t a = indexOf(net.from_vertex_handle(half));
    const std::uint32_t b = indexOf(net.to_vertex_handle(half));
    const bool stays_crease = mesh.creases.contains(ModelMesh::edge(a, b));
    if (!is_split[e]) {
      if (stays_crease) result.creases.insert(ModelMesh::edge(a, b));
      continue;
    }
    middle[e] = next++;
    result.vertices.row(middle[e]) = rules.edgePoint(edge);
    if (stays_crease) {
      result.creases.insert(ModelMesh::edge(a, middle[e]));
      result.creases.insert(ModelMesh::edge(b, middle[e]));
    }
  }
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& corner = mesh.triangles[f];
    std::array<std::uint32_t, 3> mid{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto half = net.find_halfedge(handleOf(corner[k]), handleOf(corner[(k + 1) % 3]));
      mid[k] = middle[unsignedIndex(net.edge_handle(half).idx())];
    }
    addSplitTriangle(result, corner, mid, mesh.part_of_triangle[f]);
  }
  return result;
}

std::uint32_t ModelMesh::addVertex(const Eigen::Vector3d& point) {
  vertices.conservativeResize(vertices.rows() + 1, Eigen::NoChange);
  vertices.row(vertices.rows() - 1).setZero();
  const auto index = static_cast<std::uint32_t>(vertices.rows() - 1);
  setPoint(index, point);
  return index;
}

void ModelMesh::addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, int part) {
  triangles.push_back({a, b, c});
  part_of_triangle.push_back(part);
}

void ModelMesh::addQuad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d, int part, Cut cut) {
  if (cut == Cut::kFromSecond) {
    addTriangle(a, b, c, part);
    addTriangle(b, d, c, part);
    return;
  }
  addTriangle(a, b, d, part);
  addTriangle(a, d, c, part);
}

void ModelMesh::addBand(const Ring& near, const Ring& far, int part, bool inside_out) {
  for (std::size_t a = 0; a < near.size(); ++a) {
    const std::size_t b = (a + 1) % near.size();
    inside_out ? addQuad(near[b], near[a], far[b], far[a], part) : addQuad(near[a], near[b], far[a], far[b], part);
  }
}

void ModelMesh::addFan(const Ring& ring, std::uint32_t tip, int part, bool inside_out) {
  for (std::size_t a = 0; a < ring.size(); ++a) {
    const std::size_t b = (a + 1) % ring.size();
    inside_out ? addTriangle(ring[b], ring[a], tip, part) : addTriangle(ring[a], ring[b], tip, part);
  }
}

double ModelMesh::longestEdge(std::size_t triangle) const {
  const auto& [a, b, c] = triangles[triangle];
  return std::max({(point(a) - point(b)).norm(), (point(b) - point(c)).norm(), (point(c) - point(a)).norm()});
}

Eigen::Vector3d ModelMesh::centroid(std::size_t triangle) const {
  const auto& [a, b, c] = triangles[triangle];
  return (point(a) + point(b) + point(c)) / 3;
}

void ModelMesh::append(const ModelMesh& other) {
  const auto offset = static_cast<std::uint32_t>(vertices.rows());
  vertices.conservativeResize(vertices.rows() + other.vertices.rows(), Eigen::NoChange);
  vertices.bottomRows(other.vertices.rows()) = other.vertices;
  for (std::size_t i = 0; i < other.triangles.size(); ++i) {
    const auto& [a, b, c] = other.triangles[i];
    addTriangle(a + offset, b + offset, c + offset, other.part_of_triangle[i]);
  }
  for (const Edge& crease : other.creases) creases.insert({crease.first + offset, crease.second + offset});
}

ModelMesh loopSubdivided(const ModelMesh& mesh) {
  return loopSubdividedWhere(mesh, [](std::size_t) { return true; });
}

ModelMesh::Channels loopLimit(const ModelMesh& mesh) {
  const LoopRules rules(mesh);
  ModelMesh::Channels limit(mesh.vertices.rows(), kChannelCount);
  for (Eigen::Index v = 0; v < limit.rows(); ++v) limit.row(v) = rules.vertexPoint(handleOf(v), true);
  return limit;
}

void fitLimitToVertices(ModelMesh& mesh, std::size_t count, double share, int iterations) {
  const auto rows = signedIndex(count);
  const Eigen::MatrixXd start = mesh.vertices.topRows(rows).leftCols<3>();
  const Eigen::MatrixXd smooth = loopLimit(mesh).topRows(rows).leftCols<3>();
  const Eigen::MatrixXd target = smooth + share * (start - smooth);
  for (int i = 0; i < iterations; ++i) {
    const Eigen::MatrixXd miss = target - loopLimit(mesh).topRows(rows).leftCols<3>();
    mesh.vertices.topRows(rows).leftCols<3>() += miss;
  }
}

}  // namespace mouthpiece
