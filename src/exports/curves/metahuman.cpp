#include "exports/curves/curve_files.h"

#include <algorithm>
#include <array>
#include <string>

#include "base/index.h"
#include "motion/arkit_shapes.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kPrefix = "CTRL_expressions_";

constexpr std::array kControls = std::to_array<MetahumanControl>({{"eyeBlinkLeft", "eyeBlinkL"},
                                                                  {"eyeLookDownLeft", "eyeLookDownL"},
                                                                  {"eyeLookInLeft", "eyeLookRightL"},
                                                                  {"eyeLookOutLeft", "eyeLookLeftL"},
                                                                  {"eyeLookUpLeft", "eyeLookUpL"},
                                                                  {"eyeSquintLeft", "eyeSquintInnerL"},
                                                                  {"eyeWideLeft", "eyeWidenL"},
                                                                  {"eyeBlinkRight", "eyeBlinkR"},
                                                                  {"eyeLookDownRight", "eyeLookDownR"},
                                                                  {"eyeLookInRight", "eyeLookLeftR"},
                                                                  {"eyeLookOutRight", "eyeLookRightR"},
                                                                  {"eyeLookUpRight", "eyeLookUpR"},
                                                                  {"eyeSquintRight", "eyeSquintInnerR"},
                                                                  {"eyeWideRight", "eyeWidenR"},
                                                                  {"jawForward", "jawFwd"},
                                                                  {"jawRight", "jawRight"},
                                                                  {"jawLeft", "jawLeft"},
                                                                  {"jawOpen", "jawOpen"},
                                                                  {"mouthClose", "mouthLipsTogetherUL"},
                                                                  {"mouthClose", "mouthLipsTogetherUR"},
                                                                  {"mouthClose", "mouthLipsTogetherDL"},
                                                                  {"mouthClose", "mouthLipsTogetherDR"},
                                                                  {"mouthFunnel", "mouthFunnelUL"},
                                                                  {"mouthFunnel", "mouthFunnelUR"},
                                                                  {"mouthFunnel", "mouthFunnelDL"},
                                                                  {"mouthFunnel", "mouthFunnelDR"},
                                                                  {"mouthPucker", "mouthLipsPurseUL"},
                                                                  {"mouthPucker", "mouthLipsPurseUR"},
                                                                  {"mouthPucker", "mouthLipsPurseDL"},
                                                                  {"mouthPucker", "mouthLipsPurseDR"},
                                                                  {"mouthRight", "mouthRight"},
                                                                  {"mouthLeft", "mouthLeft"},
                                                                  {"mouthSmileLeft", "mouthCornerPullL"},
                                                                  {"mouthSmileRight", "mouthCornerPullR"},
                                                                  {"mouthFrownLeft", "mouthCornerDepressL"},
                                                                  {"mouthFrownRight", "mouthCornerDepressR"},
                                                                  {"mouthDimpleLeft", "mouthDimpleL"},
                                                                  {"mouthDimpleRight", "mouthDimpleR"},
                                                                  {"mouthStretchLeft", "mouthStretchL"},
                                                                  {"mouthStretchRight", "mouthStretchR"},
                                                                  {"mouthRollLower", "mouthLowerLipRollInL"},
                                                                  {"mouthRollLower", "mouthLowerLipRollInR"},
                                                                  {"mouthRollUpper", "mouthUpperLipRollInL"},
                                                                  {"mouthRollUpper", "mouthUpperLipRollInR"},
                                                                  {"mouthShrugLower", "jawChinRaiseDL"},
                                                                  {"mouthShrugLower", "jawChinRaiseDR"},
                                                                  {"mouthShrugUpper", "jawChinRaiseUL"},
                                                                  {"mouthShrugUpper", "jawChinRaiseUR"},
                                                                  {"mouthPressLeft", "mouthPressUL"},
                                                                  {"mouthPressLeft", "mouthPressDL"},
                                                                  {"mouthPressRight", "mouthPressUR"},
                                                                  {"mouthPressRight", "mouthPressDR"},
                                                                  {"mouthLowerDownLeft", "mouthLowerLipDepressL"},
                                                                  {"mouthLowerDownRight", "mouthLowerLipDepressR"},
                                                                  {"mouthUpperUpLeft", "mouthUpperLipRaiseL"},
                                                                  {"mouthUpperUpRight", "mouthUpperLipRaiseR"},
                                                                  {"browDownLeft", "browDownL"},
                                                                  {"browDownRight", "browDownR"},
                                                                  {"browInnerUp", "browRaiseInL"},
                                                                  {"browInnerUp", "browRaiseInR"},
                                                                  {"browOuterUpLeft", "browRaiseOuterL"},
                                                                  {"browOuterUpRight", "browRaiseOuterR"},
                                                                  {"cheekPuff", "mouthCheekBlowL"},
                                                                  {"cheekPuff", "mouthCheekBlowR"},
                                                                  {"cheekSquintLeft", "eyeCheekRaiseL"},
                                                                  {"cheekSquintRight", "eyeCheekRaiseR"},
                                                                  {"noseSneerLeft", "noseWrinkleL"},
                                                                  {"noseSneerRight", "noseWrinkleR"},
                                                                  {"tongueOut", "tongueOut"}});

/// The column of that name, zeros where there is none.
Eigen::VectorXf columnOf(const WeightTracks& tracks, std::string_view name) {
  const auto found = std::find(tracks.names.begin(), tracks.names.end(), name);
  if (found == tracks.names.end()) return Eigen::VectorXf::Zero(tracks.weights.rows());
  return tracks.weights.col(found - tracks.names.begin());
}

}  // namespace

std::span<const MetahumanControl> metahumanControls() { return kControls; }

WeightTracks metahumanTracks(const WeightTracks& arkit) {
  // A jaw that is all but shut tells nothing of how far the lips take it back.
  constexpr float kShut = 0.01F;
  // So much of JawOpen's weight in MouthClose's takes all of it back, on the head that ARKit's shapes were learnt from.
  const Eigen::RowVectorXd parted = arkitMarkerMoves().rims_parted_mm.colwise().mean();
  const float all_of_it = asFloat(-parted(arkitIndex("JawOpen")) / parted(arkitIndex("MouthClose")));
  WeightTracks tracks{arkit.frame_rate_hz, {}, RowMajorMatrixF(arkit.weights.rows(), signedIndex(kControls.size()))};
  const Eigen::VectorXf jaw = columnOf(arkit, "jawOpen");
  for (std::size_t k = 0; k < kControls.size(); ++k) {
    tracks.names.push_back(std::string(kPrefix) + std::string(kControls[k].control));
    Eigen::VectorXf weights = columnOf(arkit, kControls[k].arkit);
    if (kControls[k].arkit == "mouthClose") {
      for (Eigen::Index t = 0; t < weights.size(); ++t)
        weights(t) = jaw(t) > kShut ? std::clamp(weights(t) / (all_of_it * jaw(t)), 0.0F, 1.0F) : 0.0F;
    }
    tracks.weights.col(signedIndex(k)) = weights;
  }
  return tracks;
}

}  // namespace mouthpiece
