#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "base/errors.h"
#include "base/index.h"
#include "motion/resample.h"

namespace mouthpiece {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Frames [first, last) that queries in `targets` need: those around them, and as many more as a window looks at.
struct FrameRange {
  std::size_t first = 0;
  std::size_t last = 0;
};

FrameRange framesNear(const MotionClip& clip, TimeSpan source_span, const ResampleOptions& options) {
  const auto count = asReal(clip.frameCount());
  const auto reach = asReal(options.window_samples);
  const double first = std::floor(source_span.start * clip.frame_rate_hz) - reach;
  const double last = std::ceil(source_span.end * clip.frame_rate_hz) + reach + 1.0;
  // A query beyond the clip still needs its end frame.
  return {static_cast<std::size_t>(std::clamp(first, 0.0, count - 1.0)),
          static_cast<std::size_t>(std::clamp(last, 1.0, count))};
}

/// Markers that were seen in the same frames: they share one resampler.
using SeenFrames = std::vector<bool>;

std::map<SeenFrames, std::vector<Eigen::Index>> markersBySeenFrames(const Eigen::Ref<const PositionMatrix>& positions) {
  std::map<SeenFrames, std::vector<Eigen::Index>> groups;
  SeenFrames seen(unsignedIndex(positions.rows()));
  for (Eigen::Index marker = 0; marker < positions.cols() / 3; ++marker) {
    for (Eigen::Index frame = 0; frame < positions.rows(); ++frame) {
      seen[unsignedIndex(frame)] = positions.block<1, 3>(frame, 3 * marker).allFinite();
    }
    groups[seen].push_back(marker);
  }
  return groups;
}

/// Runs of frames in which a marker was seen throughout.
std::vector<FrameRange> runsOf(const SeenFrames& seen) {
  std::vector<FrameRange> runs;
  for (std::size_t frame = 0; frame < seen.size(); ++frame) {
    if (!seen[frame]) continue;
    if (runs.empty() || runs.back().last != frame) runs.push_back({frame, frame});
    runs.back().last = frame + 1;
  }
  return runs;
}

/// The queries that a run of frames answers: those between its first and last frame; a run that reaches the first or
/// last frame of all also answers what lies beyond.
std::span<const Seconds> queriesWithin(const FrameRange& run, std::span<const Seconds> times,
                                       std::span<const Seconds> queries) {
  const auto first =
      run.first == 0 ? queries.begin() : std::lower_bound(queries.begin(), queries.end(), times[run.first]);
  const auto last =
      run.last == times.size() ? queries.end() : std::upper_bound(first, queries.end(), times[run.last - 1]);
  return {first, last};
}

/// Interpolates markers with the same gaps, each run of frames by itself.
void resampleGroup(const Eigen::Ref<const PositionMatrix>& positions, std::span<const Seconds> times,
                   std::span<const Seconds> queries, const SeenFrames& seen, const std::vector<Eigen::Index>& markers,
                   const ResampleOptions& options, PositionMatrix& result) {
  for (const FrameRange& run : runsOf(seen)) {
    const std::span<const Seconds> own = queriesWithin(run, times, queries);
    if (own.empty()) continue;
    const auto frame_count = signedIndex(run.last - run.first);
    PositionMatrix values(frame_count, signedIndex(3 * markers.size()));
    for (std::size_t m = 0; m < markers.size(); ++m) {
      values.middleCols<3>(signedIndex(3 * m)) =
          positions.block(signedIndex(run.first), 3 * markers[m], frame_count, 3);
    }
    const MotionResampler resampler(times.subspan(run.first, run.last - run.first), own, options);
    const PositionMatrix resampled = resampler.apply(values);
    const Eigen::Index first_query = own.data() - queries.data();
    for (std::size_t m = 0; m < markers.size(); ++m) {
      result.block(first_query, 3 * markers[m], resampled.rows(), 3) = resampled.middleCols<3>(signedIndex(3 * m));
    }
  }
}

}  // namespace

PositionMatrix resampleWarped(const MotionClip& clip, const TimeWarp& warp, std::span<const Seconds> target_times,
                              const ResampleOptions& options) {
  MOUTHPIECE_EXPECT(clip.frameCount() > 0 && clip.frame_rate_hz > 0.0);
  if (target_times.empty()) return PositionMatrix(0, clip.positions_mm.cols());
  const TimeSpan source_span{warp.sourceFromTarget(target_times.front()), warp.sourceFromTarget(target_times.back())};
  const FrameRange range = framesNear(clip, source_span, options);
  std::vector<Seconds> times;
  for (std::size_t frame = range.first; frame < range.last; ++frame) {
    times.push_back(warp.targetFromSource(clip.timeOf(FrameIndex(frame))));
  }
  const auto positions = clip.positions_mm.middleRows(signedIndex(range.first), signedIndex(times.size()));
  if (positions.allFinite()) return MotionResampler(times, target_times, options).apply(positions);

  PositionMatrix result = PositionMatrix::Constant(signedIndex(target_times.size()), clip.positions_mm.cols(), kNan);
  for (const auto& [seen, markers] : markersBySeenFrames(positions)) {
    resampleGroup(positions, times, target_times, seen, markers, options, result);
  }
  return result;
}

MotionClip resampleClip(const MotionClip& clip, double frame_rate_hz, const ResampleOptions& options) {
  MOUTHPIECE_EXPECT(frame_rate_hz > 0.0 && clip.frameCount() > 0);
  const auto frame_count = static_cast<std::size_t>(std::max(1.0, std::round(clip.duration() * frame_rate_hz)));
  MotionClip result{frame_rate_hz, clip.marker_names, {}};
  result.positions_mm =
      resampleWarped(clip, TimeWarp({{0.0, 0.0}}), frameTimes(0, frame_count, frame_rate_hz), options);
  return result;
}

std::vector<Seconds> frameTimes(std::size_t first_frame, std::size_t frame_count, double frame_rate_hz) {
  std::vector<Seconds> times(frame_count);
  for (std::size_t i = 0; i < frame_count; ++i) times[i] = asReal(first_frame + i) / frame_rate_hz;
  return times;
}

}  // namespace mouthpiece
