#pragma once

#include <array>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "deform/surface/left_out.h"
#include "retarget/placing/anchors.h"
#include "retarget/rig/face_file.h"

namespace mouthpiece {

struct FaceMesh;
struct FaceShapes;

/// What a fit starts from.
struct FitRequest {
  std::string name;
  std::string mesh_file;  ///< as the `.face` file shall name it
  std::string mesh_sha256;
  std::string mesh_object = {};  ///< FaceFile's
  std::string corpus;
  std::vector<std::string> marker_names;  ///< the actor's layout
  SurfacePlan surface = {};               ///< the same layout's
  MarkerPositions actor_neutral_mm;
  double actor_closed_lips_mm = 0;  ///< FaceFile's
  LipRounding actor_unseen = {};    ///< FaceFile's
  WarpOptions warp;
  BindingOptions binding;
};

/// Sets `mesh` upright, places the markers on it by `anchors` (all, or a few: marker_placing.h), fits the warp,
/// triangulates the control surface and binds the mesh (EDGE 6). Sets mesh.metres_per_unit (from the anchors, else from
/// the actor's size) and part kinds. `anchors_file` is for messages. Throws InputError that says which anchors are
/// missing, or why the face cannot be fitted.
FaceFile fitFace(FaceMesh& mesh, const Anchors& anchors, const std::string& anchors_file, const FitRequest& request);

/// Metres per unit of a head whose markers span as much as the actor's: a usual unit where one is near, else the ratio
/// itself.
double metresPerUnit(const MarkerPositions& actor_neutral_mm, const MarkerPositions& target);

/// What `retarget check` says of a fitted face. Lengths in millimetres of the target.
struct FaceCheck {
  std::size_t markers = 0;
  double landmark_rms_mm = 0;  ///< of the warp at the markers
  double landmark_max_mm = 0;
  double leave_one_out_rms_mm = 0;
  double marker_to_surface_max_mm = 0;  ///< farthest marker from the mesh's skin
  std::string farthest_marker;
  RbfKernel kernel = RbfKernel::kInverseMultiquadric;
  double shape_factor = 0;
  std::size_t sampled_points = 0;  ///< of the face, where the warp's Jacobian was looked at
  std::size_t fold_overs = 0;      ///< of them, where it turns space inside out
  std::string fold_over_marker;    ///< the marker next to the first of those
  BindingReport binding;
  SkinLeftOut left_out;  ///< where the binding covers too little
  double patch_edge_angle_max_deg =
      0;  ///< between the normals of neighbouring patches along their edge, over sampled poses
};
FaceCheck checkFace(const FaceFile& face, const FaceMesh& mesh);

/// Why the face must not be used as it is, what others come of first; empty when all is well.
std::vector<std::string> faultsOf(const FaceCheck& check);

/// How the lips of one frame lie to each other and to the teeth; the mesh's unit.
struct LipContact {
  /// Between the lips' surfaces where it is widest over the middle half of the mouth; below zero: everywhere
  /// overlapping.
  double gap = 0;
  double overlap = 0;          ///< deepest place of one lip inside the other
  double seeming_overlap = 0;  ///< the same with places beyond a fold, which only seem to be inside
  /// Deepest place of a lip, but for its back, inside teeth or gums, or how far these stand out of the skin of their
  /// jaw's lip, more than at rest.
  double in_teeth = 0;
  double in_tongue = 0;
  static constexpr std::size_t kColumns = 10;  ///< over the middle half of the mouth, from its right to its left
  /// Between the lips' surfaces in each; `gap` is the largest. 0 beyond corners that a coarse mesh has further in.
  std::array<double, kColumns> gaps{};
  /// How tall a slit one looks straight through in each, from the front and 0.18 mouths deep, past all skin: surfaces
  /// that touch somewhere in a column may leave one beside it. Those from 0.2 mouths off the corners on count in the
  /// outer columns.
  std::array<double, kColumns> slits{};
  std::array<double, kLipColumns> overlaps{};  ///< of `overlap`, across the whole mouth
};

/// Measures lips on the mesh itself, whatever moved it: points on both lips, within 0.12 mouths of the line where they
/// meet, against the surfaces of the other lip, of the teeth and of the tongue.
class LipContactMeter {
 public:
  /// `mesh` as it rests, `control` fitted to it. The points lie less than `step` mouths apart.
  LipContactMeter(const FaceMesh& mesh, const ControlMesh& control, double step = 0.02);
  LipContactMeter(LipContactMeter&&) noexcept;
  ~LipContactMeter();

  /// `vertices`: the same mesh moved. `widest`: gaps above it are told as it, and no slits are looked for, which is
  /// quicker.
  [[nodiscard]] LipContact measure(const VertexPositions& vertices,
                                   double widest = std::numeric_limits<double>::infinity()) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// What the morph targets of a head do to markers on its skin.
struct MarkerShapes {
  MarkerPositions neutral_mm;
  std::vector<std::string> names;         ///< of the shapes
  std::vector<MarkerPositions> moves_mm;  ///< of the markers, at weight 1
};

/// `places` (mesh unit) are carried to the closest skin; a marker there moves as the corners of its triangle do.
/// Throws InputError that begins with `file` when the mesh has no skin.
MarkerShapes markerShapes(const FaceMesh& mesh, const FaceShapes& shapes, const MarkerPositions& places,
                          const std::string& file);

/// The markers at `weights`, frames x shapes (a frame with a NaN: not seen).
PositionMatrix drivenMarkers(const MarkerShapes& shapes, const Eigen::MatrixXd& weights);

}  // namespace mouthpiece
