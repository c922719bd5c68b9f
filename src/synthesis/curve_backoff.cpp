#include "synthesis/curve_backoff.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "vocal/viseme_poses.h"

namespace mouthpiece {
namespace {

constexpr double kPartOfPhone = 0.9;  ///< the blend's share of the shared phone, at most
constexpr double kPartOfSilence = 0.5;
constexpr Seconds kLongestInSilence = 0.300;
constexpr Seconds kContactRamp = 0.040;  ///< keepContacts() closes and opens within it
constexpr Seconds kIntoRun = 0.080;      ///< how far beyond the shared phone a join may lie, beside a contact

bool isCaptured(const UnitDatabase& database, Phone a, Phone b) {
  const std::vector<PhonePlace>& places = database.diphones(a, b);
  return std::any_of(places.begin(), places.end(), [&](const PhonePlace& place) { return database.isSeen(place, 2); });
}

/// Entries of a tier that lie in [first, last], renumbered to count from `first`.
template <typename Entry>
std::vector<Entry> clipped(const std::vector<Entry>& entries, std::size_t first, std::size_t last,
                           std::vector<std::optional<std::size_t>>& renumbered) {
  std::vector<Entry> kept;
  for (const Entry& entry : entries) {
    const std::size_t begin = std::max(entry.phones.first.value, first);
    const std::size_t end = std::min(entry.phones.last.value, last);
    renumbered.push_back(begin <= end ? std::optional(kept.size()) : std::nullopt);
    if (begin > end) continue;
    kept.push_back(entry);
    kept.back().phones = {PhoneIndex(begin - first), PhoneIndex(end - first)};
  }
  return kept;
}

/// Phones [first, last] of the line, at their own times.
SpeechLabels partOf(const SpeechLabels& labels, std::size_t first, std::size_t last) {
  SpeechLabels part;
  std::vector<std::optional<std::size_t>> words, syllables;
  part.words = clipped(labels.words, first, last, words);
  part.syllables = clipped(labels.syllables, first, last, syllables);
  for (std::size_t i = first; i <= last; ++i) {
    LabelledPhone phone = labels.phones[i];
    if (phone.word) phone.word = words[*phone.word];
    if (phone.syllable) phone.syllable = syllables[*phone.syllable];
    part.phones.push_back(phone);
  }
  return part;
}

void selectRun(const SpeechLabels& labels, std::size_t first, std::size_t last, const UnitDatabase& database,
               const SelectionOptions& options, std::vector<CapturedRun>& runs) {
  if (first == last) return;  // a phone between two gaps: both are one
  const bool is_whole = first == 0 && last + 1 == labels.phones.size();
  CapturedRun run{selectUnits(is_whole ? labels : partOf(labels, first, last), database, options)};
  for (SelectedUnit& unit : run.units) {
    unit.phones.first.value += first;
    unit.phones.last.value += first;
  }
  if (!run.units.empty()) runs.push_back(std::move(run));
}

/// A join of curves with a run, inside the phone that they share.
struct CurveJoin {
  bool exists = false;  ///< false at the line's ends
  TimeSpan blend;
  Eigen::RowVectorXd captured;  ///< the run's pose at the blend's middle
};

/// A run's own rows, over its phones and the blends at both ends.
struct RenderedRun {
  const CapturedRun* run = nullptr;
  std::size_t first_row = 0;
  PositionMatrix positions;
  [[nodiscard]] std::size_t endRow() const { return first_row + static_cast<std::size_t>(positions.rows()); }
};

/// Continuous in the second derivative too.
double smootherStep(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * u * (10 + u * (6 * u - 15));
}

/// Where a run gives way to curves or curves to a run.
TimeSpan placeCurveJoin(const SpeechLabels& labels, PhoneIndex phone, bool curves_follow, Seconds overlap) {
  const LabelledPhone& shared = labels.phones[phone.value];
  const TimeSpan& span = shared.span;
  if (shared.phone != Phone::kSil) {
    const Seconds length = std::min(overlap, std::max(kPartOfPhone * span.duration(), 0.5 * overlap));
    // A contact that the curves make needs time to close or open, of which the capture knows nothing.
    const LabelledPhone& made = labels.phones[curves_follow ? phone.value + 1 : phone.value - 1];
    Seconds middle = span.middle();
    if (isBilabial(made.phone) || isLabiodental(made.phone)) {
      const Seconds away = kContactRamp + 0.5 * length;
      middle = curves_follow ? std::clamp(made.span.start - away, span.start - kIntoRun, middle)
                             : std::clamp(made.span.end + away, middle, span.end + kIntoRun);
    }
    return {middle - 0.5 * length, middle + 0.5 * length};
  }
  // In a pause, not far from the speech that the curves make.
  const Seconds length = std::min(kLongestInSilence, kPartOfSilence * span.duration());
  const Seconds away = std::min(kLongestInSilence, 0.5 * span.duration());
  const Seconds middle = curves_follow ? span.end - away : span.start + away;
  return {middle - 0.5 * length, middle + 0.5 * length};
}

/// Straight between the rows around `time`.
Eigen::RowVectorXd poseAt(const Eigen::Ref<const PositionMatrix>& poses, std::span<const Seconds> times, Seconds time) {
  if (times.size() == 1) return poses.row(0);
  const auto next = std::upper_bound(times.begin(), times.end(), time) - times.begin();
  const auto at = std::clamp<std::ptrdiff_t>(next, 1, static_cast<std::ptrdiff_t>(times.size()) - 1);
  const Seconds t0 = times[static_cast<std::size_t>(at - 1)], t1 = times[static_cast<std::size_t>(at)];
  const double u = std::clamp((time - t0) / (t1 - t0), 0.0, 1.0);
  return (1 - u) * poses.row(at - 1) + u * poses.row(at);
}

/// Leads the curves' poses to the captured ones at both joins.
void meetNeighbours(const CurveJoin& before, const CurveJoin& after, std::span<const Seconds> times,
                    PositionMatrix& poses) {
  Seconds reach = kOffsetReach;
  if (before.exists && after.exists) reach = std::min(reach, after.blend.middle() - before.blend.middle());
  reach = std::max(reach, 1e-3);
  const Eigen::RowVectorXd none = Eigen::RowVectorXd::Zero(poses.cols());
  const Eigen::RowVectorXd offset_before =
      before.exists ? Eigen::RowVectorXd(before.captured - poseAt(poses, times, before.blend.middle())) : none;
  const Eigen::RowVectorXd offset_after =
      after.exists ? Eigen::RowVectorXd(after.captured - poseAt(poses, times, after.blend.middle())) : none;
  for (std::size_t k = 0; k < times.size(); ++k) {
    auto row = poses.row(static_cast<Eigen::Index>(k));
    row += (1 - smootherStep((times[k] - before.blend.middle()) / reach)) * offset_before;
    row += (1 - smootherStep((after.blend.middle() - times[k]) / reach)) * offset_after;
  }
}

/// Rows of `times` within [start, end] and one more on either side.
std::pair<std::size_t, std::size_t> rowsAround(const std::vector<Seconds>& times, Seconds start, Seconds end) {
  const auto first = std::lower_bound(times.begin(), times.end(), start) - times.begin();
  const auto last = std::upper_bound(times.begin(), times.end(), end) - times.begin();
  return {static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, first - 1)),
          std::min(times.size(), static_cast<std::size_t>(last) + 1)};
}

