// Grammars and choices against the plainest way to say what they mean: random cases, the seed in the trace.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "base/errors.h"
#include "base/index.h"
#include "corpus_tools/report/prompts.h"
#include "phonetics/text/lexicon.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

constexpr unsigned kSeeds = 120;

/// A grammar's part as its text, and all it can say, in the order in which the page of the format lists them.
struct Part {
  std::string text;
  std::vector<std::string> says;
};

Part randomPart(std::mt19937& random, int depth, const std::vector<Part>& rules);

Part word(std::mt19937& random) {
  const std::vector<std::string> words{"one", "two", "it's", "twenty-five", "now"};
  const std::string& chosen = words[random() % words.size()];
  return {chosen, {chosen}};
}

Part inSequence(std::mt19937& random, int depth, const std::vector<Part>& rules) {
  Part all{"", {""}};
  for (std::size_t n = 1 + random() % 3; n > 0; --n) {
    const Part next = randomPart(random, depth, rules);
    all.text += (all.text.empty() ? "" : " ") + next.text;
    std::vector<std::string> joined;
    for (const std::string& head : all.says) {
      for (const std::string& tail : next.says)
        joined.push_back(head + (head.empty() || tail.empty() ? "" : " ") + tail);
    }
    all.says = joined;
  }
  return all;
}

Part asChoice(std::mt19937& random, int depth, const std::vector<Part>& rules) {
  Part all = inSequence(random, depth, rules);
  for (std::size_t n = random() % 3; n > 0; --n) {
    const Part other = inSequence(random, depth, rules);
    all.text += (random() % 2 == 0 ? " | " : "|") + other.text;
    all.says.insert(all.says.end(), other.says.begin(), other.says.end());
  }
  return all;
}

Part randomPart(std::mt19937& random, int depth, const std::vector<Part>& rules) {
  const std::size_t kind = depth == 0 ? 0 : random() % 5;
  if (kind == 1) {
    Part group = asChoice(random, depth - 1, rules);
    group.text = "(" + group.text + ")";
    return group;
  }
  if (kind == 2) {
    Part optional = asChoice(random, depth - 1, rules);
    optional.text = "[ " + optional.text + " ]";
    optional.says.insert(optional.says.begin(), "");
    return optional;
  }
  if (kind == 3 && !rules.empty()) {
    const std::size_t rule = random() % rules.size();
    return {"<rule" + std::to_string(rule) + ">", rules[rule].says};
  }
  return word(random);
}

TEST(PromptGrammarLaws, SaysWhatItsPartsSay) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937 random(seed);
    std::vector<Part> rules;
    for (std::size_t n = random() % 3; n > 0; --n) rules.push_back(asChoice(random, 1, rules));
    const Part sentence = asChoice(random, 2, rules);
    if (sentence.says.size() > 20000) continue;
    std::string grammar = "# a comment\nsentence = " + sentence.text + " # and another\n\n";
    for (std::size_t i = 0; i < rules.size(); ++i)
      grammar += "rule" + std::to_string(i) + "\t= " + rules[i].text + "\r\n";
    SCOPED_TRACE(grammar);
    std::vector<std::string> once;
    std::set<std::string> seen;
    for (const std::string& each : sentence.says) {
      if (!each.empty() && seen.insert(each).second) once.push_back(each);
    }
    EXPECT_EQ(sentencesOfGrammar(grammar, "g.txt"), once);
  }
}

TEST(PromptGrammarLaws, BracketsLeftOpenAreNamedWithTheirLine) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937 random(seed);
    std::string text = asChoice(random, 3, {}).text;
    const std::size_t at = text.find_first_of("()[]");
    if (at == std::string::npos) continue;
    text.erase(at, 1);
    SCOPED_TRACE(text);
    try {
      (void)sentencesOfGrammar("\n\ns = " + text, "g.txt");
      FAIL() << "a bracket is missing";
    } catch (const InputError& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with("g.txt:3: ")) << error.what();
    }
  }
}

std::vector<Prompt> randomPrompts(std::mt19937& random) {
  std::vector<Prompt> prompts(1 + random() % 25);
  for (std::size_t i = 0; i < prompts.size(); ++i) {
    prompts[i].text = std::to_string(i);
    for (std::size_t n = 1 + random() % 8; n > 0; --n) prompts[i].phones.push_back(static_cast<Phone>(random() % 9));
  }
  return prompts;
}

