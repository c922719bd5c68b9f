#include "base/text_encoding.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <iterator>
#include <random>
#include <string>

#include "base/errors.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

TEST(TextEncoding, EveryCodePointSurvivesUtf8) {
  for (char32_t c = 0; c <= 0x10FFFF; c += c < 0x1000 ? 1 : 61) {
    if (c >= 0xD800 && c < 0xE000) continue;
    std::string text;
    appendUtf8(text, c);
    std::size_t at = 0;
    EXPECT_EQ(decodeUtf8(text, at), c);
    EXPECT_EQ(at, text.size());
  }
}

TEST(TextEncoding, RefusesBrokenUtf8) {
  for (const char* text : {"\x80", "\xC0\xAF", "\xC3", "\xE2\x82", "\xED\xA0\x80", "\xE0\x80\xAF", "\xF4\x90\x80\x80",
                           "\xFF", "\xC3\x28"}) {
    std::size_t at = 0;
    EXPECT_FALSE(decodeUtf8(text, at));
    EXPECT_EQ(at, 0U);
  }
}

/// A terminal obeys nothing of it, in whatever form; a right-to-left script stays whole.
TEST(Printable, ShowsWhatATerminalWouldObey) {
  EXPECT_EQ(printable("a\x1B[31m\tb\x7F"), "a\\x1B[31m\\x09b\\x7F");
  EXPECT_EQ(printable("\xC2\x9B"
                      "31m \xC2\x80\xC2\x9F"),
            "\\xC2\\x9B31m \\xC2\\x80\\xC2\\x9F");
  EXPECT_EQ(printable("\u2028\u202A\u202E\u2066\u2069"),
            "\\xE2\\x80\\xA8\\xE2\\x80\\xAA\\xE2\\x80\\xAE\\xE2\\x81\\xA6\\xE2\\x81\\xA9");
  for (const std::string whole : {"\u00A0\u00E9", "\u2027\u202F\u2065\u206A", "\u05E9\u05DC\u05D5\u05DD", "\u0301"})
    EXPECT_EQ(printable(whole), whole);
  EXPECT_EQ(printable("\xFF\xE2\x80"), "\\xFF\\xE2\\x80") << "broken UTF-8";
}

TEST(TextEncoding, DecodesSurrogatePairsAndRefusesHalves) {
  using namespace std::string_literals;
  EXPECT_EQ(decodeText("\xFE\xFF\xD8\x3D\xDE\x00"s, "f"), "\xF0\x9F\x98\x80");
  EXPECT_THROW(decodeText("\xFE\xFF\xD8\x3D"s, "f"), InputError);
  EXPECT_THROW(decodeText("\xFE\xFF\xDE\x00\xD8\x3D"s, "f"), InputError);
  EXPECT_THROW(decodeText("\xFF\xFE\x41"s, "f"), InputError);
}

TEST(TextEncoding, TellsWhatIsNoText) {
  using namespace std::string_literals;
  EXPECT_EQ(kindOfNoText("RIFF\x24\0\0\0WAVEfmt "s), "a sound (WAV)");
  EXPECT_EQ(kindOfNoText("\0\0\0\x1C"
                         "ftypM4A "s),
            "a sound or a film (MPEG-4)");
  EXPECT_EQ(kindOfNoText("MThd\0\0\0\6"s), "a song (MIDI)");
  EXPECT_EQ(kindOfNoText("\x89PNG\r\n\x1A\n"), "a picture (PNG)");
  EXPECT_EQ(kindOfNoText("glTF\2\0\0\0"s), "a head (GLB)");
  EXPECT_EQ(kindOfNoText("\2P\0\0"s), "a motion capture (C3D)");
  EXPECT_EQ(kindOfNoText("SQLite format 3\0"s), "a corpus or another database");
  EXPECT_EQ(errorOf([] { decodeText("%PDF-1.4\n", "a.pdf"); }), "a.pdf: is a PDF; expected text");
  for (const char* text : {"", "R", "RIFF raff is a word", "ID3 tags", "The ftyp box", "GIF87 is old", "PK", "\2", "2P",
                           "[0,0,0,0]", "MThd", "\xFF\xFEh", "%PDF"})
    EXPECT_EQ(kindOfNoText(text), "") << text;
}

