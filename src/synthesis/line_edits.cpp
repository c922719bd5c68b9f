#include "synthesis/line_edits.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "base/json_fields.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxEditBytes = std::uint64_t{1} << 28;
constexpr std::size_t kMostEdits = 10000, kMostPhones = 1000;
constexpr double kLatest = 1e6;
constexpr Seconds kNearBorder = 0.3, kNearUnit = 0.5, kShortestPhone = 0.010, kNearSource = 0.05;

/// VOCAL's own parameters, as dials.
struct StyleRow {
  std::string_view name;
  double most;
  StyleSignal VocalStyle::*signal;
};
constexpr std::array<StyleRow, 4> kStyleDials{{{"ma", 1, &VocalStyle::ma},
                                               {"ps", 1, &VocalStyle::ps},
                                               {"ja", kLargestArticulation, &VocalStyle::ja},
                                               {"li", kLargestArticulation, &VocalStyle::li}}};

std::vector<std::string_view> dialNames() {
  std::vector<std::string_view> names;
  for (const DialRow& dial : kSpeechDials) names.push_back(dial.name);
  for (const StyleRow& dial : kStyleDials) names.push_back(dial.name);
  return names;
}

Seconds timeOf(const JsonField& entry, std::string_view key) { return entry[key].number(-kLatest, kLatest); }

TimeSpan spanOf(const JsonField& entry) {
  const TimeSpan span{timeOf(entry, "start_s"), timeOf(entry, "end_s")};
  if (span.duration() < 2 * kLeastKeyGap) entry.fail("found an empty span; expected end_s after start_s");
  return span;
}

DialEdit dialFrom(const JsonField& entry) {
  const std::vector<std::string_view> names = dialNames();
  DialEdit edit;
  const std::size_t place = entry["dial"].choice(names);
  edit.dial = names[place];
  const bool is_style = place >= kSpeechDials.size();
  const double least = is_style ? 0 : kSpeechDials[place].least;
  const double most = is_style ? kStyleDials[place - kSpeechDials.size()].most : kSpeechDials[place].most;
  edit.span = spanOf(entry);
  if (entry["fade_s"].exists()) edit.fade = entry["fade_s"].number(0, kLatest);
  if (entry["keys"].exists()) {
    for (const JsonField& key : entry["keys"].list(1, kMostEdits)) {
      const Seconds time = key["time_s"].number(edit.span.start, edit.span.end);
      if (!edit.points.empty() && time <= edit.points.back().time)
        key.fail("found key times that do not rise; expected rising times");
      edit.points.push_back({time, key["value"].number(least, most)});
    }
  } else {
    edit.points.push_back({edit.span.middle(), entry["value"].number(least, most)});
  }
  return edit;
}

UnitEdit unitFrom(const JsonField& entry, bool is_taken) {
  UnitEdit edit{entry["phones"].names(2, kMostPhones), timeOf(entry, "start_s"), {}, 0};
  if (!is_taken) return edit;
  edit.take = entry["take"].name();
  edit.source_start = timeOf(entry, "source_start_s");
  return edit;
}

void addEdit(const JsonField& entry, LineEdits& edits) {
  if (!entry["kind"].exists() && entry["name"].exists()) return edits.curves.push_back(wholeCurveFrom(entry));
  constexpr std::array<std::string_view, 8> kKinds{"offset", "replace", "mute", "dial",
                                                   "border", "word",    "unit", "curves"};
  switch (entry["kind"].choice(kKinds)) {
    case 3:
      return edits.dials.push_back(dialFrom(entry));
    case 4:
      return edits.borders.push_back(
          {entry["before"].name(), entry["after"].name(), timeOf(entry, "at_s"), timeOf(entry, "to_s")});
    case 5:
      return edits.words.push_back(
          {entry["word"].name(),
           entry["number"].exists() ? static_cast<std::size_t>(entry["number"].whole(0, 1'000'000)) : 0,
           entry["to"].text()});
    case 6:
      return edits.units.push_back(unitFrom(entry, true));
    case 7:
      return edits.units.push_back(unitFrom(entry, false));
    default:
      return edits.curves.push_back(curveEditFrom(entry));
  }
}

std::string joinedNames(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    if (!text.empty()) text += ' ';
    text += printable(name);
  }
  return text;
}

bool isWordByte(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '\'' || (c & 0x80) != 0;
}

