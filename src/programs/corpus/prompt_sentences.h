#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "corpus_tools/report/prompts.h"

namespace mouthpiece {

class Pronouncer;

/// A longer text is no list of sentences.
inline constexpr std::uint64_t kMostPromptBytes = 64 << 20;

/// The lines of a text that hold a sentence: not blank, not begun with '#'.
std::vector<std::string> sentenceLines(std::string_view text);
/// The sentences of a file, one a line, or all that a grammar allows. Throws InputError when there is none.
std::vector<std::string> sentencesOf(const std::filesystem::path& file, bool is_grammar);
/// As it would be said, silence at punctuation.
Prompt promptOf(const std::string& sentence, const Pronouncer& pronouncer);

}  // namespace mouthpiece
