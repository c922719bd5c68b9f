#include "vocal/vocal_style.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxSignalBytes = 1 << 24;

[[noreturn]] void failAtLine(std::string_view name, std::size_t line, const std::string& what) {
  throw InputError(name, std::to_string(line), what);
}

}  // namespace

double StyleSignal::at(Seconds time) const {
  if (points.empty()) return 0;
  const auto next = std::upper_bound(points.begin(), points.end(), time,
                                     [](Seconds t, const Point& point) { return t < point.time; });
  if (next == points.begin()) return points.front().value;
  if (next == points.end()) return points.back().value;
  const Point& before = *(next - 1);
  return std::lerp(before.value, next->value, (time - before.time) / (next->time - before.time));
}

bool StyleSignal::isConstant() const {
  return std::all_of(points.begin(), points.end(), [&](const Point& point) { return point.value == points[0].value; });
}

StyleChoice parseStyleChoice(std::string_view text, std::string_view option, double largest, bool may_be_auto) {
  StyleChoice choice;
  if (text == "auto") {
    if (!may_be_auto)
      throw InputError(option, "", "found auto; expected a number or a file (only Ma and Ps have auto)");
    choice.automatic = true;
  } else if (const std::optional<double> number = parseNumber(text)) {
    if (!(*number >= 0 && *number <= largest))
      throw InputError(option, "", fmt::format("found {}; expected 0 to {}", printable(text), largest));
    choice.constant = number;
  } else {
    choice.file = std::string(text);
  }
  return choice;
}

StyleSignal parseStyleSignal(std::string_view text, std::string_view name, double largest, double least) {
  LineReader lines(text);
  StyleSignal signal;
  std::vector<std::string_view> fields;
  for (std::string_view line; lines.next(line);) {
    if (trimmed(line).empty()) continue;
    splitFields(line, ',', fields);
    const auto time = parseNumber(fields[0]);
    const auto value = fields.size() == 2 ? parseNumber(fields[1]) : std::nullopt;
    if (!time && signal.points.empty() && lines.lineNumber() == 1) continue;
    if (!time || !value || !std::isfinite(*time) || !(*value >= least && *value <= largest)) {
      failAtLine(
          name, lines.lineNumber(),
          fmt::format("found '{}'; expected time_s,value with a value from {} to {}", printable(line), least, largest));
    }
    if (!signal.points.empty() && *time <= signal.points.back().time)
      failAtLine(name, lines.lineNumber(),
                 fmt::format("found the time {} after {}; expected rising times", *time, signal.points.back().time));
    signal.points.push_back({*time, *value});
  }
  if (signal.points.empty()) throw InputError(name, "", "holds no rows; expected time_s,value");
  return signal;
}

StyleSignal readStyleSignal(const std::filesystem::path& path, double largest, double least) {
  return parseStyleSignal(readFile(path, kMaxSignalBytes), path.string(), largest, least);
}

PhoneValues melodicAccents(const SpeechLabels& labels, const AudioTags& tags) {
  constexpr double kLeastShare = 1e-6;  // of the loudest: -60 dB, at which nothing is heard
  PhoneValues accents(labels.phones.size());
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    if (rowOf(labels.phones[i].phone).turbulent) accents[i] = kUnknownAccent;
  }
  double loudest = 0;
  const auto counts = [&](const ConsonantEnergy& energy) {
    return energy.phone.value < labels.phones.size() && rowOf(labels.phones[energy.phone.value].phone).turbulent;
  };
  for (const ConsonantEnergy& energy : tags.consonants) {
    if (counts(energy)) loudest = std::max(loudest, energy.energy);
  }
  if (!(loudest > 0)) return accents;
  const auto level = [&](const ConsonantEnergy& energy) {
    return std::log(std::max(kLeastShare, energy.energy / loudest));
  };
  double sum = 0, squares = 0, count = 0;
  for (const ConsonantEnergy& energy : tags.consonants) {
    if (!counts(energy)) continue;
    sum += level(energy);
    squares += level(energy) * level(energy);
    ++count;
  }
  if (count < 2) return accents;
  const double mean = sum / count;
  const double deviation = std::sqrt(std::max(0.0, squares / count - mean * mean));
  constexpr double kAlike = 1e-6;
  if (deviation <= kAlike) return accents;
  for (const ConsonantEnergy& energy : tags.consonants) {
    if (!counts(energy)) continue;
    if (level(energy) <= mean - deviation) accents[energy.phone.value] = 0.2;
    if (level(energy) >= mean + deviation) accents[energy.phone.value] = 0.8;
  }
  return accents;
}

PhoneValues pitchSensitivities(const SpeechLabels& labels) {
  constexpr Seconds kSpokenVowel = 0.2;
  PhoneValues sensitivities(labels.phones.size());
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    if (!isVowel(labels.phones[i].phone)) continue;
    const Seconds beyond = std::max(0.0, labels.phones[i].span.duration() - kSpokenVowel);
    sensitivities[i] = std::min(1.0, kSpokenSensitivity + beyond);
  }
  return sensitivities;
}

StyleSignal smoothedOverPhones(const PhoneValues& values, const SpeechLabels& labels, double otherwise) {
  MOUTHPIECE_EXPECT(values.size() == labels.phones.size());
  std::vector<std::size_t> own;  // phones that have a value
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] && labels.phones[i].span.duration() > 0) own.push_back(i);
  }
  // Of neighbours the signal would jump, and the face with it.
  constexpr Seconds kLongestTurn = 0.025;
  constexpr double kTurnShare = 0.25;
  StyleSignal signal;
  for (std::size_t n = 0; n < own.size(); ++n) {
    double sum = 0, weight = 0;
    for (std::size_t k = n > 0 ? n - 1 : 0; k <= std::min(n + 1, own.size() - 1); ++k) {
      const Seconds duration = labels.phones[own[k]].span.duration();
      sum += duration * *values[own[k]];
      weight += duration;
    }
    const TimeSpan& span = labels.phones[own[n]].span;
    const Seconds turn = std::min(kLongestTurn, kTurnShare * span.duration());
    const bool follows = n > 0 && labels.phones[own[n - 1]].span.end > span.start - turn;
    const bool is_followed = n + 1 < own.size() && labels.phones[own[n + 1]].span.start < span.end + turn;
    signal.points.push_back({follows ? span.start + turn : span.start, sum / weight});
    signal.points.push_back({is_followed ? span.end - turn : span.end, sum / weight});
  }
  if (signal.points.empty()) signal.points.push_back({0, otherwise});
  return signal;
}

}  // namespace mouthpiece
