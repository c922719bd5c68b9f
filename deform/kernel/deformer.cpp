#include "deform/kernel/deformer.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "base/errors.h"
#include "base/smooth_step.h"
#include "deform/kernel/patch_kernel.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mouth/jaw.h"
#include "deform/mouth/lip_guard.h"
#include "deform/mouth/lip_tuck.h"
#include "deform/surface/bezier_surface.h"
#include "deform/surface/virtual_points.h"
#include "deform/topology/head_topology.h"

namespace mouthpiece {
namespace {

using Net = std::array<float, kernel::kNetFloats>;
using Quad = Eigen::Array4f;  // x y z and a spare, so that a point is one register

/// A surface that covers less than this share of its plane is folded together; from twice as much on it is not.
constexpr double kFolded = 0.15;

/// A vertex with its place on a patch, before the vertices are sorted into blocks.
struct Hung {
  PatchPlace place;
  std::uint32_t vertex = 0;
  float d = 0, beside = 0, across = 0, weight = 1, jaw = 0;
};

/// Vertices in a row that all move or all rest.
struct VertexRun {
  std::size_t first, count;
};

/// Offset of a rest vertex from its place: along the normal, the first tangent, and across both. Of a carried vertex,
/// with `turns_within`, the share that turns; the rest becomes part of `base`. Where the surface is folded together
/// (`plane`: the area of its patch in the plane) its normal may turn over in any pose: nothing turns with that.
void measureOffset(const BezierSurface& surface, const Eigen::Vector3d& vertex, std::optional<double> turns_within,
                   double plane, Hung& hung) {
  const SurfacePoint s = evaluate(surface.restPose()[hung.place.patch], hung.place.u, hung.place.v);
  Eigen::Vector3d offset = vertex - s.position;
  offset *= smoothStep((s.du.cross(s.dv).norm() / plane - kFolded) / kFolded);
  if (turns_within) offset *= std::max(0.0, 1 - offset.norm() / *turns_within);
  const Eigen::Vector3d normal = s.normal();
  const Eigen::Vector3d tangent = s.du.normalized();
  hung.d = asFloat(offset.dot(normal));
  hung.beside = asFloat(offset.dot(tangent));
  hung.across = asFloat(offset.dot(normal.cross(tangent)));
}

/// Fills blocks patch by patch; a short last block repeats its last vertex.
template <typename BlockType, typename Fill>
void makeBlocks(std::vector<Hung> hung, std::vector<kernel::Run>& runs, std::vector<BlockType>& blocks,
                const Fill& fill) {
  std::sort(hung.begin(), hung.end(), [](const Hung& a, const Hung& b) {
    return a.place.patch != b.place.patch ? a.place.patch < b.place.patch : a.vertex < b.vertex;
  });
  for (std::size_t begin = 0; begin < hung.size();) {
    std::size_t end = begin;
    while (end < hung.size() && hung[end].place.patch == hung[begin].place.patch) ++end;
    kernel::Run run{static_cast<std::uint32_t>(hung[begin].place.patch), static_cast<std::uint32_t>(blocks.size()), 0,
                    static_cast<std::uint32_t>(end - begin)};
    for (std::size_t at = begin; at < end; at += kernel::kBlock, ++run.count) {
      BlockType& block = blocks.emplace_back();
      for (std::size_t lane = 0; lane < kernel::kBlock; ++lane) fill(block, lane, hung[std::min(at + lane, end - 1)]);
    }
    runs.push_back(run);
    begin = end;
  }
}

}  // namespace

struct FaceDeformer::Data {
  const kernel::Kernels* kernels = &kernel::bestKernels();
  ControlMesh control;
  std::vector<LipPair> lip_pairs = lipPairs(control);
  JawHinge jaw;
  LipTuck tuck;
  TongueMorph tongue;
  std::optional<LipGuard> guard;
  std::vector<CloughTocher<float>> splits;
  std::vector<Net> rest_nets;  ///< 3 a triangle, relative to `origin`
  std::vector<int> leaders;    ///< points that others follow linearly: markers and inner lips
  std::vector<float>
      follow_matrix;  ///< kernel::Product's: displacement and slopes of all points from the leaders' displacement
  std::size_t follow_rows = 0;
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  std::vector<kernel::Run> bound_runs, loose_runs;
  std::vector<kernel::Block> bound_blocks;
  std::vector<kernel::LooseBlock> loose_blocks;
  std::vector<std::uint32_t> jaw_vertices;  ///< those that only the jaw moves
  std::vector<float> jaw_weights;
  FaceBinding::Relaxed relaxed;  ///< of moving vertices only
  std::vector<VertexRun> still_runs, moving_runs;
  std::vector<std::uint32_t> moving;  ///< vertices of `moving_runs`
  VertexPositions rest;

