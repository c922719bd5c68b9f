#include "phonetics/text/speakable_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/unicode.h"
#include "phonetics/language/written_abbreviations.h"
#include "phonetics/language/written_amounts.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kLongestWord = 40;
/// Bytes; a sentence of Thai or Japanese has no blank in it.
constexpr std::size_t kLongestScriptWord = 180;
constexpr std::size_t kLongestPunctuation = 3;  // "..." is said like any number of dots
constexpr std::string_view kKeptSigns = ".,;:!?'-\"()";

bool isDigit(char32_t c) { return c >= '0' && c <= '9'; }
bool isFullWidth(char32_t c) { return c >= 0xFF01 && c <= 0xFF5E; }  // of ASCII
bool isAsciiLetter(char32_t c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// The plain letter of each code point from U+00C0 and from U+1E00; '.' where there is none or more than one.
constexpr std::string_view kFrom00C0 =
    "AAAAAA.CEEEEIIII.NOOOOO.OUUUUY..aaaaaa.ceeeeiiii.nooooo.ouuuuy.yAaAaAaCcCcCcCcDd"
    "DdEeEeEeEeEeGgGgGgGgHhHhIiIiIiIiIi..JjKkkLlLlLlLlLlNnNnNnn..OoOoOo..RrRrRrSsSsSs"
    "SsTtTtTtUuUuUuUuUuUuWwYyYZzZzZzsbB.....CcDD....e.FfG...IKkl..Nn.Oo..Pp.....tTtTU"
    "u.VYyZz......................AaIiOoUuUuUuUuUueAaAa..GgGgKkOoOo..j...Gg..NnAa...."
    "AaAaEeEeIiIiOoOoRrRrUuUuSsTt..Hh......AaEeOoOoOoOoYy......ACcLT....BU.EeJj..RrYy";
constexpr std::string_view kFrom1E00 =
    "AaBbBbBbCcDdDdDdDdDdEeEeEeEeEeFfGgHhHhHhHhHhIiIiKkKkKkLlLlLlLlMmMmMmNnNnNnNnOoOo"
    "OoOoPpPpRrRrRrRrSsSsSsSsSsTtTtTtTtUuUuUuUuUuVvVvWwWwWwWwWwXxXxYyZzZzZzhtwy.s...."
    "AaAaAaAaAaAaAaAaAaAaAaAaEeEeEeEeEeEeEeEeIiIiOoOoOoOoOoOoOoOoOoOoOoOoUuUuUuUuUuUu"
    "UuYyYyYyYy......";

constexpr std::array<std::pair<char32_t, std::string_view>, 28> kLigatures = {{
    {0x00C6, "Ae"}, {0x00E6, "ae"}, {0x00D0, "Th"}, {0x00F0, "th"}, {0x00DE, "Th"}, {0x00FE, "th"}, {0x00DF, "ss"},
    {0x1E9E, "SS"}, {0x0132, "IJ"}, {0x0133, "ij"}, {0x014A, "Ng"}, {0x014B, "ng"}, {0x0152, "Oe"}, {0x0153, "oe"},
    {0x01FC, "Ae"}, {0x01FD, "ae"}, {0x01FE, "O"},  {0x01FF, "o"},  {0x01E2, "Ae"}, {0x01E3, "ae"}, {0x01C4, "Dz"},
    {0x01C6, "dz"}, {0x01C7, "Lj"}, {0x01C9, "lj"}, {0x01CA, "Nj"}, {0x01CC, "nj"}, {0x01F1, "Dz"}, {0x01F3, "dz"},
}};

constexpr std::array<std::string_view, 7> kPresentationForms = {"ff", "fi", "fl", "ffi", "ffl", "st", "st"};  // U+FB00

/// The ASCII letters that stand for a Latin letter with marks, a ligature or a special letter: U+00E9 -> "e", U+00DF ->
/// "ss". Empty for everything else, letters that no plain letter stands for included.
std::string_view plainLatinLetters(char32_t code_point) {
  const auto fromTable = [&](std::string_view table, char32_t first) {
    const std::string_view letter = table.substr(code_point - first, 1);
    return letter == "." ? std::string_view() : letter;
  };
  for (const auto& [ligature, letters] : kLigatures) {
    if (ligature == code_point) return letters;
  }
  if (code_point >= 0x00C0 && code_point < 0x00C0 + kFrom00C0.size()) return fromTable(kFrom00C0, 0x00C0);
  if (code_point >= 0x1E00 && code_point < 0x1E00 + kFrom1E00.size()) return fromTable(kFrom1E00, 0x1E00);
  if (code_point >= 0xFB00 && code_point < 0xFB00 + kPresentationForms.size()) {
    return kPresentationForms[code_point - 0xFB00];
  }
  return {};
}

/// Written alike in every language.
constexpr SpelledSign kPlainSigns[] = {{0x2010, "-"},   {0x2011, "-"},  {0x2012, "-"},  {0x2013, "-"},  {0x2014, ", "},
                                       {0x2015, ", "},  {0x2018, "'"},  {0x2019, "'"},  {0x201A, "'"},  {0x201B, "'"},
                                       {0x02BC, "'"},   {0x2032, "'"},  {0x201C, "\""}, {0x201D, "\""}, {0x201E, "\""},
                                       {0x2026, "..."}, {0x2212, "-"},  {0x3002, ". "}, {0x3001, ", "}, {0x060C, ", "},
                                       {0x061B, "; "},  {0x061F, "? "}, {0x06D4, ". "}, {0x0964, ". "}, {0x0965, ". "}};

/// <i>, </i>, <color=red>, <br/>: a name alone or with values, which begins a word or ends something.
bool isTag(std::u32string_view inside) {
  if (inside.starts_with(U'/')) inside.remove_prefix(1);
  if (inside.empty() || !isAsciiLetter(inside[0])) return false;
  const std::size_t name = std::min(inside.find_first_of(U" =/"), inside.size());
  if (!std::all_of(inside.begin(), inside.begin() + signedIndex(name),
                   [](char32_t c) { return isAsciiLetter(c) || isDigit(c); }))
    return false;
  return name == inside.size() || inside.back() == U'/' || inside.find(U'=') != std::u32string_view::npos;
}

/// What is written for others than the speaker becomes blanks: the mark-up of a game's or a subtitle's text, and stage
/// directions in square brackets ("[laughs]").
void blankMarkup(std::vector<char32_t>& characters) {
  constexpr std::size_t kLongest = 100;
  const std::u32string_view text(characters.data(), characters.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != U'<' && text[i] != U'[') continue;
    const char32_t closes = text[i] == U'<' ? U'>' : U']';
    const std::size_t end = text.substr(0, std::min(text.size(), i + kLongest)).find(closes, i);
    if (end == std::u32string_view::npos) continue;
    const std::u32string_view inside = text.substr(i + 1, end - i - 1);
    const bool begins = i == 0 || text[i - 1] <= U' ';  // what was blanked, too
    const bool is_markup = closes == U'>' ? (begins || inside.starts_with(U'/')) && isTag(inside)
                                          : begins && std::any_of(inside.begin(), inside.end(), isAsciiLetter);
    if (is_markup) std::fill_n(characters.begin() + signedIndex(i), end + 1 - i, U' ');
  }
}

