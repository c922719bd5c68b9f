#include <algorithm>

#include "base/index.h"
#include "synthesis/stages.h"

namespace mouthpiece {
namespace {

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
  if (first == 0 && last + 1 == labels.phones.size()) return labels;
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

/// Units for phones [first, last] of the line; none for a single one.
std::vector<SelectedUnit> unitsFor(const SpeechLabels& labels, std::size_t first, std::size_t last,
                                   const UnitDatabase& database, const SelectionOptions& options) {
  std::vector<SelectedUnit> units = selectUnits(partOf(labels, first, last), database, options);
  for (SelectedUnit& unit : units) {
    unit.phones.first.value += first;
    unit.phones.last.value += first;
  }
  return units;
}

bool isCaptured(const UnitDatabase& database, Phone a, Phone b) {
  const std::vector<PhonePlace>& places = database.diphones(a, b);
  return std::any_of(places.begin(), places.end(), [&](const PhonePlace& place) { return database.isSeen(place, 2); });
}

/// Each stretch between two pairs that the corpus lacks is selected by itself.
std::vector<SelectedUnit> unitsAroundGaps(const SpeechLabels& labels, const UnitDatabase& database,
                                          const SelectionOptions& options) {
  std::vector<SelectedUnit> units;
  std::size_t first = 0;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    const bool goes_on =
        i + 1 < labels.phones.size() && isCaptured(database, labels.phones[i].phone, labels.phones[i + 1].phone);
    if (goes_on) continue;
    const std::vector<SelectedUnit> own = unitsFor(labels, first, i, database, options);
    units.insert(units.end(), own.begin(), own.end());
    first = i + 1;
  }
  return units;
}

/// Where the corpus knows how its speaker moves, a stand-in brings detail only: the lips go where they are predicted
/// to.
bool predictsStandIns(const SpeechLabels& labels, const UnitDatabase& database, const SynthesisOptions& options) {
  const SelectionOptions& selection = options.selection;
  return options.context.enabled && selection.method == SelectionMethod::kViterbi &&
         selection.units == UnitScales::kAny && database.corpus().trajectory_model != nullptr &&
         isCovered(labels, database, selection);
}

std::vector<SelectedUnit> chooseUnits(const SpeechLabels& labels, const UnitDatabase& database,
                                      const SynthesisOptions& options, const std::vector<SelectedUnit>& given) {
  const CurveOptions& curves = options.curves;
  if (labels.phones.empty() || (curves.alone && !curves.layered)) return {};
  const bool may_fill = (curves.fill_gaps || curves.layered) && CurveModel(database).isPossible();
  if (!given.empty()) {
    std::vector<SelectedUnit> units = given;
    if (may_fill) std::erase_if(units, [](const SelectedUnit& unit) { return unit.is_backoff; });
    return units;
  }
  if (may_fill && (curves.before_stand_ins || !predictsStandIns(labels, database, options)))
    return unitsAroundGaps(labels, database, options.selection);
  return unitsFor(labels, 0, labels.phones.size() - 1, database, options.selection);
}

/// The part of `segment` within [first, last], which it covers.
Segment partOf(const Segment& segment, PhoneIndex first, PhoneIndex last) {
  Segment part = segment;
  part.phones = {first, last};
  if (!part.unit) return part;
  part.unit->source = advance(part.unit->source, first.value - segment.phones.first.value);
  part.unit->phones = part.phones;
  return part;
}

void append(std::vector<Segment>& segments, const Segment& segment) {
  const bool goes_on = !segments.empty() && !segments.back().unit && !segment.unit;
  if (goes_on) segments.back().phones.last = segment.phones.last;
  if (!goes_on) segments.push_back(segment);
}

}  // namespace

SynthesisPlan planLine(const SpeechLabels& labels, const UnitDatabase& database, const SynthesisOptions& options,
                       const std::vector<SelectedUnit>& units) {
  SynthesisPlan plan;
  PhoneIndex covered;
  for (const SelectedUnit& unit : chooseUnits(labels, database, options, units)) {
    if (covered < unit.phones.first) plan.segments.push_back({{covered, unit.phones.first}, std::nullopt});
    plan.segments.push_back({unit.phones, unit});
    covered = unit.phones.last;
  }
  if (covered.value + 1 < labels.phones.size())
    plan.segments.push_back({{covered, PhoneIndex(labels.phones.size() - 1)}, std::nullopt});
  return plan;
}

void SynthesisPlan::lay(const Segment& laid) {
  std::vector<Segment> whole;
  for (const Segment& segment : segments) {
    const PhoneIndex end = std::min(segment.phones.last, laid.phones.first);
    if (segment.phones.first < end) append(whole, partOf(segment, segment.phones.first, end));
  }
  append(whole, laid);
  for (const Segment& segment : segments) {
    const PhoneIndex begin = std::max(segment.phones.first, laid.phones.last);
    if (begin < segment.phones.last) append(whole, partOf(segment, begin, segment.phones.last));
  }
  segments = std::move(whole);
}

}  // namespace mouthpiece