  Data(const FaceMesh& mesh, const ControlMesh& control_mesh, double tucked, std::vector<std::uint32_t> tongue_vertices)
      : control(control_mesh),
        jaw(control_mesh),
        tuck(mesh, control_mesh, tucked),
        tongue(mesh, std::move(tongue_vertices)),
        rest(mesh.vertices) {}

  /// Twice that of one of the three patches of a triangle.
  [[nodiscard]] double planeArea(std::size_t patch) const {
    const auto& [a, b, c] = control.triangles[patch / 3];
    const Eigen::RowVector2d ab = control.domain.row(b) - control.domain.row(a),
                             ac = control.domain.row(c) - control.domain.row(a);
    return std::abs(ab.x() * ac.y() - ab.y() * ac.x()) / 3;
  }
  void takeSurface(const BezierSurface& surface);
  void takeFollowers(const BezierSurface& surface);
  void takeBinding(const BezierSurface& surface, const FaceBinding& binding, const std::vector<PartKind>& kinds);
  void settleAtRest();
  [[nodiscard]] VertexPositions closedMouth() const;
  void posePatches(const MarkerPositions& points, std::vector<Net>& nets) const;
  void takeRelaxed(const FaceBinding::Relaxed& given, const std::vector<PartKind>& kinds, std::vector<bool>& moves);
  void moveJawVertices(const kernel::Frame& frame) const;
  void moveRelaxed(float* out) const;
  /// Writes the moving vertices alone. `out`: x y z of every vertex.
  void move(const FacePose& pose, const TonguePose& tongue_pose, float* out) const;
};

void FaceDeformer::Data::takeSurface(const BezierSurface& surface) {
  origin = control.rest.colwise().mean().transpose().cast<float>();
  for (const auto& triangle : control.triangles) {
    splits.emplace_back(std::array<Eigen::Vector2d, 3>{control.domain.row(triangle[0]), control.domain.row(triangle[1]),
                                                       control.domain.row(triangle[2])});
  }
  for (const BezierSurface::Patch& patch : surface.restPose()) {
    Net& net = rest_nets.emplace_back();
    for (std::size_t i = 0; i < patch.net.size(); ++i)
      Eigen::Vector3f::Map(&net[3 * i]) = (patch.net[i] - origin.cast<double>()).cast<float>();
  }
  takeFollowers(surface);
}

/// Rows 3 i to 3 i + 2: value, slope along x, slope along y of the displacement at point i.
void FaceDeformer::Data::takeFollowers(const BezierSurface& surface) {
  const int count = static_cast<int>(control.points.size());
  for (int i = 0; i < count; ++i) {
    if (control.points[unsignedIndex(i)].rule != PointRule::kFollow) leaders.push_back(i);
  }
  const auto leader_count = signedIndex(leaders.size());
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(count, leader_count);
  for (Eigen::Index l = 0; l < leader_count; ++l) values(leaders[unsignedIndex(l)], l) = 1;
  for (int i = 0; i < count; ++i) {
    const ControlPoint& point = control.points[unsignedIndex(i)];
    if (point.rule != PointRule::kFollow) continue;
    for (const PointDriver& driver : point.drivers) values.row(i) += driver.weight * values.row(driver.point);
  }
  const Eigen::MatrixXd slopes = surface.slopesFrom(values);
  follow_rows = (3 * control.points.size() + kernel::kBlock - 1) / kernel::kBlock * kernel::kBlock;
  follow_matrix.assign(follow_rows * leaders.size(), 0.0F);
  for (Eigen::Index l = 0; l < leader_count; ++l) {
    float* column = follow_matrix.data() + unsignedIndex(l) * follow_rows;
    for (int i = 0; i < count; ++i) {
      *column++ = asFloat(values(i, l));
      *column++ = asFloat(slopes(2 * i, l));
      *column++ = asFloat(slopes(2 * i + 1, l));
    }
  }
}

void FaceDeformer::Data::takeBinding(const BezierSurface& surface, const FaceBinding& binding,
                                     const std::vector<PartKind>& kinds) {
  std::vector<Hung> bound, loose;
  std::vector<bool> moves(kinds.size(), false);
  const auto count = static_cast<std::uint32_t>(kinds.size());
  // Closer than this to the normal through its place a vertex needs no tangents: 0.00002 mm on a mouth of 50 mm.
  const double exact = 4e-7 * control.mouth_width;
  for (std::uint32_t i = 0; i < count; ++i) {
    Hung hung;
    hung.vertex = i;
    hung.weight = binding.skin_weight[i];
    hung.jaw = binding.jaw_weight[i];
    if (kinds[i] == PartKind::kTongue) {
      moves[i] = true;
    } else if (binding.patch[i] >= 0 && hung.weight > 0) {
      hung.place = patchPlace(binding.placeOf(i));
      const bool is_carried = isCarried(binding, i);
      measureOffset(surface, pointAt(rest, i),
                    is_carried ? std::optional(kTurnsAlong * control.mouth_width) : std::nullopt,
                    planeArea(hung.place.patch), hung);
      const bool is_above = std::hypot(double{hung.beside}, double{hung.across}) < exact;
      moves[i] = true;
      (is_above && hung.weight >= 1 ? bound : loose).push_back(hung);
    } else if (hung.jaw > 0) {
      moves[i] = true;
      jaw_vertices.push_back(hung.vertex);
      jaw_weights.push_back(hung.jaw);
    }
  }
  takeRelaxed(binding.relaxed, kinds, moves);
  makeBlocks(std::move(bound), bound_runs, bound_blocks, [](kernel::Block& block, std::size_t lane, const Hung& h) {
    block.u[lane] = asFloat(h.place.u);
    block.v[lane] = asFloat(h.place.v);
    block.d[lane] = h.d;
    for (std::size_t axis = 0; axis < 3; ++axis) block.base[axis][lane] = 0;
    block.to[lane] = 3 * h.vertex;
  });
  makeBlocks(std::move(loose), loose_runs, loose_blocks,
             [this](kernel::LooseBlock& block, std::size_t lane, const Hung& h) {
               block.u[lane] = asFloat(h.place.u);
               block.v[lane] = asFloat(h.place.v);
               block.d[lane] = h.d;
               block.beside[lane] = h.beside;
               block.across[lane] = h.across;
               block.weight[lane] = h.weight;
               block.jaw[lane] = h.jaw;
               for (std::size_t axis = 0; axis < 3; ++axis) {
                 block.base[axis][lane] = 0;
                 block.rest[axis][lane] = rest(h.vertex, signedIndex(axis));
               }
               block.to[lane] = 3 * h.vertex;
             });
  for (std::size_t i = 0; i < moves.size();) {
    const std::size_t first = i;
    while (i < moves.size() && moves[i] == moves[first]) ++i;
    (moves[first] ? moving_runs : still_runs).push_back({first, i - first});
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    if (moves[i]) moving.push_back(i);
  }
}

/// `moves`: of each vertex, whether something else moves it. What follows a tongue rests: it is moved last.
void FaceDeformer::Data::takeRelaxed(const FaceBinding::Relaxed& given, const std::vector<PartKind>& kinds,
                                     std::vector<bool>& moves) {
  relaxed.vertices = given.vertices;
  std::size_t entry = 0;
  for (const std::uint32_t end : given.ends) {
    for (; entry < end; ++entry) {
      if (!moves[given.from[entry]] || kinds[given.from[entry]] == PartKind::kTongue) continue;
      relaxed.from.push_back(given.from[entry]);
      relaxed.weights.push_back(given.weights[entry]);
    }
    relaxed.ends.push_back(static_cast<std::uint32_t>(relaxed.from.size()));
  }
  for (const std::uint32_t v : relaxed.vertices) moves[v] = true;
}

/// Runs the kernels at rest and puts what they miss the rest mesh by into `base`.
void FaceDeformer::Data::settleAtRest() {
  VertexPositions reached = rest;
  kernel::Frame frame{};
  frame.nets = rest_nets.data()->data();
  frame.out = reached.data();
  // Weights below 1 would hide part of the miss.
  std::vector<kernel::LooseBlock> whole = loose_blocks;
  for (kernel::LooseBlock& block : whole) std::fill(std::begin(block.weight), std::end(block.weight), 1.0F);
  kernels->bound(frame, bound_runs.data(), bound_runs.size(), bound_blocks.data());
  kernels->loose(frame, loose_runs.data(), loose_runs.size(), whole.data());
  const auto settle = [&](auto& block) {
    for (std::size_t lane = 0; lane < kernel::kBlock; ++lane) {
      const Eigen::RowVector3f miss = rest.row(block.to[lane] / 3) - reached.row(block.to[lane] / 3);
      for (std::size_t axis = 0; axis < 3; ++axis) block.base[axis][lane] = miss[signedIndex(axis)];
    }
  };
  for (kernel::Block& block : bound_blocks) settle(block);
  for (kernel::LooseBlock& block : loose_blocks) settle(block);
}

void FaceDeformer::Data::posePatches(const MarkerPositions& points, std::vector<Net>& nets) const {
  thread_local std::vector<float> leading, following;
  leading.resize(3 * leaders.size());
  following.resize(3 * follow_rows);
  for (std::size_t l = 0; l < leaders.size(); ++l) {
    Eigen::RowVector3f::Map(&leading[3 * l]) = (points.row(leaders[l]) - control.rest.row(leaders[l])).cast<float>();
  }
  kernels->multiply({follow_matrix.data(), leading.data(), following.data(), follow_rows, leaders.size()});
  nets.resize(rest_nets.size());
  std::array<Quad, 3> value, gx, gy;
  std::array<CubicPatch<Quad>, 3> patches;
  for (std::size_t t = 0; t < control.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const float* f = following.data() + 3 * unsignedIndex(control.triangles[t][i]);
      const float* g = f + follow_rows;
      const float* h = g + follow_rows;
      value[i] = Quad(f[0], g[0], h[0], 0);
      gx[i] = Quad(f[1], g[1], h[1], 0);
      gy[i] = Quad(f[2], g[2], h[2], 0);
    }
    splits[t].nets(value, gx, gy, patches);
    for (std::size_t k = 0; k < 3; ++k) {
      const Net& at_rest = rest_nets[3 * t + k];
      Net& net = nets[3 * t + k];
      for (std::size_t i = 0; i < 10; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          net[3 * i + axis] = at_rest[3 * i + axis] + patches[k].net[i][signedIndex(axis)];
      }
    }
  }
}

