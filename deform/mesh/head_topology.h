#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// Distances along a mesh's edges. Vertices in one place count as one where `may_weld` says so (texture seams double
/// them).
class MeshGraph {
 public:
  MeshGraph(const FaceMesh& mesh, const std::function<bool(std::uint32_t vertex)>& may_weld);

  struct Reach {
    std::vector<double> distance;      ///< infinite where no seed reaches
    std::vector<std::int32_t> source;  ///< the seed that does; -1: none
  };
  /// Shortest ways along edges from `seeds`, over vertices where `may_pass` holds.
  [[nodiscard]] Reach reachFrom(const std::vector<std::uint32_t>& seeds,
                                const std::function<bool(std::uint32_t vertex)>& may_pass) const;

  /// Number of each vertex' connected part of the mesh.
  [[nodiscard]] std::vector<std::uint32_t> components() const;

 private:
  struct Link {
    std::uint32_t to;
    float length;
  };
  std::vector<std::size_t> first_;  ///< links of vertex i: [first_[i], first_[i + 1])
  std::vector<Link> links_;
};

}  // namespace mouthpiece
