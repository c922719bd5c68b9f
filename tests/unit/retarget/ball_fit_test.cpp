#include "retarget/rig/ball_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace mouthpiece {
namespace {

constexpr double kNothing = 1e-9;  ///< of the radius: rounding

class Balls : public testing::TestWithParam<unsigned> {
 protected:
  Eigen::Vector3d onSphere() {
    return (Eigen::Vector3d(spread_(random_), spread_(random_), spread_(random_))).normalized();
  }
  std::vector<Eigen::Vector3d> sphere(std::size_t count, double noise) {
    std::vector<Eigen::Vector3d> places;
    for (std::size_t i = 0; i < count; ++i)
      places.push_back(middle_ + radius_ * (1 + noise * spread_(random_)) * onSphere());
    return places;
  }

  std::mt19937 random_{GetParam()};
  std::normal_distribution<double> spread_;
  double radius_ = std::exp(spread_(random_));
  Eigen::Vector3d middle_ = 20 * radius_ * Eigen::Vector3d(spread_(random_), spread_(random_), spread_(random_));
};

TEST_P(Balls, ASphereIsFoundWhereverItLies) {
  const auto ball = ballThrough(sphere(60, 0));
  ASSERT_TRUE(ball.has_value());
  EXPECT_NEAR(ball->radius, radius_, kNothing * 1e3 * radius_);
  EXPECT_LT((ball->middle - middle_).norm(), kNothing * 1e3 * radius_);
}

TEST_P(Balls, FourPlacesAreMetExactly) {
  const std::vector<Eigen::Vector3d> places = sphere(4, 0.3);
  const Ball ball = sphereThrough(places);
  for (const Eigen::Vector3d& place : places)
    EXPECT_NEAR((place - ball.middle).norm(), ball.radius, 1e-6 * ball.radius);
}

TEST_P(Balls, WhatIsRoughIsNoBall) {
  EXPECT_TRUE(ballThrough(sphere(200, 0.02)).has_value());
  EXPECT_FALSE(ballThrough(sphere(200, 0.4)).has_value());
}

TEST_P(Balls, ACapOfAFewDegreesIsNoBall) {
  std::vector<Eigen::Vector3d> places;
  for (const Eigen::Vector3d& place : sphere(20000, 0)) {
    if ((place - middle_).z() > 0.97 * radius_) places.push_back(place);
  }
  ASSERT_GE(places.size(), 100U);
  EXPECT_FALSE(ballThrough(places).has_value()) << "a cornea, not an eye";
}

TEST_P(Balls, ASliceOfABallIsNoBall) {
  std::vector<Eigen::Vector3d> places;
  for (const Eigen::Vector3d& place : sphere(2000, 0)) {
    if (std::abs((place - middle_).x()) < 0.3 * radius_) places.push_back(place);
  }
  EXPECT_FALSE(ballThrough(places).has_value()) << "as deep as a ball, and not as wide";
}

INSTANTIATE_TEST_SUITE_P(Seeds, Balls, testing::Range(1U, 21U));

TEST(Ball, ARingIsNoBall) {
  std::vector<Eigen::Vector3d> ring;
  for (int i = 0; i < 40; ++i) ring.emplace_back(std::cos(0.157 * i), std::sin(0.157 * i), 0.0);
  EXPECT_FALSE(ballThrough(ring).has_value()) << "a tear line lies in a plane: no sphere is the nearest";
}

}  // namespace
}  // namespace mouthpiece
