#include "retarget/placing/anchors.h"

#include <gtest/gtest.h>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

std::string messageOf(std::string_view text) {
  try {
    parseAnchors(text, "a.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Anchors, HoldVerticesPointsKindsAndUnit) {
  const Anchors anchors = parseAnchors(
      R"({"markers": {"A": 2, "B": [1, 2.5, -3]}, "parts": {"x": "tongue"}, "metres_per_unit": 0.01})", "a.json");
  const FaceMesh mesh = parseObj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "m.obj");
  EXPECT_EQ(placeOf(anchors, "A", mesh, "a.json"), Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(placeOf(anchors, "B", mesh, "a.json"), Eigen::Vector3d(1, 2.5, -3));
  EXPECT_EQ(placeOf(anchors, "C", mesh, "a.json"), std::nullopt);
  EXPECT_EQ(anchors.part_kinds.at("x"), PartKind::kTongue);
  EXPECT_EQ(anchors.metres_per_unit, 0.01);
}

TEST(Anchors, AVertexTheMeshLacksIsNamed) {
  const Anchors anchors = parseAnchors(R"({"markers": {"A": 3}})", "a.json");
  const FaceMesh mesh = parseObj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "m.obj");
  try {
    placeOf(anchors, "A", mesh, "a.json");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "a.json:markers.A: found vertex 3; expected 0 to 2");
  }
}

TEST(Anchors, WhatIsNoAnchorFileIsRefused) {
  for (const char* text :
       {"", "[", "[]", "{}", R"({"markers": []})", R"({"markers": {"A": -1}})", R"({"markers": {"A": 1.5}})",
        R"({"markers": {"A": 99999999999}})", R"({"markers": {"A": [1, 2]}})", R"({"markers": {"A": [1, 2, 1e300]}})",
        R"({"markers": {"A": "x"}})", R"({"markers": {}, "parts": {"x": "nose"}})", R"({"markers": {}, "parts": 1})",
        R"({"markers": {}, "metres_per_unit": 0})", R"({"markers": {}, "part": {"x": "tongue"}})"}) {
    EXPECT_EQ(messageOf(text).rfind("a.json:", 0), 0U) << text << " -> " << messageOf(text);
  }
}

}  // namespace
}  // namespace mouthpiece
