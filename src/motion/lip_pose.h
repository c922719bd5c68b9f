#pragma once

namespace mouthpiece {

/// What markers around the lips do not tell of where the lips meet, each in [0, 1]. The outer edge alone cannot: it is
/// as near in TH as in B (docs/theory/deform/mouth.md).
struct LipPose {
  float seal = 1;      ///< how far touching lips stick together while their outer edges part
  float parting = 0;   ///< how far they are kept apart at the least; 1: the tongue's tip goes between
  float tuck = 0;      ///< how far the lower lip has gone under the upper teeth's edge, as in F and V
  float rounding = 0;  ///< how far they are rounded, as in W and UW
};

/// What rounded lips do that a capture has not seen, as shares of the mouth's width: cameras in front see little depth.
struct LipRounding {
  double narrowing = 0;   ///< the corners come together
  double protrusion = 0;  ///< the lips come forward
};

}  // namespace mouthpiece
