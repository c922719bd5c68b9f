#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "motion/cleaning/rigid.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// A take's motion, wherever it lies.
using MotionLoader = std::function<MotionClip(std::size_t take)>;

struct TakeMove {
  std::optional<RigidMotion> move;  ///< none where the phones tell too little
  double largest_mm = 0;            ///< of a marker of the mean face
};

/// Moves that bring each take rigidly to where its mouth shapes lie in the other takes: a tracker without a jig places
/// the same face differently as the head turns (1.0 mm between the takes of grid_s1). What a take's markers should be
/// is told by its phones: marker offsets by take in a two-way layout, phone + take, by alternating means; then the
/// rigid motion that takes most of the offsets away, all markers weighing the same. Distances within the face stay.
/// Looks at one take's motion at a time; of `takes` only the labels count.
std::vector<TakeMove> takeMovesByPhones(const std::vector<CorpusTake>& takes, const MotionLoader& load);
/// Moves takes in memory. Returns TakeMove::largest_mm of each.
std::vector<double> alignTakesByPhones(std::vector<CorpusTake>& takes);

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
