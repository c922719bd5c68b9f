#include "phonetics/text/speakable_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "phonetics/text/latin_letters.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kLongestWord = 40;
constexpr std::size_t kLongestPunctuation = 3;  // "..." is said like any number of dots
constexpr std::string_view kKeptSigns = ".,;:!?'-\"()";

bool isDigit(char32_t c) { return c >= '0' && c <= '9'; }
bool isAsciiLetter(char32_t c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// What is written for a sign: ASCII, or words with blanks around them.
std::string_view spelledSign(char32_t c) {
  constexpr std::array<std::pair<char32_t, std::string_view>, 41> kSigns = {{
      {'%', " percent "},   {'&', " and "},
      {'+', " plus "},      {'=', " equals "},
      {'@', " at "},        {0xA7, " section "},
      {0xB0, " degrees "},  {0xB1, " plus or minus "},
      {0xB2, " squared "},  {0xB3, " cubed "},
      {0xB5, " micro "},    {0xBC, " one quarter "},
      {0xBD, " one half "}, {0xBE, " three quarters "},
      {0xD7, " times "},    {0xF7, " divided by "},
      {0xA2, " cents "},    {0xA3, " pounds "},
      {0xA5, " yen "},      {0x20AC, " euros "},
      {0x20B9, " rupees "}, {0x20BD, " roubles "},
      {0x2010, "-"},        {0x2011, "-"},
      {0x2012, "-"},        {0x2013, "-"},
      {0x2014, ", "},       {0x2015, ", "},
      {0x2018, "'"},        {0x2019, "'"},
      {0x201A, "'"},        {0x201B, "'"},
      {0x02BC, "'"},        {0x2032, "'"},
      {0x201C, "\""},       {0x201D, "\""},
      {0x201E, "\""},       {0x2026, "..."},
      {0x2116, " number "}, {0x2212, "-"},
      {0x3002, ". "},
  }};
  for (const auto& [sign, spelled] : kSigns) {
    if (sign == c) return spelled;
  }
  return {};
}

bool isCurrencyBeforeNumber(char32_t c) { return c == 0xA3 || c == 0xA5 || c == 0x20AC || c == 0x20B9 || c == 0x20BD; }

/// Marks that change the letter before them or nothing at all: dropped without leaving a blank.
bool isInvisible(char32_t c) {
  return (c >= 0x0300 && c < 0x0370) || c == 0xAD || (c >= 0x200B && c < 0x2010) || (c >= 0x202A && c < 0x202F) ||
         (c >= 0x2060 && c < 0x2070) || (c >= 0xFE00 && c < 0xFE10) || c == 0xFEFF || c >= 0xE0000;
}

/// Signs of any kind that nobody reads aloud: they separate words.
bool isSign(char32_t c) {
  return c < 0xC0 || (c >= 0x02B0 && c < 0x0300) || (c >= 0x2000 && c < 0x2C00) || (c >= 0x2E00 && c < 0x2E80) ||
         (c >= 0x3000 && c < 0x3005) || (c >= 0x3008 && c < 0x3021) || c == 0x3030 || (c >= 0xFE10 && c < 0xFE70) ||
         (c >= 0xFF5F && c < 0xFF66) || (c >= 0xFFE0 && c <= 0xFFFF) || (c >= 0x1F000 && c < 0x1FB00);
}

std::vector<char32_t> decode(std::string_view text) {
  std::vector<char32_t> characters;
  for (std::size_t i = 0; i < text.size();) {
    const auto c = decodeUtf8(text, i);
    if (!c) throw InputError("text", fmt::format("byte {}", i), "is broken UTF-8; expected text in UTF-8");
    // Full-width forms of ASCII.
    characters.push_back(*c >= 0xFF01 && *c <= 0xFF5E ? *c - 0xFF01 + '!' : *c);
    if (characters.size() > kMaxSpokenCharacters) {
      throw InputError(
          "text", "",
          fmt::format("is longer than {} characters; expected a shorter line, or several", kMaxSpokenCharacters));
    }
  }
  return characters;
}

/// Spells out characters one by one; blanks are put right afterwards.
class Speller {
 public:
  explicit Speller(std::vector<char32_t> characters) : characters_(std::move(characters)) {}

  std::string spell() {
    while (at_ < characters_.size()) spellNext();
    return std::move(out_);
  }

 private:
  [[nodiscard]] char32_t peek(std::size_t ahead) const {
    return at_ + ahead < characters_.size() ? characters_[at_ + ahead] : U' ';
  }

  void spellNext() {
    const char32_t c = peek(0);
    if (isAsciiLetter(c) || isDigit(c) ||
        (c < 0x80 && kKeptSigns.find(static_cast<char>(c)) != std::string_view::npos)) {
      out_ += static_cast<char>(c);
    } else if (c == '$') {
      out_ += isDigit(peek(1)) ? " $" : " ";
    } else if (isCurrencyBeforeNumber(c) && isDigit(peek(1))) {
      ++at_;
      spellNumber();
      out_ += spelledSign(c);
      return;
    } else if (!isInvisible(c)) {
      spellSpecial(c);
    }
    ++at_;
  }

  /// Digits with points and commas among them.
  void spellNumber() {
    while (isDigit(peek(0)) || ((peek(0) == '.' || peek(0) == ',') && isDigit(peek(1)))) {
      out_ += static_cast<char>(peek(0));
      ++at_;
    }
  }

  void spellSpecial(char32_t c) {
    if (const std::string_view sign = spelledSign(c); !sign.empty()) {
      out_ += sign;
    } else if (const std::string_view letters = plainLatinLetters(c); !letters.empty()) {
      out_ += letters;
    } else if (isSign(c)) {
      out_ += ' ';
    } else {
      std::string shown;
      appendUtf8(shown, c);
      throw InputError("text", fmt::format("character {}", at_ + 1),
                       fmt::format("found '{}' (U+{:04X}); expected letters that an English voice reads (Latin script)",
                                   shown, static_cast<std::uint32_t>(c)));
    }
  }

  std::vector<char32_t> characters_;
  std::size_t at_ = 0;
  std::string out_;
};

bool isSpoken(char c) { return isAsciiLetter(static_cast<unsigned char>(c)) || isDigit(static_cast<unsigned char>(c)); }

/// A word of at most kLongestWord characters after the last one, rows of one sign cut short.
void appendWord(std::string& out, std::string_view word) {
  if (!out.empty()) out += ' ';
  std::size_t length = 0;
  std::size_t repeats = 0;
  for (std::size_t i = 0; i < word.size(); ++i) {
    repeats = i > 0 && word[i] == word[i - 1] ? repeats + 1 : 1;
    if (!isSpoken(word[i]) && repeats > kLongestPunctuation) continue;
    if (length == kLongestWord) {
      out += ' ';
      length = 0;
    }
    out += word[i];
    ++length;
  }
}

/// A pause that a sign standing alone means goes to the word before it: a voice stumbles over words without sounds.
void appendPause(std::string& out, std::string_view signs) {
  constexpr std::string_view kPauses = ".,;:!?";
  if (out.empty() || kPauses.find(out.back()) != std::string_view::npos) return;
  const std::size_t pause = signs.find_first_of(".,;:!?-");
  if (pause != std::string_view::npos) out += signs[pause] == '-' ? ',' : signs[pause];
}

/// Single blanks, none at the ends; every word has something to say.
std::string tidy(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (std::any_of(word.begin(), word.end(), isSpoken)) {
      appendWord(out, word);
    } else {
      appendPause(out, word);
    }
  }
  return out;
}

