#pragma once

#include <optional>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// How high `triangle` of `mesh` lies straight over or under the place (x, z); nullopt where it does not. Of two
/// triangles that share an edge one counts there.
std::optional<float> heightAt(const FaceMesh& mesh, const Triangle& triangle, const Eigen::Vector2f& place);

}  // namespace mouthpiece
