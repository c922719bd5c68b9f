#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hearing/recognition/recogniser.h"

namespace mouthpiece {

/// What another program knows of a recording (docs/formats/times.md).
struct TimesFile {
  struct Word {
    std::string text;
    TimeSpan span;
    double confidence = 1;
  };
  std::string kind;                   ///< "Whisper JSON"
  std::vector<Word> words;            ///< rising, without overlaps; may be empty
  bool words_are_lines = false;       ///< each is a row of words said somewhere within its span
  std::vector<PhoneSegment> phones;   ///< rising, without overlaps; may be empty; `word` is an index into words
  bool phones_are_shapes = false;     ///< one phone stands for all that look alike
  std::size_t cut_lines = 0;          ///< they overlapped the next one and end where it begins
  std::string language;               ///< as it names it: "de", "german"; "" for nothing told
  std::vector<std::string> not_said;  ///< what stood among the words and is none of them: "(laughs)", "JOHN:"
};

/// Words and times of another program, its kind told by its content: JSON of Whisper (openai, whisper.cpp), Vosk,
/// Gentle, Azure, Deepgram, Amazon Transcribe, Google, Watson, Speechmatics, Rev, AssemblyAI, ElevenLabs, Piper and
/// Rhubarb, Polly's speech marks, Rhubarb's TSV and XML, the Montreal Forced Aligner's JSON and CSV, Whisper's TSV,
/// Audacity's labels, TextGrid, CTM, SRT and WebVTT. `bytes` is hostile; `name` stands for the file in messages. Throws
/// InputError for no kind that is known, what is cut short or lacks a field, and times that are negative, no numbers or
/// out of order.
TimesFile parseTimes(std::string_view bytes, std::string_view name, const Language& language = english());

/// Whether these are labels in a TextGrid that has words and not the phones of all of them: it has no tier of phones,
/// or marks of what its aligner could not spell. makeTimedRecogniser() finds them. Throws InputError for a damaged
/// file.
bool lacksPhones(const std::filesystem::path& labels);

/// Hears what the file says: phones that it lacks are aligned inside their words. `lexicon` is kept alive by the
/// caller; nullptr for none.
std::unique_ptr<Recogniser> makeTimedRecogniser(const std::filesystem::path& file, const Lexicon* lexicon = nullptr,
                                                const Language& language = english());

}  // namespace mouthpiece
