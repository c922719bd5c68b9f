#include "motion/cleaning/repairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/errors.h"

namespace mouthpiece {
namespace {

auto sampleOf(PositionMatrix& positions, std::size_t frame, std::size_t marker) {
  return positions.block<1, 3>(signedIndex(frame), signedIndex(3 * marker));
}

/// Where each marker was last seen.
class LastPlaces {
 public:
  LastPlaces(std::size_t markers, std::size_t longest_gap_frames)
      : places_(markers), longest_gap_frames_(longest_gap_frames) {}

  void see(std::size_t marker, std::size_t frame, const Eigen::Vector3d& place) {
    if (place.allFinite()) places_[marker] = Place{place, frame};
  }
  [[nodiscard]] std::optional<Eigen::Vector3d> at(std::size_t marker, std::size_t frame) const {
    const auto& place = places_[marker];
    if (!place || frame - place->frame > longest_gap_frames_) return std::nullopt;
    return place->position;
  }

 private:
  struct Place {
    Eigen::Vector3d position;
    std::size_t frame;
  };
  std::vector<std::optional<Place>> places_;
  std::size_t longest_gap_frames_;
};

/// The exchange of two markers that shortens their steps into `frame` most; nullopt when none is clear enough.
std::optional<std::pair<std::size_t, std::size_t>> bestExchange(const MotionClip& clip, std::size_t frame,
                                                                const LastPlaces& last, const SwapOptions& options) {
  std::optional<std::pair<std::size_t, std::size_t>> best;
  double best_gain = options.least_gain_mm;
  for (std::size_t a = 0; a < clip.markerCount(); ++a) {
    const Eigen::Vector3d now_a = clip.position(FrameIndex(frame), MarkerIndex(a));
    const auto was_a = last.at(a, frame);
    if (!now_a.allFinite() || !was_a) continue;
    const double step_a = (now_a - *was_a).norm();
    if (2.0 * step_a < best_gain) continue;
    for (std::size_t b = 0; b < clip.markerCount(); ++b) {
      const Eigen::Vector3d now_b = clip.position(FrameIndex(frame), MarkerIndex(b));
      const auto was_b = last.at(b, frame);
      if (a == b || !now_b.allFinite() || !was_b) continue;
      const double as_named = step_a + (now_b - *was_b).norm();
      const double exchanged = (now_a - *was_b).norm() + (now_b - *was_a).norm();
      const double gain = as_named - exchanged;
      if (gain <= best_gain || exchanged > (1.0 - options.least_share) * as_named) continue;
      best_gain = gain;
      best = std::minmax(a, b);
    }
  }
  return best;
}

void exchangeFrom(MotionClip& clip, std::size_t frame, std::size_t a, std::size_t b) {
  for (std::size_t f = frame; f < clip.frameCount(); ++f) {
    const Eigen::RowVector3d kept = sampleOf(clip.positions_mm, f, a);
    sampleOf(clip.positions_mm, f, a) = sampleOf(clip.positions_mm, f, b).eval();
    sampleOf(clip.positions_mm, f, b) = kept;
  }
}

/// How far the samples [first, last) lie from the straight way between the samples around them: nearest and farthest.
std::pair<double, double> distancesFromWay(const MotionClip& clip, MarkerIndex marker, std::size_t first,
                                           std::size_t last) {
  const Eigen::Vector3d before = clip.position(FrameIndex(first - 1), marker);
  const Eigen::Vector3d after = clip.position(FrameIndex(last), marker);
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
  for (std::size_t frame = first; frame < last; ++frame) {
    const double share = asReal(frame + 1 - first) / asReal(last + 1 - first);
    const Eigen::Vector3d way = (1.0 - share) * before + share * after;
    const double distance = (clip.position(FrameIndex(frame), marker) - way).norm();
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, distance);
  }
  return {nearest, farthest};
}

/// A run that may be a spike.
struct Candidate {
  Spike spike;
  double weight_mm;                    ///< how far all of it is off at least; the greatest counts first
  std::size_t from_frame, till_frame;  ///< [from, till): what is compared, the run with it
};

std::size_t longestRun(const MotionClip& clip, const SpikeOptions& options) {
  return static_cast<std::size_t>(std::max(1.0, std::floor(options.longest * clip.frame_rate_hz)));
}

/// Every run that starts at `first` and is off its way by more than the greatest acceleration explains.
void addCandidates(const MotionClip& clip, MarkerIndex marker, std::size_t first, const SpikeOptions& options,
                   std::vector<Candidate>& candidates) {
  for (std::size_t length = 1; length <= longestRun(clip, options) && first + length < clip.frameCount(); ++length) {
    if (!clip.isSeenThroughout(marker, FrameIndex(first - 1), FrameIndex(first + length + 1))) return;
    const auto [nearest, farthest] = distancesFromWay(clip, marker, first, first + length);
    // Out and back in T under acceleration a: a (T/2)^2 / 2.
    const Seconds half = 0.5 * asReal(length + 1) / clip.frame_rate_hz;
    const double reachable = options.allowance_mm + 0.5 * options.acceleration_mm_s2 * half * half;
    if (farthest > reachable && nearest > 0.5 * reachable) {
      candidates.push_back(
          {{marker, FrameIndex(first), FrameIndex(first + length), farthest}, nearest, first - 1, first + length + 1});
    }
  }
}

/// Runs that end a stretch of seen frames at `edge`, on its later side (`step` 1) or earlier one (-1): off the straight
/// way on from the two samples before them, which with a third go on evenly themselves. Without these the good
/// neighbour of a wild sample beside a gap would be what is off its way.
void addCandidatesAtEdge(const MotionClip& clip, MarkerIndex marker, std::size_t edge, std::ptrdiff_t step,
                         const SpikeOptions& options, std::vector<Candidate>& candidates) {
  // A wild sample at the edge puts the run before it off by half as much at most; a whole spike before a good sample
  // at the edge puts that off by as much as itself.
  constexpr double kAgainstRunsWithin = 0.75;
  constexpr std::size_t kBefore = 3;
  const double square = options.acceleration_mm_s2 / (clip.frame_rate_hz * clip.frame_rate_hz);
  const auto frameOf = [&](std::size_t steps_back) { return signedIndex(edge) - step * signedIndex(steps_back); };
  const auto at = [&](std::size_t steps_back) {
    return clip.position(FrameIndex(unsignedIndex(frameOf(steps_back))), marker);
  };
  for (std::size_t length = 1; length <= longestRun(clip, options); ++length) {
    const auto [from, last] = std::minmax({signedIndex(edge), frameOf(length + kBefore - 1)});
    const std::ptrdiff_t till = last + 1;
    if (from < 0 || till > signedIndex(clip.frameCount()) ||
        !clip.isSeenThroughout(marker, FrameIndex(unsignedIndex(from)), FrameIndex(unsignedIndex(till))))
      return;
    const Eigen::Vector3d before = at(length), pace = before - at(length + 1);
    if ((pace - (at(length + 1) - at(length + 2))).norm() > 2 * options.allowance_mm + square) continue;
    double nearest = std::numeric_limits<double>::infinity(), farthest = 0, least_share = nearest, most_share = 0;
    for (std::size_t i = 1; i <= length; ++i) {
      const double steps = asReal(i), distance = (at(length - i) - before - steps * pace).norm();
      // After t under acceleration a from a pace that is the mean over one frame: a t (t + 1 frame) / 2. The noise of
      // both samples before grows with the way.
      const double reachable = (1 + steps) * (options.allowance_mm + 0.5 * square * steps);
      nearest = std::min(nearest, distance);
      farthest = std::max(farthest, distance);
      least_share = std::min(least_share, distance / reachable);
      most_share = std::max(most_share, distance / reachable);
    }
    if (most_share <= 1 || least_share <= 0.5) continue;
    const auto [first_of_run, last_of_run] = std::minmax({signedIndex(edge), frameOf(length - 1)});
    candidates.push_back(
        {{marker, FrameIndex(unsignedIndex(first_of_run)), FrameIndex(unsignedIndex(last_of_run + 1)), farthest},
         kAgainstRunsWithin * nearest,
         unsignedIndex(from),
         unsignedIndex(till)});
  }
}

/// All runs of a marker that may be spikes; hidden ones compete.
std::vector<Candidate> candidatesOf(const MotionClip& clip, MarkerIndex marker, const SpikeOptions& options) {
  std::vector<Candidate> candidates;
  const auto isSeen = [&](std::size_t frame) {
    return clip.isSeenThroughout(marker, FrameIndex(frame), FrameIndex(frame + 1));
  };
  for (std::size_t frame = 0; frame < clip.frameCount(); ++frame) {
    if (!isSeen(frame)) continue;
    const bool is_first = frame == 0 || !isSeen(frame - 1),
               is_last = frame + 1 == clip.frameCount() || !isSeen(frame + 1);
    if (!is_first && !is_last) addCandidates(clip, marker, frame, options, candidates);
    if (is_first) addCandidatesAtEdge(clip, marker, frame, -1, options, candidates);
    if (is_last) addCandidatesAtEdge(clip, marker, frame, 1, options, candidates);
  }
  // Beside a spike the way itself is wrong: the runs that are off most as a whole come first and spoil the others.
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.weight_mm > b.weight_mm; });
  return candidates;
}

}  // namespace

