#include "deform/mouth/lip_meeting.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "base/smooth_step.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mouth/lip_levelling.h"
#include "deform/surface/virtual_points.h"
#include "deform/topology/head_topology.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr std::size_t kPlanes = LipMeeting::kSections;
constexpr std::size_t kDepths = 48;  ///< in which a section is looked at
// Lengths as shares of the mouth's width.
constexpr double kMoved = 0.16;      ///< vertices further from the line where the lips meet stay
constexpr double kSpreads = 0.07;    ///< how far along the skin a movement spreads
constexpr double kSeenDeep = 0.2;    ///< lips are looked at no further behind their fronts
constexpr double kMeetInto = 0.002;  ///< lips that shall touch are brought so far into each other
/// What is further apart, or further in each other, is not moved the whole way, and from `kTooFar` on not at all.
constexpr double kMeetWhole = 0.06, kTooFar = 0.15;
/// Lips that have parted so far are not brought together any more. What is much too far apart lets go over so many
/// times as long a way as it is: what goes back sooner than the lips part is a jump.
constexpr double kParted = 0.08, kLetsGo = 4;
/// How far the lips face each other, a sine in the section, where they count as walls of the mouth: these are a
/// chance's few places deep, or none, and cross nothing.
constexpr double kWall = 0.1, kNoWall = 0.35;
constexpr double kSoftly = 0.004;  ///< places of a section that are further apart by this count for a third
/// Across the mouth: so near to its corners the lips are one surface that folds, and from here on they are two.
constexpr double kAtEnds = 0.08, kOffEnds = 0.18;
/// What is so far from the one lip as from the other, by shares of both ways, is of neither unless it is at the rims.
constexpr double kOfBoth = 0.1, kAtRim = 0.05;
constexpr double kGives = 0.1;      ///< of what is wanted, against movement
constexpr double kStays = 0.05;     ///< weight of a section in which nothing is wanted
constexpr double kCrosses = 8;      ///< and of one in which the lips cross, beside one where they are too far apart
constexpr double kCounted = 0.001;  ///< places of a section that weigh less are left out
constexpr int kLooks = 3;

/// A place on a triangle's edge.
struct EdgeCut {
  std::uint32_t a, b;
  float along, z, y;
};
struct LipSegment {
  std::uint32_t section;
  bool is_upper;
  EdgeCut ends[2];  ///< from behind to the front
};
struct EdgePlace {
  float y = 0, along = 0;
  std::int32_t segment = -1;
};
/// What is seen of the lips in all sections.
struct Sections {
  std::vector<LipSegment> segments;
  std::array<std::array<float, 2>, kPlanes> front;
  using Edges = std::array<std::array<std::array<EdgePlace, kDepths>, kPlanes>, 2>;
  Edges edges, edges_but_walls;
};
constexpr int kSquare = static_cast<int>(kPlanes);
using PlaneColumn = Eigen::Matrix<double, kSquare, 1>;
using PlaneSquare = Eigen::Matrix<double, kSquare, kSquare>;
using PlaneRows = Eigen::Matrix<double, Eigen::Dynamic, kSquare, Eigen::RowMajor>;

}  // namespace

struct LipMeeting::Data {
  double width = 0;
  float first = 0, pitch = 1;  ///< of the sections, across
  Vector3f across = Vector3f::UnitX(), forward = Vector3f::UnitZ();
  std::array<std::vector<Triangle>, 2> lips;  ///< the upper one's near its rim, the lower one's
  std::vector<Triangle> walls;                ///< the mouth's, beside its corners: of both lips or neither
  std::vector<int> row_of;                    ///< of each vertex: its row in `ways`, -1: it stays
  std::vector<std::uint32_t> vertices;        ///< of each row
  PlaneRows ways;                             ///< how far up each vertex goes by a unit of each section's movement
  PlaneSquare cost;
  std::array<double, kPlanes> allowed{};  ///< how far lips that cross at rest do

  void takeLips(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding,
                const HeadTopology& topology);
  void takeWays(const FaceMesh& mesh, const VertexPositions& closed);
  [[nodiscard]] Eigen::SparseMatrix<double> stiffness(const VertexPositions& rest) const;
  void look(const float* at, Sections& seen) const;
  /// How far the lips are apart in a section, below zero where they cross; infinite where one is missing. take(vertex,
  /// share) is told what a vertex' way up makes of it.
  template <typename Take>
  double gapIn(const Sections& seen, const Sections::Edges& edges, std::size_t section, const Take& take) const;
  [[nodiscard]] double wantedChange(std::size_t section, double gap, double may_shut, double apart, double near) const;
};

