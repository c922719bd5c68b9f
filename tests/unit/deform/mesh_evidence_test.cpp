// What parts of a head are by more than their names: by islands around the teeth, by bones, by what shapes move.
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "deform/mesh/bone_roles.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

/// Boxes of twelve triangles, each an island, in named parts.
class Boxes : public ::testing::Test {
 protected:
  void begin(const std::string& name) { soup_.parts.push_back({.name = name}); }
  /// `half`: of its sides. The vertices' numbers begin with the one returned.
  std::size_t box(const std::array<double, 3>& middle, double half) {
    const auto first = static_cast<std::uint32_t>(soup_.positions.size() / 3);
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      for (std::uint32_t axis = 0; axis < 3; ++axis)
        soup_.positions.push_back(static_cast<float>(middle[axis] + ((corner >> axis & 1U) != 0 ? half : -half)));
    }
    for (const auto& [a, b, c, d] : {std::array{0U, 2U, 3U, 1U},
                                     {4U, 5U, 7U, 6U},
                                     {0U, 1U, 5U, 4U},
                                     {2U, 6U, 7U, 3U},
                                     {0U, 4U, 6U, 2U},
                                     {1U, 3U, 7U, 5U}}) {
      for (const Triangle& t : {Triangle{a, b, c}, Triangle{a, c, d}}) {
        soup_.triangles.push_back({first + t[0], first + t[1], first + t[2]});
        soup_.part_of_triangle.push_back(static_cast<std::uint32_t>(soup_.parts.size() - 1));
      }
    }
    return first;
  }
  [[nodiscard]] FaceMesh mesh() const { return finishMesh(soup_, "boxes"); }
  void mark(std::size_t first, BoneRole role, std::size_t count = 8) {
    soup_.evidence.bones.resize(soup_.positions.size() / 3, BoneRole::kUnknown);
    std::fill_n(soup_.evidence.bones.begin() + static_cast<std::ptrdiff_t>(first), count, role);
  }
  void move(std::size_t first, float way, std::size_t count = 8) {
    soup_.evidence.mouth_moves.resize(soup_.positions.size() / 3, 0);
    std::fill_n(soup_.evidence.mouth_moves.begin() + static_cast<std::ptrdiff_t>(first), count, way);
  }
  static std::vector<PartKind> kindsOf(const FaceMesh& mesh) {
    std::vector<PartKind> kinds;
    for (const MeshPart& part : mesh.parts) kinds.push_back(part.kind);
    return kinds;
  }

  MeshSoup soup_;
};
using Kinds = std::vector<PartKind>;

TEST_F(Boxes, AnIslandOfSkinAroundTheTeethIsTheMouthsBag) {
  begin("skin");
  box({0, 0, 0}, 10);
  box({0, 0, 5}, 2.4);
  begin("upper_teeth");
  box({0, 0, 5}, 1);
  const FaceMesh bagged = mesh();
  ASSERT_EQ(kindsOf(bagged), (Kinds{PartKind::kSkin, PartKind::kMouthInside, PartKind::kUpperTeeth}));
  EXPECT_EQ(bagged.parts[0].name, "skin");
  EXPECT_EQ(bagged.parts[1].name, "skin.mouth");
  EXPECT_EQ(bagged.parts[1].triangle_count, 12U);
  for (std::size_t t = bagged.parts[1].first_triangle; t < bagged.parts[1].first_triangle + 12; ++t)
    EXPECT_LT(std::abs(bagged.vertices(bagged.triangles[t][0], 0)), 3) << "the small box";
}

TEST_F(Boxes, WhatIsMuchLargerThanTheTeethOrBesideThemIsNoBag) {
  begin("skin");
  box({0, 0, 0}, 10);
  box({0, 0, 5}, 2.6);  // its triangles' middles span 2.6 times as much
  box({9, 0, 5}, 2);
  begin("upper_teeth");
  box({0, 0, 5}, 1);
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kSkin, PartKind::kUpperTeeth}));
}