RepairedSwaps repairSwaps(const MotionClip& clip, const SwapOptions& options) {
  RepairedSwaps repaired{clip, {}};
  LastPlaces last(clip.markerCount(), static_cast<std::size_t>(options.longest_gap * clip.frame_rate_hz) + 1);
  for (std::size_t frame = 0; frame < clip.frameCount(); ++frame) {
    // Each exchange shortens the steps, so this ends; a marker takes part once a frame at most in practice.
    for (std::size_t round = 0; round < clip.markerCount(); ++round) {
      const auto exchange = bestExchange(repaired.clip, frame, last, options);
      if (!exchange) break;
      const auto [a, b] = *exchange;
      exchangeFrom(repaired.clip, frame, a, b);
      repaired.swaps.push_back({MarkerIndex(a), MarkerIndex(b), FrameIndex(frame)});
    }
    for (std::size_t marker = 0; marker < clip.markerCount(); ++marker) {
      last.see(marker, frame, repaired.clip.position(FrameIndex(frame), MarkerIndex(marker)));
    }
  }
  return repaired;
}

HiddenSpikes hideSpikes(const MotionClip& clip, const SpikeOptions& options) {
  MOUTHPIECE_EXPECT(clip.frame_rate_hz > 0);
  HiddenSpikes hidden{clip, {}};
  for (std::size_t marker = 0; marker < clip.markerCount(); ++marker) {
    for (const Candidate& candidate : candidatesOf(clip, MarkerIndex(marker), options)) {
      const Spike& spike = candidate.spike;
      if (!hidden.clip.isSeenThroughout(spike.marker, FrameIndex(candidate.from_frame),
                                        FrameIndex(candidate.till_frame)))
        continue;
      for (std::size_t frame = spike.first.value; frame < spike.last.value; ++frame) {
        sampleOf(hidden.clip.positions_mm, frame, marker).setConstant(std::numeric_limits<double>::quiet_NaN());
      }
      hidden.spikes.push_back(spike);
    }
  }
  std::stable_sort(hidden.spikes.begin(), hidden.spikes.end(),
                   [](const Spike& a, const Spike& b) { return a.first.value < b.first.value; });
  return hidden;
}

}  // namespace mouthpiece
