#include <algorithm>
#include <cmath>
#include <limits>

#include "base/statistics.h"
#include "vocal/viseme_curves.h"
#include "vocal/viseme_events.h"

namespace mouthpiece {
namespace {

/// Lowest and highest pitch of the line in semitones, and the pitch at single times.
class LinePitch {
 public:
  explicit LinePitch(const AudioTags& tags) : tags_(tags) {
    for (const Note& note : tags.notes) include(note.hz);
    if (!tags.notes.empty()) return;
    for (const PitchSample& sample : tags.f0) {
      if (sample.voiced) include(sample.hz);
    }
  }
  [[nodiscard]] bool isKnown() const { return low_ <= high_; }
  [[nodiscard]] double height(double hz) const {
    const double semitones = 12 * std::log2(hz);
    const double normalised = high_ > low_ ? std::clamp((semitones - low_) / (high_ - low_), 0.0, 1.0) : 0.5;
    return kLowestLarynx + (1 - kLowestLarynx) * normalised;
  }
  /// The median of what is voiced in `span`; 0 where nothing is.
  [[nodiscard]] double medianHz(const TimeSpan& span) const {
    std::vector<double> hz;
    const auto first = std::lower_bound(tags_.f0.begin(), tags_.f0.end(), span.start,
                                        [](const PitchSample& sample, Seconds time) { return sample.time < time; });
    for (auto sample = first; sample != tags_.f0.end() && sample->time < span.end; ++sample) {
      if (sample->voiced) hz.push_back(sample->hz);
    }
    return median(std::move(hz), 0);
  }

 private:
  void include(double hz) {
    if (!(hz > 0)) return;
    low_ = std::min(low_, 12 * std::log2(hz));
    high_ = std::max(high_, 12 * std::log2(hz));
  }
  const AudioTags& tags_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

/// The vowel's event, its keys at the larynx' heights; no keys where it has no pitch.
VisemeEvent larynxEvent(VisemeEvent vowel, const AudioTags& tags, const LinePitch& pitch) {
  std::vector<EventKey> keys;
  for (const Note& note : tags.notes) {
    const TimeSpan part{std::max(note.span.start, vowel.span.start), std::min(note.span.end, vowel.span.end)};
    if (part.duration() <= 0) continue;
    keys.push_back({part.start, pitch.height(note.hz)});
    keys.push_back({part.end, pitch.height(note.hz)});
  }
  if (const double hz = pitch.medianHz(vowel.span); keys.empty() && hz > 0) {
    for (const EventKey& key : vowel.inner) keys.push_back({key.time, pitch.height(hz)});
  }
  vowel.inner = std::move(keys);
  vowel.viseme = Viseme::kUh;  // one curve for all vowels
  return vowel;
}

}  // namespace

CurveSet larynxCurves(const SpeechLabels& labels, const AudioTags& tags) {
  const LinePitch pitch(tags);
  if (!pitch.isKnown()) return {};
  std::vector<VisemeEvent> events;
  for (const VisemeEvent& event : fourKeyEvents(labels)) {
    if (!event.is_vowel) continue;
    VisemeEvent raised = larynxEvent(event, tags, pitch);
    if (!raised.inner.empty()) events.push_back(std::move(raised));
  }
  // The larynx need not come down between vowels: conflicts are resolved as in song (VOCAL 4.2, pass 3).
  CurveSet curves = curvesFromEvents(events, kSongCoarticulation);
  for (AnimationCurve& curve : curves) curve.name = "larynx";
  return curves;
}

}  // namespace mouthpiece
