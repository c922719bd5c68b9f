// Laws of what moves in a mouth: the tongue between jaw, teeth and palate, and the lower lip that goes under the upper
// teeth; in made-up mouths.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/mouth/jaw.h"
#include "deform/mouth/lip_tuck.h"
#include "deform/surface/virtual_points.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::randomPose;
using samples::sampleControl;
using samples::sampleFace;

constexpr double kFarApart = 1e6;  ///< lips that are in nobody's way

/// Adds a closed box, each side of it a net of cells.
void addBox(FaceMesh& mesh, PartKind kind, const Eigen::AlignedBox3f& box, std::uint32_t cells) {
  mesh.parts.push_back({.name = "box", .kind = kind, .first_triangle = mesh.triangles.size()});
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto first = static_cast<std::uint32_t>(mesh.vertices.rows());
    mesh.vertices.conservativeResize(first + (cells + 1) * (cells + 1), 3);
    for (std::uint32_t i = 0; i <= cells; ++i) {
      for (std::uint32_t j = 0; j <= cells; ++j) {
        Eigen::Vector3f share;
        share[axis] = asFloat(side % 2);
        share[u] = asFloat(i) / asFloat(cells);
        share[v] = asFloat(j) / asFloat(cells);
        mesh.vertices.row(first + i * (cells + 1) + j) = (box.min() + share.cwiseProduct(box.sizes())).transpose();
      }
    }
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return first + i * (cells + 1) + j; };
    for (std::uint32_t i = 0; i < cells; ++i) {
      for (std::uint32_t j = 0; j < cells; ++j) {
        mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
        mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
      }
    }
  }
  mesh.parts.back().triangle_count = mesh.triangles.size() - mesh.parts.back().first_triangle;
}

/// A tongue behind teeth that are shut, under a palate.
class Tongues : public ::testing::TestWithParam<unsigned> {
 protected:
  Tongues() {
    mesh_.vertices.resize(0, 3);
    addBox(mesh_, PartKind::kTongue, {Eigen::Vector3f(-14, -6, 0), Eigen::Vector3f(14, 0, length_)}, 10);
    for (std::uint32_t v = 0; v < mesh_.vertexCount(); ++v) tongue_.push_back(v);
    addBox(mesh_, PartKind::kUpperTeeth,
           {Eigen::Vector3f(-20, edge_, front_ - 4), Eigen::Vector3f(20, edge_ + 9, front_)}, 6);
    addBox(mesh_, PartKind::kLowerTeeth,
           {Eigen::Vector3f(-20, edge_ - 9, front_ - 5), Eigen::Vector3f(20, edge_, front_ - 1)}, 6);
    addBox(mesh_, PartKind::kMouthInside,
           {Eigen::Vector3f(-20, palate_, 0), Eigen::Vector3f(20, palate_ + 1, front_ - 6)}, 4);
  }
  float number(float least, float most) { return std::uniform_real_distribution<float>(least, most)(random_); }

  [[nodiscard]] VertexPositions moved(const AddedMotion& jaw, const TonguePose& pose,
                                      const PartedLips& lips = {}) const {
    VertexPositions out = VertexPositions::Constant(mesh_.vertices.rows(), 3, 1e6F);
    TongueMorph(mesh_, tongue_).deform(jaw, pose, lips, out.data());
    EXPECT_EQ(out.bottomRows(signedIndex(mesh_.vertexCount() - tongue_.size())).minCoeff(), 1e6F)
        << "teeth are not its";
    return out.topRows(signedIndex(tongue_.size()));
  }
  [[nodiscard]] VertexPositions rest() const { return mesh_.vertices.topRows(signedIndex(tongue_.size())); }
  /// The jaw open by so many millimetres, without turning.
  static AddedMotion open(double mm) { return {Eigen::Matrix3d::Zero(), {0, -mm, 0}}; }
  /// Of the tongue's foremost vertices the highest in its middle.
  [[nodiscard]] Eigen::RowVector3f tipOf(const VertexPositions& moved) const {
    Eigen::Index tip = 0;
    for (Eigen::Index v = 0; v < moved.rows(); ++v) {
      const auto key = [&](Eigen::Index i) { return std::array{rest()(i, 2), rest()(i, 1), -std::abs(rest()(i, 0))}; };
      if (key(v) > key(tip)) tip = v;
    }
    return moved.row(tip);
  }

