#include "corpus_tools/sample/sample_corpus.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <sstream>

namespace mouthpiece {

extern const std::string_view kSampleSentences, kRichSentences;

namespace {

constexpr std::array kExactness = {"", "exactly", "just after", "a little after", "almost"};
constexpr std::array kMinutes = {
    "",          "five past",      "ten past",  "quarter past", "twenty past", "twenty-five past",
    "half past", "twenty-five to", "twenty to", "quarter to",   "ten to",      "five to"};
constexpr std::array kHours = {"one",   "two",   "three", "four", "five",   "six",
                               "seven", "eight", "nine",  "ten",  "eleven", "twelve"};
constexpr std::array kDayInfo = {"in the morning", "in the afternoon", "am", "pm"};

std::vector<std::string> wordsOf(const TimeSentence& sentence) {
  std::istringstream stream(sentence.text());
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

/// First and last sound of the words, for the pairs of sounds across word boundaries.
struct WordEdges {
  const char* first;
  const char* last;
};
const std::map<std::string, WordEdges>& wordEdges() {
  static const std::map<std::string, WordEdges> kEdges = {
      {"the", {"DH", "AH"}},     {"time", {"T", "M"}},     {"is", {"IH", "Z"}},         {"now", {"N", "AW"}},
      {"exactly", {"IH", "IY"}}, {"just", {"JH", "T"}},    {"after", {"AE", "ER"}},     {"a", {"AH", "AH"}},
      {"little", {"L", "L"}},    {"almost", {"AO", "T"}},  {"past", {"P", "T"}},        {"to", {"T", "UW"}},
      {"quarter", {"K", "ER"}},  {"twenty", {"T", "IY"}},  {"twenty-five", {"T", "V"}}, {"half", {"HH", "F"}},
      {"one", {"W", "N"}},       {"two", {"T", "UW"}},     {"three", {"TH", "IY"}},     {"four", {"F", "R"}},
      {"five", {"F", "V"}},      {"six", {"S", "S"}},      {"seven", {"S", "N"}},       {"eight", {"EY", "T"}},
      {"nine", {"N", "N"}},      {"ten", {"T", "N"}},      {"eleven", {"IH", "N"}},     {"twelve", {"T", "V"}},
      {"in", {"IH", "N"}},       {"morning", {"M", "NG"}}, {"afternoon", {"AE", "N"}},  {"am", {"AE", "M"}},
      {"pm", {"P", "M"}}};
  return kEdges;
}

/// A thing worth having in the corpus: much the first time, less each time again.
struct Thing {
  int worth_first;
  int worth_again;  ///< divided by how often it is there already
};

constexpr Thing kWordPair{100000, 60};
constexpr Thing kSoundPair{2000, 0};
constexpr Thing kWord{0, 1200};  ///< evens out how often the words occur
constexpr Thing kWordTriple{40, 0};

struct Catalogue {
  std::vector<TimeSentence> sentences;
  std::vector<std::vector<std::size_t>> things_of;  ///< of each sentence: indices into `things`
  std::vector<Thing> things;
};

Catalogue makeCatalogue() {
  Catalogue catalogue{allTimeSentences(), {}, {}};
  std::map<std::string, std::size_t> numbers;
  for (const TimeSentence& sentence : catalogue.sentences) {
    std::set<std::size_t> held;
    const auto add = [&](const std::string& name, const Thing& thing) {
      const auto [entry, is_new] = numbers.try_emplace(name, catalogue.things.size());
      if (is_new) catalogue.things.push_back(thing);
      held.insert(entry->second);
    };
    const std::vector<std::string> words = wordsOf(sentence);
    for (std::size_t i = 1; i < words.size(); ++i) {
      add("word " + words[i], kWord);
      add("pair " + words[i - 1] + " " + words[i], kWordPair);
      const auto &left = wordEdges().at(words[i - 1]), &right = wordEdges().at(words[i]);
      add(std::string("sounds ") + left.last + " " + right.first, kSoundPair);
      if (i > 1) add("triple " + words[i - 2] + " " + words[i - 1] + " " + words[i], kWordTriple);
    }
    catalogue.things_of.emplace_back(held.begin(), held.end());
  }
  return catalogue;
}

/// A set of sentences and how often it holds each thing.
class Choice {
 public:
  explicit Choice(const Catalogue& catalogue)
      : catalogue_(catalogue), held_(catalogue.things.size(), 0), chosen_(catalogue.sentences.size(), false) {}

  void add(std::size_t sentence) { change(sentence, 1); }
  void remove(std::size_t sentence) { change(sentence, -1); }

  /// What adding the sentence would bring, or what removing it took.
  [[nodiscard]] int gain(std::size_t sentence) const {
    int sum = 0;
    for (const std::size_t i : catalogue_.things_of[sentence]) {
      const Thing& thing = catalogue_.things[i];
      sum += held_[i] == 0 ? thing.worth_first + thing.worth_again : thing.worth_again / (held_[i] + 1);
    }
    return sum;
  }

  /// The sentence, not chosen yet, that brings the most; the first of equals.
  [[nodiscard]] std::size_t best() const {
    std::size_t best = 0;
    int best_gain = -1;
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      if (chosen_[i]) continue;
      if (const int now = gain(i); now > best_gain) best_gain = now, best = i;
    }
    return best;
  }

 private:
  void change(std::size_t sentence, int by) {
    chosen_[sentence] = by > 0;
    for (const std::size_t thing : catalogue_.things_of[sentence]) held_[thing] += by;
  }

  const Catalogue& catalogue_;
  std::vector<int> held_;
  std::vector<bool> chosen_;
};

/// Takes one sentence out and puts the best one in, until no exchange helps.
bool exchangeOnes(Choice& choice, std::vector<std::size_t>& chosen) {
  bool helped = false;
  for (bool better = true; better;) {
    better = false;
    for (std::size_t& sentence : chosen) {
      choice.remove(sentence);
      const std::size_t candidate = choice.best();
      if (choice.gain(candidate) > choice.gain(sentence)) sentence = candidate, better = helped = true;
      choice.add(sentence);
    }
  }
  return helped;
}

/// The same with two sentences at a time; each pair is tried once.
bool exchangeTwos(Choice& choice, std::vector<std::size_t>& chosen) {
  bool helped = false;
  for (std::size_t i = 1; i < chosen.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      choice.remove(chosen[i]);
      const int worth_second = choice.gain(chosen[i]);
      choice.remove(chosen[j]);
      const int worth = worth_second + choice.gain(chosen[j]);
      const std::size_t first = choice.best();
      const int gain_first = choice.gain(first);
      choice.add(first);
      const std::size_t second = choice.best();
      if (gain_first + choice.gain(second) > worth) {
        chosen[i] = first, chosen[j] = second, helped = true;
        choice.add(second);
        continue;
      }
      choice.remove(first);
      choice.add(chosen[i]);
      choice.add(chosen[j]);
    }
  }
  return helped;
}

}  // namespace