bool isUtf8(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    if (!decodeUtf8(text, at)) return false;
  }
  return true;
}

/// Of any script; joiners inside words shape their letters.
bool isKeptLetter(char32_t c) { return c >= 0x80 && (isWordSign(c) || c == 0x200C || c == 0x200D); }

std::string_view spelledIn(std::span<const SpelledSign> signs, char32_t c) {
  const auto found = std::find_if(signs.begin(), signs.end(), [&](const SpelledSign& sign) { return sign.sign == c; });
  return found == signs.end() ? std::string_view() : found->spelled;
}

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

/// Whether no voice of the language says the character, and no blank can stand for it.
bool isUnspeakable(char32_t c, const TextRules& rules) {
  const auto has = [c](std::u32string_view letters) { return letters.find(c) != std::u32string_view::npos; };
  return c >= 0x80 && !isFullWidth(c) && !has(rules.own_letters) && !has(rules.kept_signs) && !has(rules.currencies) &&
         !isInvisible(c) && !(rules.any_letters && isKeptLetter(c)) && spelledIn(rules.signs, c).empty() &&
         spelledIn(kPlainSigns, c).empty() && plainLatinLetters(c).empty() && !isSign(c);
}

/// Throws InputError for more than `longest` characters; `most` are those that a text may have. `is_read`: as it is
/// read, with words for its numbers and the like.
std::vector<char32_t> decode(std::string_view text, std::size_t longest, std::size_t most, bool is_read) {
  std::vector<char32_t> characters;
  for (std::size_t i = 0; i < text.size();) {
    const auto c = decodeUtf8(text, i);
    if (!c) throw InputError("text", fmt::format("byte {}", i), "is broken UTF-8; expected text in UTF-8");
    characters.push_back(isFullWidth(*c) ? *c - 0xFF01 + '!' : *c);
    if (characters.size() > longest) {
      throw InputError("text", "",
                       fmt::format("is longer than {} characters{}; expected a shorter line, or several", most,
                                   is_read ? " once its numbers and signs are words" : ""));
    }
  }
  return characters;
}

