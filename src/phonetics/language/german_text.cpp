#include "phonetics/language/german_text.h"

#include <optional>

#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

/// Blanks between the parts may be left out. Longer rows stand before those that they begin with.
struct Abbreviation {
  std::string_view written, said;
};
constexpr Abbreviation kAbbreviations[] = {{"i. d. R.", "in der Regel"},
                                           {"z. B.", "zum Beispiel"},
                                           {"z. T.", "zum Teil"},
                                           {"z. Zt.", "zur Zeit"},
                                           {"d. h.", "das heißt"},
                                           {"u. a.", "unter anderem"},
                                           {"u. U.", "unter Umständen"},
                                           {"u. Ä.", "und Ähnliches"},
                                           {"o. Ä.", "oder Ähnliches"},
                                           {"v. a.", "vor allem"},
                                           {"s. o.", "siehe oben"},
                                           {"s. u.", "siehe unten"},
                                           {"v. Chr.", "vor Christus"},
                                           {"n. Chr.", "nach Christus"},
                                           {"usw.", "und so weiter"},
                                           {"etc.", "et cetera"},
                                           {"bspw.", "beispielsweise"},
                                           {"inkl.", "inklusive"},
                                           {"geb.", "geboren"},
                                           {"gest.", "gestorben"},
                                           {"Mio.", "Millionen"},
                                           {"Mrd.", "Milliarden"},
                                           {"Std.", "Stunden"},
                                           {"Prof.", "Professor"},
                                           {"Hrn.", "Herrn"},
                                           {"Abb.", "Abbildung"},
                                           {"Kap.", "Kapitel"},
                                           {"Tel.", "Telefon"},
                                           {"Str.", "Straße"},
                                           {"bzw.", "beziehungsweise"},
                                           {"ca.", "circa"},
                                           {"vgl.", "vergleiche"},
                                           {"ggf.", "gegebenenfalls"},
                                           {"evtl.", "eventuell"},
                                           {"Dr.", "Doktor"},
                                           {"Nr.", "Nummer"}};

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

bool isPlainSign(char c) {
  return static_cast<unsigned char>(c) < 0x80 && !(c >= 'a' && c <= 'z') && !(c >= 'A' && c <= 'Z');
}

/// How many bytes of `text` the abbreviation takes that it begins with; its first letter may be a capital.
std::optional<std::size_t> sizeOf(std::string_view written, std::string_view text) {
  std::size_t at = 0;
  for (std::size_t i = 0; i < written.size(); ++i) {
    if (written[i] == ' ') {
      while (at < text.size() && isBlank(text[at])) ++at;
      continue;
    }
    if (at == text.size()) return std::nullopt;
    const bool fits = text[at] == written[i] || (i == 0 && lowerCase(text.substr(0, 1)) == written.substr(0, 1));
    if (!fits) return std::nullopt;
    ++at;
  }
  return at;
}

}  // namespace

std::string germanInWords(std::string_view text, const std::function<bool(std::string_view)>& is_known) {
  constexpr std::string_view kOpens = "(\"'-/";
  std::string words;
  for (std::size_t i = 0; i < text.size();) {
    const bool begins_word = i == 0 || isBlank(text[i - 1]) || kOpens.find(text[i - 1]) != std::string_view::npos;
    const Abbreviation* found = nullptr;
    std::size_t size = 0;
    for (const Abbreviation& row : kAbbreviations) {
      const auto taken = begins_word ? sizeOf(row.written, text.substr(i)) : std::nullopt;
      if (!taken || (is_known && is_known(text.substr(i, *taken - 1)))) continue;
      found = &row;
      size = *taken;
      break;
    }
    if (found == nullptr) {
      if (!begins_word && text.substr(i).starts_with("str.") && !isPlainSign(text[i - 1])) {  // Hauptstr.
        words += "straße";
        i += std::string_view("str.").size();
      } else {
        words += text[i++];
      }
      continue;
    }
    const bool is_capital = text[i] != found->written[0] && text[i] >= 'A' && text[i] <= 'Z';
    std::string said(found->said);
    if (is_capital) said[0] = static_cast<char>(said[0] - 'a' + 'A');
    words += said;
    i += size;
    // Its point ends the text, too.
    if (text.find_first_not_of(" \t\r\n", i) == std::string_view::npos) words += '.';
    if (i < text.size() && !isBlank(text[i]) && std::string_view(",;:!?.)\"'").find(text[i]) == std::string_view::npos)
      words += ' ';
  }
  return words;
}

}  // namespace mouthpiece
