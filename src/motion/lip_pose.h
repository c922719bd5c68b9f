#pragma once

namespace mouthpiece {

/// What markers around the lips do not tell of where the lips meet, each in [0, 1]. The outer edge alone cannot: it is
/// as near in TH as in B (docs/theory/deform/bezier_deformation.md).
struct LipPose {
  float seal = 1;     ///< how far touching lips stick together while their outer edges part
  float parting = 0;  ///< how far they are kept apart at the least; 1: the tongue's tip goes between
};

}  // namespace mouthpiece
