// The files of a 3 s line on a face the size of the default one: principal shapes against principal components of the
// whole (every vertex in the Gram matrix), base64 against a loop over letters, and how long GLB and page take beside
// them.
#include <benchmark/benchmark.h>

#include <Eigen/Eigenvalues>
#include <chrono>
#include <cmath>
#include <random>

#include "base/page_data.h"
#include "deform/mesh/face_mesh.h"
#include "exports/format_bytes.h"
#include "exports/gltf/glb.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kColumns = 160;
constexpr Eigen::Index kRows = 160;  // 25,600 vertices, about 50,000 triangles
constexpr Eigen::Index kFrames = 180;
constexpr Eigen::Index kControls = 66;

FaceMesh sheet() {
  FaceMesh mesh;
  mesh.vertices.resize(kColumns * kRows, 3);
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const auto x = static_cast<float>(v % kColumns) - 80;
    const auto y = static_cast<float>(v / kColumns) - 80;
    mesh.vertices.row(v) << x, y, 60 - 0.005F * (x * x + y * y);
  }
  for (std::uint32_t y = 0; y + 1 < kRows; ++y) {
    for (std::uint32_t x = 0; x + 1 < kColumns; ++x) {
      const std::uint32_t a = y * kColumns + x;
      mesh.triangles.push_back({a, a + 1, a + static_cast<std::uint32_t>(kColumns)});
      mesh.triangles.push_back(
          {a + 1, a + static_cast<std::uint32_t>(kColumns) + 1, a + static_cast<std::uint32_t>(kColumns)});
    }
  }
  mesh.parts.push_back({"skin", PartKind::kSkin, 0, mesh.triangles.size()});
  return mesh;
}

/// Bumps around 66 points that move as speech does (a few hertz, millimetres), plus a hinge that is not linear.
FaceAnimation animationOf(const FaceMesh& mesh) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(-1, 1);
  Eigen::MatrixXf trajectories(kFrames, 3 * kControls);
  for (auto column : trajectories.colwise()) {
    const float phase = 6 * uniform(random);
    const float rate_hz = 2 + 1.5F * uniform(random);
    const float size_mm = 1.5F + uniform(random);
    for (Eigen::Index f = 0; f < kFrames; ++f) {
      column(f) = size_mm * std::sin(6.28F * rate_hz * static_cast<float>(f) / 60 + phase);
    }
  }
  // Markers move together: a dozen ways of moving hold nearly all of it.
  const Eigen::MatrixXf mixing = Eigen::MatrixXf::NullaryExpr(12, 3 * kControls, [&] { return uniform(random); });
  trajectories = trajectories.leftCols(12) * mixing + 0.02F * trajectories;

  Eigen::MatrixXf influence(kControls, mesh.vertices.rows());
  for (Eigen::Index c = 0; c < kControls; ++c) {
    const Eigen::RowVector2f center(75 * uniform(random), 75 * uniform(random));
    influence.row(c) = (-(mesh.vertices.leftCols<2>().rowwise() - center).rowwise().squaredNorm() / 600).array().exp();
  }
  FaceAnimation animation;
  animation.frame_rate_hz = 60;
  animation.positions.resize(kFrames, mesh.vertices.size());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::MatrixXf along_axis = trajectories(Eigen::all, Eigen::seqN(axis, kControls, 3));
    const Eigen::MatrixXf moved = along_axis * influence;
    for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
      animation.positions.col(3 * v + axis) = moved.col(v).array() + mesh.vertices(v, axis);
    }
  }
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    const float angle = 0.1F * std::sin(0.2F * static_cast<float>(f));
    for (Eigen::Index v = 0; v < mesh.vertices.rows() / 3; ++v) {
      const float height = mesh.vertices(v, 1);
      animation.positions(f, 3 * v + 1) += height * (std::cos(angle) - 1);
      animation.positions(f, 3 * v + 2) += height * std::sin(angle);
    }
  }
  return animation;
}

struct Line {
  FaceMesh mesh = sheet();
  FaceAnimation animation = animationOf(mesh);
  PrincipalShapes shapes = principalShapes(animation, mesh.vertices, 0.001);
};

const Line& line() {
  static const Line made;
  return made;
}

