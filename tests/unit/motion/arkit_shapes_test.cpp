// ARKit's shapes by any name, what they do to markers, and markers by name.
#include "motion/arkit_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "base/errors.h"
#include "motion/formats/motion_file.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"

namespace mouthpiece {
namespace {

int numberOf(std::string_view name) {
  return static_cast<int>(std::find(kArkitNames.begin(), kArkitNames.end(), name) - kArkitNames.begin());
}

TEST(ArkitIndex, FindsEveryShapeHoweverItIsSpelt) {
  std::mt19937 random(4);
  for (const std::string_view name : kArkitNames) {
    EXPECT_EQ(arkitIndex(name), numberOf(name)) << name;
    std::string spelt;
    for (const char& letter : name) {
      // Before a last letter they would make a side of it.
      if (&letter != &name.back() && random() % 4 == 0) spelt += "_- ."[random() % 4];
      spelt += random() % 2 == 0 ? static_cast<char>(std::tolower(static_cast<unsigned char>(letter))) : letter;
    }
    EXPECT_EQ(arkitIndex(spelt), numberOf(name)) << spelt;
    for (const auto& [side, letter] : {std::pair("Left", 'L'), {"Right", 'r'}}) {
      if (!name.ends_with(side) || name == "MouthLeft" || name == "JawLeft" || name == "MouthRight" ||
          name == "JawRight")
        continue;
      const std::string stem(name.substr(0, name.size() - std::string_view(side).size()));
      for (const char dot : {'_', '.'})
        EXPECT_EQ(arkitIndex(stem + dot + letter), numberOf(name)) << stem << dot << letter;
    }
  }
}

TEST(ArkitIndex, HalvesOfAWholeShapeAreItAndOtherProgramsNamesAreKnown) {
  EXPECT_EQ(arkitIndex("browInnerUp_L"), numberOf("BrowInnerUp"));
  EXPECT_EQ(arkitIndex("cheekPuffRight"), numberOf("CheekPuff"));
  EXPECT_EQ(arkitIndex("Eye_Blink_L"), numberOf("EyeBlinkLeft"));
  EXPECT_EQ(arkitIndex("Fcl_EYE_Close_R"), numberOf("EyeBlinkRight"));
  EXPECT_EQ(arkitIndex("Eyes_Closed_L"), numberOf("EyeBlinkLeft"));
  EXPECT_EQ(arkitIndex("Blink_R"), numberOf("EyeBlinkRight"));
  EXPECT_EQ(arkitIndex("Brow_Drop_L"), numberOf("BrowDownLeft"));
  EXPECT_EQ(arkitIndex("Brow_Raise_Outer_R"), numberOf("BrowOuterUpRight"));
  EXPECT_EQ(arkitIndex("Brow_Raise_Inner_R"), numberOf("BrowInnerUp"));
  for (const char* name : {"", "_L", "left", "nose", "mouth", "EyeBlink", "jawOpenWide", "R"})
    EXPECT_EQ(arkitIndex(name), -1) << name;
}

TEST(ArkitIndex, NamesMayStandBehindThoseOfMeshesAndSets) {
  EXPECT_EQ(arkitIndex("blendShape1.jawOpen"), numberOf("JawOpen"));
  EXPECT_EQ(arkitIndex("head_lod0_mesh__CTRL_expressions_eyeBlinkL"), numberOf("EyeBlinkLeft"));
  EXPECT_EQ(arkitIndex("Face.M_F00_000_00_Fcl_EYE_Close_L"), numberOf("EyeBlinkLeft"));
  EXPECT_EQ(arkitIndex("A14_Eye_Blink_Left"), numberOf("EyeBlinkLeft"));
  EXPECT_EQ(arkitIndex("Head|mouthSmile_R"), numberOf("MouthSmileRight"));
  EXPECT_EQ(arkitIndex("jawL"), numberOf("JawLeft"));
  for (const char* name : {"jawOpen_mouthClose", "corrective.jawOpen_mouthFunnel", "Turn_Jaw_L", "up_mouth_R",
                           "Face.M_F00_000_00_Fcl_MTH_A", "MOUTHL", "._:|", "a.b_c"})
    EXPECT_EQ(arkitIndex(name), -1) << name;
}

/// Learnt from a head, they do what their names say, on the side that they name.
TEST(ArkitMarkerMoves, DoWhatTheirNamesSay) {
  const ArkitMarkerMoves& learnt = arkitMarkerMoves();
  ASSERT_EQ(learnt.moves_mm.size(), kArkitNames.size());
  ASSERT_EQ(learnt.neutral_mm.rows(), static_cast<Eigen::Index>(learnt.markers.size()));
  const auto markerNamed = [&](std::string_view name) {
    const auto found = std::find(learnt.markers.begin(), learnt.markers.end(), name);
    EXPECT_NE(found, learnt.markers.end()) << name;
    return found - learnt.markers.begin();
  };
  const auto move = [&](std::string_view shape, std::string_view marker) -> Eigen::RowVector3d {
    return learnt.moves_mm[static_cast<std::size_t>(numberOf(shape))].row(markerNamed(marker));
  };
  for (const MarkerPositions& moves : learnt.moves_mm) {
    ASSERT_EQ(moves.rows(), learnt.neutral_mm.rows());
    EXPECT_TRUE(moves.allFinite());
    EXPECT_LT(moves.rowwise().norm().maxCoeff(), 60) << "no shape tears a face";
  }
  ASSERT_EQ(learnt.rims_parted_mm.cols(), static_cast<Eigen::Index>(kArkitNames.size()));
  EXPECT_LT(learnt.rims_parted_mm.cwiseAbs().maxCoeff(), 60);
  const auto parted = [&](std::string_view shape) { return learnt.rims_parted_mm.col(numberOf(shape)).mean(); };
  EXPECT_GT(parted("JawOpen"), 20);
  EXPECT_LT(parted("MouthClose"), -20);
  EXPECT_LT(parted("MouthPressLeft"), 0);
  EXPECT_GT(parted("MouthFunnel"), 5);
  for (const char* shape : {"EyeBlinkLeft", "BrowInnerUp", "CheekSquintRight"})
    EXPECT_LT(std::abs(parted(shape)), 0.5) << shape;
  for (const std::string& marker : learnt.markers) EXPECT_NO_THROW((void)defaultLayout().indexOf(marker));
  EXPECT_LT(move("JawOpen", "CHIN_MID").y(), -10);
  EXPECT_GT(move("JawForward", "CHIN_MID").z(), 1);
  EXPECT_GT(move("JawLeft", "CHIN_MID").x(), 1) << "X is the subject's left";
  EXPECT_LT(move("JawRight", "CHIN_MID").x(), -1);
  EXPECT_LT(std::abs(move("JawOpen", "FOREHEAD_MID").norm()), 1);
  for (const auto& [side, other, sign] : {std::tuple('L', 'R', 1.0), {'R', 'L', -1.0}}) {
    const std::string word = side == 'L' ? "Left" : "Right", own = std::string("_") + side,
                      far = std::string("_") + other;
    EXPECT_GT(sign * move("MouthSmile" + word, "LIP_CORNER" + own).x(), 1) << word;
    EXPECT_GT(move("MouthSmile" + word, "LIP_CORNER" + own).y(), 1) << word;
    EXPECT_GT(move("MouthSmile" + word, "LIP_CORNER" + own).norm(),
              2 * move("MouthSmile" + word, "LIP_CORNER" + far).norm());
    EXPECT_LT(move("MouthFrown" + word, "LIP_CORNER" + own).y(), -1) << word;
    EXPECT_LT(move("BrowDown" + word, "BROW_MID" + own).y(), -1) << word;
    EXPECT_GT(move("BrowOuterUp" + word, "BROW_OUT" + own).y(), 1) << word;
    EXPECT_LT(move("EyeBlink" + word, "LID_UP" + own).y(), -2) << word;
    EXPECT_LT(move("EyeBlink" + word, "LID_UP" + far).norm(), 1) << word;
  }
  EXPECT_LT(move("MouthPucker", "LIP_CORNER_L").x(), -1) << "the mouth narrows";
  EXPECT_GT(move("MouthPucker", "LIP_CORNER_R").x(), 1);
}

TEST(SelectMarkers, GivesThoseNamedInTheirOrderAndNothingForOthers) {
  std::mt19937 random(5);
  MotionClip clip{100, {"A", "B", "C", "D"}, PositionMatrix::Random(7, 12)};
  const MotionClip selected = selectMarkers(clip, {"C", "none", "A"});
  EXPECT_EQ(selected.marker_names, (std::vector<std::string>{"C", "none", "A"}));
  EXPECT_EQ(selected.frame_rate_hz, 100);
  EXPECT_EQ(selected.positions_mm.middleCols<3>(0), clip.positions_mm.middleCols<3>(6));
  EXPECT_EQ(selected.positions_mm.middleCols<3>(6), clip.positions_mm.middleCols<3>(0));
  EXPECT_TRUE(selected.positions_mm.middleCols<3>(3).array().isNaN().all());
  EXPECT_EQ(selectMarkers(clip, clip.marker_names).positions_mm, clip.positions_mm);
}

TEST(UpperFaceColumns, AreThreeOfEachMarkerAboveTheNose) {
  const std::vector<bool> upper = upperFaceColumns(defaultLayout());
  ASSERT_EQ(upper.size(), 3 * defaultLayout().markers.size());
  for (std::size_t i = 0; i < defaultLayout().markers.size(); ++i) {
    const std::string& name = defaultLayout().markers[i].name;
    const bool expected = name.starts_with("FOREHEAD") || name.starts_with("TEMPLE") || name.starts_with("BROW") ||
                          name.starts_with("LID") || name.starts_with("CANTHUS");
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_EQ(upper[3 * i + axis], expected) << name;
  }
}

TEST(MarkerLabels, NameALayoutsMarkersAsTheCaptureDoes) {
  const auto layoutWith = [](const std::string& first, const std::string& second) {
    return R"({"name": "two", "markers": [
      {"name": "LIP_UP_MID", "region": "lip", "side": "M", "mirror": "LIP_UP_MID", "mediapipe_landmark": 0, "stable": false)" +
           first + R"(},
      {"name": "LIP_LO_MID", "region": "lip", "side": "M", "mirror": "LIP_LO_MID", "mediapipe_landmark": 17, "stable": false)" +
           second + "}], \"jig\": []}";
  };
  const auto labelsOf = [](const std::string& json) {
    return markerLabels(json, "l.json", parseLayout(json, "l.json"));
  };
  EXPECT_TRUE(labelsOf(layoutWith("", "")).empty());
  EXPECT_EQ(labelsOf(layoutWith(R"(, "label": "ulip")", R"(, "label": "llip")")),
            (std::map<std::string, std::string>{{"ulip", "LIP_UP_MID"}, {"llip", "LIP_LO_MID"}}));
  EXPECT_EQ(labelsOf(layoutWith(R"(, "label": "LIP_UP_MID")", "")).at("LIP_UP_MID"), "LIP_UP_MID")
      << "its own name will do";
  EXPECT_THROW(labelsOf(layoutWith(R"(, "label": "x")", R"(, "label": "x")")), InputError) << "one label, two markers";
  EXPECT_THROW(labelsOf(layoutWith(R"(, "label": "LIP_LO_MID")", "")), InputError) << "another marker's name";
}

}  // namespace
}  // namespace mouthpiece
