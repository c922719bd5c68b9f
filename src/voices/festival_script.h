#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_clip.h"
#include "phonetics/labels/labels_builder.h"
#include "phonetics/text/lexicon.h"

namespace mouthpiece {

/// What Festival is told: the Scheme program, and the text in a file of its own that Scheme never reads.
struct FestivalJob {
  std::string script;
  std::string text;
};

/// Names of the files within the private folder.
inline constexpr std::string_view kFestivalTextFile = "text.txt";
inline constexpr std::string_view kFestivalLabelsFile = "labels.txt";
std::string festivalWaveFile(std::size_t utterance);

/// Whether makeFestivalJob() has a word said as `lexicon` has it: one of letters that it holds.
bool isSaidByLexicon(std::string_view word, const Lexicon& lexicon);

/// `speakable_text` comes from speakableText(). Words of `lexicon` (may be nullptr) that it holds get their first
/// pronunciation; a capital letter alone is replaced by a made-up word that is said as the letter's name.
FestivalJob makeFestivalJob(std::string_view voice, std::string_view speakable_text, const Lexicon* lexicon);

/// One of the utterances that Festival cut the text into.
struct FestivalUtterance {
  std::vector<PhoneSegment> phones;
  std::vector<std::string> words;
};

/// Reads the labels that the script wrote. Throws InputError when they are not whole, or hold a phone we do not know.
std::vector<FestivalUtterance> parseFestivalLabels(std::string_view bytes);

}  // namespace mouthpiece