  std::mt19937 random_{GetParam()};
  float length_ = number(36, 55), front_ = length_ + number(3, 7), edge_ = number(0, 3),
        palate_ = edge_ + number(10, 16);
  FaceMesh mesh_;
  std::vector<std::uint32_t> tongue_;
};
INSTANTIATE_TEST_SUITE_P(Seeds, Tongues, ::testing::Range(1U, 13U));

TEST_P(Tongues, LieStillAtRestAndGoAlongWithTheJaw) {
  EXPECT_EQ(moved({}, {}), rest());
  const AddedMotion jaw{Eigen::AngleAxisd(double{number(0, 0.4F)}, Eigen::Vector3d::UnitX()).toRotationMatrix() -
                            Eigen::Matrix3d::Identity(),
                        Eigen::Vector3d(double{number(-3, 3)}, double{number(-9, 0)}, double{number(-3, 3)})};
  const VertexPositions now = moved(jaw, {});
  for (Eigen::Index v = 0; v < now.rows(); ++v) {
    const Eigen::Vector3d p = pointAt(rest(), v);
    EXPECT_LT((pointAt(now, v) - p - jaw.turn * p - jaw.shift).norm(), 1e-4);
  }
}

/// L, N, T: the tip is behind the upper teeth and above their edge, wherever the jaw is.
TEST_P(Tongues, TipsReachBehindTheUpperTeeth) {
  for (const double jaw : {0.0, 3.0, 6.0}) {
    const Eigen::RowVector3f tip = tipOf(moved(open(jaw), {.tip_up = 1}));
    EXPECT_GT(tip.y(), edge_) << jaw;
    EXPECT_LT(tip.y(), edge_ + 9) << "not above the gum";
    EXPECT_LT(tip.z(), front_) << jaw;
    EXPECT_GT(tip.z(), front_ - 0.25F * length_) << "near them";
    EXPECT_NEAR(tip.x(), 0, 1e-4);
  }
}

/// TH: between teeth that are apart the tip comes out, lies above the lower and under the upper ones; through teeth
/// that are shut it does not.
TEST_P(Tongues, TipsComeOutBetweenTheTeethAsFarAsTheyAreApart) {
  EXPECT_LE(moved(open(0), {.tip_forward = 1}).col(2).maxCoeff(), front_ + 1e-3F) << "shut";
  float before = moved(open(0), {.tip_forward = 1}).col(2).maxCoeff();
  for (const double jaw : {1.0, 2.0, 4.0}) {
    const float now = moved(open(jaw), {.tip_forward = 1}).col(2).maxCoeff();
    EXPECT_GE(now, before - 1e-4F) << jaw;
    before = now;
  }
  const double gap = 0.1 * double{length_} + 2;
  const VertexPositions out = moved(open(gap), {.tip_forward = 1});
  EXPECT_GT(out.col(2).maxCoeff(), front_) << "it is seen before the teeth";
  EXPECT_LT(out.col(2).maxCoeff(), front_ + 0.1F * length_) << "but a little";
  for (Eigen::Index v = 0; v < out.rows(); ++v) {
    if (out(v, 2) < front_) continue;
    EXPECT_LE(out(v, 1), edge_ + 1e-3F) << "under the upper teeth";
    EXPECT_GE(out(v, 1), edge_ - static_cast<float>(gap) - 1e-3F) << "above the lower ones";
  }
}

/// TH beside a silence: between teeth that are apart, but lips that are shut or nearly.
TEST_P(Tongues, StayBehindTheTeethWhereTheLipsAreShut) {
  const AddedMotion jaw = open(0.1 * double{length_} + 2);
  const auto reach = [&](double lips_apart) {
    return moved(jaw, {.tip_forward = 1}, {.apart = lips_apart}).col(2).maxCoeff();
  };
  EXPECT_LE(reach(0), front_ + 1e-3F);
  EXPECT_LT(reach(0.02 * double{length_}), reach(0.05 * double{length_}));
  EXPECT_EQ(reach(0.1 * double{length_}), reach(kFarApart)) << "parted lips do not keep it";
  EXPECT_GT(reach(kFarApart), front_);
}

