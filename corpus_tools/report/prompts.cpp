#include "corpus_tools/report/prompts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <queue>
#include <set>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

using Phrases = std::vector<std::string>;

constexpr std::string_view kBlanks = " \t\r";
constexpr std::string_view kSigns = "|[]()<>";
constexpr int kDeepest = 100;                   ///< of brackets and rules in each other: the reading is recursive
constexpr std::size_t kLongestSentence = 2000;  ///< bytes: some two minutes of speech
constexpr std::size_t kMostBytes = std::size_t{1} << 28;  ///< of all phrases ever made on the way: memory and time

struct Rule {
  std::string name;
  std::string_view body;
  std::size_t line;
};

class Grammar {
 public:
  Grammar(std::string_view text, std::string_view file) : file_(file) {
    for (std::size_t number = 1; !text.empty(); ++number) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      addLine(text.substr(0, end), number);
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    if (rules_.empty()) throw InputError(file_, "", "holds no rule; expected lines of \"name = words\"");
  }

  Phrases sentences() {
    Phrases all = phrasesOf(rules_.front());
    std::set<std::string> seen;
    Phrases once;
    for (std::string& sentence : all) {
      if (!sentence.empty() && seen.insert(sentence).second) once.push_back(std::move(sentence));
    }
    return once;
  }

 private:
  void addLine(std::string_view line, std::size_t number) {
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty()) return;
    const std::size_t equals = line.find('=');
    const std::string name(equals == std::string_view::npos ? "" : trimmed(line.substr(0, equals)));
    if (name.empty() || name.find_first_of(kSigns) != std::string::npos || places_.contains(name)) {
      fail(number, fmt::format("found '{}'; expected \"name = words\" with a name of its own", printable(line, 60)));
    }
    places_[name] = rules_.size();
    rules_.push_back({name, line.substr(equals + 1), number});
  }

  [[noreturn]] void fail(std::size_t line, const std::string& what) const {
    throw InputError(file_, std::to_string(line), what);
  }

  Phrases phrasesOf(const Rule& rule) {
    if (const auto known = known_.find(rule.name); known != known_.end()) {
      for (const std::string& phrase : known->second) charge(1, phrase.size(), rule);
      return known->second;
    }
    if (!open_.insert(rule.name).second) fail(rule.line, fmt::format("the rule '{}' holds itself", rule.name));
    std::string_view rest = rule.body;
    Phrases phrases = choice(rest, rule, 0);
    if (!rest.empty()) fail(rule.line, fmt::format("found '{}' that nothing opened", rest.front()));
    open_.erase(rule.name);
    return known_[rule.name] = std::move(phrases);
  }

  Phrases choice(std::string_view& rest, const Rule& rule, int depth) {
    if (depth > kDeepest) fail(rule.line, "has too many brackets in each other");
    Phrases all = sequence(rest, rule, depth);
    while (rest.starts_with('|')) {
      rest.remove_prefix(1);
      Phrases more = sequence(rest, rule, depth);
      all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
      expectFew(all.size(), rule);
    }
    return all;
  }

  Phrases sequence(std::string_view& rest, const Rule& rule, int depth) {
    Phrases phrases = {""};
    while (true) {
      rest.remove_prefix(std::min(rest.find_first_not_of(kBlanks), rest.size()));
      if (rest.empty() || rest.front() == '|' || rest.front() == ']' || rest.front() == ')') return phrases;
      phrases = joined(phrases, item(rest, rule, depth), rule);
    }
  }

  Phrases item(std::string_view& rest, const Rule& rule, int depth) {
    const char sign = rest.front();
    if (sign == '[' || sign == '(') {
      rest.remove_prefix(1);
      Phrases phrases = choice(rest, rule, depth + 1);
      const char closing = sign == '[' ? ']' : ')';
      if (!rest.starts_with(closing)) fail(rule.line, fmt::format("found '{}' without its '{}'", sign, closing));
      rest.remove_prefix(1);
      if (sign == '[') phrases.insert(phrases.begin(), "");
      return phrases;
    }
    if (sign == '<') return ruleNamed(rest, rule);
    if (sign == '>') fail(rule.line, "found '>' that nothing opened");
    const std::size_t end = std::min(rest.find_first_of(" \t\r|[]()<>"), rest.size());
    const Phrases word = {std::string(rest.substr(0, end))};
    rest.remove_prefix(end);
    return word;
  }

  Phrases ruleNamed(std::string_view& rest, const Rule& rule) {
    const std::size_t end = rest.find('>');
    if (end == std::string_view::npos) fail(rule.line, "found '<' without its '>'");
    const std::string name(trimmed(rest.substr(1, end - 1)));
    const auto place = places_.find(name);
    if (place == places_.end())
      fail(rule.line, fmt::format("found <{}>; expected a rule of this grammar", printable(name)));
    if (open_.size() > unsignedIndex(kDeepest)) fail(rule.line, "has too many rules in each other");
    rest.remove_prefix(end + 1);
    return phrasesOf(rules_[place->second]);
  }

  void expectFew(std::size_t count, const Rule& rule) const {
    if (count <= kMostGrammarSentences) return;
    fail(rule.line, fmt::format("has more than {} sentences; expected fewer", kMostGrammarSentences));
  }

  /// Before `count` phrases of `length` bytes each are made.
  void charge(std::size_t count, std::size_t length, const Rule& rule) {
    if (length > kLongestSentence) {
      fail(rule.line, fmt::format("makes a sentence of over {} letters; expected shorter ones", kLongestSentence));
    }
    bytes_ += count * (length + sizeof(std::string));
    if (bytes_ > kMostBytes) fail(rule.line, "makes too much text; expected fewer or shorter sentences");
  }

  Phrases joined(const Phrases& heads, const Phrases& tails, const Rule& rule) {
    expectFew(heads.size() * tails.size(), rule);
    std::size_t longest_tail = 0;
    for (const std::string& tail : tails) longest_tail = std::max(longest_tail, tail.size());
    for (const std::string& head : heads) charge(tails.size(), head.size() + 1 + longest_tail, rule);
    Phrases all;
    all.reserve(heads.size() * tails.size());
    for (const std::string& head : heads) {
      for (const std::string& tail : tails)
        all.push_back(head.empty() || tail.empty() ? head + tail : head + " " + tail);
    }
    return all;
  }

  std::string file_;
  std::vector<Rule> rules_;
  std::map<std::string, std::size_t> places_;
  std::map<std::string, Phrases> known_;
  std::set<std::string> open_;
  std::size_t bytes_ = 0;
};