/// `positions` over `rows`: blended with the run's own poses over `join`.
void blendWithRun(const RenderedRun& run, const CurveJoin& join, bool run_is_first, std::span<const Seconds> times,
                  std::size_t first_row, BlendKind kind, PositionMatrix& curves) {
  for (std::size_t k = 0; k < times.size(); ++k) {
    const std::size_t row = first_row + k;
    if (row < run.first_row || row >= run.endRow()) continue;
    const double u = (times[k] - join.blend.start) / std::max(join.blend.duration(), 1e-9);
    const double first_weight = blendWeight(kind, u);
    const double captured = run_is_first ? first_weight : 1 - first_weight;
    const auto at = static_cast<Eigen::Index>(k);
    curves.row(at) =
        captured * run.positions.row(static_cast<Eigen::Index>(row - run.first_row)) + (1 - captured) * curves.row(at);
  }
}

}  // namespace

std::vector<CapturedRun> selectAroundGaps(const SpeechLabels& labels, const UnitDatabase& database,
                                          const SelectionOptions& options) {
  std::vector<CapturedRun> runs;
  if (labels.phones.size() < 2) return runs;
  std::size_t first = 0;
  for (std::size_t i = 0; i + 1 < labels.phones.size(); ++i) {
    if (isCaptured(database, labels.phones[i].phone, labels.phones[i + 1].phone)) continue;
    selectRun(labels, first, i, database, options, runs);
    first = i + 1;
  }
  selectRun(labels, first, labels.phones.size() - 1, database, options, runs);
  return runs;
}

