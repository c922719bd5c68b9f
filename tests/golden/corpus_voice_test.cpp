// `synth --voice corpus`: sound and movement from the same recordings.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "audio/audio_clip.h"
#include "phonetics/labels/textgrid.h"
#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const fs::path kVoiceShare = MOUTHPIECE_BUILD_SHARE_DIR;
const fs::path kTakes = fs::path(MOUTHPIECE_BUILD_DIR) / "sample_takes";

class CorpusVoice : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kVoiceShare / "sample.corpus") || !fs::exists(kTakes)) {
      GTEST_SKIP() << "no sample corpus in " << kVoiceShare << ": run `make data`";
    }
  }

  ProgramResult speak(const std::string& text) {
    return runProgram("synth",
                      {"--voice", "corpus", "--text", text, "-o", wav().string(), "-o", report().string(), "--quiet"});
  }

  [[nodiscard]] fs::path wav() const { return scratch_.path() / "line.wav"; }
  [[nodiscard]] fs::path report() const { return scratch_.path() / "line.json"; }

  ScratchFolder scratch_;
};

/// The best normalised correlation of `count` samples of `line` at `at` with `take` within `slack` samples of `guess`.
double likeness(const AudioClip& line, std::size_t at, const AudioClip& take, std::size_t guess, std::size_t count,
                std::size_t slack) {
  double best = -1;
  for (std::size_t from = guess - std::min(guess, slack); from <= guess + slack; ++from) {
    if (from + count > take.samples.size()) break;
    double ab = 0, aa = 1e-12, bb = 1e-12;
    for (std::size_t i = 0; i < count; ++i) {
      const double a = line.samples[at + i], b = take.samples[from + i];
      ab += a * b;
      aa += a * a;
      bb += b * b;
    }
    best = std::max(best, ab / std::sqrt(aa * bb));
  }
  return best;
}

TEST_F(CorpusVoice, TheSoundOfAUnitIsTheRecordingThatMovesTheFace) {
  const ProgramResult result = speak("the time is now exactly five past one in the morning");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json facts = json::parse(readAll(report()));
  EXPECT_EQ(facts.at("voice"), "corpus:sample");
  const AudioClip line = readAudio(wav());
  EXPECT_NEAR(line.duration(), facts.at("phones").back().at("end_s").get<double>(), 0.01);
  double heard = 0;
  std::size_t compared = 0;
  for (const json& unit : facts.at("units")) {
    if (!unit.contains("sound")) continue;
    const double start = unit.at("sound")[0], end = unit.at("sound")[1];
    // A phone that no unit covers is a recording of that phone alone.
    if (facts.at("backoff").empty()) {
      EXPECT_NEAR(start, heard, 2e-3) << "one recording takes over where the other ends";
    } else {
      EXPECT_GE(start, heard - 2e-3);
    }
    heard = end;
    constexpr double kClearOfJoins = 0.14;  // pitch is changed up to 120 ms from a join
    if (end - start < 2 * kClearOfJoins + 0.1) continue;
    const AudioClip take = readAudio(kTakes / (unit.at("take").get<std::string>() + ".wav"));
    const double source_end = unit.at("source_end_s");
    const auto at = static_cast<std::size_t>((start + kClearOfJoins) * line.sample_rate_hz);
    const auto count = static_cast<std::size_t>((end - start - 2 * kClearOfJoins) * line.sample_rate_hz);
    // Where in the take that is depends on the cuts: look for it all over the fragment.
    const double guess = (unit.at("source_start_s").get<double>() + source_end - (end - start)) / 2 + kClearOfJoins;
    const auto slack = static_cast<std::size_t>(0.5 * take.sample_rate_hz);
    EXPECT_GT(
        likeness(line, at, take, static_cast<std::size_t>(std::max(0.0, guess) * take.sample_rate_hz), count, slack),
        0.98)
        << unit;
    ++compared;
  }
  EXPECT_NEAR(heard, line.duration(), 0.01);
  EXPECT_GT(compared, 0U);
}

TEST_F(CorpusVoice, TheFaceGoesOverWhereTheSoundDoes) {
  const ProgramResult result = speak("the time is now exactly five past one in the morning");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json facts = json::parse(readAll(report()));
  const json& units = facts.at("units");
  std::size_t cuts = 0;
  for (std::size_t i = 0; i + 1 < units.size(); ++i) {
    if (!units[i].contains("sound") || !units[i + 1].contains("sound")) continue;
    if (units[i].at("last") != units[i + 1].at("first")) continue;
    const json& shared = facts.at("phones").at(units[i].at("last").get<std::size_t>());
    if (shared.at("phone") == "sil") continue;
    const double cut = units[i].at("sound")[1];
    const double start = shared.at("start_s"), end = shared.at("end_s");
    constexpr double kMargin = 0.1;       // of the phone: no join nearer to its ends
    constexpr double kRoundingS = 0.002;  // of the times in the report
    double nearest = 1;
    for (const json& join : facts.at("joins"))
      nearest = std::min(nearest, std::abs(join.at("time_s").get<double>() - cut));
    EXPECT_LT(nearest, kMargin * (end - start) + kRoundingS) << shared;
    ++cuts;
  }
  EXPECT_GT(cuts, 0U);
}

TEST_F(CorpusVoice, DurationsAreTheFragmentsOwn) {
  ASSERT_EQ(speak("the time is now almost ten past two am").exit_code, 0);
  const json facts = json::parse(readAll(report()));
  std::size_t compared = 0;
  for (const json& unit : facts.at("units")) {
    if (!unit.contains("sound")) continue;
    const SpeechLabels take = readTextGrid(kTakes / (unit.at("take").get<std::string>() + ".TextGrid"));
    const std::size_t first = unit.at("first"), last = unit.at("last"), source = unit.at("source_first");
    for (std::size_t i = first + 1; i < last; ++i) {  // the outer ones are shared
      const json& phone = facts.at("phones")[i];
      const TimeSpan recorded = take.phones[source + i - first].span;
      EXPECT_NEAR(phone.at("end_s").get<double>() - phone.at("start_s").get<double>(), recorded.duration(), 2e-3)
          << phone;
      ++compared;
    }
  }
  EXPECT_GT(compared, 5U);
}

TEST_F(CorpusVoice, SpeaksAtTheRateThatIsAskedFor) {
  const auto durationAt = [&](const std::string& rate) {
    const ProgramResult result = runProgram("synth", {"--voice", "corpus", "--rate", rate, "--text", "the time is now",
                                                      "-o", wav().string(), "-o", report().string(), "--quiet"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const double labelled = json::parse(readAll(report())).at("phones").back().at("end_s").get<double>();
    EXPECT_NEAR(readAudio(wav()).duration(), labelled, 0.01);
    return labelled;
  };
  const double slow = durationAt("0.8"), quick = durationAt("1.6");
  EXPECT_NEAR(slow / quick, 2.0, 0.15) << "pauses at the ends are cut to the same length first";
  const ProgramResult other = runProgram("synth", {"--rate", "1", "--text", "now", "-o", wav().string()});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.err.find("expected the voice corpus"), std::string::npos) << other.err;
}

TEST_F(CorpusVoice, APhoneThatWasNeverRecordedIsNamed) {
  // The time grammar has no B.
  const ProgramResult result = runProgram(
      "synth", {"--voice", "corpus", "--corpus", "clock", "--text", "a bee", "-o", wav().string(), "--quiet"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("no recording of the phone B (in 'bee')"), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(wav()));
}

}  // namespace
}  // namespace mouthpiece::test