void FaceDeformer::Data::moveJawVertices(const kernel::Frame& frame) const {
  // By value: nothing that is written can change them.
  std::array<float, 9> t;
  std::array<float, 3> shift;
  std::copy_n(frame.jaw_turn, t.size(), t.begin());
  std::copy_n(frame.jaw_shift, shift.size(), shift.begin());
  const float* at_rest = rest.data();
  const std::uint32_t* vertices = jaw_vertices.data();
  const float* weights = jaw_weights.data();
  float* out = frame.out;
  for (std::size_t i = 0, count = jaw_vertices.size(); i < count; ++i) {
    const std::size_t first = 3 * std::size_t{vertices[i]};
    const float x = at_rest[first], y = at_rest[first + 1], z = at_rest[first + 2], weight = weights[i];
    float* to = out + first;
    to[0] = x + weight * (t[0] * x + t[1] * y + t[2] * z + shift[0]);
    to[1] = y + weight * (t[3] * x + t[4] * y + t[5] * z + shift[1]);
    to[2] = z + weight * (t[6] * x + t[7] * y + t[8] * z + shift[2]);
  }
}

void FaceDeformer::Data::moveRelaxed(float* out) const {
  const auto at = [](const float* all, std::uint32_t v) {
    return Eigen::Map<const Eigen::Array3f>(all + 3 * std::size_t{v});
  };
  std::size_t entry = 0;
  for (std::size_t row = 0; row < relaxed.vertices.size(); ++row) {
    Eigen::Array3f moved = at(rest.data(), relaxed.vertices[row]);
    for (; entry < relaxed.ends[row]; ++entry) {
      const std::uint32_t from = relaxed.from[entry];
      moved += relaxed.weights[entry] * (at(out, from) - at(rest.data(), from));
    }
    Eigen::Map<Eigen::Array3f>(out + 3 * std::size_t{relaxed.vertices[row]}) = moved;
  }
}

