#include "page_engine/package_options.h"

#include <array>
#include <nlohmann/json.hpp>
#include <utility>

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr double kMostInSignal = 1e6;

/// Switches in the order of the file.
auto switchesOf(auto& options) {
  return std::array{&options.search_coupling,
                    &options.context.enabled,
                    &options.context.fragments,
                    &options.context.average,
                    &options.context.restore_variance,
                    &options.context.restore_unsaid,
                    &options.context.keep_contacts,
                    &options.context.keep_heard,
                    &options.context.hear,
                    &options.departures.silences_keep_their_pace,
                    &options.departures.joins_where_lips_agree,
                    &options.departures.offsets_led_away,
                    &options.departures.lids_rest,
                    &options.curves.fill_gaps,
                    &options.curves.before_stand_ins,
                    &options.expression.gaze,
                    &options.expression.head};
}

auto wishesOf(auto& curves) { return std::array{&curves.ma, &curves.ps, &curves.ja, &curves.li}; }

json signalToJson(const StyleSignal& signal) {
  json points = json::array();
  for (const StyleSignal::Point& point : signal.points) points.push_back({point.time, point.value});
  return points;
}

StyleSignal signalFrom(const JsonField& field) {
  StyleSignal signal;
  for (const JsonField& point : field.list()) {
    const Eigen::VectorXd numbers = point.numbers(2, kMostInSignal);
    if (!signal.points.empty() && !(numbers(0) > signal.points.back().time)) point.refuse("rising times");
    signal.points.push_back({numbers(0), numbers(1)});
  }
  return signal;
}

}  // namespace

json optionsToJson(const SynthesisOptions& options) {
  json switches = json::array(), wishes = json::array(), dials = json::array();
  for (const bool* on : switchesOf(options)) switches.push_back(*on);
  for (const StyleWish* wish : wishesOf(options.curves))
    wishes.push_back(wish->given ? signalToJson(*wish->given) : json());
  for (const DialRow& dial : kSpeechDials) dials.push_back(signalToJson(options.dials.*dial.signal));
  return {{"frame_rate_hz", options.frame_rate_hz},
          {"method", static_cast<int>(options.selection.method)},
          {"units", static_cast<int>(options.selection.units)},
          {"blend", static_cast<int>(options.blend)},
          {"overlap_ms", options.overlap_ms},
          {"switches", std::move(switches)},
          {"wishes", std::move(wishes)},
          {"dials", std::move(dials)},
          {"rules", options.expression.upper_face == UpperFaceSource::kRules},
          {"mood", options.expression.mood},
          {"seed", options.expression.seed}};
}

SynthesisOptions optionsFrom(const JsonField& field) {
  SynthesisOptions options;
  options.frame_rate_hz = field["frame_rate_hz"].number(1, 1000);
  options.selection.method =
      static_cast<SelectionMethod>(field["method"].whole(0, static_cast<int>(SelectionMethod::kViterbi)));
  options.selection.units = static_cast<UnitScales>(field["units"].whole(0, static_cast<int>(UnitScales::kPaper)));
  options.blend = static_cast<BlendKind>(field["blend"].whole(0, static_cast<int>(BlendKind::kExponential)));
  options.overlap_ms = field["overlap_ms"].number(0, 1000);
  const auto switches = switchesOf(options);
  const std::vector<JsonField> given = field["switches"].list(switches.size(), switches.size());
  for (std::size_t i = 0; i < switches.size(); ++i) *switches[i] = given[i].flag();
  const auto wishes = wishesOf(options.curves);
  const std::vector<JsonField> wanted = field["wishes"].list(wishes.size(), wishes.size());
  for (std::size_t i = 0; i < wishes.size(); ++i) {
    if (!wanted[i].isNull()) wishes[i]->given = signalFrom(wanted[i]);
  }
  const std::vector<JsonField> dials = field["dials"].list(kSpeechDials.size(), kSpeechDials.size());
  for (std::size_t i = 0; i < dials.size(); ++i) options.dials.*kSpeechDials[i].signal = signalFrom(dials[i]);
  options.expression.upper_face = field["rules"].flag() ? UpperFaceSource::kRules : UpperFaceSource::kMouth;
  const Eigen::VectorXd mood = field["mood"].numbers(std::ssize(options.expression.mood), 1);
  std::copy(mood.begin(), mood.end(), options.expression.mood.begin());
  options.expression.seed = static_cast<std::uint32_t>(field["seed"].whole(0, UINT32_MAX));
  return options;
}

}  // namespace mouthpiece
