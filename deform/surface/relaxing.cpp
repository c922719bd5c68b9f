// Spreads over a stretch of skin what its vertices were torn apart by.
#include <Eigen/Geometry>
#include <Eigen/SparseLU>
#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/binding.h"
#include "deform/topology/head_topology.h"

namespace mouthpiece {
namespace {

constexpr float kLeastEntry = 0.002F;  ///< an entry of a row with less is left out
constexpr double kLeastEdge = 1e-6;    ///< of the mesh's size: edges count as so long at least
constexpr double kLeastShare = 1e-9;   ///< 1 + cosine of a triangle's angle counts as so much at least

/// The mesh as relaxing sees it: vertices in one place and on one side are one knot, called by the first of them.
struct Knots {
  struct Neighbour {
    std::uint32_t knot;
    double length;  ///< of the way there
    /// In the mean: 1 / length, and to keep needles, where a triangle is obtuse at this knot by what its mean value
    /// coordinates (Floater, 2003: tan(angle / 2) / length) are more. A needle's apex so stays beside its long edge,
    /// and on its side of that.
    double weight;
  };
  std::vector<std::uint32_t> of;               ///< of each vertex
  std::vector<std::vector<Neighbour>> beside;  ///< of each knot

  /// The tongue, which moves by itself, is left out.
  Knots(const FaceMesh& mesh, const std::vector<std::uint32_t>& sides, const std::vector<PartKind>& kinds,
        bool keeps_needles)
      : of(mesh.vertexCount()), beside(mesh.vertexCount()) {
    std::map<std::tuple<float, float, float, std::uint32_t>, std::uint32_t> first_at;
    for (std::uint32_t v = 0; v < of.size(); ++v) {
      const Eigen::RowVector3f p = mesh.vertices.row(v);
      of[v] = first_at.try_emplace({p.x(), p.y(), p.z(), sides[v]}, v).first->second;
    }
    const double least =
        kLeastEdge * double{(mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff()).norm()};
    for (const Triangle& t : mesh.triangles) {
      if (std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return kinds[v] == PartKind::kTongue; })) continue;
      for (std::size_t k = 0; k < 3; ++k)
        addCorner(mesh, of[t[k]], of[t[(k + 1) % 3]], of[t[(k + 2) % 3]], least, keeps_needles);
    }
    for (auto& neighbours : beside) sumUp(neighbours);
  }

  void addCorner(const FaceMesh& mesh, std::uint32_t at, std::uint32_t one, std::uint32_t other, double least,
                 bool keeps_needles) {
    const auto place = [&](std::uint32_t v) -> Eigen::Vector3d { return pointAt(mesh.vertices, v); };
    if (at == one || at == other) return;
    const Eigen::Vector3d to_one = place(one) - place(at), to_other = place(other) - place(at);
    const double length = std::max(least, to_one.norm()), length_to_other = std::max(least, to_other.norm());
    const double lengths = length * length_to_other;
    const double half_tangent =
        to_one.cross(to_other).norm() / std::max(lengths + to_one.dot(to_other), kLeastShare * lengths);
    const double of_apex = keeps_needles ? std::max(0.0, half_tangent - 1) : 0;
    beside[at].push_back({one, length, of_apex / length});
    beside[at].push_back({other, length_to_other, of_apex / length_to_other});
  }

  /// One entry a neighbour.
  static void sumUp(std::vector<Neighbour>& neighbours) {
    std::sort(neighbours.begin(), neighbours.end(),
              [](const Neighbour& a, const Neighbour& b) { return a.knot < b.knot; });
    std::size_t kept = 0;
    for (const Neighbour& next : neighbours) {
      if (kept == 0 || neighbours[kept - 1].knot != next.knot) {
        neighbours[kept++] = next;
        neighbours[kept - 1].weight += 1 / next.length;
      } else {
        neighbours[kept - 1].weight += next.weight;
      }
    }
    neighbours.resize(kept);
  }

