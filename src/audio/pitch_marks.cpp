#include <algorithm>
#include <cmath>

#include "audio/sound_joiner.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

using Sample = std::ptrdiff_t;  // its place in the clip

constexpr Seconds kUnvoicedStep = 0.006;
constexpr double kSearch = 0.2;  // of a period

/// A voiced stretch of the clip, in samples.
struct Stretch {
  Sample first, last;
};

std::vector<Stretch> voicedStretches(const PitchTrack& pitch, double rate_hz, Sample samples) {
  std::vector<Stretch> stretches;
  const auto sampleOf = [&](std::size_t frame) {
    return std::min(samples - 1, std::lround(asReal(frame) * pitch.step * rate_hz));
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
      : clip_(clip), pitch_(pitch), samples_(std::ssize(clip.samples)) {}

  std::vector<Sample> follow(const Stretch& stretch) const {
    const Sample start = loudest(stretch);
    std::vector<Sample> marks;
    for (Sample at = start; (at = next(at, -1)) >= stretch.first;) marks.push_back(at);
    std::reverse(marks.begin(), marks.end());
    marks.push_back(start);
    for (Sample at = start; (at = next(at, +1)) <= stretch.last;) marks.push_back(at);
    return marks;
  }

 private:
  [[nodiscard]] Sample loudest(const Stretch& stretch) const {
    const auto louder = [](float a, float b) { return std::abs(a) < std::abs(b); };
    const auto begin = clip_.samples.begin();
    return std::max_element(begin + stretch.first, begin + stretch.last + 1, louder) - begin;
  }

  [[nodiscard]] double periodAt(Sample sample) const {
    const double rate = clip_.sample_rate_hz;
    const double hz = pitch_.hzAt(asReal(sample) / rate);
    return hz > 0 ? rate / hz : 0;
  }

  /// One period on, or -1 before and `samples_` after the stretch's pitch ends.
  [[nodiscard]] Sample next(Sample at, int direction) const {
    const Sample none = direction < 0 ? -1 : samples_;
    const double period = periodAt(at);
    if (period <= 0) return none;
    const Sample due = at + direction * std::lround(period);
    const auto slack = static_cast<Sample>(kSearch * period);
    const auto half = static_cast<Sample>(period / 2);
    if (due - slack - half < 0 || due + slack + half >= samples_ || at - half < 0 || at + half >= samples_) {
      return none;
    }
    Sample best = due;
    double most_like = -2;
    for (Sample candidate = due - slack; candidate <= due + slack; ++candidate) {
      const double like = likeness(at, candidate, half);
      if (like > most_like) {
        most_like = like;
        best = candidate;
      }
    }
    return best;
  }

  [[nodiscard]] double likeness(Sample a, Sample b, Sample half) const {
    double ab = 0, aa = 1e-12, bb = 1e-12;
    for (Sample i = -half; i <= half; ++i) {
      const double x = clip_.samples[unsignedIndex(a + i)];
      const double y = clip_.samples[unsignedIndex(b + i)];
      ab += x * y;
      aa += x * x;
      bb += y * y;
    }
    return ab / std::sqrt(aa * bb);
  }

  const AudioClip& clip_;
  const PitchTrack& pitch_;
  Sample samples_;
};

}  // namespace

std::size_t PitchMarks::nearest(double sample) const {
  const auto after = std::partition_point(marks.begin(), marks.end(),
                                          [sample](const Mark& mark) { return asReal(mark.sample) < sample; });
  if (after == marks.begin()) return 0;
  if (after == marks.end()) return marks.size() - 1;
  const bool later = asReal(after->sample) - sample < sample - asReal((after - 1)->sample);
  return unsignedIndex(after - marks.begin()) - (later ? 0 : 1);
}

PitchMarks findPitchMarks(const AudioClip& clip, const PitchTrack& pitch) {
  const Sample end = std::ssize(clip.samples);
  const auto step = std::max<Sample>(1, std::lround(kUnvoicedStep * clip.sample_rate_hz));
  PitchMarks found;
  Sample last = 0;
  found.marks.push_back({0, false});
  /// Even marks up to `until`, none closer than half a step to it.
  const auto fill = [&](Sample until) {
    while (until - last >= step + step / 2) found.marks.push_back({unsignedIndex(last += step), false});
  };
  if (end > 0) {
    const MarkFollower follower(clip, pitch);
    for (const Stretch& stretch : voicedStretches(pitch, clip.sample_rate_hz, end)) {
      for (const Sample mark : follower.follow(stretch)) {
        if (mark <= last) continue;
        if (!found.marks.back().voiced) fill(mark);
        found.marks.push_back({unsignedIndex(last = mark), true});
      }
      // What follows the stretch is filled as unvoiced sound.
      if (last + step < end) found.marks.push_back({unsignedIndex(last += step), false});
    }
    fill(end);
    if (last < end) found.marks.push_back({unsignedIndex(end), false});
  }
  return found;
}

}  // namespace mouthpiece