std::vector<CapturedRun> runsOf(const std::vector<SelectedUnit>& units) {
  std::vector<CapturedRun> runs;
  bool in_run = false;
  for (const SelectedUnit& unit : units) {
    if (unit.is_backoff) {
      in_run = false;
      continue;
    }
    if (!in_run) runs.emplace_back();
    in_run = true;
    runs.back().units.push_back(unit);
  }
  return runs;
}

std::vector<PhoneRange> gapsBetween(const std::vector<CapturedRun>& runs, std::size_t phone_count) {
  std::vector<PhoneRange> gaps;
  if (phone_count < 2) return gaps;
  std::size_t covered = 0;
  for (const CapturedRun& run : runs) {
    const PhoneRange phones = run.phones();
    if (phones.first.value > covered) gaps.push_back({PhoneIndex(covered), phones.first});
    covered = phones.last.value;
  }
  if (covered + 1 < phone_count) gaps.push_back({PhoneIndex(covered), PhoneIndex(phone_count - 1)});
  return gaps;
}

namespace {

/// What composeRuns() needs throughout.
struct Composer {
  const SpeechLabels& labels;
  const std::vector<CapturedRun>& runs;
  const RenderUnits& render;
  const CurveSet& curves;
  const VocalStyle& style;
  const VisemePoses& visemes;
  const MarkerPositions& neutral_mm;
  const std::vector<Seconds>& times;
  Seconds overlap;
  BlendKind blend;

  /// The join at the end (or beginning) of a run. Where those of both ends would cross, they share the room.
  [[nodiscard]] CurveJoin joinAt(const CapturedRun& run, bool curves_follow) const {
    const PhoneRange phones = run.phones();
    CurveJoin join{
        true, placeCurveJoin(labels, curves_follow ? phones.last : phones.first, curves_follow, overlap), {}};
    const bool has_both = phones.first.value > 0 && phones.last.value + 1 < labels.phones.size();
    if (!has_both) return join;
    const TimeSpan other = placeCurveJoin(labels, curves_follow ? phones.first : phones.last, !curves_follow, overlap);
    const Seconds first_end = curves_follow ? other.end : join.blend.end;
    const Seconds second_start = curves_follow ? join.blend.start : other.start;
    if (first_end <= second_start) return join;
    const TimeSpan whole = labels.spanOf(phones);
    const Seconds quarter = 0.25 * whole.duration();
    join.blend = curves_follow ? TimeSpan{whole.end - quarter - 0.5 * quarter, whole.end - 0.5 * quarter}
                               : TimeSpan{whole.start + 0.5 * quarter, whole.start + quarter + 0.5 * quarter};
    return join;
  }

