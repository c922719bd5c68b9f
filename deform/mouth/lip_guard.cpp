#include "deform/mouth/lip_guard.h"

// What runs in every frame; lip_guard_watches.cpp tells who watches what.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

#include "base/smooth_step.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3f;

// Lengths as shares of the mouth's width.
constexpr double kEase = 0.001;       ///< what is pushed less than this is pushed softly
constexpr double kDrawnWhole = 0.02;  ///< lips are drawn together the whole way where they are nearer than this
constexpr double kSeenAbove = 0.042;  ///< and not at all beyond this, where watches see nothing
constexpr double kComesNear = 0.004;  ///< nothing is pushed further than this into the other lip
constexpr double kFarApart = 0.08;    ///< lips further apart everywhere need no guard, which fades in over half of this
constexpr double kKeptApart = 0.01;   ///< lips that are kept further apart are not drawn together at all
constexpr int kDrawingSweeps = 3;     ///< columns pull at their neighbours
constexpr float kLevelledWithin = 6;  ///< times as far apart as they are levelled, lips are not levelled any more
constexpr int kSweeps = 4;            ///< lips that give way by half each are out of each other after so many

/// 0 above 0; how far to go back from behind a surface, at first softly.
float pushBack(float distance, float ease) {
  if (distance >= 0) return 0;
  const float behind = -distance;
  return behind < ease ? behind * behind / (2 * ease) : behind - ease / 2;
}

}  // namespace

double LipGuard::narrowestGap(const MarkerPositions& points) const {
  double narrowest = std::numeric_limits<double>::infinity();
  for (const LipPair& pair : pairs_)
    narrowest = std::min(narrowest, (points.row(pair.upper_rim) - points.row(pair.lower_rim)).norm());
  return narrowest;
}

void LipGuard::findNearTeeth(const TeethShell& shell, const std::vector<ToothWatch>& watches, const Moved& with,
                             const float* out, std::vector<const ToothWatch*>& near) {
  near.clear();
  for (const ToothWatch& watch : watches) {
    const Vector3f p = with.back(Eigen::Map<const Vector3f>(out + 3 * std::size_t{watch.vertex}));
    if ((p - watch.rest).squaredNorm() >= watch.free && shell.mayTouch(p)) near.push_back(&watch);
  }
}

void LipGuard::findNearLips(const float* out, std::vector<const LipWatch*>& near) const {
  const auto at = [out](std::uint32_t v) { return Eigen::Map<const Vector3f>(out + 3 * std::size_t{v}); };
  const float reach = lengthOf(kWatched), above = lengthOf(kSeenAbove);
  near.clear();
  for (const LipWatch& watch : lips_) {
    const Vector3f a = at(watch.corners[0]), ab = at(watch.corners[1]) - a, ac = at(watch.corners[2]) - a;
    const Vector3f p = watch.own.in(out)-a - watch.weights[0] * ab - watch.weights[1] * ac, across = ab.cross(ac);
    const float over = p.dot(across);
    if (p.squaredNorm() > 2 * reach * reach || (over > 0 && over * over > above * above * across.squaredNorm()))
      continue;
    near.push_back(&watch);
  }
}

/// The largest push. Watches that are far from the other lip leave `near`. Of what several watches push a vertex by the
/// most counts.
float LipGuard::partLips(float share, float ease, std::vector<const LipWatch*>& near, float* out) const {
  thread_local std::vector<std::pair<std::uint32_t, Vector3f>> pushes;
  pushes.clear();
  pushes.reserve(2 * lips_.size());
  float largest = 0;
  const float far = lengthOf(kComesNear), reach = lengthOf(kWatched);
  std::erase_if(near, [&](const LipWatch* watch) {
    const LipWatch::Sight sight = watch->look(out, reach);
    const float push =
        watch->firm * share * pushBack(sight.distance + watch->unsure * sight.aside - watch->allowed, ease);
    if (push > 0) {
      const float there = watch->own.along, here = 1 - there, both = push / (here * here + there * there);
      pushes.emplace_back(watch->own.ends[0], here * both * sight.away);
      if (there > 0) pushes.emplace_back(watch->own.ends[1], there * both * sight.away);
    }
    largest = std::max(largest, push);
    return sight.distance > far;
  });
  std::sort(pushes.begin(), pushes.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second.squaredNorm() > b.second.squaredNorm();
  });
  for (std::size_t i = 0; i < pushes.size(); ++i) {
    if (i > 0 && pushes[i].first == pushes[i - 1].first) continue;
    Eigen::Map<Vector3f>(out + 3 * std::size_t{pushes[i].first}) += pushes[i].second;
  }
  return largest;
}

