#include "synthesis/join_offset.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "motion/blend.h"

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

}  // namespace mouthpiece
