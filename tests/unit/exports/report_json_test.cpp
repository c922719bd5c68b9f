#include "exports/format_bytes.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "base/index.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

TEST(Report, HasEveryFieldThatTheDesignNames) {
  const auto head = samples::makeTalkingHead();
  const json report = json::parse(reportJson(head.utterance, head.utterance.timing_ms));
  EXPECT_EQ(report["text"], "mama");
  EXPECT_EQ(report["voice"], "test:hum");
  EXPECT_EQ(report["corpus"], "made_up");
  EXPECT_EQ(report["fps"], 60.0);
  EXPECT_EQ(report["frames"], 120);
  EXPECT_EQ(report["duration_s"], 2.0);
  ASSERT_EQ(report["phones"].size(), 6U);
  EXPECT_EQ(report["phones"][1],
            json::parse(R"({"phone": "M", "start_s": 0.12, "end_s": 0.24, "word": "mama", "from": "unit"})"));
  EXPECT_EQ(report["phones"][0]["word"], "");
  ASSERT_EQ(report["units"].size(), 3U);
  for (const char* field : {"first", "last", "take", "source_first", "start_s", "end_s", "scale", "cost"}) {
    EXPECT_TRUE(report["units"][0].contains(field)) << field;
  }
  EXPECT_EQ(report["units"][0]["last"], report["units"][1]["first"]);
  ASSERT_EQ(report["joins"].size(), 2U);
  EXPECT_EQ(report["joins"][1]["velocity_jump_mm_s"], 7.0);
  EXPECT_EQ(report["backoff"], json::parse(R"([{"first": 2, "last": 3}])"));
}

TEST(Report, APhoneThatABackOffUnitTouchesIsBackOff) {
  const json report = json::parse(reportJson(samples::makeTalkingHead().utterance, {}));
  std::vector<std::string> from;
  for (const json& phone : report["phones"]) from.push_back(phone["from"]);
  EXPECT_EQ(from, (std::vector<std::string>{"unit", "unit", "backoff", "backoff", "unit", "unit"}));
}

/// A page shows words by their phones: "ma ma" would be one.
TEST(Report, AWordThatIsSaidAgainBeginsAnew) {
  UtteranceAnimation line = samples::makeTalkingHead().utterance;
  SpeechLabels& labels = line.labels;
  labels.words[0].text = "ma";
  labels.words.push_back(labels.words[0]);
  for (std::size_t i = 3; i < 5; ++i) labels.phones[i].word = 1;
  const json report = json::parse(reportJson(line, {}));
  std::vector<std::size_t> again;
  for (std::size_t i = 0; i < report["phones"].size(); ++i) {
    if (report["phones"][i].contains("says_again")) again.push_back(i);
  }
  EXPECT_EQ(again, std::vector<std::size_t>{3});
}

TEST(Report, GuessedWordsAreListedWithWhatIsSaid) {
  UtteranceAnimation line = samples::makeTalkingHead().utterance;
  EXPECT_EQ(json::parse(reportJson(line, {}))["guesses"], json::array());
  line.guessed_words = {0};
  EXPECT_EQ(json::parse(reportJson(line, {}))["guesses"],
            json::parse(R"([{"word": "mama", "start_s": 0.12, "phones": ["M", "AA", "M", "AA"]}])"));
}

TEST(Report, TheRealTimeFactorLeavesSpeechOut) {
  const UtteranceAnimation line = samples::makeTalkingHead().utterance;
  const json report = json::parse(reportJson(line, line.timing_ms));
  EXPECT_EQ(
      report["timing_ms"],
      json::parse(
          R"({"load": 0.5, "speech": 100.0, "selection": 1.0, "motion": 2.0, "retarget": 3.0, "deform": 4.0, "write": 5.0})"));
  EXPECT_DOUBLE_EQ(report["real_time_factor"], (0.5 + 1 + 2 + 3 + 4 + 5) / 1000.0 / 2.0);
}

TEST(Report, TextThatIsNoUtf8StaysJson) {
  auto head = samples::makeTalkingHead();
  head.utterance.text = "caf\xE9 \x80";
  EXPECT_TRUE(json::accept(reportJson(head.utterance, head.utterance.timing_ms)));
}

/// However a line is cut into units, the share of back-off counts each pair of phones once.
TEST(Report, TheShareOfBackOffIsThatOfThePairs) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 50; ++trial) {
    UtteranceAnimation line = samples::makeTalkingHead({.frames = 4, .rings = 3, .segments = 5}).utterance;
    const std::size_t phones = line.labels.phones.size();
    line.units.clear();
    std::size_t backed_off_pairs = 0, touched = 0;
    std::vector<bool> is_touched(phones, false);
    for (std::size_t first = 0; first + 1 < phones;) {
      PlacedUnit unit;
      const std::size_t last = first + 1 + random() % (phones - first - 1);
      unit.phones = {PhoneIndex(first), PhoneIndex(last)};
      unit.is_backoff = random() % 2 == 0;
      if (unit.is_backoff) {
        backed_off_pairs += last - first;
        for (std::size_t i = first; i <= last; ++i) is_touched[i] = true;
      }
      line.units.push_back(unit);
      first = last;
    }
    for (const bool each : is_touched) touched += each ? 1U : 0U;
    const json report = json::parse(reportJson(line, line.timing_ms));
    EXPECT_NEAR(report["backoff_share"].get<double>(), asReal(backed_off_pairs) / asReal(phones - 1), 1e-6);
    std::size_t told = 0;
    for (const json& phone : report["phones"]) told += phone["from"] == "backoff" ? 1U : 0U;
    EXPECT_EQ(told, touched);
    EXPECT_EQ(report["units"].size(), line.units.size());
  }
}

}  // namespace
}  // namespace mouthpiece
