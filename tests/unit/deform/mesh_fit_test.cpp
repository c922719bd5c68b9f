// A control surface that is laid along the skin: on faces with bumps that no marker tells of.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/surface/binding.h"
#include "deform/surface/control_surface.h"
#include "deform/surface/virtual_points.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::sampleFace;

/// The sample face with a round bump on a cheek between its markers.
class BumpyFaces : public ::testing::TestWithParam<unsigned> {
 protected:
  BumpyFaces() {
    for (std::uint32_t v = 0; v < face_.skin_vertices; ++v) {
      const double far = aside(v);
      face_.mesh.vertices(v, 2) += asFloat(high_ * std::exp(-0.5 * far * far / 36));
    }
  }
  [[nodiscard]] double aside(std::uint32_t v) const {
    return (face_.mesh.vertices.row(v).head<2>().transpose().cast<double>() - middle_).norm();
  }
  double number(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  /// How far the surface is from the skin of the bump, in the mean, along the normal.
  [[nodiscard]] double meanOff(const ControlMesh& control) const {
    const FaceBinding binding = bindFace(face_.mesh, control);
    double sum = 0;
    std::size_t count = 0;
    for (std::uint32_t v = 0; v < face_.skin_vertices; ++v) {
      if (aside(v) > 10 || binding.patch[v] < 0) continue;
      sum += std::abs(double{binding.d[v]});
      ++count;
    }
    EXPECT_GT(count, 20U);
    return sum / asReal(count);
  }

  std::mt19937 random_{GetParam()};
  double high_ = number(4, 8);
  Eigen::Vector2d middle_{(random_() % 2 == 0 ? 1 : -1) * number(44, 48), number(-50, -40)};
  samples::SampleFace face_ = samples::makeSampleFace(2.5);
};
INSTANTIATE_TEST_SUITE_P(Seeds, BumpyFaces, ::testing::Range(1U, 5U));

TEST_P(BumpyFaces, AreFollowedByPointsOnTheirSkin) {
  const ControlMesh along = buildControlMesh(face_.names, face_.rest, face_.known, &face_.mesh),
                    without = buildControlMesh(face_.names, face_.rest, face_.known);
  ASSERT_GT(along.points.size(), without.points.size());
  EXPECT_LE(along.points.size(), without.points.size() + 90);
  EXPECT_LT(meanOff(along), 0.5 * meanOff(without));
  EXPECT_LT(meanOff(along), 0.025 * along.mouth_width);
  const TriangleTree skin(face_.mesh.vertices, trianglesOf(face_.mesh, {PartKind::kSkin}));
  std::size_t on_skin = 0;
  for (std::size_t i = 0; i < along.points.size(); ++i) {
    const ControlPoint& point = along.points[i];
    const Eigen::Vector3d place = along.rest.row(signedIndex(i)).transpose();
    if (i < without.points.size()) {
      EXPECT_EQ(point.name, without.points[i].name);
      if (!point.fixed) {
        EXPECT_EQ(place, without.rest.row(signedIndex(i)).transpose()) << "only the ring is put on the skin";
      } else if (place != without.rest.row(signedIndex(i)).transpose()) {
        ++on_skin;
        EXPECT_LT((skin.closest(place)->point - place).norm(), 1e-3) << point.name;
        EXPECT_LT((place - without.rest.row(signedIndex(i)).transpose()).norm(), along.mouth_width) << point.name;
      }
      continue;
    }
    EXPECT_NE(point.name.find("FILL_"), std::string::npos);
    EXPECT_EQ(point.rule, PointRule::kFollow);
    EXPECT_LT((skin.closest(place)->point - place).norm(), 1e-3) << point.name;
    for (std::size_t other = 0; other < i; ++other)
      EXPECT_GT((along.rest.row(signedIndex(other)).transpose() - place).norm(), 0.08 * along.mouth_width)
          << point.name;
    for (const PointDriver& driver : point.drivers) {
      EXPECT_LT(driver.point, signedIndex(without.points.size()));
      EXPECT_FALSE(along.points[unsignedIndex(driver.point)].fixed);
      EXPECT_GT(std::abs(driver.weight), 1e-6);
    }
  }
  EXPECT_GE(on_skin, 6U) << "of the ring, where the head goes on beside and below the markers";
}

/// Added points say where the face is, never how it moves: they go as the surface through the others does.
TEST_P(BumpyFaces, MoveAsTheyDidWithoutTheirPoints) {
  const ControlMesh along = buildControlMesh(face_.names, face_.rest, face_.known, &face_.mesh),
                    without = buildControlMesh(face_.names, face_.rest, face_.known);
  const MarkerPositions pose = samples::randomPose(sampleFace(), random_);
  const MarkerPositions moved = controlPoints(along, FacePose(pose)), coarse = controlPoints(without, FacePose(pose));
  const BezierSurface surface(without);
  const MarkerPositions moves = coarse - without.rest, slopes = surface.slopesFrom(moves);
  for (std::size_t i = without.points.size(); i < along.points.size(); ++i) {
    const Eigen::RowVector2d plane = along.domain.row(signedIndex(i));
    bool is_found = false;
    for (std::size_t t = 0; t < without.triangles.size() && !is_found; ++t) {
      const auto& [a, b, c] = without.triangles[t];
      const Eigen::RowVector2d ac = without.domain.row(a) - without.domain.row(c),
                               bc = without.domain.row(b) - without.domain.row(c), p = plane - without.domain.row(c);
      const double area = ac.x() * bc.y() - ac.y() * bc.x(), u = (p.x() * bc.y() - p.y() * bc.x()) / area,
                   v = (ac.x() * p.y() - ac.y() * p.x()) / area;
      if (u < 0 || v < 0 || u + v > 1) continue;
      is_found = true;
      const TriangleForm form = formAt(surface, {static_cast<int>(t), u, v});
      Eigen::RowVector3d expected = Eigen::RowVector3d::Zero();
      for (const auto& [corner, k] : {std::pair(a, 0), {b, 1}, {c, 2}})
        expected += form[k] * moves.row(corner) + form[3 + 2 * k] * slopes.row(2 * corner) +
                    form[4 + 2 * k] * slopes.row(2 * corner + 1);
      const Eigen::RowVector3d move = moved.row(signedIndex(i)) - along.rest.row(signedIndex(i));
      EXPECT_LT((move - expected).norm(), 1e-3) << along.points[i].name;
    }
    EXPECT_TRUE(is_found) << along.points[i].name;
  }
}

/// Where a slit ends well before the lips do, and the skin between bulges: a point put there belongs to no lip.
TEST(SkinBetweenTheLips, TakesNoPointOfOneLip) {
  for (const double clicked_beside : {8.0, 11.0, 14.0}) {
    samples::SampleFace face = samples::makeSampleFace(2.5);
    const ControlMesh before = buildControlMesh(face.names, face.rest, face.known);
    for (std::size_t i = 0; i < face.names.size(); ++i) {
      if (face.names[i] == "LIP_CORNER_R") face.rest(signedIndex(i), 0) -= clicked_beside;
      if (face.names[i] == "LIP_CORNER_L") face.rest(signedIndex(i), 0) += clicked_beside;
    }
    const auto place = [&](const char* name) -> Eigen::Vector2d {
      return before.rest.row(findPoint(before, name)).head<2>().transpose();
    };
    for (const char* end : {"R", "L"}) {
      const Eigen::Vector2d corner = place((std::string("LIP_CORNER_") + end).c_str());
      const Eigen::Vector2d middle = corner + Eigen::Vector2d((*end == 'R' ? -0.5 : 0.5) * clicked_beside, 0);
      for (std::uint32_t v = 0; v < face.skin_vertices; ++v) {
        const double far = (face.mesh.vertices.row(v).head<2>().transpose().cast<double>() - middle).norm();
        face.mesh.vertices(v, 2) += asFloat(8 * std::exp(-0.5 * far * far / 36));
      }
    }
    const ControlMesh along = buildControlMesh(face.names, face.rest, face.known, &face.mesh);
    EXPECT_GT(along.points.size(), before.points.size());
    for (const char* end : {"R", "L"}) {
      const Eigen::RowVector2d inner = along.domain.row(findPoint(along, std::string("RIM_CORNER_") + end)),
                               way = along.domain.row(findPoint(along, std::string("LIP_CORNER_") + end)) - inner;
      for (std::size_t i = before.points.size(); i < along.points.size(); ++i) {
        const Eigen::RowVector2d to = along.domain.row(signedIndex(i)) - inner;
        const double share = to.dot(way) / way.squaredNorm();
        if (share < 0 || share > 1 || along.points[i].side == LipSide::kNone) continue;
        EXPECT_GT((to - share * way).norm(), 0.01 * along.mouth_width) << along.points[i].name << clicked_beside;
      }
    }
  }
}

}  // namespace
}  // namespace mouthpiece
