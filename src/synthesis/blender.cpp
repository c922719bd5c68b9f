#include "synthesis/blender.h"

#include <algorithm>
#include <cmath>

namespace mouthpiece {
namespace {

/// Where one of two poses was not seen, the other stands for both.
void fillFromEachOther(PositionMatrix& a, PositionMatrix& b) {
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    double& first = a.data()[i];
    double& second = b.data()[i];
    if (std::isnan(first)) first = second;
    if (std::isnan(second)) second = first;
  }
}

/// Columns that no phone moves: lids blink and brows rise when they will. A cut through such a movement shows, so they
/// are blended over longer than the lips.
std::vector<bool> upperFaceColumns(const MarkerLayout& layout) {
  std::vector<bool> upper;
  for (const LayoutMarker& marker : layout.markers) {
    const bool is_upper = marker.region == "forehead" || marker.region == "temple" || marker.region == "brow" ||
                          marker.region == "lid" || marker.region == "canthus";
    upper.insert(upper.end(), 3, is_upper);
  }
  return upper;
}

/// Rows of `times` that begin at or after `time`.
std::size_t rowFrom(std::span<const Seconds> times, Seconds time) {
  return static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), time) - times.begin());
}

/// One fragment's poses, led towards its neighbours.
PositionMatrix ledPoses(const std::vector<UnitFragment>& fragments, std::size_t i,
                        const std::vector<JoinOffset>& offsets, std::span<const Seconds> times) {
  PositionMatrix poses = fragments[i].fragment.posesAt(times);
  if (offsets.empty()) return poses;
  for (std::size_t k = 0; k < times.size(); ++k) {
    auto row = poses.row(static_cast<Eigen::Index>(k));
    if (i > 0 && times[k] < offsets[i - 1].time + offsets[i - 1].reach_after)
      row += offsets[i - 1].shiftOfAfter(times[k]);
    if (i < offsets.size() && times[k] > offsets[i].time - offsets[i].reach_before)
      row += offsets[i].shiftOfBefore(times[k]);
  }
  return poses;
}

/// Eq. (2), the upper face over its own, longer stretch.
PositionMatrix blendJoin(PositionMatrix before, PositionMatrix after, std::span<const Seconds> times,
                         const JoinSpans& join, BlendKind blend, const std::vector<bool>& upper) {
  fillFromEachOther(before, after);
  const PositionMatrix lips = blendRows(before, after, times, join.lips, blend);
  PositionMatrix blended = blendRows(before, after, times, join.upper_face, blend);
  for (std::size_t column = 0; column < upper.size(); ++column) {
    const auto at = static_cast<Eigen::Index>(column);
    if (!upper[column]) blended.col(at) = lips.col(at);
  }
  return blended;
}

}  // namespace

PositionMatrix blendFragments(const std::vector<UnitFragment>& fragments, const std::vector<JoinSpans>& joins,
                              const std::vector<JoinOffset>& offsets, std::span<const Seconds> times, BlendKind blend,
                              const MarkerLayout& layout) {
  const std::vector<bool> upper = upperFaceColumns(layout);
  PositionMatrix result(static_cast<Eigen::Index>(times.size()), static_cast<Eigen::Index>(upper.size()));
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    // The stretch over which the upper face is blended holds that of the lips.
    const std::size_t begin = i == 0 ? 0 : rowFrom(times, joins[i - 1].upper_face.start);
    const std::size_t end = i + 1 == fragments.size() ? times.size() : rowFrom(times, joins[i].upper_face.end);
    if (begin >= end) continue;
    const PositionMatrix poses = ledPoses(fragments, i, offsets, times.subspan(begin, end - begin));
    const std::size_t blended_end =
        i == 0 ? begin : std::clamp(rowFrom(times, joins[i - 1].upper_face.end), begin, end);
    const auto first = static_cast<Eigen::Index>(begin);
    const auto blended = static_cast<Eigen::Index>(blended_end - begin);
    const auto rest = static_cast<Eigen::Index>(end - blended_end);
    if (blended > 0) {
      result.middleRows(first, blended) =
          blendJoin(result.middleRows(first, blended), poses.topRows(blended),
                    times.subspan(begin, blended_end - begin), joins[i - 1], blend, upper);
    }
    result.middleRows(first + blended, rest) = poses.bottomRows(rest);
  }
  return result;
}

}  // namespace mouthpiece
