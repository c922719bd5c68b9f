#include "synthesis/join.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/index.h"
#include "synthesis/stages.h"

namespace mouthpiece {
namespace {

constexpr double kCaptureFramesInBlend =
    2.5;  ///< at least, whatever the overlap asked for: a slow capture has no more to blend
constexpr Seconds kUpperFaceOverlap = 0.240;

Seconds blendLength(Seconds phone, double capture_rate_hz, Seconds overlap) {
  if (overlap <= 0) return 0;
  return std::max(std::min(overlap, kPartOfPhone * phone), kCaptureFramesInBlend / capture_rate_hz);
}

/// Mean squared distance of the lips over a blend, mm^2, with a mild preference for the middle of the phone.
double disagreement(const Fragment& before, const Fragment& after, TimeSpan blend) {
  double sum = 0;
  for (const double u : {0.25, 0.5, 0.75}) {
    const Seconds time = std::lerp(blend.start, blend.end, u);
    sum += (before.lipsAt(time) - after.lipsAt(time)).squaredNorm();
  }
  return sum / (asReal(before.lipsAt(blend.start).size()) + 1);
}

/// Anywhere but at the very ends of the phone, over `length` to twice that.
TimeSpan searchCoupling(const LabelledPhone& phone, const Fragment& before, const Fragment& after, Seconds length,
                        std::optional<Seconds> sound_cut) {
  constexpr double kMargin = 0.1;  // of the phone
  const std::array<Seconds, 3> lengths{length, 1.5 * length, 2 * length};
  const Seconds margin = kMargin * phone.span.duration();
  TimeSpan middles{phone.span.start + margin, phone.span.end - margin};
  if (sound_cut) middles.start = middles.end = std::clamp(*sound_cut, middles.start, middles.end);
  return cheapestCoupling(before, after, {middles, lengths});
}

TimeSpan placeLipJoin(const LabelledPhone& phone, const Fragment& before, const Fragment& after,
                      const JoinOptions& options) {
  const PhoneIndex shared = after.phones().first;
  const Seconds length = std::max(
      blendLength(phone.span.duration(), std::min(before.captureRateHz(), after.captureRateHz()), options.overlap),
      std::min(options.overlap, 2 / options.frame_rate_hz));
  const Seconds room = std::max(0.0, phone.span.duration() - length);
  const auto at = [&](double u) {
    const Seconds middle = phone.span.middle() + (u - 0.5) * room;
    return centred(middle, length);
  };
  // A stand-in that plays another phone gives way to the real one as soon as it can.
  const bool before_is_strange = before.sourcePhone(shared).phone != phone.phone;
  const bool after_is_strange = after.sourcePhone(shared).phone != phone.phone;
  if (before_is_strange != after_is_strange) return at(before_is_strange ? 0 : 1);
  if (options.search_coupling && length > 0) return searchCoupling(phone, before, after, length, options.sound_cut);
  TimeSpan best = at(0.5);
  double least = disagreement(before, after, best);
  constexpr double kOffCentre = 1.1;  // a place off the middle must be that much better
  for (const double u : {0.375, 0.625, 0.25, 0.75, 0.125, 0.875, 0.0, 1.0}) {
    const double found = kOffCentre * disagreement(before, after, at(u));
    if (found < least) {
      least = found;
      best = at(u);
    }
  }
  return best;
}

/// EDGE 5.1.3: "always a fraction of the smallest phone-to-phone interval", here a half of the shortest of the shared
/// phone and its neighbours.
TimeSpan publishedJoin(const SpeechLabels& line, PhoneIndex shared, Seconds overlap) {
  constexpr double kFraction = 0.5;
  Seconds shortest = line.phones[shared.value].span.duration();
  if (shared.value > 0) shortest = std::min(shortest, line.phones[shared.value - 1].span.duration());
  if (shared.value + 1 < line.phones.size())
    shortest = std::min(shortest, line.phones[shared.value + 1].span.duration());
  return centred(line.phones[shared.value].span.middle(), std::min(overlap, kFraction * shortest));
}

/// What both fragments may show of the pause, so that neither has to hold still within the blend.
TimeSpan placeSilentJoin(const LabelledPhone& phone, const LabelledPhone& before, const LabelledPhone& after) {
  const Seconds captured = std::min(before.span.duration(), after.span.duration());
  return centred(phone.span.middle(),
                 std::min(kLongestInSilence, kPartOfSilence * std::min(phone.span.duration(), captured)));
}

/// Where the sound goes over from one unit to the next; none where another voice speaks.
std::optional<Seconds> soundCut(const SelectedUnit& before, const SelectedUnit& after) {
  constexpr Seconds kRounding = 1e-6;
  const bool both_sound = before.sound.duration() > 0 && after.sound.duration() > 0;
  if (!both_sound || std::abs(before.sound.end - after.sound.start) > kRounding) return std::nullopt;
  return before.sound.end;
}

TimeSpan notBefore(const TimeSpan& span, const TimeSpan& earlier) {
  return {std::max(span.start, earlier.start), std::max(span.end, earlier.end)};
}

/// Joins lie in the order of the line, so that each blend begins where the one before has begun.
std::vector<JoinSpans> placeJoins(const std::vector<UnitFragment>& fragments, const std::vector<SelectedUnit>& units,
                                  const LineToRender& line, bool search_coupling) {
  std::vector<JoinSpans> joins;
  for (std::size_t i = 0; i + 1 < fragments.size(); ++i) {
    const Fragment &before = fragments[i].fragment, &after = fragments[i + 1].fragment;
    const JoinOptions options{line.overlap(), line.options.frame_rate_hz, search_coupling,
                              !line.options.departures.joins_where_lips_agree,
                              soundCut(units[fragments[i].unit], units[fragments[i + 1].unit])};
    JoinSpans join = line.recent_joins != nullptr
                         ? line.recent_joins->place(line.labels, line.origin, before, after, options)
                         : placeJoin(line.labels, before, after, options);
    if (!joins.empty()) {
      join.lips = notBefore(join.lips, joins.back().lips);
      join.upper_face = notBefore(join.upper_face, joins.back().upper_face);
    }
    joins.push_back(join);
  }
  return joins;
}

constexpr Seconds kSpacing = 0.010;  ///< of the times at which the fragments are compared
constexpr Seconds kStep = 0.020;     ///< over which a velocity is read

/// The columns without gaps.
PositionMatrix seenThroughout(const PositionMatrix& rows) {
  std::vector<Eigen::Index> seen;
  for (Eigen::Index column = 0; column < rows.cols(); ++column) {
    if (rows.col(column).allFinite()) seen.push_back(column);
  }
  return rows(Eigen::all, seen);
}

/// Lips and chin of two fragments at even times; markers that are not seen all the while do not count.
class SharedLips {
 public:
  SharedLips(const Fragment& before, const Fragment& after, const TimeSpan& span) : start_(span.start) {
    std::vector<Seconds> times;
    const auto count = static_cast<int>(std::ceil(span.duration() / kSpacing)) + 2;
    for (int i = 0; i < count; ++i) times.push_back(span.start + i * kSpacing);
    const PositionMatrix captured_before = before.capturedLipsAt(times), captured_after = after.capturedLipsAt(times);
    difference_ =
        seenThroughout(after.lipsOfCaptured(captured_after, times) - before.lipsOfCaptured(captured_before, times));
    captured_before_ = seenThroughout(captured_before);
    captured_after_ = seenThroughout(captured_after);
  }

