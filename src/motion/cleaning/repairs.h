#pragma once

#include <vector>

#include "motion/motion_clip.h"

namespace mouthpiece {

// Repairs of a captured clip, in the order in which they are done (docs/theory/motion/cleaning.md).

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
  double acceleration_mm_s2 =
      40000;                  ///< more than lips or a head reach (measured on GRID: docs/theory/motion/cleaning.md)
  double allowance_mm = 1.0;  ///< on top, for noise
  Seconds longest = 0.06;     ///< a longer excursion is no spike
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
/// something under the greatest acceleration could go and come back in the time. At an end of a stretch of seen frames
/// it is one when it is off the straight way on from the samples before it by more than that acceleration explains, and
/// these go on evenly.
HiddenSpikes hideSpikes(const MotionClip& clip, const SpikeOptions& options = {});

/// A run of frames [first, last) in which a marker was not seen.
struct Gap {
  MarkerIndex marker;
  FrameIndex first;
  FrameIndex last;
};

/// All gaps of the clip, by marker, then by time; a marker never seen is one gap over the whole clip.
std::vector<Gap> findGaps(const MotionClip& clip);

struct GapFillOptions {
  Seconds longest = 0.30;  ///< a longer gap stays NaN
  Seconds memory = 0.08;   ///< how long a deviation from what the other markers tell lasts
};

struct GapFillReport {
  std::vector<Gap> filled;
  std::vector<Gap> left;  ///< too long, or at an end of the clip, or with nothing to fill from
  double noise_mm = 0;    ///< estimated, one axis: what the filling takes as the capture's own uncertainty
};

struct FilledMotion {
  MotionClip clip;
  GapFillReport report;
};

/// Fills gaps that are short and have seen frames on both sides: the marker's place as the other markers tell it (ridge
/// regression over the frames in which they were all seen), plus the deviation from it on both sides of the gap, led
/// through it in the domain of its cosines (DCT; docs/theory/motion/cleaning.md). Meant for a clip whose head is still;
/// seen samples are not touched.
FilledMotion fillShortGaps(const MotionClip& clip, const GapFillOptions& options = {});

/// Standard deviation of the noise in one coordinate, from third differences (median, so that movement hardly counts);
/// 0 when there are fewer than four frames in a row. An upper bound where the frame rate is low.
double estimateNoise(const MotionClip& clip);

/// The same for each marker.
std::vector<double> estimateMarkerNoise(const MotionClip& clip);

struct SmoothingOptions {
  /// Standard deviation of the capture's noise in one coordinate; 0: each marker's own, estimateMarkerNoise(clip).
  double noise_mm = 0.0;
};

struct SmoothedMotion {
  MotionClip clip;
  double noise_mm = 0;                  ///< given, or the median of the markers'
  std::vector<double> marker_noise_mm;  ///< of each marker
  double rms_change_mm = 0;             ///< how far samples were moved, one coordinate
};

/// Takes light noise off (EDGE 4): a Kalman filter and Rauch-Tung-Striebel smoother of a point whose jerk is white
/// noise, for each coordinate. How restless each marker is, is found by maximum likelihood, and no coordinate is moved
/// by more than 2.5 times the noise, so quick closures stay. A sample that was not seen stays NaN.
SmoothedMotion smoothMotion(const MotionClip& clip, const SmoothingOptions& options = {});

}  // namespace mouthpiece
