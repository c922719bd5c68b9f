#pragma once

#include <vector>

#include "motion/motion_clip.h"

namespace mouthpiece {

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
/// through it in the domain of its cosines (DCT; docs/theory/cleaning.md). Meant for a clip whose head is still; seen
/// samples are not touched.
FilledMotion fillShortGaps(const MotionClip& clip, const GapFillOptions& options = {});

/// Standard deviation of the noise in one coordinate, from third differences (median, so that movement hardly counts);
/// 0 when there are fewer than four frames in a row. An upper bound where the frame rate is low.
double estimateNoise(const MotionClip& clip);

/// The same for each marker.
std::vector<double> estimateMarkerNoise(const MotionClip& clip);

}  // namespace mouthpiece
