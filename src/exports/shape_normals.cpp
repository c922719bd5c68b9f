#include "exports/shape_normals.h"

#include <algorithm>
#include <cmath>

namespace mouthpiece {
namespace {

using Eigen::Index;

/// Shapes worked on side by side: the mesh is walked once for all of them.
constexpr Index kLanes = 8;
constexpr Index kVertexStride = 3 * kLanes;  ///< x of all lanes, then y, then z
constexpr float kVisibleTurn = 0.0087F;      ///< half a degree, in radians

/// positions[v * kVertexStride + axis * kLanes + lane] = rest + shapes.row(first + lane); missing lanes rest.
void loadLanes(const PrincipalShapes& shapes, Index first, std::vector<float>& positions) {
  const Index count = std::clamp<Index>(shapes.shapeCount() - first, 0, kLanes);
  for (Index component = 0; component < shapes.rest.cols(); ++component) {
    float* to = positions.data() + component * kLanes;
    const float rest = shapes.rest(component);
    for (Index lane = 0; lane < kLanes; ++lane) to[lane] = rest;
    for (Index lane = 0; lane < count; ++lane) to[lane] += shapes.shapes(first + lane, component);
  }
}

/// Adds twice each triangle's area times its normal to its three corners.
void accumulateNormals(const std::vector<Triangle>& triangles, const std::vector<float>& positions,
                       std::vector<float>& normals) {
  std::fill(normals.begin(), normals.end(), 0.0F);
  for (const Triangle& triangle : triangles) {
    const float* a = positions.data() + triangle[0] * kVertexStride;
    const float* b = positions.data() + triangle[1] * kVertexStride;
    const float* c = positions.data() + triangle[2] * kVertexStride;
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
      float* normal = normals.data() + corner * kVertexStride;
      for (Index i = 0; i < kVertexStride; ++i) normal[i] += cross[i];
    }
  }
}

void normalize(std::vector<float>& normals, std::size_t vertex_count) {
  for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
    float* x = normals.data() + vertex * kVertexStride;
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

void storeDeltas(const std::vector<float>& normals, Index first, ShapeNormals& result) {
  const Index count = std::min(kLanes, result.deltas.rows() - first);
  for (Index lane = 0; lane < count; ++lane) {
    float* to = result.deltas.row(first + lane).data();
    for (Index component = 0; component < result.rest.cols(); component += 3) {
      float delta[3];
      float square = 0;
      for (Index axis = 0; axis < 3; ++axis) {
        delta[axis] = normals[static_cast<std::size_t>((component + axis) * kLanes + lane)] - result.rest(component + axis);
        square += delta[axis] * delta[axis];
      }
      const bool visible = square > kVisibleTurn * kVisibleTurn;
      for (Index axis = 0; axis < 3; ++axis) to[component + axis] = visible ? delta[axis] : 0.0F;
    }
  }
}

}  // namespace

ShapeNormals shapeNormals(const std::vector<Triangle>& triangles, const PrincipalShapes& shapes) {
  ShapeNormals result;
  const Index components = shapes.rest.cols();
  result.rest.resize(components);
  result.deltas.resize(shapes.shapeCount(), components);
  std::vector<float> positions(static_cast<std::size_t>(components * kLanes));
  std::vector<float> normals(positions.size());
  const auto compute = [&](Index first) {
    loadLanes(shapes, first, positions);
    accumulateNormals(triangles, positions, normals);
    normalize(normals, static_cast<std::size_t>(components / 3));
  };
  compute(shapes.shapeCount());  // no shape: the resting mesh in every lane
  for (Index component = 0; component < components; ++component) {
    result.rest(component) = normals[static_cast<std::size_t>(component * kLanes)];
  }
  for (Index first = 0; first < shapes.shapeCount(); first += kLanes) {
    compute(first);
    storeDeltas(normals, first, result);
  }
  return result;
}

}  // namespace mouthpiece