/// TH between lips that hang before the teeth: out under the upper one's rim and over the lower one's.
TEST_P(Tongues, ComeOutBetweenTheLips) {
  const double gap = 0.1 * double{length_} + 4, upper = double{edge_} - 1.5, lower = double{edge_} - gap + 1;
  const VertexPositions out =
      moved(open(gap), {.tip_forward = 1}, {.apart = upper - lower, .upper_y = upper, .lower_y = lower});
  EXPECT_GT(out.col(2).maxCoeff(), front_);
  for (Eigen::Index v = 0; v < out.rows(); ++v) {
    if (out(v, 2) < front_) continue;
    EXPECT_LE(out(v, 1), static_cast<float>(upper) + 1e-3F);
    EXPECT_GE(out(v, 1), static_cast<float>(lower) - 1e-3F);
  }
}

/// K, G: the back rises to the palate, the tip and the root stay.
TEST_P(Tongues, BacksRiseToThePalate) {
  const VertexPositions up = moved({}, {.back_up = 1}) - rest();
  const float to_palate = std::min(palate_, 0.45F * length_);
  EXPECT_NEAR(up.col(1).maxCoeff(), to_palate, 0.12F * to_palate);
  float highest_z = 0, highest = 0;
  for (Eigen::Index v = 0; v < up.rows(); ++v) {
    if (up(v, 1) > highest) highest = up(v, 1), highest_z = rest()(v, 2);
    if (rest()(v, 2) > 0.85F * length_ || rest()(v, 2) < 1e-3F) {
      EXPECT_LT(up.row(v).norm(), 0.03F * to_palate) << rest().row(v);
    }
    EXPECT_GE(up(v, 1), -1e-4F);
  }
  EXPECT_NEAR(highest_z, 0.4F * length_, 0.1F * length_);
}

/// Half a pose is half the way; no way is longer than 0.45 of the tongue; left and right move alike.
TEST_P(Tongues, MoveInProportionWithinBounds) {
  const TonguePose pose{.tip_up = number(0, 1), .tip_forward = 0, .back_up = number(0, 1)};
  const VertexPositions whole = moved({}, pose) - rest(),
                        half = moved({}, {.tip_up = pose.tip_up / 2, .tip_forward = 0, .back_up = pose.back_up / 2}) -
                               rest();
  EXPECT_LT((whole - 2 * half).cwiseAbs().maxCoeff(), 1e-3F);
  const VertexPositions far = moved(open(60), {.tip_up = 1}) - moved(open(60), {});
  EXPECT_NEAR(far.rowwise().norm().maxCoeff(), 0.45F * length_, 1e-3F) << "a tongue does not stretch further";
  for (Eigen::Index v = 0; v < whole.rows(); ++v)
    EXPECT_NEAR(whole(v, 0), 0, 1e-4F) << "in the middle it goes straight";
}

TEST(Tongue, WithoutTeethOrVerticesIsLeftToItsOwn) {
  FaceMesh mesh;
  mesh.vertices.resize(0, 3);
  addBox(mesh, PartKind::kTongue, {Eigen::Vector3f(-14, -6, 0), Eigen::Vector3f(14, 0, 40)}, 8);
  std::vector<std::uint32_t> all(mesh.vertexCount());
  for (std::uint32_t v = 0; v < all.size(); ++v) all[v] = v;
  VertexPositions up = mesh.vertices, out = mesh.vertices;
  TongueMorph(mesh, all).deform({}, {.tip_up = 1}, {}, up.data());
  TongueMorph(mesh, all).deform({}, {.tip_forward = 1}, {}, out.data());
  EXPECT_GT((up - mesh.vertices).col(1).maxCoeff(), 4) << "to where teeth would be";
  EXPECT_GT(out.col(2).maxCoeff(), 41) << "nothing is in its way";
  VertexPositions untouched = mesh.vertices;
  TongueMorph(mesh, {}).deform({}, {.tip_up = 1}, {}, untouched.data());
  EXPECT_EQ(untouched, mesh.vertices);
}

