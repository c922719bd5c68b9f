// Where the tongue gets on the default face, against teeth and the roof of the mouth as they are in the same frame.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/topology/head_topology.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

constexpr double kTouches_mm = 1.0;  // the tongue is a morph without contact: a touch is as near as its mesh is fine

constexpr double kMiddle_mm = 7;  // half the width of the tongue's back that is looked at

class TongueReachTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
    if (!file_.marker_names.empty()) return;
    file_ = test::fittedDefaultFace(mesh_);
    kinds_ = vertexKinds(mesh_);
    normals_ = vertexNormals(mesh_.vertices, mesh_.triangles);
  }

  /// A mouth opened by `opening` mm at the chin, with a tongue.
  [[nodiscard]] static VertexPositions posed(double opening, const TonguePose& tongue) {
    const FaceDeformer deformer(mesh_, file_.control, file_.binding);
    MarkerPositions pose = file_.marker_targets;
    for (std::size_t i = 0; i < file_.marker_names.size(); ++i) {
      const std::string& name = file_.marker_names[i];
      if (name.starts_with("LIP_LO") || name.starts_with("CHIN") || name.starts_with("JAW_FRONT"))
        pose(static_cast<Eigen::Index>(i), 1) -= opening;
    }
    VertexPositions out;
    deformer.deform(pose, tongue, out);
    return out;
  }

  /// Between the tongue and all parts of a kind.
  [[nodiscard]] static double distance(const VertexPositions& vertices, PartKind kind) {
    std::vector<Triangle> triangles;
    for (const MeshPart& part : mesh_.parts) {
      if (part.kind != kind) continue;
      const auto first = mesh_.triangles.begin() + static_cast<std::ptrdiff_t>(part.first_triangle);
      triangles.insert(triangles.end(), first, first + static_cast<std::ptrdiff_t>(part.triangle_count));
    }
    const TriangleTree tree(vertices, triangles);
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < kinds_.size(); ++v) {
      if (kinds_[v] != PartKind::kTongue) continue;
      const Eigen::Vector3d p = vertices.row(static_cast<Eigen::Index>(v)).transpose().cast<double>();
      const Eigen::Vector3d foot = tree.closest(p)->point;
      // The tongue lies on the mouth's floor and against its walls: the roof is what is straight above.
      if (kind == PartKind::kMouthInside &&
          (std::abs(p.x()) > kMiddle_mm || !isBack(v) || foot.y() < p.y() + 0.7 * (foot - p).norm()))
        continue;
      nearest = std::min(nearest, (foot - p).norm());
    }
    return nearest;
  }

  /// On top of the tongue's back, between root and blade.
  [[nodiscard]] static bool isBack(std::size_t v) {
    float low = std::numeric_limits<float>::infinity(), high = -low;
    for (std::size_t i = 0; i < kinds_.size(); ++i) {
      if (kinds_[i] != PartKind::kTongue) continue;
      low = std::min(low, mesh_.vertices(static_cast<Eigen::Index>(i), 2));
      high = std::max(high, mesh_.vertices(static_cast<Eigen::Index>(i), 2));
    }
    const float along = (mesh_.vertices(static_cast<Eigen::Index>(v), 2) - low) / (high - low);
    return along > 0.25F && along < 0.65F && normals_(static_cast<Eigen::Index>(v), 1) > 0.7F;
  }

  static inline FaceMesh mesh_;  // fitted once
  static inline FaceFile file_;
  static inline std::vector<PartKind> kinds_;
  static inline VertexPositions normals_;
};

TEST_F(TongueReachTest, TouchesWhereThePhoneSays) {
  for (const double opening : {0.0, 3.0, 6.0}) {
    const double th = distance(posed(opening, {.tip_forward = 1}), PartKind::kUpperTeeth);
    const double lntd = distance(posed(opening, {.tip_up = 1}), PartKind::kUpperTeeth);
    const double kgng = distance(posed(opening, {.back_up = 1}), PartKind::kMouthInside);
    EXPECT_GT(distance(posed(opening, {}), PartKind::kUpperTeeth), 4) << "a resting tongue touches nothing";
    EXPECT_GT(distance(posed(opening, {}), PartKind::kMouthInside), 2 * kTouches_mm);
    EXPECT_LT(th, kTouches_mm) << opening;
    EXPECT_LT(lntd, kTouches_mm) << opening;
    EXPECT_LT(kgng, kTouches_mm) << opening;
  }
}

/// The tip comes out between the teeth as far as they are apart, and not through them, nor the lip.
TEST_F(TongueReachTest, GoesBetweenTheTeethAndNotThroughThem) {
  constexpr float kThrough_mm = 0.5F;
  for (const double opening : {0.0, 1.0, 3.0, 6.0}) {
    const VertexPositions moved = posed(opening, {.tip_forward = 1});
    float upper_front = -1e30F, lower_front = -1e30F, lower_edge = -1e30F;
    for (std::size_t v = 0; v < kinds_.size(); ++v) {
      const auto p = moved.row(static_cast<Eigen::Index>(v));
      if (kinds_[v] == PartKind::kUpperTeeth) upper_front = std::max(upper_front, p[2]);
      if (kinds_[v] == PartKind::kLowerTeeth) lower_front = std::max(lower_front, p[2]);
    }
    for (std::size_t v = 0; v < kinds_.size(); ++v) {
      const auto p = moved.row(static_cast<Eigen::Index>(v));
      if (kinds_[v] == PartKind::kLowerTeeth && p[2] > lower_front - 2) lower_edge = std::max(lower_edge, p[1]);
    }
    for (std::size_t v = 0; v < kinds_.size(); ++v) {
      const auto p = moved.row(static_cast<Eigen::Index>(v));
      if (kinds_[v] != PartKind::kTongue) continue;
      if (opening == 0) {
        EXPECT_LT(p[2], upper_front) << "the teeth are closed";
      }
      if (p[2] > lower_front) {
        EXPECT_GT(p[1], lower_edge - kThrough_mm) << opening;
      }
    }
  }
}

/// Lower teeth and gum move as one rigid piece, by the chin; the upper ones stay.
TEST_F(TongueReachTest, TheLowerTeethMoveRigidly) {
  const VertexPositions moved = posed(8, {});
  std::vector<Eigen::Index> lower;
  for (std::size_t v = 0; v < kinds_.size(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    if (kinds_[v] == PartKind::kLowerTeeth) lower.push_back(row);
    if (kinds_[v] == PartKind::kUpperTeeth) {
      ASSERT_EQ(moved.row(row), mesh_.vertices.row(row));
    }
  }
  ASSERT_GT(lower.size(), 100U);
  double farthest = 0;
  for (std::size_t i = 0; i + 97 < lower.size(); i += 13) {
    const Eigen::Index a = lower[i], b = lower[i + 97];
    const float before = (mesh_.vertices.row(a) - mesh_.vertices.row(b)).norm();
    EXPECT_NEAR((moved.row(a) - moved.row(b)).norm(), before, 1e-3F);
    farthest = std::max(farthest, static_cast<double>((moved.row(a) - mesh_.vertices.row(a)).norm()));
  }
  EXPECT_GT(farthest, 4);
}

}  // namespace
}  // namespace mouthpiece
