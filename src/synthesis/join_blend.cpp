#include <algorithm>
#include <array>
#include <cmath>

#include "base/index.h"
#include "synthesis/join.h"

namespace mouthpiece {
namespace {

constexpr Seconds kReach = 0.100;
constexpr Seconds kLeastRoom = 0.020;  ///< both sides together; leading faster than that would itself be a jerk

bool hasContact(Phone phone) { return isBilabial(phone) || isLabiodental(phone); }

/// Keeps the reaches out of the phones whose contact they would loosen.
void stayOffContacts(const SpeechLabels& line, JoinOffset& offset) {
  for (const LabelledPhone& phone : line.phones) {
    if (!hasContact(phone.phone)) continue;
    if (phone.span.start < offset.time) {
      offset.reach_before = std::min(offset.reach_before, std::max(0.0, offset.time - phone.span.end));
    }
    if (phone.span.end > offset.time) {
      offset.reach_after = std::min(offset.reach_after, std::max(0.0, phone.span.start - offset.time));
    }
  }
}

Eigen::RowVectorXd poseAt(const Fragment& fragment, Seconds time) {
  const std::array<Seconds, 1> times{time};
  return fragment.posesAt(times).row(0);
}

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

/// The first row of `times` that begins at or after `time`.
Eigen::Index rowFrom(std::span<const Seconds> times, Seconds time) {
  return std::lower_bound(times.begin(), times.end(), time) - times.begin();
}

std::span<const Seconds> part(std::span<const Seconds> times, Eigen::Index begin, Eigen::Index end) {
  return {times.begin() + begin, times.begin() + end};
}

/// One fragment's poses, led towards its neighbours.
PositionMatrix ledPoses(const std::vector<UnitFragment>& fragments, std::size_t i,
                        const std::vector<JoinOffset>& offsets, std::span<const Seconds> times) {
  PositionMatrix poses = fragments[i].fragment.posesAt(times);
  if (offsets.empty()) return poses;
  for (std::size_t k = 0; k < times.size(); ++k) {
    auto row = poses.row(signedIndex(k));
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
    if (!upper[column]) blended.col(signedIndex(column)) = lips.col(signedIndex(column));
  }
  return blended;
}

}  // namespace

Eigen::RowVectorXd JoinOffset::shiftOfBefore(Seconds at) const {
  const Seconds room = reach_before + reach_after;
  if (room < kLeastRoom || reach_before <= 0) return Eigen::RowVectorXd::Zero(offset_mm.size());
  return reach_before / room * blendWeight(BlendKind::kSmooth, (time - at) / reach_before) * offset_mm;
}

Eigen::RowVectorXd JoinOffset::shiftOfAfter(Seconds at) const {
  const Seconds room = reach_before + reach_after;
  if (room < kLeastRoom || reach_after <= 0) return Eigen::RowVectorXd::Zero(offset_mm.size());
  return -reach_after / room * blendWeight(BlendKind::kSmooth, (at - time) / reach_after) * offset_mm;
}

std::vector<JoinOffset> findJoinOffsets(const SpeechLabels& line, const std::vector<UnitFragment>& fragments,
                                        const std::vector<JoinSpans>& joins) {
  std::vector<JoinOffset> offsets;
  for (std::size_t i = 0; i < joins.size(); ++i) {
    JoinOffset offset;
    offset.time = joins[i].lips.middle();
    // A fragment that is joined at both ends keeps room for both.
    const Seconds room_before = i > 0 ? offset.time - joins[i - 1].lips.middle() : kReach;
    const Seconds room_after = i + 1 < joins.size() ? joins[i + 1].lips.middle() - offset.time : kReach;
    offset.reach_before = std::clamp(room_before, 0.0, kReach);
    offset.reach_after = std::clamp(room_after, 0.0, kReach);
    stayOffContacts(line, offset);
    offset.offset_mm = poseAt(fragments[i + 1].fragment, offset.time) - poseAt(fragments[i].fragment, offset.time);
    offset.offset_mm = offset.offset_mm.unaryExpr([](double mm) { return std::isfinite(mm) ? mm : 0.0; });
    offsets.push_back(std::move(offset));
  }
  return offsets;
}

PositionMatrix blendFragments(const std::vector<UnitFragment>& fragments, const std::vector<JoinSpans>& joins,
                              const std::vector<JoinOffset>& offsets, std::span<const Seconds> times, BlendKind blend,
                              const MarkerLayout& layout) {
  const std::vector<bool> upper = upperFaceColumns(layout);
  const Eigen::Index frames = std::ssize(times);
  PositionMatrix result(frames, std::ssize(upper));
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    // The stretch over which the upper face is blended holds that of the lips.
    const Eigen::Index begin = i == 0 ? 0 : rowFrom(times, joins[i - 1].upper_face.start);
    const Eigen::Index end = i + 1 == fragments.size() ? frames : rowFrom(times, joins[i].upper_face.end);
    if (begin >= end) continue;
    const PositionMatrix poses = ledPoses(fragments, i, offsets, part(times, begin, end));
    const Eigen::Index blended_end =
        i == 0 ? begin : std::clamp(rowFrom(times, joins[i - 1].upper_face.end), begin, end);
    const Eigen::Index blended = blended_end - begin;
    if (blended > 0) {
      result.middleRows(begin, blended) = blendJoin(result.middleRows(begin, blended), poses.topRows(blended),
                                                    part(times, begin, blended_end), joins[i - 1], blend, upper);
    }
    result.middleRows(blended_end, end - blended_end) = poses.bottomRows(end - blended_end);
  }
  return result;
}

}  // namespace mouthpiece