  /// Which knots are within `reach` of `seeds`, over those where `may_pass` holds; an edge counts as `longest` at most.
  [[nodiscard]] std::vector<bool> within(const std::vector<std::uint32_t>& seeds, double reach, double longest,
                                         const std::vector<bool>& may_pass) const {
    std::vector<double> way(of.size(), std::numeric_limits<double>::infinity());
    std::vector<bool> is_in(of.size(), false);
    std::vector<std::pair<double, std::uint32_t>> queue;
    const auto offer = [&](std::uint32_t v, double to) {
      if (!may_pass[v] || to > reach || to >= way[v]) return;
      way[v] = to;
      queue.emplace_back(-to, v);
      std::push_heap(queue.begin(), queue.end());
    };
    for (const std::uint32_t v : seeds) offer(of[v], 0);
    while (!queue.empty()) {
      std::pop_heap(queue.begin(), queue.end());
      const std::uint32_t v = queue.back().second;
      queue.pop_back();
      if (is_in[v]) continue;
      is_in[v] = true;
      for (const Neighbour& next : beside[v]) offer(next.knot, way[v] + std::min(next.length, longest));
    }
    return is_in;
  }

  /// Takes those out of `is_in` from which no way leads out of it: they would follow nobody.
  void keepAnchored(std::vector<bool>& is_in) const {
    std::vector<std::uint32_t> reached;
    std::vector<bool> is_anchored(of.size(), false);
    const auto reach = [&](std::uint32_t v) {
      if (!is_in[v] || is_anchored[v]) return;
      is_anchored[v] = true;
      reached.push_back(v);
    };
    for (std::uint32_t v = 0; v < of.size(); ++v) {
      if (is_in[v]) continue;
      for (const Neighbour& next : beside[v]) reach(next.knot);
    }
    while (!reached.empty()) {
      const std::uint32_t v = reached.back();
      reached.pop_back();
      for (const Neighbour& next : beside[v]) reach(next.knot);
    }
    is_in = std::move(is_anchored);
  }
};

}  // namespace

struct SkinRelaxing::Data {
  std::vector<std::uint32_t> knot_of;    ///< of each vertex
  std::vector<int> inner;                ///< of each knot: its row, -1 where it is not relaxed
  std::vector<std::uint32_t> rim_knots;  ///< those that are not, beside some that are
  Eigen::SparseMatrix<double> from_rim;  ///< rows x rim knots
  Eigen::SparseLU<Eigen::SparseMatrix<double>> solver;
  bool is_solved = false;

  Data(const FaceMesh& mesh, const HeadTopology& topology, const std::vector<std::uint32_t>& torn,
       const std::vector<std::uint32_t>& also, const std::vector<bool>& held, double reach, double longest_edge,
       bool keeps_needles);
};

