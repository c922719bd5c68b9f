#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "deform/kernel/face_animation.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/face_motion.h"
#include "motion/lip_pose.h"
#include "motion/motion_clip.h"
#include "motion/tongue_pose.h"

namespace mouthpiece {

/// The actor who moves a face.
struct ActorPose {
  MarkerPositions neutral_mm;  ///< markers of the motion, in its order
  /// Between LIP_UP_MID and LIP_LO_MID in B P M at the tightest, the median; 0: not known.
  double closed_lips_mm = 0;
};

/// A face that can be driven: the `.face` file and its mesh, loaded and bound. Immutable, safe to share.
class FaceRig {
 public:
  /// Reads the `.face` file and the mesh it names (relative to itself). Throws InputError when the
  /// mesh has changed since the fit (its SHA-256 is in the file), is missing, or the file is damaged.
  static FaceRig load(const std::filesystem::path& face_file);

  FaceRig(FaceRig&&) noexcept;
  FaceRig& operator=(FaceRig&&) noexcept;
  ~FaceRig();

  [[nodiscard]] const FaceMesh& mesh() const;
  [[nodiscard]] const std::string& name() const;
  /// The markers that drive it, in the order of retarget()'s.
  [[nodiscard]] const std::vector<std::string>& markerNames() const;

  /// Marker trajectories carried from the actor's space to the mesh's by the RBF warp (EDGE 6), and how the lips lie.
  /// `motion` holds the rig's markers by name; others are ignored, and some may be missing (completedMarkers). Lips
  /// that are apart on the mesh at rest are brought together by as much as the actor's are closed. `actor`: who moves;
  /// null: the actor of the corpus the face was fitted with. `lips`: one a frame (lipsFromPhones); empty, where the
  /// phones are not known: LipPose{}.
  [[nodiscard]] FaceMotion retarget(const MotionClip& motion, const ActorPose* actor = nullptr,
                                    std::span<const LipPose> lips = {}) const;

  /// Deforms one frame of retarget()'s: `out` is vertices x 3 (resized when needed), mesh units. Thread-safe; when
  /// `out` already has its size nothing is allocated once a thread has posed this face.
  void deform(const FacePose& pose, const TonguePose& tongue, VertexPositions& out) const;

  /// Many frames at once: retarget()'s result with its tongues and, where the mesh has a neck, the height of the larynx
  /// (0 at rest to 1; empty: at rest). Only the vertices that can move are given.
  [[nodiscard]] FaceAnimation deformMoving(const FaceMotion& motion, std::span<const TonguePose> tongues,
                                           double frame_rate_hz, std::span<const double> larynx = {}) const;

 private:
  FaceRig();
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace mouthpiece
