#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// More sentences than this are no grammar for prompts.
inline constexpr std::size_t kMostGrammarSentences = 200'000;

/// Every sentence of a grammar (docs/formats/grammar.md): lines of "rule = words", where `a | b` is a choice, `[a]` may
/// be left out, `( )` groups and `<rule>` stands for another rule; the first rule is the sentence, '#' starts a
/// comment. In a fixed order, each once. Throws InputError with the line for what is no grammar, a rule that is not
/// there or holds itself, and more than kMostGrammarSentences.
std::vector<std::string> sentencesOfGrammar(std::string_view text, std::string_view file);

}  // namespace mouthpiece
