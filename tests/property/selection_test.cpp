#include "units/selection/selection.h"

#include <gtest/gtest.h>

#include <chrono>
#include <iostream>
#include <random>

#include "base/errors.h"
#include "phonetics/labels/labels_builder.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

/// Any phones in any order, with pauses.
SpeechLabels randomLine(std::mt19937_64& random) {
  std::vector<PhoneSegment> segments;
  std::vector<std::string> words;
  double time = 0.1;
  const std::size_t count = 1 + random() % 40;
  for (std::size_t i = 0; i < count; ++i) {
    if (random() % 4 == 0 || words.empty()) words.push_back("w" + std::to_string(i));
    if (random() % 10 == 0) time += 0.15;
    const double duration = 0.03 + 0.0001 * static_cast<double>(random() % 1500);
    segments.push_back({.phone = static_cast<Phone>(1 + random() % (kPhoneCount - 1)),
                        .span = {time, time + duration},
                        .word = words.size() - 1});
    time += duration;
  }
  return buildSpeechLabels(std::move(segments), words, time + 0.1);
}

/// The paper's loop never ends when a diphone is missing; ours covers the line or names a pair, whatever the phones.
TEST(SelectionProperty, NeverLoopsOnAnyPhones) {
  const std::uint64_t base = static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  const Corpus plain = samples::tinyCorpus();
  Corpus modelled = plain;
  modelled.trajectory_model = samples::tinyModel(modelled);
  const UnitDatabase plain_database(plain), modelled_database(modelled);
  std::size_t covered = 0;
  for (std::uint64_t round = 0; round < 400; ++round) {
    SCOPED_TRACE("seed " + std::to_string(base + round));
    std::mt19937_64 random(base + round);
    const SpeechLabels line = randomLine(random);
    const UnitDatabase& database = round % 4 < 2 ? modelled_database : plain_database;
    SelectionOptions options;
    options.method = round % 2 == 0 ? SelectionMethod::kGreedy : SelectionMethod::kViterbi;
    options.units = round % 3 == 0 ? UnitScales::kPaper : UnitScales::kAny;
    try {
      const auto units = selectUnits(line, database, options);
      ASSERT_FALSE(units.empty());
      ASSERT_EQ(units.front().phones.first.value, 0U);
      ASSERT_EQ(units.back().phones.last.value + 1, line.phones.size());
      for (std::size_t i = 0; i + 1 < units.size(); ++i) ASSERT_EQ(units[i].phones.last, units[i + 1].phones.first);
      for (const SelectedUnit& unit : units) {
        ASSERT_LT(unit.phones.first, unit.phones.last);
        ASSERT_TRUE(std::isfinite(unit.target_cost) && std::isfinite(unit.join_cost));
      }
      ++covered;
    } catch (const InputError& error) {
      ASSERT_NE(std::string(error.what()).find("neither this pair nor one that looks alike"), std::string::npos)
          << error.what();
    }
  }
  std::cout << "seeds " << base << " to " << base + 399 << ", " << covered << " lines covered\n";
  EXPECT_GT(covered, 0U);
}

}  // namespace
}  // namespace mouthpiece
