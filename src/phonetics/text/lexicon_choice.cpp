#include "phonetics/text/lexicon.h"

#include <algorithm>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "base/index.h"

namespace mouthpiece {
namespace {

/// How a word that comes several times is said is settled in this many rounds at most.
constexpr int kRounds = 3;
/// Of two ways with as many missing pairs the earlier in the lexicon is taken.
constexpr double kLaterWay = 1e-3;
/// Than the one that a word was settled to before.
constexpr double kOtherWay = 1e6;

struct LineWord {
  std::string text;
  bool pause_before = false;
};

bool isWordCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '\'' || c == '-' ||
         static_cast<unsigned char>(c) >= 0x80;
}

std::vector<LineWord> wordsOf(std::string_view line) {
  std::vector<LineWord> words;
  bool pause = true;
  std::string word;
  const auto finish = [&] {
    if (word.empty()) return;
    words.push_back({std::move(word), pause});
    word.clear();
    pause = false;
  };
  for (const char c : line) {
    if (isWordCharacter(c)) {
      word += c;
      continue;
    }
    finish();
    pause = pause || std::string_view(",.;:!?()").find(c) != std::string_view::npos;
  }
  finish();
  return words;
}

/// The ways to say a word of the line: the lexicon's, or one without phones where it lacks the word.
using Ways = std::vector<Pronunciation>;

class LineChooser {
 public:
  LineChooser(const Lexicon& lexicon, const std::vector<LineWord>& words, const PhonePairs& pairs)
      : words_(words), pairs_(pairs) {
    for (const LineWord& word : words) {
      const Ways& known = lexicon.find(word.text);
      ways_.push_back(known.empty() ? Ways(1) : known);
    }
  }

  /// The way of each word; words that come again are fixed round by round.
  std::map<std::string, std::size_t> choose() {
    std::map<std::string, std::size_t> chosen;
    for (int round = 0; round < kRounds; ++round) {
      const std::vector<std::size_t> ways = cheapestWays(chosen);
      std::map<std::string, std::size_t> next = chosen;
      for (std::size_t i = 0; i < words_.size(); ++i) next.emplace(words_[i].text, ways[i]);
      if (next == chosen) break;
      chosen = std::move(next);
    }
    return chosen;
  }

 private:
  [[nodiscard]] double missing(Phone first, Phone second) const { return pairs_.has(first, second) ? 0.0 : 1.0; }

  [[nodiscard]] double insideCost(const Pronunciation& way, std::size_t rank) const {
    double cost = kLaterWay * asReal(rank);
    for (std::size_t i = 1; i < way.phones.size(); ++i) cost += missing(way.phones[i - 1], way.phones[i]);
    return cost;
  }

  /// What comes between the phones of two words, silence at a pause; nothing is judged beside an unknown word.
  [[nodiscard]] double joinCost(const std::vector<Phone>& before, const std::vector<Phone>& after, bool pause) const {
    if (before.empty() || after.empty()) return 0;
    if (!pause) return missing(before.back(), after.front());
    return missing(before.back(), Phone::kSil) + missing(Phone::kSil, after.front());
  }

  /// Viterbi over the words' ways, from the silence before the line to the one after it.
  [[nodiscard]] std::vector<std::size_t> cheapestWays(const std::map<std::string, std::size_t>& fixed) const {
    struct Node {
      double cost = std::numeric_limits<double>::infinity();
      std::size_t from = 0;
    };
    const std::vector<Phone> silence{Phone::kSil};
    const auto cheapestInto = [&](const std::vector<Node>& before, std::size_t word, const std::vector<Phone>& after,
                                  bool pause) {
      Node node;
      for (std::size_t way = 0; way < before.size(); ++way) {
        const double cost = before[way].cost + joinCost(ways_[word][way].phones, after, pause);
        if (cost < node.cost) node = {cost, way};
      }
      return node;
    };
    std::vector<std::vector<Node>> nodes;
    for (std::size_t w = 0; w < words_.size(); ++w) {
      std::vector<Node> here;
      const auto held = fixed.find(words_[w].text);
      for (std::size_t way = 0; way < ways_[w].size(); ++way) {
        const Pronunciation& said = ways_[w][way];
        Node node = w == 0 ? Node{joinCost(silence, said.phones, false)}
                           : cheapestInto(nodes.back(), w - 1, said.phones, words_[w].pause_before);
        node.cost += insideCost(said, way) + (held != fixed.end() && held->second != way ? kOtherWay : 0);
        here.push_back(node);
      }
      nodes.push_back(std::move(here));
    }
    std::vector<std::size_t> chosen(words_.size(), 0);
    if (words_.empty()) return chosen;
    chosen.back() = cheapestInto(nodes.back(), words_.size() - 1, silence, false).from;
    for (std::size_t w = words_.size(); w-- > 1;) chosen[w - 1] = nodes[w][chosen[w]].from;
    return chosen;
  }

  const std::vector<LineWord>& words_;
  const PhonePairs& pairs_;
  std::vector<Ways> ways_;
};

}  // namespace

void PhonePairs::add(const SpeechLabels& labels) {
  for (std::size_t i = 1; i < labels.phones.size(); ++i) add(labels.phones[i - 1].phone, labels.phones[i].phone);
}

Lexicon lexiconForLine(const Lexicon& lexicon, std::string_view line, const PhonePairs& pairs) {
  const std::vector<LineWord> words = wordsOf(line);
  Lexicon spoken = lexicon;
  for (const auto& [word, way] : LineChooser(lexicon, words, pairs).choose()) spoken.putFirst(word, way);
  return spoken;
}

}  // namespace mouthpiece
