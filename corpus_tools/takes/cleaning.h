#pragma once

#include <string>

#include "corpus_tools/takes/head_tracking.h"
#include "corpus_tools/takes/take_report.h"
#include "motion/cleaning/repairs.h"
#include "motion/marker_layout.h"

namespace mouthpiece {

/// Which steps are done, in this order, and how (docs/theory/motion/cleaning.md).
struct CleaningOptions {
  bool repair_swaps = true;
  bool hide_spikes = true;
  bool use_jig = true;      ///< false: the head is found by the stable markers alone
  bool remove_head = true;  ///< false: the head still moves
  bool fill_gaps = true;
  bool smooth = true;

  SwapOptions swaps;
  SpikeOptions spikes;
  HeadTrackingOptions head;
  GapFillOptions gaps;
  /// Captures at this rate or above: marker noise taken off by smoothMotion(). Below, lips move as fast as the noise
  /// does and closures would be lost (docs/theory/corpus_tools/head_motion.md).
  double smoothed_from_hz = 60;
};

/// The face of a take, cleaned, in the reference's coordinates.
struct CleanedFace {
  MotionClip motion;
  TakeReport report;
};

/// Swaps and spikes are repaired first: they would spoil the head's pose.
RawTake withoutOutliers(const RawTake& raw, const CleaningOptions& options, TakeReport& report);

/// Throws InputError, as trackHead() does, when the head cannot be found.
CleanedFace cleanFace(const RawTake& raw, const HeadReference& reference, const MarkerLayout& layout,
                      const CleaningOptions& options);

/// One clip by itself: in the face's own axes (unless the head is left to move); the layout's markers. `file` is for
/// messages.
CleanedFace cleanClip(const MotionClip& clip, const MarkerLayout& layout, const std::string& file,
                      const CleaningOptions& options = {});

}  // namespace mouthpiece
