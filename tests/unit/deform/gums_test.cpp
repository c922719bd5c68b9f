#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"

#include <gtest/gtest.h>

#include <array>
#include "tests/unit/deform/kept_numbers.h"

namespace mouthpiece {
namespace {

struct Place {
  float z, y;
  GumPiece piece;  ///< of the strip from here to the next place
  bool told = true;
};

/// The mouth from the side, from the upper gum over palate and throat to the tongue, round its tip to the floor and the
/// lower gum: one surface.
constexpr std::array kProfile{
    Place{52, 14, GumPiece::kUpperGum},        Place{52, 6, GumPiece::kUpperGum},
    Place{48, 8, GumPiece::kUpperGum},         Place{40, 12, GumPiece::kUpperGum},
    Place{10, 12, GumPiece::kUpperGum, false}, Place{2, 6, GumPiece::kUpperGum, false},
    Place{2, -10, GumPiece::kTongue, false},   Place{8, -2, GumPiece::kTongue},
    Place{20, 2, GumPiece::kTongue},           Place{40, 2, GumPiece::kTongue},
    Place{46, -1, GumPiece::kTongue},          Place{40, -4, GumPiece::kTongue},
    Place{20, -5, GumPiece::kLowerGum},        Place{40, -9, GumPiece::kLowerGum},
    Place{48, -6, GumPiece::kLowerGum},        Place{50, -4, GumPiece::kLowerGum},
    Place{53, -10, GumPiece::kLowerGum},
};
constexpr int kColumns = 7;
constexpr float kWidth = 30;

struct Mouth {
  FaceMesh mesh;
  std::vector<Triangle> gums, upper_teeth, lower_teeth;
};

std::uint32_t vertexAt(std::size_t place, int column) {
  return static_cast<std::uint32_t>(place) * kColumns + static_cast<std::uint32_t>(column);
}

/// A row of teeth that stands across: one sheet.
std::vector<Triangle> addTeeth(float low, float high, float z, VertexPositions& vertices) {
  const auto first = static_cast<std::uint32_t>(vertices.rows());
  vertices.conservativeResize(first + 4, 3);
  vertices.bottomRows(4) << -kWidth / 2, low, z, kWidth / 2, low, z, kWidth / 2, high, z, -kWidth / 2, high, z;
  return {{first, first + 1, first + 2}, {first, first + 2, first + 3}};
}

Mouth mouthWith(bool inside_out) {
  Mouth mouth;
  mouth.mesh.vertices.resize(static_cast<Eigen::Index>(kProfile.size()) * kColumns, 3);
  for (std::size_t i = 0; i < kProfile.size(); ++i) {
    for (int c = 0; c < kColumns; ++c) {
      const float x = kWidth * (static_cast<float>(c) / (kColumns - 1) - 0.5F);
      mouth.mesh.vertices.row(vertexAt(i, c)) << x, kProfile[i].y, kProfile[i].z;
    }
  }
  for (std::size_t i = 0; i + 1 < kProfile.size(); ++i) {
    for (int c = 0; c + 1 < kColumns; ++c) {
      const std::uint32_t a = vertexAt(i, c), b = vertexAt(i, c + 1), d = vertexAt(i + 1, c),
                          e = vertexAt(i + 1, c + 1);
      mouth.gums.push_back(inside_out ? Triangle{a, d, b} : Triangle{a, b, d});
      mouth.gums.push_back(inside_out ? Triangle{b, d, e} : Triangle{b, e, d});
    }
  }
  mouth.upper_teeth = addTeeth(-1, 6, 51, mouth.mesh.vertices);
  mouth.lower_teeth = addTeeth(-4, -1, 50, mouth.mesh.vertices);
  return mouth;
}

TEST(Gums, TheTongueIsToldFromPalateAndFloor) {
  for (const bool inside_out : {false, true}) {
    const Mouth mouth = mouthWith(inside_out);
    const std::vector<GumPiece> pieces = splitGums(mouth.mesh, mouth.gums, mouth.upper_teeth, mouth.lower_teeth);
    ASSERT_EQ(pieces.size(), mouth.gums.size());
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const Place& place = kProfile[i / (2 * (kColumns - 1))];
      if (place.told) {
        EXPECT_EQ(pieces[i], place.piece) << "at z " << place.z << ", y " << place.y;
      }
    }
  }
}

/// A head that was read, written and read again has the parts that it had.
TEST(Gums, WhatWasSplitIsNotSplitAgain) {
  Mouth mouth = mouthWith(false);
  FaceMesh& mesh = mouth.mesh;
  const auto addPart = [&](const std::string& name, const std::vector<Triangle>& triangles) {
    MeshPart part;
    part.name = name;
    part.first_triangle = mesh.triangles.size();
    part.triangle_count = triangles.size();
    mesh.parts.push_back(part);
    mesh.triangles.insert(mesh.triangles.end(), triangles.begin(), triangles.end());
  };
  addPart("Teeth_upper", mouth.upper_teeth);
  addPart("Teeth_lower", mouth.lower_teeth);
  addPart("GumsTongue", mouth.gums);
  const auto namesOf = [](const FaceMesh& of) {
    std::vector<std::pair<std::string, PartKind>> names;
    for (const MeshPart& part : of.parts) names.emplace_back(part.name, part.kind);
    return names;
  };
  assignPartKinds(mesh, false, {});
  const auto once = namesOf(mesh);
  ASSERT_EQ(once.size(), 5U);
  EXPECT_EQ(once.back(), (std::pair<std::string, PartKind>("GumsTongue.tongue", PartKind::kTongue)));
  assignPartKinds(mesh, false, {});
  EXPECT_EQ(namesOf(mesh), once);
}

TEST(Gums, GumsWithoutATongueHaveNone) {
  Mouth mouth = mouthWith(false);
  constexpr std::size_t kStrip = 2 * (kColumns - 1);
  mouth.gums.resize(4 * kStrip);  // the upper gum and the palate
  for (const GumPiece piece : splitGums(mouth.mesh, mouth.gums, mouth.upper_teeth, mouth.lower_teeth))
    EXPECT_NE(piece, GumPiece::kTongue);
  EXPECT_TRUE(splitGums(mouth.mesh, {}, mouth.upper_teeth, mouth.lower_teeth).empty());
}

TEST(Gums, AreSplitAsWasKept) {
  test::KeptNumbers kept("gums");
  Mouth mouth = mouthWith(false);
  for (const float slant : {-0.25F, 0.1F, 0.3F}) {
    FaceMesh slanted = mouth.mesh;
    slanted.vertices.col(1) += slant * mouth.mesh.vertices.col(2) + 0.1F * mouth.mesh.vertices.col(0);
    for (const GumPiece piece : splitGums(slanted, mouth.gums, mouth.upper_teeth, mouth.lower_teeth))
      kept.add(static_cast<int>(piece));
  }
}

}  // namespace
}  // namespace mouthpiece