void LipMeeting::Data::look(const float* at, Sections& seen) const {
  seen.segments.clear();
  constexpr float kNowhere = -std::numeric_limits<float>::infinity();
  seen.front.fill({kNowhere, kNowhere});
  for (std::size_t lip = 0; lip < 2; ++lip) {
    for (const Triangle& t : lips[lip]) {
      std::array<float, 3> side;
      for (std::size_t k = 0; k < 3; ++k)
        side[k] = (Eigen::Map<const Vector3f>(at + 3 * std::size_t{t[k]}).dot(across) - first) / pitch;
      const auto [low, high] = std::minmax({side[0], side[1], side[2]});
      const float last = std::min(std::floor(high), asFloat(kPlanes - 1));
      const Eigen::Map<const Vector3f> p0(at + 3 * std::size_t{t[0]}), p1(at + 3 * std::size_t{t[1]}),
          p2(at + 3 * std::size_t{t[2]});
      const float faces_up = (p1.z() - p0.z()) * (p2.x() - p0.x()) - (p1.x() - p0.x()) * (p2.z() - p0.z());
      for (float s = std::max(0.0F, std::ceil(low)); s <= last; ++s) {
        LipSegment segment;
        int cuts = 0;
        for (std::size_t k = 0; k < 3 && cuts < 2; ++k) {
          const std::size_t next = (k + 1) % 3;
          if ((side[k] < s) == (side[next] < s)) continue;
          const float along = (s - side[k]) / (side[next] - side[k]);
          const Eigen::Map<const Vector3f> a(at + 3 * std::size_t{t[k]}), b(at + 3 * std::size_t{t[next]});
          const Vector3f p = a + along * (b - a);
          segment.ends[cuts++] = {t[k], t[next], along, p.dot(forward), p.y()};
        }
        if (cuts != 2) continue;
        if (segment.ends[0].z > segment.ends[1].z) std::swap(segment.ends[0], segment.ends[1]);
        segment.section = static_cast<std::uint32_t>(s);
        segment.is_upper = lip == 0;
        float& front = seen.front[segment.section][lip];
        front = std::max(front, segment.ends[1].z);
        // What faces away from the other lip is the back of the same lip.
        if (lip == 0 ? faces_up < 0 : faces_up > 0) seen.segments.push_back(segment);
      }
    }
  }
  for (Sections::Edges* edges : {&seen.edges, &seen.edges_but_walls}) {
    for (auto& of_lip : *edges) {
      for (auto& section : of_lip) section.fill(EdgePlace{});
    }
  }
  const float step = asFloat(kSeenDeep * width / double{kDepths});
  for (std::size_t i = 0; i < seen.segments.size(); ++i) {
    const LipSegment& segment = seen.segments[i];
    const auto& [behind, before] = segment.ends;
    const float front = std::min(seen.front[segment.section][0], seen.front[segment.section][1]);
    const float from = std::max(0.0F, std::ceil((front - before.z) / step)),
                to = std::min(std::floor((front - behind.z) / step), asFloat(kDepths - 1));
    const float length = before.z - behind.z, way = segment.is_upper ? 1 : -1;
    const float facing = length / std::max(std::hypot(length, before.y - behind.y), 1e-20F);
    const float wall = way * asFloat(kTooFar * width * (1 - smoothStep(kWall, kNoWall, double{facing})));
    const std::size_t lip = segment.is_upper ? 0 : 1;
    const auto offer = [&](EdgePlace& place, float y, float along) {
      if (place.segment < 0 || way * y < way * place.y) place = {y, along, static_cast<std::int32_t>(i)};
    };
    for (float d = from; d <= to; ++d) {
      const float along = length > 0 ? (front - d * step - behind.z) / length : 0;
      const float y = behind.y + along * (before.y - behind.y);
      const auto depth = static_cast<std::size_t>(d);
      offer(seen.edges[lip][segment.section][depth], y, along);
      offer(seen.edges_but_walls[lip][segment.section][depth], y + wall, along);
    }
  }
}

