#include "hearing/alignment/phone_edits.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace mouthpiece {
namespace {

PhoneEdits editsOf(const std::string& first, const std::string& second) {
  return cheapestEdits(first.size(), second.size(), 0.75,
                       [&](std::size_t i, std::size_t j) { return first[i] == second[j] ? 0.0 : 1.0; });
}

TEST(PhoneEdits, AreTheCheapest) {
  EXPECT_EQ(editsOf("", "").price, 0);
  EXPECT_EQ(editsOf("ab", "").of_first, (std::vector<double>{0.75, 0.75}));
  const PhoneEdits one_more = editsOf("abcd", "abxcd");
  EXPECT_EQ(one_more.of_first, (std::vector<double>(4, 0)));
  EXPECT_EQ(one_more.of_second, (std::vector<double>{0, 0, 0.75, 0, 0}));
  EXPECT_EQ(editsOf("abc", "axc").of_second, (std::vector<double>{0, 1, 0}));
}

/// A change counts in both rows, what is left out in its own.
TEST(PhoneEdits, CostWhatTheirPhonesDo) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    std::string rows[2];
    for (std::string& row : rows) {
      row.resize(random() % 9);
      for (char& letter : row) letter = static_cast<char>('a' + random() % 3);
    }
    const PhoneEdits edits = editsOf(rows[0], rows[1]), back = editsOf(rows[1], rows[0]);
    EXPECT_DOUBLE_EQ(edits.price, back.price);
    double sum = 0;
    for (const double price : edits.of_first) sum += price;
    for (const double price : edits.of_second) sum += price == 0.75 ? price : 0;
    EXPECT_NEAR(sum, edits.price, 1e-9) << rows[0] << " " << rows[1];
    EXPECT_LE(edits.price, 0.75 * static_cast<double>(rows[0].size() + rows[1].size()));
  }
}

}  // namespace
}  // namespace mouthpiece
