#include "deform/mouth/lip_guard.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace mouthpiece {
namespace {

constexpr float kRadius_mm = 30, kHeight_mm = 10, kCell_mm = 0.5F;

/// The front of an upright cylinder about the origin, its lower end at height 0: a row of upper teeth. Each `groove`-th
/// strip of 3 degrees lies 2 mm further in.
struct Arch {
  VertexPositions vertices;
  std::vector<Triangle> triangles;
};
Arch arch(int groove = 0) {
  constexpr int kStrips = 60;
  Arch made;
  made.vertices.resize(4 * kStrips, 3);
  for (int i = 0; i < kStrips; ++i) {
    const float radius = groove > 0 && i % groove == groove / 2 ? kRadius_mm - 2 : kRadius_mm;
    for (int k = 0; k < 4; ++k) {
      const float angle = (static_cast<float>(i + k % 2) / kStrips - 0.5F) * std::numbers::pi_v<float>;
      made.vertices.row(4 * i + k) << radius * std::sin(angle), k < 2 ? 0 : kHeight_mm, radius * std::cos(angle);
    }
    const auto first = static_cast<std::uint32_t>(4 * i);
    made.triangles.push_back({first, first + 1, first + 3});
    made.triangles.push_back({first, first + 3, first + 2});
  }
  return made;
}

Eigen::Vector3f at(float angle, float height, float radius) {
  return {radius * std::sin(angle), height, radius * std::cos(angle)};
}

TEST(TeethShell, SaysHowDeepAPointIsAndTheWayOut) {
  const Arch teeth = arch();
  const TeethShell shell(teeth.vertices, teeth.triangles, true, kCell_mm);
  for (const float angle : {-1.2F, -0.7F, 0.0F, 0.4F, 1.1F}) {
    const TeethShell::Depth inside = shell.depthAt(at(angle, 5, kRadius_mm - 1), 4, false);
    EXPECT_NEAR(inside.depth, 1, 0.1) << angle;
    EXPECT_GT(inside.out.dot(at(angle, 0, 1)), 0.99F) << angle;
    EXPECT_EQ(shell.depthAt(at(angle, 5, kRadius_mm + 0.2F), 4, false).depth, 0) << angle;
    EXPECT_EQ(shell.depthAt(at(angle, -2, kRadius_mm - 1), 4, false).depth, 0) << "below the teeth";
    EXPECT_EQ(shell.depthAt(at(angle, 5, kRadius_mm - 6), 4, false).depth, 0) << "in the mouth";
  }
}

TEST(TeethShell, TheEdgeIsAWayOut) {
  const Arch teeth = arch();
  const TeethShell shell(teeth.vertices, teeth.triangles, true, kCell_mm);
  const TeethShell::Depth around = shell.depthAt(at(0.2F, 0.3F, kRadius_mm - 1.5F), 4, true);
  EXPECT_NEAR(around.depth, 0.3, 0.1);
  EXPECT_LT(around.out.y(), -0.99F);
  EXPECT_NEAR(shell.depthAt(at(0.2F, 0.3F, kRadius_mm - 1.5F), 4, false).depth, 1.5, 0.1);
}

TEST(TeethShell, LipsDoNotDipIntoGrooves) {
  const Arch teeth = arch(6);
  const TeethShell shell(teeth.vertices, teeth.triangles, true, kCell_mm);
  for (float angle = -1; angle < 1; angle += 0.01F)
    EXPECT_GT(shell.depthAt(at(angle, 5, kRadius_mm - 1), 4, false).depth, 0.5F) << angle;
}

/// The quick look may err to one side only.
TEST(TeethShell, MayTouchMissesNothing) {
  const Arch teeth = arch(4);
  TeethShell shell(teeth.vertices, teeth.triangles, true, kCell_mm);
  constexpr float kMargin_mm = 0.5F;
  shell.bound(kMargin_mm);
  std::mt19937 random(6);
  std::uniform_real_distribution<float> angle(-1.5F, 1.5F), height(-3, 13), radius(24, 34), way(-1, 1);
  int inside = 0, quick = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3f p = at(angle(random), height(random), radius(random));
    const Eigen::Vector3f moved =
        p + 0.99F * kMargin_mm * Eigen::Vector3f(way(random), way(random), way(random)).normalized();
    quick += shell.mayTouch(p) ? 0 : 1;
    if (!(shell.depthAt(moved, 4, false).depth > 0)) continue;
    ++inside;
    EXPECT_TRUE(shell.mayTouch(p)) << p.transpose();
  }
  EXPECT_GT(inside, 2000);
  EXPECT_GT(quick, 4000);
}

