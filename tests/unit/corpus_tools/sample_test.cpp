// The sample corpus: which sentences it holds, and what the actor and the cameras make of them.
#include "corpus_tools/sample/sample_corpus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "audio/audio_clip.h"
#include "base/errors.h"
#include "corpus_tools/research/models/actor_fit.h"
#include "corpus_tools/sample/actor_model.h"
#include "corpus_tools/sample/actor_performance.h"
#include "motion/cleaning/rigid.h"
#include "motion/formats/c3d_file.h"
#include "phonetics/labels/textgrid.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using test::readAll;
using test::ScratchFolder;

const fs::path kGridTakes = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/takes";
/// Flite is linked in: these tests need no child process.
constexpr const char* kQuickVoice = "flite:kal16";

std::string withoutCommas(std::string text) {
  std::erase(text, ',');
  return text;
}

TEST(SampleSentences, AreTheChosenOnesSomeWithAPause) {
  std::vector<std::string> chosen;
  for (const TimeSentence& sentence : chooseTimeSentences(55)) chosen.push_back(sentence.text());
  std::vector<std::string> built_in;
  std::size_t pauses = 0;
  for (const std::string& text : sampleSentences()) {
    built_in.push_back(withoutCommas(text));
    pauses += text != built_in.back() ? 1U : 0U;
  }
  EXPECT_EQ(built_in, chosen);
  EXPECT_GE(pauses, 5U) << "'now' must also be heard before a pause";
}

TEST(SampleSentences, TheRichOnesBeginWithTheClock) {
  const std::vector<std::string> clock = sampleSentences(), rich = sampleSentences(SamplePrompts::kRich);
  ASSERT_EQ(rich.size(), 305U);
  EXPECT_TRUE(std::equal(clock.begin(), clock.end(), rich.begin()));
  EXPECT_EQ(std::set<std::string>(rich.begin(), rich.end()).size(), rich.size()) << "a sentence stands there twice";
}

TEST(SampleActor, HasATargetForEveryPhone) {
  for (std::size_t i = 1; i < kPhoneCount; ++i) {
    const auto phone = static_cast<Phone>(i);
    const std::string name = "phone " + std::string(phoneName(phone)) + (isDiphthong(phone) ? " 1" : "");
    EXPECT_TRUE(sampleActor().targets.contains(name) || phone == Phone::kHH) << name;  // HH: what follows it
  }
  const auto opening = [](const char* viseme, const char* phone) {
    const auto& targets = sampleActor().targets;
    return (targets.at(viseme) + targets.at(phone)).dot(sampleActor().openings());
  };
  const double book = opening("viseme Uh", "phone UH");
  EXPECT_GT(book, opening("viseme Oo", "phone UW"));
  EXPECT_LT(book, opening("viseme Uh", "phone AH"));
}

using WordPair = std::pair<std::string, std::string>;

/// The words of `sentence` that follow each other; "twenty-five" is one word.
std::set<WordPair> wordPairs(const TimeSentence& sentence) {
  std::istringstream stream(sentence.text());
  const std::vector<std::string> words{std::istream_iterator<std::string>(stream), {}};
  std::set<WordPair> pairs;
  for (std::size_t i = 1; i < words.size(); ++i) pairs.emplace(words[i - 1], words[i]);
  return pairs;
}

/// An upper bound of the word pairs that `count` sentences can hold together; 55 reach it.
std::size_t mostWordPairs(std::size_t count) {
  std::set<WordPair> all;
  for (const TimeSentence& sentence : allTimeSentences()) {
    const std::set<WordPair> pairs = wordPairs(sentence);
    all.insert(pairs.begin(), pairs.end());
  }
  // Three kinds of pairs compete for the sentences. "Entries": {now, exactly, after, almost} with the first word of the
  // minutes (24) or with an hour (40 more; "five" and "ten" are among the 24): a sentence has one. {past, to} with an
  // hour (24). An hour with the first word of the day-info, of which {five, ten} x {in, am, pm} (6) matter here. Let x
  // be the number of sentences with minutes, or with the bare hour five or ten. The others alone bring the 40: entries
  // <= min(count, 24 + count - x). Of the last two kinds, 20 need sentences of their own with minutes, and 6 more need
  // one each with hour five or ten (which may bring the other 4 of the 24): all but 26 - x of them at best.
  constexpr std::size_t kEntries = 64, kMinuteEntries = 24, kOwnSentences = 26;
  std::size_t fewest_missing = all.size();
  for (std::size_t x = 0; x <= count; ++x) {
    const std::size_t entries = std::min({kEntries, count, kMinuteEntries + count - x});
    const std::size_t others_missing = kOwnSentences > x ? kOwnSentences - x : 0;
    fewest_missing = std::min(fewest_missing, kEntries - entries + others_missing);
  }
  return all.size() - fewest_missing;
}

