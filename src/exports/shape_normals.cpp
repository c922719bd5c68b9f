#include "exports/shape_normals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace mouthpiece {
namespace {

using Eigen::Index;

/// Shapes worked on side by side: the moving part of the mesh is walked once for all of them.
constexpr Index kLanes = 8;
constexpr Index kVertexStride = 3 * kLanes;  ///< x of all lanes, then y, then z
constexpr float kVisibleTurn = 0.0087F;      ///< half a degree, in radians

/// The triangles that some shape moves, in numbers of their own: a face is mostly hair and back of the head.
struct MovingPart {
  std::vector<std::uint32_t> vertices;  ///< of the mesh, all corners of `triangles`, rising
  std::vector<Index> columns;           ///< where each moves in the shapes' rows, -1 for one that rests
  std::vector<Triangle> triangles;      ///< into `vertices`
  std::vector<Triangle> others;         ///< into the mesh
};

/// Where some shape moves each vertex of the mesh: the column of its x, -1 for those that rest.
std::vector<Index> movingColumns(const PrincipalShapes& shapes) {
  std::vector<Index> columns(static_cast<std::size_t>(shapes.rest.cols() / 3), -1);
  if (shapes.shapeCount() == 0) return columns;
  Eigen::RowVectorXf largest = shapes.shapes.row(0).cwiseAbs();
  for (Index k = 1; k < shapes.shapeCount(); ++k) largest = largest.cwiseMax(shapes.shapes.row(k).cwiseAbs());
  const std::vector<std::uint32_t> vertices = shapes.columnVertices();
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const auto column = 3 * static_cast<Index>(i);
    if (!largest.segment<3>(column).isZero(0)) columns[vertices[i]] = column;
  }
  return columns;
}

MovingPart movingPart(const std::vector<Triangle>& triangles, const PrincipalShapes& shapes) {
  const auto vertex_count = static_cast<std::size_t>(shapes.rest.cols() / 3);
  const std::vector<Index> columns = movingColumns(shapes);
  MovingPart part;
  std::vector<char> is_corner(vertex_count, 0);
  for (const Triangle& triangle : triangles) {
    const auto moves = [&](std::uint32_t corner) { return columns[corner] >= 0; };
    const bool is_still = std::none_of(triangle.begin(), triangle.end(), moves);
    (is_still ? part.others : part.triangles).push_back(triangle);
    if (is_still) continue;
    for (const std::uint32_t corner : triangle) is_corner[corner] = 1;
  }
  std::vector<std::uint32_t> numbers(vertex_count);
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    if (is_corner[v] == 0) continue;
    numbers[v] = static_cast<std::uint32_t>(part.vertices.size());
    part.vertices.push_back(v);
    part.columns.push_back(columns[v]);
  }
  for (Triangle& triangle : part.triangles) {
    for (std::uint32_t& corner : triangle) corner = numbers[corner];
  }
  return part;
}

/// Twice each triangle's area times its normal, summed over the triangles around each vertex.
VertexPositions normalSums(const std::vector<Triangle>& triangles, const Eigen::RowVectorXf& positions) {
  VertexPositions sums = VertexPositions::Zero(positions.cols() / 3, 3);
  for (const auto& [a, b, c] : triangles) {
    const Eigen::RowVector3f corner = positions.segment<3>(3 * a);
    const Eigen::RowVector3f cross = (positions.segment<3>(3 * b) - corner).cross(positions.segment<3>(3 * c) - corner);
    sums.row(a) += cross;
    sums.row(b) += cross;
    sums.row(c) += cross;
  }
  return sums;
}

/// +Z where there is no area.
Eigen::RowVector3f unitNormal(const Eigen::RowVector3f& sum) {
  const float length = sum.norm();
  return length > 1e-20F ? Eigen::RowVector3f(sum / length) : Eigen::RowVector3f(0, 0, 1);
}

/// The moving part in eight shapes at once. A lane without a shape rests.
class LaneNormals {
 public:
  LaneNormals(const MovingPart& part, const PrincipalShapes& shapes, const VertexPositions& sums_of_others)
      : part_(part),
        shapes_(shapes),
        positions_(part.vertices.size() * kVertexStride),
        sums_of_others_(positions_.size()),
        normals_(positions_.size()) {
    for (std::size_t i = 0; i < part.vertices.size(); ++i) {
      for (Index axis = 0; axis < 3; ++axis) {
        std::fill_n(sums_of_others_.data() + i * kVertexStride + axis * kLanes, kLanes,
                    sums_of_others(part.vertices[i], axis));
      }
    }
  }

  /// Turns of shapes [first, first + 8) into `result`.
  void compute(Index first, ShapeNormals& result) {
    load(first);
    normals_ = sums_of_others_;
    accumulate();
    normalize();
    store(first, result);
  }

