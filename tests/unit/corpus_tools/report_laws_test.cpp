// What the reports count, counted again in the plainest way, on random corpora.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "base/index.h"
#include "corpus_tools/building/corpus_facts.h"
#include "corpus_tools/report/corpus_report.h"
#include "corpus_tools/report/data_page.h"
#include "corpus_tools/sample/actor_performance.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr unsigned kReportSeeds = 12;

Corpus randomCorpus(unsigned seed) {
  std::mt19937 random(seed);
  const std::vector<std::string> sounds{"B", "IY", "N", "AA", "M", "P"};
  std::vector<CorpusTake> takes;
  for (std::size_t n = 1 + random() % 5; n > 0; --n) {
    std::vector<std::string> phones;
    for (std::size_t length = 1 + random() % 7; length > 0; --length)
      phones.push_back(sounds[random() % sounds.size()]);
    takes.push_back(saidTake("w" + std::to_string(random() % 4), phones));
    takes.back().name = "take" + std::to_string(takes.size());
    for (std::size_t hidden = random() % 3; hidden > 0; --hidden) {
      const auto marker = static_cast<Eigen::Index>(random() % 66);
      takes.back().motion.positions_mm.block(5, 3 * marker, 10, 3).setConstant(std::nan(""));
    }
  }
  return corpusOf("random", std::move(takes));
}

std::map<std::string, std::size_t> phoneCounts(const Corpus& corpus) {
  std::map<std::string, std::size_t> counts;
  for (const CorpusTake& take : corpus.takes) {
    for (const LabelledPhone& phone : take.labels.phones) ++counts[std::string(phoneName(phone.phone))];
  }
  return counts;
}

using NamePair = std::pair<std::string, std::string>;

std::map<NamePair, std::size_t> pairCounts(const Corpus& corpus) {
  std::map<NamePair, std::size_t> counts;
  for (const CorpusTake& take : corpus.takes) {
    const auto& phones = take.labels.phones;
    for (std::size_t i = 1; i < phones.size(); ++i)
      ++counts[{std::string(phoneName(phones[i - 1].phone)), std::string(phoneName(phones[i].phone))}];
  }
  return counts;
}

TEST(ReportLaws, CountsPhonesAndPairsAsTheyStand) {
  for (unsigned seed = 1; seed <= kReportSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Corpus corpus = randomCorpus(seed);
    const json report = json::parse(corpusReportJson(corpus));
    const auto phones = phoneCounts(corpus);
    for (const json& row : report["phones"]) {
      const auto counted = phones.find(row["phone"].get<std::string>());
      EXPECT_EQ(row["count"], counted == phones.end() ? 0U : counted->second) << row;
      EXPECT_LE(row["ms_5"], row["ms_50"]);
      EXPECT_LE(row["ms_50"], row["ms_95"]);
    }
    const auto pairs = pairCounts(corpus);
    std::size_t counted = 0;
    const std::vector<std::string> names = report["phone_names"];
    for (std::size_t a = 0; a < names.size(); ++a) {
      for (std::size_t b = 0; b < names.size(); ++b) {
        const auto known = pairs.find({names[a], names[b]});
        EXPECT_EQ(report["pairs"][a][b], known == pairs.end() ? 0U : known->second) << names[a] << " " << names[b];
        counted += report["pairs"][a][b].get<std::size_t>();
      }
    }
    std::size_t all = 0;
    for (const auto& [pair, count] : pairs) all += count;
    EXPECT_EQ(counted, all);
    EXPECT_EQ(report["takes"].size(), corpus.takes.size());
    EXPECT_EQ(report["markers"].size(), corpus.layout.markers.size());
  }
}

/// Of a language whose words are those of the corpus, nothing is missing; of one with another phone, that is.
TEST(ReportLaws, MissingIsWhatTheLanguageAsksFor) {
  for (unsigned seed = 1; seed <= kReportSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Corpus corpus = randomCorpus(seed);
    ReportOptions options;
    for (const CorpusTake& take : corpus.takes) {
      std::vector<Phone> word;
      for (const LabelledPhone& phone : take.labels.phones) {
        if (phone.phone != Phone::kSil) word.push_back(phone.phone);
      }
      options.language.push_back(word);
    }
    json missing = json::parse(corpusReportJson(corpus, options))["missing"];
    EXPECT_EQ(missing["missing_pairs"], 0);
    EXPECT_EQ(missing["speakable_words"], corpus.takes.size());
    EXPECT_EQ(missing["pair_share"], 1.0);
    options.language.push_back({*phoneFromName("ZH")});
    missing = json::parse(corpusReportJson(corpus, options))["missing"];
    EXPECT_EQ(missing["missing_pairs"], 2) << "from silence and back";
    EXPECT_EQ(missing["speakable_words"], corpus.takes.size());
  }
}

