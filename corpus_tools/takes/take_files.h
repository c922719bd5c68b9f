#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "audio/audio_clip.h"
#include "corpus_tools/takes/take_labeller.h"
#include "corpus_tools/takes/take_report.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"
#include "phonetics/text/lexicon.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// The files of one take: NAME.c3d (or .trc, .csv), NAME.wav (or .flac), NAME.txt, NAME.TextGrid (or .lab,
/// .phn, .ctm).
struct TakeFiles {
  std::string name;
  std::filesystem::path motion, audio;
  std::filesystem::path labels;               ///< empty: found by aligning the sound with the text
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
  bool labels_found = false;  ///< by forced alignment
  std::vector<DoubtfulWord> doubtful;
};

/// Markers of the files that go by another name in the layout: from -> to.
using MarkerNameMap = std::map<std::string, std::string>;
void renameMarkers(MotionClip& clip, const MarkerNameMap& names);

/// Reads all files of a take. Throws InputError for a damaged file, motion without enough of the layout's markers, or
/// sound and motion shorter than the labels.
RawTake readTake(const TakeFiles& files, const MarkerLayout& layout, const Lexicon& lexicon, TakeLabeller& labeller,
                 const MarkerNameMap& names = {});
/// The same with a labeller of its own.
RawTake readTake(const TakeFiles& files, const MarkerLayout& layout, const Lexicon& lexicon);

/// The layout's face markers and jig markers of any clip; a subject's prefix ("Anna:LIP_UP_MID") is ignored.
/// Throws InputError, with `file` in front, that says what was found and expected, unless at least three quarters of
/// the face markers are seen in some frame.
struct FaceAndJig {
  MotionClip face, jig;
};
FaceAndJig splitMarkers(const MotionClip& clip, const MarkerLayout& layout, const std::string& file);

}  // namespace mouthpiece
