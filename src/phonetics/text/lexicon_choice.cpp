#include "phonetics/text/lexicon.h"

#include <algorithm>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace mouthpiece {
namespace {

/// How a word that comes several times is said is settled in this many rounds at most.
constexpr int kRounds = 3;
/// Of two ways with as many missing pairs the earlier in the lexicon is taken.
constexpr double kLaterWay = 1e-3;

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

class LineChooser {
 public:
  LineChooser(const Lexicon& lexicon, const std::vector<LineWord>& words, const PhonePairs& pairs)
      : lexicon_(lexicon), words_(words), pairs_(pairs) {}

  /// The way of each word of the line that the lexicon has, by the word; words that come again are fixed round by
  /// round.
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
  [[nodiscard]] const std::vector<Pronunciation>& waysOf(std::size_t word) const {
    return lexicon_.find(words_[word].text);
  }

  [[nodiscard]] double missing(Phone first, Phone second) const {
    return pairs_.has(first, second) ? 0.0 : 1.0;
  }

  [[nodiscard]] double insideCost(const Pronunciation& way, std::size_t rank) const {
    double cost = kLaterWay * asReal(rank);
    for (std::size_t i = 1; i < way.phones.size(); ++i) cost += missing(way.phones[i - 1], way.phones[i]);
    return cost;
  }

  /// Between the last phone of the word before (sil: the line's start) and the first of `word`.
  [[nodiscard]] double stepCost(Phone before, const Pronunciation& way, bool pause) const {
    if (!pause) return missing(before, way.phones.front());
    return (before == Phone::kSil ? 0.0 : missing(before, Phone::kSil)) + missing(Phone::kSil, way.phones.front());
  }

  /// Viterbi over the words' ways.
  [[nodiscard]] std::vector<std::size_t> cheapestWays(const std::map<std::string, std::size_t>& fixed) const {
    struct Node {
      double cost = 0;
      std::size_t from = 0;
    };
    std::vector<std::vector<Node>> nodes(words_.size());
    for (std::size_t w = 0; w < words_.size(); ++w) {
      const auto& ways = waysOf(w);
      nodes[w].resize(std::max<std::size_t>(1, ways.size()));
      for (std::size_t v = 0; v < nodes[w].size(); ++v) {
        Node& node = nodes[w][v];
        const auto held = fixed.find(words_[w].text);
        const bool is_other = held != fixed.end() && held->second != v;
        node.cost = std::numeric_limits<double>::infinity();
        for (std::size_t u = 0; u < (w == 0 ? 1 : nodes[w - 1].size()); ++u) {
          double cost = w == 0 ? 0.0 : nodes[w - 1][u].cost;
          if (!ways.empty()) {
            const bool before_known = w > 0 && !waysOf(w - 1).empty();
            if (w == 0) cost += stepCost(Phone::kSil, ways[v], true);
            if (before_known) cost += stepCost(waysOf(w - 1)[u].phones.back(), ways[v], words_[w].pause_before);
          }
          if (cost < node.cost) node = {cost, u};
        }
        if (!ways.empty()) node.cost += insideCost(ways[v], v);
        if (w + 1 == words_.size() && !ways.empty()) node.cost += missing(ways[v].phones.back(), Phone::kSil);
        if (is_other) node.cost += 1e6;
      }
    }
    std::vector<std::size_t> chosen(words_.size(), 0);
    if (words_.empty()) return chosen;
    const auto& last = nodes.back();
    std::size_t way = 0;
    for (std::size_t v = 1; v < last.size(); ++v) {
      if (last[v].cost < last[way].cost) way = v;
    }
    for (std::size_t w = words_.size(); w-- > 0;) {
      chosen[w] = way;
      way = nodes[w][way].from;
    }
    return chosen;
  }

  const Lexicon& lexicon_;
  const std::vector<LineWord>& words_;
  const PhonePairs& pairs_;
};

}  // namespace

void PhonePairs::add(const SpeechLabels& labels) {
  for (std::size_t i = 1; i < labels.phones.size(); ++i) {
    pairs_[static_cast<std::size_t>(labels.phones[i - 1].phone)][static_cast<std::size_t>(labels.phones[i].phone)] =
        true;
  }
}

Lexicon lexiconForLine(const Lexicon& lexicon, std::string_view line, const PhonePairs& pairs) {
  const std::vector<LineWord> words = wordsOf(line);
  Lexicon spoken = lexicon;
  for (const auto& [word, way] : LineChooser(lexicon, words, pairs).choose()) spoken.putFirst(word, way);
  return spoken;
}

}  // namespace mouthpiece
