#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/time.h"
#include "motion/lip_gauge.h"
#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// What cleaning did to the lips of a take: to the middles of both.
struct LipFidelity {
  static constexpr std::size_t kBands = 7;
  /// Edges in Hz of the bands that jerk is told in.
  static constexpr std::array<double, kBands + 1> kEdgesHz = {0, 3, 6, 10, 15, 25, 40, 60};
  using Bands = std::array<double, kBands>;  ///< m/s^3, rms of a coordinate

  /// Of each P, B and M: how much further apart the lips come at their closest than before; mm.
  std::vector<double> closure_changes_mm;
  Bands jerk_before{}, jerk_after{};
};

/// Closures that were not seen whole are left out; all zero without those markers, or with a frame of theirs missing.
LipFidelity lipFidelity(const MotionClip& before, const MotionClip& after, const SpeechLabels& labels,
                        const LipGauge& gauge);

/// A word that the aligner is not sure of.
struct DoubtfulWord {
  std::string text;
  TimeSpan span;
  double confidence = 0;
};

/// What was done to a take.
struct TakeReport {
  std::string name;
  std::string key;  ///< hash of all that it was made of; "" when nothing was kept
  std::size_t frames = 0;
  std::size_t jig_frames = 0, skin_frames = 0, bridged_frames = 0;  ///< see HeadTrack
  double scale = 1;
  double head_residual_mm = 0;
  std::size_t swaps = 0;            ///< pairs of markers given their names back
  std::size_t spikes = 0;           ///< excursions hidden
  std::size_t gap_samples = 0;      ///< marker samples not seen, or hidden as spikes
  std::size_t filled_samples = 0;   ///< of these, in gaps short enough to fill
  std::size_t missing_samples = 0;  ///< of these, still missing
  double noise_mm = 0;              ///< of a coordinate, the markers' median, before smoothing
  double smoothed_mm = 0;           ///< rms move of a coordinate by the smoothing; 0: not smoothed
  LipFidelity lips;                 ///< by the smoothing; nothing where it was not smoothed
  double aligned_mm = 0;            ///< largest move by alignTakesByPhones()
  bool labels_found = false;        ///< by forced alignment
  std::vector<DoubtfulWord> doubtful;
};

/// Where the build log of a corpus keeps them, in the order of its takes.
inline constexpr const char* kTakeReportsKey = "take_reports";
/// As the build log keeps them: a JSON list.
std::string reportsToJson(const std::vector<TakeReport>& reports);
/// What is no such list, or not whole, gives an empty one: the log of a corpus made elsewhere is no error.
std::vector<TakeReport> reportsFromJson(const std::string& text);

}  // namespace mouthpiece
