// What a place on one lip sees of the other: against the surface itself, in any pose.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "deform/mouth/lip_guard.h"

namespace mouthpiece {
namespace {

constexpr float kReach_mm = 4;
constexpr int kSide = 33;  ///< vertices along a side of the other lip

/// A bent piece of lip, seen from along its z axis, with a watch at its middle; the last two vertices are of the own
/// lip.
class Watches : public ::testing::TestWithParam<unsigned> {
 protected:
  Watches() {
    vertices_.resize(kSide * kSide + 2, 3);
    normals_ = vertices_;
    for (int r = 0; r < kSide; ++r) {
      for (int c = 0; c < kSide; ++c) {
        const float x = placeOf(c), y = placeOf(r);
        vertices_.row(r * kSide + c) << x, y, heightAt(x, y);
        normals_.row(r * kSide + c) = normalAt(x, y).transpose();
        lip_.push_back(static_cast<std::uint32_t>(r * kSide + c));
      }
    }
    own_ = static_cast<std::uint32_t>(kSide * kSide);
    const int middle = kSide / 2 * kSide + kSide / 2;
    watch_.own = {{own_, own_}, 0};
    const std::array corners{middle, middle + 1, middle + kSide};
    std::copy(corners.begin(), corners.end(), watch_.corners);
    watch_.weights[0] = watch_.weights[1] = 0;
    std::sort(lip_.begin(), lip_.end(),
              [this](std::uint32_t a, std::uint32_t b) { return vertices_(a, 0) < vertices_(b, 0); });
    watch_.takeShape(vertices_, normals_, lip_, kReach_mm);
  }
  static float placeOf(int i) { return 1.4F * kReach_mm * (2 * asFloat(i) / (kSide - 1) - 1); }
  float number(float least, float most) { return std::uniform_real_distribution<float>(least, most)(random_); }
  [[nodiscard]] float heightAt(float x, float y) const {
    return bend_[0] * x * x + bend_[1] * x * y + bend_[2] * y * y;
  }
  [[nodiscard]] Eigen::Vector3f normalAt(float x, float y) const {
    return Eigen::Vector3f(-2 * bend_[0] * x - bend_[1] * y, -bend_[1] * x - 2 * bend_[2] * y, 1).normalized();
  }
  /// Over the surface by `distance` along its normal.
  [[nodiscard]] Eigen::Vector3f over(float x, float y, float distance) const {
    return Eigen::Vector3f(x, y, heightAt(x, y)) + distance * normalAt(x, y);
  }
  LipWatch::Sight lookFrom(const Eigen::Vector3f& place) {
    vertices_.row(own_) = place.transpose();
    return watch_.look(vertices_.data(), kReach_mm);
  }

