// Takes, motion and shapes that are loaded when they are asked for.
#include <gtest/gtest.h>

#include <filesystem>

#include "base/errors.h"
#include "support/corpus_file_fixture.h"
#include "support/repeated_corpus.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/file/corpus.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

TEST_F(CorpusFile, MayHoldNoTake) {
  writeCorpus(path_, samples::tinyCorpus(std::vector<std::string>{}));
  EXPECT_TRUE(checkCorpus(path_).empty());
  EXPECT_TRUE(readCorpus(path_).takes.empty());
}

TEST_F(CorpusFile, AudioCanBeLeftOut) {
  writeCorpus(path_, samples::tinyCorpus());
  const Corpus read = readCorpus(path_);
  EXPECT_TRUE(read.takes[0].audio.samples.empty());
  EXPECT_EQ(read.takes[0].audio.sample_rate_hz, 8000);
}

TEST_F(CorpusFile, MotionOnDemandIsTheSameMotion) {
  const Corpus written = samples::tinyCorpus();
  writeCorpus(path_, written);
  const Corpus read = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
  fs::remove(path_);  // the file stays open
  ASSERT_NE(read.take_source, nullptr);
  for (const std::size_t take : {5U, 0U, 3U}) {
    EXPECT_EQ(read.takes[take].motion.frameCount(), 0U);
    const MotionClip clip = read.take_source->load(TakeIndex(take));
    EXPECT_EQ(clip.positions_mm, written.takes[take].motion.positions_mm);
    EXPECT_EQ(clip.marker_names, written.takes[take].motion.marker_names);
    EXPECT_EQ(clip.frame_rate_hz, written.takes[take].motion.frame_rate_hz);
  }
}

TEST_F(CorpusFile, TakesOnDemandAreTheSameTakes) {
  Corpus written = samples::tinyCorpus();
  written.trajectory_model = samples::tinyModel(written);
  writeCorpus(path_, written);
  const Corpus loaded = readCorpus(path_);
  const Corpus open = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kTakesOnDemand);
  EXPECT_TRUE(open.takes.empty());
  ASSERT_EQ(takeCount(open), written.takes.size());
  for (const std::size_t i : {5U, 0U, 3U, 1U, 5U}) {
    const TakeIndex take(i);
    EXPECT_EQ(takeNamed(open, written.takes[i].name), take);
    EXPECT_EQ(takeOf(open, take).name, written.takes[i].name);
    EXPECT_EQ(takeOf(open, take).text, written.takes[i].text);
    EXPECT_EQ(takeOf(open, take).motion.frame_rate_hz, written.takes[i].motion.frame_rate_hz);
    expectSameLabels(takeOf(open, take).labels, written.takes[i].labels);
    EXPECT_EQ(&takeOf(open, take), &takeOf(open, take)) << "kept";
    const PhoneShapes shapes = open.take_source->loadShapes(take), some = open.take_source->loadSomeShapes(take, 1, 2);
    EXPECT_EQ(some.captured, shapes.captured.middleRows(1, 2));
    EXPECT_EQ(some.predicted, shapes.predicted.middleRows(1, 2));
    EXPECT_EQ(some.tightest_mm, std::vector<float>(shapes.tightest_mm.begin() + 1, shapes.tightest_mm.begin() + 3));
    EXPECT_EQ(open.take_source->load(take).positions_mm, written.takes[i].motion.positions_mm);
    EXPECT_EQ(open.take_source->loadAudio(take).sample_rate_hz, written.takes[i].audio.sample_rate_hz);
  }
  EXPECT_EQ(takeNamed(open, "nobody"), std::nullopt);
  EXPECT_EQ(takeNamed(loaded, written.takes[2].name), TakeIndex(2));
  EXPECT_EQ(evenlySpreadTakes(open, 3), (std::vector<TakeIndex>{TakeIndex(0), TakeIndex(2), TakeIndex(4)}));
  EXPECT_EQ(evenlySpreadTakes(open, 100).size(), written.takes.size());

  const UnitDatabase a(loaded), b(open);
  const SpeechLabels line = samples::tinyLabels("T-EH-N M-AE-N", 5);
  for (const SelectionMethod method : {SelectionMethod::kGreedy, SelectionMethod::kViterbi}) {
    const auto from_all = selectUnits(line, a, {.method = method});
    const auto from_few = selectUnits(line, b, {.method = method});
    ASSERT_EQ(from_few.size(), from_all.size());
    for (std::size_t i = 0; i < from_all.size(); ++i) {
      EXPECT_EQ(from_few[i].source, from_all[i].source);
      EXPECT_EQ(from_few[i].target_cost, from_all[i].target_cost);
    }
  }
}

