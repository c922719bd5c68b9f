#include "phonetics/labels/label_entries.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr Seconds kRoundingOverlap = 0.9e-4;
/// Shorter than this is a slip of the mouse in the labelling program: a phone is refused, a silence ignored.
constexpr Seconds kShortestLabel = 2e-4;

void checkSpan(std::string_view file, const LabelEntry& entry, Seconds previous_end) {
  const auto [start, end] = entry.span;
  if (!std::isfinite(start) || !std::isfinite(end) || start < -kRoundingOverlap || end > kLatestLabel) {
    throw InputError(file, entry.place,
                     fmt::format("found times {} to {} s; expected 0 to {} s", start, end, kLatestLabel));
  }
  if (end < start) {
    throw InputError(file, entry.place,
                     fmt::format("'{}' ends at {} s, before it begins at {} s; expected a later end",
                                 printable(entry.text), end, start));
  }
  if (start < previous_end - kRoundingOverlap) {
    throw InputError(file, entry.place,
                     fmt::format("'{}' begins at {} s, inside the interval before it, which ends at {} s; expected "
                                 "intervals that do not overlap",
                                 printable(entry.text), start, previous_end));
  }
}

void checkIsLongEnough(std::string_view file, const LabelEntry& entry) {
  if (entry.span.duration() >= kShortestLabel) return;
  throw InputError(file, entry.place,
                   fmt::format("'{}' lasts {:.6f} s; expected at least {} s", printable(entry.text),
                               entry.span.duration(), kShortestLabel));
}

bool releases(Phone stop, Phone next) {
  return next == stop || (stop == Phone::kD && next == Phone::kJH) || (stop == Phone::kT && next == Phone::kCH);
}

Phone requirePhone(std::string_view file, const LabelEntry& entry, PhoneSet set, const Language& language) {
  if (isSilenceName(entry.text)) return Phone::kSil;
  if (const auto phone = phoneFromName(entry.text, set, language)) return *phone;
  if (const auto stop = closedStop(entry.text)) return *stop;
  const char* hint = entry.text == "spn" ? " (the aligner's mark for a word that its dictionary lacks)" : "";
  throw InputError(file, entry.place,
                   fmt::format("found phone '{}'{}; expected {} or sil", printable(entry.text), hint,
                               set == PhoneSet::kArpabet ? "ARPAbet (AA AE AH ... ZH)" : phoneSetName(set)));
}

}  // namespace

std::vector<PhoneSegment> phonesFromEntries(std::string_view file, const std::vector<LabelEntry>& entries,
                                            const Language& language) {
  std::vector<std::string> names;
  for (const LabelEntry& entry : entries) names.push_back(entry.text);
  const PhoneSet set = likeliestPhoneSet(names, language);
  std::vector<PhoneSegment> segments;
  std::optional<Phone> open_closure;
  Seconds previous_end = 0;
  for (const LabelEntry& entry : entries) {
    checkSpan(file, entry, previous_end);
    previous_end = std::max(previous_end, entry.span.end);
    const bool is_glottal_stop = isGlottalStop(entry.text);
    const Phone phone = !is_glottal_stop   ? requirePhone(file, entry, set, language)
                        : segments.empty() ? Phone::kSil
                                           : segments.back().phone;
    if (phone == Phone::kSil && entry.span.duration() < kShortestLabel) continue;
    const bool joins = !segments.empty() && std::abs(segments.back().span.end - entry.span.start) <= kRoundingOverlap &&
                       (is_glottal_stop || (open_closure && releases(*open_closure, phone)));
    open_closure = closedStop(entry.text);
    if (joins) {
      segments.back().phone = phone;
      segments.back().span.end = std::max(segments.back().span.end, entry.span.end);
    } else if (!is_glottal_stop) {
      checkIsLongEnough(file, entry);
      segments.push_back({.phone = phone,
                          .span = {std::max(0.0, entry.span.start), entry.span.end},
                          .stress = stressOfName(entry.text)});
    }
  }
  return segments;
}

std::vector<WordSegment> wordsFromEntries(std::string_view file, const std::vector<LabelEntry>& entries) {
  std::vector<WordSegment> words;
  Seconds previous_end = 0;
  for (const LabelEntry& entry : entries) {
    checkSpan(file, entry, previous_end);
    previous_end = std::max(previous_end, entry.span.end);
    if (!isSilenceName(entry.text)) words.push_back({entry.text, entry.span});
  }
  return words;
}

}  // namespace mouthpiece
