#include "phonetics/language/written_abbreviations.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

/// Blanks between the parts may be left out. Longer rows stand before those that they begin with.
struct Abbreviation {
  std::string_view written, said;
  bool is_title = false;  ///< before a capital alone
};
constexpr Abbreviation kGerman[] = {{"i. d. R.", "in der Regel"},
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
constexpr Abbreviation kFrench[] = {{"M.", "monsieur", true},
                                    {"MM.", "messieurs", true},
                                    {"Mlle", "mademoiselle"},
                                    {"Dr", "docteur", true},
                                    {"Pr", "professeur", true},
                                    {"p. ex.", "par exemple"},
                                    {"c.-à-d.", "c'est-à-dire"},
                                    {"etc.", "et cetera"},
                                    {"env.", "environ"},
                                    {"av. J.-C.", "avant Jésus-Christ"},
                                    {"apr. J.-C.", "après Jésus-Christ"},
                                    {"n°", "numéro"},
                                    {"bd", "boulevard", true},
                                    {"min.", "minutes"}};
constexpr Abbreviation kSpanish[] = {{"p. ej.", "por ejemplo"},
                                     {"EE. UU.", "Estados Unidos"},
                                     {"Ud.", "usted"},
                                     {"Uds.", "ustedes"},
                                     {"Vd.", "usted"},
                                     {"aprox.", "aproximadamente"},
                                     {"núm.", "número"},
                                     {"pág.", "página"},
                                     {"Avda.", "avenida"},
                                     {"a. C.", "antes de Cristo"},
                                     {"d. C.", "después de Cristo"},
                                     {"etc.", "etcétera"}};
constexpr Abbreviation kItalian[] = {
    {"ad es.", "ad esempio"},  {"p. es.", "per esempio"},     {"ecc.", "eccetera"},
    {"Sig.ra", "signora"},     {"Sig.", "signor", true},      {"Dott.ssa", "dottoressa"},
    {"Dott.", "dottor", true}, {"Prof.ssa", "professoressa"}, {"Prof.", "professor", true},
    {"pag.", "pagina"},        {"a.C.", "avanti Cristo"},     {"d.C.", "dopo Cristo"},
    {"n°", "numero"}};
constexpr Abbreviation kPortuguese[] = {
    {"p. ex.", "por exemplo"},     {"Sr.", "senhor", true},      {"Sra.", "senhora", true}, {"Dr.", "doutor", true},
    {"Dra.", "doutora", true},     {"Prof.", "professor", true}, {"Av.", "avenida", true},  {"pág.", "página"},
    {"aprox.", "aproximadamente"}, {"etc.", "et cétera"},        {"nº", "número"},          {"a.C.", "antes de Cristo"},
    {"d.C.", "depois de Cristo"}};
constexpr Abbreviation kPolish[] = {{"m. in.", "między innymi"},
                                    {"np.", "na przykład"},
                                    {"itd.", "i tak dalej"},
                                    {"itp.", "i tym podobne"},
                                    {"tzn.", "to znaczy"},
                                    {"tzw.", "tak zwany"},
                                    {"ul.", "ulica"},
                                    {"al.", "aleja", true},
                                    {"godz.", "godzina"},
                                    {"prof.", "profesor"},
                                    {"nr", "numer"},
                                    {"ok.", "około"},
                                    {"św.", "święty", true},
                                    {"p.n.e.", "przed naszą erą"},
                                    {"n.e.", "naszej ery"},
                                    {"mln", "milionów"},
                                    {"mld", "miliardów"},
                                    {"tys.", "tysięcy"}};
constexpr Abbreviation kDutch[] = {{"dhr.", "de heer"},
                                   {"mevr.", "mevrouw"},
                                   {"mw.", "mevrouw"},
                                   {"bijv.", "bijvoorbeeld"},
                                   {"bv.", "bijvoorbeeld"},
                                   {"d.w.z.", "dat wil zeggen"},
                                   {"o.a.", "onder andere"},
                                   {"enz.", "enzovoort"},
                                   {"etc.", "et cetera"},
                                   {"m.b.t.", "met betrekking tot"},
                                   {"i.v.m.", "in verband met"},
                                   {"a.u.b.", "alstublieft"},
                                   {"t/m", "tot en met"},
                                   {"ca.", "circa"},
                                   {"nr.", "nummer"},
                                   {"blz.", "bladzijde"},
                                   {"v.Chr.", "voor Christus"},
                                   {"n.Chr.", "na Christus"},
                                   {"prof.", "professor"},
                                   {"dr.", "dokter", true}};

std::span<const Abbreviation> abbreviationsOf(std::string_view language) {
  constexpr std::pair<std::string_view, std::span<const Abbreviation>> kTables[] = {
      {"de", kGerman}, {"es", kSpanish}, {"fr", kFrench},    {"it", kItalian},
      {"nl", kDutch},  {"pl", kPolish},  {"pt", kPortuguese}};
  for (const auto& [of, rows] : kTables) {
    if (of == language) return rows;
  }
  return {};
}

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

/// Whether an abbreviation may end before `rest`.
bool ends(const Abbreviation& row, std::string_view rest) {
  if (!row.written.ends_with('.') && !rest.empty() && !isPlainSign(rest[0])) return false;
  if (!row.is_title) return true;
  const std::size_t next = std::min(rest.find_first_not_of(' '), rest.size());
  return next > 0 && next < rest.size() &&
         ((rest[next] >= 'A' && rest[next] <= 'Z') || static_cast<unsigned char>(rest[next]) >= 0x80);
}

}  // namespace

std::string abbreviationsInWords(std::string_view text, std::string_view locale,
                                 const std::function<bool(std::string_view)>& is_known) {
  constexpr std::string_view kOpens = "(\"'-/", kCloses = ",;:!?.)\"'";
  const std::string_view language = locale.substr(0, locale.find('-'));
  const std::span<const Abbreviation> rows = abbreviationsOf(language);
  std::string words;
  for (std::size_t i = 0; i < text.size();) {
    const bool begins_word = i == 0 || isBlank(text[i - 1]) || kOpens.find(text[i - 1]) != std::string_view::npos;
    const Abbreviation* found = nullptr;
    std::size_t size = 0;
    for (const Abbreviation& row : rows) {
      const auto taken = begins_word ? sizeOf(row.written, text.substr(i)) : std::nullopt;
      if (!taken || !ends(row, text.substr(i + *taken)) || (is_known && is_known(text.substr(i, *taken - 1)))) continue;
      found = &row;
      size = *taken;
      break;
    }
    if (found == nullptr) {
      if (language == "de" && !begins_word && text.substr(i).starts_with("str.") && !isPlainSign(text[i - 1])) {
        words += "straße";  // Hauptstr.
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
    if (found->written.ends_with('.') && text.find_first_not_of(" \t\r\n", i) == std::string_view::npos) words += '.';
    if (i < text.size() && !isBlank(text[i]) && kCloses.find(text[i]) == std::string_view::npos) words += ' ';
  }
  return words;
}

}  // namespace mouthpiece
