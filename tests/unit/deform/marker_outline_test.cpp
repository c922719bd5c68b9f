#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "deform/surface/surface_projection.h"

namespace mouthpiece {
namespace {

class Outlines : public testing::TestWithParam<unsigned> {
 protected:
  MarkerPositions markers(Eigen::Index count) {
    MarkerPositions places(count, 3);
    for (double& number : places.reshaped()) number = spread_(random_);
    return places;
  }
  std::mt19937 random_{GetParam()};
  std::normal_distribution<double> spread_{0, 40};
};

/// Outside is what a line through two of the markers, with all others on one side of it, has on its other side.
bool isOutside(const MarkerPositions& markers, const Eigen::Vector2d& point) {
  const auto side = [&](Eigen::Index a, Eigen::Index b, const Eigen::Vector2d& p) {
    const Eigen::Vector2d from = markers.row(a).head<2>().transpose(), to = markers.row(b).head<2>().transpose();
    return (to.x() - from.x()) * (p.y() - from.y()) - (to.y() - from.y()) * (p.x() - from.x());
  };
  for (Eigen::Index a = 0; a < markers.rows(); ++a) {
    for (Eigen::Index b = 0; b < markers.rows(); ++b) {
      bool is_edge = a != b;
      for (Eigen::Index c = 0; c < markers.rows() && is_edge; ++c)
        is_edge = c == a || c == b || side(a, b, markers.row(c).head<2>().transpose()) >= 0;
      if (is_edge && side(a, b, point) < 0) return true;
    }
  }
  return false;
}

TEST_P(Outlines, HoldWhatNoSideOfThemPartsFromTheMarkers) {
  const MarkerPositions places = markers(3 + static_cast<Eigen::Index>(GetParam() % 9));
  Eigen::MatrixX2d points(200, 2);
  for (double& number : points.reshaped()) number = spread_(random_);
  const std::vector<bool> within = withinOutline(places, points);
  ASSERT_EQ(within.size(), 200U);
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    EXPECT_NE(within[static_cast<std::size_t>(i)], isOutside(places, points.row(i).transpose()));
}

TEST_P(Outlines, DoNotDependOnDepthOrOrder) {
  MarkerPositions places = markers(8);
  Eigen::MatrixX2d points(100, 2);
  for (double& number : points.reshaped()) number = spread_(random_);
  const std::vector<bool> within = withinOutline(places, points);
  for (double& depth : places.col(2).reshaped()) depth = spread_(random_);
  EXPECT_EQ(withinOutline(places, points), within);
  EXPECT_EQ(withinOutline(places.colwise().reverse(), points), within);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Outlines, testing::Range(1U, 25U));

TEST(Outline, HoldTheirMarkersAndMiddle) {
  MarkerPositions square(4, 3);
  square << 0, 0, 5, 10, 0, 1, 10, 10, 2, 0, 10, 9;
  Eigen::MatrixX2d points(7, 2);
  points << 0, 0, 10, 10, 5, 5, 5, 0, 10.001, 5, -0.001, 5, 5, 11;
  EXPECT_EQ(withinOutline(square, points), (std::vector<bool>{true, true, true, true, false, false, false}));
}

}  // namespace
}  // namespace mouthpiece
