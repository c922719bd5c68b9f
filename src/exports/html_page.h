#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "motion/motion_clip.h"
#include "synthesis/utterance_animation.h"

namespace mouthpiece {

/// What view.html shows. Views only: everything must outlive the call.
struct ViewPage {
  const UtteranceAnimation& animation;
  std::string_view glb;  ///< glbBytes() of `mesh`
  const FaceMesh& mesh;  ///< for its parts' kinds and its unit
  std::string_view face_name;
  std::span<const std::string> marker_names;
  const PositionMatrix& markers;  ///< FaceMotion's: frames x (3 * markers), the mesh's unit
};

/// Where the template takes its data: this line, once.
inline constexpr std::string_view kViewPagePlaceholder = "<!-- mouthpiece:data -->";

/// The page, one file that opens from disk (viewer/): `page_template` with the face, the sound and the report in it.
/// Text from outside (words, names of takes) is data there and cannot become markup or script. Throws InputError when
/// the template has no placeholder.
std::string viewHtml(std::string_view page_template, const ViewPage& page);

/// viewHtml() into a file, atomically.
void writeViewHtml(const std::filesystem::path& path, std::string_view page_template, const ViewPage& page);

/// The distance between LIP_UP_MID and LIP_LO_MID, frame by frame, in mm; empty when `clip` lacks them.
std::vector<double> lipOpeningMm(const MotionClip& clip);

}  // namespace mouthpiece