TEST(SampleSentences, HoldEveryWordAndAsManyWordPairsAsTheyCan) {
  std::set<std::string> grammar_words, words;
  std::set<WordPair> pairs;
  for (const TimeSentence& sentence : allTimeSentences()) {
    for (const auto& [first, second] : wordPairs(sentence)) grammar_words.insert({first, second});
  }
  for (const TimeSentence& sentence : chooseTimeSentences(55)) {
    for (const WordPair& pair : wordPairs(sentence)) {
      words.insert({pair.first, pair.second});
      pairs.insert(pair);
    }
  }
  EXPECT_EQ(words, grammar_words);
  EXPECT_EQ(pairs.size(), mostWordPairs(55));
}

SampleOptions quickOptions(std::uint64_t seed = 1) {
  SampleOptions options;
  options.seed = seed;
  options.sentences = {"the time is now, exactly half past one", "almost five to twelve pm"};
  options.voice = kQuickVoice;
  return options;
}

TEST(SampleCorpus, SameSeedSameBytesWhateverTheJobs) {
  const ScratchFolder a, b, c;
  SampleOptions options = quickOptions();
  writeSampleCorpus(a.path(), options);
  options.jobs = 1;
  writeSampleCorpus(b.path(), options);
  writeSampleCorpus(c.path(), quickOptions(2));
  for (const char* name : {"take_01.c3d", "take_01.wav", "take_01.txt", "take_01.TextGrid", "take_02.c3d"}) {
    EXPECT_FALSE(readAll(a.path() / name).empty()) << name;
    EXPECT_EQ(readAll(a.path() / name), readAll(b.path() / name)) << name;
  }
  EXPECT_NE(readAll(a.path() / "take_01.c3d"), readAll(c.path() / "take_01.c3d"));
}

TEST(SampleCorpus, SoundLabelsAndMotionLastAsLong) {
  const ScratchFolder scratch;
  writeSampleCorpus(scratch.path(), quickOptions());
  const MotionClip motion = readC3d(scratch.path() / "take_01.c3d");
  EXPECT_EQ(motion.frame_rate_hz, 120);
  EXPECT_EQ(motion.markerCount(), 66U + 7U);
  EXPECT_NEAR(motion.duration(), readAudio(scratch.path() / "take_01.wav").duration(), 0.03);
  EXPECT_NEAR(motion.duration(), readTextGrid(scratch.path() / "take_01.TextGrid").duration(), 0.03);
}

TEST(SampleCorpus, CapturedIsTheTruthMovedWithNoiseAndGaps) {
  const ScratchFolder scratch;
  SampleOptions options = quickOptions();
  options.truth_folder = scratch.path() / "truth";
  const SampleSummary summary = writeSampleCorpus(scratch.path(), options);
  EXPECT_GT(summary.gaps, 0U);
  EXPECT_GT(summary.missing_share, 0.0);
  EXPECT_LT(summary.missing_share, 0.02);
  const MotionClip captured = readC3d(scratch.path() / "take_01.c3d");
  const MotionClip truth = readC3d(*options.truth_folder / "take_01.c3d");
  ASSERT_EQ(truth.markerCount(), 66U);
  ASSERT_EQ(truth.frameCount(), captured.frameCount());
  double squared_mm2 = 0, moved_mm = 0;
  std::size_t samples = 0;
  for (std::size_t frame = 0; frame < truth.frameCount(); frame += 10) {
    const MarkerPositions on_head = truth.pose(FrameIndex(frame));
    const MarkerPositions in_room = captured.pose(FrameIndex(frame)).topRows(66);
    const auto motion = fitRigidMotion(on_head, in_room, {0});
    ASSERT_TRUE(motion.has_value());
    moved_mm = std::max(moved_mm, (motion->apply({0, 0, 80}) - in_room.row(0).transpose()).norm());
    for (Eigen::Index i = 0; i < 66; ++i) {
      if (!in_room.row(i).allFinite()) continue;
      squared_mm2 += (motion->apply(on_head.row(i).transpose()) - in_room.row(i).transpose()).squaredNorm() / 3;
      ++samples;
    }
  }
  EXPECT_NEAR(std::sqrt(3 * squared_mm2 / static_cast<double>(samples)), SampleCaptureOptions().noise_mm, 0.02)
      << "mm in 3-D";
}

