// The deformer's loops, every kind of processor's, against the same in double precision.
#include "deform/kernel/patch_kernel.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "deform/surface/bezier_surface.h"

namespace mouthpiece {
namespace {

using kernel::kBlock;
using kernel::kNetFloats;

/// Shares of the patches' size: products of ten numbers in single precision.
constexpr double kRounding = 2e-5;

/// Random patches with vertices on them, in blocks as the deformer makes them.
struct Scene {
  std::vector<float> nets;
  std::vector<kernel::Run> runs;
  std::vector<kernel::Block> bound;
  std::vector<kernel::LooseBlock> loose;
  std::uint32_t vertices = 0;
};

Scene randomScene(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-0.3F, 0.3F), share(0, 1), offset(-0.5F, 0.5F);
  Scene scene;
  const auto patches = static_cast<std::uint32_t>(1 + random() % 5);
  for (std::uint32_t p = 0; p < patches; ++p) {
    // A flat patch, bent.
    for (int i = 3; i >= 0; --i) {
      for (int j = 3 - i; j >= 0; --j) {
        for (const float at : {asFloat(i), asFloat(j), 0.0F}) scene.nets.push_back(at + place(random));
      }
    }
    const auto count = static_cast<std::uint32_t>(1 + random() % 50);
    scene.runs.push_back({p, static_cast<std::uint32_t>(scene.bound.size()),
                          static_cast<std::uint32_t>((count + kBlock - 1) / kBlock), count});
    for (std::uint32_t begin = 0; begin < count; begin += kBlock) {
      kernel::Block& b = scene.bound.emplace_back();
      kernel::LooseBlock& l = scene.loose.emplace_back();
      for (std::uint32_t lane = 0; lane < kBlock; ++lane) {
        b.u[lane] = l.u[lane] = 0.9F * share(random);
        b.v[lane] = l.v[lane] = (1 - b.u[lane]) * share(random);
        b.d[lane] = l.d[lane] = offset(random);
        l.beside[lane] = offset(random);
        l.across[lane] = offset(random);
        l.weight[lane] = share(random);
        l.jaw[lane] = share(random);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          b.base[axis][lane] = l.base[axis][lane] = offset(random);
          l.rest[axis][lane] = 4 * offset(random);
        }
        b.to[lane] = l.to[lane] = 3 * (scene.vertices + std::min(begin + lane, count - 1));
        if (begin + lane < count) continue;
        // A short last block repeats its last vertex.
        const std::uint32_t last = (count - 1) % kBlock;
        for (float* column : {b.u, b.v, b.d, b.base[0], b.base[1], b.base[2]}) column[lane] = column[last];
        for (float* column : {l.u, l.v, l.d, l.beside, l.across, l.weight, l.jaw, l.base[0], l.base[1], l.base[2],
                              l.rest[0], l.rest[1], l.rest[2]})
          column[lane] = column[last];
      }
    }
    scene.vertices += count;
  }
  return scene;
}

SurfacePoint exactPoint(const Scene& scene, std::uint32_t patch, double u, double v) {
  CubicPatch<Eigen::Vector3d> exact;
  for (std::size_t i = 0; i < 10; ++i)
    exact.net[i] = Eigen::Map<const Eigen::Vector3f>(&scene.nets[kNetFloats * patch + 3 * i]).cast<double>();
  return evaluate(exact, u, v);
}

class Loops : public ::testing::TestWithParam<std::tuple<const kernel::Kernels*, unsigned>> {
 protected:
  static const kernel::Kernels& kernels() { return *std::get<0>(GetParam()); }
  Scene scene_ = randomScene(std::get<1>(GetParam()));
  VertexPositions out_ = VertexPositions::Constant(scene_.vertices + 1, 3, 77);

  kernel::Frame frame() {
    kernel::Frame frame{};
    frame.nets = scene_.nets.data();
    frame.out = out_.data();
    return frame;
  }
};
INSTANTIATE_TEST_SUITE_P(BestFirst, Loops,
                         ::testing::Combine(::testing::ValuesIn(kernel::kernelsHere()), ::testing::Range(1U, 16U)));

