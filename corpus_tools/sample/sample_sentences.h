#pragma once

#include <array>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mouthpiece {

/// One choice of EDGE 4's time grammar: {prolog} {exactness} {minutes} {hours} {day-info}; exactness and minutes may be
/// empty, as in the paper's own examples.
struct TimeSentence {
  std::string exactness, minutes, hours, day_info;

  [[nodiscard]] std::string text() const;  ///< "the time is now exactly one in the afternoon"
  bool operator==(const TimeSentence&) const = default;
};

/// All 2,880 sentences of the grammar, in a fixed order.
std::vector<TimeSentence> allTimeSentences();

using WordPair = std::pair<std::string, std::string>;
/// The words of `sentence` that follow each other; "twenty-five" is one word.
std::set<WordPair> wordPairs(const TimeSentence& sentence);

/// An upper bound of the word pairs that `count` sentences can hold together (proof in the source); 55 reach it.
std::size_t mostWordPairs(std::size_t count);

/// `count` sentences that hold every word and as many word pairs as `count` sentences can; beyond that, as many pairs
/// of neighbouring sounds across a word boundary and word triples as possible. Greedy choice, then exchange while it
/// helps; the same for every call.
std::vector<TimeSentence> chooseTimeSentences(std::size_t count);

/// The texts of chooseTimeSentences(55), the sample corpus: sample_data/prompts/time55.txt, built in.
std::vector<std::string> sampleSentences();

}  // namespace mouthpiece