TEST_F(CorpusFile, ShapesLoadedByThePhoneAreThoseOfTheTake) {
  Corpus written = samples::tinyCorpus();
  written.trajectory_model = samples::tinyModel(written);
  writeCorpus(path_, written);
  const Corpus open = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kTakesOnDemand);
  const UnitDatabase by_take(open), by_phone(open, 0), in_memory(written, 0);
  std::size_t compared = 0;
  for (std::size_t take = 0; take < written.takes.size(); ++take) {
    // Backwards, so that a phone is asked for before, after and together with the one behind it.
    for (std::size_t phone = written.takes[take].labels.phones.size(); phone-- > 0;) {
      for (const std::size_t asked : {phone, phone / 2}) {
        const PhonePlace place{TakeIndex(take), PhoneIndex(asked)};
        const PhoneShape wanted = by_take.shapeOf(place);
        for (const UnitDatabase* other : {&by_phone, &in_memory}) {
          constexpr float kRoundedMm = 0.005F;  // to steps of the range of what is loaded together
          const PhoneShape shape = other->shapeOf(place);
          ASSERT_EQ(shape.size, wanted.size);
          EXPECT_LT((shape.captured() - wanted.captured()).cwiseAbs().maxCoeff(), kRoundedMm) << take << " " << asked;
          EXPECT_LT((shape.predicted() - wanted.predicted()).cwiseAbs().maxCoeff(), kRoundedMm) << take << " " << asked;
          EXPECT_NEAR(other->tightestMm(place), by_take.tightestMm(place), kRoundedMm);
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 40U);
}

TEST_F(CorpusFile, WritesTakesFromTheirSourceAndLoadsThemOneByOne) {
  const Corpus original = samples::tinyCorpus();
  writeCorpus(path_, samples::repeatedCorpus(original, 3));
  const Corpus whole = readCorpus(path_);
  const Corpus open = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
  ASSERT_EQ(whole.takes.size(), 3 * original.takes.size());
  for (std::size_t i = whole.takes.size(); i-- > 0;) {  // backwards: any row, in any order
    const MotionClip& first = original.takes[i % original.takes.size()].motion;
    const MotionClip loaded = open.take_source->load(TakeIndex(i));
    EXPECT_EQ(open.takes[i].motion.frameCount(), 0U);
    EXPECT_EQ(loaded.marker_names, first.marker_names);
    EXPECT_EQ(loaded.positions_mm, whole.takes[i].motion.positions_mm);
    EXPECT_EQ(loaded.positions_mm, first.positions_mm.cast<float>().cast<double>());
    EXPECT_EQ(loaded.frame_rate_hz, whole.takes[i].motion.frame_rate_hz);
    std::vector<bool> unseen;
    for (const auto& frame : loaded.positions_mm.rowwise()) unseen.push_back(frame.hasNaN());
    EXPECT_EQ(open.take_source->loadUnseen(TakeIndex(i)), unseen);
    EXPECT_TRUE(open.take_source->loadAudio(TakeIndex(i)).samples.empty());
  }
  EXPECT_THROW((void)open.take_source->load(TakeIndex(whole.takes.size())), InputError);
}

}  // namespace
}  // namespace mouthpiece