 private:
  void load(Index first) {
    const Index count = std::min(kLanes, shapes_.shapeCount() - first);
    for (std::size_t i = 0; i < part_.vertices.size(); ++i) {
      for (Index axis = 0; axis < 3; ++axis) {
        float* to = positions_.data() + i * kVertexStride + axis * kLanes;
        std::fill_n(to, kLanes, shapes_.rest(3 * Index{part_.vertices[i]} + axis));
        if (part_.columns[i] < 0) continue;
        const float* from = shapes_.shapes.row(first).data() + part_.columns[i] + axis;
        for (Index lane = 0; lane < count; ++lane, from += shapes_.shapes.cols()) to[lane] += *from;
      }
    }
  }

  void accumulate() {
    for (const Triangle& triangle : part_.triangles) {
      const float* a = positions_.data() + triangle[0] * kVertexStride;
      const float* b = positions_.data() + triangle[1] * kVertexStride;
      const float* c = positions_.data() + triangle[2] * kVertexStride;
      float cross[kVertexStride];
      for (Index lane = 0; lane < kLanes; ++lane) {
        const float ux = b[lane] - a[lane];
        const float uy = b[lane + kLanes] - a[lane + kLanes];
        const float uz = b[lane + 2 * kLanes] - a[lane + 2 * kLanes];
        const float vx = c[lane] - a[lane];
        const float vy = c[lane + kLanes] - a[lane + kLanes];
        const float vz = c[lane + 2 * kLanes] - a[lane + 2 * kLanes];
        cross[lane] = uy * vz - uz * vy;
        cross[lane + kLanes] = uz * vx - ux * vz;
        cross[lane + 2 * kLanes] = ux * vy - uy * vx;
      }
      for (const std::uint32_t corner : triangle) {
        float* normal = normals_.data() + corner * kVertexStride;
        for (Index i = 0; i < kVertexStride; ++i) normal[i] += cross[i];
      }
    }
  }

  void normalize() {
    for (std::size_t i = 0; i < part_.vertices.size(); ++i) {
      float* x = normals_.data() + i * kVertexStride;
      float* y = x + kLanes;
      float* z = y + kLanes;
      for (Index lane = 0; lane < kLanes; ++lane) {
        const float length = std::sqrt(x[lane] * x[lane] + y[lane] * y[lane] + z[lane] * z[lane]);
        const bool flat = !(length > 1e-20F);
        const float scale = flat ? 0.0F : 1.0F / length;
        x[lane] *= scale;
        y[lane] *= scale;
        z[lane] = flat ? 1.0F : z[lane] * scale;
      }
    }
  }

  void store(Index first, ShapeNormals& result) const {
    const Index count = std::min(kLanes, shapes_.shapeCount() - first);
    for (Index lane = 0; lane < count; ++lane) {
      float* to = result.deltas.row(first + lane).data();
      for (std::size_t i = 0; i < part_.vertices.size(); ++i) {
        const float* rest = result.rest.data() + 3 * std::size_t{part_.vertices[i]};
        const float* normal = normals_.data() + i * kVertexStride + lane;
        const float x = normal[0] - rest[0];
        const float y = normal[kLanes] - rest[1];
        const float z = normal[2 * kLanes] - rest[2];
        const float kept = x * x + y * y + z * z <= kVisibleTurn * kVisibleTurn ? 0.0F : 1.0F;
        to[3 * i] = kept * x;
        to[3 * i + 1] = kept * y;
        to[3 * i + 2] = kept * z;
      }
    }
  }

  const MovingPart& part_;
  const PrincipalShapes& shapes_;
  std::vector<float> positions_;
  std::vector<float> sums_of_others_;  ///< what the triangles that never move add to each normal, in every lane
  std::vector<float> normals_;
};

}  // namespace

ShapeNormals shapeNormals(const std::vector<Triangle>& triangles, const PrincipalShapes& shapes) {
  ShapeNormals result;
  result.rest.resize(shapes.rest.cols());
  const VertexPositions sums = normalSums(triangles, shapes.rest);
  for (Index v = 0; v < sums.rows(); ++v) result.rest.segment<3>(3 * v) = unitNormal(sums.row(v));

  const MovingPart part = movingPart(triangles, shapes);
  result.vertices = part.vertices;
  result.deltas.resize(shapes.shapeCount(), 3 * static_cast<Index>(part.vertices.size()));
  LaneNormals lanes(part, shapes, normalSums(part.others, shapes.rest));
  for (Index first = 0; first < shapes.shapeCount(); first += kLanes) lanes.compute(first, result);
  return result;
}

}  // namespace mouthpiece
