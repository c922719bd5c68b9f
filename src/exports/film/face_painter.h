#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "deform/mesh/part_kind.h"
#include "deform/mesh/triangles.h"
#include "exports/film/picture.h"

namespace mouthpiece {

struct FaceMesh;

/// Draws a head as a photographer would light it, without a graphics card: a key light that throws shadows, a fill, two
/// lights from behind; skin that light creeps into; seen from a little beside. Colours are those of the parts and
/// vertices; pictures (textures) are not shown. The same vertices give the same picture. Immutable: several threads may
/// paint with one, each its own picture.
class FacePainter {
 public:
  /// `mesh` is upright, faces +Z and outlives this; `focus`: what is to be in the picture, mesh unit. It is seen from
  /// that side.
  FacePainter(const FaceMesh& mesh, const Eigen::AlignedBox3f& focus, std::size_t width, std::size_t height,
              const Eigen::Vector3f& towards_camera = {0.3F, 0.06F, 1});

  /// The head with its vertices at these places.
  void paint(const VertexPositions& vertices, Picture& picture) const;

  /// Where a place is seen: pixels from the picture's upper left, and one over its depth before the camera, which is
  /// linear across a triangle's picture. fromPicture() gives the place back.
  [[nodiscard]] Eigen::Vector3f onPicture(const Eigen::Vector3f& place) const;
  [[nodiscard]] Eigen::Vector3f fromPicture(const Eigen::Vector3f& seen) const;

 private:
  /// A vertex as one part shows it.
  struct Corner {
    std::uint32_t vertex;
    PartKind kind;
    Eigen::Vector3f color;  ///< linear
    float roughness;
  };

  const FaceMesh& mesh_;
  std::vector<Corner> corners_;
  std::vector<Triangle> triangles_;  ///< of corners
  Eigen::Matrix3f view_from_mesh_;   ///< rows: right, up, towards the camera
  Eigen::Vector3f eye_, middle_;
  float reach_;         ///< of the focus from its middle
  float focal_length_;  ///< in samples
  std::size_t width_, height_;
};

}  // namespace mouthpiece