/// Marks of letters, dashes and quotes spelled plainly, so that rules for words need to know one spelling.
std::string plainText(const std::vector<char32_t>& characters, const TextRules& rules) {
  std::string plain;
  for (const char32_t c : characters) {
    const bool is_own =
        rules.own_letters.find(c) != std::u32string_view::npos || (rules.any_letters && isKeptLetter(c));
    const bool is_joiner = c == 0x200D && rules.in_words != nullptr;  // of emoji, which it names
    if (!is_own && isInvisible(c) && !is_joiner) continue;
    std::string_view spelled = is_own ? std::string_view() : spelledIn(kPlainSigns, c);
    if (spelled.empty() && !is_own) spelled = plainLatinLetters(c);
    if (spelled.empty()) {
      appendUtf8(plain, c);
    } else {
      plain += spelled;
    }
  }
  return plain;
}

/// Spells out characters one by one; blanks are put right afterwards.
class Speller {
 public:
  Speller(std::vector<char32_t> characters, const TextRules& rules)
      : characters_(std::move(characters)), rules_(rules) {}

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
    } else if (contains(rules_.own_letters, c) || contains(rules_.kept_signs, c) ||
               (rules_.any_letters && isKeptLetter(c))) {
      appendUtf8(out_, c);
    } else if (c == '$') {
      out_ += isDigit(peek(1)) ? " $" : " ";
    } else if (contains(rules_.currencies, c) && isDigit(peek(1))) {
      ++at_;
      spellNumber();
      out_ += spelledIn(rules_.signs, c);
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
    if (const std::string_view sign = spelledIn(rules_.signs, c); !sign.empty()) {
      out_ += sign;
    } else if (const std::string_view plain = spelledIn(kPlainSigns, c); !plain.empty()) {
      out_ += plain;
    } else if (const std::string_view letters = plainLatinLetters(c); !letters.empty()) {
      out_ += letters;
    } else if (isSign(c)) {
      out_ += ' ';
    } else {
      std::string shown;
      appendUtf8(shown, c);
      throw InputError(
          "text", fmt::format("character {}", at_ + 1),
          fmt::format("found '{}' (U+{:04X}); expected {}", shown, static_cast<std::uint32_t>(c), rules_.expected));
    }
  }

  static bool contains(std::u32string_view letters, char32_t c) { return letters.find(c) != std::u32string_view::npos; }

  std::vector<char32_t> characters_;
  const TextRules& rules_;
  std::size_t at_ = 0;
  std::string out_;
};

/// Bytes beyond ASCII belong to a language's own letters; signs are here only where its voices read them.
bool isSpoken(char c) {
  constexpr std::string_view kReadSigns = "&%+=@$";
  const auto byte = static_cast<unsigned char>(c);
  return isAsciiLetter(byte) || isDigit(byte) || byte >= 0x80 || kReadSigns.find(c) != std::string_view::npos;
}

bool hasWords(std::string_view text) { return std::any_of(text.begin(), text.end(), isSpoken); }

/// A pause that a sign standing alone means goes to the word before it: a voice stumbles over words without sounds.
void appendPause(std::string& out, std::string_view signs) {
  constexpr std::string_view kPauses = ".,;:!?";
  if (out.empty() || kPauses.find(out.back()) != std::string_view::npos) return;
  const std::size_t pause = signs.find_first_of(".,;:!?-");
  if (pause != std::string_view::npos) out += signs[pause] == '-' ? ',' : signs[pause];
}

