#pragma once

#include <cstddef>
#include <cstdint>

namespace mouthpiece {

/// Large enough for millions of polygons, small enough for the machine.
inline constexpr std::uint64_t kMaxMeshBytes = std::uint64_t{1} << 30;
/// More than any head has; what says so is damaged or no head.
inline constexpr std::size_t kMaxMeshVertices = 8'000'000;
inline constexpr std::size_t kMaxMeshTriangles = 16'000'000;
inline constexpr std::size_t kMaxMeshParts = 4096;
/// A polygon with more corners than this is refused.
inline constexpr std::size_t kMaxPolygonCorners = 4096;
/// Coordinates beyond this lose all precision in 32-bit floats around a head of any unit.
inline constexpr double kMaxCoordinate = 1e7;
/// Larger sets of shapes are refused.
inline constexpr std::size_t kMaxShapes = 1000;
inline constexpr std::size_t kMaxShapeNumbers = 300'000'000;

}  // namespace mouthpiece
