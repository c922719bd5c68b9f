#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "audio/pitch_track.h"
#include "hearing/alignment/forced_alignment.h"
#include "singing/sung_line.h"

namespace mouthpiece {

/// Where a song lies in a sound of somebody singing it.
struct SongPlace {
  Seconds offset = 0;    ///< the sound's time at which the song's clock stands at 0; negative: it began before
  double agreement = 0;  ///< 0 to 1: share of the time of the notes within the sound at which their pitch is heard
};

/// Finds the song whose notes are `notes` (in order) by pitch and rests, in whatever key or octave it is sung (that of
/// most of its time). nullopt where the sound has no pitch or there are no notes.
std::optional<SongPlace> findSong(std::span<const Note> notes, const PitchTrack& pitch);
/// The same at a place that is known.
SongPlace songAt(Seconds offset, std::span<const Note> notes, const PitchTrack& pitch);

/// The least agreement of a song that is believed to be in a sound (docs/formats/song.md).
inline constexpr double kLeastAgreement = 0.5;

/// A song whose sound is `sound` in place of the voice that sang it: the score's words, phones and notes, each word
/// where it is heard if that is near its place in the score, else where its neighbours say; pitch, vibrato, vowels and
/// consonants as they are heard. `offset`: as in SongPlace; none: it is found. Words outside the sound are left out,
/// and that is warned of. `name` stands for the sound. Throws InputError where nothing of the song is in the sound.
SungLine besideSound(SungLine sung, AudioClip sound, std::optional<Seconds> offset, Aligner& aligner,
                     std::string_view name);

}  // namespace mouthpiece