TEST(FactsLaws, CountWhatIsThere) {
  for (unsigned seed = 1; seed <= kReportSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Corpus corpus = randomCorpus(seed);
    const json facts = json::parse(corpusFactsJson(corpus));
    std::size_t phones = 0, missing = 0, samples = 0;
    double duration = 0, speech = 0;
    std::set<std::string> words;
    for (const CorpusTake& take : corpus.takes) {
      phones += take.labels.phones.size();
      duration += take.motion.duration();
      samples += take.motion.frameCount() * 66;
      for (const LabelledWord& word : take.labels.words) words.insert(word.text);
      for (const LabelledPhone& phone : take.labels.phones)
        speech += phone.phone == Phone::kSil ? 0 : phone.span.duration();
      for (std::size_t frame = 0; frame < take.motion.frameCount(); ++frame) {
        for (std::size_t marker = 0; marker < 66; ++marker)
          missing += take.motion.isSeen(FrameIndex(frame), MarkerIndex(marker)) ? 0U : 1U;
      }
    }
    EXPECT_EQ(facts["takes"], corpus.takes.size());
    EXPECT_EQ(facts["phones"], phones);
    EXPECT_EQ(facts["different_phones"], phoneCounts(corpus).size());
    EXPECT_EQ(facts["different_phone_pairs"], pairCounts(corpus).size());
    EXPECT_EQ(facts["different_words"], words.size());
    EXPECT_NEAR(facts["duration_s"].get<double>(), duration, 1e-9);
    EXPECT_NEAR(facts["speech_s"].get<double>(), speech, 1e-9);
    EXPECT_NEAR(facts["missing_share"].get<double>(), asReal(missing) / asReal(samples), 1e-12);
  }
}

/// Whatever text the data hold, the page's script does not end before its end.
TEST(DataPageLaws, NoTextEndsTheScript) {
  std::mt19937 random(1);
  const std::string letters = "<>/!-scriptSCRIPT&\"'\\ ";
  for (int round = 0; round < 300; ++round) {
    std::string text;
    for (std::size_t n = random() % 40; n > 0; --n) text += letters[random() % letters.size()];
    if (random() % 3 == 0) text += "</script><script>/*REPORT*/null/*STYLE*/";
    const std::string page =
        dataPage("<meta charset=\"utf-8\"><style>/*STYLE*/</style><script>/*TOOLS*/ const r = /*REPORT*/null;</script>",
                 json(text).dump());
    const std::string shown = page.substr(page.rfind("const r = ") + 10);
    EXPECT_EQ(shown.find('<'), shown.rfind("</script>")) << text;
    EXPECT_EQ(json::parse(shown.substr(0, shown.rfind(';'))).get<std::string>(), text);
  }
}

/// The cameras' picture of a face: with neither noise nor gaps all distances within face and jig are kept.
TEST(SampleCaptureLaws, WithoutNoiseTheHeadIsRigid) {
  for (unsigned seed = 1; seed <= kReportSeeds; ++seed) {
    SCOPED_TRACE(seed);
    SyntheticTake take;
    SampleCaptureOptions options{.seed = seed, .noise_mm = 0, .gaps_per_take = 0, .long_gap_chance = 0};
    const MotionClip face = take.truth();
    const SampleCapture capture = captureSample(face, take.labels(), options);
    EXPECT_EQ(capture.hidden.gaps, 0U);
    ASSERT_EQ(capture.motion.markerCount(), face.markerCount() + 7);
    for (std::size_t frame = 0; frame < face.frameCount(); frame += 10) {
      const MarkerPositions seen = capture.motion.pose(FrameIndex(frame)), real = face.pose(FrameIndex(frame));
      for (Eigen::Index marker = 1; marker < real.rows(); marker += 7)
        EXPECT_NEAR((seen.row(marker) - seen.row(0)).norm(), (real.row(marker) - real.row(0)).norm(), 1e-9);
      EXPECT_NEAR((seen.row(66) - seen.row(72)).norm(), (sampleJig().row(0) - sampleJig().row(6)).norm(), 1e-9);
    }
  }
}

TEST(SampleCaptureLaws, HiddenSamplesAreCounted) {
  for (unsigned seed = 1; seed <= kReportSeeds; ++seed) {
    SCOPED_TRACE(seed);
    SyntheticTake take;
    const SampleCapture capture = captureSample(take.truth(), take.labels(), {.seed = seed, .gaps_per_take = 12});
    const auto missing = capture.motion.positions_mm.array().isNaN().count() / 3;
    EXPECT_EQ(capture.hidden.hidden_samples, unsignedIndex(missing));
    EXPECT_EQ(captureSample(take.truth(), take.labels(), {.seed = seed, .gaps_per_take = 12})
                  .motion.positions_mm.array()
                  .isNaN()
                  .count(),
              3 * missing)
        << "the same seed hides the same";
  }
}

/// Mean 0 and deviation 1, and the same curve at another frame rate.
TEST(SampleNoiseLaws, IsTheSameCurveAtAnyRate) {
  for (std::uint64_t stream = 1; stream <= 6; ++stream) {
    SCOPED_TRACE(stream);
    const Eigen::VectorXd slow = smoothNoise(5, stream, 0.4, 50, 2000), fast = smoothNoise(5, stream, 0.4, 100, 4000);
    for (Eigen::Index i = 0; i < 1900; ++i) ASSERT_NEAR(slow[i], fast[2 * i], 1e-9);
    EXPECT_NEAR(slow.mean(), 0, 0.6);
    EXPECT_NEAR(std::sqrt((slow.array() - slow.mean()).square().mean()), 1, 0.35);
  }
}

}  // namespace
}  // namespace mouthpiece
