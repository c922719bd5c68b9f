#include "audio/pitch_marks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace mouthpiece {
namespace {

using Index = std::int64_t;

constexpr Seconds kUnvoicedStep = 0.006;
constexpr double kSearch = 0.2;  // of a period

/// A voiced stretch of the clip, in samples.
struct Stretch {
  Index first, last;
};

std::vector<Stretch> voicedStretches(const PitchTrack& pitch, double rate_hz, Index samples) {
  std::vector<Stretch> stretches;
  const auto sampleOf = [&](std::size_t frame) {
    return std::min(samples - 1, static_cast<Index>(std::lround(static_cast<double>(frame) * pitch.step * rate_hz)));
  };
  for (std::size_t i = 0; i < pitch.frames.size(); ++i) {
    if (pitch.frames[i].hz <= 0) continue;
    const std::size_t first = i;
    while (i + 1 < pitch.frames.size() && pitch.frames[i + 1].hz > 0) ++i;
    stretches.push_back({sampleOf(first), sampleOf(i)});
  }
  return stretches;
}

class MarkFollower {
 public:
  MarkFollower(const AudioClip& clip, const PitchTrack& pitch)
      : clip_(clip), pitch_(pitch), samples_(static_cast<Index>(clip.samples.size())) {}

  std::vector<Index> follow(const Stretch& stretch) const {
    const Index start = loudest(stretch);
    std::vector<Index> marks;
    for (Index at = start; (at = next(at, -1)) >= stretch.first;) marks.push_back(at);
    std::reverse(marks.begin(), marks.end());
    marks.push_back(start);
    for (Index at = start; (at = next(at, +1)) <= stretch.last;) marks.push_back(at);
    return marks;
  }

 private:
  [[nodiscard]] Index loudest(const Stretch& stretch) const {
    const auto louder = [](float a, float b) { return std::abs(a) < std::abs(b); };
    const auto begin = clip_.samples.begin();
    return std::max_element(begin + stretch.first, begin + stretch.last + 1, louder) - begin;
  }

  [[nodiscard]] double periodAt(Index sample) const {
    const double rate = clip_.sample_rate_hz;
    const double hz = pitch_.hzAt(static_cast<double>(sample) / rate);
    return hz > 0 ? rate / hz : 0;
  }

  /// One period on, or -1 before and `samples_` after the stretch's pitch ends.
  [[nodiscard]] Index next(Index at, int direction) const {
    const Index none = direction < 0 ? -1 : samples_;
    const double period = periodAt(at);
    if (period <= 0) return none;
    const Index due = at + direction * static_cast<Index>(std::lround(period));
    const auto slack = static_cast<Index>(kSearch * period);
    const auto half = static_cast<Index>(period / 2);
    if (due - slack - half < 0 || due + slack + half >= samples_ || at - half < 0 || at + half >= samples_) {
      return none;
    }
    Index best = due;
    double most_like = -2;
    for (Index candidate = due - slack; candidate <= due + slack; ++candidate) {
      const double like = likeness(at, candidate, half);
      if (like > most_like) {
        most_like = like;
        best = candidate;
      }
    }
    return best;
  }

  [[nodiscard]] double likeness(Index a, Index b, Index half) const {
    double ab = 0, aa = 1e-12, bb = 1e-12;
    for (Index i = -half; i <= half; ++i) {
      const double x = clip_.samples[static_cast<std::size_t>(a + i)];
      const double y = clip_.samples[static_cast<std::size_t>(b + i)];
      ab += x * y;
      aa += x * x;
      bb += y * y;
    }
    return ab / std::sqrt(aa * bb);
  }

  const AudioClip& clip_;
  const PitchTrack& pitch_;
  Index samples_;
};

}  // namespace

std::size_t PitchMarks::nearest(double sample) const {
  const auto after = std::partition_point(
      marks.begin(), marks.end(), [sample](const Mark& mark) { return static_cast<double>(mark.sample) < sample; });
  if (after == marks.begin()) return 0;
  if (after == marks.end()) return marks.size() - 1;
  const bool later = static_cast<double>(after->sample) - sample < sample - static_cast<double>((after - 1)->sample);
  return static_cast<std::size_t>(after - marks.begin()) - (later ? 0 : 1);
}

PitchMarks findPitchMarks(const AudioClip& clip, const PitchTrack& pitch) {
  const auto end = static_cast<Index>(clip.samples.size());
  const auto step = std::max<Index>(1, std::lround(kUnvoicedStep * clip.sample_rate_hz));
  PitchMarks found;
  Index last = 0;
  found.marks.push_back({0, false});
  /// Even marks up to `until`, none closer than half a step to it.
  const auto fill = [&](Index until) {
    while (until - last >= step + step / 2) found.marks.push_back({static_cast<std::size_t>(last += step), false});
  };
  if (end > 0) {
    const MarkFollower follower(clip, pitch);
    for (const Stretch& stretch : voicedStretches(pitch, clip.sample_rate_hz, end)) {
      for (const Index mark : follower.follow(stretch)) {
        if (mark <= last) continue;
        if (!found.marks.back().voiced) fill(mark);
        found.marks.push_back({static_cast<std::size_t>(last = mark), true});
      }
      // What follows the stretch is filled as unvoiced sound.
      if (last + step < end) found.marks.push_back({static_cast<std::size_t>(last += step), false});
    }
    fill(end);
    if (last < end) found.marks.push_back({static_cast<std::size_t>(end), false});
  }
  return found;
}

}  // namespace mouthpiece
