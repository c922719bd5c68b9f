#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mouthpiece/corpus.h"
#include "mouthpiece/errors.h"
#include "mouthpiece/face.h"
#include "mouthpiece/frames.h"
#include "mouthpiece/line.h"
#include "mouthpiece/live.h"
#include "mouthpiece/performance.h"
#include "mouthpiece/save.h"

namespace mouthpiece {

/// What a speaker is made of. The defaults are those of the program `synth`.
struct MOUTHPIECE_API SpeakerOptions {
  std::filesystem::path corpus;  ///< empty: the sample corpus
  std::filesystem::path face;    ///< empty: the default face
  bool with_face = true;         ///< off: sound, labels and markers alone; no face is opened
  std::string voice;             ///< asked for: one of voiceNames(); empty: usual_voice
  /// Speaks where no voice is asked for and the language, if any is, is its own; else the language's first voice does.
  std::string usual_voice = "festival:cmu_us_slt_arctic_hts";
  std::optional<double> rate;  ///< of the voice "corpus": 1 as fast as Festival would speak; none: as recorded
  std::string language;        ///< BCP 47: of the text, the recording, its labels; empty: the voice's
  /// How a recording without its words is heard; with its words, whether they are held against what is heard by words.
  enum class Hear {
    kAuto,   ///< words where they are likely, else phones
    kWords,  ///< words of US English
    kPhones  ///< phones: any language
  };
  Hear hear = Hear::kAuto;
  std::filesystem::path lexicon;  ///< pronunciations that go before the voice's own; empty: none
  Manner manner;
  bool timing = true;  ///< off: reports tell no times, so that the same line gives the same bytes
  /// The page can make its line again by itself after an edit (docs/guides/edit_a_line.md). Needs the engine that
  /// `make wasm` builds; a line that it cannot make has a page without it and a warning.
  bool page_engine = false;
  /// The captured motion that a line was made of stays in memory for the next one; off, for a program that makes a
  /// single line: it is given back before the line's face takes memory. Of a corpus that others use, or of one of over
  /// some three hours, this says nothing: the first keeps it, the second does not.
  bool keep_motion = true;
};

/// Performs lines: opens a corpus, a face and a voice once and uses them for every line. Not thread-safe; two speakers
/// in two threads give the same bytes as one after the other.
class MOUTHPIECE_API Speaker {
 public:
  /// Throws InputError for files that cannot be used and options out of range; of a face whose parts contradict each
  /// other perform() tells.
  explicit Speaker(const SpeakerOptions& options = {});
  /// The same with a corpus and a face that others use, too; options.corpus and options.face do not count.
  Speaker(const SharedCorpus& corpus, std::optional<SharedFace> face, const SpeakerOptions& options = {});
  Speaker(Speaker&&) noexcept;
  Speaker& operator=(Speaker&&) noexcept;
  ~Speaker();

  /// Throws InputError for text with nothing to say in it, recordings that cannot be read, and so on.
  Performance perform(std::string_view text);
  Performance perform(const Line& line);
  /// The same, its frames pulled one by one.
  FrameStream stream(std::string_view text);
  /// Frames of what is being said, sound or labels pushed as they come. Throws InputError for options out of range, for
  /// a manner other than Method::kGuided of units of any kind, for dials, Ma, Ps and edits, which are of a whole line,
  /// and for a corpus that predicts no movement.
  [[nodiscard]] LiveStream live(const LiveOptions& options = {}) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

/// The names of all voices, the default one first.
MOUTHPIECE_API std::vector<std::string> voiceNames();

}  // namespace mouthpiece
