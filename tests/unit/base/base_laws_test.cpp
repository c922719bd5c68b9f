// Laws of bytes, text numbers and parallel loops that hold for any input: random cases, the seed in the trace.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/parallel_for.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

constexpr unsigned kSeeds = 50;

/// Any bits, as wide and as narrow numbers.
std::uint64_t bitsOf(std::mt19937_64& random) { return random() >> (random() % 64); }

TEST(BytesLaws, WhatIsWrittenIsReadInBothOrders) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    for (const ByteOrder order : {ByteOrder::kLittle, ByteOrder::kBig}) {
      std::mt19937_64 random(seed), again(seed);
      ByteWriter writer(order);
      for (int i = 0; i < 200; ++i) {
        const std::uint64_t bits = bitsOf(random);
        switch (random() % 6) {
          case 0:
            writer.writeU8(bits & 0xFFU);
            break;
          case 1:
            writer.writeU16(bits & 0xFFFFU);
            break;
          case 2:
            writer.writeU32(bits & 0xFFFFFFFFU);
            break;
          case 3:
            writer.writeU64(bits);
            break;
          case 4:
            writer.writeF64(std::bit_cast<double>(bits));
            break;
          default:
            writer.writeF32(1.0 / 3.0 * static_cast<double>(bits));
            break;
        }
      }
      ByteReader reader(writer.bytes(), "x", order);
      for (int i = 0; i < 200; ++i) {
        const std::uint64_t bits = bitsOf(again);
        switch (again() % 6) {
          case 0:
            EXPECT_EQ(reader.readU8(), bits & 0xFFU);
            break;
          case 1:
            EXPECT_EQ(reader.readU16(), bits & 0xFFFFU);
            break;
          case 2:
            EXPECT_EQ(reader.readU32(), bits & 0xFFFFFFFFU);
            break;
          case 3:
            EXPECT_EQ(reader.readU64(), bits);
            break;
          case 4:
            EXPECT_EQ(std::bit_cast<std::uint64_t>(reader.readF64()), bits);
            break;
          default:
            EXPECT_EQ(reader.readF32(), static_cast<float>(1.0 / 3.0 * static_cast<double>(bits)));
            break;
        }
      }
      EXPECT_EQ(reader.remaining(), 0U);
    }
  }
}

TEST(BytesLaws, TheOrdersMirrorEachOther) {
  ByteWriter little, big(ByteOrder::kBig);
  little.writeU32(0x01020304);
  big.writeU32(0x01020304);
  EXPECT_EQ(little.bytes(), std::string("\x04\x03\x02\x01"));
  EXPECT_EQ(big.bytes(), std::string("\x01\x02\x03\x04"));
  big.patchU16(1, 0xABCD);
  EXPECT_EQ(big.bytes(), std::string("\x01\xAB\xCD\x04"));
}

/// The reader against an index into the bytes: never past the end, and nothing moves when a read is refused.
TEST(BytesLaws, AnyWalkStaysInside) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const std::string bytes(random() % 40, 'x');
    ByteReader reader(bytes, "x");
    std::size_t at = 0;
    for (int step = 0; step < 100; ++step) {
      const std::size_t count = random() % 12;
      if (random() % 3 == 0) {
        const std::size_t to = random() % 50;
        if (to <= bytes.size()) {
          reader.seek(to);
          at = to;
        } else {
          EXPECT_THROW(reader.seek(to), InputError);
        }
      } else if (at + count <= bytes.size()) {
        EXPECT_EQ(reader.readBytes(count).size(), count);
        at += count;
      } else {
        EXPECT_THROW(reader.readBytes(count), InputError);
      }
      EXPECT_EQ(reader.position(), at);
      EXPECT_EQ(reader.remaining(), bytes.size() - at);
    }
  }
}

