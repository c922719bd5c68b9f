#pragma once

#include <vector>

#include "audio/audio_tags.h"
#include "phonetics/labels/speech_labels.h"
#include "vocal/animation_curve.h"

namespace mouthpiece {

/// An internal key of a viseme: how far it is reached at a time inside (or beside) the phonation.
struct EventKey {
  Seconds time = 0;
  double value = 0;
};

/// One viseme of the line: zero at `onset`, through `inner`, zero at `end` (VOCAL figure 3). `lips` and `jaw` say how
/// much of the viseme's lip part and jaw part it brings, 0 to 1.
struct VisemeEvent {
  Viseme viseme = Viseme::kSil;
  PhoneIndex phone;                    ///< whose viseme it is; the first, where several were merged
  PhoneIndex first_phone, last_phone;  ///< that it covers: an HH before it too
  TimeSpan span;                       ///< of phonation
  bool is_vowel = false;
  Seconds onset = 0, end = 0;   ///< boundary keys
  std::vector<EventKey> inner;  ///< internal keys, in time order, at least one
  double lips = 1, jaw = 1;
  bool has_sung_keys = false;  ///< its inner keys are those of notes or vibrato
};

/// The numbers of VOCAL 4.2, "Generating a speech curve", and of JALI (design page, section 8).
namespace vocal_numbers {
inline constexpr Seconds kOnset = 0.120;          ///< boundary keys before and after phonation
inline constexpr Seconds kLipHeavyOnset = 0.150;  ///< the same of lip-heavy visemes
inline constexpr double kSustain = 0.75;          ///< of phonation
inline constexpr double kFull = 1.0;              ///< B P M F V S SH
inline constexpr double kShort = 0.6;             ///< other consonants, short vowels
inline constexpr double kLong = 0.8;              ///< long vowels
inline constexpr Seconds kLongVowel = 0.200;
inline constexpr Seconds kJawFrame = 1.0 / 24;  ///< JALI's frame: shorter obstruents and nasals leave the jaw alone
}  // namespace vocal_numbers

/// M B P and F V.
inline bool isLabial(Viseme viseme) { return rowOf(viseme).closure != LipClosure::kNone; }

/// Where a diphthong turns from its first viseme to its last: half way, but where it is held 120 ms before its end, for
/// singers hold the first vowel and let the second vanish.
Seconds diphthongTurn(const TimeSpan& span);

/// Pass 1: four keys for each phone (diphthongs: for each of the two; silence: none). HH waits for pass 2.
std::vector<VisemeEvent> fourKeyEvents(const SpeechLabels& labels);

/// Pass 2: JALI's co-articulation rules. Merges repeated visemes (sung ones keep their inner keys, and meet as VOCAL's
/// figure 4 has it: curvesFromEvents()), gives HH the shape of the next vowel, lets lip-heavy
/// visemes take the lips of the consonants that look at them (inside a word a phone looks ahead, its last one back) and
/// tongue-only ones keep theirs out, and short obstruents the jaw.
std::vector<VisemeEvent> coarticulated(std::vector<VisemeEvent> events, const SpeechLabels& labels);

/// The numbers of VOCAL 4.2, "Generating a singing curve".
namespace vocal_numbers {
inline constexpr double kNoteRange = 0.4, kNoteFloor = 0.6;  ///< amplitude at a note's start: range x pitch + floor
inline constexpr double kNoteDecay = 0.95;                   ///< at its end, of that at its start
inline constexpr double kBetweenNotes = 0.9;                 ///< of the lower of both neighbours
inline constexpr double kVibratoRateHz = 7;
inline constexpr double kVibratoDepth = 0.6;      ///< of the amplitude, reached at the vibrato's end
inline constexpr Seconds kBlendedVowels = 0.300;  ///< vowels closer than this blend into each other
}  // namespace vocal_numbers

/// Pass 1 of song: the events with an internal key at the start and end of each note of a vowel, one between notes and
/// keys that oscillate where there is vibrato. A vowel with one note apexes where the note begins and decays as in
/// speech; one without keeps its speech keys. Pitch is normalised over all notes of the line.
std::vector<VisemeEvent> withSungInternalKeys(std::vector<VisemeEvent> events, const AudioTags& tags);

/// Pass 2 of song: extends the boundary keys of vowels less than 300 ms apart into each other and takes back the
/// consonants between them.
std::vector<VisemeEvent> withSungBoundaryKeys(std::vector<VisemeEvent> events);

/// What is left of a consonant between two vowels that blend at Ma = 1: "little visual contribution".
inline constexpr double kConsonantInLegato = 0.2;

/// Pass 3: the events' keys joined into one curve per viseme and part. Where two events of one viseme overlap, the two
/// boundary keys give way to one, 120 ms before the second begins if the first has been held until then, else midway;
/// its value is `vowel_coarticulation` of the lower of both.
CurveSet curvesFromEvents(const std::vector<VisemeEvent>& events, double vowel_coarticulation);

/// VC of the paper.
inline constexpr double kSpeechCoarticulation = 0.5;
inline constexpr double kSongCoarticulation = 0.95;

}  // namespace mouthpiece
