#include "deform/mouth/lip_levelling.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangles.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

// Lengths as shares of the mouth's width.
constexpr std::size_t kSections = 48;  ///< across the whole mouth
constexpr double kBehindRim = 0.05, kBeforeRim = 0.12;
constexpr double kNear = 0.16;   ///< vertices further from the rim stay
constexpr double kSpread = 0.1;  ///< how far along the skin a movement spreads
constexpr double kFarthest = 0.15;

/// Sections stand upright.
struct MouthFrame {
  Vector3d up = Vector3d::UnitY(), across, forward;

  explicit MouthFrame(const Vector3d& to_left)
      : across((to_left - to_left.y() * up).normalized()), forward(across.cross(up)) {}
};

/// A place on an edge of the mesh.
struct Cut {
  std::uint32_t a, b;
  double along;
  double z, y;
};
/// What a plane cuts out of a triangle, from behind to the front.
struct Segment {
  Cut ends[2];
};

struct Share {
  std::uint32_t vertex;
  double weight;
};
using Shares = std::vector<Share>;

/// One lip in a plane across the mouth.
class Section {
 public:
  Section(const VertexPositions& vertices, std::span<const Triangle> triangles, const MouthFrame& frame,
          double across) {
    const auto at = [&](std::uint32_t v) { return Vector3d(vertices.row(v).transpose().cast<double>()); };
    for (const Triangle& t : triangles) {
      std::array<double, 3> side{};
      for (std::size_t k = 0; k < 3; ++k) side[k] = at(t[k]).dot(frame.across) - across;
      std::vector<Cut> cuts;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = (k + 1) % 3;
        if ((side[k] < 0) == (side[next] < 0)) continue;
        const double along = side[k] / (side[k] - side[next]);
        const Vector3d p = at(t[k]) + along * (at(t[next]) - at(t[k]));
        cuts.push_back({t[k], t[next], along, p.dot(frame.forward), p.dot(frame.up)});
      }
      if (cuts.size() != 2) continue;
      if (cuts[0].z > cuts[1].z) std::swap(cuts[0], cuts[1]);
      segments_.push_back({{cuts[0], cuts[1]}});
    }
  }

  void addDepths(std::vector<double>& depths) const {
    for (const Segment& segment : segments_) {
      for (const Cut& end : segment.ends) depths.push_back(end.z);
    }
  }

  struct Place {
    double y;
    const Segment* on;
    double along;
  };
  /// The lowest or highest place at this depth.
  [[nodiscard]] std::optional<Place> at(double z, bool lowest) const {
    std::optional<Place> best;
    for (const Segment& segment : segments_) {
      const auto& [behind, before] = segment.ends;
      if (z < behind.z || z > before.z) continue;
      const double length = before.z - behind.z, along = length > 0 ? (z - behind.z) / length : 0;
      const double y = behind.y + along * (before.y - behind.y);
      if (!best || (lowest ? y < best->y : y > best->y)) best = Place{y, &segment, along};
    }
    return best;
  }

  /// The lowest or highest place between two depths.
  [[nodiscard]] std::optional<Place> rim(double from, double to, bool lowest) const {
    std::optional<Place> best;
    for (const Segment& segment : segments_) {
      for (const double along : {0.0, 1.0}) {
        const Cut& end = segment.ends[along > 0 ? 1 : 0];
        if (end.z < from || end.z > to) continue;
        if (!best || (lowest ? end.y < best->y : end.y > best->y)) best = Place{end.y, &segment, along};
      }
    }
    return best;
  }

  static void addShares(const Place& place, double sign, Shares& shares) {
    const double of[2] = {1 - place.along, place.along};
    for (std::size_t k = 0; k < 2; ++k) {
      const Cut& end = place.on->ends[k];
      shares.push_back({end.a, sign * of[k] * (1 - end.along)});
      shares.push_back({end.b, sign * of[k] * end.along});
    }
  }

 private:
  std::vector<Segment> segments_;
};

/// That the lips touch in a section: `shares` of upright movements make up for `gap`, which is below zero where they
/// cross.
struct Touch {
  double gap;
  Shares shares;
};

}  // namespace