/// A word of at most `longest` bytes after the last one, rows of one sign cut short.
void appendWord(std::string& out, std::string_view word, std::size_t longest) {
  if (!out.empty()) out += ' ';
  std::size_t length = 0;
  std::size_t repeats = 0;
  for (std::size_t i = 0; i < word.size(); ++i) {
    repeats = i > 0 && word[i] == word[i - 1] ? repeats + 1 : 1;
    if (!isSpoken(word[i]) && repeats > kLongestPunctuation) continue;
    const bool begins_character = (static_cast<unsigned char>(word[i]) & 0xC0U) != 0x80U;
    if (length >= longest && begins_character) {
      if (!hasWords(word.substr(i))) return appendPause(out, word.substr(i));
      out += ' ';
      length = 0;
    }
    out += word[i];
    ++length;
  }
}

/// Single blanks, none at the ends; every word has something to say.
std::string tidy(std::string_view text, std::size_t longest) {
  std::string out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (hasWords(word)) {
      appendWord(out, word, longest);
    } else {
      appendPause(out, word);
    }
  }
  return out;
}

}  // namespace

std::string withoutLoneCharacters(std::string_view text, const Language& language, std::vector<std::string>& left_out) {
  std::string kept;
  std::vector<std::string> lone;
  bool follows_one = false;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = at;
    const auto c = decodeUtf8(text, at);
    if (!c) return std::string(text);  // refused by who reads it
    std::size_t behind = at;
    const bool is_one = isUnspeakable(*c, language.text);
    const bool is_lone = is_one && !follows_one &&
                         (at == text.size() || !isUnspeakable(decodeUtf8(text, behind).value_or(U' '), language.text));
    if (is_lone) lone.emplace_back(text.substr(begin, at - begin));
    kept += is_lone ? std::string_view(" ") : text.substr(begin, at - begin);
    follows_one = is_one;
  }
  if (lone.empty() || !hasWords(kept)) return std::string(text);
  left_out.insert(left_out.end(), lone.begin(), lone.end());
  return kept;
}

std::string withoutMarkup(std::string_view text) {
  if (!isUtf8(text)) return std::string(text);
  std::vector<char32_t> characters;
  for (std::size_t at = 0; at < text.size();) characters.push_back(*decodeUtf8(text, at));
  blankMarkup(characters);
  std::string plain;
  for (const char32_t c : characters) appendUtf8(plain, c);
  return plain;
}

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

std::string speakableText(std::string_view text, const Language& language,
                          const std::function<bool(std::string_view)>& is_known, std::size_t most) {
  const TextRules& rules = language.text;
  const std::string joined = rules.any_letters && isUtf8(text) ? toNfc(text) : std::string(text);
  std::vector<char32_t> characters = decode(joined, most, most, false);
  blankMarkup(characters);
  const std::size_t longest = rules.any_letters ? kLongestScriptWord : kLongestWord;
  std::string spoken = Speller(characters, rules).spell();  // refuses what cannot be read by its place in `text`
  if (rules.in_words == nullptr && rules.locale.empty()) {
    spoken = tidy(spoken, longest);
  } else {
    spoken = plainText(characters, rules);
    const auto inWords = [&](const std::string& plain) {
      if (rules.in_words != nullptr) return rules.in_words(plain, is_known);
      return amountsInWords(abbreviationsInWords(plain, rules.locale, is_known), rules.locale);
    };
    // What is said for signs can make an abbreviation of the letters beside them: it is read until nothing changes.
    constexpr int kMostReadings = 4;
    std::string before;
    for (int reading = 0; reading < kMostReadings && spoken != before; ++reading) {
      before = spoken;
      // Blanks that cut long words make it a little longer.
      const std::size_t readable = reading == 0 ? most : 2 * most;
      spoken = tidy(Speller(decode(inWords(before), readable, most, true), rules).spell(), longest);
    }
  }
  if (!hasWords(spoken)) {
    throw InputError("text", "",
                     fmt::format("has nothing to say in it: found '{}'; expected words", printable(text, 40)));
  }
  return spoken;
}

}  // namespace mouthpiece
