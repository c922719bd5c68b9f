#pragma once

#include <filesystem>
#include <string>

#include "deform/surface/binding.h"
#include "retarget/rig/face_rig.h"
#include "retarget/warp/rbf_warp.h"

namespace mouthpiece {

struct Corpus;

/// What `retarget` was asked for.
struct CommandLine {
  std::filesystem::path mesh, anchors, corpus, out, face, motion, phones, canonical, show;
  WarpOptions warp;
  std::string kernel = "auto";
  BindingOptions binding;
  std::string name;
  bool arkit = false;
  bool quiet = false;
  bool json = false;
};

/// `retarget apply`; the exit code. Throws InputError.
int applyCommand(const CommandLine& line);

inline constexpr double kTouchMm = 0.3;  ///< lips nearer than this touch

/// What the captured closures (B P M in which the outer lips come near) of a corpus become on a face.
struct ClosureCheck {
  std::size_t closures = 0;
  std::size_t touching = 0;         ///< whose lips are kTouchMm apart at most, all over the middle half of the mouth
  std::size_t others = 0;           ///< phones looked at that are no closure: every eighth but B P M and silence
  std::size_t others_touching = 0;  ///< whose lips touch at their widest
  double gap_median_mm = 0;
  double gap_p95_mm = 0;
  double overlap_mm = 0;   ///< deepest place of one lip inside the other, over all closures
  double in_teeth_mm = 0;  ///< of a lip inside teeth or gums
  double overlap_at_rest_mm = 0;
  double in_teeth_at_rest_mm = 0;
  std::size_t poses = 0;                ///< drawn at random from the capture
  double patch_edge_angle_max_deg = 0;  ///< between neighbouring patches in these
};
ClosureCheck checkClosures(const FaceRig& rig, const ControlMesh& control_mesh, const Corpus& corpus, bool quiet);

}  // namespace mouthpiece
