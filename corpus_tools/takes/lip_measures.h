#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "base/index.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// The lips of one take, synthesised against captured (docs/theory/corpus_tools/evaluation.md). Sums, so that takes add
/// up.
struct LipMeasures {
  std::size_t frames = 0;            ///< compared: lips seen in both
  double squared_error_mm2 = 0;      ///< over frames and lip markers, 3-D, the constant offset taken off
  std::size_t squared_errors = 0;    ///< frames x lip markers
  double largest_squared_mm2 = 0;    ///< sum over frames of the largest squared lip-marker error
  std::vector<double> opening_r;     ///< one a take: correlation of LipGauge::opening
  std::vector<double> width_r;       ///< one a take: of LipGauge::width
  std::vector<double> protrusion_r;  ///< one a take: of LipGauge::protrusion
  double protrusion_spread_mm = 0, captured_protrusion_spread_mm = 0;  ///< standard deviation, summed over takes
  std::size_t closures = 0;                                            ///< B P M closed in the capture
  std::size_t closures_kept = 0;                                       ///< of those, closed in the synthesis
  std::size_t contacts = 0;              ///< F V whose lower lip rises to the teeth in the capture
  std::size_t contacts_kept = 0;         ///< of those, in the synthesis
  std::size_t open_phones = 0;           ///< other phones, F and V aside, that stay open in the capture
  std::size_t false_closures = 0;        ///< of those, closed in the synthesis
  std::size_t vowels = 0;                ///< all of them
  std::size_t vowels_shut = 0;           ///< whose opening falls under the level of a closure, in the synthesis
  std::size_t captured_vowels_shut = 0;  ///< in the capture: next to B P M the labels' edges do
  double variance_mm2 = 0, captured_variance_mm2 = 0;  ///< of the lip coordinates, summed
  double jerk = 0, captured_jerk = 0;                  ///< squared third differences, summed

  /// NaN where there is nothing to divide by, as in all that follow.
  [[nodiscard]] static double ratio(double part, double whole);
  [[nodiscard]] double lipRms() const { return std::sqrt(ratio(squared_error_mm2, asReal(squared_errors))); }  ///< mm
  [[nodiscard]] double lve() const { return ratio(largest_squared_mm2, asReal(frames)); }                      ///< mm^2
  [[nodiscard]] double openingCorrelation() const;  ///< mean over takes
  [[nodiscard]] double widthCorrelation() const;
  [[nodiscard]] double protrusionCorrelation() const;
  /// How deep protrusion goes, over how deep it does in the capture.
  [[nodiscard]] double protrusionDepth() const { return ratio(protrusion_spread_mm, captured_protrusion_spread_mm); }
  [[nodiscard]] double closureRecall() const { return ratio(asReal(closures_kept), asReal(closures)); }
  [[nodiscard]] double contactRecall() const { return ratio(asReal(contacts_kept), asReal(contacts)); }
  [[nodiscard]] double falseClosureShare() const { return ratio(asReal(false_closures), asReal(open_phones)); }
  [[nodiscard]] double vowelsShutShare() const { return ratio(asReal(vowels_shut), asReal(vowels)); }
  [[nodiscard]] double capturedVowelsShutShare() const { return ratio(asReal(captured_vowels_shut), asReal(vowels)); }
  [[nodiscard]] double varianceRatio() const { return ratio(variance_mm2, captured_variance_mm2); }
  [[nodiscard]] double jerkRatio() const { return std::sqrt(ratio(jerk, captured_jerk)); }
  LipMeasures& operator+=(const LipMeasures& other);
};

/// Stretches of a take that are to be measured; empty: all of it.
using MeasuredStretches = std::vector<TimeSpan>;

/// Both clips on the clock of `labels`, with the columns of `layout`; `synthesised` has the capture's frame rate.
/// Of `stretches` frames and phones count that lie in one of them; what is closed, and the constant offset, is told by
/// the whole take. Throws InputError when the layout has not both lips and both corners.
LipMeasures measureLips(const MotionClip& captured, const MotionClip& synthesised, const SpeechLabels& labels,
                        const MarkerLayout& layout, const MeasuredStretches& stretches = {});

}  // namespace mouthpiece
