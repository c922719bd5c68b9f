#include "corpus_tools/sample/actor_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json_fields.h"
#include "motion/lip_gauge.h"

namespace mouthpiece {

extern const std::string_view kSampleActorJson;

namespace {

using nlohmann::json;

/// A contribution that nobody was seen to make, as a sum of others.
struct UnheardTarget {
  std::string_view feature;
  std::array<std::pair<std::string_view, double>, 4> of;
};

// GRID's 51 words lack ER, HH, NG, OY, SH, UH and ZH. HH has the mouth of what follows it and ER is half R, half AH
// (speech_segments.cpp). For the rest:
// - SH, ZH: the lips of CH and JH, whose second part they are: palato-alveolar fricatives and affricates are alike
//   labialised (P. Ladefoged, K. Johnson, "A Course in Phonetics", 6th ed. 2011, chapter 3).
// - NG: velar as K and G; neither asks anything of the lips (the same, figure 1.5).
// - UH: near-close, near-back, rounded less than UW; half way from AH to UW. The lips of American vowels are rounded
//   the less the more open the vowel (V. Fromkin, "Lip positions in American English vowels", Language and Speech 7
//   (4), 215-225, 1964).
// - OY: from AO to where AY and EY end; ER: from R's lips, which are rounded with it (Ladefoged and Johnson, chapter
// 4).
constexpr std::array<UnheardTarget, 7> kUnheard{{
    {"phone SH", {{{"phone CH", 0.5}, {"phone JH", 0.5}}}},
    {"phone ZH", {{{"phone CH", 0.5}, {"phone JH", 0.5}}}},
    {"phone NG", {{{"phone K", 0.5}, {"phone G", 0.5}}}},
    {"phone UH", {{{"viseme Oo", 0.5}, {"phone UW", 0.5}, {"viseme Uh", -0.5}, {"phone AH", 0.5}}}},
    {"phone OY 1", {{{"phone AO", 1.0}}}},
    {"phone OY 2", {{{"phone AY 2", 0.5}, {"phone EY 2", 0.5}}}},
    {"phone ER", {{{"phone R", 0.5}, {"phone AH", 0.5}}}},
}};

/// What the model has learnt stays; a target that lacks a part is left out.
void addUnheardTargets(ActorModel& model) {
  for (const UnheardTarget& unheard : kUnheard) {
    Eigen::VectorXd target = Eigen::VectorXd::Zero(model.componentCount());
    bool is_known = true;
    for (const auto& [feature, weight] : unheard.of) {
      if (feature.empty()) continue;
      const auto found = model.targets.find(std::string(feature));
      is_known = is_known && found != model.targets.end();
      if (is_known) target += weight * found->second;
    }
    if (is_known) model.targets.try_emplace(std::string(unheard.feature), target);
  }
}

constexpr std::size_t kMostMarkers = 1000, kMostComponents = 100;
constexpr double kLargestNumber = 1e4;  ///< mm, s, units: nothing on a face comes near

Eigen::VectorXd numbers(const JsonField& list, Eigen::Index size) { return list.numbers(size, kLargestNumber); }

void readShapes(const JsonField& root, ActorModel& model) {
  model.marker_names = root["markers"].names(3, kMostMarkers);
  const Eigen::Index columns = 3 * signedIndex(model.marker_names.size());
  const Eigen::VectorXd neutral = numbers(root["neutral_mm"], columns);
  model.neutral_mm = Eigen::Map<const MarkerPositions>(neutral.data(), columns / 3, 3);
  const std::vector<JsonField> components = root["components"].list(1, kMostComponents);
  model.component_shapes.resize(signedIndex(components.size()), columns);
  Eigen::Index row = 0;
  for (const JsonField& component : components) {
    model.component_shapes.row(row++) = numbers(component["shape_mm"], columns).transpose();
    model.dynamics.push_back(
        {component["time_constant_s"].number(1e-3, 1), component["lead_s"].number(-kLargestNumber, kLargestNumber)});
  }
  model.blink_shape = numbers(root["blink_shape_mm"], columns).transpose();
  model.brow_shape = numbers(root["brow_shape_mm"], columns).transpose();
}

json rounded(const Eigen::Ref<const Eigen::VectorXd>& values, double digits) {
  json list = json::array();
  for (const double value : values) {
    const double rounded = std::round(value * digits) / digits;
    list.push_back(rounded == 0.0 ? 0.0 : rounded);
  }
  return list;
}

}  // namespace

Eigen::VectorXd ActorModel::openings() const { return LipGauge(marker_names).verticalOpenings(component_shapes); }

ActorModel parseActorModel(std::string_view json_text, std::string_view file) {
  const JsonField root = parseJson(json_text, file, "an actor model");
  ActorModel model;
  model.credit = root["credit"].text();
  readShapes(root, model);
  for (const MarkerRole lip : {MarkerRole::kUpperLip, MarkerRole::kLowerLip}) {
    if (findRole(lip, model.marker_names)) continue;
    root["markers"].fail(fmt::format("found no {}; expected it among the markers", usualName(lip)));
  }
  const Eigen::Index components = model.componentCount();
  model.gain = numbers(root["gain"], components);
  model.speech_mean = numbers(root["speech_mean"], components);
  model.closing = numbers(root["closing"], components);
  const auto closure = [&](const char* key) { return root["closures"][key].number(-kLargestNumber, kLargestNumber); };
  model.closures = {closure("bilabial_mm"), closure("labiodental_mm"), closure("contact_mm")};
  for (const auto& [feature, values] : root["targets"].members())
    model.targets.emplace(feature, numbers(values, components));
  return model;
}

std::string actorModelToJson(const ActorModel& model) {
  constexpr double kHundredths = 100, kThousandths = 1000;
  nlohmann::ordered_json root;
  root["credit"] = model.credit;
  root["markers"] = model.marker_names;
  root["neutral_mm"] =
      rounded(Eigen::Map<const Eigen::VectorXd>(model.neutral_mm.data(), model.neutral_mm.size()), kHundredths);
  for (Eigen::Index i = 0; i < model.componentCount(); ++i) {
    const ActorDynamics& dynamics = model.dynamics[unsignedIndex(i)];
    root["components"].push_back({{"time_constant_s", dynamics.time_constant},
                                  {"lead_s", dynamics.lead},
                                  {"shape_mm", rounded(model.component_shapes.row(i).transpose(), kThousandths)}});
  }
  root["blink_shape_mm"] = rounded(model.blink_shape.transpose(), kHundredths);
  root["brow_shape_mm"] = rounded(model.brow_shape.transpose(), kHundredths);
  root["gain"] = rounded(model.gain, kThousandths);
  root["speech_mean"] = rounded(model.speech_mean, kThousandths);
  root["closing"] = rounded(model.closing, 1e5);
  root["closures"] = {{"bilabial_mm", model.closures.bilabial_mm},
                      {"labiodental_mm", model.closures.labiodental_mm},
                      {"contact_mm", model.closures.contact_mm}};
  for (const auto& [feature, values] : model.targets) root["targets"][feature] = rounded(values, kThousandths);
  // A line a key or feature, so that a change shows as a few lines.
  const std::string dense = root.dump();
  std::string text;
  for (const char byte : dense) {
    if (byte == '"' && text.ends_with("],")) text += '\n';
    text += byte;
  }
  return text + "\n";
}

const ActorModel& sampleActor() {
  static const ActorModel model = [] {
    ActorModel learnt = parseActorModel(kSampleActorJson, "grid_s1_actor.json (built in)");
    addUnheardTargets(learnt);
    return learnt;
  }();
  return model;
}

}  // namespace mouthpiece