/// Neither the order in the file nor where the head stands changes what the teeth are.
TEST(TeethShell, IsTheSameInAnyOrderAndPlace) {
  const Arch teeth = arch(5);
  const TeethShell shell(teeth.vertices, teeth.triangles, true, kCell_mm);
  std::mt19937 random(8);
  std::uniform_real_distribution<float> angle(-1.3F, 1.3F), height(-1, 11), radius(26, 31);
  for (int round = 0; round < 4; ++round) {
    Arch other = teeth;
    std::shuffle(other.triangles.begin(), other.triangles.end(), random);
    for (Triangle& t : other.triangles) std::rotate(t.begin(), t.begin() + random() % 3, t.end());
    const Eigen::RowVector3f shift(asFloat(40.0 * round), asFloat(-90.0 * round), asFloat(300.0 * round));
    other.vertices.rowwise() += shift;
    const TeethShell moved(other.vertices, other.triangles, true, kCell_mm);
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3f p = at(angle(random), height(random), radius(random));
      for (const bool around_edge : {false, true}) {
        const TeethShell::Depth here = shell.depthAt(p, 4, around_edge),
                                there = moved.depthAt(p + shift.transpose(), 4, around_edge);
        EXPECT_NEAR(here.depth, there.depth, 0.02F) << p.transpose();
        if (here.depth > 0.1F) {
          EXPECT_GT(here.out.dot(there.out), 0.99F) << p.transpose();
        }
      }
    }
  }
}

/// Of teeth that lean out or in the depth is the shortest way out, not the way along the ground.
TEST(TeethShell, LeaningTeethAreLeftByTheShortestWay) {
  for (const float lean : {-0.5F, -0.3F, 0.3F, 0.5F}) {
    Arch teeth = arch();
    for (Eigen::Index v = 0; v < teeth.vertices.rows(); ++v) {
      const float radius = kRadius_mm + lean * (teeth.vertices(v, 1) - kHeight_mm / 2);
      const Eigen::Vector2f flat(teeth.vertices(v, 0), teeth.vertices(v, 2));
      teeth.vertices(v, 0) = radius * flat.x() / flat.norm();
      teeth.vertices(v, 2) = radius * flat.y() / flat.norm();
    }
    const TeethShell shell(teeth.vertices, teeth.triangles, true, kCell_mm);
    const float upright = std::sqrt(1 + lean * lean);
    for (const float angle : {-0.8F, 0.0F, 0.3F}) {
      const auto behind = [&](float mm) {
        return shell.depthAt(at(angle, kHeight_mm / 2, kRadius_mm - mm), 12, false);
      };
      EXPECT_NEAR(behind(2.5F).depth - behind(1).depth, 1.5F / upright, 0.1F) << lean;
      EXPECT_NEAR(behind(1).out.y(), -lean / upright, 0.1F) << lean;
    }
  }
}

TEST(TeethShell, TellsWhatIsNear) {
  const Arch teeth = arch();
  const TeethShell shell(teeth.vertices, teeth.triangles, true, kCell_mm);
  for (const float angle : {-1.2F, -0.6F, 0.0F, 0.5F, 1.1F}) {
    for (const float height : {0.5F, 5.0F, 9.5F}) {
      EXPECT_TRUE(shell.isNear(at(angle, height, kRadius_mm - 3), 0)) << "behind their fronts";
      for (const float distance : {0.5F, 2.0F, 5.0F}) {
        EXPECT_TRUE(shell.isNear(at(angle, height, kRadius_mm + 0.9F * distance), distance)) << angle;
        EXPECT_FALSE(shell.isNear(at(angle, height, kRadius_mm + 1.1F * distance), distance)) << angle;
      }
    }
    EXPECT_FALSE(shell.isNear(at(angle, -1, kRadius_mm), 5)) << "below them";
    EXPECT_FALSE(shell.isNear(at(angle, kHeight_mm + 1, kRadius_mm), 5)) << "above them";
  }
  EXPECT_FALSE(shell.isNear(at(2.5F, 5, kRadius_mm), 5)) << "behind the mouth";
}

/// The lower row is the upper one upside down, and its edge is above it.
TEST(TeethShell, LowerTeethAreUpperOnesUpsideDown) {
  const Arch teeth = arch(5);
  const TeethShell upper(teeth.vertices, teeth.triangles, true, kCell_mm);
  Arch turned = teeth;
  turned.vertices.col(1) *= -1;
  const TeethShell lower(turned.vertices, turned.triangles, false, kCell_mm);
  std::mt19937 random(12);
  std::uniform_real_distribution<float> angle(-1.3F, 1.3F), height(0.1F, 9.9F), radius(26.5F, 29.5F);
  int around_the_edge = 0;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3f p = at(angle(random), height(random), radius(random)), below(p.x(), -p.y(), p.z());
    for (const bool around_edge : {false, true}) {
      const TeethShell::Depth here = upper.depthAt(p, 4, around_edge), there = lower.depthAt(below, 4, around_edge);
      EXPECT_NEAR(here.depth, there.depth, 0.03F) << p.transpose();
      around_the_edge += around_edge && there.out.y() > 0.99F ? 1 : 0;
      if (here.depth > 0.2F) {
        EXPECT_GT(here.out.dot(Eigen::Vector3f(there.out.x(), -there.out.y(), there.out.z())), 0.98F) << p.transpose();
      }
    }
  }
  EXPECT_GT(around_the_edge, 20);
}

TEST(TeethShell, NoTeethTouchNothing) {
  const TeethShell shell(VertexPositions(0, 3), {}, true, kCell_mm);
  EXPECT_TRUE(shell.empty());
  EXPECT_EQ(shell.depthAt({0, 0, 0}, 4, true).depth, 0);
  EXPECT_FALSE(shell.mayTouch({0, 0, 0}));
  EXPECT_FALSE(shell.isNear({0, 0, 0}, 1));
}

}  // namespace
}  // namespace mouthpiece
