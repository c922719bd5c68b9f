#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_clip.h"
#include "corpus_tools/takes/take_report.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "phonetics/text/lexicon.h"

namespace mouthpiece {

class ForcedAligner;
class Pronouncer;
class WordNetwork;

/// Finds the labels of takes that have none. Thread-safe: each thread at work has an aligner of its own.
class TakeLabeller {
 public:
  /// `lexicon` is kept alive by the caller. Nothing is loaded before the first take asks. `network`: asked about words
  /// that are in doubt (judgeByNetwork), if they are English.
  explicit TakeLabeller(const Lexicon& lexicon, std::shared_ptr<WordNetwork> network = {},
                        const Language& language = english());
  ~TakeLabeller();

  struct Labels {
    SpeechLabels labels;
    std::vector<DoubtfulWord> doubtful;
  };
  /// Throws InputError when the words cannot be said or do not fit the sound.
  Labels label(const AudioClip& audio, const std::string& text, const std::string& name);
  /// Why the network could not be asked, the first time that it was not; else "".
  [[nodiscard]] std::string networkFault() const;
  [[nodiscard]] const Language& language() const { return language_; }

 private:
  std::unique_ptr<ForcedAligner> takeAligner();

  const Lexicon& lexicon_;
  std::shared_ptr<WordNetwork> network_;
  const Language& language_;
  mutable std::mutex mutex_;
  std::string network_fault_;
  std::unique_ptr<Pronouncer> pronouncer_;
  std::vector<std::unique_ptr<ForcedAligner>> idle_;
};

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

/// Looks in the folder itself, not in folders below. A name counts as a take when it has motion, or sound with labels
/// or text; what such a take lacks makes it left out. Throws InputError when the folder cannot be read or holds no
/// take.
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

/// From the highest marker to the lowest, or from side to side: what is smaller or larger is no face in mm.
inline constexpr double kLeastFaceMm = 40, kLargestFaceMm = 400;

/// The layout's face markers and jig markers of any clip; a sample at 0 0 0 was not seen, as many programs write it; a
/// subject's prefix ("Anna:LIP_UP_MID") is ignored.
/// Throws InputError, with `file` in front, that says what was found and expected, unless at least three quarters of
/// the face markers are seen in some frame.
struct FaceAndJig {
  MotionClip face, jig;
};
FaceAndJig splitMarkers(const MotionClip& clip, const MarkerLayout& layout, const std::string& file);

/// Labels that know phones only, given the words of `text`: word by word, some pronunciation of the lexicon must spell
/// the next phones, pauses between words left aside. nullopt when a word is unknown or the phones do not fit.
std::optional<SpeechLabels> withWords(const SpeechLabels& labels, std::string_view text, const Lexicon& lexicon);

}  // namespace mouthpiece
