#pragma once

#include <span>

#include "vocal/viseme_poses.h"
#include "vocal/vocal_style.h"

namespace mouthpiece {

/// The markers' displacements from the neutral pose at rising `times`: times x (3 * markers), mm. Lips do not pass
/// through each other.
PositionMatrix displacementsFromCurves(const CurveSet& curves, const VisemePoses& poses, const StyleSignal& ja,
                                       const StyleSignal& li, const std::vector<Seconds>& times);

/// Leads the lips to a contact wherever the curves ask for one: to closed lips by MBP, to the teeth by FV, and never
/// further together than pressed. Moves along the poses' opening direction. `displacements` as above, of any origin.
void keepContacts(const CurveSet& curves, const VisemePoses& poses, const std::vector<Seconds>& times,
                  PositionMatrix& displacements);

}  // namespace mouthpiece
