#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/index.h"
#include "exports/shapes/principal_shapes.h"

namespace mouthpiece {
namespace {

/// Shapes worked on side by side: the moving part of the mesh is walked once for all of them.
constexpr Eigen::Index kLanes = 8;
constexpr Eigen::Index kVertexStride = 3 * kLanes;  ///< x of all lanes, then y, then z
constexpr float kVisibleTurn = 0.0087F;             ///< half a degree, in radians
constexpr float kLeastArea = 1e-20F;

/// The triangles that some shape moves, in numbers of their own: a face is mostly hair and back of the head.
struct MovingPart {
  std::vector<std::uint32_t> vertices;  ///< of the mesh, all corners of `triangles`, rising
  std::vector<Eigen::Index> columns;    ///< where each moves in the shapes' rows, -1 for one that rests
  std::vector<Triangle> triangles;      ///< into `vertices`
};

/// Where some shape moves each vertex of the mesh: the column of its x, -1 for those that rest.
std::vector<Eigen::Index> movingColumns(const PrincipalShapes& shapes) {
  std::vector<Eigen::Index> columns(unsignedIndex(shapes.rest.cols() / 3), -1);
  if (shapes.shapeCount() == 0) return columns;
  Eigen::RowVectorXf largest = shapes.shapes.row(0).cwiseAbs();
  for (Eigen::Index k = 1; k < shapes.shapeCount(); ++k) largest = largest.cwiseMax(shapes.shapes.row(k).cwiseAbs());
  const std::vector<std::uint32_t> vertices = shapes.columnVertices();
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const auto column = 3 * signedIndex(i);
    if (!largest.segment<3>(column).isZero(0)) columns[vertices[i]] = column;
  }
  return columns;
}

MovingPart movingPart(const std::vector<Triangle>& triangles, const PrincipalShapes& shapes) {
  const auto vertex_count = unsignedIndex(shapes.rest.cols() / 3);
  const std::vector<Eigen::Index> columns = movingColumns(shapes);
  MovingPart part;
  std::vector<char> is_corner(vertex_count, 0);
  for (const Triangle& triangle : triangles) {
    const auto moves = [&](std::uint32_t corner) { return columns[corner] >= 0; };
    const bool is_still = std::none_of(triangle.begin(), triangle.end(), moves);
    if (is_still) continue;
    part.triangles.push_back(triangle);
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
  return length > kLeastArea ? Eigen::RowVector3f(sum / length) : Eigen::RowVector3f(0, 0, 1);
}

/// How the normals of the moving part begin to turn in eight shapes at once. A lane without a shape rests.
class LaneNormals {
 public:
  /// `sums`: normalSums of the resting mesh.
  LaneNormals(const MovingPart& part, const PrincipalShapes& shapes, const VertexPositions& sums)
      : part_(part),
        shapes_(shapes),
        sums_(sums),
        moves_(part.vertices.size() * kVertexStride),
        changes_(moves_.size()),
        is_moved_(part.vertices.size()),
        is_turned_(part.vertices.size()) {}

  /// Turns of shapes [first, first + 8) into `result`.
  void compute(Eigen::Index first, ShapeNormals& result) {
    load(first);
    std::fill(changes_.begin(), changes_.end(), 0.0F);
    std::fill(is_turned_.begin(), is_turned_.end(), char{0});
    // Most shapes move little of a face.
    for (const Triangle& triangle : part_.triangles) {
      if ((is_moved_[triangle[0]] | is_moved_[triangle[1]] | is_moved_[triangle[2]]) == 0) continue;
      accumulate(triangle);
      for (const std::uint32_t corner : triangle) is_turned_[corner] = 1;
    }
    store(first, result);
  }

 private:
  void load(Eigen::Index first) {
    const Eigen::Index count = std::min(kLanes, shapes_.shapeCount() - first);
    std::fill(moves_.begin(), moves_.end(), 0.0F);
    std::fill(is_moved_.begin(), is_moved_.end(), char{0});
    for (std::size_t i = 0; i < part_.vertices.size(); ++i) {
      if (part_.columns[i] < 0) continue;
      float farthest = 0;
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        float* to = moves_.data() + i * kVertexStride + axis * kLanes;
        const float* from = shapes_.shapes.row(first).data() + part_.columns[i] + axis;
        for (Eigen::Index lane = 0; lane < count; ++lane, from += shapes_.shapes.cols()) {
          to[lane] = *from;
          farthest = std::max(farthest, std::abs(*from));
        }
      }
      is_moved_[i] = farthest > 0 ? 1 : 0;
    }
  }

  [[nodiscard]] Eigen::Vector3f atRest(std::uint32_t vertex) const {
    return shapes_.rest.segment<3>(3 * signedIndex(part_.vertices[vertex])).transpose();
  }

  /// Of a triangle's normal u x v: du x v + u x dv.
  void accumulate(const Triangle& triangle) {
    const Eigen::Vector3f u = atRest(triangle[1]) - atRest(triangle[0]), v = atRest(triangle[2]) - atRest(triangle[0]);
    const float* a = moves_.data() + triangle[0] * kVertexStride;
    const float* b = moves_.data() + triangle[1] * kVertexStride;
    const float* c = moves_.data() + triangle[2] * kVertexStride;
    float change[kVertexStride];
    for (Eigen::Index lane = 0; lane < kLanes; ++lane) {
      const float ux = b[lane] - a[lane];
      const float uy = b[lane + kLanes] - a[lane + kLanes];
      const float uz = b[lane + 2 * kLanes] - a[lane + 2 * kLanes];
      const float vx = c[lane] - a[lane];
      const float vy = c[lane + kLanes] - a[lane + kLanes];
      const float vz = c[lane + 2 * kLanes] - a[lane + 2 * kLanes];
      change[lane] = uy * v.z() - uz * v.y() + u.y() * vz - u.z() * vy;
      change[lane + kLanes] = uz * v.x() - ux * v.z() + u.z() * vx - u.x() * vz;
      change[lane + 2 * kLanes] = ux * v.y() - uy * v.x() + u.x() * vy - u.y() * vx;
    }
    for (const std::uint32_t corner : triangle) {
      float* sum = changes_.data() + corner * kVertexStride;
      for (Eigen::Index i = 0; i < kVertexStride; ++i) sum[i] += change[i];
    }
  }

  void store(Eigen::Index first, ShapeNormals& result) const {
    const Eigen::Index count = std::min(kLanes, shapes_.shapeCount() - first);
    for (std::size_t i = 0; i < part_.vertices.size(); ++i) {
      const float length = sums_.row(part_.vertices[i]).norm();
      if (is_turned_[i] == 0 || !(length > kLeastArea)) continue;
      const auto normal = result.rest.segment<3>(3 * signedIndex(part_.vertices[i]));
      using Lanes = Eigen::Array<float, kLanes, 1>;
      using Change = Eigen::Map<const Lanes>;
      const float* change = changes_.data() + i * kVertexStride;
      const Change x(change), y(change + kLanes), z(change + 2 * kLanes);
      const Lanes along = normal.x() * x + (normal.y() * y + normal.z() * z);
      const Lanes turn_x = (x - along * normal.x()) / length, turn_y = (y - along * normal.y()) / length,
                  turn_z = (z - along * normal.z()) / length;
      const Lanes squared = turn_x * turn_x + (turn_y * turn_y + turn_z * turn_z);
      for (Eigen::Index lane = 0; lane < count; ++lane) {
        if (!(squared[lane] > kVisibleTurn * kVisibleTurn)) continue;
        ShapeNormals::Turns& turns = result.shapes[unsignedIndex(first + lane)];
        turns.vertices.push_back(part_.vertices[i]);
        turns.values.insert(turns.values.end(), {turn_x[lane], turn_y[lane], turn_z[lane]});
      }
    }
  }

  const MovingPart& part_;
  const PrincipalShapes& shapes_;
  const VertexPositions& sums_;
  std::vector<float> moves_;
  std::vector<float> changes_;              ///< of each vertex' sum of normals
  std::vector<char> is_moved_, is_turned_;  ///< in some lane
};

}  // namespace

ShapeNormals shapeNormals(const std::vector<Triangle>& triangles, const PrincipalShapes& shapes) {
  ShapeNormals result;
  result.rest.resize(shapes.rest.cols());
  const VertexPositions sums = normalSums(triangles, shapes.rest);
  for (Eigen::Index v = 0; v < sums.rows(); ++v) result.rest.segment<3>(3 * v) = unitNormal(sums.row(v));

  const MovingPart part = movingPart(triangles, shapes);
  result.shapes.resize(unsignedIndex(shapes.shapeCount()));
  LaneNormals lanes(part, shapes, sums);
  for (Eigen::Index first = 0; first < shapes.shapeCount(); first += kLanes) lanes.compute(first, result);
  return result;
}

}  // namespace mouthpiece