TEST_F(Boxes, OneIslandIsNoBagAndABagNeedsNoOther) {
  begin("skin");
  box({0, 0, 5}, 2);
  begin("upper_teeth");
  box({0, 0, 5}, 1);
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kSkin, PartKind::kUpperTeeth}));
  begin("mouth");
  box({0, 0, 5}, 1.5);
  begin("skin2");
  box({0, 0, 0}, 9);
  box({0, 0, 5}, 2);
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kSkin, PartKind::kUpperTeeth, PartKind::kMouthInside, PartKind::kSkin}));
}

TEST_F(Boxes, RowsOfTeethAreToldByTheirNames) {
  for (const char* name : {"teeth_top", "TeethUpper", "teeth_up", "teeth_bottom", "LowerTeeth", "teeth_lo"}) {
    begin(name);
    box({0, 5, 0}, 1);
    box({0, -5, 0}, 1);
  }
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kUpperTeeth, PartKind::kUpperTeeth, PartKind::kUpperTeeth,
                                    PartKind::kLowerTeeth, PartKind::kLowerTeeth, PartKind::kLowerTeeth}));
}

/// A mouth that is modelled open tells more by its jaw than by heights: what the jaw carries is the lower row.
TEST_F(Boxes, TheRowThatTheJawCarriesIsTheLowerOne) {
  for (const bool high_one_moves : {false, true}) {
    soup_ = {};
    begin("teeth");
    const std::size_t high = box({0, 5, 0}, 1), low = box({0, -5, 0}, 1), loose = box({4, -5, 0}, 1);
    soup_.evidence.jaw_moves.assign(24, 0);
    const auto carry = [&](std::size_t first, float way) {
      std::fill_n(soup_.evidence.jaw_moves.begin() + signedIndex(first), 8, way);
    };
    carry(high_one_moves ? high : low, 3);
    carry(loose, high_one_moves ? 0.2F : 2.8F);
    const FaceMesh split = mesh();
    ASSERT_EQ(kindsOf(split), (Kinds{PartKind::kUpperTeeth, PartKind::kLowerTeeth}));
    for (const MeshPart& part : split.parts) {
      for (const Triangle& t : trianglesOf(split, part))
        EXPECT_EQ(part.kind == PartKind::kLowerTeeth, soup_.evidence.jaw_moves[t[0]] > 1.5F) << t[0] / 8;
    }
  }
}

/// A bite may rise or fall to the back: a molar of the lower row then stands higher than an incisor of the upper one.
TEST_F(Boxes, RowsOfTeethAreToldHoweverTheirBiteFalls) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> jitter(-0.1, 0.1);
  for (const double tilt : {-0.6, -0.5, -0.35, -0.2, -0.1, 0.0, 0.1, 0.2, 0.35, 0.5, 0.6}) {
    soup_ = {};
    begin("teeth");
    std::vector<bool> is_upper;
    for (int tooth = 0; tooth < 28; ++tooth) {
      const double deep = tooth / 4 * 4.0;
      is_upper.push_back(tooth % 2 == 0);
      box({(tooth / 2 % 2 == 0 ? 1 : -1) * (4 + 0.5 * deep), -tilt * deep + (is_upper.back() ? 1 : -1) + jitter(random),
           -deep},
          0.3);
    }
    const FaceMesh split = mesh();
    ASSERT_EQ(kindsOf(split), (Kinds{PartKind::kUpperTeeth, PartKind::kLowerTeeth})) << tilt;
    for (const MeshPart& part : split.parts) {
      EXPECT_EQ(part.triangle_count, 14U * 12) << tilt;
      for (const Triangle& t : trianglesOf(split, part))
        EXPECT_EQ(is_upper[t[0] / 8], part.kind == PartKind::kUpperTeeth) << tilt << " tooth " << t[0] / 8;
    }
  }
}