using Pair = std::pair<Phone, Phone>;

std::set<Pair> pairsOf(const Prompt& prompt) {
  std::set<Pair> pairs;
  Phone before = Phone::kSil;
  for (const Phone phone : prompt.phones) {
    pairs.insert({before, phone});
    before = phone;
  }
  pairs.insert({before, Phone::kSil});
  return pairs;
}

/// Greedy by its definition: every sentence is judged anew in every round.
std::vector<std::size_t> plainChoice(const std::vector<Prompt>& prompts, std::size_t count) {
  std::map<Pair, int> held;
  std::vector<std::size_t> chosen;
  while (chosen.size() < std::min(count, prompts.size())) {
    std::size_t best = prompts.size();
    double best_worth = -1;
    for (std::size_t i = 0; i < prompts.size(); ++i) {
      if (std::find(chosen.begin(), chosen.end(), i) != chosen.end()) continue;
      double worth = 0;
      for (const Pair& pair : pairsOf(prompts[i])) worth += held[pair] == 0 ? 1.0 : 0.01 / held[pair];
      worth /= std::sqrt(asReal(prompts[i].phones.size() + 1));
      if (worth > best_worth) best_worth = worth, best = i;
    }
    for (const Pair& pair : pairsOf(prompts[best])) ++held[pair];
    chosen.push_back(best);
  }
  return chosen;
}

TEST(PromptChoiceLaws, IsThePlainGreedyChoice) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const std::vector<Prompt> prompts = randomPrompts(random);
    const std::size_t count = random() % 30;
    const ChosenPrompts chosen = choosePrompts(prompts, count);
    EXPECT_EQ(chosen.sentences, plainChoice(prompts, count));
    std::set<Pair> held, possible;
    for (const Prompt& prompt : prompts) possible.merge(pairsOf(prompt));
    EXPECT_EQ(chosen.possible_pairs, possible.size());
    ASSERT_EQ(chosen.pairs.size(), chosen.sentences.size());
    for (std::size_t i = 0; i < chosen.sentences.size(); ++i) {
      held.merge(pairsOf(prompts[chosen.sentences[i]]));
      EXPECT_EQ(chosen.pairs[i], held.size()) << "the curve counts different pairs";
    }
  }
}

/// Words of random phones, said one after the other with pauses: the lexicon finds them again.
TEST(TakeLabelsLaws, WordsAreFoundUnderTheirPhones) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const std::vector<std::string> sounds{"B", "IY", "N", "AA", "M"};
    std::map<std::string, std::vector<std::string>> spelt;
    std::string lines;
    for (const char* word : {"uno", "due", "tre", "quattro"}) {
      for (std::size_t n = 1 + random() % 3; n > 0; --n) spelt[word].push_back(sounds[random() % sounds.size()]);
      lines += word;
      for (const std::string& sound : spelt[word]) lines += " " + sound;
      lines += "\n";
    }
    SyntheticTake take;
    take.phones = {"sil"};
    std::string text;
    std::vector<std::size_t> lengths;
    for (std::size_t n = 1 + random() % 6; n > 0; --n) {
      const auto word = std::next(spelt.begin(), static_cast<std::ptrdiff_t>(random() % spelt.size()));
      text += (text.empty() ? "" : ", ") + word->first;
      lengths.push_back(word->second.size());
      take.phones.insert(take.phones.end(), word->second.begin(), word->second.end());
      if (n > 1 && random() % 3 == 0) take.phones.emplace_back("sil");
    }
    take.phones.emplace_back("sil");
    SpeechLabels phones_only = take.labels();
    phones_only.words.clear();
    const Lexicon lexicon = Lexicon::parse(lines, "lexicon");
    const std::optional<SpeechLabels> found = withWords(phones_only, text, lexicon);
    ASSERT_TRUE(found.has_value()) << text << "\n" << lines;
    EXPECT_EQ(found->words.size(), lengths.size());
    EXPECT_EQ(found->phones.size(), take.phones.size());
    EXPECT_FALSE(withWords(phones_only, text + " cinque", lexicon)) << "an unknown word";
    EXPECT_FALSE(withWords(phones_only, text + " uno", lexicon)) << "a word too many";
  }
}

}  // namespace
}  // namespace mouthpiece
