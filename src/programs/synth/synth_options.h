#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "synthesis/synthesis.h"

namespace mouthpiece {

/// The files that synth can write; their names in an output folder are those of the design. The last three only
/// with -o.
enum class OutputKind {
  kSound,
  kMotionC3d,
  kMotionCsv,
  kFace,
  kCurves,
  kPhones,
  kPage,
  kReport,
  kCurveKeysCsv,
  kCurveFramesCsv,
  kAblation
};

struct OutputFile {
  OutputKind kind;
  std::filesystem::path path;
};

/// What kind of file `path` asks for by its ending. Throws InputError that lists the known endings.
OutputFile outputFileFor(const std::filesystem::path& path);

/// All of them, in `folder`, under their usual names.
std::vector<OutputFile> allOutputFiles(const std::filesystem::path& folder);

/// One line to animate: typed, or recorded with its labels or its words.
struct LineSource {
  std::string text;              ///< typed; for a recording what is said, if known
  std::filesystem::path audio;   ///< a recording; empty: `text` is spoken by the voice
  std::filesystem::path phones;  ///< its labels (TextGrid, .lab, .phn); empty: `text` is aligned with it
  std::filesystem::path song;    ///< sung by Festival instead; empty: none
  bool is_sung = false;          ///< a song, or the recording of one
};

/// What to do where the corpus lacks a phone pair.
enum class BackoffKind { kVocal, kViseme, kNone };

/// The part of the command line that is the same for every line of a batch.
struct SynthOptions {
  std::filesystem::path corpus;   ///< empty: the sample corpus
  std::filesystem::path face;     ///< empty: the default face
  std::filesystem::path lexicon;  ///< empty: the voice's own pronunciations
  std::string voice = "festival:cmu_us_slt_arctic_hts";
  std::optional<double> rate;  ///< corpus voice: 1 as fast as Festival would speak; none: as it was recorded
  SynthesisOptions synthesis;
  BackoffKind backoff = BackoffKind::kVocal;
  /// Ma, Ps, Ja, Li as given: a number, "auto" (the first two) or a file of time_s,value; empty: left to the style.
  std::string ma, ps, ja, li;
  std::filesystem::path edits;  ///< of the curves; empty: none
};

}  // namespace mouthpiece
