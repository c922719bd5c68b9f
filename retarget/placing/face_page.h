#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "deform/mesh/glb_scene.h"
#include "retarget/placing/anchors.h"

namespace mouthpiece {

struct FaceMesh;

/// An anchor to click: the marker's name and where it lies, in words.
struct AnchorToPick {
  std::string_view name;
  std::string_view place;
};

/// Ten places that anyone finds on a face and that are enough to place all markers.
const std::vector<AnchorToPick>& suggestedAnchors();

/// What a page shows of a head besides its surface.
struct PageDressing {
  std::map<int, GlbPicture> pictures;                  ///< by MeshPart::material; an empty one is only told of
  std::vector<Eigen::Vector3d> lip_line = {};          ///< places along both lips' rims, the mesh's frame
  std::map<std::string, Eigen::Vector3d> traced = {};  ///< rims by name: saved once they are dragged
};

/// One HTML file that shows `mesh` and turns it with the mouse, without a server or other files. `shown`: markers on
/// it, which can be dragged. `to_pick`: anchors that a user clicks one after the other. The page saves both as an
/// anchors file (docs/formats/anchors.md), `shown`'s other keys with them.
std::string facePage(const FaceMesh& mesh, std::string_view name, const Anchors& shown,
                     const std::vector<AnchorToPick>& to_pick, const PageDressing& dressing = {});

}  // namespace mouthpiece