double millisecondsOf(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The textbook: Gram matrix of all displacements, eigenvectors, shapes, and the residual to see how good they are.
float componentsOfTheWhole(const FaceAnimation& animation, const FaceMesh& mesh, Eigen::Index count) {
  const Eigen::Map<const Eigen::RowVectorXf> rest(mesh.vertices.data(), mesh.vertices.size());
  const RowMajorMatrixF displacements = animation.positions.rowwise() - rest;
  const Eigen::MatrixXd gram = (displacements * displacements.transpose()).cast<double>();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
  const Eigen::MatrixXf weights = solver.eigenvectors().rightCols(count).cast<float>();
  const RowMajorMatrixF shapes = weights.transpose() * displacements;
  const RowMajorMatrixF residual = displacements - weights * shapes;
  return residual.cwiseAbs().maxCoeff();
}

void principalShapesAgainstComponentsOfTheWhole(benchmark::State& state) {
  const Line& made = line();
  for (auto _ : state) benchmark::DoNotOptimize(principalShapes(made.animation, made.mesh.vertices, 0.001));
  double ours_ms = 1e9;
  double whole_ms = 1e9;
  for (int repeat = 0; repeat < 3; ++repeat) {
    ours_ms = std::min(ours_ms, millisecondsOf([&] {
                         benchmark::DoNotOptimize(principalShapes(made.animation, made.mesh.vertices, 0.001));
                       }));
    whole_ms =
        std::min(whole_ms, millisecondsOf([&] {
                   benchmark::DoNotOptimize(componentsOfTheWhole(made.animation, made.mesh, made.shapes.shapeCount()));
                 }));
  }
  state.counters["shapes"] = static_cast<double>(made.shapes.shapeCount());
  state.counters["max_error_mm"] = made.shapes.max_error_mm;
  state.counters["whole_ms"] = whole_ms;
  state.counters["times_faster"] = whole_ms / ours_ms;
}
BENCHMARK(principalShapesAgainstComponentsOfTheWhole)->Unit(benchmark::kMillisecond);

void glb(benchmark::State& state) {
  std::size_t bytes = 0;
  for (auto _ : state) bytes = glbBytes(line().mesh, line().shapes, "sheet").size();
  state.counters["MB"] = 1e-6 * static_cast<double>(bytes);
}
BENCHMARK(glb)->Unit(benchmark::kMillisecond);

void viewPage(benchmark::State& state) {
  const std::string glb_bytes = glbBytes(line().mesh, line().shapes, "sheet");
  UtteranceAnimation utterance;
  utterance.motion = {60, {}, PositionMatrix(kFrames, 0)};
  utterance.audio = {32000, std::vector<float>(96000, 0.1F)};
  const std::vector<std::string> names(kControls, "MARKER");
  const PositionMatrix markers = PositionMatrix::Zero(kFrames, 3 * kControls);
  const std::string page_template = std::string(700'000, ' ') + std::string(kViewPagePlaceholder);
  for (auto _ : state) {
    benchmark::DoNotOptimize(viewHtml(page_template, {utterance, glb_bytes, line().mesh, "sheet", names, markers}));
  }
}
BENCHMARK(viewPage)->Unit(benchmark::kMillisecond);

std::string base64LetterByLetter(std::string_view bytes) {
  constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  unsigned int bits = 0;
  int count = 0;
  for (const char byte : bytes) {
    bits = bits << 8U | static_cast<unsigned char>(byte);
    for (count += 8; count >= 6; count -= 6) text.push_back(kAlphabet[bits >> static_cast<unsigned>(count - 6) & 63U]);
  }
  if (count > 0) text.push_back(kAlphabet[bits << static_cast<unsigned>(6 - count) & 63U]);
  text.append((4 - text.size() % 4) % 4, '=');
  return text;
}

void base64AgainstLetterByLetter(benchmark::State& state) {
  const std::string bytes(10'000'000, 'x');
  double ours_ms = 1e9;
  double letters_ms = 1e9;
  for (auto _ : state) {
    std::string text;
    appendBase64(text, bytes);
    benchmark::DoNotOptimize(text);
  }
  for (int repeat = 0; repeat < 3; ++repeat) {
    ours_ms = std::min(ours_ms, millisecondsOf([&] {
                         std::string text;
                         appendBase64(text, bytes);
                         benchmark::DoNotOptimize(text);
                       }));
    letters_ms = std::min(letters_ms, millisecondsOf([&] { benchmark::DoNotOptimize(base64LetterByLetter(bytes)); }));
  }
  state.counters["times_faster"] = letters_ms / ours_ms;
}
BENCHMARK(base64AgainstLetterByLetter)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mouthpiece
