#include <algorithm>

#include "base/index.h"
#include "synthesis/join.h"
#include "synthesis/stages.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {
namespace {

constexpr Seconds kContactRamp = 0.040;  ///< withContacts() closes and opens within it
constexpr Seconds kIntoCapture = 0.080;  ///< how far beyond the shared phone a blend may lie, beside a contact
constexpr Seconds kOffsetReach = 0.4;

/// Where captured motion gives way to curves in the phone that both share, or curves to captured motion.
TimeSpan placeBlend(const SpeechLabels& labels, PhoneIndex phone, bool curves_follow, Seconds overlap) {
  const LabelledPhone& shared = labels.phones[phone.value];
  const TimeSpan& span = shared.span;
  if (shared.phone == Phone::kSil) {  // not far from the speech that the curves make
    const Seconds away = std::min(kLongestInSilence, 0.5 * span.duration());
    return centred(curves_follow ? span.end - away : span.start + away,
                   std::min(kLongestInSilence, kPartOfSilence * span.duration()));
  }
  const Seconds length = std::min(overlap, std::max(kPartOfPhone * span.duration(), 0.5 * overlap));
  // A contact that the curves make needs time to close or open, of which the capture knows nothing.
  const LabelledPhone& made = labels.phones[curves_follow ? phone.value + 1 : phone.value - 1];
  Seconds middle = span.middle();
  if (isBilabial(made.phone) || isLabiodental(made.phone)) {
    const Seconds away = kContactRamp + 0.5 * length;
    middle = curves_follow ? std::clamp(made.span.start - away, span.start - kIntoCapture, middle)
                           : std::clamp(made.span.end + away, middle, span.end + kIntoCapture);
  }
  return centred(middle, length);
}

/// The blends at both ends of captured motion. Where they would cross, they share the room.
void placeBlends(const LineToRender& line, Stretch& stretch) {
  const PhoneRange& phones = stretch.phones;
  if (phones.first.value > 0) stretch.enters = placeBlend(line.labels, phones.first, false, line.overlap());
  if (phones.last.value + 1 < line.labels.phones.size())
    stretch.leaves = placeBlend(line.labels, phones.last, true, line.overlap());
  if (!stretch.enters || !stretch.leaves || stretch.enters->end <= stretch.leaves->start) return;
  const TimeSpan whole = line.labels.spanOf(phones);
  const Seconds quarter = 0.25 * whole.duration();
  stretch.enters = centred(whole.start + quarter, quarter);
  stretch.leaves = centred(whole.end - quarter, quarter);
}

/// The frames within a stretch's blends and one more on either side.
void placeFrames(const std::vector<Seconds>& times, Stretch& stretch) {
  const Seconds start = stretch.enters ? stretch.enters->start : times.front();
  const Seconds end = stretch.leaves ? stretch.leaves->end : times.back();
  const auto first = std::lower_bound(times.begin(), times.end(), start) - times.begin();
  const auto last = std::upper_bound(times.begin(), times.end(), end) - times.begin();
  stretch.first_frame = unsignedIndex(std::max<Eigen::Index>(0, first - 1));
  stretch.end_frame = std::min(times.size(), unsignedIndex(last) + 1);
}

/// Straight between the rows around `time`.
Eigen::RowVectorXd poseAt(const PositionMatrix& poses, std::span<const Seconds> times, Seconds time) {
  if (times.size() == 1) return poses.row(0);
  const auto next = std::upper_bound(times.begin(), times.end(), time) - times.begin();
  const Eigen::Index at = std::clamp<Eigen::Index>(next, 1, std::ssize(times) - 1);
  const Seconds t0 = times[unsignedIndex(at - 1)], t1 = times[unsignedIndex(at)];
  const double u = std::clamp((time - t0) / (t1 - t0), 0.0, 1.0);
  return (1 - u) * poses.row(at - 1) + u * poses.row(at);
}

/// Displacements that curves make.
PositionMatrix drawnMotion(const CurveSet& curves, std::span<const Seconds> times, const LineToRender& line) {
  return displacementsFromCurves(curves, line.model.poses(), line.style.ja, line.style.li,
                                 {times.begin(), times.end()});
}

/// A gap's neighbour, rendered, and the blend with it.
struct Neighbour {
  const Stretch& stretch;
  const PositionMatrix& positions_mm;
  TimeSpan blend;
  double into_gap;  ///< the sign of time on the way from the blend into the gap: 1 behind the neighbour, -1 before it

