#include "corpus_tools/sample/actor_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "motion/lip_gauge.h"

namespace mouthpiece {

extern const std::string_view kSampleActorJson;

namespace {

using nlohmann::json;

constexpr std::size_t kMostMarkers = 1000, kMostComponents = 100;
constexpr double kLargestNumber = 1e4;  ///< mm, s, units: nothing on a face comes near

/// Reads an actor model, naming the key of what is wrong.
class ModelReader {
 public:
  ModelReader(const json& root, std::string_view file) : root_(root), file_(file) {}

  [[noreturn]] void fail(const std::string& key, const std::string& what) const { throw InputError(file_, key, what); }

  [[nodiscard]] const json& at(const json& parent, const std::string& key) const {
    if (!parent.is_object() || !parent.contains(key)) fail(key, "found nothing; expected this key");
    return parent.at(key);
  }

  [[nodiscard]] double number(const json& value, const std::string& key) const {
    if (!value.is_number() || !(std::abs(value.get<double>()) < kLargestNumber)) {
      fail(key, fmt::format("found {}; expected a number", printable(value.dump(-1, ' ', true))));
    }
    return value.get<double>();
  }

  /// A list of exactly `size` numbers.
  [[nodiscard]] Eigen::VectorXd vector(const json& list, const std::string& key, Eigen::Index size) const {
    if (!list.is_array() || list.size() != static_cast<std::size_t>(size)) {
      fail(key, fmt::format("found {} numbers; expected {}", list.is_array() ? list.size() : 0, size));
    }
    Eigen::VectorXd values(size);
    for (Eigen::Index i = 0; i < size; ++i) values(i) = number(list[static_cast<std::size_t>(i)], key);
    return values;
  }
  [[nodiscard]] Eigen::VectorXd vector(const std::string& key, Eigen::Index size) const {
    return vector(at(root_, key), key, size);
  }

  [[nodiscard]] std::size_t listSize(const std::string& key, std::size_t least, std::size_t most) const {
    const json& list = at(root_, key);
    if (!list.is_array() || list.size() < least || list.size() > most) {
      fail(key, fmt::format("found {} entries; expected {} to {}", list.is_array() ? list.size() : 0, least, most));
    }
    return list.size();
  }

  [[nodiscard]] std::string text(const json& value, const std::string& key) const {
    if (!value.is_string()) fail(key, "found no text; expected one");
    return value.get<std::string>();
  }

 private:
  const json& root_;
  std::string_view file_;
};

void readShapes(const ModelReader& reader, const json& root, ActorModel& model) {
  const std::size_t markers = reader.listSize("markers", 3, kMostMarkers);
  for (const json& name : root["markers"]) model.marker_names.push_back(reader.text(name, "markers"));
  const auto columns = static_cast<Eigen::Index>(3 * markers);
  const Eigen::VectorXd neutral = reader.vector("neutral_mm", columns);
  model.neutral_mm = Eigen::Map<const MarkerPositions>(neutral.data(), columns / 3, 3);
  const std::size_t components = reader.listSize("components", 1, kMostComponents);
  model.component_shapes.resize(static_cast<Eigen::Index>(components), columns);
  for (std::size_t i = 0; i < components; ++i) {
    const json& component = root["components"][i];
    const auto row = static_cast<Eigen::Index>(i);
    model.component_shapes.row(row) = reader.vector(reader.at(component, "shape_mm"), "shape_mm", columns).transpose();
    const double time_constant = reader.number(reader.at(component, "time_constant_s"), "time_constant_s");
    if (time_constant < 1e-3 || time_constant > 1) reader.fail("time_constant_s", "expected 0.001 to 1");
    model.dynamics.push_back({time_constant, reader.number(reader.at(component, "lead_s"), "lead_s")});
  }
  model.blink_shape = reader.vector("blink_shape_mm", columns).transpose();
  model.brow_shape = reader.vector("brow_shape_mm", columns).transpose();
}

json numbers(const Eigen::Ref<const Eigen::VectorXd>& values, double digits) {
  json list = json::array();
  for (const double value : values) {
    const double rounded = std::round(value * digits) / digits;
    list.push_back(rounded == 0.0 ? 0.0 : rounded);
  }
  return list;
}

}  // namespace

Eigen::VectorXd ActorModel::openings() const {
  return LipGauge(marker_names).verticalOpenings(component_shapes);
}

ActorModel parseActorModel(std::string_view json_text, std::string_view file) {
  const json root = json::parse(json_text, nullptr, false);
  if (!root.is_object()) throw InputError(file, "", "found no JSON object; expected an actor model");
  const ModelReader reader(root, file);
  ActorModel model;
  model.credit = reader.text(reader.at(root, "credit"), "credit");
  readShapes(reader, root, model);
  for (const MarkerRole lip : {MarkerRole::kUpperLip, MarkerRole::kLowerLip}) {
    if (findRole(lip, model.marker_names)) continue;
    reader.fail("markers", fmt::format("found no {}; expected it among the markers", usualName(lip)));
  }
  const Eigen::Index components = model.componentCount();
  model.gain = reader.vector("gain", components);
  model.speech_mean = reader.vector("speech_mean", components);
  model.closing = reader.vector("closing", components);
  const json& closures = reader.at(root, "closures");
  model.closures = {reader.number(reader.at(closures, "bilabial_mm"), "bilabial_mm"),
                    reader.number(reader.at(closures, "labiodental_mm"), "labiodental_mm"),
                    reader.number(reader.at(closures, "contact_mm"), "contact_mm")};
  const json& targets = reader.at(root, "targets");
  if (!targets.is_object()) reader.fail("targets", "found no object; expected the features' targets");
  for (const auto& [feature, values] : targets.items()) {
    model.targets.emplace(feature, reader.vector(values, "targets/" + printable(feature), components));
  }
  return model;
}

std::string actorModelToJson(const ActorModel& model) {
  constexpr double kHundredths = 100, kThousandths = 1000;
  nlohmann::ordered_json root;
  root["credit"] = model.credit;
  root["markers"] = model.marker_names;
  root["neutral_mm"] =
      numbers(Eigen::Map<const Eigen::VectorXd>(model.neutral_mm.data(), model.neutral_mm.size()), kHundredths);
  for (Eigen::Index i = 0; i < model.componentCount(); ++i) {
    const ActorDynamics& dynamics = model.dynamics[static_cast<std::size_t>(i)];
    root["components"].push_back({{"time_constant_s", dynamics.time_constant},
                                  {"lead_s", dynamics.lead},
                                  {"shape_mm", numbers(model.component_shapes.row(i).transpose(), kThousandths)}});
  }
  root["blink_shape_mm"] = numbers(model.blink_shape.transpose(), kHundredths);
  root["brow_shape_mm"] = numbers(model.brow_shape.transpose(), kHundredths);
  root["gain"] = numbers(model.gain, kThousandths);
  root["speech_mean"] = numbers(model.speech_mean, kThousandths);
  root["closing"] = numbers(model.closing, 1e5);
  root["closures"] = {{"bilabial_mm", model.closures.bilabial_mm},
                      {"labiodental_mm", model.closures.labiodental_mm},
                      {"contact_mm", model.closures.contact_mm}};
  for (const auto& [feature, values] : model.targets) root["targets"][feature] = numbers(values, kThousandths);
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
  static const ActorModel model = parseActorModel(kSampleActorJson, "grid_s1_actor.json (built in)");
  return model;
}

}  // namespace mouthpiece
