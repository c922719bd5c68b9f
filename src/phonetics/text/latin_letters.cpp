#include "phonetics/text/latin_letters.h"

#include <array>
#include <utility>

namespace mouthpiece {
namespace {

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

}  // namespace

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

}  // namespace mouthpiece