/// UTF-8 by its table (RFC 3629, section 4), as slow as it is plain.
bool isUtf8ByTheTable(const std::string& text) {
  struct Row {
    int first_low, first_high, second_low, second_high;
    std::size_t length;
  };
  constexpr Row kRows[] = {{0x00, 0x7F, 0, 0, 1},       {0xC2, 0xDF, 0x80, 0xBF, 2}, {0xE0, 0xE0, 0xA0, 0xBF, 3},
                           {0xE1, 0xEC, 0x80, 0xBF, 3}, {0xED, 0xED, 0x80, 0x9F, 3}, {0xEE, 0xEF, 0x80, 0xBF, 3},
                           {0xF0, 0xF0, 0x90, 0xBF, 4}, {0xF1, 0xF3, 0x80, 0xBF, 4}, {0xF4, 0xF4, 0x80, 0x8F, 4}};
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : -1; };
  for (std::size_t i = 0; i < text.size();) {
    std::size_t length = 0;
    for (const Row& row : kRows) {
      if (byte(i) < row.first_low || byte(i) > row.first_high) continue;
      bool fits = row.length == 1 || (byte(i + 1) >= row.second_low && byte(i + 1) <= row.second_high);
      for (std::size_t k = 2; k < row.length; ++k) fits = fits && byte(i + k) >= 0x80 && byte(i + k) <= 0xBF;
      if (fits) length = row.length;
    }
    if (length == 0) return false;
    i += length;
  }
  return true;
}

TEST(TextEncoding, AgreesWithTheTableOnRandomBytes) {
  std::mt19937 random(20261122);
  constexpr unsigned char kLikely[] = {'a',  0x7F, 0x80, 0x8F, 0x90, 0x9F, 0xA0, 0xBF, 0xC1, 0xC2, 0xDF,
                                       0xE0, 0xE1, 0xED, 0xEE, 0xEF, 0xF0, 0xF1, 0xF3, 0xF4, 0xF5, 0xFF};
  std::size_t good = 0;
  for (int round = 0; round < 200'000; ++round) {
    std::string text;
    const int length = std::uniform_int_distribution<int>(1, 5)(random);
    for (int i = 0; i < length; ++i)
      text += static_cast<char>(kLikely[std::uniform_int_distribution<std::size_t>(0, std::size(kLikely) - 1)(random)]);
    bool is_good = true;
    std::string again;
    for (std::size_t at = 0; is_good && at < text.size();) {
      const auto c = decodeUtf8(text, at);
      is_good = c.has_value();
      if (c) appendUtf8(again, *c);
    }
    ASSERT_EQ(is_good, isUtf8ByTheTable(text)) << testing::PrintToString(text);
    ASSERT_TRUE(!is_good || again == text);
    good += is_good ? 1 : 0;
  }
  EXPECT_GT(good, 1000U);
}

TEST(TextEncoding, BothByteOrdersSayTheSame) {
  std::mt19937 random(20261122);
  for (int round = 0; round < 500; ++round) {
    std::string expected, big = "\xFE\xFF", little = "\xFF\xFE";
    const auto put = [&](char32_t unit) {
      big += {static_cast<char>(unit >> 8U), static_cast<char>(unit & 0xFFU)};
      little += {static_cast<char>(unit & 0xFFU), static_cast<char>(unit >> 8U)};
    };
    for (int i = 0; i < 20; ++i) {
      char32_t c = std::uniform_int_distribution<std::uint32_t>(1, 0x10FFFF)(random);
      if (c >= 0xD800 && c < 0xE000) c = 'x';
      appendUtf8(expected, c);
      if (c < 0x10000) {
        put(c);
      } else {
        put(0xD800 + ((c - 0x10000) >> 10U));
        put(0xDC00 + ((c - 0x10000) & 0x3FFU));
      }
    }
    EXPECT_EQ(decodeText(big, "f"), expected);
    EXPECT_EQ(decodeText(little, "f"), expected);
  }
}

TEST(TextEncoding, WhatIsNoUtf8IsWindows1252) {
  EXPECT_EQ(decodeText("don\x92t \x80 \x81", "f"), "don\u2019t \u20AC \u0081");
  EXPECT_EQ(decodeText("caf\xE9", "f"), "caf\xC3\xA9");
  EXPECT_EQ(decodeText("\xEF\xBB\xBF"
                       "caf\xC3\xA9",
                       "f"),
            "caf\xC3\xA9");
  EXPECT_EQ(decodeText("", "f"), "");
}

TEST(LowerCase, ChangesAsciiCapitalsAlone) {
  for (int c = 1; c < 256; ++c) {
    const std::string one(1, static_cast<char>(c));
    const bool is_capital = c >= 'A' && c <= 'Z';
    EXPECT_EQ(lowerCase(one), is_capital ? std::string(1, static_cast<char>(c + 32)) : one) << c;
  }
}

}  // namespace

}  // namespace mouthpiece
