#pragma once

#include <map>
#include <string>
#include <string_view>

#include "deform/mesh/face_mesh.h"
#include "retarget/placing/anchors.h"

namespace mouthpiece {

/// The face that comes with Mouthpiece: MediaPipe's canonical face opened, smoothed (Loop) and finished to a head.
struct DefaultFace {
  FaceMesh mesh;    ///< millimetres
  Anchors anchors;  ///< every marker of the default layout with a landmark, and the control surface's virtual points
};

/// `canonical`: what `make data` brings. The same input gives the same bytes. Throws InputError when
/// it is another mesh.
DefaultFace makeDefaultFace(const FaceMesh& canonical, std::string_view file);

}  // namespace mouthpiece
