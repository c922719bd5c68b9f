#include "hearing/alignment/pronouncer.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "base/errors.h"
#include "base/file_parts.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "phonetics/text/speakable_text.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxDictionaryBytes = std::uint64_t{64} << 20U;

/// Bytes beyond ASCII belong to a language's own letters.
bool isLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || static_cast<unsigned char>(c) >= 0x80;
}
bool isWordCharacter(char c) { return isLetter(c) || (c >= '0' && c <= '9') || c == '\'' || c == '-' || c == '.'; }

/// Lines of "word PHONE PHONE ..." and "word(2) ..."; without stress. Sorted in the file, but for a few that stand
/// beside their place, and looked up there: a line of text must not wait for 135,000 words of which it needs ten.
class Dictionary {
 public:
  explicit Dictionary(const Language& language) {
    const std::filesystem::path path = std::filesystem::path(MOUTHPIECE_SPHINX_MODELS) / language.dictionary;
    if (!language.dictionary.empty() && std::filesystem::exists(path)) file_.emplace(path, kMaxDictionaryBytes);
  }

  [[nodiscard]] bool isEmpty() const { return !file_ || file_->size() == 0; }

  [[nodiscard]] std::vector<Pronunciation> find(const std::string& word) const {
    std::vector<Pronunciation> ways;
    for (int variant = 1; !isEmpty(); ++variant) {
      const std::string start = variant == 1 ? fmt::format("\n{} ", word) : fmt::format("\n{}({}) ", word, variant);
      const std::string near = linesAround(std::string_view(start).substr(1));
      const std::size_t found = near.find(start);
      if (found == std::string::npos) break;
      const std::size_t first = found + start.size();
      ways.push_back(parse(std::string_view(near).substr(first, near.find('\n', first) - first)));
    }
    return ways;
  }

  [[nodiscard]] std::vector<std::vector<Phone>> usualWays() const {
    std::vector<std::vector<Phone>> ways;
    const std::string all = isEmpty() ? std::string() : file_->bytes(0, file_->size());
    LineReader lines(all);
    for (std::string_view line; lines.next(line);) {
      const std::size_t blank = line.find(' ');
      if (blank == std::string_view::npos) continue;
      if (blank > 0 && line[blank - 1] != ')') ways.push_back(parse(line.substr(blank + 1)).phones);
    }
    return ways;
  }

 private:
  static Pronunciation parse(std::string_view names) {
    Pronunciation way;
    while (!names.empty()) {
      const std::size_t end = std::min(names.find(' '), names.size());
      if (const auto phone = phoneFromName(names.substr(0, end))) {
        way.phones.push_back(*phone);
        way.stress.push_back(-1);
      }
      names.remove_prefix(std::min(end + 1, names.size()));
    }
    return way;
  }

  /// Whole lines, each after a line's end, among which the one that begins with `start` is if there is one. A blank
  /// sorts before every letter, so lines sort as their words do.
  [[nodiscard]] std::string linesAround(std::string_view start) const {
    constexpr std::uint64_t kEnough = 4096, kBytesBeside = 512;  // bytes; a line has some 30
    std::uint64_t low = 0, high = file_->size();
    while (high - low > kEnough) {
      const std::uint64_t middle = low + (high - low) / 2;
      const std::string line = file_->bytes(middle, kBytesBeside);
      const bool is_before = line.substr(std::min(line.find('\n'), line.size() - 1) + 1) < start;
      (is_before ? low : high) = middle;
    }
    low -= std::min(low, kBytesBeside);
    return (low == 0 ? "\n" : "") + file_->bytes(low, high + kBytesBeside - low);
  }

  std::optional<FileReader> file_;
};

/// Stress goes by the order of the vowels: ways of one word differ in vowels, seldom in their number.
void lendStress(Pronunciation& way, const Pronunciation& stressed) {
  std::vector<int> of_vowels;
  for (std::size_t i = 0; i < stressed.phones.size(); ++i) {
    if (isVowel(stressed.phones[i])) of_vowels.push_back(stressed.stress[i]);
  }
  const auto vowels = std::count_if(way.phones.begin(), way.phones.end(), isVowel);
  if (vowels != signedIndex(of_vowels.size())) return;
  std::size_t next = 0;
  for (std::size_t i = 0; i < way.phones.size(); ++i) {
    if (isVowel(way.phones[i])) way.stress[i] = of_vowels[next++];
  }
}

bool hasStress(const Pronunciation& way) {
  return std::any_of(way.stress.begin(), way.stress.end(), [](int stress) { return stress >= 0; });
}

std::vector<std::string> splitAt(std::string_view text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c != separator) {
      parts.back() += c;
    } else if (!parts.back().empty()) {
      parts.emplace_back();
    }
  }
  if (parts.back().empty()) parts.pop_back();
  return parts;
}

/// "(quarter," -> "quarter"; "9:25" stays.
std::string_view withoutPunctuation(std::string_view token) {
  const auto is_inner = [](char c) { return isWordCharacter(c) && c != '-' && c != '.'; };
  const auto first = std::find_if(token.begin(), token.end(), is_inner);
  const auto last = std::find_if(token.rbegin(), std::make_reverse_iterator(first), is_inner).base();
  return {first, last};
}

