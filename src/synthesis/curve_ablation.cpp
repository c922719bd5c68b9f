#include "synthesis/curve_ablation.h"

#include <utility>

#include "vocal/viseme_curves.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {
namespace {

struct LeftOut {
  std::string name;
  bool ma = false, ps = false, vowel_modification = false, vibrato = false;
};

const std::vector<LeftOut>& variants() {
  static const std::vector<LeftOut> kVariants = {{"all"},
                                                 {.name = "without Ma", .ma = true},
                                                 {.name = "without Ps", .ps = true},
                                                 {.name = "without vowel modification", .vowel_modification = true},
                                                 {.name = "without vibrato", .vibrato = true},
                                                 {"as speech", true, true, true, true}};
  return kVariants;
}

CurveVariant variantOf(const LeftOut& out, const SpeechLabels& labels, AudioTags tags, VocalStyle style,
                       const VisemePoses& poses, const std::vector<Seconds>& times) {
  if (out.ma) style.ma = StyleSignal(0.0);
  if (out.ps) style.ps = StyleSignal(0.0);
  if (out.vowel_modification) tags.vowels.clear();
  if (out.vibrato) tags.vibrato.clear();
  CurveVariant variant{out.name, vocalCurves(labels, tags, style), {}, {}};
  const PositionMatrix moved = displacementsFromCurves(variant.curves, poses, style.ja, style.li, times);
  variant.lip_opening_mm = poses.mouth.overFrames(&LipGauge::verticalOpening, moved);
  variant.chin_drop_mm = poses.mouth.overFrames(&LipGauge::chinDrop, moved);
  return variant;
}

}  // namespace

std::vector<CurveVariant> ablateCurves(const SpeechLabels& labels, const AudioTags& tags, const VocalStyle& style,
                                       const VisemePoses& poses, const std::vector<Seconds>& times) {
  std::vector<CurveVariant> made;
  for (const LeftOut& out : variants()) made.push_back(variantOf(out, labels, tags, style, poses, times));
  return made;
}

}  // namespace mouthpiece