/// The largest push out of this row of teeth, which has gone along with `with`. Watches outside leave `near`.
float LipGuard::leaveTeeth(const TeethShell& shell, std::vector<const ToothWatch*>& near, const Moved& with, float ease,
                           float* out) const {
  const float deepest = lengthOf(kDeepInTeeth);
  float largest = 0;
  std::erase_if(near, [&](const ToothWatch* watch) {
    Eigen::Map<Vector3f> p(out + 3 * std::size_t{watch->vertex});
    const TeethShell::Depth depth = shell.depthAt(with.back(p), deepest + watch->allowed, watch->around_edge != 0);
    if (depth.depth <= watch->allowed) return true;
    const float push = pushBack(watch->allowed - depth.depth, ease);
    p += push * (with.turn * depth.out);
    largest = std::max(largest, push);
    return false;
  });
  return largest;
}

/// How far the lips of a pair are shut: not where they have opened, are kept apart, or the lower one is at the teeth.
float LipGuard::shutShare(const LipGap& gap) const {
  return asFloat((1 - gap.opened) * (1 - smoothStep(gap.tuck)) *
                 (1 - smoothStep(gap.least / (kKeptApart * mouth_width_))));
}

std::array<float, LipGuard::kColumns> LipGuard::gapsSeen(std::span<const LipWatch* const> watches,
                                                         const float* out) const {
  std::array<float, kColumns> gaps;
  gaps.fill(std::numeric_limits<float>::infinity());
  std::array<bool, kColumns> has{};
  for (const std::uint32_t column : watched_columns_) has[column] = true;
  const float reach = lengthOf(kWatched);
  for (const LipWatch* watch : watches) {
    if (!watch->own.isVertex()) continue;
    const LipWatch::Sight sight = watch->look(out, reach);
    gaps[watch->column] = std::min(gaps[watch->column], sight.distance + kUnsure * sight.aside);
  }
  // Coarse lips have no vertex in some columns.
  for (std::size_t c = 0; c < kColumns; ++c) {
    if (has[c]) continue;
    std::size_t before = c, after = c;
    while (before > 0 && !has[before]) --before;
    while (after + 1 < kColumns && !has[after]) ++after;
    if (!has[before] || !has[after]) continue;
    const float share = asFloat(c - before) / asFloat(after - before);
    gaps[c] = (1 - share) * gaps[before] + share * gaps[after];
  }
  return gaps;
}

template <typename Of>
auto LipGuard::inColumns(const Of& of) const -> std::array<float, kColumns> {
  std::array<float, kColumns> all;
  for (std::size_t c = 0; c < kColumns; ++c) {
    const float column = middleOf(c);
    const auto next = std::upper_bound(pair_columns_.begin(), pair_columns_.end(), column) - pair_columns_.begin();
    const std::size_t before = unsignedIndex(std::max<std::ptrdiff_t>(next - 1, 0));
    const std::size_t after = std::min(unsignedIndex(next), pairs_.size() - 1);
    const float span = pair_columns_[after] - pair_columns_[before];
    const float weight = span > 0 ? (column - pair_columns_[before]) / span : 0;
    all[c] = of(before) * (1 - weight) + of(after) * weight;
  }
  return all;
}

/// 1 but where the lower lip goes to the teeth.
auto LipGuard::untucked(std::span<const LipGap> gaps) const -> std::array<float, kColumns> {
  return inColumns([&](std::size_t pair) { return asFloat(1 - smoothStep(gaps[pair].tuck)); });
}

/// Whatever is near: a way that set in with the first watch would be a jump.
void LipGuard::level(const MarkerPositions& points, std::span<const LipGap> gaps, float* out) const {
  if (levelled_.empty()) return;
  const auto tight = untucked(gaps);
  const auto rim_gaps = inColumns([&](std::size_t pair) {
    return asFloat((points.row(pairs_[pair].upper_rim) - points.row(pairs_[pair].lower_rim)).norm());
  });
  for (const Levelled& vertex : levelled_) {
    const float fade = kLevelledWithin * std::abs(vertex.way);
    out[3 * std::size_t{vertex.vertex} + 1] +=
        tight[vertex.column] * asFloat(1 - smoothStep(double{rim_gaps[vertex.column] / fade})) * vertex.way;
  }
}