TEST(SampleCorpus, LipsCloseForBilabials) {
  const ScratchFolder scratch;
  SampleOptions options = quickOptions();
  options.truth_folder = scratch.path() / "truth";
  writeSampleCorpus(scratch.path(), options);
  const MotionClip truth = readC3d(*options.truth_folder / "take_01.c3d");
  const auto opening = [&](Seconds time) {
    const auto frame =
        FrameIndex(std::min(truth.frameCount() - 1, static_cast<std::size_t>(time * truth.frame_rate_hz)));
    return truth.position(frame, *truth.findMarker("LIP_UP_MID")).y() -
           truth.position(frame, *truth.findMarker("LIP_LO_MID")).y();
  };
  const ActorModel& actor = sampleActor();
  const MotionClip names{0, actor.marker_names, {}};
  const double rest = actor.neutral_mm(static_cast<Eigen::Index>(names.findMarker("LIP_UP_MID")->value), 1) -
                      actor.neutral_mm(static_cast<Eigen::Index>(names.findMarker("LIP_LO_MID")->value), 1);
  std::size_t closures = 0;
  for (const LabelledPhone& phone : readTextGrid(scratch.path() / "take_01.TextGrid").phones) {
    if (!isBilabial(phone.phone)) continue;
    double least = 1e9;
    for (Seconds t = phone.span.start - 0.04; t < phone.span.end; t += 0.005) least = std::min(least, opening(t));
    EXPECT_LT(least - rest, 1.5) << "mm over the closed mouth, at " << phone.span.start << " s";
    ++closures;
  }
  EXPECT_GE(closures, 2U);
}

TEST(SampleCorpus, SentenceFileWithNothingInItIsRefused) {
  const ScratchFolder scratch;
  const fs::path path = scratch.write("none.txt", "# only a comment\n\n");
  EXPECT_THROW(readSentences(path), InputError);
}

TEST(ActorModel, IsRefusedWhenItContradictsItself) {
  const std::string good = actorModelToJson(sampleActor());
  EXPECT_NO_THROW(parseActorModel(good, "good.json"));
  EXPECT_THROW(parseActorModel("", "x.json"), InputError);
  EXPECT_THROW(parseActorModel("{}", "x.json"), InputError);
  std::string bad = good;
  bad.replace(bad.find("\"gain\":["), 8, "\"gain\":[1,");
  EXPECT_THROW(parseActorModel(bad, "x.json"), InputError);
}

TEST(ActorModel, SurvivesWritingAndReading) {
  const std::string once = actorModelToJson(sampleActor());
  const ActorModel again = parseActorModel(once, "again.json");
  EXPECT_EQ(actorModelToJson(again), once);
  EXPECT_EQ(again.targets.size(), sampleActor().targets.size());
  EXPECT_EQ(again.component_shapes.rows(), again.gain.size());
}

/// Whichever key is missing or of another kind, it is named.
TEST(ActorModel, NamesTheKeyThatIsWrong) {
  const nlohmann::json whole = nlohmann::json::parse(actorModelToJson(sampleActor()));
  for (const auto& [key, value] : whole.items()) {
    SCOPED_TRACE(key);
    nlohmann::json without = whole, other = whole;
    without.erase(key);
    other[key] = value.is_string() ? nlohmann::json(5) : nlohmann::json("text");
    for (const nlohmann::json& bad : {without, other}) {
      try {
        (void)parseActorModel(bad.dump(), "x.json");
        ADD_FAILURE() << "was accepted";
      } catch (const InputError& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with("x.json:" + key + (key == "closures" ? "" : ": ")))
            << error.what();
      }
    }
  }
}

TEST(ActorModel, CarriesTheCreditOfItsData) {
  EXPECT_NE(sampleActor().credit.find("GRID"), std::string::npos);
  EXPECT_NE(sampleActor().credit.find("CC BY 4.0"), std::string::npos);
}

/// The fitting program's own steps on some of the takes come out near the committed numbers.
TEST(ActorFit, LearnsFromTheCaptureAndHoldsOnTakesItHasNotSeen) {
  if (!fs::exists(kGridTakes)) GTEST_SKIP() << "no real capture in " << kGridTakes;
  const ActorCapture capture = readActorCapture(kGridTakes, 6);
  ActorFitOptions options;
  options.credit = "a test";
  const ActorModel model = fitActor(withoutFold(capture, 5, 0), options);
  const Eigen::RowVectorXd learnt = model.component_shapes.row(0).normalized();
  const Eigen::RowVectorXd committed = sampleActor().component_shapes.row(0).normalized();
  EXPECT_GT(std::abs(learnt.dot(committed)), 0.95) << "the first component is the opening of the jaw";
  const LipMeasures lips = scoreActor(model, onlyFold(capture, 5, 0), {});
  EXPECT_GT(lips.openingCorrelation(), 0.8);
  EXPECT_LT(lips.lipRms(), 2.0) << "mm";
}

}  // namespace
}  // namespace mouthpiece
