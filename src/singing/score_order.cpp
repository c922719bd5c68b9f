#include "singing/score_order.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

constexpr double kScoreTempo = 100, kSlowestScore = 10, kFastestScore = 600;  // quarters a minute
constexpr double kMostBeats = 1e4;                                            // of a note
constexpr std::size_t kMostPlayed = 20'000;                                   // measures
constexpr int kMostTimes = 64;                                                // of a repeat

/// What a measure says of where to go on.
struct Signs {
  bool repeat_begins = false, da_capo = false, fine = false;
  std::string segno, dal_segno, coda, to_coda;
  int repeat_times = 0;    ///< of the repeat that ends here
  std::set<int> endings;   ///< that hold in this measure; none: all do
  bool ends_here = false;  ///< the ending
};

std::set<int> endingNumbers(std::string_view text) {
  std::set<int> numbers;
  std::vector<std::string_view> fields;
  splitFields(text, ',', fields);
  for (const std::string_view field : fields) {
    if (const auto number = parseNumber(field); number && *number >= 1 && *number <= kMostTimes)
      numbers.insert(static_cast<int>(*number));
  }
  return numbers;
}

void readSound(const pugi::xml_node& sound, Signs& signs) {
  if (!sound) return;
  signs.da_capo |= std::string_view(sound.attribute("dacapo").as_string()) == "yes";
  signs.fine = signs.fine || !sound.attribute("fine").empty();
  for (const auto& [name, sign] : {std::pair{"segno", &signs.segno}, std::pair{"dalsegno", &signs.dal_segno},
                                   std::pair{"coda", &signs.coda}, std::pair{"tocoda", &signs.to_coda}}) {
    if (const pugi::xml_attribute value = sound.attribute(name)) *sign = value.as_string();
  }
}

std::vector<Signs> signsOf(const pugi::xml_node& score, const pugi::xml_node& part) {
  std::vector<Signs> all;
  std::set<int> endings;
  for (const pugi::xml_node& measure : part.children("measure")) {
    Signs& signs = all.emplace_back();
    bool stops = false;
    for (const pugi::xml_node& line : measure.children("barline")) {
      const pugi::xml_node repeat = line.child("repeat"), ending = line.child("ending");
      const std::string_view direction = repeat.attribute("direction").as_string();
      signs.repeat_begins |= direction == "forward";
      if (direction == "forward") endings.clear();  // a last ending may have no end of its own
      if (direction == "backward") signs.repeat_times = std::clamp(repeat.attribute("times").as_int(2), 1, kMostTimes);
      const std::string_view type = ending.attribute("type").as_string();
      if (type == "start") endings = endingNumbers(ending.attribute("number").as_string());
      stops |= type == "stop" || type == "discontinue";
    }
    signs.endings = endings;
    signs.ends_here = stops;
    if (stops) endings.clear();
  }
  for (const pugi::xml_node& any : score.children("part")) {
    std::size_t index = 0;
    for (const pugi::xml_node& measure : any.children("measure")) {
      if (index == all.size()) break;
      readSound(measure.child("sound"), all[index]);
      for (const pugi::xml_node& direction : measure.children("direction"))
        readSound(direction.child("sound"), all[index]);
      ++index;
    }
  }
  return all;
}

/// Goes through the measures as a player does.
class Player {
 public:
  explicit Player(std::vector<Signs> signs) : signs_(std::move(signs)), played_(signs_.size(), 0) {}

  /// Nothing when it never ends.
  std::optional<std::vector<PlayedMeasure>> play() {
    std::vector<PlayedMeasure> order;
    while (at_ < signs_.size()) {
      if (order.size() == kMostPlayed) return std::nullopt;
      const Signs& here = signs_[at_];
      if (here.repeat_begins && at_ != begin_) {
        begin_ = at_;
        pass_ = 1;
      }
      if (isLeftOut(here)) {
        ++at_;
        continue;
      }
      order.push_back({at_, played_[at_]++});
      if (!goOn(here)) break;
    }
    return order;
  }