/// A row of upper teeth behind the sample's lips, as deep as it happens.
class Tucks : public ::testing::TestWithParam<unsigned> {
 protected:
  Tucks() {
    mesh_.vertices.resize(0, 3);
    addBox(mesh_, PartKind::kUpperTeeth,
           {Eigen::Vector3f(-22, edge_y_, edge_z_ - 1), Eigen::Vector3f(22, edge_y_ + 9, edge_z_ + 1)}, 40);
    addBox(mesh_, PartKind::kUpperTeeth,
           {Eigen::Vector3f(-22, edge_y_ - 6, edge_z_ - 40), Eigen::Vector3f(22, edge_y_ + 9, edge_z_ - 30)}, 40);
  }
  double number(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  MarkerPositions points() { return controlPoints(sampleControl(), randomPose(sampleFace(), random_)); }
  [[nodiscard]] MarkerPositions tucked(const MarkerPositions& points, double tuck) const {
    MarkerPositions moved = points;
    const std::vector<LipGap> gaps(lipPairs(sampleControl()).size(), {.opened = 0, .least = 0, .tuck = tuck});
    LipTuck(mesh_, sampleControl(), 1).apply(gaps, moved);
    return moved;
  }

  std::mt19937 random_{GetParam()};
  float edge_y_ = static_cast<float>(number(-46, -41)), edge_z_ = static_cast<float>(number(62, 68));
  FaceMesh mesh_;
};
INSTANTIATE_TEST_SUITE_P(Seeds, Tucks, ::testing::Range(1U, 13U));

TEST_P(Tucks, BringTheMiddleOfTheLowerLipUnderTheFrontTeeth) {
  const double mouth = sampleControl().mouth_width;
  const MarkerPositions after = tucked(sampleControl().rest, 1);
  for (const LipPair& pair : lipPairs(sampleControl())) {
    const Eigen::RowVector3d lower = sampleControl().rest.row(pair.lower_rim);
    if (std::abs(lower.x()) > 1) continue;
    EXPECT_NEAR(after(pair.lower_rim, 1), double{edge_y_} - 0.01 * mouth, 1e-4) << "just under the edge";
    EXPECT_NEAR(after(pair.lower_rim, 2), double{edge_z_}, 1e-4) << "in its middle, not at the back teeth";
    EXPECT_GE(after(pair.upper_rim, 1), double{edge_y_} + 0.03 * mouth - 1e-4) << "the teeth are seen";
  }
}

/// Where the rows stand edge to edge the lip's inner side would be in the lower one.
TEST_P(Tucks, StayBeforeLowerTeethThatStandUnderTheUpperOnes) {
  const double mouth = sampleControl().mouth_width;
  const MarkerPositions with_upper_alone = tucked(sampleControl().rest, 1);
  addBox(mesh_, PartKind::kLowerTeeth,
         {Eigen::Vector3f(-22, edge_y_ - 9, edge_z_ - 2), Eigen::Vector3f(22, edge_y_ - 0.3F, edge_z_)}, 40);
  addBox(mesh_, PartKind::kLowerTeeth,  // a gum further down is in nobody's way
         {Eigen::Vector3f(-22, edge_y_ - 20, edge_z_), Eigen::Vector3f(22, edge_y_ - 8, edge_z_ + 6)}, 40);
  const MarkerPositions after = tucked(sampleControl().rest, 1);
  for (const LipPair& pair : lipPairs(sampleControl())) {
    const Eigen::RowVector3d lower = sampleControl().rest.row(pair.lower_rim);
    if (std::abs(lower.x()) > 1) continue;
    EXPECT_NEAR(after(pair.lower_rim, 2), std::min(lower.z(), double{edge_z_} + 0.03 * mouth), 1e-4);
    EXPECT_GT(after(pair.lower_rim, 2), with_upper_alone(pair.lower_rim, 2));
    EXPECT_NEAR(after(pair.lower_rim, 1), with_upper_alone(pair.lower_rim, 1), 1e-9) << "as high as before";
  }
}

/// The edge is the lowest millimetre of the front teeth: how they bulge above it does not matter.
TEST_P(Tucks, GoUnderTheEdgeHoweverTheTeethBulgeAboveIt) {
  addBox(mesh_, PartKind::kUpperTeeth,
         {Eigen::Vector3f(-22, edge_y_ + 1.5F, edge_z_ - 1), Eigen::Vector3f(22, edge_y_ + 9, edge_z_ + 5)}, 40);
  const MarkerPositions after = tucked(sampleControl().rest, 1);
  for (const LipPair& pair : lipPairs(sampleControl())) {
    if (std::abs(sampleControl().rest(pair.lower_rim, 0)) > 1) continue;
    EXPECT_NEAR(after(pair.lower_rim, 2), double{edge_z_}, 1e-4);
    EXPECT_NEAR(after(pair.lower_rim, 1), double{edge_y_} - 0.01 * sampleControl().mouth_width, 1e-4);
  }
}

TEST_P(Tucks, WithoutTeethGoUpBehindARaisedUpperLip) {
  mesh_ = {};
  const double mouth = sampleControl().mouth_width;
  const MarkerPositions after = tucked(sampleControl().rest, 1);
  for (const LipPair& pair : lipPairs(sampleControl())) {
    const Eigen::RowVector3d upper = sampleControl().rest.row(pair.upper_rim);
    if (std::abs(upper.x()) > 1) continue;
    EXPECT_NEAR(after(pair.lower_rim, 1), upper.y() + 0.03 * mouth, 1e-9);
    EXPECT_NEAR(after(pair.lower_rim, 2), upper.z() - 0.12 * mouth, 1e-9);
    EXPECT_NEAR(after(pair.upper_rim, 1), upper.y() + 0.04 * mouth, 1e-9) << "and higher than the lower one";
  }
}

/// Less and less, and not the cheeks: else the chin bulges under a lip that goes in.
TEST_P(Tucks, TakeTheChinAlong) {
  const MarkerPositions at_rest = tucked(sampleControl().rest, 1) - sampleControl().rest;
  const auto way = [&](const char* name) { return at_rest.row(findPoint(sampleControl(), name)).norm(); };
  EXPECT_GT(way("CHIN_UP"), 0.1 * way("LIP_LO_MID"));
  EXPECT_LT(way("CHIN_UP"), way("LIP_LO_MID"));
  EXPECT_LE(way("CHIN_MID"), way("CHIN_UP"));
  for (const char* still : {"CHIN_LOW", "CHEEK_MOUTH_R", "CHEEK_MOUTH_L", "LIP_CORNER_R", "LIP_CORNER_L", "NOSE_BASE"})
    EXPECT_EQ(way(still), 0) << still;
}

TEST_P(Tucks, GoInProportionStraightAndFadeTowardsTheCorners) {
  const MarkerPositions before = points();
  EXPECT_EQ(tucked(before, 0), before);
  const MarkerPositions whole = tucked(before, 1) - before;
  const double share = number(0.1, 0.9);
  EXPECT_LT((tucked(before, share) - before - share * whole).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(whole.col(0).cwiseAbs().maxCoeff(), 0) << "nothing goes sideways";
  const double furthest = 0.2 * sampleControl().mouth_width;
  std::vector<bool> moves(sampleControl().points.size(), false);
  for (const LipPair& pair : lipPairs(sampleControl())) {
    for (const int point : {pair.upper_rim, pair.lower_rim, pair.upper_marker, pair.lower_marker})
      moves[unsignedIndex(point)] = true;
    EXPECT_LE(whole.row(pair.lower_rim).norm(), furthest + 1e-9);
    EXPECT_GE(whole(pair.upper_rim, 1), 0);
    EXPECT_LE(whole(pair.upper_rim, 1), furthest + 1e-9);
    EXPECT_LT((whole.row(pair.lower_marker) - 0.3 * whole.row(pair.lower_rim)).norm(), 1e-9);
    EXPECT_LT((whole.row(pair.upper_marker) - 0.3 * whole.row(pair.upper_rim)).norm(), 1e-9);
  }
  for (std::size_t i = 0; i < moves.size(); ++i) {
    if (!moves[i] && !sampleControl().points[i].name.starts_with("CHIN")) {
      EXPECT_EQ(whole.row(signedIndex(i)).norm(), 0) << sampleControl().points[i].name;
    }
  }
  // At rest all pairs are as far from the teeth: the outer ones go less of that way.
  const MarkerPositions at_rest = tucked(sampleControl().rest, 1) - sampleControl().rest;
  const auto wayOf = [&](const char* end) {
    for (const LipPair& pair : lipPairs(sampleControl())) {
      if (sampleControl().points[unsignedIndex(pair.lower_rim)].name == std::string("RIM_LO_") + end)
        return at_rest.row(pair.lower_rim).norm();
    }
    return -1.0;
  };
  EXPECT_LT(wayOf("OUT_R"), 0.9 * wayOf("MID"));
  EXPECT_GT(wayOf("IN_R"), 0.8 * wayOf("MID")) << "whole, up to 0.4 of the way to the corner";
  EXPECT_NEAR(wayOf("OUT_R"), wayOf("OUT_L"), 1e-6);
}

}  // namespace
}  // namespace mouthpiece
