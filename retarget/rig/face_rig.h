#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "deform/kernel/face_animation.h"
#include "deform/mesh/triangles.h"
#include "deform/surface/control_surface.h"
#include "motion/head_pose.h"
#include "motion/lip_pose.h"
#include "motion/motion_clip.h"
#include "motion/tongue_pose.h"

namespace mouthpiece {

class HeadTopology;
struct FaceMesh;
struct FaceFile;

/// The actor who moves a face.
struct ActorPose {
  MarkerPositions neutral_mm;  ///< markers of the motion, in its order
  /// Between LIP_UP_MID and LIP_LO_MID in B P M at the tightest, the median; 0: not known.
  double closed_lips_mm = 0;
  LipRounding unseen = {};  ///< added where LipPose::rounding says so
};

/// A face that can be driven: the `.face` file and its mesh, loaded and bound. Immutable, safe to share.
class FaceRig {
 public:
  /// Reads the `.face` file and the mesh it names (relative to itself). Throws InputError when the
  /// mesh has changed since the fit (its SHA-256 is in the file), is missing, or the file is damaged.
  static FaceRig load(const std::filesystem::path& face_file);
  /// A face that is fitted but not written yet: `mesh` stands upright, as readMeshOf() gives it. `name`: for messages.
  /// `topology`: of the mesh, opened as the face's control surface tells, where it is known.
  static FaceRig of(FaceFile face, std::shared_ptr<const FaceMesh> mesh, const std::string& name,
                    const HeadTopology* topology = nullptr);
  static FaceRig of(FaceFile face, FaceMesh mesh, const std::string& name);

  FaceRig(FaceRig&&) noexcept;
  FaceRig& operator=(FaceRig&&) noexcept;
  ~FaceRig();

  [[nodiscard]] const FaceMesh& mesh() const;
  /// Of the mesh, for those who need no more of it.
  [[nodiscard]] const VertexPositions& restVertices() const;
  [[nodiscard]] double metresPerUnit() const;
  [[nodiscard]] const std::string& name() const;
  /// The markers that drive it, in the order of retarget()'s.
  [[nodiscard]] const std::vector<std::string>& markerNames() const;
  /// `face`, of which this rig was made, with what it takes time to find out when it is loaded.
  [[nodiscard]] FaceFile withSetUp(FaceFile face) const;

  /// Marker trajectories carried from the actor's space to the mesh's by the RBF warp (EDGE 6), and how the lips lie.
  /// `motion` holds the rig's markers by name; others are ignored, and some may be missing (completedMarkers). Lips
  /// that are apart on the mesh at rest are brought together by as much as the actor's are closed. `actor`: who moves;
  /// null: the actor of the corpus the face was fitted with. `lips`: one a frame (lipsFromPhones); empty, where the
  /// phones are not known: LipPose{}. `gaze`: one a frame, or empty: lids follow eyes that look up or down, which no
  /// marker of the actor's has seen.
  [[nodiscard]] FaceMotion retarget(const MotionClip& motion, const ActorPose* actor = nullptr,
                                    std::span<const LipPose> lips = {}, std::span<const GazeTurn> gaze = {}) const;

  /// Deforms one frame of retarget()'s: `out` is vertices x 3 (resized when needed), mesh units. Thread-safe; when
  /// `out` already has its size nothing is allocated once a thread has posed this face.
  void deform(const FacePose& pose, const TonguePose& tongue, VertexPositions& out) const;

  /// Turns the balls of the eyes in a frame of deform()'s, as far as the mesh has some.
  void turnEyes(const GazeTurn& gaze, VertexPositions& vertices) const;

  /// Frames of retarget()'s result with its tongues and, where the mesh has a neck, the height of the larynx (0 at rest
  /// to 1; empty: at rest), where it has eyeballs, where they look (one a frame; empty: ahead). Only the vertices that
  /// can move are given. The rig, `motion` and the spans must outlive what is returned, which one thread at a time may
  /// use. Throws InputError when no vertex moves.
  [[nodiscard]] FrameMaker movingFrames(const FaceMotion& motion, std::span<const TonguePose> tongues,
                                        double frame_rate_hz, std::span<const double> larynx = {},
                                        std::span<const GazeTurn> gaze = {}) const;

 private:
  FaceRig();
  struct Data;
  std::unique_ptr<Data> data_;
};

/// Motion of a face's markers, in its order, with the pose that it is relative to.
struct CompletedMarkers {
  PositionMatrix positions_mm;  ///< frames x 3 * markers
  MarkerPositions neutral_mm;
};

/// `motion` in the order of a face's markers (the first of `control`'s points), though it may lack some: these go along
/// with those near them, a lip's with none of the other lip. `motion_neutral_mm`: the actor at rest, a row for each of
/// motion's markers; `face_neutral_mm`: the actor that the face was fitted to, a row for each of the face's. Throws
/// InputError that names a lip marker which no face can do without, or tells that too few are there.
CompletedMarkers completedMarkers(const MotionClip& motion, const MarkerPositions& motion_neutral_mm,
                                  const ControlMesh& control, const MarkerPositions& face_neutral_mm);

/// Where the larynx shows at the front of a neck, and how it goes up with a singer's pitch (VOCAL 3.1). No marker says
/// so: it is the "larynx" curve that moves it.
class LarynxBump {
 public:
  LarynxBump() = default;
  /// `chin`: its place on the mesh at rest (the mesh upright, Y up, face +Z); `face_width`: between the outer canthi.
  /// Empty where the mesh has no neck.
  LarynxBump(const FaceMesh& mesh, const Eigen::Vector3d& chin, double face_width);

  /// The vertices that it moves, rising.
  [[nodiscard]] const std::vector<std::uint32_t>& vertices() const { return vertices_; }
  /// What it adds to each of them, x y z side by side, the mesh's unit. `height`: 0 at rest to 1.
  void displacements(double height, std::span<float> out) const;

 private:
  std::vector<std::uint32_t> vertices_;
  std::vector<Eigen::Vector2d> places_;  ///< beside and above the larynx at rest, in radii
  double radius_ = 0;                    ///< mesh units
};

/// Of the face's width: how far it goes up, and how far it stands out where it is. 10 and 2.7 mm on a face of 90 mm.
inline constexpr double kLarynxTravel = 0.11, kLarynxBulge = 0.03;

}  // namespace mouthpiece
