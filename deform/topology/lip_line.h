#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "deform/mesh/triangles.h"

namespace mouthpiece {

/// What is known of a mouth before its lips are looked for, the mesh's unit; the mesh stands upright (Y up, Z out of
/// the face). All of it may be off by some millimetres.
struct MouthHints {
  Eigen::Vector3d corner_right, corner_left;
  Eigen::Vector3d upper, lower;  ///< on either lip's skin in the mouth's middle
  /// Places on the line where the lips meet, any number in any order: the line keeps near them.
  std::vector<Eigen::Vector3d> on_line = {};
};

/// Where two lips part. The rims have as many points each, from the right corner to the left one; points of the same
/// number lie in one plane across the mouth and meet when it closes.
struct LipLine {
  std::vector<Eigen::Vector3d> upper, lower;
  Eigen::Vector3d corner_right, corner_left;          ///< where the slit ends
  std::vector<std::uint32_t> upper_skin, lower_skin;  ///< vertices in front of the rims, whose side is certain
  std::vector<std::uint32_t> inside;  ///< vertices behind the rims: of the lips' backs, the mouth bag, inner walls
  bool is_parted = true;  ///< no: the lips are one surface, and both rims are the crease where they seem to meet

  /// Points of the rims in the plane across the mouth through `place`.
  struct Pair {
    Eigen::Vector3d upper, lower;
  };
  [[nodiscard]] Pair at(const Eigen::Vector3d& place) const;
};

/// Finds the line between the lips of `triangles` (skin, lips and the mouth's inside) by what a mouth is. The mesh is
/// cut by planes across the mouth. Seen in such a section, one outline leads down from the skin over the mouth and one
/// up from below it; where they come nearest to each other, as far in front as may be, are the rims. Two outlines may
/// end at the edge of a hole, may run on inside the head (double walls), may be joined by a pocket behind (a mouth
/// bag), or may lie in one place: in all of these the lips are two. The corners are where the pocket ends. nullopt
/// where the hints are no mouth's or no skin is there.
std::optional<LipLine> traceLipLine(const VertexPositions& vertices, std::span<const Triangle> triangles,
                                    const MouthHints& hints);

}  // namespace mouthpiece
