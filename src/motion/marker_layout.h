#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/index.h"

namespace mouthpiece {

enum class Side { kRight, kMiddle, kLeft };  ///< the subject's own sides

/// Which lip a marker, or a point or a triangle of a surface laid through them, belongs to.
enum class LipSide : std::uint8_t { kNone, kUpper, kLower };

/// By its name: LIP_UP_... and LIP_LO_... are on the lips.
LipSide lipSideOf(std::string_view marker_name);

struct LayoutMarker {
  std::string name;
  std::string region;  ///< forehead temple brow lid canthus nose cheek lip chin jaw
  Side side = Side::kMiddle;
  MarkerIndex mirror;  ///< itself on the midline
  LipSide lip = LipSide::kNone;
  bool stable = false;          ///< moves with the skull: used to remove head motion
  int mediapipe_landmark = -1;  ///< FaceMesh landmark id = vertex id of the canonical face; -1: none
};

/// Names and roles of the markers of a capture set-up, in the order of a corpus' motion columns.
struct MarkerLayout {
  std::string name;
  std::vector<LayoutMarker> markers;
  std::vector<std::string> jig_names;  ///< rigid head-jig markers, outside `markers`
  /// Triangles that the control surface of a face shall have, by names of markers or of the surface's virtual points
  /// (deform/control_surface.h); all others are found from where the markers lie.
  std::vector<std::array<std::string, 3>> triangles;

  [[nodiscard]] std::vector<std::string> markerNames() const;
  /// Throws InputError when the layout has no such marker.
  [[nodiscard]] MarkerIndex indexOf(std::string_view marker_name) const;
};

/// The 66-marker face layout of sample_data/layouts/face66.json (built into the library).
const MarkerLayout& defaultLayout();

/// Reads a layout from JSON text; `file` is for messages only. Throws InputError.
MarkerLayout parseLayout(std::string_view json_text, std::string_view file);
std::string layoutToJson(const MarkerLayout& layout);

}  // namespace mouthpiece