/// printf's own "%.*f" where no half is rounded: both round the same exact value.
TEST(TextNumbersLaws, FixedDecimalsAreThoseOfPrintf) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 20000; ++i) {
    const int decimals = static_cast<int>(random() % 10);
    const double scale = std::pow(10.0, static_cast<double>(random() % 12));
    const double value = std::uniform_real_distribution<double>(-scale, scale)(random);
    std::string text;
    appendFixed(text, value, decimals);
    const std::optional<double> back = parseNumber(text);
    ASSERT_TRUE(back.has_value()) << text;
    // Half a unit of the last place, and what a double of that size holds.
    EXPECT_NEAR(*back, value, 0.5000001 * std::pow(10.0, -decimals) + 1e-15 * std::abs(value)) << text;
    EXPECT_EQ(text.find('.') == std::string::npos ? 0U : text.size() - text.find('.') - 1,
              static_cast<std::size_t>(decimals));
    EXPECT_FALSE(text.starts_with("-0") && *back == 0) << text;
  }
}

TEST(TextNumbersLaws, EveryDoubleSurvivesAsShortestText) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 5000; ++i) {
    const double value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) continue;
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), " %.17g\t", value);
    EXPECT_EQ(parseNumber(text.data()), std::optional(value)) << text.data();
  }
}

TEST(TextNumbersLaws, FieldsJoinedAreTheText) {
  std::mt19937 random(5);
  const std::string letters = "ab,, \t;";
  for (int i = 0; i < 500; ++i) {
    std::string text;
    for (std::size_t n = random() % 20; n > 0; --n) text += letters[random() % letters.size()];
    std::vector<std::string_view> fields{"left from before"};
    splitFields(text, ',', fields);
    std::string joined;
    for (const std::string_view field : fields) {
      EXPECT_EQ(field.find(','), std::string_view::npos);
      joined += std::string(field) + ",";
    }
    joined.pop_back();
    EXPECT_EQ(joined, text);
  }
}

TEST(TextNumbersLaws, LinesJoinedAreTheTextWithoutItsEnds) {
  std::mt19937 random(6);
  for (int i = 0; i < 500; ++i) {
    std::vector<std::string> lines(1 + random() % 6);
    std::string text;
    for (std::string& line : lines) {
      line.assign(random() % 4, 'x');
      text += line + (random() % 2 == 0 ? "\n" : "\r\n");
    }
    LineReader reader(text);
    std::vector<std::string> read;
    for (std::string_view line; reader.next(line);) {
      read.emplace_back(line);
      EXPECT_EQ(reader.lineNumber(), read.size());
    }
    EXPECT_EQ(read, lines);
  }
}

TEST(ParallelForLaws, EachIndexIsVisitedOnceForAnyThreadCount) {
  std::mt19937 random(7);
  for (int i = 0; i < 60; ++i) {
    const std::size_t count = random() % 300, threads = random() % 9;
    SCOPED_TRACE(testing::Message() << count << " on " << threads);
    std::vector<std::atomic<int>> visits(count);
    parallelFor(count, threads, [&](std::size_t index) { ++visits[index]; });
    for (const std::atomic<int>& visit : visits) EXPECT_EQ(visit.load(), 1);
  }
}

TEST(ParallelForLaws, TheLowestFailureIsTheOneThatIsThrown) {
  std::mt19937 random(8);
  for (int i = 0; i < 60; ++i) {
    const std::size_t count = 1 + random() % 200;
    std::set<std::size_t> failing;
    for (std::size_t n = 1 + random() % 5; n > 0; --n) failing.insert(random() % count);
    try {
      parallelFor(count, 1 + random() % 6, [&](std::size_t index) {
        if (failing.contains(index)) throw std::runtime_error(std::to_string(index));
      });
      FAIL() << "no exception came through";
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(error.what(), std::to_string(*failing.begin()));
    }
  }
}

TEST(ParallelForLaws, LoopsInLoopsAddUp) {
  std::atomic<std::size_t> sum = 0;
  parallelFor(10, 4, [&](std::size_t outer) { parallelFor(outer, 3, [&](std::size_t inner) { sum += inner; }); });
  std::size_t expected = 0;
  for (std::size_t outer = 0; outer < 10; ++outer) expected += outer * (outer - 1) / 2 * (outer > 0 ? 1 : 0);
  EXPECT_EQ(sum.load(), expected);
}

}  // namespace
}  // namespace mouthpiece
