#include "base/json_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>

#include "base/page_data.h"

namespace mouthpiece {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

std::string randomText(std::mt19937& random) {
  constexpr std::array<const char*, 10> kPieces{"a", "<", ">", "&", "\"", "\\", "\n", "\xC3\xA9", "\xE2\x80\xA8", "/"};
  std::string text;
  for (std::size_t length = random() % 8; length > 0; --length) text += kPieces[random() % kPieces.size()];
  return text;
}

template <typename Json>
Json randomValue(std::mt19937& random, int depth) {
  switch (random() % (depth > 0 ? 7 : 5)) {
    case 0:
      return nullptr;
    case 1:
      return random() % 2 == 0;
    case 2:
      return static_cast<std::int64_t>(random()) - 2'000'000'000;
    case 3:
      return static_cast<double>(random()) / 7919;
    case 4:
      return randomText(random);
    case 5: {
      Json list = Json::array();
      for (std::size_t i = random() % 4; i > 0; --i) list.push_back(randomValue<Json>(random, depth - 1));
      return list;
    }
    default: {
      Json object = Json::object();
      for (std::size_t i = random() % 4; i > 0; --i) object[randomText(random)] = randomValue<Json>(random, depth - 1);
      return object;
    }
  }
}

class JsonTextLaws : public testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};
};

TEST_P(JsonTextLaws, WhatIsWrittenIsReadAgain) {
  const json value = randomValue<json>(random_, 4);
  for (const int indent : {-1, 0, 2}) EXPECT_EQ(looseJson(jsonText(value, indent)), value);
  EXPECT_EQ(json::from_cbor(cborBytes(value)), value);
  EXPECT_EQ(jsonText(value).find('\n'), std::string::npos);
}

TEST_P(JsonTextLaws, OrderedKeysStayInTheirOrder) {
  const auto value = randomValue<ordered_json>(random_, 4);
  const ordered_json read = looseOrderedJson(jsonText(value, 1));
  EXPECT_EQ(jsonText(read), jsonText(value)) << "not only equal: in the same order";
}

TEST_P(JsonTextLaws, AScriptCannotBeEndedByAValue) {
  const json value = randomValue<json>(random_, 4);
  const std::string text = scriptJson(value);
  EXPECT_EQ(looseJson(text), value);
  const auto isUnsafe = [](char c) { return c == '<' || c == '>' || c == '&' || static_cast<unsigned char>(c) > 126; };
  EXPECT_TRUE(std::none_of(text.begin(), text.end(), isUnsafe)) << text;
}

INSTANTIATE_TEST_SUITE_P(Seeds, JsonTextLaws, testing::Range(0U, 40U));

TEST(JsonText, WhatIsNoUtf8IsShownAndDoesNotThrow) {
  const std::string broken = "a\xFFz";
  EXPECT_EQ(jsonText(json{{"t", broken}}), "{\"t\":\"a\xEF\xBF\xBDz\"}");
  EXPECT_EQ(jsonText(ordered_json{{"t", broken}}, 1), "{\n \"t\": \"a\xEF\xBF\xBDz\"\n}");
  EXPECT_EQ(scriptJson(ordered_json{{"t", broken}}), "{\"t\":\"a\\ufffdz\"}");
}

TEST(JsonText, WhatIsNoJsonIsDiscarded) {
  for (const char* text : {"", "{", "[1,]", "nul", "{\"a\":1}x"}) {
    EXPECT_TRUE(looseJson(text).is_discarded()) << text;
    EXPECT_TRUE(looseOrderedJson(text).is_discarded()) << text;
  }
}

}  // namespace
}  // namespace mouthpiece