  /// How much of it shows.
  [[nodiscard]] double shareAt(Seconds time, BlendKind kind) const {
    const double first = blendWeight(kind, (time - blend.start) / std::max(blend.duration(), 1e-9));
    return into_gap > 0 ? first : 1 - first;
  }
};

/// Calls visit(frame) for the frames of the line that both have.
template <typename Visit>
void forCommonFrames(const Stretch& a, const Stretch& b, const Visit& visit) {
  const std::size_t end = std::min(a.end_frame, b.end_frame);
  for (std::size_t frame = std::max(a.first_frame, b.first_frame); frame < end; ++frame) visit(frame);
}

/// The poses that the curves make in a gap, led to what its neighbours captured at the middles of the blends, and
/// blended with them.
PositionMatrix drawGap(const Stretch& gap, const std::vector<Neighbour>& sides, const LineToRender& line) {
  const std::span<const Seconds> times = line.timesOf(gap);
  const PositionMatrix drawn = drawnMotion(line.curves, times, line);
  Seconds reach = kOffsetReach;
  if (sides.size() == 2) reach = std::min(reach, sides[1].blend.middle() - sides[0].blend.middle());
  reach = std::max(reach, 1e-3);
  PositionMatrix poses = drawn;
  for (const Neighbour& side : sides) {
    const Seconds join = side.blend.middle();
    const Eigen::RowVectorXd captured = poseAt(side.positions_mm, line.timesOf(side.stretch), join);
    const Eigen::RowVectorXd offset = captured - line.rest() - poseAt(drawn, times, join);
    for (std::size_t k = 0; k < times.size(); ++k)
      poses.row(signedIndex(k)) += blendWeight(BlendKind::kSmooth, side.into_gap * (times[k] - join) / reach) * offset;
  }
  poses = withContacts(line.curves, line.model.poses(), {times.begin(), times.end()}, std::move(poses));
  poses.rowwise() += line.rest();
  for (const Neighbour& side : sides) {
    forCommonFrames(gap, side.stretch, [&](std::size_t frame) {
      const double captured = side.shareAt(line.times[frame], line.options.blend);
      auto row = poses.row(signedIndex(frame - gap.first_frame));
      row = captured * side.positions_mm.row(signedIndex(frame - side.stretch.first_frame)) + (1 - captured) * row;
    });
  }
  return poses;
}

/// How much of a consonant's captured motion shows at each time: (1 - Ma) over the phone, coming and going in 60 ms.
Eigen::VectorXd consonantWeights(const LineToRender& line) {
  constexpr Seconds kFade = 0.060;
  const std::vector<Seconds>& times = line.times;
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(std::ssize(times));
  for (const LabelledPhone& phone : line.labels.phones) {
    if (phone.phone == Phone::kSil || isVowel(phone.phone)) continue;
    const auto first = std::lower_bound(times.begin(), times.end(), phone.span.start - kFade);
    for (auto time = first; time != times.end() && *time < phone.span.end + kFade; ++time) {
      const Seconds outside = std::max({0.0, phone.span.start - *time, *time - phone.span.end});
      double& weight = weights[time - times.begin()];
      weight = std::max(weight, (1 - line.style.ma.at(*time)) * blendWeight(BlendKind::kSmooth, outside / kFade));
    }
  }
  return weights;
}

}  // namespace