/// `also`: vertices that are relaxed whatever is said of them.
SkinRelaxing::Data::Data(const FaceMesh& mesh, const HeadTopology& topology, const std::vector<std::uint32_t>& torn,
                         const std::vector<std::uint32_t>& also, const std::vector<bool>& held, double reach,
                         double longest_edge, bool keeps_needles) {
  const std::vector<PartKind>& kinds = topology.kinds();
  const Knots knots(mesh, topology.forbidden(), kinds, keeps_needles);
  knot_of = knots.of;
  std::vector<bool> may_relax(kinds.size());
  // Gums of both rows may hang together at the back of the mouth.
  for (std::size_t v = 0; v < kinds.size(); ++v)
    may_relax[v] = isSkin(kinds[v]) || kinds[v] == PartKind::kMouthInside || kinds[v] == PartKind::kUpperTeeth ||
                   kinds[v] == PartKind::kLowerTeeth;
  std::vector<bool> is_in = knots.within(torn, reach, longest_edge, may_relax);
  for (std::uint32_t v = 0; v < held.size(); ++v) {
    if (held[v]) is_in[knots.of[v]] = false;
  }
  for (const std::uint32_t v : torn) is_in[knots.of[v]] = may_relax[knots.of[v]];
  for (const std::uint32_t v : also) is_in[knots.of[v]] = true;
  knots.keepAnchored(is_in);

  inner.assign(kinds.size(), -1);
  std::vector<int> rim(kinds.size(), -1);
  int inner_count = 0;
  for (std::uint32_t v = 0; v < kinds.size(); ++v) {
    if (is_in[v]) inner[v] = inner_count++;
  }
  if (inner_count == 0) return;
  std::vector<Eigen::Triplet<double>> laplacian, to_rim;
  for (std::uint32_t v = 0; v < kinds.size(); ++v) {
    if (inner[v] < 0) continue;
    double sum = 0;
    for (const auto& [next, length, weight] : knots.beside[v]) sum += weight;
    for (const auto& [next, length, weight] : knots.beside[v]) {
      if (inner[next] >= 0) {
        laplacian.emplace_back(inner[v], inner[next], -weight / sum);
        continue;
      }
      if (rim[next] < 0) {
        rim[next] = static_cast<int>(rim_knots.size());
        rim_knots.push_back(next);
      }
      to_rim.emplace_back(inner[v], rim[next], weight / sum);
    }
    laplacian.emplace_back(inner[v], inner[v], 1);
  }
  Eigen::SparseMatrix<double> left(inner_count, inner_count);
  from_rim.resize(inner_count, signedIndex(rim_knots.size()));
  left.setFromTriplets(laplacian.begin(), laplacian.end());
  from_rim.setFromTriplets(to_rim.begin(), to_rim.end());
  solver.compute(left);
  is_solved = solver.info() == Eigen::Success;
}

SkinRelaxing::SkinRelaxing(const FaceMesh& mesh, const HeadTopology& topology, const std::vector<std::uint32_t>& torn,
                           const std::vector<bool>& held, double reach)
    : data_(std::make_unique<const Data>(mesh, topology, torn, std::vector<std::uint32_t>(), held, reach,
                                         std::numeric_limits<double>::infinity(), false)) {}
SkinRelaxing::SkinRelaxing(SkinRelaxing&&) noexcept = default;
SkinRelaxing& SkinRelaxing::operator=(SkinRelaxing&&) noexcept = default;
SkinRelaxing::~SkinRelaxing() = default;

void SkinRelaxing::relax(VertexPositions& moves) const {
  if (!data_->is_solved) return;
  const Eigen::MatrixXd around = moves(data_->rim_knots, Eigen::all).cast<double>();
  const Eigen::MatrixXf inner = data_->solver.solve(data_->from_rim * around).cast<float>();
  if (!inner.allFinite()) return;
  for (Eigen::Index v = 0; v < moves.rows(); ++v) {
    const int row = data_->inner[data_->knot_of[unsignedIndex(v)]];
    if (row >= 0) moves.row(v) = inner.row(row);
  }
}

void relaxAround(const FaceMesh& mesh, const HeadTopology& topology, const std::vector<std::uint32_t>& torn,
                 const std::vector<bool>& held, double reach, FaceBinding& binding, double longest_edge,
                 bool keeps_needles) {
  const SkinRelaxing::Data system(mesh, topology, torn, binding.relaxed.vertices, held, reach, longest_edge,
                                  keeps_needles);
  if (!system.is_solved) return;
  const Eigen::MatrixXf shares = system.solver.solve(Eigen::MatrixXd(system.from_rim)).cast<float>();
  if (!shares.allFinite()) return;

  FaceBinding::Relaxed relaxed;
  for (std::uint32_t v = 0; v < system.knot_of.size(); ++v) {
    const int row = system.inner[system.knot_of[v]];
    if (row < 0) continue;
    relaxed.vertices.push_back(v);
    const auto weights = shares.row(row).array();
    const float kept = (weights >= kLeastEntry).select(weights, 0).sum();
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
      if (weights[i] < kLeastEntry) continue;
      relaxed.from.push_back(system.rim_knots[unsignedIndex(i)]);
      relaxed.weights.push_back(weights[i] / kept);
    }
    relaxed.ends.push_back(static_cast<std::uint32_t>(relaxed.from.size()));
  }
  binding.relaxed = std::move(relaxed);
}

}  // namespace mouthpiece
