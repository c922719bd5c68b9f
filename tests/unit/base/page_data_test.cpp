#include "base/page_data.h"

#include <gtest/gtest.h>

#include <string>

namespace mouthpiece {
namespace {

std::string encoded(std::string_view bytes) {
  std::string text;
  appendBase64(text, bytes);
  return text;
}

// RFC 4648, section 10.
TEST(Base64, MatchesTheStandardsVectors) {
  EXPECT_EQ(encoded(""), "");
  EXPECT_EQ(encoded("f"), "Zg==");
  EXPECT_EQ(encoded("fo"), "Zm8=");
  EXPECT_EQ(encoded("foo"), "Zm9v");
  EXPECT_EQ(encoded("foob"), "Zm9vYg==");
  EXPECT_EQ(encoded("fooba"), "Zm9vYmE=");
  EXPECT_EQ(encoded("foobar"), "Zm9vYmFy");
}

TEST(Base64, TakesEveryByteAndAppends) {
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes.push_back(static_cast<char>(i));
  std::string text = "before ";
  appendBase64(text, bytes);
  ASSERT_EQ(text.size(), 7 + 344U);
  EXPECT_EQ(text.substr(0, 23), "before AAECAwQFBgcICQoL");
  EXPECT_TRUE(text.ends_with("+fr7/P3+/w=="));
}

TEST(ClosedPage, LetsItsOwnScriptsRunAndNothingElse) {
  const std::string page = closedPage(
      "<head><meta charset=\"utf-8\"><script type=\"application/json\">{}</script></head><script>let a = 1;</script>"
      "<script>b()</script>");
  // printf 'let a = 1;' | openssl dgst -sha256 -binary | base64
  EXPECT_NE(page.find("default-src 'none'; script-src 'sha256-xY6QKfH9PRsQnLz56nj6MBwiK5oHg+im1Jkpdp1x/Ck=' 'sha256-"),
            std::string::npos)
      << page;
  EXPECT_EQ(page.find("unsafe-eval"), std::string::npos);
  EXPECT_LT(page.find("Content-Security-Policy"), page.find("<script"));
  EXPECT_TRUE(page.ends_with("<script>b()</script>"));
}

TEST(ScriptSafe, NothingEndsTheScriptAndAllReadsBack) {
  EXPECT_EQ(scriptSafe("{\"a\": [1, 2.5]}"), "{\"a\": [1, 2.5]}");
  EXPECT_EQ(scriptSafe("\"</script><!-- & -->\""), "\"\\u003c/script\\u003e\\u003c!-- \\u0026 --\\u003e\"");
}

}  // namespace
}  // namespace mouthpiece
