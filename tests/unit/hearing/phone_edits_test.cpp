#include "hearing/alignment/phone_edits.h"

#include <gtest/gtest.h>

#include <random>

namespace mouthpiece {
namespace {

using enum Phone;
using Row = std::vector<Phone>;
using Prices = std::vector<double>;

TEST(PhoneEdits, AreTheCheapest) {
  EXPECT_EQ(cheapestEdits({}, {}).price, 0);
  EXPECT_EQ(cheapestEdits(Row{kP, kAA}, {}).of_first, (Prices{0.7, 0.7}));
  const PhoneEdits one_more = cheapestEdits(Row{kP, kAA, kT, kIY}, Row{kP, kAA, kS, kT, kIY});
  EXPECT_EQ(one_more.of_first, (Prices{0, 0, 0, 0}));
  EXPECT_EQ(one_more.of_second, (Prices{0, 0, 0.7, 0, 0}));
  EXPECT_EQ(cheapestEdits(Row{kP, kAA, kT}, Row{kP, kOW, kT}).of_second, (Prices{0, 0.6, 0}));
  EXPECT_EQ(cheapestEdits(Row{kP, kAA, kT}, Row{kP, kS, kT}).of_first, (Prices{0, 1, 0}));
}

/// A change counts in both rows, what is left out in its own.
TEST(PhoneEdits, CostWhatTheirPhonesDo) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    Row rows[2];
    for (Row& row : rows) {
      row.resize(random() % 9);
      for (Phone& phone : row) phone = Row{kP, kAA, kT, kIY}[random() % 4];
    }
    const PhoneEdits edits = cheapestEdits(rows[0], rows[1]);
    EXPECT_NEAR(edits.price, cheapestEdits(rows[1], rows[0]).price, 1e-9);
    double sum = 0;
    for (const double price : edits.of_first) sum += price;
    for (const double price : edits.of_second) sum += price == PhoneEdits::kLeftOut ? price : 0;
    EXPECT_NEAR(sum, edits.price, 1e-9);
    EXPECT_LE(edits.price, PhoneEdits::kLeftOut * static_cast<double>(rows[0].size() + rows[1].size()) + 1e-9);
  }
}

}  // namespace
}  // namespace mouthpiece
