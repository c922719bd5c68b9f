#include <algorithm>
#include <cmath>
#include <optional>

#include "vocal/viseme_events.h"

namespace mouthpiece {
namespace {

using namespace vocal_numbers;

/// Lowest and highest note of the line.
struct PitchRange {
  double low = 0, high = 0;
  /// alpha_s of the paper; 0.8, the middle, where all notes are alike.
  [[nodiscard]] double startAmplitude(double hz) const {
    const double normalised = high > low ? std::clamp((hz - low) / (high - low), 0.0, 1.0) : 0.5;
    return kNoteRange * normalised + kNoteFloor;
  }
};

PitchRange pitchRangeOf(const std::vector<Note>& notes) {
  PitchRange range{notes.front().hz, notes.front().hz};
  for (const Note& note : notes) {
    range.low = std::min(range.low, note.hz);
    range.high = std::max(range.high, note.hz);
  }
  return range;
}

/// The parts of notes that lie in `span`.
std::vector<Note> notesIn(const std::vector<Note>& notes, const TimeSpan& span) {
  constexpr Seconds kShortest = 0.020;
  std::vector<Note> found;
  for (const Note& note : notes) {
    const TimeSpan part{std::max(note.span.start, span.start), std::min(note.span.end, span.end)};
    if (part.duration() >= kShortest) found.push_back({part, note.hz, note.vibrato});
  }
  return found;
}

/// One note: apex when it is reached, then as a speech vowel.
std::vector<EventKey> syllabicKeys(const VisemeEvent& event, const Note& note, const PitchRange& range) {
  const double amplitude = range.startAmplitude(note.hz);
  const Seconds hold_end = std::max(event.inner.back().time, note.span.start);
  return {{note.span.start, amplitude}, {hold_end, amplitude}};
}

/// Several notes: up at the start of each, mildly down to its end, a dip between.
std::vector<EventKey> melismaticKeys(const std::vector<Note>& notes, const PitchRange& range) {
  std::vector<EventKey> keys;
  for (const Note& note : notes) {
    const double start = range.startAmplitude(note.hz);
    if (!keys.empty()) {
      keys.push_back({0.5 * (keys.back().time + note.span.start), kBetweenNotes * std::min(keys.back().value, start)});
    }
    keys.push_back({note.span.start, start});
    keys.push_back({note.span.end, kNoteDecay * start});
  }
  return keys;
}

double valueAt(const std::vector<EventKey>& keys, Seconds time) {
  if (time <= keys.front().time) return keys.front().value;
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (time > keys[i].time) continue;
    const double u = (time - keys[i - 1].time) / std::max(keys[i].time - keys[i - 1].time, 1e-9);
    return std::lerp(keys[i - 1].value, keys[i].value, u);
  }
  return keys.back().value;
}

/// Keys half a period apart, alternating about the amplitude that is there, by a share that grows to 0.6. A viseme
/// cannot be reached by more than wholly.
std::vector<EventKey> withVibrato(const std::vector<EventKey>& steady, const TimeSpan& vibrato) {
  constexpr Seconds kHalfPeriod = 0.5 / kVibratoRateHz;
  std::vector<EventKey> waves;
  double sign = 1;
  for (Seconds time = vibrato.start + kHalfPeriod; time < vibrato.end; time += kHalfPeriod, sign = -sign) {
    const double grown = (time - vibrato.start) / vibrato.duration();
    waves.push_back({time, std::min(1.0, valueAt(steady, time) * (1 + sign * kVibratoDepth * grown))});
  }
  if (waves.empty()) return steady;
  std::vector<EventKey> keys = steady;
  std::erase_if(keys, [&](const EventKey& key) { return vibrato.start < key.time && key.time < vibrato.end; });
  const auto insert = [&keys](const EventKey& key) {
    const auto place = std::lower_bound(keys.begin(), keys.end(), key.time,
                                        [](const EventKey& other, Seconds time) { return other.time < time; });
    if (place == keys.end() || place->time > key.time) keys.insert(place, key);
  };
  insert({vibrato.start, valueAt(steady, vibrato.start)});
  for (const EventKey& wave : waves) insert(wave);
  insert({vibrato.end, valueAt(steady, vibrato.end)});
  return keys;
}

}  // namespace

std::vector<VisemeEvent> withSungInternalKeys(std::vector<VisemeEvent> events, const AudioTags& tags) {
  for (VisemeEvent& event : events) {
    if (!event.is_vowel) continue;
    const std::vector<Note> notes = notesIn(tags.notes, event.span);
    if (!notes.empty()) {
      const PitchRange range = pitchRangeOf(tags.notes);
      event.inner = notes.size() == 1 ? syllabicKeys(event, notes[0], range) : melismaticKeys(notes, range);
      event.has_sung_keys = true;
    }
    for (const VibratoSpan& vibrato : tags.vibrato) {
      const TimeSpan part{std::max(vibrato.span.start, event.span.start), std::min(vibrato.span.end, event.span.end)};
      if (!(part.duration() > 0)) continue;
      event.inner = withVibrato(event.inner, part);
      event.has_sung_keys = true;
    }
  }
  return events;
}

std::vector<VisemeEvent> withSungBoundaryKeys(std::vector<VisemeEvent> events) {
  std::optional<std::size_t> before;  // the last vowel
  for (std::size_t i = 0; i < events.size(); ++i) {
    VisemeEvent& second = events[i];
    if (!second.is_vowel) continue;
    if (before && second.span.start - events[*before].span.end < kBlendedVowels) {
      VisemeEvent& first = events[*before];
      const Seconds held = first.inner.back().time;
      first.end = std::max(first.end, second.inner.front().time);
      second.onset = std::min(second.onset, held);
      for (std::size_t between = *before + 1; between < i; ++between) {
        // Lips that must close or touch the teeth do so in song too.
        if (!isLabial(events[between].viseme)) events[between].lips *= kConsonantInLegato;
        events[between].jaw *= kConsonantInLegato;
      }
    }
    before = i;
  }
  return events;
}

}  // namespace mouthpiece
