#pragma once

#include <cstddef>
#include <string>

namespace mouthpiece {

struct ControlMesh;
struct FaceBinding;
struct FaceMesh;

/// Of the skin in front that a binding leaves out (BindingReport::coverage) the part of the mesh with most of it.
struct SkinLeftOut {
  std::string part;
  bool is_of_face = false;      ///< the part has most of the skin in front
  std::size_t vertices = 0;     ///< of the part
  std::size_t all = 0;          ///< of all parts
  double median_distance = 0;   ///< from the surface, mouth widths
  double median_angle_deg = 0;  ///< between the vertex' normal and that of the surface where it is nearest
};
SkinLeftOut skinLeftOut(const FaceBinding& binding, const FaceMesh& mesh, const ControlMesh& control);

}  // namespace mouthpiece
