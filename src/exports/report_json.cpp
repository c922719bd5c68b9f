#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/index.h"
#include "base/json_text.h"
#include "exports/arkit.h"
#include "exports/format_bytes.h"
#include "exports/line_quality.h"
#include "exports/report_fields.h"

namespace mouthpiece {
namespace {

using nlohmann::ordered_json;

/// Nothing here is known to better than a microsecond or a micrometre; shorter numbers are easier to read.
double toMicro(double value) { return std::round(value * 1e6) / 1e6; }

ordered_json phonesOf(const UtteranceAnimation& animation) {
  std::vector<bool> is_made(animation.labels.phones.size(), false);  // by curves
  for (const PlacedUnit& unit : animation.units) {
    for (std::size_t i = unit.phones.first.value;
         unit.is_backoff && i < std::min(is_made.size(), unit.phones.last.value + 1); ++i)
      is_made[i] = true;
  }
  ordered_json phones = ordered_json::array();
  for (std::size_t i = 0; i < animation.labels.phones.size(); ++i) {
    const LabelledPhone& phone = animation.labels.phones[i];
    // In a sung line vowels are made of curves, whatever lies under them.
    const bool is_backoff = is_made[i] || (!animation.style.empty() && isVowel(phone.phone));
    phones.push_back({{"phone", phone.name()},
                      {"start_s", toMicro(phone.span.start)},
                      {"end_s", toMicro(phone.span.end)},
                      {"word", animation.labels.wordOf(PhoneIndex(i))},
                      {"from", is_backoff ? "backoff" : "unit"}});
    // "no no": the words' names alone would make one of them.
    const bool says_again = i > 0 && phone.word && animation.labels.phones[i - 1].word &&
                            *phone.word != *animation.labels.phones[i - 1].word &&
                            phones[i]["word"] == phones[i - 1]["word"];
    if (says_again) phones.back()["says_again"] = true;
  }
  return phones;
}

/// Words that no dictionary has, with what is said for them.
ordered_json guessesOf(const UtteranceAnimation& animation) {
  const SpeechLabels& labels = animation.labels;
  ordered_json guesses = ordered_json::array();
  for (const std::size_t i : animation.guessed_words) {
    const LabelledWord& word = labels.words[i];
    ordered_json phones = ordered_json::array();
    for (std::size_t phone = word.phones.first.value; phone <= word.phones.last.value; ++phone)
      phones.push_back(labels.phones[phone].name());
    guesses.push_back(
        {{"word", word.text}, {"start_s", toMicro(labels.spanOf(word.phones).start)}, {"phones", std::move(phones)}});
  }
  return guesses;
}

ordered_json unitsOf(const UtteranceAnimation& animation) {
  ordered_json units = ordered_json::array();
  for (const PlacedUnit& unit : animation.units) {
    units.push_back({{"first", unit.phones.first.value},
                     {"last", unit.phones.last.value},
                     {"take", unit.take},
                     {"source_first", unit.source_first.value},
                     {"source_start_s", toMicro(unit.source_span.start)},
                     {"source_end_s", toMicro(unit.source_span.end)},
                     {"start_s", toMicro(unit.span.start)},
                     {"end_s", toMicro(unit.span.end)},
                     {"scale", unit.scale},
                     {"cost", toMicro(unit.cost)},
                     {"backoff", unit.is_backoff}});
    if (unit.sound.duration() > 0) units.back()["sound"] = {toMicro(unit.sound.start), toMicro(unit.sound.end)};
  }
  return units;
}

ordered_json joinsOf(const UtteranceAnimation& animation) {
  ordered_json joins = ordered_json::array();
  for (const Join& join : animation.joins) {
    joins.push_back({{"time_s", toMicro(join.time)},
                     {"position_jump_mm", toMicro(join.position_jump_mm)},
                     {"velocity_jump_mm_s", toMicro(join.velocity_jump_mm_s)}});
  }
  return joins;
}

ordered_json backoffOf(const UtteranceAnimation& animation) {
  ordered_json backoff = ordered_json::array();
  for (const PlacedUnit& unit : animation.units) {
    if (unit.is_backoff) backoff.push_back({{"first", unit.phones.first.value}, {"last", unit.phones.last.value}});
  }
  return backoff;
}

/// What moved the lips, of the whole line and second by second.
ordered_json movedByOf(const UtteranceAnimation& animation) {
  const auto sharesOf = [](const MovementShares& shares) -> ordered_json {
    return {{"capture", rounded(shares.capture)},
            {"prediction", rounded(shares.prediction)},
            {"curves", rounded(shares.curves)},
            {"contact", rounded(shares.contact)}};
  };
  MovementShares all;
  double weight = 0;
  ordered_json seconds = ordered_json::array();
  for (const MovementShares& second : animation.shares) {
    const double own = second.movement_mm * second.movement_mm;
    weight += own;
    for (const auto share :
         {&MovementShares::capture, &MovementShares::prediction, &MovementShares::curves, &MovementShares::contact})
      all.*share += own * second.*share;
    ordered_json entry = {{"start_s", rounded(second.start)}, {"movement_mm", rounded(second.movement_mm)}};
    entry.update(sharesOf(second));
    seconds.push_back(std::move(entry));
  }
  for (const auto share :
       {&MovementShares::capture, &MovementShares::prediction, &MovementShares::curves, &MovementShares::contact})
    all.*share /= weight > 0 ? weight : 1;
  return {{"line", sharesOf(all)}, {"seconds", std::move(seconds)}};
}

ordered_json settingsOf(const UtteranceAnimation& animation) {
  ordered_json settings = ordered_json::object();
  for (const SettingUsed& setting : animation.settings) settings[setting.name] = setting.value;
  return settings;
}

/// What the fields are made of.
struct Told {
  const UtteranceAnimation& animation;
  const StageTimings& timing;
  const ArkitCurves* of_head;