  [[nodiscard]] std::vector<RenderedRun> renderRuns() const {
    std::vector<RenderedRun> rendered;
    for (const CapturedRun& run : runs) {
      const PhoneRange phones = run.phones();
      const bool starts_line = phones.first.value == 0;
      const bool ends_line = phones.last.value + 1 == labels.phones.size();
      const Seconds start = starts_line ? times.front() : joinAt(run, false).blend.start;
      const Seconds end = ends_line ? times.back() : joinAt(run, true).blend.end;
      const auto [first, last] = rowsAround(times, start, end);
      const std::vector<Seconds> own(times.begin() + static_cast<std::ptrdiff_t>(first),
                                     times.begin() + static_cast<std::ptrdiff_t>(last));
      rendered.push_back({&run, first, render(run.units, own)});
    }
    return rendered;
  }

  /// The gap's rows, joined to its neighbours where it has them.
  void fillGap(const RenderedRun* run_before, const RenderedRun* run_after, ComposedMotion& motion) const {
    CurveJoin before = run_before == nullptr ? CurveJoin{} : joinAt(*run_before->run, true);
    CurveJoin after = run_after == nullptr ? CurveJoin{} : joinAt(*run_after->run, false);
    const Seconds start = before.exists ? before.blend.start : times.front();
    const Seconds end = after.exists ? after.blend.end : times.back();
    const auto [first, last] = rowsAround(times, start, end);
    const std::vector<Seconds> own(times.begin() + static_cast<std::ptrdiff_t>(first),
                                   times.begin() + static_cast<std::ptrdiff_t>(last));
    PositionMatrix poses = displacementsFromCurves(curves, visemes, style.ja, style.li, own);
    const Eigen::Map<const Eigen::RowVectorXd> rest(neutral_mm.data(), neutral_mm.size());
    const auto meet = [&](const RenderedRun& run, CurveJoin& join) {
      const std::span<const Seconds> run_times(times.data() + run.first_row, run.endRow() - run.first_row);
      join.captured = poseAt(run.positions, run_times, join.blend.middle()) - rest;
      motion.joins.push_back(join.blend.middle());
    };
    if (before.exists) meet(*run_before, before);
    if (after.exists) meet(*run_after, after);
    meetNeighbours(before, after, own, poses);
    poses = withContacts(curves, visemes, own, std::move(poses));
    poses.rowwise() += rest;
    if (before.exists) blendWithRun(*run_before, before, true, own, first, blend, poses);
    if (after.exists) blendWithRun(*run_after, after, false, own, first, blend, poses);
    motion.positions_mm.middleRows(static_cast<Eigen::Index>(first), poses.rows()) = poses;
  }
};

}  // namespace

ComposedMotion composeRuns(const SpeechLabels& labels, const std::vector<CapturedRun>& runs, const RenderUnits& render,
                           const CurveSet& curves, const VocalStyle& style, const VisemePoses& visemes,
                           const MarkerPositions& neutral_mm, const std::vector<Seconds>& times, Seconds overlap,
                           BlendKind blend) {
  const Composer composer{labels, runs, render, curves, style, visemes, neutral_mm, times, overlap, blend};
  ComposedMotion motion;
  motion.positions_mm.resize(static_cast<Eigen::Index>(times.size()), neutral_mm.size());
  const std::vector<RenderedRun> rendered = composer.renderRuns();
  for (const RenderedRun& run : rendered) {
    motion.positions_mm.middleRows(static_cast<Eigen::Index>(run.first_row), run.positions.rows()) = run.positions;
  }
  if (runs.empty()) composer.fillGap(nullptr, nullptr, motion);
  if (runs.empty()) return motion;
  for (const PhoneRange& gap : gapsBetween(runs, labels.phones.size())) {
    const RenderedRun* before = nullptr;
    const RenderedRun* after = nullptr;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (runs[i].phones().last == gap.first) before = &rendered[i];
      if (runs[i].phones().first == gap.last) after = &rendered[i];
    }
    composer.fillGap(before, after, motion);
  }
  return motion;
}

}  // namespace mouthpiece