template <typename Take>
double LipMeeting::Data::gapIn(const Sections& seen, const Sections::Edges& edges, std::size_t section,
                               const Take& take) const {
  const auto& above = edges[0][section];
  const auto& below = edges[1][section];
  const double softly = kSoftly * width;
  std::array<double, kDepths> gaps;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t d = 0; d < kDepths; ++d) {
    gaps[d] = std::numeric_limits<double>::infinity();
    if (above[d].segment < 0 || below[d].segment < 0) continue;
    gaps[d] = double{above[d].y - below[d].y};
    least = std::min(least, gaps[d]);
  }
  if (!std::isfinite(least)) return least;
  double all = 0;
  std::array<double, kDepths> weights{};
  for (std::size_t d = 0; d < kDepths; ++d) {
    if (!std::isfinite(gaps[d])) continue;
    weights[d] = std::exp((least - gaps[d]) / softly);
    all += weights[d];
  }
  for (std::size_t d = 0; d < kDepths; ++d) {
    const double counts = weights[d] / all;
    if (counts < kCounted) continue;
    for (const EdgePlace* place : {&above[d], &below[d]}) {
      const LipSegment& segment = seen.segments[unsignedIndex(place->segment)];
      const double sign = place == &above[d] ? counts : -counts;
      for (std::size_t e = 0; e < 2; ++e) {
        const EdgeCut& cut = segment.ends[e];
        const double share = sign * double{e == 1 ? place->along : 1 - place->along};
        take(cut.a, share * double{1 - cut.along});
        take(cut.b, share * double{cut.along});
      }
    }
  }
  return least;
}

/// Triangles of each lip, those across the seam beside the corners with the lip that is nearer.
void LipMeeting::Data::takeLips(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding,
                                const HeadTopology& topology) {
  const std::vector<Vector3d> rim = openingsOf(control).lip_line;
  std::vector<bool> is_near(mesh.vertexCount());
  for (std::size_t v = 0; v < is_near.size(); ++v)
    is_near[v] = distanceToLine(pointAt(mesh.vertices, v), rim) < kMoved * width;
  for (const Triangle& t : trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside})) {
    if (std::none_of(t.begin(), t.end(), [&](std::uint32_t v) { return is_near[v]; })) continue;
    double lower = 0;
    bool is_lip = true;
    for (const std::uint32_t v : t) {
      lower += topology.lowerShare(v) / 3;
      is_lip = is_lip && binding.patch[v] >= 0;
    }
    if (!is_lip) continue;
    const bool is_wall = std::abs(lower - 0.5) < kOfBoth && std::none_of(t.begin(), t.end(), [&](std::uint32_t v) {
                           return distanceToLine(pointAt(mesh.vertices, v), rim) < kAtRim * width;
                         });
    (is_wall ? walls : lips[lower > 0.5 ? 1 : 0]).push_back(t);
  }
  row_of.assign(mesh.vertexCount(), -1);
  std::set<std::uint32_t> moved;
  for (const auto* triangles : {&lips[0], &lips[1], &walls}) {
    for (const Triangle& t : *triangles) {
      for (const std::uint32_t v : t) {
        if (is_near[v]) moved.insert(v);
      }
    }
  }
  for (const std::uint32_t v : moved) {
    row_of[v] = static_cast<int>(vertices.size());
    vertices.push_back(v);
  }
}

/// What a movement costs: itself, and what neighbours move differently.
Eigen::SparseMatrix<double> LipMeeting::Data::stiffness(const VertexPositions& rest) const {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto* triangles : {&lips[0], &lips[1], &walls}) {
    for (const Triangle& t : *triangles) {
      for (std::size_t k = 0; k < 3; ++k) edges.emplace(std::minmax(t[k], t[(k + 1) % 3]));
    }
  }
  return costOfMoving(edges, row_of, rest, kSpreads * width);
}

/// Each section's is the least movement that closes it in the closed mouth.
void LipMeeting::Data::takeWays(const FaceMesh& mesh, const VertexPositions& closed) {
  Sections seen;
  look(closed.data(), seen);
  Eigen::Matrix<double, Eigen::Dynamic, kSquare> touches;
  touches.setZero(signedIndex(vertices.size()), kSquare);
  for (std::size_t s = 0; s < kPlanes; ++s) {
    gapIn(seen, seen.edges, s, [&](std::uint32_t v, double share) {
      if (row_of[v] >= 0) touches(row_of[v], signedIndex(s)) += share;
    });
  }
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(stiffness(mesh.vertices));
  ways = solver.solve(touches);
  cost = touches.transpose() * ways;
  const double usual = cost.trace() / asReal(std::max<Eigen::Index>(1, (cost.diagonal().array() > 0).count()));
  if (usual > 0) cost /= usual;
}