char inLower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Where the word stands for the `number`-th time by itself; npos where it does not.
std::size_t placeOfWord(std::string_view text, std::string_view word, std::size_t number) {
  const auto is_alike = [](char a, char b) { return inLower(a) == inLower(b); };
  for (auto from = text.begin();;) {
    const auto found = std::search(from, text.end(), word.begin(), word.end(), is_alike);
    if (found == text.end()) return std::string_view::npos;
    const auto end = found + std::ssize(word);
    const bool is_whole =
        (found == text.begin() || !isWordByte(*(found - 1))) && (end == text.end() || !isWordByte(*end));
    if (is_whole && number-- == 0) return static_cast<std::size_t>(found - text.begin());
    from = found + 1;
  }
}

/// The first of the phones' places in the line, the one nearest to the time.
std::optional<PhoneIndex> placeOfPhones(const SpeechLabels& labels, const std::vector<std::string>& phones,
                                        Seconds start) {
  std::optional<PhoneIndex> best;
  for (std::size_t first = 0; first + phones.size() <= labels.phones.size(); ++first) {
    bool fits = true;
    for (std::size_t i = 0; fits && i < phones.size(); ++i) fits = labels.phones[first + i].name() == phones[i];
    const auto away = [&](std::size_t phone) { return std::abs(labels.phones[phone].span.start - start); };
    if (fits && away(first) <= kNearUnit && (!best || away(first) < away(best->value))) best = PhoneIndex(first);
  }
  return best;
}

/// The fragment that an edit names, if the corpus has it, it says these phones, and all of it was seen.
std::optional<PhonePlace> sourceOf(const UnitEdit& edit, const SpeechLabels& labels, PhoneIndex first,
                                   const UnitDatabase& database) {
  const std::optional<TakeIndex> take = takeNamed(database.corpus(), edit.take);
  if (!take) return std::nullopt;
  const auto& phones = database.takeOf(*take).labels.phones;
  for (std::size_t p = 0; p + edit.phones.size() <= phones.size(); ++p) {
    if (std::abs(phones[p].span.start - edit.source_start) > kNearSource) continue;
    bool fits = true;
    for (std::size_t i = 0; fits && i < edit.phones.size(); ++i)
      fits = phones[p + i].phone == labels.phones[first.value + i].phone;
    const PhonePlace place{*take, PhoneIndex(p)};
    if (fits && database.isSeen(place, edit.phones.size())) return place;
  }
  return std::nullopt;
}

/// `signal` with `edit` in force over its span.
StyleSignal withEdit(const StyleSignal& signal, const DialEdit& edit) {
  const Seconds fade = std::clamp(edit.fade, kLeastKeyGap, 0.49 * edit.span.duration());
  StyleSignal made;
  const auto add = [&](Seconds time, double value) {
    if (made.points.empty() || time > made.points.back().time) made.points.push_back({time, value});
  };
  for (const StyleSignal::Point& point : signal.points) {
    if (point.time < edit.span.start) add(point.time, point.value);
  }
  const StyleSignal inner{[&] {
    StyleSignal points;
    points.points = edit.points;
    return points;
  }()};
  add(edit.span.start, signal.at(edit.span.start));
  add(edit.span.start + fade, inner.at(edit.span.start + fade));
  for (const StyleSignal::Point& point : edit.points) {
    if (point.time > edit.span.start + fade && point.time < edit.span.end - fade) add(point.time, point.value);
  }
  add(edit.span.end - fade, inner.at(edit.span.end - fade));
  add(edit.span.end, signal.at(edit.span.end));
  for (const StyleSignal::Point& point : signal.points) add(point.time, point.value);
  return made;
}

}  // namespace

bool isUsual(const DialRow& dial, const SpeechDials& dials) {
  const StyleSignal& signal = dials.*dial.signal;
  return signal.isConstant() && (signal.points.empty() || signal.points[0].value == dial.usual);
}

bool areUsual(const SpeechDials& dials) {
  return std::all_of(kSpeechDials.begin(), kSpeechDials.end(),
                     [&](const DialRow& dial) { return isUsual(dial, dials); });
}

LineEdits parseLineEdits(std::string_view json_text, std::string_view file) {
  LineEdits edits;
  for (const JsonField& entry : parseJson(json_text, file, "edits").list(0, kMostEdits)) addEdit(entry, edits);
  return edits;
}

