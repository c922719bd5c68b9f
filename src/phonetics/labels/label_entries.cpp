#include "phonetics/labels/label_entries.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"

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

/// The phones that an entry names, at least one; two of a sound that no single phone shows (pf).
std::vector<SpelledPhone> requirePhones(std::string_view file, const LabelEntry& entry, PhoneSet set,
                                        const Language& language) {
  if (isSilenceName(entry.text)) return {{}};
  std::vector<std::string> unknown;
  std::vector<SpelledPhone> phones = phonesOfSymbol(entry.text, set, language, unknown);
  if (!phones.empty() && unknown.empty()) return phones;
  // Labels that were made here name sounds of other languages by IPA beside ARPAbet, however few there are of either.
  for (const PhoneSet other : {PhoneSet::kArpabet, PhoneSet::kIpa}) {
    if (set == PhoneSet::kXSampa || set == other) continue;
    unknown.clear();
    phones = phonesOfSymbol(entry.text, other, language, unknown);
    if (phones.size() == 1 && unknown.empty()) return phones;
  }
  if (const auto stop = closedStop(entry.text)) return {{*stop, *stop, "", 0}};
  const char* hint = entry.text == kUnspelledWord ? " (the aligner's mark for a word that its dictionary lacks)" : "";
  throw InputError(file, entry.place,
                   fmt::format("found phone '{}'{}; expected {} or sil", printable(entry.text), hint,
                               set == PhoneSet::kArpabet ? "ARPAbet (AA AE AH ... ZH)" : phoneSetName(set)));
}

/// In equal parts.
void appendParts(std::vector<PhoneSegment>& segments, std::vector<SpelledPhone>& phones, const TimeSpan& span,
                 std::optional<int> stress) {
  const Seconds length = span.duration() / asReal(phones.size());
  for (std::size_t i = 0; i < phones.size(); ++i) {
    const bool is_last = i + 1 == phones.size();
    segments.push_back(
        {.phone = phones[i].phone,
         .span = {span.start + asReal(i) * length, is_last ? span.end : span.start + asReal(i + 1) * length},
         .stress = stress,
         .ipa = std::move(phones[i].ipa)});
  }
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
    std::vector<SpelledPhone> phones;
    if (!is_glottal_stop) phones = requirePhones(file, entry, set, language);
    const Phone phone = !is_glottal_stop   ? phones.front().phone
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
      appendParts(segments, phones, {std::max(0.0, entry.span.start), entry.span.end}, stressOfName(entry.text));
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
