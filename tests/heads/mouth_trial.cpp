#include "heads/mouth_trial.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "motion/resample.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_rig.h"
#include "synthesis/lips.h"

namespace mouthpiece::test {
namespace {

using Eigen::Vector3d;

/// Behind the lips' fronts: further back one looks between them, not into the crease where thick lips meet.
constexpr double kDeepMm = 9;
constexpr double kLeapMm = 1.5;  ///< from one place of the net to the next: one looks past an edge

/// What is seen of a mouth from the front: the depth of the foremost skin on a net of places.
class FrontView {
 public:
  FrontView(const Vector3d& middle, double width, double height, double step)
      : middle_(middle), step_(step), columns_(wholePart(width / step)), rows_(wholePart(height / step)) {}

  /// The tallest column of places, between the quarters of the mouth, where one looks deeper than `deep` into it, over
  /// an edge: lips that meet, however deep they do, are one valley, without a leap of depth by `leap`.
  [[nodiscard]] double tallestGap(const VertexPositions& vertices, const std::vector<Triangle>& triangles, double deep,
                                  double leap) const {
    Eigen::ArrayXXd depth = Eigen::ArrayXXd::Constant(rows_, columns_, -1e30);
    for (const Triangle& t : triangles) paint(vertices, t, depth);
    const double front = depth.maxCoeff();
    double tallest = 0;
    for (Eigen::Index c = columns_ / 4; c < columns_ - columns_ / 4; ++c) {
      // The lips' own depth in this column: the skin just over and under the mouth, between which one looks into it and
      // not into the fold under the lower lip.
      Eigen::Index lowest = 0, highest = 0;
      const double edge = std::min(depth.col(c).topRows(rows_ / 4).maxCoeff(&lowest),
                                   depth.col(c).bottomRows(rows_ / 4).maxCoeff(&highest));
      highest += rows_ - rows_ / 4;
      double gap = 0;
      bool is_over_edge = false;
      for (Eigen::Index r = std::max(rows_ / 8, lowest); r < std::min(rows_ - rows_ / 8, highest); ++r) {
        if (depth(r, c) >= std::min(edge, front) - deep) {
          gap = 0;
          is_over_edge = false;
          continue;
        }
        gap += step_;
        for (const Eigen::Index beside : {r - 1, r + 1})
          is_over_edge = is_over_edge || depth(beside, c) - depth(r, c) > leap;
        if (is_over_edge) tallest = std::max(tallest, gap);
      }
    }
    return tallest;
  }

 private:
  void paint(const VertexPositions& vertices, const Triangle& t, Eigen::ArrayXXd& depth) const {
    std::array<Vector3d, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d q = pointAt(vertices, t[k]) - middle_;
      p[k] = {q.x() / step_ + 0.5 * asReal(columns_), q.y() / step_ + 0.5 * asReal(rows_), q.z()};
    }
    const double turn = (p[1].x() - p[0].x()) * (p[2].y() - p[0].y()) - (p[1].y() - p[0].y()) * (p[2].x() - p[0].x());
    if (std::abs(turn) < 1e-12) return;
    const auto range = [&](int axis, Eigen::Index count) {
      const auto [low, high] = std::minmax({p[0][axis], p[1][axis], p[2][axis]});
      return std::pair(std::max<Eigen::Index>(0, wholePart(std::floor(std::max(low, -1.0)))),
                       std::min<Eigen::Index>(count - 1, wholePart(std::ceil(std::min(high, asReal(count))))));
    };
    const auto [left, right] = range(0, columns_);
    const auto [low, high] = range(1, rows_);
    for (Eigen::Index c = left; c <= right; ++c) {
      for (Eigen::Index r = low; r <= high; ++r) {
        const double x = asReal(c) + 0.5 - p[0].x(), y = asReal(r) + 0.5 - p[0].y();
        const double b = (x * (p[2].y() - p[0].y()) - y * (p[2].x() - p[0].x())) / turn;
        const double d = ((p[1].x() - p[0].x()) * y - (p[1].y() - p[0].y()) * x) / turn;
        if (b < 0 || d < 0 || b + d > 1) continue;
        depth(r, c) = std::max(depth(r, c), (1 - b - d) * p[0].z() + b * p[1].z() + d * p[2].z());
      }
    }
  }