std::string TimeSentence::text() const {
  std::string text = "the time is now";
  for (const std::string* part : {&exactness, &minutes, &hours, &day_info}) {
    if (!part->empty()) text += " " + *part;
  }
  return text;
}

std::vector<TimeSentence> allTimeSentences() {
  std::vector<TimeSentence> sentences;
  for (const char* exactness : kExactness) {
    for (const char* minutes : kMinutes) {
      for (const char* hours : kHours) {
        for (const char* day_info : kDayInfo) sentences.push_back({exactness, minutes, hours, day_info});
      }
    }
  }
  return sentences;
}

std::vector<TimeSentence> chooseTimeSentences(std::size_t count) {
  const Catalogue catalogue = makeCatalogue();
  count = std::min(count, catalogue.sentences.size());
  Choice choice(catalogue);
  std::vector<std::size_t> chosen;
  while (chosen.size() < count) {
    chosen.push_back(choice.best());
    choice.add(chosen.back());
  }
  exchangeOnes(choice, chosen);
  while (exchangeTwos(choice, chosen)) exchangeOnes(choice, chosen);
  std::sort(chosen.begin(), chosen.end());
  std::vector<TimeSentence> sentences;
  for (const std::size_t sentence : chosen) sentences.push_back(catalogue.sentences[sentence]);
  return sentences;
}

std::vector<std::string> sampleSentences(SamplePrompts prompts) {
  std::vector<std::string> texts;
  const auto add = [&](std::string_view list) {
    std::istringstream stream{std::string(list)};
    for (std::string line; std::getline(stream, line);) {
      if (!line.empty() && !line.starts_with('#')) texts.push_back(line);
    }
  };
  add(kSampleSentences);
  if (prompts == SamplePrompts::kRich) add(kRichSentences);
  return texts;
}

}  // namespace mouthpiece
