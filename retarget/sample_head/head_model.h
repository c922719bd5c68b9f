#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "deform/mesh/face_mesh.h"
#include "retarget/sample_head/model_mesh.h"

namespace mouthpiece {

/// Parts of the default face, in the order they are written.
enum DefaultPart : int {
  kPartSkin,
  kPartLips,
  kPartMouth,
  kPartEyes,
  kPartUpperGums,
  kPartUpperTeeth,
  kPartLowerGums,
  kPartLowerTeeth,
  kPartTongue,
  kPartLashes,
  kPartHair,
  kDefaultPartCount
};

/// Vertices of MediaPipe's canonical face (468 vertices; a vertex' number is its landmark's).
inline constexpr std::size_t kCanonicalVertexCount = 468;

/// One half of the line where the lips meet, right to left, without the corners: kInnerUpperLip[i] faces
/// kInnerLowerLip[i].
inline constexpr std::array<std::uint32_t, 9> kInnerUpperLip{191, 80, 81, 82, 13, 312, 311, 310, 415};
inline constexpr std::array<std::uint32_t, 9> kInnerLowerLip{95, 88, 178, 87, 14, 317, 402, 318, 324};
inline constexpr std::uint32_t kInnerCornerRight = 78;
inline constexpr std::uint32_t kInnerCornerLeft = 308;

/// Edges of the eyes' openings, around: outer corner, upper lid, inner corner, lower lid.
inline constexpr std::array<std::uint32_t, 16> kEyeRight{33,  246, 161, 160, 159, 158, 157, 173,
                                                         133, 155, 154, 153, 145, 144, 163, 7};
inline constexpr std::array<std::uint32_t, 16> kEyeLeft{263, 466, 388, 387, 386, 385, 384, 398,
                                                        362, 382, 381, 380, 374, 373, 390, 249};

/// The face's outline from the forehead's middle over the subject's left side, the chin and the right side.
inline constexpr std::array<std::uint32_t, 36> kFaceOutline{10,  338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288,
                                                            397, 365, 379, 378, 400, 377, 152, 148, 176, 149, 150, 136,
                                                            172, 58,  132, 93,  234, 127, 162, 21,  54,  103, 67,  109};

struct EyeBall {
  Eigen::Vector3d centre;
  double radius = 0;
};

/// The canonical face made ready: millimetres, mouth and eyes opened, lips meeting along one line and rolled inward
/// into a closed mouth bag, lids with an edge that lies on the eyeballs. Vertices below 468 are the landmarks.
struct OpenedFace {
  ModelMesh mesh;
  std::array<EyeBall, 2> eyes;  ///< right, left
};

/// `canonical`: mind-ar's canonical-face-model.obj (centimetres). Throws InputError when it is another mesh.
OpenedFace openCanonicalFace(const FaceMesh& canonical, std::string_view file);

}  // namespace mouthpiece