  Vector3d middle_;
  double step_;
  Eigen::Index columns_, rows_;
};

/// The frame of each B P M in which the actor's lips are nearest, where they come near at all.
std::set<std::size_t> closedFrames(const CorpusTake& take, const MarkerLayout& layout) {
  const std::vector<std::string> names = layout.markerNames();
  const auto column = [&](const char* name) { return std::find(names.begin(), names.end(), name) - names.begin(); };
  const Eigen::Index upper = 3 * column("LIP_UP_MID"), lower = 3 * column("LIP_LO_MID");
  const PositionMatrix& at = take.motion.positions_mm;
  const Eigen::VectorXd opening = (at.middleCols(upper, 3) - at.middleCols(lower, 3)).rowwise().norm();
  std::set<std::size_t> frames;
  for (const LabelledPhone& phone : take.labels.phones) {
    if (!isBilabial(phone.phone)) continue;
    const auto first = std::clamp<Eigen::Index>(wholePart(std::ceil(phone.span.start * take.motion.frame_rate_hz)), 0,
                                                opening.size() - 1);
    const auto last =
        std::clamp<Eigen::Index>(wholePart(phone.span.end * take.motion.frame_rate_hz), first, opening.size() - 1);
    Eigen::Index tightest = 0;
    const double least = opening.segment(first, last - first + 1).minCoeff(&tightest);
    if (least < opening.minCoeff() + 0.25 * (opening.maxCoeff() - opening.minCoeff()))
      frames.insert(unsignedIndex(first + tightest));
  }
  return frames;
}

ActorPose actorOf(const Corpus& corpus) {
  return {corpus.neutral_pose_mm, closedLipsMm(corpus), unseenRounding(corpus)};
}

void judge(const FaceRig& rig, const ClickedHead& head, const CorpusTake& take, const Corpus& corpus,
           MouthTrial& trial) {
  const FaceMesh& mesh = rig.mesh();
  const double mm = head.mm_per_unit;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  const std::vector<Triangle> skin = trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside});
  for (const Triangle& t : skin) {
    for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(std::minmax(t[k], t[(k + 1) % 3]));
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  std::vector<float> lengths;
  for (const auto& [a, b] : edges) lengths.push_back((mesh.vertices.row(a) - mesh.vertices.row(b)).norm());
  const ActorPose actor = actorOf(corpus);
  const auto times = frameTimes(0, take.motion.frameCount(), take.motion.frame_rate_hz);
  const FaceMotion motion = rig.retarget(take.motion, &actor, lipsFromPhones(take.labels, times));
  const std::set<std::size_t> closed = closedFrames(take, corpus.layout);
  VertexPositions now, before;
  for (std::size_t f = 0; f < motion.frameCount(); ++f) {
    rig.deform(motion.pose(FrameIndex{f}), TonguePose{}, now);
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const auto [a, b] = edges[i];
      const double grown = double{(now.row(a) - now.row(b)).norm() - lengths[i]};
      trial.edge_growth_mm = std::max(trial.edge_growth_mm, mm * grown);
    }
    if (f > 0) {
      const Eigen::Map<const MarkerPositions> here(motion.pose(FrameIndex{f}).markers.data(),
                                                   motion.markers().cols() / 3, 3),
          there(motion.pose(FrameIndex{f - 1}).markers.data(), motion.markers().cols() / 3, 3);
      const double of_markers = (here - there).rowwise().norm().maxCoeff();
      const double of_vertices = double{(now - before).rowwise().norm().maxCoeff()};
      trial.jump_mm = std::max(trial.jump_mm, mm * (of_vertices - of_markers));
    }
    if (closed.contains(f)) {
      const auto marker = [&](const char* name) -> Vector3d {
        const auto at = std::find(rig.markerNames().begin(), rig.markerNames().end(), name) - rig.markerNames().begin();
        return Eigen::Map<const Vector3d>(motion.pose(FrameIndex{f}).markers.data() + 3 * at);
      };
      const Vector3d middle = 0.5 * (marker("LIP_UP_MID") + marker("LIP_LO_MID"));
      const double width = (marker("LIP_CORNER_L") - marker("LIP_CORNER_R")).norm();
      const double height = 1.4 * (marker("LIP_UP_MID") - marker("LIP_LO_MID")).norm();
      const double gap = FrontView(middle, width, height, 0.15 / mm).tallestGap(now, skin, kDeepMm / mm, kLeapMm / mm);
      ++trial.closures;
      trial.shut += mm * gap <= 0.5 ? 1U : 0U;
    }
    before = now;
  }
}

