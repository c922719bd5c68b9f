// What several subcommands tell of a face, and ask of a corpus.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "programs/retarget/commands.h"
#include "units/file/corpus.h"

namespace mouthpiece {

FitRequest fitRequestFor(const std::string& face_name, const Corpus& corpus) {
  FitRequest request;
  request.name = face_name;
  request.corpus = corpus.name;
  request.marker_names = corpus.layout.markerNames();
  request.surface = surfacePlanOf(corpus.layout);
  request.actor_neutral_mm = corpus.neutral_pose_mm;
  request.actor_closed_lips_mm = closedLipsMm(corpus);
  return request;
}

nlohmann::json faceFacts(const FaceFile& face, const FaceCheck& check) {
  return {{"name", face.name},
          {"mesh", face.mesh_file},
          {"corpus", face.corpus},
          {"metres_per_unit", face.metres_per_unit},
          {"markers", check.markers},
          {"vertices", check.binding.vertices},
          {"bound_vertices", check.binding.bound_vertices},
          {"coverage", check.binding.coverage},
          {"lip_side_errors", check.binding.lip_side_errors},
          {"way_between_lips", check.binding.way_between_lips},
          {"largest_offset_mm", check.binding.largest_offset},
          {"landmark_rms_mm", check.landmark_rms_mm},
          {"landmark_max_mm", check.landmark_max_mm},
          {"leave_one_out_rms_mm", check.leave_one_out_rms_mm},
          {"marker_to_surface_max_mm", check.marker_to_surface_max_mm},
          {"farthest_marker", check.farthest_marker},
          {"kernel", nameOf(check.kernel)},
          {"shape_factor", check.shape_factor},
          {"sampled_points", check.sampled_points},
          {"fold_overs", check.fold_overs},
          {"fold_over_marker", check.fold_over_marker},
          {"patch_edge_angle_max_deg", check.patch_edge_angle_max_deg},
          {"faults", faultsOf(check)}};
}

std::string faceText(const FaceFile& face, const FaceCheck& check) {
  std::string text = fmt::format(
      "{}: {} vertices, {} markers, actor of {}\n"
      "  landmark error     {:.2e} mm at most, left out one by one {:.2f} mm RMS ({}, shape {:.2f})\n"
      "  markers on skin    {:.2f} mm off at most ({})\n"
      "  fold-overs         {} of {} points\n"
      "  bound              {} vertices, {:.1f} % of the face, {:.1f} mm off the control surface at most\n"
      "  across the lips    {} vertices\n"
      "  patch edges        {:.3g} degrees at most\n",
      face.name, check.binding.vertices, check.markers, face.corpus, check.landmark_max_mm, check.leave_one_out_rms_mm,
      nameOf(check.kernel), check.shape_factor, check.marker_to_surface_max_mm, check.farthest_marker, check.fold_overs,
      check.sampled_points, check.binding.bound_vertices, 100 * check.binding.coverage, check.binding.largest_offset,
      check.binding.lip_side_errors, check.patch_edge_angle_max_deg);
  for (const std::string& fault : faultsOf(check)) text += "  fault: " + fault + "\n";
  return text;
}

void printFace(const FaceFile& face, const FaceCheck& check, bool json, bool quiet) {
  if (json) {
    printJson(faceFacts(face, check));
  } else if (!quiet) {
    printText(faceText(face, check));
  }
}

}  // namespace mouthpiece