constexpr std::size_t kPairs = kPhoneCount * kPhoneCount;
/// A pair that is held already is worth this share of a new one, divided by how often it is held.
constexpr double kWorthAgain = 0.01;

/// In the order of speech.
std::vector<std::size_t> allPairsOf(const Prompt& prompt) {
  std::vector<std::size_t> pairs;
  std::size_t before = static_cast<std::size_t>(Phone::kSil);
  const auto add = [&](Phone phone) {
    pairs.push_back(before * kPhoneCount + static_cast<std::size_t>(phone));
    before = static_cast<std::size_t>(phone);
  };
  for (const Phone phone : prompt.phones) add(phone);
  add(Phone::kSil);
  return pairs;
}

std::vector<std::size_t> pairsOf(const Prompt& prompt) {
  std::vector<std::size_t> pairs = allPairsOf(prompt);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

struct Candidate {
  double worth;
  std::size_t sentence;
  std::size_t judged_at;  ///< how many sentences were chosen when it was judged
  bool operator<(const Candidate& other) const {
    return worth != other.worth ? worth < other.worth : sentence > other.sentence;
  }
};

}  // namespace

std::vector<std::string> sentencesOfGrammar(std::string_view text, std::string_view file) {
  return Grammar(text, file).sentences();
}

PairShares pairShares(const std::vector<Prompt>& running) {
  PairShares shares{};
  double all = 0;
  for (const Prompt& prompt : running) {
    for (const std::size_t pair : allPairsOf(prompt)) {
      shares[pair] += 1;
      all += 1;
    }
  }
  for (double& share : shares) share /= std::max(all, 1.0);
  return shares;
}

