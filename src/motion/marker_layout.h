#pragma once

#include <array>
#include <cstdint>
#include <optional>
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

/// What a mouth is measured with (motion/lip_gauge.h): the middles of the lips' outer edges, the corners, the chin.
enum class MarkerRole : std::uint8_t { kUpperLip, kLowerLip, kRightLipCorner, kLeftLipCorner, kChin };
inline constexpr std::array kMarkerRoles{MarkerRole::kUpperLip, MarkerRole::kLowerLip, MarkerRole::kRightLipCorner,
                                         MarkerRole::kLeftLipCorner, MarkerRole::kChin};

std::string_view wordOf(MarkerRole role);     ///< as a layout's file says it: "upper lip"
std::string_view usualName(MarkerRole role);  ///< the marker that has it unless the layout gives it away
/// The marker that has the role by its name; for the chin any whose name begins with CHIN will do.
std::optional<MarkerIndex> findRole(MarkerRole role, const std::vector<std::string>& marker_names);

struct LayoutMarker {
  std::string name;
  std::string region;  ///< forehead temple brow lid canthus nose cheek lip chin jaw
  Side side = Side::kMiddle;
  MarkerIndex mirror;  ///< itself on the midline
  LipSide lip = LipSide::kNone;
  bool stable = false;             ///< moves with the skull: used to remove head motion
  int mediapipe_landmark = -1;     ///< FaceMesh landmark id = vertex id of the canonical face; -1: none
  std::optional<MarkerRole> role;  ///< given to it in place of the marker that has it by its name
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
  /// The marker that is given the role, or has it by its name.
  [[nodiscard]] std::optional<MarkerIndex> findRole(MarkerRole role) const;
};

/// The 66-marker face layout of sample_data/layouts/face66.json (built into the library).
const MarkerLayout& defaultLayout();

/// Reads a layout from JSON text; `file` is for messages only. Throws InputError.
MarkerLayout parseLayout(std::string_view json_text, std::string_view file);
std::string layoutToJson(const MarkerLayout& layout);

/// Columns that no phone moves: lids blink and brows rise when they will. A cut through such a movement shows, so they
/// are blended over longer than the lips.
std::vector<bool> upperFaceColumns(const MarkerLayout& layout);

}  // namespace mouthpiece
