// Lips whose vertices do not lie opposite each other.
#include "deform/mouth/lip_levelling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/index.h"
#include "deform/surface/virtual_points.h"
#include "deform/topology/head_topology.h"
#include "sample_face.h"
#include "tests/unit/deform/kept_numbers.h"

namespace mouthpiece {
namespace {

using samples::sampleControl;

/// The sample face with a vertex for 7 mm, every other one of the upper lip's rim too high, so that slits stay open.
class JaggedLips : public ::testing::Test {
 protected:
  JaggedLips() {
    for (const auto& [a, b] : edgesOf(face_.mesh)) ++uses_[{a, b}];
    for (const auto& [edge, uses] : uses_) {
      const bool is_slit = uses == 1 && isInMouth(edge.first) && isInMouth(edge.second);
      if (!is_slit) continue;
      for (const std::uint32_t v : {edge.first, edge.second}) (face_.is_above_slit[v] ? upper_ : lower_).insert(v);
    }
    bool is_high = false;
    std::vector<std::uint32_t> across(upper_.begin(), upper_.end());
    std::sort(across.begin(), across.end(), [&](auto a, auto b) { return x(a) < x(b); });
    for (const std::uint32_t v : across) {
      if (is_high) face_.mesh.vertices(v, 1) += kSlitMm;
      is_high = !is_high;
    }
  }
  static constexpr float kSlitMm = 1.5F;

  static std::vector<std::pair<std::uint32_t, std::uint32_t>> edgesOf(const FaceMesh& mesh) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const Triangle& t : trianglesOf(mesh, {PartKind::kSkin})) {
      for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(std::minmax(t[k], t[(k + 1) % 3]));
    }
    return edges;
  }
  [[nodiscard]] float x(std::uint32_t v) const { return face_.mesh.vertices(v, 0); }
  [[nodiscard]] bool isInMouth(std::uint32_t v) const {
    const auto at = [&](const char* name) { return sampleControl().rest.row(findPoint(sampleControl(), name)); };
    const Eigen::RowVector3d p = face_.mesh.vertices.row(v).cast<double>();
    return p.x() > at("LIP_CORNER_R").x() && p.x() < at("LIP_CORNER_L").x() &&
           std::abs(p.y() - at("LIP_CORNER_R").y()) < 5;
  }
  /// Height of a rim at `at`, between its vertices.
  static double heightAt(const VertexPositions& vertices, const std::set<std::uint32_t>& rim, float at) {
    std::uint32_t before = *rim.begin(), after = before;
    float left = -1e9F, right = 1e9F;
    for (const std::uint32_t v : rim) {
      const float here = vertices(v, 0);
      if (here <= at && here > left) left = here, before = v;
      if (here >= at && here < right) right = here, after = v;
    }
    const float share = right > left ? (at - left) / (right - left) : 0;
    return double{vertices(before, 1) + share * (vertices(after, 1) - vertices(before, 1))};
  }
  [[nodiscard]] double widestSlit(const VertexPositions& vertices) const {
    double widest = 0;
    for (float at = -12; at <= 12; at += 0.5F)
      widest = std::max(widest, std::abs(heightAt(vertices, upper_, at) - heightAt(vertices, lower_, at)));
    return widest;
  }

  samples::SampleFace face_ = samples::makeSampleFace(7);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses_;
  std::set<std::uint32_t> upper_, lower_;
};