bool hasWords(std::string_view text) { return std::any_of(text.begin(), text.end(), isSpoken); }

}  // namespace

std::vector<std::string> splitSentences(std::string_view speakable, std::size_t max_length) {
  MOUTHPIECE_EXPECT(max_length >= 2 * kLongestWord);
  std::vector<std::string> sentences;
  while (!speakable.empty()) {
    std::size_t end = speakable.find_first_of(".!?;:");
    while (end < speakable.size() && end + 1 < speakable.size() && speakable[end + 1] != ' ') {
      end = speakable.find_first_of(".!?;:", end + 1);
    }
    end = end >= speakable.size() ? speakable.size() : end + 1;
    if (end > max_length) end = speakable.rfind(' ', max_length);
    const std::string_view sentence = speakable.substr(0, end);
    if (hasWords(sentence)) sentences.emplace_back(sentence);
    speakable.remove_prefix(end);
    speakable.remove_prefix(std::min(speakable.find_first_not_of(' '), speakable.size()));
  }
  return sentences;
}

std::string speakableText(std::string_view text) {
  std::string spoken = tidy(Speller(decode(text)).spell());
  if (!hasWords(spoken)) {
    throw InputError("text", "",
                     fmt::format("has nothing to say in it: found '{}'; expected words", printable(text, 40)));
  }
  return spoken;
}

}  // namespace mouthpiece
