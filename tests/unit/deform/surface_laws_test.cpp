// Laws of the surface and of what is bound to it, on random triangles, markers and meshes.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/bezier_surface.h"
#include "deform/surface/binding.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::randomPose;
using samples::sampleControl;
using samples::sampleFace;

class Laws : public ::testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};
  double number(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  Eigen::Vector2d place() { return {number(-10, 10), number(-10, 10)}; }

  /// Three places that turn left and span something.
  std::array<Eigen::Vector2d, 3> triangle() {
    while (true) {
      std::array<Eigen::Vector2d, 3> t{place(), place(), place()};
      const Eigen::Vector2d ab = t[1] - t[0], ac = t[2] - t[0];
      const double turn = ab.x() * ac.y() - ab.y() * ac.x();
      if (turn < 0) std::swap(t[1], t[2]);
      if (std::abs(turn) > 5) return t;
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Seeds, Laws, ::testing::Range(1U, 11U));

using Net = CubicPatch<double>;

double valueIn(const Net& net, double u, double v) {
  const auto h = net.halves(u, v);
  return u * h.a + v * h.b + (1 - u - v) * h.c;
}

/// Value and gradient in the plane of a split triangle's patch k.
Eigen::Vector3d valueAndGradient(const std::array<Net, 3>& nets, const std::array<Eigen::Vector2d, 3>& corners,
                                 std::size_t k, double u, double v) {
  const Eigen::Vector2d middle = (corners[0] + corners[1] + corners[2]) / 3;
  const auto h = nets[k].halves(u, v);
  Eigen::Matrix2d plane;
  plane << corners[k] - middle, corners[(k + 1) % 3] - middle;
  const Eigen::Vector2d slope = plane.transpose().inverse() * Eigen::Vector2d(3 * (h.a - h.c), 3 * (h.b - h.c));
  return {valueIn(nets[k], u, v), slope.x(), slope.y()};
}

TEST_P(Laws, SplitTrianglesReproduceParabolasAndStraightLines) {
  const auto corners = triangle();
  const Eigen::VectorXd c = Eigen::VectorXd::NullaryExpr(6, [&] { return number(-1, 1); });
  const auto f = [&](const Eigen::Vector2d& p) {
    return c[0] + c[1] * p.x() + c[2] * p.y() + c[3] * p.x() * p.x() + c[4] * p.x() * p.y() + c[5] * p.y() * p.y();
  };
  const auto slope = [&](const Eigen::Vector2d& p) {
    return Eigen::Vector2d(c[1] + 2 * c[3] * p.x() + c[4] * p.y(), c[2] + c[4] * p.x() + 2 * c[5] * p.y());
  };
  std::array<double, 3> value{}, gx{}, gy{};
  for (std::size_t i = 0; i < 3; ++i) {
    value[i] = f(corners[i]);
    gx[i] = slope(corners[i]).x();
    gy[i] = slope(corners[i]).y();
  }
  std::array<Net, 3> nets;
  CloughTocher<double>(corners).nets(value, gx, gy, nets);
  const Eigen::Vector2d middle = (corners[0] + corners[1] + corners[2]) / 3;
  for (int i = 0; i < 30; ++i) {
    const std::size_t k = random_() % 3;
    const double u = number(0, 1), v = number(0, 1 - u);
    const Eigen::Vector2d p = u * corners[k] + v * corners[(k + 1) % 3] + (1 - u - v) * middle;
    const Eigen::Vector3d found = valueAndGradient(nets, corners, k, u, v);
    EXPECT_NEAR(found[0], f(p), 1e-9);
    EXPECT_LT((found.tail<2>() - slope(p)).norm(), 1e-9);
  }
}

/// Two triangles with a common edge, any values and slopes: one value and one gradient all along it.
TEST_P(Laws, NeighboursShareValueAndGradientAlongTheirEdge) {
  const auto left = triangle();
  std::array<Eigen::Vector2d, 3> right{left[1], left[0], {}};
  const Eigen::Vector2d along = left[1] - left[0];
  right[2] = left[0] + number(0.1, 0.9) * along + number(0.5, 2) * Eigen::Vector2d(along.y(), -along.x());
  std::array<double, 4> value{}, gx{}, gy{};
  for (std::size_t i = 0; i < 4; ++i) {
    value[i] = number(-5, 5);
    gx[i] = number(-2, 2);
    gy[i] = number(-2, 2);
  }
  std::array<Net, 3> on_left, on_right;
  CloughTocher<double>(left).nets<double>({value[0], value[1], value[2]}, {gx[0], gx[1], gx[2]}, {gy[0], gy[1], gy[2]},
                                          on_left);
  CloughTocher<double>(right).nets<double>({value[1], value[0], value[3]}, {gx[1], gx[0], gx[3]}, {gy[1], gy[0], gy[3]},
                                           on_right);
  for (const double way : {0.0, 0.11, 0.5, 0.83, 1.0}) {
    const Eigen::Vector3d a = valueAndGradient(on_left, left, 0, 1 - way, way);
    const Eigen::Vector3d b = valueAndGradient(on_right, right, 0, way, 1 - way);
    EXPECT_LT((a - b).norm(), 1e-9) << way;
  }
  // So do the three patches of one triangle along their inner edges.
  for (std::size_t k = 0; k < 3; ++k) {
    const double way = number(0, 1);
    EXPECT_LT(
        (valueAndGradient(on_left, left, k, 0, way) - valueAndGradient(on_left, left, (k + 1) % 3, way, 0)).norm(),
        1e-9);
  }
}

TEST_P(Laws, SlopesAnswerLinearly) {
  const BezierSurface surface(sampleControl());
  const Eigen::Index count = sampleControl().rest.rows();
  const Eigen::MatrixXd one = Eigen::MatrixXd::Random(count, 3), other = Eigen::MatrixXd::Random(count, 3);
  const double a = number(-3, 3), b = number(-3, 3);
  const Eigen::MatrixXd together = surface.slopesFrom(a * one + b * other);
  EXPECT_LT((together - a * surface.slopesFrom(one) - b * surface.slopesFrom(other)).cwiseAbs().maxCoeff(), 1e-9);
}

/// Where markers go by a field that is linear in the plane the surface has much of its slope there; the ring's is none.
TEST_P(Laws, SlopesOfALinearFieldAreItsOwn) {
  const BezierSurface surface(sampleControl());
  const Eigen::Vector2d slope(number(-2, 2), number(-2, 2));
  const Eigen::MatrixXd slopes = surface.slopesFrom(sampleControl().domain * slope);
  for (std::size_t i = 0; i < sampleControl().points.size(); ++i) {
    const Eigen::Vector2d found = slopes.block<2, 1>(2 * signedIndex(i), 0);
    const ControlPoint& point = sampleControl().points[i];
    if (point.fixed) {
      EXPECT_EQ(found.norm(), 0) << "where motion ends";
    } else if (point.rule == PointRule::kMarker) {
      EXPECT_LT((found - slope).norm(), 0.8 * slope.norm()) << point.name;
    }
  }
}

/// A form of nine numbers says what the surface does at a place.
TEST_P(Laws, FormsGiveTheSurface) {
  const BezierSurface surface(sampleControl());
  const MarkerPositions points = controlPoints(sampleControl(), randomPose(sampleFace(), random_));
  const auto pose = surface.pose(points);
  const MarkerPositions moves = points - sampleControl().rest, slopes = surface.slopesFrom(moves);
  for (int i = 0; i < 20; ++i) {
    const double u = number(0, 1);
    const SurfacePlace at{static_cast<int>(random_() % sampleControl().triangles.size()), u, number(0, 1 - u)};
    const TriangleForm form = formAt(surface, at);
    Eigen::RowVector3d expected = evaluate(surface.restPose(), at).position.transpose();
    for (int k = 0; k < 3; ++k) {
      const int point = sampleControl().triangles[unsignedIndex(at.triangle)][unsignedIndex(k)];
      expected += form[k] * moves.row(point) + form[3 + 2 * k] * slopes.row(2 * point) +
                  form[4 + 2 * k] * slopes.row(2 * point + 1);
    }
    EXPECT_LT((evaluate(pose, at).position.transpose() - expected).norm(), 1e-9);
  }
}

/// Whatever mesh is bound: at rest it is itself, and where all markers go the skin between them goes.
TEST_P(Laws, BoundMeshesRestAndGoAlong) {
  const samples::SampleFace face = samples::makeSampleFace(number(2.5, 6));
  const FaceBinding binding = bindFace(face.mesh, sampleControl());
  const FaceDeformer deformer(face.mesh, sampleControl(), binding);
  VertexPositions out;
  deformer.deform(face.rest, {}, out);
  EXPECT_LT((out - face.mesh.vertices).cwiseAbs().maxCoeff(), 1e-4F);
  const Eigen::RowVector3d shift(number(-3, 3), number(-3, 3), number(-3, 3));
  deformer.deform(MarkerPositions(face.rest.rowwise() + shift), {}, out);
  for (std::uint32_t v = 0; v < face.skin_vertices; ++v) {
    const Eigen::RowVector3f p = face.mesh.vertices.row(v);
    if (std::abs(p.x()) > 25 || p.y() > 45 || p.y() < -55) continue;
    EXPECT_LT((out.row(v) - p - shift.cast<float>()).norm(), 0.05 * shift.norm() + 1e-3) << p;
  }
  const BindingReport report = inspectBinding(binding, face.mesh, sampleControl());
  EXPECT_EQ(report.lip_side_errors, 0U);
  EXPECT_GT(report.coverage, 0.9);
}

/// Neither the unit nor where the head stands changes what a vertex hangs on.
TEST_P(Laws, BindingDoesNotDependOnUnitAndPlace) {
  const double scale = std::exp(number(-6, 6));
  const Eigen::RowVector3d shift = scale * Eigen::RowVector3d(number(-300, 300), number(-300, 300), number(-300, 300));
  samples::SampleFace face = samples::makeSampleFace(6);
  const auto bound = [&] {
    const ControlMesh control = buildControlMesh(face.names, face.rest, face.known, &face.mesh);
    return bindFace(face.mesh, control);
  };
  const FaceBinding here = bound();
  face.rest = (scale * face.rest).rowwise() + shift;
  for (auto& [name, place] : face.known) place = scale * place + shift.transpose();
  face.mesh.vertices = ((scale * face.mesh.vertices.cast<double>()).rowwise() + shift).cast<float>();
  const FaceBinding there = bound();
  // Not the patches' numbers: where four control points lie on a circle, a rounding decides which diagonal is drawn.
  std::size_t same = 0;
  for (std::size_t v = 0; v < here.patch.size(); ++v) {
    const bool alike = std::abs(here.jaw_weight[v] - there.jaw_weight[v]) < 0.05F &&
                       std::abs(scale * double{here.d[v]} - double{there.d[v]}) < 0.1 * scale;
    same += alike ? 1U : 0U;
  }
  EXPECT_GT(asReal(same), 0.95 * asReal(here.patch.size())) << "scale " << scale << " shift " << shift;
}

TEST_P(Laws, PatchPlacesLieInTheirPatch) {
  for (int i = 0; i < 50; ++i) {
    const double u = number(0, 1);
    const SurfacePlace at{static_cast<int>(random_() % 9), u, number(0, 1 - u)};
    const PatchPlace patch = patchPlace(at);
    EXPECT_EQ(patch.patch / 3, unsignedIndex(at.triangle));
    EXPECT_GE(patch.u, 0);
    EXPECT_GE(patch.v, 0);
    EXPECT_LE(patch.u + patch.v, 1 + 1e-12);
    // Back: the centroid's share goes to all three corners.
    std::array<double, 3> weight{};
    weight.fill((1 - patch.u - patch.v) / 3);
    weight[patch.patch % 3] += patch.u;
    weight[(patch.patch + 1) % 3] += patch.v;
    EXPECT_NEAR(weight[0], at.u, 1e-12);
    EXPECT_NEAR(weight[1], at.v, 1e-12);
  }
}

}  // namespace
}  // namespace mouthpiece