std::string pairSharesToCsv(const PairShares& shares) {
  std::vector<std::size_t> met;
  for (std::size_t pair = 0; pair < shares.size(); ++pair) {
    if (shares[pair] > 0) met.push_back(pair);
  }
  std::stable_sort(met.begin(), met.end(), [&](std::size_t a, std::size_t b) { return shares[a] > shares[b]; });
  std::string text = "left,right,share\n";
  for (const std::size_t pair : met) {
    const auto left = static_cast<Phone>(pair / kPhoneCount), right = static_cast<Phone>(pair % kPhoneCount);
    text += fmt::format("{},{},{:.7f}\n", phoneName(left), phoneName(right), shares[pair]);
  }
  return text;
}

PairShares parsePairShares(std::string_view text, std::string_view file) {
  PairShares shares{};
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.front() == '#' || line == "left,right,share") continue;
    const std::size_t first = std::min(line.find(','), line.size()), second = line.find(',', first + 1);
    const auto field = [&](std::size_t from, std::size_t to) { return from <= to ? line.substr(from, to - from) : ""; };
    const bool has_fields = second != std::string_view::npos;
    const auto left = phoneFromName(field(0, first));
    const auto right = has_fields ? phoneFromName(field(first + 1, second)) : std::nullopt;
    const auto share = has_fields ? parseNumber(line.substr(second + 1)) : std::nullopt;
    if (!left || !right || !share || !(*share >= 0 && *share <= 1))
      throw InputError(
          std::string(file), std::to_string(number),
          fmt::format("found '{}'; expected two phones and a share, \"AH,N,0.0123\"", printable(line, 60)));
    double& known = shares[static_cast<std::size_t>(*left) * kPhoneCount + static_cast<std::size_t>(*right)];
    if (known > 0)
      throw InputError(std::string(file), std::to_string(number), fmt::format("'{}' stands there twice", line));
    known = *share;
  }
  return shares;
}

ChosenPrompts choosePrompts(const std::vector<Prompt>& prompts, std::size_t count, const PairShares* weights) {
  std::vector<std::vector<std::size_t>> pairs;
  std::array<std::size_t, kPairs> held{};
  ChosenPrompts chosen;
  for (const Prompt& prompt : prompts) {
    pairs.push_back(pairsOf(prompt));
    for (const std::size_t pair : pairs.back()) held[pair] = 1;
  }
  chosen.possible_pairs = unsignedIndex(std::count(held.begin(), held.end(), std::size_t{1}));
  held.fill(0);
  const auto worth_of = [&](std::size_t sentence) {
    double worth = 0;
    for (const std::size_t pair : pairs[sentence]) {
      const double weight = weights == nullptr ? 1.0 : (*weights)[pair];
      worth += weight * (held[pair] == 0 ? 1.0 : kWorthAgain / asReal(held[pair]));
    }
    return worth / std::sqrt(asReal(prompts[sentence].phones.size() + 1));
  };
  // A sentence's worth only falls as others are chosen, so the best of the old judgements, judged again, is the best.
  std::priority_queue<Candidate> candidates;
  for (std::size_t i = 0; i < prompts.size(); ++i) candidates.push({worth_of(i), i, 0});
  std::size_t different = 0;
  double share = 0;
  while (chosen.sentences.size() < count && !candidates.empty()) {
    const Candidate best = candidates.top();
    candidates.pop();
    if (best.judged_at < chosen.sentences.size()) {
      candidates.push({worth_of(best.sentence), best.sentence, chosen.sentences.size()});
      continue;
    }
    for (const std::size_t pair : pairs[best.sentence]) {
      if (held[pair]++ != 0) continue;
      ++different;
      if (weights != nullptr) share += (*weights)[pair];
    }
    if (weights != nullptr) chosen.shares.push_back(share);
    chosen.sentences.push_back(best.sentence);
    chosen.pairs.push_back(different);
  }
  return chosen;
}

}  // namespace mouthpiece
