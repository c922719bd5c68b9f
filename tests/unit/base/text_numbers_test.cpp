#include "base/text_numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/errors.h"

namespace mouthpiece {
namespace {

std::string fixed(double value, int decimals) {
  std::string text = "<";
  appendFixed(text, value, decimals);
  return text;
}

TEST(AppendFixed, WritesExactlyTheDecimalsAskedFor) {
  EXPECT_EQ(fixed(0.0, 4), "<0.0000");
  EXPECT_EQ(fixed(-0.00001, 4), "<0.0000");
  EXPECT_EQ(fixed(1.5, 0), "<2");
  EXPECT_EQ(fixed(-12.34567, 4), "<-12.3457");
  EXPECT_EQ(fixed(0.05, 4), "<0.0500");
  EXPECT_EQ(fixed(-0.9, 1), "<-0.9");
  EXPECT_EQ(fixed(999.99996, 4), "<1000.0000");
  EXPECT_EQ(fixed(1e20, 2), "<100000000000000000000.00");
}

TEST(AppendFixed, AgreesWithTheNumberItWrites) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> value(-2000, 2000);
  for (int i = 0; i < 20000; ++i) {
    const double x = value(random);
    const auto back = parseNumber(fixed(x, 4).substr(1));
    ASSERT_TRUE(back.has_value());
    // Half a unit of the fourth decimal, and the rounding of the product.
    ASSERT_NEAR(*back, x, 0.5e-4 + 1e-11);
  }
}

TEST(AppendFixed, RefusesWhatIsNoNumber) {
  std::string text;
  EXPECT_THROW(appendFixed(text, std::nan(""), 4), InternalError);
  EXPECT_THROW(appendFixed(text, 1.0, 10), InternalError);
}

TEST(ParseNumber, TakesNumbersAndNothingElse) {
  EXPECT_EQ(parseNumber(" +1.5e2\r"), 150.0);
  EXPECT_EQ(parseNumber("-.5"), -0.5);
  EXPECT_TRUE(std::isnan(*parseNumber("NaN")));
  EXPECT_TRUE(std::isinf(*parseNumber("inf")));
  for (const char* bad : {"", " ", "1,5", "1.5mm", "+-1", "++1", "0x10", "e5", "--1"}) {
    EXPECT_EQ(parseNumber(bad), std::nullopt) << bad;
  }
}

TEST(ParseNumber, IsTheNearestDouble) {
  std::mt19937_64 random(20261126);
  const auto below = [&](std::uint64_t n) { return random() % n; };
  for (int i = 0; i < 200'000; ++i) {
    // Up to 20 digits with a point somewhere, or none.
    std::string text = below(2) == 0 ? "-" : "";
    const std::uint64_t digits = 1 + below(20), point = below(digits + 2);
    for (std::uint64_t d = 0; d < digits; ++d) {
      if (d == point) text += '.';
      text += static_cast<char>('0' + below(10));
    }
    const std::optional<double> parsed = parseNumber(text);
    ASSERT_TRUE(parsed) << text;
    const double nearest = std::strtod(text.c_str(), nullptr);
    ASSERT_EQ(*parsed, nearest) << text;
    ASSERT_EQ(std::signbit(*parsed), std::signbit(nearest)) << text;
  }
  for (const char* bad : {".", "-", "-.", "1.2.3", "1-", "12a"}) EXPECT_EQ(parseNumber(bad), std::nullopt) << bad;
  EXPECT_EQ(parseNumber("5."), 5.0);
}

TEST(LineReader, CountsLinesAndTakesAnyEnding) {
  LineReader lines("\xEF\xBB\xBFone\r\ntwo\n\nfour");
  std::string_view line;
  ASSERT_TRUE(lines.next(line));
  EXPECT_EQ(line, "one");
  ASSERT_TRUE(lines.next(line));
  EXPECT_EQ(line, "two");
  ASSERT_TRUE(lines.next(line));
  EXPECT_EQ(line, "");
  ASSERT_TRUE(lines.next(line));
  EXPECT_EQ(line, "four");
  EXPECT_EQ(lines.lineNumber(), 4U);
  EXPECT_FALSE(lines.next(line));
}

TEST(SplitFields, KeepsEmptyFields) {
  std::vector<std::string_view> fields;
  splitFields("a,,b,", ',', fields);
  EXPECT_EQ(fields, (std::vector<std::string_view>{"a", "", "b", ""}));
  splitFields("", ',', fields);
  EXPECT_EQ(fields.size(), 1U);
}

TEST(WithoutBracketed, LeavesWhatStandsOutside) {
  EXPECT_EQ(withoutBracketed(" <i>one</i> [laughs] {x} two ", "<>[]{}"), "one   two");
  EXPECT_EQ(withoutBracketed("<i>one</i> [laughs]", "<>"), "one [laughs]");
  EXPECT_EQ(withoutBracketed("[a] b [c", "[]"), "b [c");
  EXPECT_EQ(withoutBracketed("one ] two", "[]"), "one ] two");
  EXPECT_EQ(withoutBracketed("", "<>"), "");
  EXPECT_EQ(withoutBracketed(std::string(300'000, '<'), "<>").size(), 300'000U) << "in no time";
}

}  // namespace
}  // namespace mouthpiece