LineEdits readLineEdits(const std::filesystem::path& path) {
  return parseLineEdits(readFile(path, kMaxEditBytes), path.string());
}

std::string withWords(std::string text, const std::vector<WordEdit>& edits, std::vector<std::string>& warnings) {
  for (const WordEdit& edit : edits) {
    const std::size_t place = placeOfWord(text, edit.word, edit.number);
    if (place == std::string::npos) {
      warnings.push_back(fmt::format("an edit does not apply: the line has no word \"{}\" to become \"{}\"",
                                     printable(edit.word), printable(edit.to)));
    } else {
      text.replace(place, edit.word.size(), edit.to);
    }
  }
  return text;
}

SpeechLabels withBorders(SpeechLabels labels, const std::vector<BorderEdit>& edits,
                         std::vector<std::string>& warnings) {
  for (const BorderEdit& edit : edits) {
    std::optional<std::size_t> best;
    for (std::size_t i = 1; i < labels.phones.size(); ++i) {
      const auto away = [&](std::size_t phone) { return std::abs(labels.phones[phone].span.start - edit.at); };
      if (labels.phones[i - 1].name() != edit.before || labels.phones[i].name() != edit.after) continue;
      if (away(i) <= kNearBorder && (!best || away(i) < away(*best))) best = i;
    }
    if (!best) {
      warnings.push_back(fmt::format("an edit does not apply: no {} is followed by {} near {:.2f} s",
                                     printable(edit.before), printable(edit.after), edit.at));
      continue;
    }
    TimeSpan &left = labels.phones[*best - 1].span, &right = labels.phones[*best].span;
    const Seconds least = std::min(left.start + kShortestPhone, left.end);
    const Seconds most = std::max(right.end - kShortestPhone, right.start);
    left.end = right.start = std::clamp(edit.to, least, most);
    if (left.end != edit.to)
      warnings.push_back(
          fmt::format("the border between {} and {} went to {:.3f} s, not to {:.3f} s: a phone keeps "
                      "10 ms",
                      printable(edit.before), printable(edit.after), left.end, edit.to));
  }
  return labels;
}

SynthesisPlan withUnits(SynthesisPlan plan, const SpeechLabels& labels, const UnitDatabase& database,
                        const std::vector<UnitEdit>& edits, std::vector<std::string>& warnings) {
  for (const UnitEdit& edit : edits) {
    const std::optional<PhoneIndex> first = placeOfPhones(labels, edit.phones, edit.start);
    if (!first) {
      warnings.push_back(fmt::format("an edit does not apply: the line has no {} near {:.2f} s",
                                     joinedNames(edit.phones), edit.start));
      continue;
    }
    const PhoneRange phones{*first, PhoneIndex(first->value + edit.phones.size() - 1)};
    if (edit.take.empty()) {
      plan.lay({phones, std::nullopt});
      continue;
    }
    const std::optional<PhonePlace> source = sourceOf(edit, labels, *first, database);
    if (!source) {
      warnings.push_back(fmt::format("an edit does not apply: the corpus {} has no {} at {:.2f} s of a take {}",
                                     printable(database.corpus().name), joinedNames(edit.phones), edit.source_start,
                                     printable(edit.take)));
      continue;
    }
    plan.lay({phones, SelectedUnit{phones, *source, 0, 0, false, {}}});
  }
  return plan;
}

SpeechDials withDials(SpeechDials dials, const std::vector<DialEdit>& edits, Seconds duration,
                      std::vector<std::string>& warnings) {
  for (const DialEdit& edit : edits) {
    if (edit.span.start >= duration || edit.span.end <= 0) {
      warnings.push_back(
          fmt::format("an edit does not apply: {} from {:.2f} s to {:.2f} s lies beyond the line's end "
                      "at {:.2f} s",
                      edit.dial, edit.span.start, edit.span.end, duration));
      continue;
    }
    for (const DialRow& dial : kSpeechDials) {
      if (dial.name == edit.dial) dials.*dial.signal = withEdit(dials.*dial.signal, edit);
    }
  }
  return dials;
}

VocalStyle withDials(VocalStyle style, const std::vector<DialEdit>& edits) {
  for (const DialEdit& edit : edits) {
    for (const StyleRow& dial : kStyleDials) {
      if (dial.name == edit.dial) style.*dial.signal = withEdit(style.*dial.signal, edit);
    }
  }
  return style;
}

}  // namespace mouthpiece