  [[nodiscard]] Seconds duration() const {
    return animation.motion.frameCount() > 0 ? animation.motion.duration() : animation.labels.duration();
  }
};

ordered_json mouthOf(const Told& told) {
  ordered_json mouth = {{"bilabials", told.animation.mouth.bilabials},
                        {"closures", told.animation.mouth.closures},
                        {"jitter_mm", toMicro(told.animation.mouth.jitter_mm)}};
  if (told.of_head != nullptr) {
    mouth["shapes"] = {{"closed_frames", told.of_head->closures},
                       {"kept", told.of_head->closures_kept},
                       {"rms_error_mm", toMicro(told.of_head->rms_error_mm)},
                       {"rms_motion_mm", toMicro(told.of_head->rms_motion_mm)}};
  }
  return mouth;
}

ordered_json timingOf(const StageTimings& timing) {
  return {{"load", toMicro(timing.load)},           {"speech", toMicro(timing.speech)},
          {"selection", toMicro(timing.selection)}, {"motion", toMicro(timing.motion)},
          {"retarget", toMicro(timing.retarget)},   {"deform", toMicro(timing.deform)},
          {"write", toMicro(timing.write)}};
}

double realTimeFactor(const Told& told) {
  const StageTimings& timing = told.timing;
  const double work_ms =
      timing.load + timing.selection + timing.motion + timing.retarget + timing.deform + timing.write;
  return told.duration() > 0 ? toMicro(work_ms / 1000 / told.duration()) : 0.0;
}

struct Field {
  const char* name;
  ordered_json (*value)(const Told&);
};

constexpr Field kFields[] = {
    {"text", [](const Told& told) -> ordered_json { return told.animation.text; }},
    {"voice", [](const Told& told) -> ordered_json { return told.animation.voice; }},
    {"corpus", [](const Told& told) -> ordered_json { return told.animation.corpus; }},
    {"method", [](const Told& told) -> ordered_json { return told.animation.method; }},
    {"settings", [](const Told& told) { return settingsOf(told.animation); }},
    {"moved_by", [](const Told& told) { return movedByOf(told.animation); }},
    {"fps", [](const Told& told) -> ordered_json { return told.animation.motion.frame_rate_hz; }},
    {"frames", [](const Told& told) -> ordered_json { return told.animation.motion.frameCount(); }},
    {"duration_s", [](const Told& told) -> ordered_json { return toMicro(told.duration()); }},
    {"phones", [](const Told& told) { return phonesOf(told.animation); }},
    {"guesses", [](const Told& told) { return guessesOf(told.animation); }},
    {"units", [](const Told& told) { return unitsOf(told.animation); }},
    {"joins", [](const Told& told) { return joinsOf(told.animation); }},
    {"backoff", [](const Told& told) { return backoffOf(told.animation); }},
    {"backoff_share", [](const Told& told) -> ordered_json { return toMicro(backoffShare(told.animation)); }},
    {"style", [](const Told& told) -> ordered_json { return told.animation.style; }},
    {"mouth", mouthOf},
    {"warnings", [](const Told& told) -> ordered_json { return told.animation.warnings; }},
    {"notices", [](const Told& told) -> ordered_json { return told.animation.notices; }},
    {"timing_ms", [](const Told& told) { return timingOf(told.timing); }},
    {"real_time_factor", [](const Told& told) -> ordered_json { return realTimeFactor(told); }}};

}  // namespace

ordered_json reportFields(const UtteranceAnimation& animation, const StageTimings& timing) {
  ordered_json fields = ordered_json::object();
  for (const Field& field : kFields) fields[field.name] = field.value({animation, timing, nullptr});
  return fields;
}

/// Field by field: the whole tree of an hour takes several times its text.
std::string reportJson(const UtteranceAnimation& animation, const StageTimings& timing, const ArkitCurves* of_head) {
  constexpr std::size_t kRest = 10'000;  // letters of the small fields that follow a large one
  std::string text = "{";
  for (const Field& field : kFields) {
    if (text.size() > 1) text += ',';
    text += fmt::format("\n \"{}\": ", field.name);
    const std::string shown = jsonText(field.value({animation, timing, of_head}), 1);
    text.reserve(text.size() + shown.size() + unsignedIndex(std::count(shown.begin(), shown.end(), '\n')) + kRest);
    for (const char letter : shown) {
      text += letter;
      if (letter == '\n') text += ' ';  // one level deeper; a line's end within a string is written as two letters
    }
  }
  return text + "\n}\n";
}

}  // namespace mouthpiece