Eigen::SparseMatrix<double> costOfMoving(const std::set<std::pair<std::uint32_t, std::uint32_t>>& edges,
                                         const std::vector<int>& row_of, const VertexPositions& rest, double spreads) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& [a, b] : edges) {
    const double length = (pointAt(rest, a) - pointAt(rest, b)).norm() / spreads;
    const double stiff = 1 / std::max(length * length, 1e-6);
    const int ra = row_of[a], rb = row_of[b];
    if (ra >= 0) entries.emplace_back(ra, ra, stiff);
    if (rb >= 0) entries.emplace_back(rb, rb, stiff);
    if (ra < 0 || rb < 0) continue;
    entries.emplace_back(ra, rb, -stiff);
    entries.emplace_back(rb, ra, -stiff);
  }
  const int count = row_of.empty() ? 0 : *std::max_element(row_of.begin(), row_of.end()) + 1;
  for (int row = 0; row < count; ++row) entries.emplace_back(row, row, 1);
  Eigen::SparseMatrix<double> all(count, count);
  all.setFromTriplets(entries.begin(), entries.end());
  return all;
}

LipVertices::LipVertices(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding)
    : upper(mesh.vertexCount(), false), lower(mesh.vertexCount(), false) {
  const std::vector<std::uint32_t> patch_sides = triangleSides(control);
  const auto sideOf = [&](std::uint32_t v) {
    return binding.patch[v] < 0 || !(binding.skin_weight[v] > 0) ? 0U : patch_sides[unsignedIndex(binding.patch[v])];
  };
  for (const Triangle& triangle : trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside})) {
    const std::uint32_t side = sideOf(triangle[0]) & sideOf(triangle[1]) & sideOf(triangle[2]);
    for (const std::uint32_t v : triangle) {
      if ((side & kUpperLip) != 0) upper[v] = true;
      if ((side & kLowerLip) != 0) lower[v] = true;
    }
  }
}

std::vector<std::uint32_t> LipVertices::ofOne(bool is_upper) const {
  std::vector<std::uint32_t> found;
  for (std::uint32_t v = 0; v < upper.size(); ++v) {
    if (upper[v] != lower[v] && upper[v] == is_upper) found.push_back(v);
  }
  return found;
}

struct LipLevelling::Data {
  Options options;
  std::vector<Triangle> upper, lower;  ///< with corners on that lip and none on the other
  std::vector<Vector3d> rim;
  Vector3d right_corner, to_left;
  MouthFrame frame;
  double width, first = 0, last = 1;  ///< shares of the way between which lips meet
  std::vector<int> row_of;            ///< of each vertex: its row among `vertices`, -1: it stays
  std::vector<std::uint32_t> vertices;
  Eigen::SparseMatrix<double> stiffness;

  Data(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding, const Options& asked)
      : options(asked),
        rim(openingsOf(control).lip_line),
        right_corner(control.rest.row(findPoint(control, "LIP_CORNER_R"))),
        to_left(control.rest.row(findPoint(control, "LIP_CORNER_L")).transpose() - right_corner),
        frame(to_left),
        width(to_left.norm()),
        row_of(mesh.vertexCount(), -1) {
    const LipVertices of(mesh, control, binding);
    const auto isOf = [](const std::vector<bool>& own, const std::vector<bool>& other, const Triangle& t) {
      return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return own[v] && !other[v]; });
    };
    for (const Triangle& t : trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside})) {
      const bool is_upper = isOf(of.upper, of.lower, t), is_lower = isOf(of.lower, of.upper, t);
      if (is_upper != is_lower) (is_upper ? upper : lower).push_back(t);
    }
    std::vector<double> at;
    for (const LipPair& pair : lipPairs(control)) {
      const Vector3d rims = 0.5 * (control.rest.row(pair.upper_rim) + control.rest.row(pair.lower_rim)).transpose();
      at.push_back((rims - right_corner).dot(frame.across) / width);
    }
    if (!at.empty()) {
      first = *std::min_element(at.begin(), at.end());
      last = *std::max_element(at.begin(), at.end());
    }
    takeSprings(mesh.vertices);
  }

  /// What a movement costs: itself, and what neighbours move differently.
  void takeSprings(const VertexPositions& rest) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const std::vector<Triangle>* triangles : {&upper, &lower}) {
      for (const Triangle& t : *triangles) {
        for (std::size_t k = 0; k < 3; ++k) edges.emplace(std::minmax(t[k], t[(k + 1) % 3]));
      }
    }
    std::set<std::uint32_t> near;
    for (const auto& [a, b] : edges) {
      for (const std::uint32_t v : {a, b}) {
        if (distanceToLine(pointAt(rest, v), rim) < kNear * width) near.insert(v);
      }
    }
    for (const std::uint32_t v : near) {
      row_of[v] = static_cast<int>(vertices.size());
      vertices.push_back(v);
    }
    stiffness = costOfMoving(edges, row_of, rest, kSpread * width);
  }

  [[nodiscard]] std::optional<Touch> touchIn(const VertexPositions& pose, double across) const {
    double rim_depth = 0, nearest = std::numeric_limits<double>::infinity();
    for (const Vector3d& p : rim) {
      const double aside = std::abs(p.dot(frame.across) - across);
      if (aside >= nearest) continue;
      nearest = aside;
      rim_depth = p.dot(frame.forward);
    }
    const Section above(pose, upper, frame, across), below(pose, lower, frame, across);
    const double behind = rim_depth - kBehindRim * width, before = rim_depth + kBeforeRim * width;
    std::vector<double> depths;
    above.addDepths(depths);
    below.addDepths(depths);
    std::optional<Touch> touch;
    const auto takeIfNearer = [&](const auto& low, const auto& high) {
      if (!low || !high || (touch && low->y - high->y >= touch->gap)) return;
      touch = Touch{low->y - high->y, {}};
      Section::addShares(*low, 1, touch->shares);
      Section::addShares(*high, -1, touch->shares);
    };
    for (const double z : depths) {
      if (z >= behind && z <= before) takeIfNearer(above.at(z, true), below.at(z, false));
    }
    // Lips that are bare sheets have no depth in common.
    if (!touch) takeIfNearer(above.rim(behind, before, true), below.rim(behind, before, false));
    return touch;
  }
};