bool isSpelled(std::string_view token) {
  return std::all_of(token.begin(), token.end(), [](char c) { return isLetter(c) || c == '\''; });
}

}  // namespace

struct Pronouncer::State {
  const Lexicon* lexicon;
  const Language& language;
  Dictionary dictionary;
  mutable std::mutex mutex;  ///< of `kept`
  mutable std::unordered_map<std::string, std::vector<Pronunciation>> kept = {};

  [[nodiscard]] std::vector<Pronunciation> fromLexicon(std::string_view word) const {
    return lexicon == nullptr ? std::vector<Pronunciation>() : lexicon->find(word);
  }

  /// Of words asked for before from memory: all the sentences of a grammar are made of a few words.
  [[nodiscard]] std::vector<Pronunciation> waysOf(const std::string& word) const {
    constexpr std::size_t kMostKept = 20'000;
    {
      const std::scoped_lock lock(mutex);
      if (const auto found = kept.find(word); found != kept.end()) return found->second;
    }
    std::vector<Pronunciation> ways = findWays(word);
    const std::scoped_lock lock(mutex);
    if (kept.size() < kMostKept) kept.emplace(word, ways);
    return ways;
  }

  [[nodiscard]] std::vector<Pronunciation> findWays(const std::string& word) const {
    std::vector<Pronunciation> ways = fromLexicon(word);
    if (ways.empty()) ways = dictionary.find(lowerCase(word));
    const Pronunciation by_rule = language.pronounce(word);
    if (ways.empty() && !by_rule.phones.empty()) ways.push_back(by_rule);
    for (Pronunciation& way : ways) {
      if (!hasStress(way)) lendStress(way, by_rule);
    }
    return ways;
  }

  void addWord(std::vector<TranscriptWord>& words, const std::string& word) const {
    std::vector<Pronunciation> ways = waysOf(word);
    if (ways.empty()) {
      throw InputError("transcript", "",
                       fmt::format("found '{}', which no lexicon can say; expected a word, or its line in a lexicon",
                                   printable(word)));
    }
    words.push_back({word, std::move(ways)});
  }

  /// The whole text as the language's engine says it; the lexicon's words as the lexicon has them.
  [[nodiscard]] std::vector<TranscriptWord> wordsAsSaid(std::string_view speakable) const {
    constexpr std::size_t kLongestSentence = 400;
    std::vector<TranscriptWord> words;
    for (const std::string& sentence : splitSentences(speakable, kLongestSentence)) {
      for (SaidWord& word : language.say(sentence, language)) {
        std::vector<Pronunciation> ways = fromLexicon(word.text);
        if (ways.empty() && !word.said.phones.empty()) ways.push_back(std::move(word.said));
        if (!ways.empty()) words.push_back({std::move(word.text), std::move(ways)});
      }
    }
    return words;
  }

  /// A token without blanks: as the lexicon has it, letter by letter as it stands, or as the language reads it out.
  void addToken(std::vector<TranscriptWord>& words, std::string_view token) const {
    const std::string_view bare = withoutPunctuation(token);
    if (bare.empty()) return;
    if (isSpelled(bare) || !fromLexicon(bare).empty()) return addWord(words, std::string(bare));
    const auto parts = splitAt(bare, '-');
    if (parts.size() > 1) {
      for (const std::string& part : parts) addToken(words, part);
      return;
    }
    for (const std::string& word : language.read_out(token)) {
      if (const std::string_view spelled = withoutPunctuation(word); !spelled.empty()) {
        addWord(words, std::string(spelled));
      }
    }
  }
};

Pronouncer::Pronouncer(const Lexicon* lexicon, const Language& language)
    : state_(new State{lexicon, language, Dictionary(language), {}}) {}
Pronouncer::~Pronouncer() = default;
Pronouncer::Pronouncer(Pronouncer&&) noexcept = default;
Pronouncer& Pronouncer::operator=(Pronouncer&&) noexcept = default;

std::vector<TranscriptWord> Pronouncer::wordsOf(std::string_view transcript) const {
  const auto is_known = [&](std::string_view word) { return !state_->fromLexicon(word).empty(); };
  const std::string speakable = speakableText(transcript, state_->language, is_known, kMaxTranscriptCharacters);
  if (state_->language.say != nullptr) return state_->wordsAsSaid(speakable);
  std::vector<TranscriptWord> words;
  for (const std::string& token : splitAt(speakable, ' ')) state_->addToken(words, token);
  return words;
}

std::vector<TranscriptWord> Pronouncer::wordsOf(std::string_view word, bool is_loud) const {
  const std::string_view bare = withoutPunctuation(word);
  const bool is_word = is_loud && bare.size() > 1 && isSpelled(bare) && bare != lowerCase(bare) && knows(bare);
  std::vector<TranscriptWord> words = wordsOf(is_word ? lowerCase(word) : std::string(word));
  if (is_word && words.size() == 1) words[0].text = bare;
  return words;
}

const Language& Pronouncer::language() const { return state_->language; }

bool Pronouncer::knows(std::string_view word) const {
  if (state_->dictionary.isEmpty() || !isSpelled(word) || !state_->fromLexicon(word).empty()) return true;
  return !state_->dictionary.find(lowerCase(word)).empty();
}

std::vector<std::vector<Phone>> dictionaryWords(const Language& language) { return Dictionary(language).usualWays(); }

}  // namespace mouthpiece
