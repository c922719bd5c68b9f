#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/json_fields.h"
#include "motion/formats/motion_file.h"

namespace mouthpiece {

std::map<std::string, std::string> markerLabels(std::string_view json_text, std::string_view file,
                                                const MarkerLayout& layout) {
  std::map<std::string, std::string> names;
  auto marker = layout.markers.begin();  // parseLayout() has read the same text
  for (const JsonField& own : parseJson(json_text, file, "a marker layout")["markers"].list()) {
    const LayoutMarker& known = *marker++;
    if (!own["label"].exists()) continue;
    const std::string label = own["label"].name();
    const bool is_taken = std::any_of(layout.markers.begin(), layout.markers.end(), [&](const LayoutMarker& other) {
      return other.name == label && &other != &known;
    });
    if (is_taken || !names.emplace(label, known.name).second)
      own.fail(fmt::format("found label {}, which is another marker's; expected each label once", printable(label)));
  }
  return names;
}

}  // namespace mouthpiece
