#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// A vertex of the mesh, or a point in its unit.
using AnchorPlace = std::variant<std::uint32_t, Eigen::Vector3d>;

/// Where markers (and virtual points of the control surface) lie on a mesh (docs/formats/anchors.md).
struct Anchors {
  std::map<std::string, AnchorPlace> markers;
  std::map<std::string, PartKind> part_kinds;  ///< by part name
  std::optional<double> metres_per_unit;
};

/// Reads JSON; throws InputError with the key at fault.
Anchors parseAnchors(std::string_view json_text, const std::string& file);

/// The place of `name` on `mesh`; nullopt when it is not among the anchors. Throws InputError for a vertex that the
/// mesh lacks.
std::optional<Eigen::Vector3d> placeOf(const Anchors& anchors, const std::string& name, const FaceMesh& mesh,
                                       const std::string& file);

}  // namespace mouthpiece