/// A take without gaps that has closures.
const CorpusTake& wholeTake(const Corpus& corpus, std::size_t number) {
  for (std::size_t i = 0; i < corpus.takes.size(); ++i) {
    const CorpusTake& take = corpus.takes[(number + i) % corpus.takes.size()];
    if (take.motion.positions_mm.allFinite() && !closedFrames(take, corpus.layout).empty()) return take;
  }
  throw InputError(corpus.name + ": found no take without gaps that has a B P M; expected one");
}

}  // namespace

FitRequest requestFor(const ClickedHead& head, const Corpus& corpus) {
  FitRequest request;
  request.name = head.name;
  request.corpus = corpus.name;
  request.marker_names = corpus.layout.markerNames();
  request.surface = surfacePlanOf(corpus.layout);
  request.actor_neutral_mm = corpus.neutral_pose_mm;
  request.actor_closed_lips_mm = closedLipsMm(corpus);
  request.warp.any_kernel = true;
  return request;
}

MouthTrial tryMouth(const ClickedHead& head, const Corpus& corpus, const JudgedPoses& poses, std::size_t take,
                    const std::filesystem::path& folder) {
  MouthTrial trial;
  std::filesystem::create_directories(folder);
  const std::string stem = fmt::format("head_{}", head.name);
  const std::string bytes = objOf(head);
  writeFileAtomically(folder / (stem + ".obj"), bytes);
  FitRequest request = requestFor(head, corpus);
  request.mesh_file = stem + ".obj";
  request.mesh_sha256 = sha256Hex(bytes);
  try {
    FaceMesh mesh = parseFaceMesh(bytes, stem + ".obj");
    const auto secondsSince = [](std::clock_t start) { return asReal(std::clock() - start) / asReal(CLOCKS_PER_SEC); };
    const std::clock_t start = std::clock();
    FaceFile face = fitFace(mesh, head.clicks, "clicks", request);
    trial.fit_s = secondsSince(start);
    std::vector<std::string> faults = faultsOf(checkFace(face, mesh));
    FaceRig fitted = FaceRig::of(face, std::move(mesh), stem);
    const ActorPose actor = actorOf(corpus);
    FaceJudgement judged = judgeFace(fitted, face, poses, actor);
    const std::clock_t given = std::clock();
    judged = mendFace(face, fitted, poses, actor, std::move(judged));
    trial.mend_s = secondsSince(given);
    for (const FaceFault& fault : judged.faults) faults.push_back(fault.what);
    writeFaceFile(folder / (stem + ".face"), face);
    const FaceRig rig = FaceRig::load(folder / (stem + ".face"));
    trial.faults = fmt::format("{}", fmt::join(faults, "; "));
    judge(rig, head, wholeTake(corpus, take), corpus, trial);
  } catch (const InputError& error) {
    trial.refused = error.what();
  }
  return trial;
}

}  // namespace mouthpiece::test