TEST_P(Loops, BoundVerticesLieAboveTheirPlaces) {
  kernels().bound(frame(), scene_.runs.data(), scene_.runs.size(), scene_.bound.data());
  for (const kernel::Run& run : scene_.runs) {
    for (std::uint32_t i = 0; i < run.vertices; ++i) {
      const kernel::Block& b = scene_.bound[run.first + i / kBlock];
      const std::uint32_t lane = i % kBlock;
      const SurfacePoint s = exactPoint(scene_, run.patch, double{b.u[lane]}, double{b.v[lane]});
      const Eigen::Vector3d base(double{b.base[0][lane]}, double{b.base[1][lane]}, double{b.base[2][lane]});
      const Eigen::Vector3d expected = s.position + double{b.d[lane]} * s.normal() + base;
      EXPECT_LT((pointAt(out_, b.to[lane] / 3) - expected).norm(), kRounding) << "vertex " << b.to[lane] / 3;
    }
  }
  EXPECT_EQ(out_(scene_.vertices, 0), 77) << "nothing behind the last vertex is written";
}

TEST_P(Loops, LooseVerticesHangOnTheirFrameAndTheJaw) {
  kernel::Frame frame = this->frame();
  const Eigen::Matrix3f turn = 0.1F * Eigen::Matrix3f::Random();
  const Eigen::Vector3f shift = Eigen::Vector3f::Random();
  Eigen::Matrix<float, 3, 3, Eigen::RowMajor>::Map(frame.jaw_turn) = turn;
  Eigen::Vector3f::Map(frame.jaw_shift) = shift;
  kernels().loose(frame, scene_.runs.data(), scene_.runs.size(), scene_.loose.data());
  for (const kernel::Run& run : scene_.runs) {
    for (std::uint32_t i = 0; i < run.vertices; ++i) {
      const kernel::LooseBlock& b = scene_.loose[run.first + i / kBlock];
      const std::uint32_t lane = i % kBlock;
      const SurfacePoint s = exactPoint(scene_, run.patch, double{b.u[lane]}, double{b.v[lane]});
      const auto vector = [&](const float(&columns)[3][kBlock]) {
        return Eigen::Vector3d(double{columns[0][lane]}, double{columns[1][lane]}, double{columns[2][lane]});
      };
      const Eigen::Vector3d n = s.normal(), t = s.du.normalized(), rest = vector(b.rest);
      const Eigen::Vector3d p = s.position + double{b.beside[lane]} * t + double{b.across[lane]} * n.cross(t) +
                                double{b.d[lane]} * n + vector(b.base);
      const Eigen::Vector3d q = rest + double{b.jaw[lane]} * (turn.cast<double>() * rest + shift.cast<double>());
      const Eigen::Vector3d expected = q + double{b.weight[lane]} * (p - q);
      EXPECT_LT((pointAt(out_, b.to[lane] / 3) - expected).norm(), kRounding) << "vertex " << b.to[lane] / 3;
    }
  }
}

TEST_P(Loops, MultiplyIsAMatrixProduct) {
  std::mt19937 random(std::get<1>(GetParam()));
  const auto rows = signedIndex(kBlock * (1 + random() % 9)), points = signedIndex(1 + random() % 80);
  const Eigen::MatrixXf matrix = Eigen::MatrixXf::Random(rows, points);
  const VertexPositions moves = VertexPositions::Random(points, 3);
  Eigen::MatrixX3f slopes(rows, 3);
  kernels().multiply({matrix.data(), moves.data(), slopes.data(), unsignedIndex(rows), unsignedIndex(points)});
  const Eigen::MatrixXd exact = matrix.cast<double>() * moves.cast<double>();
  EXPECT_LT((slopes.cast<double>() - exact).cwiseAbs().maxCoeff(), 1e-6 * asReal(points));
}

/// A patch crushed to a point has no normal; what hangs on it goes there.
TEST_P(Loops, ACrushedPatchGivesNumbers) {
  std::fill(scene_.nets.begin(), scene_.nets.end(), 0.5F);
  kernels().bound(frame(), scene_.runs.data(), scene_.runs.size(), scene_.bound.data());
  EXPECT_TRUE(out_.allFinite());
  kernels().loose(frame(), scene_.runs.data(), scene_.runs.size(), scene_.loose.data());
  EXPECT_TRUE(out_.allFinite());
}

}  // namespace
}  // namespace mouthpiece
