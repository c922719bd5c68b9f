#pragma once

#include <span>
#include <string_view>

#include "exports/curves/weight_tracks.h"

namespace mouthpiece {

/// A raw control of MetaHuman's face rig and the shape of ARKit's that moves it, by Apple's name in lower camel case.
struct MetahumanControl {
  std::string_view arkit, control;
};

/// A row a control, in ARKit's order; a shape may move several (docs/formats/metahuman.md).
std::span<const MetahumanControl> metahumanControls();

/// The values of MetaHuman's controls, 0 to 1, named as its curves are ("CTRL_expressions_jawOpen"), from ARKit's
/// weights (`arkit`, by Apple's names in lower camel case). A control has its shape's weight; those that bring the lips
/// together have mouthClose as a share of jawOpen, for the rig multiplies the two.
WeightTracks metahumanTracks(const WeightTracks& arkit);

}  // namespace mouthpiece