TEST_F(JaggedLips, AreBroughtToOneLine) {
  ASSERT_GE(upper_.size(), 4U);
  ASSERT_GE(lower_.size(), 4U);
  const double before = widestSlit(face_.mesh.vertices);
  ASSERT_GT(before, 1);
  FaceBinding binding = bindFace(face_.mesh, sampleControl());
  const LipLevelling levelling(face_.mesh, sampleControl(), binding);
  VertexPositions now = face_.mesh.vertices;
  for (int round = 0; round < 4; ++round) {
    levelling.level(std::vector{now}, binding);
    now = face_.mesh.vertices;
    for (std::size_t i = 0; i < binding.levelled.vertices.size(); ++i)
      now(binding.levelled.vertices[i], 1) += binding.levelled.ways[i];
  }
  EXPECT_LT(widestSlit(now), 0.25 * before);
  EXPECT_TRUE(std::is_sorted(binding.levelled.vertices.begin(), binding.levelled.vertices.end()));
  EXPECT_LE((now - face_.mesh.vertices).cwiseAbs().maxCoeff(), 1.5F * kSlitMm) << "no further than the slits are high";
  const Eigen::RowVector3d mouth = sampleControl().rest.row(findPoint(sampleControl(), "LIP_UP_MID"));
  for (const std::uint32_t v : binding.levelled.vertices) {
    EXPECT_LT((face_.mesh.vertices.row(v).cast<double>() - mouth).norm(), sampleControl().mouth_width);
  }
}

TEST_F(JaggedLips, NothingIsDoneWithoutAClosure) {
  FaceBinding binding = bindFace(face_.mesh, sampleControl());
  LipLevelling(face_.mesh, sampleControl(), binding).level({}, binding);
  EXPECT_TRUE(binding.levelled.vertices.empty());
}

/// The plain sample face, whose lips touch.
class LevelLips : public ::testing::Test {
 protected:
  /// One lip, `thick` from the slit on, goes `mm` up.
  [[nodiscard]] VertexPositions lifted(bool upper, float mm, float thick = 14) const {
    VertexPositions moved = face_.mesh.vertices;
    const auto slit = asFloat(sampleControl().rest(lipPairs(sampleControl()).front().upper_rim, 1));
    for (std::uint32_t v = 0; v < face_.skin_vertices; ++v) {
      if (face_.is_above_slit[v] == upper && std::abs(moved(v, 1) - slit) < thick) moved(v, 1) += mm;
    }
    return moved;
  }
  [[nodiscard]] FaceBinding levelled(const std::vector<VertexPositions>& closures, FaceBinding binding) const {
    LipLevelling(face_.mesh, sampleControl(), binding).level(closures, binding);
    return binding;
  }
  /// By vertex, 0 where it stays.
  [[nodiscard]] Eigen::VectorXf ways(const FaceBinding& binding) const {
    Eigen::VectorXf all = Eigen::VectorXf::Zero(face_.mesh.vertices.rows());
    for (std::size_t i = 0; i < binding.levelled.vertices.size(); ++i)
      all[binding.levelled.vertices[i]] = binding.levelled.ways[i];
    return all;
  }

  samples::SampleFace face_ = samples::makeSampleFace(3.1);
  FaceBinding binding_ = bindFace(face_.mesh, sampleControl());
  double width_ = sampleControl().mouth_width;
};

/// Lips a little apart meet half way, a little in each other; the movement ends a sixth of a mouth's width away.
TEST_F(LevelLips, MeetHalfWay) {
  for (const bool upper : {true, false}) {
    const float apart = 1;
    const VertexPositions open = lifted(upper, upper ? apart : -apart);
    const Eigen::VectorXf way = ways(levelled({open}, binding_));
    std::size_t rims = 0;
    for (Eigen::Index v = 0; v + 1 < signedIndex(face_.skin_vertices); ++v) {
      const Eigen::RowVector3f p = face_.mesh.vertices.row(v);
      if (p != face_.mesh.vertices.row(v + 1) || std::abs(p.x()) > 10) continue;
      ++rims;
      EXPECT_NEAR(way[v] - way[v + 1], apart + asFloat(0.002 * width_), 0.12F) << p.x();
      EXPECT_NEAR(way[v], -way[v + 1], 0.1F) << "each by half";
    }
    EXPECT_GE(rims, 5U);
    const std::vector<Eigen::Vector3d> line = openingsOf(sampleControl()).lip_line;
    std::size_t further = 0;
    for (Eigen::Index v = 0; v < way.size(); ++v) {
      const double far = distanceToLine(pointAt(face_.mesh.vertices, v), line) / width_;
      if (far > 0.161) {
        EXPECT_EQ(way[v], 0) << far;
      }
      further += far > 0.1 && way[v] != 0 ? 1U : 0U;
    }
    EXPECT_GT(further, 5U) << "it is spread";
  }
}

