#pragma once

namespace mouthpiece {

/// Where the tongue is asked to be, each in [0, 1]; all zero is rest. No capture of ours sees the tongue, so it is
/// driven by the phones alone (EDGE 7).
struct TonguePose {
  float tip_up = 0;       ///< tip to the ridge behind the upper teeth (L N T D)
  float tip_forward = 0;  ///< tip between the teeth (TH DH)
  float back_up = 0;      ///< back to the palate (K G NG)
};

}  // namespace mouthpiece
