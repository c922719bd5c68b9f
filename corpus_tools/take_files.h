#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "audio/audio_clip.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"
#include "phonetics/lexicon.h"
#include "phonetics/speech_labels.h"

namespace mouthpiece {

/// The files of one take: NAME.c3d (or .trc, .csv), NAME.wav (or .flac), NAME.TextGrid (or .lab, .phn), NAME.txt.
struct TakeFiles {
  std::string name;
  std::filesystem::path motion, audio, labels;
  std::optional<std::filesystem::path> text;  ///< none: the words of the labels are the text
};

/// A take that cannot be used, and why (one line that names the file).
struct LeftOutTake {
  std::string name;
  std::string reason;
};

struct FoundTakes {
  std::vector<TakeFiles> takes;  ///< by name
  std::vector<LeftOutTake> left_out;
};

/// Looks in the folder itself, not in folders below. A name counts as a take when it has motion, or sound and labels;
/// what such a take lacks makes it left out. Throws InputError when the folder cannot be read or holds no take.
FoundTakes findTakes(const std::filesystem::path& folder);

/// A take as captured: the head still moves.
struct RawTake {
  std::string name;
  std::string text;
  SpeechLabels labels;
  MotionClip face;  ///< the layout's markers in its order; NaN where not seen
  MotionClip jig;   ///< the layout's jig markers in its order; NaN where not seen
  AudioClip audio;
};

/// Reads all files of a take. Throws InputError for a damaged file, motion without enough of the layout's markers, or
/// sound and motion shorter than the labels.
RawTake readTake(const TakeFiles& files, const MarkerLayout& layout, const Lexicon& lexicon);

/// The layout's face markers and jig markers of any clip; a subject's prefix ("Anna:LIP_UP_MID") is ignored.
/// Throws InputError, with `file` in front, that says what was found and expected, unless at least three quarters of
/// the face markers are seen in some frame.
struct FaceAndJig {
  MotionClip face, jig;
};
FaceAndJig splitMarkers(const MotionClip& clip, const MarkerLayout& layout, const std::string& file);

}  // namespace mouthpiece
