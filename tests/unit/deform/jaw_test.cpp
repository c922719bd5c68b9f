#include "deform/mouth/jaw.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "deform/surface/virtual_points.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::sampleControl;

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

class JawLaws : public ::testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};
  double number(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  /// A jaw somewhere, its markers off by some millimetres.
  MarkerPositions pose() {
    MarkerPositions points =
        hinged(number(-0.05, 0.3), number(-0.1, 0.1), {number(-1, 1), number(-1, 1), number(-2, 4)});
    for (double& axis : points.reshaped()) axis += number(-1, 1);
    return points;
  }
};
INSTANTIATE_TEST_SUITE_P(Seeds, JawLaws, ::testing::Range(1U, 11U));

/// Its least squares do not depend on where the head is, or on its unit.
TEST_P(JawLaws, GoesWithPlaceAndUnit) {
  const MarkerPositions points = pose();
  const AddedMotion here = JawHinge(sampleControl()).motion(points);
  const double scale = std::exp(number(-4, 4));
  const Eigen::RowVector3d shift(number(-300, 300), number(-300, 300), number(-300, 300));
  ControlMesh elsewhere = sampleControl();
  elsewhere.rest = (scale * elsewhere.rest).rowwise() + shift;
  elsewhere.mouth_width *= scale;
  const AddedMotion there = JawHinge(elsewhere).motion((scale * points).rowwise() + shift);
  EXPECT_LT((here.turn - there.turn).cwiseAbs().maxCoeff(), 1e-9);
  const Eigen::Vector3d p(10, -60, 40), q = scale * p + shift.transpose();
  EXPECT_LT((scale * (here.turn * p + here.shift) - there.turn * q - there.shift).norm(), 1e-7 * scale);
}

TEST_P(JawLaws, IsTheSameInAMirror) {
  const MarkerPositions points = pose();
  MarkerPositions mirrored = points;
  for (std::size_t i = 0; i < sampleControl().points.size(); ++i) {
    std::string name = sampleControl().points[i].name;
    if (name.ends_with("_R") || name.ends_with("_L")) name.back() = name.back() == 'R' ? 'L' : 'R';
    if (const int other = findPoint(sampleControl(), name); other >= 0)
      mirrored.row(signedIndex(i)) = points.row(other);
  }
  mirrored.col(0) *= -1;
  const AddedMotion there = JawHinge(sampleControl()).motion(points), here = JawHinge(sampleControl()).motion(mirrored);
  const Eigen::DiagonalMatrix<double, 3> mirror(-1, 1, 1);
  EXPECT_LT((here.turn - mirror * there.turn * mirror).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((here.shift - mirror * there.shift).norm(), 1e-4);
}

/// What lips and cheeks do is no movement of bone.
TEST_P(JawLaws, ListensToChinAndJawAlone) {
  MarkerPositions points = pose();
  const AddedMotion before = JawHinge(sampleControl()).motion(points);
  for (std::size_t i = 0; i < sampleControl().points.size(); ++i) {
    const std::string& name = sampleControl().points[i].name;
    if (name.starts_with("CHIN") || name.starts_with("JAW_FRONT") || name.starts_with("JAW_MID")) continue;
    points.row(signedIndex(i)) += Eigen::RowVector3d(number(-9, 9), number(-9, 9), number(-9, 9));
  }
  const AddedMotion after = JawHinge(sampleControl()).motion(points);
  EXPECT_EQ(before.turn, after.turn);
  EXPECT_EQ(before.shift, after.shift);
}

/// The rigid movement that it finds fits its markers better than any a little beside it, but for what it is reluctant
/// to.
TEST_P(JawLaws, OpensAsFarAsFitsItsMarkersBest) {
  constexpr std::pair<const char*, double> kGuides[] = {{"CHIN_UP", 0.25},    {"CHIN_MID", 1},      {"CHIN_LOW", 1},
                                                        {"JAW_FRONT_R", 0.5}, {"JAW_FRONT_L", 0.5}, {"JAW_MID_R", 0.15},
                                                        {"JAW_MID_L", 0.15}};
  const MarkerPositions points = pose();
  const JawHinge jaw(sampleControl());
  const AddedMotion found = jaw.motion(points);
  const auto miss = [&](double more) {
    // The hinge's own axis, as it has turned sideways.
    const Eigen::Matrix3d turn = found.turn + Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d further = turn * Eigen::AngleAxisd(more, Eigen::Vector3d::UnitX()).toRotationMatrix();
    const Eigen::Vector3d slide = found.shift + found.turn * jaw.pivot();
    double sum = 0;
    for (const auto& [name, weight] : kGuides) {
      const int point = findPoint(sampleControl(), name);
      const Eigen::Vector3d arm = sampleControl().rest.row(point).transpose() - jaw.pivot();
      sum += weight * (jaw.pivot() + further * arm + slide - points.row(point).transpose()).squaredNorm();
    }
    return sum;
  };
  EXPECT_LT(miss(0), miss(0.002));
  EXPECT_LT(miss(0), miss(-0.002));
}

/// So it turns to the side and slides no further than its markers ask for: a twentieth of their weight speaks for the
/// middle.
TEST_P(JawLaws, TurnsAndSlidesAsItsMarkersAndItsReluctanceSay) {
  const MarkerPositions points = pose();
  const JawHinge jaw(sampleControl());
  const AddedMotion found = jaw.motion(points);
  const Eigen::Matrix3d turn = found.turn + Eigen::Matrix3d::Identity();
  const Eigen::Vector3d slide = found.shift + found.turn * jaw.pivot();
  EXPECT_NEAR(slide.x(), 0, 1e-9);
  EXPECT_NEAR(slide.y(), 0, 1e-9) << "forwards and back alone";
  std::vector<std::tuple<Eigen::Vector3d, Eigen::Vector3d, double>> guides;  // at rest, now, weight
  Eigen::Vector3d chin = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const auto& [name, weight] : {std::pair("CHIN_UP", 0.25),
                                     {"CHIN_MID", 1},
                                     {"CHIN_LOW", 1},
                                     {"JAW_FRONT_R", 0.5},
                                     {"JAW_FRONT_L", 0.5},
                                     {"JAW_MID_R", 0.15},
                                     {"JAW_MID_L", 0.15}}) {
    const int point = findPoint(sampleControl(), name);
    const Eigen::Vector3d rest = sampleControl().rest.row(point).transpose();
    guides.emplace_back(rest, points.row(point).transpose(), weight);
    chin += weight * rest;
    weights += weight;
  }
  const double lever = (chin / weights - jaw.pivot()).norm();
  const double sideways = std::atan2(-turn(2, 0), turn(0, 0));
  const auto miss = [&](double more_sideways, double more_forward) {
    const Eigen::Matrix3d further =
        Eigen::AngleAxisd(more_sideways, Eigen::Vector3d::UnitY()).toRotationMatrix() * turn;
    const Eigen::Vector3d forward(0, 0, slide.z() + more_forward * lever);
    double sum = 0.05 * weights * (std::pow(sideways + more_sideways, 2) + std::pow(forward.z() / lever, 2));
    for (const auto& [rest, now, weight] : guides)
      sum += weight * (jaw.pivot() + further * (rest - jaw.pivot()) + forward - now).squaredNorm() / (lever * lever);
    return sum;
  };
  for (const double step : {-0.002, 0.002}) {
    EXPECT_LT(miss(0, 0), miss(step, 0)) << step;
    EXPECT_LT(miss(0, 0), miss(0, step)) << step;
  }
}

