#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// How far the eyes have turned where an EyeLook... is 1; radians: 30 degrees.
inline constexpr float kWholeLook = 0.52F;

/// Apple's names of ARKit's blend shapes, in the order of Live Link Face.
inline constexpr std::array<std::string_view, 52> kArkitNames{"EyeBlinkLeft",
                                                              "EyeLookDownLeft",
                                                              "EyeLookInLeft",
                                                              "EyeLookOutLeft",
                                                              "EyeLookUpLeft",
                                                              "EyeSquintLeft",
                                                              "EyeWideLeft",
                                                              "EyeBlinkRight",
                                                              "EyeLookDownRight",
                                                              "EyeLookInRight",
                                                              "EyeLookOutRight",
                                                              "EyeLookUpRight",
                                                              "EyeSquintRight",
                                                              "EyeWideRight",
                                                              "JawForward",
                                                              "JawRight",
                                                              "JawLeft",
                                                              "JawOpen",
                                                              "MouthClose",
                                                              "MouthFunnel",
                                                              "MouthPucker",
                                                              "MouthRight",
                                                              "MouthLeft",
                                                              "MouthSmileLeft",
                                                              "MouthSmileRight",
                                                              "MouthFrownLeft",
                                                              "MouthFrownRight",
                                                              "MouthDimpleLeft",
                                                              "MouthDimpleRight",
                                                              "MouthStretchLeft",
                                                              "MouthStretchRight",
                                                              "MouthRollLower",
                                                              "MouthRollUpper",
                                                              "MouthShrugLower",
                                                              "MouthShrugUpper",
                                                              "MouthPressLeft",
                                                              "MouthPressRight",
                                                              "MouthLowerDownLeft",
                                                              "MouthLowerDownRight",
                                                              "MouthUpperUpLeft",
                                                              "MouthUpperUpRight",
                                                              "BrowDownLeft",
                                                              "BrowDownRight",
                                                              "BrowInnerUp",
                                                              "BrowOuterUpLeft",
                                                              "BrowOuterUpRight",
                                                              "CheekPuff",
                                                              "CheekSquintLeft",
                                                              "CheekSquintRight",
                                                              "NoseSneerLeft",
                                                              "NoseSneerRight",
                                                              "TongueOut"};

/// The number in kArkitNames of a shape's name: letter case, `_` and other punctuation do not count, `_L` and `_R`
/// stand for Left and Right, as a capital L or R after a small letter does, and halves of a shape that Apple has whole
/// (browInnerUp_L) are that shape. The name of a mesh or a set may stand before it ("blendShape1.jawOpen"), not that of
/// another shape ("jawOpen_mouthClose"). -1: none of them.
int arkitIndex(std::string_view shape_name);
/// The same of a shape of a head that has shapes of these `names`: one blink of both eyes (VRM's blink, eyesClosed) is
/// EyeBlinkLeft where none of them is of one eye alone.
int arkitIndexAmong(std::string_view shape_name, const std::vector<std::string>& names);

/// What each of ARKit's shapes does to each marker of the default layout, learnt from a head that has them all.
struct ArkitMarkerMoves {
  std::vector<std::string> markers;
  MarkerPositions neutral_mm;             ///< markers x 3, of that head
  std::vector<MarkerPositions> moves_mm;  ///< 52, markers x 3 each
  Eigen::MatrixXd rims_parted_mm;  ///< 3 x 52: the lips' rims right of the middle, there and left of it, by height
};
const ArkitMarkerMoves& arkitMarkerMoves();

}  // namespace mouthpiece