  [[nodiscard]] double markers() const { return std::max(1.0, asReal(difference_.cols()) / 3); }

  /// after - before, mm.
  [[nodiscard]] Eigen::RowVectorXd differenceAt(Seconds time) const { return at(difference_, time); }

  /// Its change over a second.
  [[nodiscard]] Eigen::RowVectorXd velocityAt(Seconds time) const {
    return (differenceAt(time + kStep) - differenceAt(time - kStep)) / (2 * kStep);
  }

  /// How far the captured lips move in 20 ms, mm, squared, mean over the markers: of the faster one.
  [[nodiscard]] double haste(Seconds time) const {
    const auto moved = [&](const PositionMatrix& lips) {
      return (at(lips, time + kStep / 2) - at(lips, time - kStep / 2)).squaredNorm() / markers();
    };
    return std::max(moved(captured_before_), moved(captured_after_));
  }

 private:
  [[nodiscard]] Eigen::RowVectorXd at(const PositionMatrix& rows, Seconds time) const {
    const double place = std::clamp((time - start_) / kSpacing, 0.0, asReal(rows.rows() - 1));
    const auto first = static_cast<Eigen::Index>(place);
    const Eigen::Index second = std::min(first + 1, rows.rows() - 1);
    const double part = place - asReal(first);
    return (1 - part) * rows.row(first) + part * rows.row(second);
  }

