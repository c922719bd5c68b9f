#include "exports/format_bytes.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/spoken_phones.h"

namespace mouthpiece {
namespace {

TEST(AblationPage, HoldsEveryVariantAndNoTextEndsItsScript) {
  const SpeechLabels labels = samples::spokenPhones({{Phone::kAA, 0.5}});
  const std::vector<CurveVariant> variants = {
      {"all", {{"Ah", {{0.38, 0, 0, 0}, {0.5, 0.8, 0, 0}, {1, 0, 0, 0}}}}, {0, 1.25, 0}, {0, 0.5, 0}},
      {"without Ps", {{"Ah", {{0.38, 0, 0, 0}, {0.5, 0.6, 0, 0}, {1, 0, 0, 0}}}}, {0, 1, 0}, {0, 0.4, 0}}};
  const std::string page = ablationPage("a </script> \xff & b", labels, variants, 60);
  const std::string start = "const data = ";
  const std::size_t from = page.find(start) + start.size();
  const auto data = nlohmann::json::parse(page.substr(from, page.find(";\nconst colours", from) - from));
  ASSERT_EQ(data.at("variants").size(), 2U);
  EXPECT_EQ(data["variants"][1].at("name"), "without Ps");
  EXPECT_EQ(data["variants"][1]["curves"]["Ah"][1][1], 0.6);
  EXPECT_EQ(data["variants"][0]["lip_opening_mm"][1], 1.25);
  EXPECT_EQ(data.at("phones")[1][0], "AA");
  EXPECT_EQ(data.at("rate_hz"), 60);
  const std::string end = "</script>";
  EXPECT_EQ(page.find(end), page.rfind(end)) << "one script, its own end";
  EXPECT_NE(page.find("Content-Security-Policy\" content=\"default-src 'none'"), std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
