#include "motion/lip_gauge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr double kRounding = 1e-12;  // mm

const std::vector<std::string> kNames = {"CHIN_LOW", "LIP_LO_MID", "LIP_CORNER_L", "LIP_UP_MID", "LIP_CORNER_R"};

/// Five markers in the order of kNames: y of the lips as given, corners 50 apart, all else at zero.
Eigen::RowVectorXd mouth(double upper_y, double lower_y) {
  Eigen::RowVectorXd pose = Eigen::RowVectorXd::Zero(15);
  pose(3 * 1 + 1) = lower_y;
  pose(3 * 2) = 30;
  pose(3 * 3 + 1) = upper_y;
  pose(3 * 4) = -20;
  return pose;
}

TEST(LipGauge, MeasuresByName) {
  const LipGauge lips(kNames);
  ASSERT_TRUE(lips.hasLips());
  Eigen::RowVectorXd pose = mouth(4, -2);
  EXPECT_NEAR(lips.opening(pose), 6, kRounding);
  EXPECT_NEAR(lips.verticalOpening(pose), 6, kRounding);
  EXPECT_NEAR(lips.width(pose), 50, kRounding);
  EXPECT_NEAR(lips.lowerLipDrop(pose), 2, kRounding);
  pose(3 * 3 + 2) = 8;  // the upper lip goes forward
  EXPECT_NEAR(lips.opening(pose), 10, kRounding);
  EXPECT_NEAR(lips.verticalOpening(pose), 6, kRounding);
  EXPECT_NEAR(lips.protrusion(pose), 4, kRounding);
  pose(1) = -5;
  EXPECT_NEAR(lips.chinDrop(pose), 5, kRounding) << "any chin will do";
}

TEST(LipGauge, TheMiddleOfTheChinIsPreferred) {
  EXPECT_EQ(LipGauge({"CHIN_LOW", "CHIN_MID"}).column(MarkerRole::kChin), 3);
  EXPECT_EQ(LipGauge({"CHIN_LOW", "CHIN_UP"}).column(MarkerRole::kChin), 0);
}

TEST(LipGauge, RolesOfTheLayoutGoBeforeNames) {
  const std::string text = R"({"name":"t","markers":[
      {"name":"LIP_UP_MID","region":"lip","side":"M","mirror":"LIP_UP_MID"},
      {"name":"M17","region":"lip","side":"M","mirror":"M17","role":"upper lip"},
      {"name":"LIP_LO_MID","region":"lip","side":"M","mirror":"LIP_LO_MID"},
      {"name":"M4","region":"lip","side":"M","mirror":"M4","role":"chin"}]})";
  const MarkerLayout once = parseLayout(text, "t.json");
  for (const MarkerLayout& layout : {once, parseLayout(layoutToJson(once), "again.json")}) {
    const LipGauge lips(layout);
    EXPECT_EQ(lips.column(MarkerRole::kUpperLip), 3);
    EXPECT_EQ(lips.column(MarkerRole::kLowerLip), 6);
    EXPECT_EQ(lips.column(MarkerRole::kChin), 9);
    EXPECT_FALSE(lips.has(MarkerRole::kRightLipCorner));
    try {
      LipGauge::whole(layout);
      FAIL();
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("\"right lip corner\" in layout t"), std::string::npos);
    }
  }
  const auto broken = [&](std::string_view from, std::string_view to) {
    std::string changed = text;
    return changed.replace(changed.find(from), from.size(), to);
  };
  EXPECT_THROW(parseLayout(broken("\"chin\"", "\"upper lip\""), "t"), InputError) << "twice";
  EXPECT_THROW(parseLayout(broken("\"chin\"", "\"tongue\""), "t"), InputError);
  EXPECT_THROW(parseLayout(broken("\"chin\"", "7"), "t"), InputError);
}