std::vector<Stretch> stretchesOf(const SynthesisPlan& plan, const LineToRender& line) {
  std::vector<Stretch> stretches;
  for (const Segment& segment : plan.segments) {
    const bool goes_on = !stretches.empty() && stretches.back().units.empty() == !segment.unit;
    if (!goes_on) stretches.push_back({segment.phones, {}, {}, {}});
    stretches.back().phones.last = segment.phones.last;
    if (segment.unit) stretches.back().units.push_back(*segment.unit);
  }
  for (Stretch& stretch : stretches) {
    if (!stretch.units.empty()) placeBlends(line, stretch);
  }
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    Stretch& own = stretches[i];
    if (own.units.empty() && i > 0) own.enters = stretches[i - 1].leaves;
    if (own.units.empty() && i + 1 < stretches.size()) own.leaves = stretches[i + 1].enters;
    placeFrames(line.times, own);
  }
  return stretches;
}

StretchMotion fillWithCurves(const std::vector<Stretch>& stretches, std::vector<StretchMotion> captured,
                             const LineToRender& line) {
  if (stretches.size() == 1 && !stretches[0].units.empty()) return std::move(captured[0]);
  StretchMotion whole{line.rest().replicate(std::ssize(line.times), 1),
                      {},
                      MovementParts::none(std::ssize(line.times), std::ssize(line.database.lipColumns()))};
  const auto lay = [&](const Stretch& stretch, const PositionMatrix& positions_mm) {
    whole.positions_mm.middleRows(signedIndex(stretch.first_frame), positions_mm.rows()) = positions_mm;
  };
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    if (stretches[i].units.empty()) continue;
    lay(stretches[i], captured[i].positions_mm);
    whole.parts.lay(stretches[i].first_frame, captured[i].parts);
    whole.joins.insert(whole.joins.end(), captured[i].joins.begin(), captured[i].joins.end());
  }
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const Stretch& gap = stretches[i];
    if (!gap.units.empty()) continue;
    std::vector<Neighbour> sides;
    if (gap.enters) sides.push_back({stretches[i - 1], captured[i - 1].positions_mm, *gap.enters, 1});
    if (gap.leaves) sides.push_back({stretches[i + 1], captured[i + 1].positions_mm, *gap.leaves, -1});
    for (const Neighbour& side : sides) whole.joins.push_back(side.blend.middle());
    lay(gap, drawGap(gap, sides, line));
    for (const Neighbour& side : sides) {
      forCommonFrames(gap, side.stretch, [&](std::size_t frame) {
        whole.parts.scaleFrame(frame, side.shareAt(line.times[frame], line.options.blend));
      });
    }
  }
  return whole;
}

StretchMotion layerConsonants(StretchMotion captured, const LineToRender& line) {
  const Stretch everything{{}, {}, {}, {}, 0, line.times.size()};
  const PositionMatrix vowels = drawGap(everything, {}, line);
  const Eigen::VectorXd weights = consonantWeights(line);
  // Lids and brows are nobody's consonants: they move as they were captured, all along.
  const std::vector<bool> upper = upperFaceColumns(line.database.corpus().layout);
  for (std::size_t i = 0; i < upper.size(); ++i) {
    const auto column = signedIndex(i);
    if (upper[i]) continue;
    captured.positions_mm.col(column) =
        vowels.col(column) + weights.cwiseProduct(captured.positions_mm.col(column) - vowels.col(column));
  }
  for (std::size_t frame = 0; frame < line.times.size(); ++frame)
    captured.parts.scaleFrame(frame, weights(signedIndex(frame)));
  return captured;
}

PositionMatrix withCurveEdits(PositionMatrix positions, const CurveSet& edited, const LineToRender& line) {
  if (edited != line.curves && line.model.isPossible())
    positions += drawnMotion(edited, line.times, line) - drawnMotion(line.curves, line.times, line);
  return positions;
}

}  // namespace mouthpiece
