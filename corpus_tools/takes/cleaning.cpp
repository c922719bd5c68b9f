#include "corpus_tools/takes/cleaning.h"

#include <cmath>

#include "corpus_tools/takes/pose_fit.h"
#include "corpus_tools/takes/take_poses.h"
#include "motion/cleaning/repairs.h"

namespace mouthpiece {
namespace {

std::size_t missingSamples(const MotionClip& clip) {
  std::size_t missing = 0;
  for (Eigen::Index column = 0; column < clip.positions_mm.cols(); column += 3) {
    missing += unsignedIndex((!clip.positions_mm.col(column).array().isFinite()).count());
  }
  return missing;
}

/// Face and jig side by side: a jig marker may take the name of one on the brow.
MotionClip joined(const MotionClip& face, const MotionClip& jig) {
  MotionClip both = face;
  both.marker_names.insert(both.marker_names.end(), jig.marker_names.begin(), jig.marker_names.end());
  both.positions_mm.resize(face.positions_mm.rows(), face.positions_mm.cols() + jig.positions_mm.cols());
  both.positions_mm << face.positions_mm, jig.positions_mm;
  return both;
}

void findHead(CleanedFace& cleaned, const RawTake& raw, const HeadReference& reference, const MarkerLayout& layout,
              const CleaningOptions& options) {
  const HeadTrack track = trackHead(raw, reference, layout, options.head);
  cleaned.motion = withoutHeadMotion(raw.face, track);
  cleaned.report.jig_frames = track.jig_frames;
  cleaned.report.skin_frames = track.skin_frames;
  cleaned.report.bridged_frames = track.bridged_frames;
  cleaned.report.scale = track.scale;
  cleaned.report.head_residual_mm = track.residual_rms_mm;
}

}  // namespace

RawTake withoutOutliers(const RawTake& raw, const CleaningOptions& options, TakeReport& report) {
  RawTake repaired = raw;
  if (!options.use_jig) repaired.jig.positions_mm.setConstant(std::nan(""));
  if (!options.repair_swaps && !options.hide_spikes) return repaired;
  MotionClip both = joined(repaired.face, repaired.jig);
  if (options.repair_swaps) {
    RepairedSwaps swaps = repairSwaps(both, options.swaps);
    report.swaps = swaps.swaps.size();
    both = std::move(swaps.clip);
  }
  if (options.hide_spikes) {
    HiddenSpikes spikes = hideSpikes(both, options.spikes);
    report.spikes = spikes.spikes.size();
    both = std::move(spikes.clip);
  }
  repaired.face.positions_mm = both.positions_mm.leftCols(raw.face.positions_mm.cols());
  repaired.jig.positions_mm = both.positions_mm.rightCols(raw.jig.positions_mm.cols());
  return repaired;
}

CleanedFace cleanFace(const RawTake& raw, const HeadReference& reference, const MarkerLayout& layout,
                      const CleaningOptions& options) {
  CleanedFace cleaned;
  const RawTake repaired = withoutOutliers(raw, options, cleaned.report);
  cleaned.report.name = raw.name;
  cleaned.report.frames = raw.face.frameCount();
  cleaned.motion = repaired.face;
  if (options.remove_head) findHead(cleaned, repaired, reference, layout, options);
  cleaned.report.gap_samples = missingSamples(cleaned.motion);
  cleaned.report.noise_mm = estimateNoise(cleaned.motion);
  if (options.fill_gaps) cleaned.motion = fillShortGaps(cleaned.motion, options.gaps).clip;
  if (options.smooth && raw.face.frame_rate_hz >= options.smoothed_from_hz) {
    SmoothedMotion smoothed = smoothMotion(cleaned.motion);
    cleaned.report.lips = lipFidelity(cleaned.motion, smoothed.clip, raw.labels, LipGauge(layout));
    cleaned.motion = std::move(smoothed.clip);
    cleaned.report.smoothed_mm = smoothed.rms_change_mm;
  }
  cleaned.report.missing_samples = missingSamples(cleaned.motion);
  cleaned.report.filled_samples = cleaned.report.gap_samples - cleaned.report.missing_samples;
  return cleaned;
}

CleanedFace cleanClip(const MotionClip& clip, const MarkerLayout& layout, const std::string& file,
                      const CleaningOptions& options) {
  FaceAndJig split = splitMarkers(clip, layout, file);
  const RawTake take{file, "", {}, std::move(split.face), std::move(split.jig), {}, false, {}};
  if (!options.remove_head) return cleanFace(take, {}, layout, options);
  TakeReport ignored;
  const HeadReference reference =
      estimateHeadReference({withoutOutliers(take, options, ignored)}, layout, options.head);
  CleanedFace cleaned = cleanFace(take, reference, layout, options);
  const NeutralPose neutral = neutralPose({{file, "", {}, cleaned.motion, {}}}, layout);
  transform(cleaned.motion, faceFromHead(neutral.pose_mm, layout));
  return cleaned;
}

}  // namespace mouthpiece
