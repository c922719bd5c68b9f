#include "deform/mouth/jaw.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using testing::sampleControl;

MarkerPositions hinged(double open_rad, double sideways_rad, const Eigen::Vector3d& slide) {
  const JawHinge jaw(sampleControl());
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(sideways_rad, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(open_rad, Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  MarkerPositions points = sampleControl().rest;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    points.row(i) = (jaw.pivot() + turn * (points.row(i).transpose() - jaw.pivot()) + slide).transpose();
  }
  return points;
}

TEST(JawHinge, AddsNothingAtRest) {
  const AddedMotion added = JawHinge(sampleControl()).motion(sampleControl().rest);
  EXPECT_EQ(added.turn.cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(added.shift.cwiseAbs().maxCoeff(), 0.0);
}

TEST(JawHinge, FindsAHingesTurn) {
  const JawHinge jaw(sampleControl());
  for (const double open : {-0.05, 0.1, 0.3}) {
    const AddedMotion added = jaw.motion(hinged(open, 0, Eigen::Vector3d::Zero()));
    const Eigen::Matrix3d expected = Eigen::AngleAxisd(open, Eigen::Vector3d::UnitX()).toRotationMatrix();
    EXPECT_LT((added.turn + Eigen::Matrix3d::Identity() - expected).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((added.turn * jaw.pivot() + added.shift).norm(), 1e-4) << "the pivot must stay";
  }
}

TEST(JawHinge, StaysRigid) {
  const AddedMotion added = JawHinge(sampleControl()).motion(hinged(0.2, 0.05, {0, 0, 2}));
  const Eigen::Matrix3d turn = added.turn + Eigen::Matrix3d::Identity();
  EXPECT_LT((turn * turn.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(JawHinge, SlidesForwardReluctantly) {
  const JawHinge jaw(sampleControl());
  const AddedMotion added = jaw.motion(hinged(0, 0, {0, 0, 5}));
  const Eigen::Vector3d chin = sampleControl().rest.row(58).transpose();
  const double forward = (added.turn * chin + added.shift).z();
  EXPECT_GT(forward, 4.0);
  EXPECT_LT(forward, 5.2);
}

}  // namespace
}  // namespace mouthpiece