TEST(LipGauge, TheDefaultLayoutHasEveryRole) {
  const LipGauge by_role = LipGauge::whole(defaultLayout()), by_name(defaultLayout().markerNames());
  for (const MarkerRole role : kMarkerRoles) {
    EXPECT_TRUE(by_role.has(role));
    EXPECT_EQ(by_role.column(role), by_name.column(role));
    EXPECT_EQ(by_role.column(role), 3 * defaultLayout().indexOf(usualName(role)).row());
  }
  for (const MarkerRole role : kMarkerRoles) EXPECT_FALSE(LipGauge().has(role));
}

TEST(LipGauge, MovingTheHeadChangesNoDistance) {
  std::mt19937 random(4);
  std::normal_distribution<double> any(0, 20);
  const LipGauge lips(kNames);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::RowVectorXd pose = Eigen::RowVectorXd::NullaryExpr(15, [&] { return any(random); });
    const Eigen::RowVector3d shift(any(random), any(random), any(random));
    const Eigen::RowVectorXd moved = pose + shift.replicate(1, 5);
    EXPECT_NEAR(lips.opening(moved), lips.opening(pose), 1e-10);
    EXPECT_NEAR(lips.width(moved), lips.width(pose), 1e-10);
    EXPECT_NEAR(lips.verticalOpening(moved), lips.verticalOpening(pose), 1e-10);
    EXPECT_NEAR(lips.protrusion(moved), lips.protrusion(pose) + shift.z(), 1e-10);
    EXPECT_LE(std::abs(lips.verticalOpening(pose)), lips.opening(pose) + kRounding);
    const Eigen::RowVectorXd other = Eigen::RowVectorXd::NullaryExpr(15, [&] { return any(random); });
    EXPECT_NEAR(lips.verticalOpening(pose + other), lips.verticalOpening(pose) + lips.verticalOpening(other), 1e-10)
        << "displacements add up";
  }
}

TEST(LipGauge, EachFrameIsMeasuredByItself) {
  const LipGauge lips(kNames);
  PositionMatrix frames(4, 15);
  for (Eigen::Index frame = 0; frame < 4; ++frame) frames.row(frame) = mouth(static_cast<double>(frame), -1);
  frames(2, 10) = std::nan("");
  const std::vector<double> openings = lips.overFrames(&LipGauge::opening, frames);
  ASSERT_EQ(openings.size(), 4U);
  EXPECT_NEAR(openings[3], 4, kRounding);
  EXPECT_TRUE(std::isnan(openings[2]));
  EXPECT_NEAR(lips.overFrames(&LipGauge::width, frames)[2], 50, kRounding) << "the corners were seen";
  EXPECT_NEAR(lips.verticalOpenings(frames)[3], 4, kRounding);
}

/// Against a search through all frames that lie in the span or 20 ms around it, and the one beyond on either side.
TEST(LipGauge, TheTightestIsTheLeastOpeningAround) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(1, 20);
  const LipGauge lips(kNames);
  MotionClip clip{100, kNames, PositionMatrix(200, 15)};
  for (Eigen::Index frame = 0; frame < 200; ++frame) clip.positions_mm.row(frame) = mouth(any(random), 0);
  for (int hidden = 0; hidden < 60; ++hidden) clip.positions_mm(static_cast<Eigen::Index>(random() % 200), 4) = NAN;
  for (int trial = 0; trial < 200; ++trial) {
    const double start = 0.1 * any(random) - 0.15;
    const TimeSpan span{start, start + 0.01 * any(random)};
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t frame = 0; frame < 200; ++frame) {
      const Seconds time = clip.timeOf(FrameIndex(frame));
      if (time <= span.start - 0.020 - 0.010 || time >= span.end + 0.020 + 0.010) continue;
      const double opening = lips.opening(clip.positions_mm.row(static_cast<Eigen::Index>(frame)));
      if (opening < least) least = opening;
    }
    if (!std::isfinite(least)) continue;
    EXPECT_EQ(lips.tightest(clip, span), least) << span.start << " to " << span.end;
  }
  clip.positions_mm.col(4).setConstant(NAN);
  EXPECT_TRUE(std::isnan(lips.tightest(clip, {0.5, 0.6})));
}

}  // namespace
}  // namespace mouthpiece
