// What is named by its digits: telephones, versions, types, codes and places on the globe.
#include "phonetics/language/english_amounts.h"

#include <algorithm>
#include <span>

#include "phonetics/language/english_numbers.h"
#include "phonetics/language/english_spelling.h"
#include "phonetics/language/phone.h"

namespace mouthpiece::english_text {
namespace {

/// The capitals that stand in place of a number's last digits, behind `rest`'s hyphen: 1-800-FLOWERS.
std::string_view lettersToDial(std::span<const std::string_view> digits, std::string_view rest) {
  constexpr std::size_t kFewest = 4, kMost = 8;
  const bool is_free = !digits.empty() && digits.back().size() == 3 && digits.back()[0] == '8' &&
                       (digits.size() == 1 || (digits.size() == 2 && digits[0] == "1"));
  if (!is_free || !rest.starts_with('-')) return {};
  rest.remove_prefix(1);
  const std::size_t letters = std::min(rest.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ"), rest.size());
  return letters >= kFewest && letters <= kMost && endsHere(rest.substr(letters)) ? rest.substr(0, letters)
                                                                                  : std::string_view();
}

/// 747, 1080: in two halves.
std::string inHalves(std::string_view digits) {
  if (digits.size() == 4) return year(digits);
  if (digits.ends_with("00")) return cardinal(digits);
  return joined({cardinal(digits.substr(0, 1)), minutesWords(digits.substr(1))});
}

std::size_t countHexDigits(std::string_view text) {
  return std::min(text.find_first_not_of("0123456789abcdefABCDEF"), text.size());
}

/// How long "00:1A:2B" is, of three pairs and more; 0 for another row.
std::size_t pairsLength(std::string_view token) {
  constexpr std::size_t kFewest = 3;
  std::size_t pairs = 0, size = 0;
  for (std::size_t at = 0; at < token.size() && countHexDigits(token.substr(at)) == 2; at = size + 1) {
    size = at + 2;
    ++pairs;
    if (!token.substr(size).starts_with(':')) break;
  }
  return pairs >= kFewest ? size : 0;
}

}  // namespace

/// Of three groups and more with hyphens a row is a number of somebody or something, as an ISBN is.
std::optional<Said> sayTelephone(std::string_view token) {
  const bool is_abroad = token.starts_with('+');
  const DigitGroups groups = readGroups(token.substr(is_abroad ? 1 : 0), "-.");
  const auto& digits = groups.digits;
  const bool is_local = digits.size() == 2 && digits[0].size() == 3 && digits[1].size() == 4 && groups.sign == '-';
  const bool is_long =
      digits.size() >= 3 &&
      (groups.sign == '-' || (digits.back().size() >= 4 && std::all_of(digits.begin(), digits.end() - 1,
                                                                       [](auto group) { return group.size() <= 4; })));
  // +10 and +1.5 are amounts.
  constexpr std::size_t kFewestAbroad = 7;
  std::size_t count = 0;
  for (const std::string_view group : digits) count += group.size();
  Said said{is_abroad ? "plus" : "", groups.size + (is_abroad ? 1 : 0)};
  for (const std::string_view group : digits) said.words = joined({said.words, digitByDigit(group)});
  const std::string_view rest = token.substr(said.size);
  if (const std::string_view letters = lettersToDial(digits, rest); !letters.empty()) {
    said.words = joined({said.words, letters});
    said.size += 1 + letters.size();
    return said;
  }
  const bool is_number = is_abroad ? count >= kFewestAbroad : is_local || is_long;
  return is_number && endsHere(rest) ? std::optional(std::move(said)) : std::nullopt;
}

/// 2.0.1; four groups are an address.
std::optional<Said> sayVersion(std::string_view token) {
  const DigitGroups groups = readGroups(token, ".");
  if (groups.digits.size() < 3 || !endsHere(token.substr(groups.size))) return std::nullopt;
  const bool is_address = groups.digits.size() == 4;
  Said said{"", groups.size};
  for (const std::string_view group : groups.digits) {
    if (!said.words.empty()) said.words += is_address ? " dot" : " point";
    said.words = joined({said.words, is_address ? digitByDigit(group) : cardinal(group)});
  }
  return said;
}

/// 747-400, 737-800: a type of aeroplane, no range or score.
std::optional<Said> sayAeroplane(std::string_view token) {
  const DigitGroups groups = readGroups(token, "-");
  const auto& digits = groups.digits;
  if (digits.size() != 2 || digits[0].size() != 3 || digits[1].size() != 3 || !endsHere(token.substr(groups.size)))
    return std::nullopt;
  if (digits[0][0] != '7' || digits[0][2] != '7' || digits[1][0] == '0' || !digits[1].ends_with("00"))
    return std::nullopt;
  return Said{joined({inHalves(digits[0]), inHalves(digits[1])}), groups.size};
}

/// Lines of a picture: 1080p, 480i.
std::optional<Said> sayPictureLines(std::string_view token) {
  const std::size_t count = countDigits(token);
  if (!isWordOf("240 360 480 576 720 1080 1440 2160 4320", token.substr(0, count)) || count == 0) return std::nullopt;
  const std::string_view rest = token.substr(count);
  if ((!rest.starts_with('p') && !rest.starts_with('i')) || !endsHere(rest.substr(1))) return std::nullopt;
  return Said{joined({inHalves(token.substr(0, count)), rest[0] == 'p' ? "P" : "I"}), count + 1};
}

std::optional<Said> sayHexadecimal(std::string_view token) {
  const bool has_mark = token.starts_with("0x") || token.starts_with("0X");
  const std::size_t size = has_mark ? 2 + countHexDigits(token.substr(2)) : pairsLength(token);
  const bool has_letter = std::ranges::any_of(token.substr(0, size), isLetter);
  if (size <= 2 || !has_letter || !endsHere(token.substr(size))) return std::nullopt;
  std::string words;
  for (const char c : token.substr(0, size)) {
    if (c != ':') words = joined({words, isDigit(c) ? digitByDigit({&c, 1}) : capitals({&c, 1})});
  }
  if (words.ends_with(" A")) words[words.size() - 2] = '.';  // no article
  return Said{std::move(words), size};
}

std::optional<Said> sayCoordinate(std::string_view token) {
  struct Part {
    std::string_view sign, one, many;
  };
  constexpr Part kParts[] = {{"°", "degree", "degrees"}, {"'", "minute", "minutes"}, {"\"", "second", "seconds"}};
  struct Side {
    char letter;
    std::string_view name;
  };
  constexpr Side kSides[] = {{'N', "north"}, {'S', "south"}, {'E', "east"}, {'W', "west"}};
  Said said;
  for (const Part& part : kParts) {
    const auto amount = readAmount(token.substr(said.size));
    if (!amount || !token.substr(said.size + amount->size).starts_with(part.sign)) break;
    said.words = joined({said.words, amount->words(), amount->isOne() ? part.one : part.many});
    said.size += amount->size + part.sign.size();
  }
  const std::string_view rest = token.substr(said.size);
  for (const Side& side : kSides) {
    if (said.size == 0 || !rest.starts_with(side.letter) || !endsHere(rest.substr(1))) continue;
    // 5'E is no place.
    if (token.find("°") >= said.size) return std::nullopt;
    said.words = joined({said.words, side.name});
    ++said.size;
    return said;
  }
  return std::nullopt;
}

}  // namespace mouthpiece::english_text
