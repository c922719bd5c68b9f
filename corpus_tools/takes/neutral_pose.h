#pragma once

#include <vector>

#include "corpus_tools/takes/take_alignment.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"
#include "units/file/corpus.h"

namespace mouthpiece {

struct NeutralPose {
  MarkerPositions pose_mm;
  std::size_t frames = 0;  ///< that it is the median of
};

/// The median of the frames in silence whose lips are closed (people open them to breathe, so silence alone is not
/// rest): opening under the 5th percentile of all openings plus 15 % of the way to the 95th. A layout without
/// lips: of all frames in silence. Throws InputError for a marker that is seen in no take.
NeutralPose neutralPose(const std::vector<CorpusTake>& takes, const MarkerLayout& layout);
/// The same for takes of which only the labels are at hand; one take's motion is looked at at a time. In a corpus of
/// hours the median is of every n-th such frame.
NeutralPose neutralPose(const std::vector<CorpusTake>& takes, const MarkerLayout& layout, const MotionLoader& load);

}  // namespace mouthpiece