  Seconds start_;
  PositionMatrix difference_, captured_before_, captured_after_;
};

/// mm^2 a marker. With d = after - before eq. (2) gives theta'' = g before'' + (1 - g) after'' - 2 g' d' - g'' d: the
/// last two terms are the join's own. The constant part of d is led away over longer than the blend (JoinOffset).
double mismatch(const SharedLips& lips, const TimeSpan& blend) {
  constexpr Seconds kComesTo =
      0.030;  // velocities count as what they come to in that time, accelerations in its square
  constexpr double kApartPerSecond = 3;  // two poses that differ are shown as their mean for that long
  constexpr int kPoints = 7;
  const Seconds length = blend.duration();
  const Eigen::RowVectorXd at_middle = lips.differenceAt(blend.middle());
  double apart = 0, added = 0;
  for (int i = 1; i <= kPoints; ++i) {
    const double u = asReal(i) / (kPoints + 1);
    const Seconds time = blend.start + u * length;
    const double g = blendWeight(BlendKind::kSmooth, u);
    const double slope = 30 * u * u * (1 - u) * (1 - u) / length;
    const double bend = 60 * u * (1 - u) * (1 - 2 * u) / (length * length);
    const Eigen::RowVectorXd difference = lips.differenceAt(time);
    apart += 4 * g * (1 - g) * difference.squaredNorm() / kPoints;
    added += (2 * slope * lips.velocityAt(time) + bend * (difference - at_middle)).squaredNorm() / kPoints;
  }
  constexpr double kSquare = kComesTo * kComesTo;
  const double velocity = kSquare * lips.velocityAt(blend.middle()).squaredNorm();
  return (kApartPerSecond * length * apart + velocity + kSquare * kSquare * added) / lips.markers() +
         lips.haste(blend.middle());
}

constexpr Seconds kReach = 0.100;
constexpr Seconds kLeastRoom = 0.020;  ///< both sides together; leading faster than that would itself be a jerk

bool hasContact(Phone phone) { return isBilabial(phone) || isLabiodental(phone); }

/// Keeps the reaches out of the phones whose contact they would loosen.
void stayOffContacts(const SpeechLabels& line, JoinOffset& offset) {
  const auto near = std::partition_point(line.phones.begin(), line.phones.end(), [&](const LabelledPhone& phone) {
    return phone.span.end < offset.time - kReach;
  });
  for (auto phone = near; phone != line.phones.end() && phone->span.start < offset.time + kReach; ++phone) {
    if (!hasContact(phone->phone)) continue;
    if (phone->span.start < offset.time) {
      offset.reach_before = std::min(offset.reach_before, std::max(0.0, offset.time - phone->span.end));
    }
    if (phone->span.end > offset.time) {
      offset.reach_after = std::min(offset.reach_after, std::max(0.0, phone->span.start - offset.time));
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

/// The first row of `times` that begins at or after `time`.
Eigen::Index rowFrom(std::span<const Seconds> times, Seconds time) {
  return std::lower_bound(times.begin(), times.end(), time) - times.begin();
}

std::span<const Seconds> part(std::span<const Seconds> times, Eigen::Index begin, Eigen::Index end) {
  return {times.begin() + begin, times.begin() + end};
}

struct FrameRange {
  Eigen::Index begin = 0, end = 0;
};
/// Where a fragment is seen: the stretch over which the upper face is blended holds that of the lips.
FrameRange rowsOf(std::size_t fragment, const std::vector<JoinSpans>& joins, std::span<const Seconds> times) {
  return {fragment == 0 ? 0 : rowFrom(times, joins[fragment - 1].upper_face.start),
          fragment == joins.size() ? std::ssize(times) : rowFrom(times, joins[fragment].upper_face.end)};
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

JoinSpans placeJoin(const SpeechLabels& line, const Fragment& before, const Fragment& after,
                    const JoinOptions& options) {
  const PhoneIndex shared = after.phones().first;
  const LabelledPhone& phone = line.phones[shared.value];
  if (options.as_published) {
    const TimeSpan join = publishedJoin(line, shared, options.overlap);
    return {join, join};
  }
  if (phone.phone == Phone::kSil) {
    const TimeSpan join = placeSilentJoin(phone, before.sourcePhone(shared), after.sourcePhone(shared));
    return {join, join};
  }
  const TimeSpan lips = placeLipJoin(phone, before, after, options);
  return {lips, centred(lips.middle(), std::max(kUpperFaceOverlap, lips.duration()))};
}

JoinSpans RecentJoins::place(const SpeechLabels& line, Seconds origin, const Fragment& before, const Fragment& after,
                             const JoinOptions& options) {
  constexpr std::size_t kMost = 32;
  if (options.sound_cut) return placeJoin(line, before, after, options);
  // Half of the longest blend, which is twice as long as is asked for or as a slow capture needs, and what is around
  // it.
  const Seconds looked_at =
      options.overlap + kCaptureFramesInBlend / std::min(before.captureRateHz(), after.captureRateHz()) + 0.1;
  const TimeSpan& shared = line.phones[after.phones().first.value].span;
  const TimeSpan seen{shared.start - looked_at, shared.end + looked_at};
  std::vector<std::int64_t> fragments;
  const auto addTime = [&](Seconds time) {
    fragments.push_back(std::llround(1e9 * (origin + std::clamp(time, seen.start, seen.end))));
  };
  for (const Fragment* fragment : {&before, &after}) {
    const PhoneRange& phones = fragment->phones();
    const PhonePlace source = fragment->source();
    addTime(fragment->usable().start);
    addTime(fragment->usable().end);
    for (std::size_t i = phones.first.value; i <= phones.last.value; ++i) {
      const LabelledPhone& phone = line.phones[i];
      if (phone.span.end < seen.start || phone.span.start > seen.end) continue;
      const PhonePlace played = advance(source, i - phones.first.value);
      fragments.insert(fragments.end(), {signedIndex(played.take.value), signedIndex(played.phone.value),
                                         static_cast<std::int64_t>(phone.phone)});
      addTime(phone.span.start);
      addTime(phone.span.end);
    }
  }
  const auto moved = [](const JoinSpans& join, Seconds by) {
    const auto movedSpan = [&](const TimeSpan& span) { return TimeSpan{span.start + by, span.end + by}; };
    return JoinSpans{movedSpan(join.lips), movedSpan(join.upper_face)};
  };
  const auto known =
      std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) { return kept.fragments == fragments; });
  if (known != kept_.end()) return moved(known->join, -origin);
  const JoinSpans join = placeJoin(line, before, after, options);
  if (kept_.size() >= kMost) kept_.erase(kept_.begin());
  kept_.push_back({std::move(fragments), moved(join, origin)});
  return join;
}

TimeSpan cheapestCoupling(const Fragment& before, const Fragment& after, const CouplingSearch& search) {
  constexpr double kOffCentre = 1.1;  // a place off the middle must be that much better
  const Seconds longest = *std::max_element(search.lengths.begin(), search.lengths.end());
  const SharedLips lips(before, after,
                        {search.middles.start - longest / 2 - kStep, search.middles.end + longest / 2 + kStep});
  TimeSpan best;
  double least = std::numeric_limits<double>::infinity();
  for (const double u : {0.5, 0.375, 0.625, 0.25, 0.75, 0.125, 0.875, 0.0, 1.0}) {
    const Seconds middle = std::lerp(search.middles.start, search.middles.end, u);
    for (const Seconds length : search.lengths) {
      const TimeSpan blend{middle - length / 2, middle + length / 2};
      const double cost = (u == 0.5 ? 1 : kOffCentre) * mismatch(lips, blend);
      if (cost < least) {
        least = cost;
        best = blend;
      }
    }
  }
  return best;
}

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

JoinRange joinsWithin(const std::vector<JoinSpans>& joins, std::span<const Seconds> times, Eigen::Index first,
                      Eigen::Index end) {
  JoinRange range{joins.size(), 0};
  for (std::size_t fragment = 0; fragment <= joins.size(); ++fragment) {
    const FrameRange rows = rowsOf(fragment, joins, times);
    if (std::max(first, rows.begin) >= std::min(end, rows.end)) continue;
    range.first = std::min(range.first, fragment == 0 ? 0 : fragment - 1);
    range.end = std::min(fragment + 1, joins.size());
  }
  return range;
}

std::vector<JoinOffset> findJoinOffsets(const SpeechLabels& line, const std::vector<UnitFragment>& fragments,
                                        const std::vector<JoinSpans>& joins, const JoinRange& range) {
  std::vector<JoinOffset> offsets(joins.size());
  // Backwards: the takes that were looked at last when the joins were placed are still in memory, and then the first.
  for (std::size_t i = std::min(range.end, joins.size()); i-- > range.first;) {
    JoinOffset& offset = offsets[i];
    offset.time = joins[i].lips.middle();
    // A fragment that is joined at both ends keeps room for both.
    const Seconds room_before = i > 0 ? offset.time - joins[i - 1].lips.middle() : kReach;
    const Seconds room_after = i + 1 < joins.size() ? joins[i + 1].lips.middle() - offset.time : kReach;
    offset.reach_before = std::clamp(room_before, 0.0, kReach);
    offset.reach_after = std::clamp(room_after, 0.0, kReach);
    stayOffContacts(line, offset);
    const Eigen::RowVectorXd after = poseAt(fragments[i + 1].fragment, offset.time);
    offset.offset_mm = after - poseAt(fragments[i].fragment, offset.time);
    offset.offset_mm = offset.offset_mm.unaryExpr([](double mm) { return std::isfinite(mm) ? mm : 0.0; });
  }
  return offsets;
}

PositionMatrix blendFragments(const std::vector<UnitFragment>& fragments, const std::vector<JoinSpans>& joins,
                              const std::vector<JoinOffset>& offsets, std::span<const Seconds> times, BlendKind blend,
                              const MarkerLayout& layout) {
  return blendFragments(fragments, joins, offsets, times, blend, layout, 0, std::ssize(times));
}

PositionMatrix blendFragments(const std::vector<UnitFragment>& fragments, const std::vector<JoinSpans>& joins,
                              const std::vector<JoinOffset>& offsets, std::span<const Seconds> times, BlendKind blend,
                              const MarkerLayout& layout, Eigen::Index first, Eigen::Index last) {
  const std::vector<bool> upper = upperFaceColumns(layout);
  PositionMatrix result(last - first, std::ssize(upper));
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    const auto [whole_begin, whole_end] = rowsOf(i, joins, times);
    const Eigen::Index begin = std::max(first, whole_begin), end = std::min(last, whole_end);
    if (begin >= end) continue;
    const PositionMatrix poses = ledPoses(fragments, i, offsets, part(times, whole_begin, whole_end));
    const Eigen::Index blended_end =
        i == 0 ? begin : std::clamp(rowFrom(times, joins[i - 1].upper_face.end), begin, end);
    const Eigen::Index blended = blended_end - begin;
    if (blended > 0) {
      result.middleRows(begin - first, blended) =
          blendJoin(result.middleRows(begin - first, blended), poses.middleRows(begin - whole_begin, blended),
                    part(times, begin, blended_end), joins[i - 1], blend, upper);
    }
    result.middleRows(blended_end - first, end - blended_end) =
        poses.middleRows(blended_end - whole_begin, end - blended_end);
  }
  return result;
}

JoinedUnits::JoinedUnits(const std::vector<SelectedUnit>& units, const LineToRender& line, bool residual)
    : blend_(line.options.blend), layout_(line.database.corpus().layout), labels_(line.labels) {
  const Departures& departures = line.options.departures;
  fragments_ = cutIntoFragments(line.labels, line.database, units, residual, !departures.silences_keep_their_pace,
                                line.predictions);
  joins_ = placeJoins(fragments_, units, line, residual && line.options.search_coupling);
  // A bare cut, when no blend is wanted.
  leads_offsets_away_ = line.overlap() > 0 && departures.offsets_led_away;
}

PositionMatrix JoinedUnits::rows(std::span<const Seconds> times, std::size_t first, std::size_t end) const {
  // An hour's offsets would take 50 MB.
  std::vector<JoinOffset> offsets;
  if (leads_offsets_away_)
    offsets =
        findJoinOffsets(labels_, fragments_, joins_, joinsWithin(joins_, times, signedIndex(first), signedIndex(end)));
  return blendFragments(fragments_, joins_, offsets, times, blend_, layout_, signedIndex(first), signedIndex(end));
}

std::vector<Seconds> JoinedUnits::middles() const {
  std::vector<Seconds> middles;
  for (std::size_t i = 0; i < joins_.size(); ++i) {
    // Between two fragments of one unit lies a pause of the take itself.
    if (fragments_[i].unit != fragments_[i + 1].unit) middles.push_back(joins_[i].lips.middle());
  }
  return middles;
}

StretchMotion blendUnits(const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                         const LineToRender& line, bool residual) {
  const JoinedUnits joined(units, line, residual);
  return {joined.rows(times, 0, times.size()), joined.middles(), {}};
}

}  // namespace mouthpiece
