#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "deform/surface/binding.h"
#include "deform/surface/control_surface.h"
#include "motion/lip_pose.h"
#include "motion/motion_clip.h"
#include "retarget/warp/rbf_warp.h"

namespace mouthpiece {

enum class PartKind;
struct FaceMesh;

inline constexpr int kFaceFormatVersion = 3;

/// What a `.face` file holds (docs/formats/face.md): everything that `retarget fit` found out about one mesh and one
/// actor.
struct FaceFile {
  std::string name;
  std::string mesh_file;    ///< relative to the `.face` file
  std::string mesh_sha256;  ///< of the mesh file's bytes, lower-case hexadecimal
  std::string mesh_object;  ///< the object of a GLB's scene that was fitted; empty: all of it
  double metres_per_unit = 0.001;
  Eigen::Matrix3d upright_from_mesh = Eigen::Matrix3d::Identity();  ///< turns the mesh file's vertices: Y up, face +Z
  std::string corpus;                          ///< name of the corpus whose actor is the neutral pose, for reports
  std::vector<std::string> marker_names;       ///< order of the markers everywhere below
  MarkerPositions marker_targets;              ///< their places on the mesh, its unit
  MarkerPositions actor_neutral_mm;            ///< the actor's neutral pose
  double actor_closed_lips_mm = 0;             ///< between LIP_UP_MID and LIP_LO_MID in the actor's B P M; 0: not known
  LipRounding actor_unseen;                    ///< what rounded lips do that the actor's capture has not seen
  WarpOptions warp;                            ///< shape_factor as chosen at the fit
  std::map<std::string, PartKind> part_kinds;  ///< by part name: what the mesh file does not tell by itself
  ControlMesh control;
  FaceBinding binding;
  /// The mesh as it was read from its file at the fit and set upright; null: it is read again when the face is loaded.
  std::shared_ptr<const FaceMesh> mesh = nullptr;
  /// FaceDeformer::guardWords() of this mesh, control mesh and binding; empty: found anew when the face is loaded.
  std::vector<std::uint32_t> guard = {};
};

/// Whether these first bytes of a file are a face's: its blobs, which are no longer than a file is, or, of older ones,
/// a map.
bool beginsAsFace(std::string_view bytes);
/// Reads CBOR that nobody has checked: types, sizes, ranges, finiteness. What needs the mesh (the binding) is checked
/// by checkBinding. Throws InputError.
FaceFile parseFaceFile(std::string_view bytes, const std::string& file);
FaceFile readFaceFile(const std::filesystem::path& path);
std::string faceFileToBytes(const FaceFile& face);
void writeFaceFile(const std::filesystem::path& path, const FaceFile& face);

/// Turns every vertex.
void turnMesh(const Eigen::Matrix3d& turn, FaceMesh& mesh);

/// The mesh that `face` names, next to `face_path`, set upright; its hash is checked, unit and part kinds are set.
/// Throws InputError when it is missing or has changed since the fit.
FaceMesh readMeshOf(const FaceFile& face, const std::filesystem::path& face_path);
/// Its two halves, of which the second takes the time where `face` does not hold the mesh: the mesh's bytes, of the
/// same file as when it was fitted to, and the mesh that they are.
std::string readMeshBytesOf(const FaceFile& face, const std::filesystem::path& face_path);
std::shared_ptr<const FaceMesh> meshOf(const FaceFile& face, const std::filesystem::path& face_path,
                                       std::string_view bytes);

/// "inverse_multiquadric", "biharmonic", "triharmonic".
std::string_view nameOf(RbfKernel kernel);
std::optional<RbfKernel> kernelFromName(std::string_view name);

}  // namespace mouthpiece
