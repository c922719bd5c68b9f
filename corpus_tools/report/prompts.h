#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "phonetics/language/phone.h"

namespace mouthpiece {

/// More sentences than this are no grammar for prompts.
inline constexpr std::size_t kMostGrammarSentences = 200'000;

/// Every sentence of a grammar (docs/formats/grammar.md): lines of "rule = words", where `a | b` is a choice, `[a]` may
/// be left out, `( )` groups and `<rule>` stands for another rule; the first rule is the sentence, '#' starts a
/// comment. In a fixed order, each once. Throws InputError with the line for what is no grammar, a rule that is not
/// there or holds itself, more than kMostGrammarSentences, a sentence of more than 2,000 bytes, and what would take
/// over 256 MiB of text on the way.
std::vector<std::string> sentencesOfGrammar(std::string_view text, std::string_view file);

/// A sentence that could be recorded, as it would be said; silence around it is not written.
struct Prompt {
  std::string text;
  std::vector<Phone> phones;
};

/// How often each pair of phones is met in running speech: its share of all pairs, at left * kPhoneCount + right.
using PairShares = std::array<double, kPhoneCount * kPhoneCount>;
/// Of all pairs in `running`, silence around each prompt. All zero when there are none.
PairShares pairShares(const std::vector<Prompt>& running);
/// A line a pair that is met, the most frequent first: "left,right,share" under a header row.
std::string pairSharesToCsv(const PairShares& shares);
/// Throws InputError with the line for what is no such table: an unknown phone, a share outside [0, 1], a pair twice.
PairShares parsePairShares(std::string_view text, std::string_view file);

struct ChosenPrompts {
  std::vector<std::size_t> sentences;  ///< indices, in the order of choice
  std::vector<std::size_t> pairs;      ///< different phone pairs held after each of them: the coverage curve
  std::vector<double> shares;          ///< the sum of `weights` over those pairs; empty without weights
  std::size_t possible_pairs = 0;      ///< that all sentences together hold
};

/// Up to `count` sentences, each the one that adds most phone pairs for its length (greedy: at least 63 % of what any
/// choice of that many could hold, when lengths are alike); when nothing new is left, the one whose pairs are rarest so
/// far. Ties go to the earlier sentence. With `weights` a pair counts as much as it is met in running speech.
ChosenPrompts choosePrompts(const std::vector<Prompt>& prompts, std::size_t count, const PairShares* weights = nullptr);

}  // namespace mouthpiece
