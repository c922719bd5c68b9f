#include "base/text_encoding.h"

#include <gtest/gtest.h>

#include "base/errors.h"

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

TEST(TextEncoding, DecodesSurrogatePairsAndRefusesHalves) {
  using namespace std::string_literals;
  EXPECT_EQ(decodeText("\xFE\xFF\xD8\x3D\xDE\x00"s, "f"), "\xF0\x9F\x98\x80");
  EXPECT_THROW(decodeText("\xFE\xFF\xD8\x3D"s, "f"), InputError);
  EXPECT_THROW(decodeText("\xFE\xFF\xDE\x00\xD8\x3D"s, "f"), InputError);
  EXPECT_THROW(decodeText("\xFF\xFE\x41"s, "f"), InputError);
}

}  // namespace
}  // namespace mouthpiece
