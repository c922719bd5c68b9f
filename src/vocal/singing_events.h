#pragma once

#include <vector>

#include "audio/audio_tags.h"
#include "vocal/viseme_events.h"

namespace mouthpiece {

/// The numbers of VOCAL 4.2, "Generating a singing curve".
namespace vocal_numbers {
inline constexpr double kNoteRange = 0.4, kNoteFloor = 0.6;  ///< amplitude at a note's start: range x pitch + floor
inline constexpr double kNoteDecay = 0.95;                   ///< at its end, of that at its start
inline constexpr double kBetweenNotes = 0.9;                 ///< of the lower of both neighbours
inline constexpr double kVibratoRateHz = 7;
inline constexpr double kVibratoDepth = 0.6;      ///< of the amplitude, reached at the vibrato's end
inline constexpr Seconds kBlendedVowels = 0.300;  ///< vowels closer than this blend into each other
}  // namespace vocal_numbers

/// Gives vowels an internal key at the start and end of each note, one between notes and keys that oscillate where
/// there is vibrato. A vowel with one note apexes where the note begins and decays as in speech; one without keeps its
/// speech keys. Pitch is normalised over all notes of the line.
void singInternalKeys(std::vector<VisemeEvent>& events, const AudioTags& tags);

/// Extends the boundary keys of vowels less than 300 ms apart into each other and takes back the consonants between
/// them.
void singBoundaryKeys(std::vector<VisemeEvent>& events);

/// What is left of a consonant between two vowels that blend at Ma = 1: "little visual contribution".
inline constexpr double kConsonantInLegato = 0.2;

}  // namespace mouthpiece