 private:
  [[nodiscard]] bool anotherEndingFollows(std::size_t measure) const {
    while (measure < signs_.size() && !signs_[measure].ends_here) ++measure;
    return measure + 1 < signs_.size() && !signs_[measure + 1].endings.empty();
  }

  /// By a jump: what lies behind the one that it was made from has not been played yet.
  [[nodiscard]] bool isPlayedAgain() const { return has_jumped_ && at_ <= jumped_from_; }

  [[nodiscard]] bool isLeftOut(const Signs& here) const {
    if (here.endings.empty()) return false;
    return isPlayedAgain() ? anotherEndingFollows(at_) : !here.endings.contains(pass_);
  }

  [[nodiscard]] bool isRepeated(const Signs& here) const {
    if (here.repeat_times == 0 || isPlayedAgain()) return false;
    if (here.endings.empty()) return pass_ < here.repeat_times;
    return here.endings.contains(pass_ + 1) ||
           (pass_ == *here.endings.rbegin() && (here.endings.contains(1) || anotherEndingFollows(at_)));
  }

  std::optional<std::size_t> measureOf(std::string Signs::*sign, const std::string& wanted) const {
    const auto found =
        std::find_if(signs_.begin(), signs_.end(), [&](const Signs& signs) { return signs.*sign == wanted; });
    return found == signs_.end() ? std::nullopt : std::optional(unsignedIndex(found - signs_.begin()));
  }

  /// Takes the step to the next measure; false at the end.
  bool goOn(const Signs& here) {
    if (has_jumped_ && here.fine) return false;
    if (has_jumped_ && !here.to_coda.empty()) {
      if (const auto coda = measureOf(&Signs::coda, here.to_coda); coda && *coda > at_) {
        at_ = begin_ = *coda;
        pass_ = 1;
        return true;
      }
    }
    if (isRepeated(here)) {
      ++pass_;
      at_ = begin_;
      return true;
    }
    if (here.repeat_times > 0 && !(!here.endings.empty() && anotherEndingFollows(at_))) {
      begin_ = at_ + 1;
      pass_ = 1;
    }
    const bool jumps = !has_jumped_ && (here.da_capo || !here.dal_segno.empty());
    const auto segno = here.da_capo ? std::optional<std::size_t>(0) : measureOf(&Signs::segno, here.dal_segno);
    if (jumps && segno && *segno <= at_) {
      has_jumped_ = true;
      jumped_from_ = at_;
      at_ = *segno;
      return true;
    }
    ++at_;
    if (has_jumped_ && at_ == jumped_from_ + 1) {
      begin_ = at_;
      pass_ = 1;
    }
    return true;
  }

  std::vector<Signs> signs_;
  std::vector<std::size_t> played_;
  std::size_t at_ = 0, begin_ = 0, jumped_from_ = 0;
  int pass_ = 1;
  bool has_jumped_ = false;
};

double numberIn(const pugi::xml_node& node, const char* what, std::string_view name, std::string_view place) {
  const auto value = parseNumber(node.child_value());
  if (!value || !std::isfinite(*value))
    throw InputError(name, place,
                     fmt::format("has {} '{}'; expected a number", what, printable(node.child_value(), 20)));
  return *value;
}

/// Quarters a minute of a metronome mark: "dotted quarter = 60", "half = c. 80".
std::optional<double> metronomeTempo(const pugi::xml_node& mark) {
  constexpr std::array<std::pair<std::string_view, double>, 6> kUnits{
      {{"whole", 4}, {"half", 2}, {"quarter", 1}, {"eighth", 0.5}, {"16th", 0.25}, {"breve", 8}}};
  const std::string_view unit = mark.child_value("beat-unit"), text = mark.child_value("per-minute");
  const auto known =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const auto& candidate) { return candidate.first == unit; });
  const std::size_t first = text.find_first_of("0123456789");
  if (known == kUnits.end() || first == std::string_view::npos) return std::nullopt;
  const auto value = parseNumber(text.substr(first, text.find_first_not_of("0123456789.", first) - first));
  double quarters = known->second, dot = known->second;
  for ([[maybe_unused]] const pugi::xml_node& each : mark.children("beat-unit-dot")) quarters += dot /= 2;
  return value ? std::optional(*value * quarters) : std::nullopt;
}

