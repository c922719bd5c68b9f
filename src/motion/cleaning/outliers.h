#pragma once

#include <vector>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// Two markers whose names changed places at `frame`; every sample from there on was given back to its marker.
struct MarkerSwap {
  MarkerIndex first, second;
  FrameIndex frame;
};

/// Samples [first, last) of a marker that left its path and came back faster than skin can move.
struct Spike {
  MarkerIndex marker;
  FrameIndex first;
  FrameIndex last;
  double distance_mm = 0;  ///< farthest from the straight way over them
};

struct SwapOptions {
  double least_gain_mm = 4.0;  ///< the two steps of a pair get shorter by at least this when their names are exchanged
  double least_share = 0.5;    ///< ... and by at least this share of what they are
  Seconds longest_gap = 0.20;  ///< a marker that was not seen for longer is not compared with where it was
};

struct SpikeOptions {
  double acceleration_mm_s2 = 40000;  ///< more than lips or a head reach (measured on GRID: docs/theory/cleaning.md)
  double allowance_mm = 1.0;          ///< on top, for noise
  Seconds longest = 0.06;             ///< a longer excursion is no spike
};

struct RepairedSwaps {
  MotionClip clip;
  std::vector<MarkerSwap> swaps;
};

/// Follows all markers from frame to frame; where exchanging the names of two makes both their steps much shorter, they
/// are exchanged from there on (so a second swap exchanges them back). A swap that lasts the whole clip cannot be seen.
RepairedSwaps repairSwaps(const MotionClip& clip, const SwapOptions& options = {});

struct HiddenSpikes {
  MotionClip clip;  ///< the spikes' samples are NaN, for the gap filling to repair
  std::vector<Spike> spikes;
};

/// A run of samples is a spike when all of it is off the straight way between the samples around it, and farther than
/// something under the greatest acceleration could go and come back in the time.
HiddenSpikes hideSpikes(const MotionClip& clip, const SpikeOptions& options = {});

}  // namespace mouthpiece