/// The lips as they meet: the rest pose, or what closes it.
VertexPositions FaceDeformer::Data::closedMouth() const {
  const MarkerPositions markers = control.markerRest() + closingOffsets(control);
  const std::vector<LipGap> touching(lip_pairs.size(), {.opened = 0});
  VertexPositions closed = rest;
  move({markers, touching}, {}, closed.data());
  return closed;
}

FaceDeformer::FaceDeformer(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding,
                           const DeformerOptions& options) {
  checkBinding(binding, mesh, control, "face binding");
  const std::vector<PartKind> kinds = vertexKinds(mesh);
  std::vector<std::uint32_t> tongue;
  for (std::uint32_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i] == PartKind::kTongue) tongue.push_back(i);
  }
  auto data = std::make_unique<Data>(mesh, control, double{binding.tuck}, std::move(tongue));
  if (options.portable_loops) data->kernels = &kernel::portableKernels();
  const BezierSurface surface(control);
  data->takeSurface(surface);
  data->takeBinding(surface, binding, kinds);
  data->settleAtRest();
  if (options.guard_lips)
    data->guard.emplace(mesh, data->closedMouth(), control, binding, options.guard, options.topology);
  data_ = std::move(data);
}

FaceDeformer::FaceDeformer(FaceDeformer&&) noexcept = default;
FaceDeformer& FaceDeformer::operator=(FaceDeformer&&) noexcept = default;
FaceDeformer::~FaceDeformer() = default;

