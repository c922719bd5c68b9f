#pragma once

#include <Eigen/Core>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// Where the key light comes from; its shadows are looked up by the caller.
Eigen::Vector3f keyLightDirection();

/// A point of a surface that is lit. Directions are unit vectors.
struct LitPoint {
  Eigen::Vector3f normal, to_camera;
  Eigen::Vector3f color;  ///< linear
  float roughness = 0.6F;
  PartKind kind = PartKind::kSkin;
  float key_share = 1;   ///< of the key light that comes through, 0 to 1
  float open_share = 1;  ///< of the light from all around that comes through
};

/// What is seen of it: linear RGB, 1 is white. Light reaches round the edge of flesh, the red of it furthest; what
/// shines does so by Blinn and Phong with the roughness' exponent.
Eigen::Vector3f litColor(const LitPoint& point);

/// Linear light as a byte of the screen's, what is over white rolled off.
std::uint8_t screenByte(float linear);

}  // namespace mouthpiece
