#include "base/text_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <locale>
#include <sstream>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr std::array<double, 10> kPowersOfTen{1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
/// Up to here a scaled value is a whole number of 64 bits with room to spare.
constexpr double kLargestScaled = 9e15;

/// All of `text` as a number, by the rules of std::from_chars.
std::optional<double> wholeNumber(std::string_view text) {
  double value = 0;
#if defined(__cpp_lib_to_chars)
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
#else
  // libc++ 14 reads whole numbers alone; a stream takes blanks, a plus sign and hexadecimal digits as well.
  const bool is_name = text.find_first_not_of("+-.0123456789eE") != std::string_view::npos;
  if (is_name) {
    const bool is_negative = text.starts_with('-');
    if (is_negative) text.remove_prefix(1);
    std::string name(text);
    for (char& letter : name) letter = letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
    if (name != "nan" && name != "inf" && name != "infinity") return std::nullopt;
    value = name == "nan" ? std::numeric_limits<double>::quiet_NaN() : std::numeric_limits<double>::infinity();
    return is_negative ? -value : value;
  }
  if (text.empty() || text.starts_with('+')) return std::nullopt;
  std::istringstream stream{std::string(text)};
  stream.imbue(std::locale::classic());
  if (!(stream >> value) || stream.peek() != std::istringstream::traits_type::eof()) return std::nullopt;
#endif
  return value;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string withoutBracketed(std::string_view text, std::string_view pairs) {
  std::string left, open(pairs);
  while (!text.empty()) {
    const std::size_t pair = open.find(text.front());
    const bool opens = pair % 2 == 0;
    const std::size_t end = opens ? text.find(open[pair + 1]) : std::string_view::npos;
    if (opens && end == std::string_view::npos) open.erase(pair, 2);  // no later one closes either
    if (end == std::string_view::npos) left += text.front();
    text.remove_prefix(end == std::string_view::npos ? 1 : end + 1);
  }
  return std::string(trimmed(left));
}

std::optional<double> parseNumber(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  return wholeNumber(text);
}

void appendFixed(std::string& text, double value, int decimals) {
  MOUTHPIECE_EXPECT(std::isfinite(value) && decimals >= 0 && decimals <= 9);
  const double power = kPowersOfTen[unsignedIndex(decimals)];
  if (!(std::abs(value) * power < kLargestScaled)) {
    fmt::format_to(std::back_inserter(text), "{:.{}f}", value, decimals);
    return;
  }
  // A whole number in units of the last decimal prints several times faster than a double.
  const std::int64_t scaled = std::llround(value * power);
  if (scaled < 0) text.push_back('-');
  std::array<char, 24> digits;
  const auto written = std::to_chars(digits.data(), digits.data() + digits.size(), std::abs(scaled));
  const auto count = unsignedIndex(written.ptr - digits.data());
  const auto wanted = unsignedIndex(decimals);
  if (count > wanted) {
    text.append(digits.data(), count - wanted);
  } else {
    text.push_back('0');
  }
  if (wanted == 0) return;
  text.push_back('.');
  if (count < wanted) text.append(wanted - count, '0');
  text.append(digits.data() + (count > wanted ? count - wanted : 0), std::min(count, wanted));
}

LineReader::LineReader(std::string_view text) : rest_(text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
}

bool LineReader::next(std::string_view& line) {
  if (rest_.empty()) return false;
  const std::size_t end = rest_.find('\n');
  line = rest_.substr(0, end);
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  ++line_number_;
  return true;
}

void splitFields(std::string_view text, char separator, std::vector<std::string_view>& fields) {
  fields.clear();
  while (true) {
    const std::size_t end = text.find(separator);
    fields.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return;
    text.remove_prefix(end + 1);
  }
}

}  // namespace mouthpiece
