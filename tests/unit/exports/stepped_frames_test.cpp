#include "exports/shapes/stepped_frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr float kStep = 0.001F;

/// Seven vertices and a rest, so that the last panel is short.
struct Moves {
  RowMajorMatrixF displacements;
  Eigen::RowVectorXf rest;

  explicit Moves(Eigen::Index vertices) {
    std::srand(5);
    displacements = 30 * RowMajorMatrixF::Random(9, 3 * vertices);
    rest = 100 * Eigen::RowVectorXf::Random(3 * vertices);
  }
  [[nodiscard]] FrameMaker frames() const {
    FrameMaker frames{60, displacements.rows(), displacements.cols(), {}, {}};
    frames.make = [this](Eigen::Index f, std::span<float> out) {
      Eigen::Map<Eigen::RowVectorXf>(out.data(), std::ssize(out)) = rest + displacements.row(f);
    };
    return frames;
  }
  [[nodiscard]] std::optional<SteppedFrames> stepped() const {
    std::vector<Eigen::Index> all(unsignedIndex(displacements.rows()));
    std::iota(all.begin(), all.end(), 0);
    return SteppedFrames::of(frames(), all, rest, kStep);
  }
};

TEST(SteppedFrames, AreOffByHalfAStepAtMost) {
  // Besides, what a float of 130 rounds by.
  constexpr float kAllowed = 0.5F * kStep + 2e-5F;
  for (const Eigen::Index vertices : {1, 7, 8, 9, 31}) {
    const Moves moves(vertices);
    const std::optional<SteppedFrames> stepped = moves.stepped();
    ASSERT_TRUE(stepped);
    ASSERT_EQ(stepped->frameCount(), 9);
    std::vector<float> panel(9 * unsignedIndex(kPanelWidth));
    for (Eigen::Index first = 0; first < vertices; first += kPanelVertices) {
      float largest[kPanelVertices];
      stepped->panel(first, panel.data(), largest);
      for (Eigen::Index v = 0; v < std::min(kPanelVertices, vertices - first); ++v) {
        const float farthest = moves.displacements.middleCols<3>(3 * (first + v)).rowwise().norm().maxCoeff();
        EXPECT_NEAR(std::sqrt(largest[v]), farthest, 2 * kAllowed);
      }
      for (Eigen::Index f = 0; f < 9; ++f) {
        for (Eigen::Index i = 0; i < kPanelWidth; ++i) {
          const Eigen::Index column = 3 * first + i;
          const float held = panel[unsignedIndex(f * kPanelWidth + i % 3 * kPanelVertices + i / 3)];
          if (column >= 3 * vertices) {
            EXPECT_EQ(held, 0);
            continue;
          }
          EXPECT_NEAR(held, moves.displacements(f, column), kAllowed) << vertices << " " << f << " " << column;
          EXPECT_EQ(held, stepped->at(f, column));
        }
      }
    }
  }
}

TEST(SteppedFrames, DoNotHoldWhatIsTooFarOrNoNumber) {
  for (const float bad :
       {32.9F, -32.9F, 1e30F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    for (const Eigen::Index column : {0, 20, 26}) {
      Moves moves(9);
      moves.displacements(4, column) = bad;
      EXPECT_FALSE(moves.stepped()) << bad << " " << column;
      moves.displacements(4, column) = std::clamp(bad, -32.5F, 32.5F);
      EXPECT_EQ(moves.stepped().has_value(), bad == bad);
    }
  }
}

/// Both ways of holding a line make shapes within the tolerance, also where a vertex goes too far for steps.
TEST(SteppedFrames, MakeShapesThatHoldTheTolerance) {
  for (const float farthest_mm : {10.0F, 40.0F}) {
    Moves moves(40);
    for (Eigen::Index f = 0; f < moves.displacements.rows(); ++f)
      moves.displacements.row(f) *= farthest_mm / 30 * asFloat(std::sin(0.7 * asReal(f)));
    const FrameMaker frames = moves.frames();
    const VertexPositions rest = Eigen::Map<const VertexPositions>(moves.rest.data(), 40, 3);
    const PrincipalShapes shapes = principalShapes(frames, rest, 1e-3);
    const RowMajorMatrixF made = shapes.weights * shapes.shapes;
    double worst = 0;
    for (Eigen::Index v = 0; v < 40; ++v)
      worst = std::max(worst, double{(made - moves.displacements).middleCols<3>(3 * v).rowwise().norm().maxCoeff()});
    EXPECT_LE(worst, 0.09 + 1e-4) << farthest_mm;
    EXPECT_LE(worst, shapes.max_error_mm + 1e-4) << farthest_mm;
  }
}

}  // namespace
}  // namespace mouthpiece