TEST_F(Boxes, WetThingsShineAndOwnColoursStay) {
  for (const char* name : {"skin", "lips", "upper_teeth", "tongue", "eye", "hair"}) {
    begin(name);
    box({0, 0, 0}, 1);
  }
  const FaceMesh plain = mesh();
  const std::vector<float> expected{0.6F, 0.4F, 0.25F, 0.4F, 0.25F, 0.6F};
  for (std::size_t p = 0; p < expected.size(); ++p) {
    EXPECT_EQ(plain.parts[p].roughness, expected[p]) << plain.parts[p].name;
    EXPECT_LT(plain.parts[p].base_color[2], 0.9F);
    EXPECT_EQ(plain.parts[p].base_color[3], 1);
  }
  begin("Gums_upper");
  box({0, 0, 0}, 1);
  EXPECT_EQ(mesh().parts.back().base_color, (std::array<float, 4>{0.25F, 0.06F, 0.06F, 1}));
  soup_.vertex_colors.assign(soup_.positions.size() / 3, {0.1F, 0.2F, 0.3F});
  for (const MeshPart& part : mesh().parts) EXPECT_EQ(part.base_color, (std::array<float, 4>{1, 1, 1, 1}));
  soup_.has_colors = true;
  for (MeshPart& part : soup_.parts) part.base_color = {0.3F, 0.4F, 0.5F, 0.6F};
  for (const MeshPart& part : mesh().parts) EXPECT_EQ(part.base_color, (std::array<float, 4>{0.3F, 0.4F, 0.5F, 0.6F}));
}

TEST_F(Boxes, WhatHangsOnBonesOfEyesAndHairIsThat) {
  begin("thing");
  mark(box({0, 0, 0}, 1), BoneRole::kEye);
  begin("other thing");
  mark(box({3, 0, 0}, 1), BoneRole::kHair);
  begin("third thing");
  mark(box({6, 0, 0}, 1), BoneRole::kEye, 7);  // one corner in eight hangs elsewhere
  begin("lash");
  mark(box({9, 0, 0}, 1), BoneRole::kEye);  // it moves with the lids
  begin("upper_teeth");
  mark(box({12, 0, 0}, 1), BoneRole::kHair);
  EXPECT_EQ(kindsOf(mesh()),
            (Kinds{PartKind::kEye, PartKind::kHair, PartKind::kSkin, PartKind::kSkin, PartKind::kUpperTeeth}));
}

TEST_F(Boxes, WhatHangsOnTheBodyIsNoFaceWhereThereIsAHead) {
  begin("glove face");
  const std::size_t glove = box({0, 0, 0}, 1);
  mark(glove, BoneRole::kBody);
  EXPECT_EQ(kindsOf(mesh()), Kinds{PartKind::kSkin}) << "no head that could be the face";
  begin("face");
  const std::size_t head = box({3, 0, 0}, 1);
  mark(head, BoneRole::kHead);
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kOther, PartKind::kSkin}));
  move(head, 1);
  move(glove, 0.11F, 1);
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kSkin, PartKind::kSkin})) << "shapes of the mouth move some of it";
  move(glove, 0.09F, 1);
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kOther, PartKind::kSkin})) << "less than a tenth of the furthest";
}

TEST_F(Boxes, WhatShapesOfTheMouthMoveMostIsSkinWhateverItIsCalled) {
  begin("glasses");
  const std::size_t first = box({0, 0, 0}, 1);
  begin("hair");
  const std::size_t second = box({3, 0, 0}, 1);
  move(first, 1, 3);
  move(second, 1, 5);
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kOther, PartKind::kSkin}));
  move(first, 1, 8);
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kSkin, PartKind::kHair}));
  begin("skin");
  const std::size_t skin = box({6, 0, 0}, 1);
  move(skin, 0);
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kSkin, PartKind::kHair, PartKind::kSkin})) << "skin that does not move";
  move(skin, 0.5F, 1);
  EXPECT_EQ(kindsOf(mesh()), (Kinds{PartKind::kOther, PartKind::kHair, PartKind::kSkin})) << "skin that does";
}

TEST(Bones, AJawHasNamesInSeveralLanguages) {
  tinygltf::Model model;
  for (const char* name :
       {"mixamorig:Jaw", "lower_jaw.x", "mandible", "Kiefer", "Unterkiefer", "顎", "Oberkiefer", "上顎", "arm", "head"})
    model.nodes.emplace_back().name = name;
  const std::vector<int> parents(model.nodes.size(), -1);
  model.skins.emplace_back();
  for (int i = 0; i < std::ssize(model.nodes); ++i) model.skins[0].joints.push_back(i);
  const std::vector<BoneRole> roles = boneRoles(model, parents);
  for (std::size_t i = 0; i < roles.size(); ++i) EXPECT_EQ(roles[i] == BoneRole::kJaw, i < 6) << model.nodes[i].name;
}

}  // namespace
}  // namespace mouthpiece
