#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "deform/topology/lip_line.h"

namespace mouthpiece {

/// A place on an outline: depth and height in the section's plane, and the edge that the plane cuts there.
struct OutlinePoint {
  Eigen::Vector2d at;
  std::uint32_t a = 0, b = 0;
  double way = 0;  ///< along the outline from its start
};

/// One lip's outline in a section.
struct Outline {
  std::vector<OutlinePoint> points;
  std::vector<double> joins;     ///< ways at which two edges of the mesh lie in one place without being one
  std::optional<double> joined;  ///< the way at which it reaches the other outline's start
};

/// A mesh cut by planes across its mouth. Lengths are shares of the mouth's width; a plane is told by its way across
/// the mouth, 0 at the right corner and 1 at the left one, and places in it by their depth and height.
class MouthSections {
 public:
  /// An outline is followed this far.
  static constexpr double kOutline = 1.0;
  /// Between the places of an outline.
  static constexpr double kStep = 0.012;
  /// Which way an outline leads is told by where it is so far on.
  static constexpr double kAhead = 0.06;

  /// `vertices` and `hints` must outlive this.
  MouthSections(const VertexPositions& vertices, std::span<const Triangle> triangles, const MouthHints& hints);

  /// Whether the hints are those of a mouth, and there are triangles around it.
  [[nodiscard]] bool isMouth() const;

  [[nodiscard]] Eigen::Vector2d inSection(const Eigen::Vector3d& p) const;
  [[nodiscard]] Eigen::Vector3d inSpace(double way, const Eigen::Vector2d& p) const;
  [[nodiscard]] double wayOf(const Eigen::Vector3d& p) const;

  /// Where the mouth should be in a section, and half of how far its lips are apart: a bow through the corners and
  /// between the lips.
  [[nodiscard]] std::pair<Eigen::Vector2d, double> expected(double way) const;

  /// From the skin above the mouth down and from that below it up, at steps of kStep; nullopt where there is no skin.
  struct Outlines {
    Outline upper, lower;
  };
  [[nodiscard]] std::optional<Outlines> outlinesAt(double way) const;

 private:
  struct Plane;

  void takeRegion(std::span<const Triangle> triangles);
  [[nodiscard]] Plane cut(double way) const;
  [[nodiscard]] static std::optional<std::uint32_t> frontAt(const Plane& plane, const Eigen::Vector2d& near);
  [[nodiscard]] std::optional<std::uint32_t> beyond(const Plane& plane, std::uint32_t from, std::size_t end,
                                                    bool& joins) const;
  [[nodiscard]] Outline follow(const Plane& plane, std::uint32_t start, std::size_t end,
                               std::optional<std::uint32_t> goal, double longest) const;
  [[nodiscard]] Outline followTowards(const Plane& plane, std::uint32_t start, double sign,
                                      std::optional<std::uint32_t> goal, double longest) const;

  const VertexPositions& vertices_;
  const MouthHints& hints_;
  Eigen::Vector3d origin_, across_, up_, forward_;
  double width_ = 0;
  std::vector<Triangle> region_;
  std::vector<std::array<std::uint32_t, 3>> places_;  ///< of each triangle: the first vertex in each corner's place
  std::vector<std::array<double, 3>> ways_;           ///< and how far across the mouth it is
  std::unordered_map<std::uint32_t, std::uint32_t> place_;
  std::unordered_map<std::uint32_t, double> way_;
};

}  // namespace mouthpiece
