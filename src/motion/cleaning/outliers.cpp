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

/// A run that may be a spike, and how far all of it is off at least.
struct Candidate {
  Spike spike;
  double least_distance_mm;
};

/// Every run that starts at `first` and is off its way by more than the greatest acceleration explains.
void addCandidates(const MotionClip& clip, MarkerIndex marker, std::size_t first, const SpikeOptions& options,
                   std::vector<Candidate>& candidates) {
  const auto longest = static_cast<std::size_t>(std::max(1.0, std::floor(options.longest * clip.frame_rate_hz)));
  for (std::size_t length = 1; length <= longest && first + length < clip.frameCount(); ++length) {
    if (!clip.isSeenThroughout(marker, FrameIndex(first - 1), FrameIndex(first + length + 1))) return;
    const auto [nearest, farthest] = distancesFromWay(clip, marker, first, first + length);
    // Out and back in T under acceleration a: a (T/2)^2 / 2.
    const Seconds half = 0.5 * asReal(length + 1) / clip.frame_rate_hz;
    const double reachable = options.allowance_mm + 0.5 * options.acceleration_mm_s2 * half * half;
    if (farthest > reachable && nearest > 0.5 * reachable) {
      candidates.push_back({{marker, FrameIndex(first), FrameIndex(first + length), farthest}, nearest});
    }
  }
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
    std::vector<Candidate> candidates;
    for (std::size_t frame = 1; frame + 1 < clip.frameCount(); ++frame) {
      addCandidates(clip, MarkerIndex(marker), frame, options, candidates);
    }
    // Beside a spike the way itself is wrong: the runs that are off most as a whole come first and spoil the others.
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.least_distance_mm > b.least_distance_mm; });
    for (const auto& [spike, distance] : candidates) {
      if (!hidden.clip.isSeenThroughout(spike.marker, FrameIndex(spike.first.value - 1), FrameIndex(spike.last.value + 1))) continue;
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
