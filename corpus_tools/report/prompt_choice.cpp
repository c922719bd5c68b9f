#include "corpus_tools/report/prompt_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>

namespace mouthpiece {
namespace {

constexpr std::size_t kPairs = kPhoneCount * kPhoneCount;
/// A pair that is held already is worth this share of a new one, divided by how often it is held.
constexpr double kWorthAgain = 0.01;

std::vector<std::size_t> pairsOf(const Prompt& prompt) {
  std::vector<std::size_t> pairs;
  std::size_t before = static_cast<std::size_t>(Phone::kSil);
  const auto add = [&](Phone phone) {
    pairs.push_back(before * kPhoneCount + static_cast<std::size_t>(phone));
    before = static_cast<std::size_t>(phone);
  };
  for (const Phone phone : prompt.phones) add(phone);
  add(Phone::kSil);
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

ChosenPrompts choosePrompts(const std::vector<Prompt>& prompts, std::size_t count) {
  std::vector<std::vector<std::size_t>> pairs;
  std::array<std::size_t, kPairs> held{};
  ChosenPrompts chosen;
  for (const Prompt& prompt : prompts) {
    pairs.push_back(pairsOf(prompt));
    for (const std::size_t pair : pairs.back()) held[pair] = 1;
  }
  chosen.possible_pairs = static_cast<std::size_t>(std::count(held.begin(), held.end(), std::size_t{1}));
  held.fill(0);
  const auto worth_of = [&](std::size_t sentence) {
    double worth = 0;
    for (const std::size_t pair : pairs[sentence]) {
      worth += held[pair] == 0 ? 1.0 : kWorthAgain / static_cast<double>(held[pair]);
    }
    return worth / std::sqrt(static_cast<double>(prompts[sentence].phones.size() + 1));
  };
  // A sentence's worth only falls as others are chosen, so the best of the old judgements, judged again, is the best.
  std::priority_queue<Candidate> candidates;
  for (std::size_t i = 0; i < prompts.size(); ++i) candidates.push({worth_of(i), i, 0});
  std::size_t different = 0;
  while (chosen.sentences.size() < count && !candidates.empty()) {
    const Candidate best = candidates.top();
    candidates.pop();
    if (best.judged_at < chosen.sentences.size()) {
      candidates.push({worth_of(best.sentence), best.sentence, chosen.sentences.size()});
      continue;
    }
    for (const std::size_t pair : pairs[best.sentence]) different += held[pair]++ == 0 ? 1 : 0;
    chosen.sentences.push_back(best.sentence);
    chosen.pairs.push_back(different);
  }
  return chosen;
}

}  // namespace mouthpiece
