#include "motion/formats/marker_labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/errors.h"

namespace mouthpiece {

std::map<std::string, std::string> markerLabels(std::string_view json_text, std::string_view file,
                                                const MarkerLayout& layout) {
  const auto root = nlohmann::json::parse(json_text);  // parseLayout() has read it
  std::map<std::string, std::string> names;
  for (std::size_t i = 0; i < layout.markers.size(); ++i) {
    const auto& marker = root["markers"][i];
    if (!marker.contains("label")) continue;
    const std::string place = fmt::format("markers[{}]", i);
    if (!marker["label"].is_string() || marker["label"].get<std::string>().empty())
      throw InputError(file, place, "found a \"label\" that is no text; expected the marker's name in the files");
    const auto label = marker["label"].get<std::string>();
    const bool is_taken = std::any_of(layout.markers.begin(), layout.markers.end(), [&](const LayoutMarker& other) {
      return other.name == label && &other != &layout.markers[i];
    });
    if (is_taken || !names.emplace(label, layout.markers[i].name).second) {
      throw InputError(
          file, place,
          fmt::format("found label {}, which is another marker's; expected each label once", printable(label)));
    }
  }
  return names;
}

}  // namespace mouthpiece
