#include "exports/shapes/trajectories.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <vector>

namespace mouthpiece {
namespace {

using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr Eigen::Index kFrames = 44;
constexpr Eigen::Index kShapes = 12;

/// Column of a panel that holds one axis of one vertex.
Eigen::Index columnOf(Eigen::Index vertex, Eigen::Index axis) { return axis * kPanelVertices + vertex; }

struct Results {
  Matrix panel = Matrix::Zero(kFrames, kPanelWidth);
  Matrix product = Matrix::Zero(kShapes, kPanelWidth);
  float displacement[kPanelVertices];
  float residual[kPanelVertices];
};

class TrajectoryPanel : public ::testing::Test {
 protected:
  TrajectoryPanel() {
    std::srand(7);
    std::iota(all_columns.begin(), all_columns.end(), 0);
  }

  Results run(const PanelKernels& kernels) const {
    Results results;
    kernels.load_displacements(positions.data() + 24, positions.cols(), kFrames, rest.data(), results.panel.data(),
                               results.displacement);
    kernels.multiply(inverse.data(), kShapes, kFrames, results.panel.data(), results.product.data());
    kernels.largest_residual(weights.data(), kShapes, kFrames, all_columns.data(), kShapes, results.panel.data(),
                             results.product.data(), results.residual);
    return results;
  }

  std::vector<std::int32_t> all_columns = std::vector<std::int32_t>(kShapes);
  Matrix positions = Matrix::Random(kFrames, 72);
  Matrix rest = Matrix::Random(1, 24);
  Matrix inverse = Matrix::Random(kShapes, kFrames);
  Matrix weights = 0.1F * Matrix::Random(kFrames, kShapes);
};

TEST_F(TrajectoryPanel, AgreesWithPlainMatrixArithmetic) {
  const Results results = run(panelKernels());
  for (Eigen::Index v = 0; v < kPanelVertices; ++v) {
    Matrix own(kFrames, 3);
    Matrix shapes(kShapes, 3);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      own.col(axis) = positions.col(24 + 3 * v + axis).array() - rest(3 * v + axis);
      shapes.col(axis) = inverse * own.col(axis);
      EXPECT_TRUE(results.panel.col(columnOf(v, axis)).isApprox(own.col(axis)));
      EXPECT_TRUE(results.product.col(columnOf(v, axis)).isApprox(shapes.col(axis), 1e-4F));
    }
    EXPECT_NEAR(results.displacement[v], own.rowwise().squaredNorm().maxCoeff(), 1e-5F);
    const float expected = (own - weights * shapes).rowwise().squaredNorm().maxCoeff();
    EXPECT_NEAR(results.residual[v], expected, 1e-4F * expected);
  }
}

// The same face whatever the processor: wide and narrow vectors give equal bits.
TEST_F(TrajectoryPanel, EveryVersionGivesTheSameBits) {
  const Results wide = run(panelKernels());
  const Results narrow = run(portablePanelKernels());
  EXPECT_TRUE(wide.panel == narrow.panel);
  EXPECT_TRUE(wide.product == narrow.product);
  for (Eigen::Index v = 0; v < kPanelVertices; ++v) {
    EXPECT_EQ(wide.displacement[v], narrow.displacement[v]);
    EXPECT_EQ(wide.residual[v], narrow.residual[v]);
  }
}

TEST_F(TrajectoryPanel, StepsAreTheSameBitsAndComeBackWithinHalfAStep) {
  constexpr float kHeldStep = 0.001F;
  std::vector<std::int16_t> held[2];
  for (const bool portable : {false, true}) {
    const PanelKernels& kernels = portable ? portablePanelKernels() : panelKernels();
    std::vector<std::int16_t>& steps = held[portable ? 1 : 0];
    steps.resize(kFrames * kPanelWidth);
    float farthest[kPanelWidth] = {}, largest[kPanelVertices], squares[kPanelVertices];
    kernels.store_steps(positions.data() + 24, positions.cols(), kFrames, rest.data(), 1 / kHeldStep, steps.data(),
                        farthest);
    Matrix back(kFrames, kPanelWidth), exact(kFrames, kPanelWidth);
    kernels.load_steps(steps.data(), kFrames, kHeldStep, back.data(), largest);
    kernels.load_displacements(positions.data() + 24, positions.cols(), kFrames, rest.data(), exact.data(), squares);
    EXPECT_LE((back - exact).cwiseAbs().maxCoeff(), 0.5001F * kHeldStep);
    for (Eigen::Index i = 0; i < kPanelWidth; ++i) {
      const Eigen::Index in_panel = i % 3 * kPanelVertices + i / 3;
      EXPECT_NEAR(farthest[i], exact.col(in_panel).cwiseAbs().maxCoeff() / kHeldStep, 0.01F);
    }
    for (Eigen::Index v = 0; v < kPanelVertices; ++v) EXPECT_NEAR(largest[v], squares[v], 0.01F);
  }
  EXPECT_EQ(held[0], held[1]);
}

TEST_F(TrajectoryPanel, ShapesMayBelongToSomeColumnsOfTheWeights) {
  const Results whole = run(panelKernels());
  const std::vector<std::int32_t> columns{1, 4, 11};
  Matrix shapes = Matrix::Zero(kShapes, kPanelWidth), few(columns.size(), kPanelWidth);
  for (std::size_t i = 0; i < columns.size(); ++i)
    shapes.row(columns[i]) = few.row(static_cast<Eigen::Index>(i)) = whole.product.row(columns[i]);
  for (const PanelKernels* kernels : {&panelKernels(), &portablePanelKernels()}) {
    float by_all[kPanelVertices], by_few[kPanelVertices];
    kernels->largest_residual(weights.data(), kShapes, kFrames, all_columns.data(), kShapes, whole.panel.data(),
                              shapes.data(), by_all);
    kernels->largest_residual(weights.data(), kShapes, kFrames, columns.data(), std::ssize(columns), whole.panel.data(),
                              few.data(), by_few);
    EXPECT_EQ(std::memcmp(by_all, by_few, sizeof by_all), 0);
  }
}

// Callers promise the alignment of a float and no more.
TEST_F(TrajectoryPanel, BuffersMayLieAnywhere) {
  const Results expected = run(panelKernels());
  std::vector<float> panel(1 + kFrames * kPanelWidth);
  std::vector<float> product(1 + kShapes * kPanelWidth);
  float squares[1 + kPanelVertices];
  for (const PanelKernels* kernels : {&panelKernels(), &portablePanelKernels()}) {
    kernels->load_displacements(positions.data() + 24, positions.cols(), kFrames, rest.data(), panel.data() + 1,
                                squares + 1);
    EXPECT_EQ(std::memcmp(squares + 1, expected.displacement, sizeof(expected.displacement)), 0);
    kernels->multiply(inverse.data(), kShapes, kFrames, panel.data() + 1, product.data() + 1);
    kernels->largest_residual(weights.data(), kShapes, kFrames, all_columns.data(), kShapes, panel.data() + 1,
                              product.data() + 1, squares + 1);
    EXPECT_EQ(std::memcmp(squares + 1, expected.residual, sizeof(expected.residual)), 0);
  }
}

}  // namespace
}  // namespace mouthpiece
