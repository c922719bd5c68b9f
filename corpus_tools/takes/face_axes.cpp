// faceFromHead of head_tracking.h: the axes that a face gives itself.
#include <fmt/format.h>

#include <Eigen/Geometry>

#include <optional>

#include "base/errors.h"
#include "corpus_tools/takes/head_tracking.h"

namespace mouthpiece {
namespace {

Eigen::Vector3d place(const MarkerPositions& pose, std::size_t marker) {
  return pose.row(static_cast<Eigen::Index>(marker)).transpose();
}

struct CanthusPair {
  Eigen::Vector3d right, left;
};

/// Of all mirrored pairs of the region "canthus" the one farthest apart.
CanthusPair outerCanthi(const MarkerPositions& neutral, const MarkerLayout& layout) {
  std::optional<CanthusPair> outer;
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    if (layout.markers[marker].region != "canthus" || layout.markers[marker].side != Side::kRight) continue;
    const CanthusPair pair{place(neutral, marker), place(neutral, layout.markers[marker].mirror.value)};
    if (!pair.right.allFinite() || !pair.left.allFinite()) continue;
    if (!outer || (pair.left - pair.right).norm() > (outer->left - outer->right).norm()) outer = pair;
  }
  if (!outer || (outer->left - outer->right).norm() < 1e-3) {
    throw InputError(
        fmt::format("layout {} has no seen pair of markers in the region \"canthus\"; the face's axes need "
                    "the outer corners of the eyes",
                    layout.name));
  }
  return *outer;
}

/// Mean of the seen markers of a region, midline or sides only. nullopt when there is none.
std::optional<Eigen::Vector3d> regionMean(const MarkerPositions& neutral, const MarkerLayout& layout,
                                          std::string_view region, bool midline) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    const LayoutMarker& known = layout.markers[marker];
    if (known.region != region || (known.side == Side::kMiddle) != midline) continue;
    if (!place(neutral, marker).allFinite()) continue;
    sum += place(neutral, marker);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return Eigen::Vector3d(sum / count);
}

}  // namespace

RigidMotion faceFromHead(const MarkerPositions& neutral_mm, const MarkerLayout& layout) {
  const CanthusPair canthi = outerCanthi(neutral_mm, layout);
  const Eigen::Vector3d origin = 0.5 * (canthi.left + canthi.right);
  const Eigen::Vector3d x = (canthi.left - canthi.right).normalized();
  const auto forehead = regionMean(neutral_mm, layout, "forehead", true);
  const auto chin = regionMean(neutral_mm, layout, "chin", true);
  if (!forehead || !chin) {
    throw InputError(
        fmt::format("layout {} has no seen midline markers in the regions \"forehead\" and \"chin\"; the "
                    "face's axes need both",
                    layout.name));
  }
  const Eigen::Vector3d up = *forehead - *chin;
  const Eigen::Vector3d y = (up - up.dot(x) * x).normalized();
  const Eigen::Vector3d z = x.cross(y);
  const auto nose = regionMean(neutral_mm, layout, "nose", true);
  if (nose && (*nose - origin).dot(z) <= 0) {
    throw InputError(
        fmt::format("the nose lies behind the eyes: the capture is a mirror image, or the left and right "
                    "markers of layout {} are exchanged",
                    layout.name));
  }
  RigidMotion face_from_head;
  face_from_head.rotation << x.transpose(), y.transpose(), z.transpose();
  face_from_head.translation_mm = -face_from_head.rotation * origin;
  return face_from_head;
}

}  // namespace mouthpiece