LipMeeting::LipMeeting(const FaceMesh& mesh, const VertexPositions& closed, const ControlMesh& control,
                       const FaceBinding& binding, const HeadTopology* topology) {
  auto data = std::make_unique<Data>();
  data->width = control.mouth_width;
  const auto place = [&](const std::string& name) -> Vector3d {
    const int point = findPoint(control, name);
    if (point < 0) throw InputError("found no point " + name + " on the control surface; expected lips that meet");
    return control.rest.row(point).transpose();
  };
  const Vector3d right = place("LIP_CORNER_R"), to_left = place("LIP_CORNER_L") - right, up = Vector3d::UnitY(),
                 across = (to_left - to_left.y() * up).normalized();
  data->across = across.cast<float>();
  data->forward = across.cross(up).cast<float>();
  data->pitch = asFloat(to_left.dot(across) / double{kPlanes});
  data->first = asFloat(right.dot(across)) + 0.5F * data->pitch;
  std::optional<HeadTopology> found;
  if (topology == nullptr) topology = &found.emplace(mesh, openingsOf(control));
  data->takeLips(mesh, control, binding, *topology);
  data->takeWays(mesh, closed);
  Sections seen;
  data->look(mesh.vertices.data(), seen);
  for (std::size_t s = 0; s < kPlanes; ++s) {
    const double gap = data->gapIn(seen, seen.edges_but_walls, s, [](std::uint32_t, double) {});
    if (std::isfinite(gap)) data->allowed[s] = std::max(0.0, -gap);
  }
  data_ = std::move(data);
}
LipMeeting::LipMeeting(LipMeeting&&) noexcept = default;
LipMeeting& LipMeeting::operator=(LipMeeting&&) noexcept = default;
LipMeeting::~LipMeeting() = default;

/// By how much the gap of a section shall change. `apart`: of Wanted, as `may_shut`.
double LipMeeting::Data::wantedChange(std::size_t section, double gap, double may_shut, double apart,
                                      double near) const {
  const double along = (asReal(section) + 0.5) / asReal(kPlanes), into = kMeetInto * width;
  const double crosses = -gap - into - allowed[section], too_far = gap + into - apart;
  const double moves = smoothStep(kAtEnds, kOffEnds, std::min(along, 1 - along)) *
                       (1 - smoothStep(kMeetWhole, kTooFar, std::max(too_far, -gap) / width));
  if (crosses > 0) return near * moves * crosses;
  if (too_far <= 0) return 0;
  return -may_shut * (1 - smoothStep(apart / std::max(kParted * width, kLetsGo * too_far))) * moves * too_far;
}

void LipMeeting::meet(const Wanted& wanted, double near, float* out) const {
  const double width = data_->width, into = kMeetInto * width;
  bool may_shut = false;
  for (std::size_t c = 0; c < kLipColumns; ++c)
    may_shut = may_shut || (wanted.may_shut[c] > 0 && double{wanted.apart[c]} < kLetsGo * kTooFar * width);
  if (data_->vertices.empty() || (near <= 0 && !may_shut)) return;
  thread_local Sections seen;
  std::array<double, kPlanes> wanted_gaps;  // as the first look tells; the others come nearer to it
  wanted_gaps.fill(std::numeric_limits<double>::infinity());
  for (int look = 0; look < kLooks; ++look) {
    data_->look(out, seen);
    PlaneSquare system = kGives * data_->cost;
    PlaneColumn right = PlaneColumn::Zero();
    double most = 0;
    for (std::size_t s = 0; s < kPlanes; ++s) {
      const std::size_t column = s * kLipColumns / kPlanes;
      PlaneColumn closes;
      double gap = 0, further = 0;
      const auto measure = [&](const Sections::Edges& edges) {
        closes.setZero();
        gap = data_->gapIn(seen, edges, s, [&](std::uint32_t v, double share) {
          if (data_->row_of[v] >= 0) closes += share * data_->ways.row(data_->row_of[v]).transpose();
        });
        further = data_->wantedChange(s, gap, double{wanted.may_shut[column]}, double{wanted.apart[column]}, near);
      };
      measure(seen.edges);
      if (!std::isfinite(gap)) continue;
      if (further > 0) {
        measure(seen.edges_but_walls);
        further = std::max(0.0, further);
      }
      if (!std::isfinite(wanted_gaps[s])) wanted_gaps[s] = gap + further;
      further = std::clamp(wanted_gaps[s] - gap, std::min(further, 0.0), std::max(further, 0.0));
      most = std::max(most, std::abs(further));
      const double much = std::min(1.0, std::abs(further) / into);
      const double counts = (kStays + (1 - kStays) * much) * (further > 0 ? 1 + (kCrosses - 1) * much : 1);
      system += counts * closes * closes.transpose();
      right += counts * further * closes;
    }
    if (most < 0.25 * into) return;
    system.diagonal().array() += 1e-9;
    const PlaneColumn moves = system.ldlt().solve(right);
    for (std::size_t i = 0; i < data_->vertices.size(); ++i)
      out[3 * std::size_t{data_->vertices[i]} + 1] += asFloat(data_->ways.row(signedIndex(i)).dot(moves));
  }
}

}  // namespace mouthpiece
