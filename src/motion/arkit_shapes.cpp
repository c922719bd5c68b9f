#include "motion/arkit_shapes.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <nlohmann/json.hpp>

#include "base/index.h"

namespace mouthpiece {

extern const std::string_view kArkitMarkersJson;

namespace {

/// Lower case, letters and digits only; a final side letter ("_l", ".L", "eyeBlinkL") written out.
std::string plainName(std::string_view name) {
  std::string ending;
  if (name.size() > 2) {
    const char before = name[name.size() - 2];
    const bool is_apart = before == '_' || before == '.';
    const bool is_capital = std::islower(static_cast<unsigned char>(before)) != 0;
    if ((is_apart && name.back() == 'l') || ((is_apart || is_capital) && name.back() == 'L')) ending = "left";
    if ((is_apart && name.back() == 'r') || ((is_apart || is_capital) && name.back() == 'R')) ending = "right";
    if (!ending.empty()) name.remove_suffix(is_apart ? 2 : 1);
  }
  std::string plain;
  for (const char letter : name) {
    const auto byte = static_cast<unsigned char>(letter);
    if (std::isalnum(byte) != 0) plain.push_back(static_cast<char>(std::tolower(byte)));
  }
  return plain + ending;
}

/// As arkitIndex(), of a name that nothing stands before.
int indexOfBare(std::string_view shape_name) {
  static const auto plain_names = [] {
    std::array<std::string, kArkitNames.size()> plain;
    std::transform(kArkitNames.begin(), kArkitNames.end(), plain.begin(), plainName);
    return plain;
  }();
  std::string name = plainName(shape_name);
  // What VRM, VRoid, Character Creator and Daz call the same.
  constexpr std::array<std::array<std::string_view, 2>, 7> kOthers{{{"fcleyeclose", "eyeblink"},
                                                                    {"eyesclosed", "eyeblink"},
                                                                    {"eyeclose", "eyeblink"},
                                                                    {"blink", "eyeblink"},
                                                                    {"browdrop", "browdown"},
                                                                    {"browraiseinner", "browinnerup"},
                                                                    {"browraiseouter", "browouterup"}}};
  for (const auto& [theirs, apples] : kOthers) {
    for (const std::string_view side : {"left", "right"}) {
      if (name == std::string(theirs) + std::string(side)) name = std::string(apples) + std::string(side);
    }
  }
  for (int pass = 0; pass < 2; ++pass) {
    const auto found = std::find(plain_names.begin(), plain_names.end(), name);
    if (found != plain_names.end()) return static_cast<int>(found - plain_names.begin());
    for (const std::string_view side : {"left", "right"}) {
      if (name.ends_with(side)) name.resize(name.size() - side.size());
    }
  }
  return -1;
}

}  // namespace

int arkitIndex(std::string_view shape_name) {
  if (const int whole = indexOfBare(shape_name); whole >= 0) return whole;
  // What stands before it is a mesh's, a node's or a set's name; where it is a shape's, the two correct each other.
  for (std::size_t at = 0; (at = shape_name.find_first_of("._:|", at)) != std::string_view::npos; ++at) {
    const int index = indexOfBare(shape_name.substr(at + 1));
    if (index < 0) continue;
    const std::string_view found = kArkitNames[unsignedIndex(index)];
    const bool is_short = found == "JawLeft" || found == "JawRight" || found == "MouthLeft" || found == "MouthRight";
    return is_short || arkitIndex(shape_name.substr(0, at)) >= 0 ? -1 : index;
  }
  return -1;
}

int arkitIndexAmong(std::string_view shape_name, const std::vector<std::string>& names) {
  const int left = arkitIndex("EyeBlinkLeft"), right = arkitIndex("EyeBlinkRight"), own = arkitIndex(shape_name);
  if (own >= 0 || arkitIndex(std::string(shape_name) + "_L") != left) return own;
  const bool has_one_eyes = std::any_of(names.begin(), names.end(), [&](const std::string& name) {
    const int index = arkitIndex(name);
    return index == left || index == right;
  });
  return has_one_eyes ? -1 : left;
}

const ArkitMarkerMoves& arkitMarkerMoves() {
  static const ArkitMarkerMoves shapes = [] {
    const nlohmann::json tree = nlohmann::json::parse(kArkitMarkersJson);
    ArkitMarkerMoves learnt;
    learnt.markers = tree.at("markers").get<std::vector<std::string>>();
    const auto places = [&](const nlohmann::json& numbers) -> MarkerPositions {
      const auto all = numbers.get<std::vector<double>>();
      return Eigen::Map<const MarkerPositions>(all.data(), signedIndex(learnt.markers.size()), 3);
    };
    learnt.neutral_mm = places(tree.at("neutral_mm"));
    for (const std::string_view name : kArkitNames)
      learnt.moves_mm.push_back(places(tree.at("moves_mm").at(std::string(name))));
    learnt.rims_parted_mm.resize(3, std::ssize(kArkitNames));
    for (std::size_t k = 0; k < kArkitNames.size(); ++k) {
      const auto parted = tree.at("rims_parted_mm").at(std::string(kArkitNames[k])).get<std::array<double, 3>>();
      learnt.rims_parted_mm.col(signedIndex(k)) = Eigen::Vector3d(parted.data());
    }
    return learnt;
  }();
  return shapes;
}

}  // namespace mouthpiece
