// The studio's lights: those of the page (viewer/src/stage.js), in arithmetic.
#include "deform/mesh/face_mesh.h"
#include "exports/film/painting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace mouthpiece {
namespace {

using Eigen::Vector3f;

struct Light {
  Vector3f direction;  ///< towards it
  Vector3f color;      ///< with its strength
};

Light light(float x, float y, float z, float red, float green, float blue, float strength) {
  return {Vector3f(x, y, z).normalized(), strength * Vector3f(red, green, blue)};
}

/// The key comes first.
const std::array<Light, 4>& lights() {
  static const std::array<Light, 4> all{
      light(-0.75F, 0.85F, 1, 1, 0.88F, 0.76F, 0.78F), light(1, 0.1F, 0.9F, 0.74F, 0.82F, 1, 0.2F),
      light(0.9F, 0.7F, -0.9F, 0.81F, 0.88F, 1, 0.55F), light(-1, 0.2F, -0.6F, 1, 0.77F, 0.63F, 0.24F)};
  return all;
}

/// How a kind of part takes the light.
struct Surface {
  Vector3f wrap;     ///< how far light reaches round its edge, by colour
  float roughness;   ///< 0: as the part says
  float reflection;  ///< of light that falls on it squarely
  float sheen;       ///< of skin's down, seen at its edges
};

Surface surfaceOf(PartKind kind) {
  switch (kind) {
    case PartKind::kSkin:
      return {{0.34F, 0.16F, 0.12F}, 0.5F, 0.022F, 0.10F};
    case PartKind::kLips:
      return {{0.34F, 0.14F, 0.12F}, 0.36F, 0.03F, 0};
    case PartKind::kUpperTeeth:
    case PartKind::kLowerTeeth:
      return {{0.1F, 0.1F, 0.1F}, 0.3F, 0.04F, 0};
    case PartKind::kTongue:
      return {{0.3F, 0.1F, 0.1F}, 0.4F, 0.035F, 0};
    case PartKind::kEye:
      return {{0.1F, 0.1F, 0.1F}, 0.28F, 0.05F, 0};
    case PartKind::kHair:
      return {{0.2F, 0.2F, 0.2F}, 0.55F, 0.05F, 0};
    case PartKind::kMouthInside:
      return {{0.1F, 0.05F, 0.05F}, 0.6F, 0.02F, 0};
    case PartKind::kOther:
      return {Vector3f::Zero(), 0, 0.04F, 0};
  }
  return {Vector3f::Zero(), 0, 0.04F, 0};
}

/// Light from all around: the sky above, what the floor gives back below.
Vector3f ambientFor(const Vector3f& normal) {
  const float up = 0.5F + 0.5F * normal.y();
  return up * Vector3f(0.36F, 0.37F, 0.39F) + (1 - up) * Vector3f(0.17F, 0.145F, 0.13F);
}

}  // namespace

Vector3f keyLightDirection() { return lights()[0].direction; }

Vector3f litColor(const LitPoint& point) {
  const Surface surface = surfaceOf(point.kind);
  const float roughness = surface.roughness > 0 ? surface.roughness : std::max(point.roughness, 0.2F);
  const float alpha = roughness * roughness, shine = 2 / (alpha * alpha) - 2;
  Vector3f diffuse = point.open_share * ambientFor(point.normal), mirrored = Vector3f::Zero();
  for (const Light& each : lights()) {
    const float share = &each == &lights()[0] ? point.key_share : point.open_share;
    const float towards = point.normal.dot(each.direction);
    const Eigen::Array3f wrapped = ((towards + surface.wrap.array()) / (1 + surface.wrap.array()).square()).max(0.0F);
    diffuse += share * each.color.cwiseProduct(wrapped.matrix());
    if (towards <= 0) continue;
    const Vector3f half = (each.direction + point.to_camera).normalized();
    const float aligned = std::max(point.normal.dot(half), 0.0F);
    const float fresnel =
        surface.reflection + (1 - surface.reflection) * std::pow(1 - std::max(half.dot(point.to_camera), 0.0F), 5.0F);
    const float peak = (shine + 8) / 8 * std::pow(aligned, shine);
    mirrored += share * towards * fresnel * peak * each.color;
  }
  const float edge = 1 - std::max(point.normal.dot(point.to_camera), 0.0F);
  const Vector3f sheen = surface.sheen * point.open_share * edge * edge * edge * Vector3f(0.95F, 0.62F, 0.5F);
  return point.color.cwiseProduct(diffuse) + mirrored + sheen;
}

std::uint8_t screenByte(float linear) {
  constexpr std::size_t kSteps = 4096;
  constexpr float kMost = 4;
  static const std::array<std::uint8_t, kSteps + 1> table = [] {
    std::array<std::uint8_t, kSteps + 1> bytes{};
    for (std::size_t i = 0; i <= kSteps; ++i) {
      // Small values are told apart more finely: the table goes by the square root.
      const double root = static_cast<double>(i) / kSteps, value = static_cast<double>(kMost) * root * root;
      constexpr double kShoulder = 0.76;
      const double shown = value < kShoulder
                               ? value
                               : kShoulder + (1 - kShoulder) * (1 - std::exp(-(value - kShoulder) / (1 - kShoulder)));
      const double srgb = srgbFromLinear(shown);
      bytes[i] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(srgb, 0.0, 1.0)));
    }
    return bytes;
  }();
  const float share = std::sqrt(std::min(std::max(0.0F, linear), kMost) / kMost);
  return table[static_cast<std::size_t>(std::lround(share * kSteps))];
}

}  // namespace mouthpiece