/// Lips that touch may still be a little apart on the mesh, whose rims the control surface knows at five places only:
/// each column's narrowest place is closed, as far as `gaps` say that the lips touch there.
void LipGuard::drawTogether(const MarkerPositions& points, std::span<const LipGap> gaps,
                            const std::vector<const LipWatch*>& near, float* out) const {
  Eigen::Vector3d lips = Eigen::Vector3d::Zero();
  for (const LipPair& pair : pairs_)
    lips += (points.row(pair.upper_marker) - points.row(pair.lower_marker)).transpose();
  const Vector3f up = lips.normalized().cast<float>();
  const std::array<float, kColumns> shut = inColumns([&](std::size_t pair) { return shutShare(gaps[pair]); });
  std::array<float, kColumns> pull;
  pull.fill(1);
  for (int sweep = 0; sweep < kDrawingSweeps; ++sweep) {
    std::array<float, kColumns> way = gapsSeen(near, out);
    float farthest = 0;
    for (std::size_t c = 0; c < kColumns; ++c) {
      // What is further apart than lips that touch ever are is not drawn: the pull fades out.
      const double apart = double{way[c] - drawn_further_[c]} / mouth_width_;
      pull[c] =
          std::min(pull[c], shut[c] * asFloat(1 - smoothStep((apart - kDrawnWhole) / (kSeenAbove - kDrawnWhole))));
      way[c] = pull[c] > 0 ? pull[c] * std::max(0.0F, way[c] - resting_gaps_[c]) : 0;
      farthest = std::max(farthest, way[c]);
    }
    if (farthest < kStill * mouth_width_) return;
    for (const Drawn& vertex : drawn_) {
      const float far = (1 - vertex.next) * way[vertex.column] + vertex.next * way[vertex.column + 1];
      Eigen::Map<Vector3f>(out + 3 * std::size_t{vertex.vertex}) += vertex.share * far * up;
    }
  }
}

void LipGuard::separate(const MarkerPositions& points, std::span<const LipGap> gaps, const AddedMotion& jaw,
                        float* out) const {
  const float ease = lengthOf(kEase);
  const double apart = narrowestGap(points) / (kFarApart * mouth_width_);
  const bool may_touch = apart < 1 && !lips_.empty();
  thread_local std::vector<const LipWatch*> near;
  thread_local std::vector<const ToothWatch*> near_upper_teeth, near_lower_teeth;
  near.clear();
  near.reserve(lips_.size());
  near_upper_teeth.reserve(at_upper_teeth_.size());
  near_lower_teeth.reserve(at_lower_teeth_.size());
  if (!gaps.empty()) level(points, gaps, out);
  if (may_touch) findNearLips(out, near);
  if (!gaps.empty() && !near.empty()) drawTogether(points, gaps, near, out);
  const Moved still_head,
      lower_jaw{true, Eigen::Matrix3f::Identity() + jaw.turn.cast<float>(), jaw.shift.cast<float>()};
  findNearTeeth(upper_teeth_, at_upper_teeth_, still_head, out, near_upper_teeth);
  findNearTeeth(lower_teeth_, at_lower_teeth_, lower_jaw, out, near_lower_teeth);
  const float share = asFloat(0.5 * (1 - smoothStep(2 * apart - 1)));
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    const float of_lips = partLips(share, ease, near, out);
    const float of_upper_teeth = leaveTeeth(upper_teeth_, near_upper_teeth, still_head, ease, out);
    const float of_lower_teeth = leaveTeeth(lower_teeth_, near_lower_teeth, lower_jaw, ease, out);
    if (std::max({of_lips, of_upper_teeth, of_lower_teeth}) < kStill * mouth_width_) break;
  }
}

void LipGuard::leaveTeeth(const AddedMotion& jaw, float* out) const {
  thread_local std::vector<const ToothWatch*> near;
  near.reserve(std::max(at_upper_teeth_.size(), at_lower_teeth_.size()));
  const float ease = lengthOf(kEase);
  const auto leave = [&](const TeethShell& shell, const std::vector<ToothWatch>& watches, const Moved& with) {
    findNearTeeth(shell, watches, with, out, near);
    for (int sweep = 0; sweep < kSweeps && leaveTeeth(shell, near, with, ease, out) >= kStill * mouth_width_; ++sweep) {
    }
  };
  leave(upper_teeth_, at_upper_teeth_, {});
  leave(lower_teeth_, at_lower_teeth_,
        {true, Eigen::Matrix3f::Identity() + jaw.turn.cast<float>(), jaw.shift.cast<float>()});
}

void LipGuard::meet(const MarkerPositions& points, std::span<const LipGap> gaps, float* out) const {
  if (!meeting_) return;
  // Along the lips' own direction: rims that have slid along each other touch.
  const auto apart = inColumns([&](std::size_t i) {
    const LipPair& pair = pairs_[i];
    const Eigen::RowVector3d up = (points.row(pair.upper_marker) - points.row(pair.lower_marker)).normalized();
    return asFloat(std::max(0.0, (points.row(pair.upper_rim) - points.row(pair.lower_rim)).dot(up)));
  });
  std::array<float, kColumns> may_shut{};
  if (!gaps.empty()) may_shut = untucked(gaps);
  meeting_->meet({may_shut, apart}, 1 - smoothStep(2 * narrowestGap(points) / (kFarApart * mouth_width_) - 1), out);
}

}  // namespace mouthpiece
