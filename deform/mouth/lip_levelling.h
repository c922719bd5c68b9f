#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "deform/mesh/triangles.h"
#include "deform/surface/binding.h"
#include "deform/surface/control_surface.h"

namespace mouthpiece {

struct FaceMesh;

/// Which of a mesh's vertices are of the upper and of the lower lip alone, as their places on the surface tell.
struct LipVertices {
  std::vector<bool> upper, lower;  ///< both at the corners
  LipVertices(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding);
  /// Those of one lip only, rising.
  [[nodiscard]] std::vector<std::uint32_t> ofOne(bool is_upper) const;
};

/// What it costs to move vertices up, a row each: w' C w = sum of w_i^2 + sum over `edges` of ((w_i - w_j) spreads /
/// length)^2. `row_of`: each vertex' row, -1: it stays. `rest` and `spreads`, how far a movement spreads, in one unit.
Eigen::SparseMatrix<double> costOfMoving(const std::set<std::pair<std::uint32_t, std::uint32_t>>& edges,
                                         const std::vector<int>& row_of, const VertexPositions& rest, double spreads);

/// Vertices of coarse lips do not lie opposite each other: where the lips close, each moved by its own markers, slits
/// stay open between their edges, which no movement by columns shuts. Found is the least upright movement, spread
/// over the lips, after which they touch in sections across the mouth in as many closures as may be.
class LipLevelling {
 public:
  struct Options {
    double softness = 0.05;  ///< of a touch, against movement
    double into = 0.002;     ///< lips that shall touch are brought so far into each other, mouth widths
  };

  /// `binding` is that of `mesh`, at rest.
  LipLevelling(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding, const Options& options);
  LipLevelling(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding)
      : LipLevelling(mesh, control, binding, Options{}) {}
  LipLevelling(LipLevelling&&) noexcept;
  ~LipLevelling();

  /// Adds to binding.levelled what `closures` need: poses of the mesh in which the lips shall touch.
  void level(std::span<const VertexPositions> closures, FaceBinding& binding) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

}  // namespace mouthpiece