TEST_F(LevelLips, MeetWhereTheyAreInEachOtherToo) {
  const Eigen::VectorXf way = ways(levelled({lifted(true, -0.8F)}, binding_));
  for (Eigen::Index v = 0; v + 1 < signedIndex(face_.skin_vertices); ++v) {
    const Eigen::RowVector3f p = face_.mesh.vertices.row(v);
    if (p != face_.mesh.vertices.row(v + 1) || std::abs(p.x()) > 10) continue;
    EXPECT_NEAR(way[v + 1] - way[v], 0.8F - asFloat(0.002 * width_), 0.12F) << "out of each other again";
  }
}

/// A closure that is told twice asks for what it asked for once; one after the other adds up; none goes too far.
TEST_F(LevelLips, AddUpWithinBounds) {
  const VertexPositions open = lifted(true, 0.7F);
  const Eigen::VectorXf once = ways(levelled({open}, binding_)), twice = ways(levelled({open, open}, binding_));
  EXPECT_GT(once.cwiseAbs().maxCoeff(), 0.3F);
  EXPECT_LT((once - twice).cwiseAbs().maxCoeff(), 1e-4F);
  const Eigen::VectorXf again = ways(levelled({open}, levelled({open}, binding_)));
  EXPECT_LT((again - 2 * once).cwiseAbs().maxCoeff(), asFloat(2.1e-4 * width_))
      << "but for what is too little to be seen";
  const std::vector<VertexPositions> far{lifted(true, 0.14F * asFloat(width_))};
  const FaceBinding thrice = levelled(far, levelled(far, levelled(far, binding_)));
  EXPECT_NEAR(ways(thrice).cwiseAbs().maxCoeff(), asFloat(0.15 * width_), 1e-4F);
  EXPECT_EQ(ways(levelled({lifted(true, 0.8F * asFloat(width_))}, binding_)).cwiseAbs().maxCoeff(), 0)
      << "that far apart are no lips";
  for (Eigen::Index v = 0; v < once.size(); ++v) {
    if (once[v] != 0) {
      EXPECT_GE(std::abs(once[v]), asFloat(1e-4 * width_) * 0.999F);
    }
  }
  // Two closures that differ ask for something between.
  const Eigen::VectorXf between = ways(levelled({open, lifted(true, 0.1F)}, binding_));
  EXPECT_LT(between.cwiseAbs().maxCoeff(), 0.8F * once.cwiseAbs().maxCoeff());
  EXPECT_GT(between.cwiseAbs().maxCoeff(), 0.3F * once.cwiseAbs().maxCoeff());
}

TEST_F(JaggedLips, AreLevelledAsWasKept) {
  test::KeptNumbers kept("jagged lips");
  FaceBinding binding = bindFace(face_.mesh, sampleControl());
  const LipLevelling levelling(face_.mesh, sampleControl(), binding);
  VertexPositions apart = face_.mesh.vertices;
  for (Eigen::Index v = 0; v < apart.rows(); ++v) {
    if (unsignedIndex(v) < face_.skin_vertices && face_.is_above_slit[unsignedIndex(v)])
      apart(v, 1) += 0.4F + 0.02F * apart(v, 0);
  }
  levelling.level(std::vector{face_.mesh.vertices, apart}, binding);
  ASSERT_FALSE(binding.levelled.vertices.empty());
  kept.add(binding.levelled.vertices).add(binding.levelled.ways);
}

TEST_F(LevelLips, AreLevelledAsWasKept) {
  test::KeptNumbers kept("level lips");
  for (const float mm : {-0.6F, 0.9F, 3.0F}) {
    VertexPositions open = lifted(true, mm);
    for (Eigen::Index v = 0; v < open.rows(); ++v) open(v, 1) += 0.01F * open(v, 0);
    const FaceBinding now = levelled({open, lifted(false, -0.5F * mm)}, binding_);
    kept.add(now.levelled.vertices).add(now.levelled.ways);
  }
}

}  // namespace
}  // namespace mouthpiece
