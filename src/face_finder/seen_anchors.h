#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

namespace mouthpiece {

struct FaceMesh;
class FaceTracker;

/// A place of a face on a head's skin, as it is seen in several pictures of the head.
struct SeenAnchor {
  Eigen::Vector3d place;  ///< the mesh's unit
  double spread = 0;      ///< how far the pictures' places lie from it, their median, the mesh's unit
};

/// A face that was seen on a mesh.
struct SeenFace {
  /// The ten suggested anchors (retarget/placing/face_page.h), the head's own right and left.
  std::map<std::string, SeenAnchor> anchors;
  double presence = 0;       ///< how sure the tracker is in the least sure of the pictures that count, 0 to 1
  std::size_t pictures = 0;  ///< that were looked at from around the front
  std::size_t seen = 0;      ///< of them, those that show the face
  double eye_corners = 0;    ///< distance of the outer eye corners, the mesh's unit
};

/// Paints the mesh from many sides, upright and otherwise, until a face is seen; then from around that face's front,
/// and lays what the tracker finds onto the foremost skin (docs/theory/face_finder/seen_anchors.md). The mesh may be
/// turned any way and be a whole figure; `head`: vertices that are known to be its head, where it is looked at first.
/// nullopt where no face is seen. Forgets what the tracker has followed.
std::optional<SeenFace> seenFace(const FaceMesh& mesh, FaceTracker& tracker, std::span<const std::uint32_t> head = {});

}  // namespace mouthpiece