LipLevelling::LipLevelling(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding,
                           const Options& options)
    : data_(std::make_unique<const Data>(mesh, control, binding, options)) {}
LipLevelling::LipLevelling(LipLevelling&&) noexcept = default;
LipLevelling::~LipLevelling() = default;

void LipLevelling::level(std::span<const VertexPositions> closures, FaceBinding& binding) const {
  const auto count = signedIndex(data_->vertices.size());
  if (closures.empty() || count == 0) return;
  std::vector<Eigen::Triplet<double>> pulls;
  Eigen::VectorXd wanted = Eigen::VectorXd::Zero(count);
  int touches = 0;
  for (const VertexPositions& pose : closures) {
    for (std::size_t s = 0; s < kSections; ++s) {
      const double share = (asReal(s) + 0.5) / asReal(kSections);
      if (share < data_->first || share > data_->last) continue;
      const double across = (data_->right_corner + share * data_->to_left).dot(data_->frame.across);
      const auto touch = data_->touchIn(pose, across);
      // In sections in which coarse lips have no depth in common, other skin is what lies over each other.
      if (!touch || std::abs(touch->gap) > kFarthest * data_->width) continue;
      for (const Share& of : touch->shares) {
        const int row = data_->row_of[of.vertex];
        if (row < 0) continue;
        pulls.emplace_back(touches, row, of.weight);
        wanted(row) -= of.weight * (touch->gap + data_->options.into * data_->width);
      }
      ++touches;
    }
  }
  if (touches == 0) return;
  Eigen::SparseMatrix<double> pull(touches, count);
  pull.setFromTriplets(pulls.begin(), pulls.end());
  const Eigen::SparseMatrix<double> system = Eigen::SparseMatrix<double>(pull.transpose() * pull) +
                                             data_->options.softness * asReal(closures.size()) * data_->stiffness;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
  const Eigen::VectorXd further = solver.solve(wanted);
  if (solver.info() != Eigen::Success || !further.allFinite()) return;

  FaceBinding::Levelled& levelled = binding.levelled;
  std::map<std::uint32_t, double> ways;
  for (std::size_t i = 0; i < levelled.vertices.size(); ++i) ways[levelled.vertices[i]] = double{levelled.ways[i]};
  for (Eigen::Index i = 0; i < count; ++i) ways[data_->vertices[unsignedIndex(i)]] += further(i);
  levelled = {};
  const double most = kFarthest * data_->width;
  constexpr double kUnseen = 1e-4;
  for (const auto& [vertex, way] : ways) {
    if (std::abs(way) < kUnseen * data_->width) continue;
    levelled.vertices.push_back(vertex);
    levelled.ways.push_back(asFloat(std::clamp(way, -most, most)));
  }
}

}  // namespace mouthpiece
