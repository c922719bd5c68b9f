// Laws of placing markers, of the warp and of morph targets, on random similarities, maps and meshes.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "retarget/placing/anchors.h"
#include "retarget/rig/face_fit.h"
#include "retarget/warp/rbf_warp.h"

namespace mouthpiece {
namespace {

class Laws : public ::testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};
  double number(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  Eigen::Vector3d vector(double most) { return {number(-most, most), number(-most, most), number(-most, most)}; }
  Eigen::Matrix3d turn() { return Eigen::AngleAxisd(number(-3, 3), vector(1).normalized()).toRotationMatrix(); }
  MarkerPositions cloud(Eigen::Index count) {
    return MarkerPositions::NullaryExpr(count, 3, [&] { return number(-80, 80); });
  }

  /// A symmetric face of twelve markers with their names.
  struct Face {
    std::vector<std::string> names{"LIP_CORNER_R", "LIP_CORNER_L", "LIP_UP_MID",    "LIP_LO_MID",
                                   "NOSE_TIP",     "CHIN_LOW",     "CANTHUS_OUT_R", "CANTHUS_OUT_L",
                                   "TEMPLE_R",     "TEMPLE_L",     "BROW_IN_R",     "BROW_IN_L"};
    MarkerPositions places{12, 3};
    Face() {
      places << -25, -40, 60, 25, -40, 60, 0, -33, 68, 0, -48, 66, 0, 0, 85, 0, -90, 50, -47, 27, 40, 47, 27, 40, -76,
          25, 0, 76, 25, 0, -14, 50, 55, 14, 50, 55;
    }
  };
};
INSTANTIATE_TEST_SUITE_P(Seeds, Laws, ::testing::Range(1U, 16U));

TEST_P(Laws, TheSimilarityOfAnchorsIsFound) {
  const Face face;
  const double scale = std::exp(number(-7, 3));
  const Eigen::Matrix3d turned = turn();
  const Eigen::Vector3d shift = scale * vector(500);
  FaceMesh mesh;
  mesh.vertices.resize(12, 3);
  Anchors anchors;
  for (std::uint32_t i = 0; i < 12; ++i) {
    const Eigen::Vector3d place = scale * (turned * face.places.row(i).transpose()) + shift;
    mesh.vertices.row(i) = place.transpose().cast<float>();
    // Half of them as vertices, half as points.
    if (i % 2 == 0)
      anchors.markers[face.names[i]] = i;
    else
      anchors.markers[face.names[i]] = place;
  }
  const Similarity found = meshFromActor(mesh, anchors, "anchors", face.names, face.places);
  EXPECT_NEAR(found.scale / scale, 1, 1e-3);
  EXPECT_TRUE(found.turn.isApprox(turned, 1e-3)) << found.turn;
  EXPECT_LT((found(Eigen::Vector3d(1, 2, 3)) - (scale * (turned * Eigen::Vector3d(1, 2, 3)) + shift)).norm(),
            0.1 * scale);
  // The upright turn is a rotation that undoes it, up to a tilt.
  const Eigen::Matrix3d upright = uprightFromMesh(found);
  EXPECT_TRUE((upright * upright.transpose()).isIdentity(1e-9));
  EXPECT_NEAR(upright.determinant(), 1, 1e-9);
  EXPECT_LT(std::abs(Eigen::AngleAxisd(Eigen::Matrix3d(upright * turned)).angle()), 36 * 3.14159 / 180);
}

/// Heads are modelled along the axes, each way round.
TEST_P(Laws, QuarterTurnsAreTakenAsTheyAre) {
  Eigen::Matrix3d quarters = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 4; ++i) {
    quarters =
        Eigen::AngleAxisd(asReal(random_() % 4) * 1.5707963267948966, Eigen::Vector3d::Unit(i % 3)).toRotationMatrix() *
        quarters;
  }
  const Eigen::Matrix3d exact = quarters.array().round().matrix();
  const Eigen::Matrix3d nod = Eigen::AngleAxisd(number(-0.4, 0.4), Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Eigen::Matrix3d lean = Eigen::AngleAxisd(number(-0.15, 0.15), vector(1).normalized()).toRotationMatrix();
  Similarity similarity;
  similarity.turn = exact * nod * lean;
  EXPECT_EQ(uprightFromMesh(similarity), exact.transpose()) << "a tilt is the head's own";
}

/// A posed figure looks over its shoulder: teeth are put into its mouth along its own Z, and lips leave them along it.
TEST_P(Laws, HeadsThatLookAsideAreTurnedToTheFront) {
  const double side = random_() % 2 == 0 ? -1 : 1;
  const Eigen::Matrix3d looks = Eigen::AngleAxisd(side * number(0.2, 0.5), Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Matrix3d nod = Eigen::AngleAxisd(number(-0.2, 0.2), Eigen::Vector3d::UnitX()).toRotationMatrix();
  Similarity similarity;
  similarity.turn = looks * nod;
  EXPECT_TRUE(uprightFromMesh(similarity).isApprox(looks.transpose(), 1e-9)) << "but a nod is the head's own";
}

TEST_P(Laws, UnitsComeFromTheHeadsSize) {
  const Face face;
  const double metres = std::array{1.0, 0.1, 0.0254, 0.01, 0.001}[random_() % 5], size = number(0.85, 1.2);
  const MarkerPositions target = (size * 0.001 / metres * face.places).rowwise() + vector(9).transpose();
  EXPECT_EQ(metresPerUnit(face.places, target), metres);
}

class Kernels : public ::testing::TestWithParam<std::tuple<RbfKernel, unsigned>> {
 protected:
  RbfKernel kernel_ = std::get<0>(GetParam());
  std::mt19937 random_{std::get<1>(GetParam())};
  MarkerPositions cloud(Eigen::Index count) {
    std::uniform_real_distribution<double> place(-80, 80);
    return MarkerPositions::NullaryExpr(count, 3, [&] { return place(random_); });
  }
  Eigen::Matrix3d linear() {
    std::uniform_real_distribution<double> entry(-0.4, 0.4);
    return Eigen::Matrix3d::Identity() + Eigen::Matrix3d::NullaryExpr([&] { return entry(random_); });
  }
};
INSTANTIATE_TEST_SUITE_P(All, Kernels,
                         ::testing::Combine(::testing::Values(RbfKernel::kInverseMultiquadric, RbfKernel::kBiharmonic,
                                                              RbfKernel::kTriharmonic),
                                            ::testing::Range(1U, 9U)));

TEST_P(Kernels, WarpsMeetTheirLandmarksAndKeepAffineMaps) {
  const MarkerPositions actor = cloud(20 + signedIndex(random_() % 50)), bent = actor + 0.1 * cloud(actor.rows());
  const RbfWarp warp = RbfWarp::fit(actor, bent, {.kernel = kernel_, .shape_factor = 1});
  EXPECT_LT((warp.targetFromActor(actor) - bent).cwiseAbs().maxCoeff(), 1e-6);
  const Eigen::Matrix3d map = linear();
  const Eigen::RowVector3d shift(1, -20, 300);
  const auto mapped = [&](const MarkerPositions& p) {
    return MarkerPositions((p * map.transpose()).rowwise() + shift);
  };
  const RbfWarp affine = RbfWarp::fit(actor, mapped(actor), {.kernel = kernel_, .shape_factor = 1});
  const MarkerPositions elsewhere = 2 * cloud(40);
  EXPECT_LT((affine.targetFromActor(elsewhere) - mapped(elsewhere)).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_TRUE(affine.jacobian(elsewhere.row(0).transpose()).isApprox(map, 1e-6));
  // A warp followed by an affine map is the warp onto mapped targets.
  const RbfWarp both = RbfWarp::fit(actor, mapped(bent), {.kernel = kernel_, .shape_factor = 1});
  EXPECT_LT((both.targetFromActor(elsewhere) - mapped(warp.targetFromActor(elsewhere))).cwiseAbs().maxCoeff(), 1e-5);
}

TEST_P(Kernels, JacobiansAreDerivatives) {
  const MarkerPositions actor = cloud(30), bent = actor + 0.2 * cloud(30);
  const RbfWarp warp = RbfWarp::fit(actor, bent, {.kernel = kernel_, .shape_factor = 1});
  constexpr double kStep = 1e-4;
  for (int i = 0; i < 5; ++i) {
    const Eigen::RowVector3d at = cloud(1);
    const Eigen::Matrix3d jacobian = warp.jacobian(at.transpose());
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Eigen::RowVector3d step = kStep * Eigen::RowVector3d::Unit(axis);
      const MarkerPositions slope = (warp.targetFromActor(at + step) - warp.targetFromActor(at - step)) / (2 * kStep);
      EXPECT_LT((jacobian.col(axis) - slope.row(0).transpose()).norm(), 1e-5 * (1 + jacobian.norm()));
    }
  }
}

TEST_P(Kernels, RelativeMotionRestsOnTheTarget) {
  const MarkerPositions actor = cloud(25), target = actor + 0.1 * cloud(25);
  const RbfWarp warp = RbfWarp::fit(actor, target, {.kernel = kernel_, .shape_factor = 1, .regularization = 0.1});
  PositionMatrix frames(4, 75);
  for (Eigen::Index f = 0; f < 4; ++f) {
    const MarkerPositions pose = actor + asReal(f) * 0.02 * cloud(25);
    frames.row(f) = Eigen::RowVectorXd::Map(pose.data(), 75);
  }
  const PositionMatrix moved = warp.targetFromActorRelative(frames, actor);
  EXPECT_LT((moved.row(0) - Eigen::RowVectorXd::Map(target.data(), 75)).cwiseAbs().maxCoeff(), 1e-9)
      << "frame 0 is the actor at rest";
  // Frame by frame is the same as all at once, but for the order in which a product is summed.
  for (Eigen::Index f = 0; f < 4; ++f) {
    const PositionMatrix alone = warp.targetFromActorRelative(frames.row(f), actor);
    EXPECT_LT((alone.row(0) - moved.row(f)).cwiseAbs().maxCoeff(), 1e-9);
  }
}

/// Markers on a mesh that moves by an affine map, as a morph target: they move by the same.
TEST_P(Laws, MarkersMoveAsTheSkinUnderThem) {
  FaceMesh mesh;
  constexpr std::uint32_t kSide = 6;
  mesh.vertices.resize(kSide * kSide, 3);
  for (std::uint32_t i = 0; i < kSide * kSide; ++i)
    mesh.vertices.row(i) << asFloat(i % kSide), asFloat(i / kSide), asFloat(number(-0.2, 0.2));
  for (std::uint32_t r = 0; r + 1 < kSide; ++r) {
    for (std::uint32_t c = 0; c + 1 < kSide; ++c) {
      const std::uint32_t a = r * kSide + c;
      mesh.triangles.push_back({a, a + 1, a + kSide + 1});
      mesh.triangles.push_back({a, a + kSide + 1, a + kSide});
    }
  }
  mesh.parts = {{.name = "skin", .triangle_count = mesh.triangles.size()}};
  mesh.metres_per_unit = 0.01;
  const Eigen::Matrix3d map = Eigen::Matrix3d::NullaryExpr([&] { return number(-0.5, 0.5); });
  const Eigen::RowVector3d shift = vector(2).transpose();
  const FaceShapes shapes{{"affine"},
                          {((mesh.vertices.cast<double>() * map.transpose()).rowwise() + shift).cast<float>()}};
  MarkerPositions places(8, 3);
  for (Eigen::Index m = 0; m < 8; ++m) places.row(m) << number(0.5, 4.5), number(0.5, 4.5), number(-1, 1);
  const MarkerShapes markers = markerShapes(mesh, shapes, places, "sheet");
  const MarkerPositions expected = (markers.neutral_mm * map.transpose()).rowwise() + 10 * shift;
  EXPECT_LT((markers.moves_mm[0] - expected).cwiseAbs().maxCoeff(), 1e-4);
  // Driven by a weight, linearly; an unseen frame stays unseen.
  Eigen::MatrixXd weights(3, 1);
  weights << 0, 0.5, std::nan("");
  const PositionMatrix driven = drivenMarkers(markers, weights);
  EXPECT_EQ(driven.row(0), Eigen::RowVectorXd::Map(markers.neutral_mm.data(), 24));
  EXPECT_LT((driven.row(1) - driven.row(0) - 0.5 * Eigen::RowVectorXd::Map(markers.moves_mm[0].data(), 24))
                .cwiseAbs()
                .maxCoeff(),
            1e-9);
  EXPECT_TRUE(driven.row(2).array().isNaN().all());
}

/// Any bytes are anchors or refused, with the file's name first.
TEST_P(Laws, HostileAnchorsAreRefused) {
  const std::string sound =
      R"({"markers": {"LIP_UP_MID": 3, "NOSE_TIP": [1.5, -2, 3e1]}, "metres_per_unit": 0.001, "parts": {"skin": "skin"}})";
  constexpr std::string_view kTelling = "{}[]\":,0123456789.-eEnulltrue \\";
  EXPECT_EQ(parseAnchors(sound, "a.json").markers.size(), 2U);
  for (int i = 0; i < 200; ++i) {
    std::string damaged = sound;
    for (std::size_t k = 1 + random_() % 4; k > 0; --k) {
      const std::size_t at = random_() % damaged.size();
      if (random_() % 3 == 0)
        damaged.erase(at, 1 + random_() % 5);
      else
        damaged[at] = kTelling[random_() % kTelling.size()];
      if (damaged.empty()) damaged = " ";
    }
    SCOPED_TRACE(damaged);
    try {
      for (const auto& [name, place] : parseAnchors(damaged, "a.json").markers) {
        if (const auto* point = std::get_if<Eigen::Vector3d>(&place)) {
          EXPECT_LE(point->cwiseAbs().maxCoeff(), 1e7);
        }
      }
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind("a.json", 0), 0U) << error.what();
    }
  }
}

}  // namespace
}  // namespace mouthpiece
