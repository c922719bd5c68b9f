#pragma once

#include <span>
#include <vector>

#include "motion/motion_clip.h"
#include "motion/time_warp.h"

namespace mouthpiece {

/// The defaults are measured on real speech: docs/theory/motion/resampling.md.
struct ResampleOptions {
  double shape = 1.25;              ///< c of eq. (1), in samples
  std::size_t window_samples = 32;  ///< samples that share one small system
  std::size_t margin_samples = 8;   ///< at an inner end of a window, where its interpolant is not used
  std::size_t overlap_samples = 4;  ///< spacings over which two windows are blended
};

/// Exact interpolation of samples at uneven times by inverse multiquadrics plus a linear polynomial (EDGE eq. 1). The
/// radial distance is taken along the samples: x = S(time), the smooth rising curve with S(time of sample i) = i, so
/// that squeezed and stretched phones are interpolated equally well. Everything that depends on the times alone is
/// worked out once; the values then cost one matrix product per window. A query outside the samples gives the nearest
/// end sample. Immutable, safe to share between threads.
class MotionResampler {
 public:
  /// `sample_times` rise strictly, `query_times` do not fall, both finite (else InternalError); at least one sample.
  /// O(samples + queries): overlapping windows, blended by a partition of unity.
  MotionResampler(std::span<const Seconds> sample_times, std::span<const Seconds> query_times,
                  const ResampleOptions& options = {});

  /// samples x channels -> queries x channels. A NaN spoils the window that it is in: see resampleWarped.
  [[nodiscard]] PositionMatrix apply(const Eigen::Ref<const PositionMatrix>& values) const;

 private:
  /// Queries [first_query, ...) as weighted sums of samples [first_sample, ...).
  struct Block {
    Eigen::Index first_query = 0;
    Eigen::Index first_sample = 0;
    PositionMatrix weights;  ///< queries x samples
  };
  Eigen::Index sample_count_ = 0;
  Eigen::Index query_count_ = 0;
  std::vector<Block> blocks_;
};

/// The same interpolant from one dense system over all samples: O(samples^3), the reference for tests and benchmarks.
PositionMatrix resampleDense(std::span<const Seconds> sample_times, const Eigen::Ref<const PositionMatrix>& values,
                             std::span<const Seconds> query_times, const ResampleOptions& options = {});

/// The clip seen through `warp` at `target_times` (not falling): each frame is moved to its warped time and the motion
/// interpolated there (EDGE 5.1.2). Only frames near the queries are touched. A marker is NaN where a query lies
/// between frames of which one did not see it; each run of frames between gaps is interpolated by itself.
PositionMatrix resampleWarped(const MotionClip& clip, const TimeWarp& warp, std::span<const Seconds> target_times,
                              const ResampleOptions& options = {});

/// The whole clip at another frame rate, over the same duration.
MotionClip resampleClip(const MotionClip& clip, double frame_rate_hz, const ResampleOptions& options = {});

/// k / frame_rate_hz for all k from `first_frame` on: `frame_count` times.
std::vector<Seconds> frameTimes(std::size_t first_frame, std::size_t frame_count, double frame_rate_hz);

}  // namespace mouthpiece