TEST(JawHinge, WithoutItsMarkersNeverMoves) {
  ControlMesh bare = sampleControl();
  for (ControlPoint& point : bare.points) {
    if (point.name.starts_with("CHIN") || point.name.starts_with("JAW")) point.name = "x" + point.name;
  }
  const AddedMotion added = JawHinge(bare).motion(hinged(0.2, 0, {0, 0, 3}));
  EXPECT_EQ(added.turn.norm(), 0);
  EXPECT_EQ(added.shift.norm(), 0);
}

TEST(JawHinge, LiesBetweenTemplesAndTheJawsAngles) {
  Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
  for (const char* name : {"TEMPLE_R", "TEMPLE_L", "JAW_BACK_R", "JAW_BACK_L"})
    middle += sampleControl().rest.row(findPoint(sampleControl(), name)) / 4;
  EXPECT_LT((JawHinge(sampleControl()).pivot().transpose() - middle).norm(), 1e-9);
}

/// Without temples and the jaw's angles the joint is guessed from the mouth: as wide as it is, so far behind it.
TEST(JawHinge, GuessesItsJointFromTheMouth) {
  ControlMesh bare = sampleControl();
  for (ControlPoint& point : bare.points) {
    if (point.name.starts_with("TEMPLE")) point.name = "x" + point.name;
  }
  const Eigen::Vector3d guessed = JawHinge(bare).pivot(), seen = JawHinge(sampleControl()).pivot();
  const auto at = [](const char* name) -> Eigen::Vector3d {
    return sampleControl().rest.row(findPoint(sampleControl(), name)).transpose();
  };
  const Eigen::Vector3d mouth = 0.5 * (at("LIP_CORNER_R") + at("LIP_CORNER_L"));
  for (const Eigen::Vector3d& pivot : {guessed, seen}) {
    EXPECT_NEAR(pivot.x(), 0, 1);
    EXPECT_GT(pivot.y(), mouth.y() + 0.4 * sampleControl().mouth_width) << "above the mouth";
    EXPECT_LT(pivot.z(), mouth.z() - 0.7 * sampleControl().mouth_width) << "far behind it";
  }
  EXPECT_LT((guessed - seen).norm(), sampleControl().mouth_width);
}

}  // namespace
}  // namespace mouthpiece
