#include "hearing/alignment/pronouncer.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "phonetics/text/speakable_text.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxDictionaryBytes = std::uint64_t{64} << 20U;

/// Bytes beyond ASCII belong to a language's own letters.
bool isLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || static_cast<unsigned char>(c) >= 0x80;
}
bool isWordCharacter(char c) { return isLetter(c) || (c >= '0' && c <= '9') || c == '\'' || c == '-' || c == '.'; }

/// Lines of "word PHONE PHONE ..." and "word(2) ..."; without stress. Kept as they stand in the file, sorted: a line of
/// text must not wait for a table of 135,000 words of which it needs ten.
class Dictionary {
 public:
  explicit Dictionary(const Language& language) {
    const std::filesystem::path path = std::filesystem::path(MOUTHPIECE_SPHINX_MODELS) / language.dictionary;
    if (language.dictionary.empty() || !std::filesystem::exists(path)) return;
    text_ = readFile(path, kMaxDictionaryBytes);
    lines_.reserve(150'000);
    std::vector<std::string_view> misplaced;
    for (std::string_view rest = text_; !rest.empty();) {
      const std::size_t end = std::min(rest.find('\n'), rest.size());
      const std::string_view line = rest.substr(0, end);
      rest.remove_prefix(std::min(end + 1, rest.size()));
      if (line.find(' ') == std::string_view::npos) continue;
      (lines_.empty() || lines_.back() <= line ? lines_ : misplaced).push_back(line);
    }
    // The file is sorted but for a few lines. A blank sorts before every letter, so lines sort as their words do.
    std::sort(misplaced.begin(), misplaced.end());
    const auto middle = lines_.insert(lines_.end(), misplaced.begin(), misplaced.end());
    std::inplace_merge(lines_.begin(), middle, lines_.end());
  }

  [[nodiscard]] bool isEmpty() const { return lines_.empty(); }

  [[nodiscard]] std::vector<Pronunciation> find(const std::string& word) const {
    std::vector<Pronunciation> ways;
    for (int variant = 1;; ++variant) {
      const std::string start = variant == 1 ? fmt::format("{} ", word) : fmt::format("{}({}) ", word, variant);
      const auto found = std::lower_bound(lines_.begin(), lines_.end(), start);
      if (found == lines_.end() || !found->starts_with(start)) return ways;
      ways.push_back(parse(found->substr(start.size())));
    }
  }

  [[nodiscard]] std::vector<std::vector<Phone>> usualWays() const {
    std::vector<std::vector<Phone>> ways;
    for (const std::string_view line : lines_) {
      const std::size_t blank = line.find(' ');
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

  std::string text_;
  std::vector<std::string_view> lines_;
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

  [[nodiscard]] std::vector<Pronunciation> fromLexicon(std::string_view word) const {
    return lexicon == nullptr ? std::vector<Pronunciation>() : lexicon->find(word);
  }

  [[nodiscard]] std::vector<Pronunciation> waysOf(const std::string& word) const {
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
    : state_(new State{lexicon, language, Dictionary(language)}) {}
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

bool Pronouncer::knows(std::string_view word) const {
  if (state_->dictionary.isEmpty() || !isSpelled(word) || !state_->fromLexicon(word).empty()) return true;
  return !state_->dictionary.find(lowerCase(word)).empty();
}

std::vector<std::vector<Phone>> dictionaryWords(const Language& language) { return Dictionary(language).usualWays(); }

}  // namespace mouthpiece
