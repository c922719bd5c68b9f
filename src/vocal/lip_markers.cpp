#include "vocal/lip_markers.h"

#include <algorithm>
#include <optional>
#include <string_view>

namespace mouthpiece {

LipMarkers findLipMarkers(const std::vector<std::string>& marker_names) {
  const auto y_column = [&](std::string_view name) -> std::optional<Eigen::Index> {
    const auto found = std::find(marker_names.begin(), marker_names.end(), name);
    if (found == marker_names.end()) return std::nullopt;
    return 3 * static_cast<Eigen::Index>(found - marker_names.begin()) + 1;
  };
  LipMarkers markers;
  // Any chin marker will do; the middle one is best.
  const auto any_chin = std::find_if(marker_names.begin(), marker_names.end(),
                                     [](const std::string& name) { return name.starts_with("CHIN"); });
  const auto upper = y_column("LIP_UP_MID"), lower = y_column("LIP_LO_MID");
  auto chin = y_column("CHIN_MID");
  if (!chin && any_chin != marker_names.end()) chin = y_column(*any_chin);
  markers.has_lips = upper && lower;
  markers.has_chin = chin.has_value();
  markers.upper_y = upper.value_or(0);
  markers.lower_y = lower.value_or(0);
  markers.chin_y = chin.value_or(0);
  return markers;
}

double softFloor(double value, double floor) {
  constexpr double kSoft = 0.5;  // mm either side of the floor
  const double above = value - floor;
  if (above >= kSoft) return value;
  if (above <= -kSoft) return floor;
  // The parabola that leaves the floor with slope 0 and reaches the diagonal with slope 1.
  return floor + (above + kSoft) * (above + kSoft) / (4 * kSoft);
}

}  // namespace mouthpiece