/// What a direction, or a sound that stands alone, says of the tempo.
std::optional<double> tempoOf(const pugi::xml_node& element, std::string_view name, std::string_view place) {
  const bool is_direction = std::string_view(element.name()) == "direction";
  const pugi::xml_node sound = is_direction ? element.child("sound") : element;
  if (const pugi::xml_attribute tempo = sound.attribute("tempo")) {
    const auto value = parseNumber(tempo.as_string());
    if (!value || !std::isfinite(*value))
      throw InputError(name, place, "has a tempo that is no number; expected beats a minute");
    return value;
  }
  for (const pugi::xml_node& type : element.children("direction-type")) {
    if (const auto tempo = metronomeTempo(type.child("metronome"))) return tempo;
  }
  return std::nullopt;
}

}  // namespace

std::vector<PlayedMeasure> playedMeasures(const pugi::xml_node& score, const pugi::xml_node& part,
                                          std::string_view name) {
  auto order = Player(signsOf(score, part)).play();
  if (!order) throw InputError(name, "", fmt::format("repeats over {} measures; expected fewer", kMostPlayed));
  return std::move(*order);
}

ScoreTempos::ScoreTempos(const pugi::xml_node& score, std::string_view name) {
  for (const pugi::xml_node& part : score.children("part")) {
    double divisions = 1;
    std::size_t index = 0;
    for (const pugi::xml_node& measure : part.children("measure")) {
      const std::string place = placeOfMeasure(measure);
      double quarters = 0;
      for (const pugi::xml_node& element : measure.children()) {
        passElement(element, divisions, quarters, name, place);
        const std::string_view kind = element.name();
        if (kind != "sound" && kind != "direction") continue;
        const auto tempo = tempoOf(element, name, place);
        if (!tempo) continue;
        if (!(*tempo >= kSlowestScore && *tempo <= kFastestScore))
          throw InputError(name, place,
                           fmt::format("has a tempo of {:g} beats a minute; expected {} to {}", *tempo, kSlowestScore,
                                       kFastestScore));
        tempos_.emplace(std::pair(index, quarters), *tempo);
      }
      ++index;
    }
  }
  const double first = tempos_.empty() ? kScoreTempo : tempos_.begin()->second;
  tempos_.emplace(std::pair(std::size_t{0}, 0.0), first);
}

Seconds ScoreTempos::between(std::size_t measure, double from, double to) const {
  auto next = tempos_.upper_bound({measure, from});
  double tempo = next == tempos_.begin() ? next->second : std::prev(next)->second;
  Seconds seconds = 0;
  for (; next != tempos_.end() && next->first < std::pair(measure, to); ++next) {
    seconds += (next->first.second - from) * 60 / tempo;
    from = next->first.second;
    tempo = next->second;
  }
  return seconds + (to - from) * 60 / tempo;
}

void passElement(const pugi::xml_node& element, double& divisions, double& quarters, std::string_view name,
                 std::string_view place) {
  const std::string_view kind = element.name();
  if (kind == "attributes" && element.child("divisions")) {
    divisions = numberIn(element.child("divisions"), "divisions", name, place);
    if (!(divisions > 0 && divisions <= 1e6))
      throw InputError(name, place, fmt::format("has {:g} divisions; expected 1 or more", divisions));
  }
  if (kind != "note" && kind != "forward" && kind != "backup") return;
  if (kind == "note" && (element.child("chord") || element.child("grace"))) return;
  if (!element.child("duration"))
    throw InputError(name, place, fmt::format("has a {} without duration; expected one", kind));
  const double beats = numberIn(element.child("duration"), "a duration", name, place) / divisions;
  if (!(beats >= 0 && beats <= kMostBeats))
    throw InputError(name, place, fmt::format("has a {} of {:g} beats", kind, beats));
  quarters = std::max(0.0, kind == "backup" ? quarters - beats : quarters + beats);
}

std::string placeOfMeasure(const pugi::xml_node& measure) {
  return fmt::format("measure {}", printable(measure.attribute("number").as_string("?"), 12));
}

}  // namespace mouthpiece