  std::mt19937 random_{GetParam()};
  std::array<float, 3> bend_{number(-0.08F, 0.08F), number(-0.08F, 0.08F), number(-0.08F, 0.08F)};  ///< 1/mm
  VertexPositions vertices_, normals_;
  std::vector<std::uint32_t> lip_;
  std::uint32_t own_ = 0;
  LipWatch watch_{};
};
INSTANTIATE_TEST_SUITE_P(Seeds, Watches, ::testing::Range(1U, 13U));

TEST_P(Watches, SeeHowFarTheOtherLipIs) {
  for (int i = 0; i < 40; ++i) {
    const float x = number(-0.5F, 0.5F) * kReach_mm, y = number(-0.5F, 0.5F) * kReach_mm,
                distance = number(-0.8F, 0.8F);
    const LipWatch::Sight sight = lookFrom(over(x, y, distance));
    const Eigen::Vector3f place = over(x, y, distance);
    if (place.head<2>().squaredNorm() > 0.45F * kReach_mm * kReach_mm) continue;
    EXPECT_NEAR(sight.distance, distance, 0.06F + 0.1F * std::abs(distance)) << x << " " << y;
    EXPECT_NEAR(sight.aside, place.head<2>().squaredNorm() / kReach_mm, 0.15F);
  }
}

/// Wherever the head has gone, and turned by less than makes a triangle tip over.
TEST_P(Watches, SeeTheSameWhereverTheHeadIs) {
  const float before = lookFrom(over(1, -0.5F, 0.3F)).distance;
  const Eigen::Vector3f axis = Eigen::Vector3f(number(-1, 1), number(-1, 1), number(-1, 1)).normalized();
  const Eigen::Matrix3f turn = Eigen::AngleAxisf(number(0, 0.4F), axis).toRotationMatrix();
  vertices_ = ((vertices_ * turn.transpose()).rowwise() + Eigen::RowVector3f(30, -20, 9)).eval();
  EXPECT_NEAR(watch_.look(vertices_.data(), kReach_mm).distance, before, 1e-3F);
}

/// On a lip that is its own mirror image a watch that is another's sees what that sees: neither axis of a triangle is
/// told from the other.
TEST_P(Watches, SeeMirrorImagesAlike) {
  bend_[1] = 0;
  for (const std::uint32_t v : lip_) {
    const float x = vertices_(v, 0), y = vertices_(v, 1);
    vertices_(v, 2) = heightAt(x, y);
    normals_.row(v) = normalAt(x, y).transpose();
  }
  watch_.takeShape(vertices_, normals_, lip_, kReach_mm);
  LipWatch mirrored = watch_;
  const std::uint32_t middle = watch_.corners[0];
  mirrored.corners[1] = middle + kSide;  // along y first, then against x
  mirrored.corners[2] = middle - 1;
  mirrored.takeShape(vertices_, normals_, lip_, kReach_mm);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3f place = over(number(-0.6F, 0.6F) * kReach_mm, number(-0.6F, 0.6F) * kReach_mm, number(-1, 1));
    const float here = lookFrom(place).distance;
    vertices_.row(own_) << -place.x(), place.y(), place.z();
    EXPECT_NEAR(mirrored.look(vertices_.data(), kReach_mm).distance, here, 1e-4F);
  }
}

/// The shape goes along with its triangle: where that is lifted the whole lip is.
TEST_P(Watches, GoAlongWithTheirTriangle) {
  const float before = lookFrom(over(0.5F, 0.4F, 0.2F)).distance;
  const float lifted = number(-0.3F, 0.3F);
  for (const std::uint32_t corner : watch_.corners) vertices_(corner, 2) += lifted;
  EXPECT_NEAR(watch_.look(vertices_.data(), kReach_mm).distance, before - lifted, 0.1F * std::abs(lifted) + 1e-3F);
  // A place between two vertices of the own lip.
  vertices_.row(own_ + 1) = vertices_.row(own_) + Eigen::RowVector3f(0, 0, 0.4F);
  watch_.own = {{own_, own_ + 1}, 0.25F};
  EXPECT_NEAR(watch_.look(vertices_.data(), kReach_mm).distance, before - lifted + 0.1F,
              0.1F * std::abs(lifted) + 0.02F);
}

/// Aside and tipped over they see nothing: no lip is nearer than their reach; on the way there what they see only
/// grows.
TEST_P(Watches, GoBlindSoftlyAsideAndTippedOver) {
  const float angle = number(0, 6.28F);
  const auto besides = [&](float share) {
    const float x = share * kReach_mm * std::cos(angle), y = share * kReach_mm * std::sin(angle);
    return lookFrom({x, y, heightAt(x, y) - 0.5F}).distance;
  };
  EXPECT_LT(besides(0.6F), 0);
  EXPECT_NEAR(besides(1.08F), kReach_mm, 1e-3F);
  EXPECT_GE(besides(1.3F), kReach_mm - 1e-3F);
  float before = besides(0.72F);
  for (float share = 0.74F; share < 1; share += 0.01F) {
    EXPECT_GT(besides(share), before - 0.02F) << share;
    EXPECT_LT(besides(share) - before, 0.5F) << "no jump at " << share;
    before = besides(share);
  }
  // The triangle tips over about an edge, more and more.
  const Eigen::RowVector3f edge = (vertices_.row(watch_.corners[1]) - vertices_.row(watch_.corners[0])).normalized();
  const Eigen::RowVector3f arm = vertices_.row(watch_.corners[2]) - vertices_.row(watch_.corners[0]);
  const auto tipped = [&](float degrees) {
    const Eigen::Matrix3f turn = Eigen::AngleAxisf(degrees / 57.29578F, edge.transpose()).toRotationMatrix();
    vertices_.row(watch_.corners[2]) = vertices_.row(watch_.corners[0]) + arm * turn.transpose();
    return lookFrom({0, 0, -0.5F}).distance;
  };
  EXPECT_LT(tipped(20), 0);
  EXPECT_NEAR(tipped(56), kReach_mm, 1e-3F) << "cosine below 0.6";
  EXPECT_LT(tipped(40), kReach_mm - 0.1F);
  EXPECT_GT(tipped(40), -0.5F);
}

/// What lies as deep behind the lip as it is seen to the sides is elsewhere, and goes out of sight little by little.
TEST_P(Watches, LoseSightOfWhatIsTooDeepLittleByLittle) {
  constexpr float kStep_mm = 0.04F, kTimes = 6;
  const auto under = [&](float deep_mm) { return lookFrom({0.3F, 0.2F, heightAt(0.3F, 0.2F) - deep_mm}).distance; };
  EXPECT_LT(under(0.45F * kReach_mm), -0.3F * kReach_mm);
  EXPECT_NEAR(under(1.1F * kReach_mm), kReach_mm, 1e-3F);
  float before = under(0);
  for (float deep = kStep_mm; deep < 1.6F * kReach_mm; deep += kStep_mm) {
    const float now = under(deep);
    EXPECT_LT(std::abs(now - before), kTimes * kStep_mm) << deep;
    before = now;
  }
}

/// A place far behind a lip that may end before it comes into sight little by little, and so it is pushed.
TEST_P(Watches, SeeWhatIsDeepLittleByLittle) {
  constexpr float kStep_mm = 0.04F, kTimes = 6, kDeep_mm = 0.5F * kReach_mm;
  const float angle = number(0, 6.28F);
  const auto behind = [&](float aside_mm) {
    const float x = aside_mm * std::cos(angle), y = aside_mm * std::sin(angle);
    return std::max(0.0F, -lookFrom({x, y, heightAt(x, y) - kDeep_mm}).distance);
  };
  EXPECT_GT(behind(0.5F), 0.8F * kDeep_mm);
  float before = behind(1.1F * kReach_mm);
  EXPECT_EQ(before, 0);
  for (float aside = 1.1F * kReach_mm; aside > 0; aside -= kStep_mm) {
    EXPECT_LT(behind(aside) - before, kTimes * kStep_mm) << aside;
    before = behind(aside);
  }
}

}  // namespace
}  // namespace mouthpiece
