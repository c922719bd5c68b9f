// Moods by the action units of EMFACS (Friesen and Ekman 1983), drawn by the shapes of ARKit that show them.
#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/files.h"
#include "base/json_fields.h"
#include "base/text_numbers.h"
#include "expression/expression.h"

namespace mouthpiece {
namespace {

struct ShapeShare {
  std::string_view shape;  ///< without Left and Right: both
  double share;
};
struct MoodRow {
  std::string_view name;
  std::array<ShapeShare, 6> shapes;
};
constexpr std::array<MoodRow, 6> kMoods{{
    {"anger", {{{"BrowDown", 0.9}, {"EyeSquint", 0.5}, {"EyeWide", 0.3}, {"NoseSneer", 0.3}, {"MouthPress", 0.35}}}},
    {"contempt", {{{"MouthDimpleLeft", 0.7}, {"MouthSmileLeft", 0.25}, {"EyeSquint", 0.15}}}},
    {"disgust", {{{"NoseSneer", 0.8}, {"BrowDown", 0.4}, {"EyeSquint", 0.4}, {"MouthFrown", 0.35}}}},
    {"joy", {{{"MouthSmile", 0.55}, {"CheekSquint", 0.6}, {"EyeSquint", 0.3}, {"BrowOuterUp", 0.1}}}},
    {"sadness", {{{"BrowInnerUp", 0.7}, {"BrowDown", 0.25}, {"MouthFrown", 0.6}, {"MouthShrugLower", 0.15}}}},
    {"surprise", {{{"BrowInnerUp", 0.8}, {"BrowOuterUp", 0.8}, {"EyeWide", 0.7}, {"JawOpen", 0.06}}}},
}};
constexpr std::uint64_t kMostMoodBytes = 1 << 16;

MoodPose poseOf(const MoodRow& row) {
  MoodPose pose{};
  for (std::size_t i = 0; i < kArkitNames.size(); ++i) {
    for (const ShapeShare& part : row.shapes) {
      if (part.shape.empty()) continue;
      const std::string_view side =
          kArkitNames[i].starts_with(part.shape) ? kArkitNames[i].substr(part.shape.size()) : std::string_view("other");
      if (side.empty() || side == "Left" || side == "Right") pose[i] = part.share;
    }
  }
  return pose;
}

MoodPose poseIn(const std::string& file) {
  MoodPose pose{};
  for (const auto& [name, field] : parseJson(readFile(file, kMostMoodBytes), file, "weights").members()) {
    const int shape = arkitIndex(name);
    if (shape < 0) field.fail(fmt::format("found the shape {}; expected one of ARKit's 52", printable(name)));
    pose[static_cast<std::size_t>(shape)] = field.number(0, 1);
  }
  return pose;
}

}  // namespace

std::vector<std::string_view> moodNames() {
  std::vector<std::string_view> names;
  for (const MoodRow& row : kMoods) names.push_back(row.name);
  return names;
}

MoodPose moodOf(const std::string& wish) {
  std::string name = wish;
  double strength = 1;
  if (const std::size_t colon = wish.rfind(':'); colon != std::string::npos) {
    const std::optional<double> given = parseNumber(wish.substr(colon + 1));
    if (!given || !(*given >= 0 && *given <= 1))
      throw InputError("mood", "",
                       fmt::format("found the strength '{}'; expected 0 to 1", printable(wish.substr(colon + 1))));
    strength = *given;
    name = wish.substr(0, colon);
  }
  const auto row = std::find_if(kMoods.begin(), kMoods.end(), [&](const MoodRow& mood) { return mood.name == name; });
  if (row == kMoods.end() && !name.ends_with(".json")) {
    std::string known;
    for (const MoodRow& mood : kMoods) known += fmt::format("{}, ", mood.name);
    throw InputError("mood", "",
                     fmt::format("found '{}'; expected {}or a file of weights (.json)", printable(name), known));
  }
  MoodPose pose = row != kMoods.end() ? poseOf(*row) : poseIn(name);
  for (double& weight : pose) weight *= strength;
  return pose;
}

bool ExpressionOptions::hasMood() const {
  return std::any_of(mood.begin(), mood.end(), [](double weight) { return weight > 0; });
}

}  // namespace mouthpiece