void FaceDeformer::Data::move(const FacePose& pose, const TonguePose& tongue_pose, float* out) const {
  thread_local MarkerPositions points;
  thread_local std::vector<Net> nets;
  leadingPoints(control, lip_pairs, pose, points);
  tuck.apply(pose.lips, points);
  posePatches(points, nets);
  const AddedMotion jaw_motion = jaw.motion(points);

  kernel::Frame frame{};
  frame.nets = nets.data()->data();
  frame.out = out;
  Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(frame.jaw_turn) = jaw_motion.turn.cast<float>();
  Eigen::Map<Eigen::Vector3f>(frame.jaw_shift) = jaw_motion.shift.cast<float>();

  kernels->bound(frame, bound_runs.data(), bound_runs.size(), bound_blocks.data());
  kernels->loose(frame, loose_runs.data(), loose_runs.size(), loose_blocks.data());
  moveJawVertices(frame);
  moveRelaxed(out);
  if (guard) {
    guard->separate(points, pose.lips, jaw_motion, out);
    moveRelaxed(out);
    guard->meet(points, pose.lips, out);
    guard->leaveTeeth(jaw_motion, out);
  }
  PartedLips lips;
  for (const LipPair& pair : lip_pairs) {
    const double apart = (points.row(pair.upper_rim) - points.row(pair.lower_rim)).norm();
    if (&pair == &lip_pairs.front() || apart > lips.apart)
      lips = {apart, points(pair.upper_rim, 1), points(pair.lower_rim, 1)};
  }
  tongue.deform(jaw_motion, tongue_pose, lips, out);
}

void FaceDeformer::deform(const FacePose& pose, const TonguePose& tongue, VertexPositions& out) const {
  if (out.rows() != data_->rest.rows()) out.resize(data_->rest.rows(), 3);
  data_->move(pose, tongue, out.data());
  for (const VertexRun& run : data_->still_runs) {
    std::copy_n(data_->rest.data() + 3 * run.first, 3 * run.count, out.data() + 3 * run.first);
  }
}

std::vector<std::uint32_t> FaceDeformer::guardWords() const {
  return data_->guard ? data_->guard->words() : std::vector<std::uint32_t>();
}

const std::vector<std::uint32_t>& FaceDeformer::movingVertices() const { return data_->moving; }

void FaceDeformer::deformMoving(const FacePose& pose, const TonguePose& tongue, std::span<float> out) const {
  MOUTHPIECE_EXPECT(out.size() == 3 * data_->moving.size());
  thread_local std::vector<float> whole;
  whole.resize(unsignedIndex(data_->rest.size()));
  data_->move(pose, tongue, whole.data());
  float* to = out.data();
  for (const VertexRun& run : data_->moving_runs) to = std::copy_n(whole.data() + 3 * run.first, 3 * run.count, to);
}

}  // namespace mouthpiece
