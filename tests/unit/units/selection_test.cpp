#include "units/selection/selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "base/errors.h"
#include "support/random_corpus.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/costs/viseme_distance.h"
#include "units/selection/lattice.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

using samples::tinyCorpus;
using samples::tinyLabels;

/// Units cover the line from end to end, and neighbours share one phone.
void expectCover(const std::vector<SelectedUnit>& units, const SpeechLabels& line) {
  ASSERT_FALSE(units.empty());
  EXPECT_EQ(units.front().phones.first.value, 0U);
  EXPECT_EQ(units.back().phones.last.value, line.phones.size() - 1);
  for (std::size_t i = 0; i + 1 < units.size(); ++i) {
    EXPECT_EQ(units[i].phones.last, units[i + 1].phones.first);
    EXPECT_LT(units[i].phones.first, units[i].phones.last);
  }
}

/// A unit that is no stand-in spells the line's own phones.
void expectSpells(const std::vector<SelectedUnit>& units, const SpeechLabels& line, const UnitDatabase& database) {
  for (const SelectedUnit& unit : units) {
    for (std::size_t i = unit.phones.first.value; i <= unit.phones.last.value && !unit.is_backoff; ++i) {
      EXPECT_EQ(database.phoneAt(advance(unit.source, i - unit.phones.first.value)).phone, line.phones[i].phone);
    }
  }
}

double totalCost(const std::vector<SelectedUnit>& units, const SelectionWeights& weights) {
  double cost = 0;
  for (const SelectedUnit& unit : units) cost += unit.target_cost + unit.join_cost + weights["unit"];
  return cost;
}

TEST(GreedySelection, AWholeTakeIsOneUnit) {
  const Corpus corpus = tinyCorpus();
  const UnitDatabase database(corpus);
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    const auto units = selectUnits(corpus.takes[take].labels, database, {});
    ASSERT_EQ(units.size(), 1U);
    EXPECT_EQ(units[0].source, (PhonePlace{TakeIndex(take), PhoneIndex(0)}));
    EXPECT_NEAR(units[0].target_cost, 0, 1e-12);
    EXPECT_EQ(scaleOf(corpus.takes[take].labels, PhoneIndex(0), corpus.takes[take].labels.phones.size()), "sentence");
  }
}

TEST(GreedySelection, TakesTheLongestFragmentEachTime) {
  const Corpus corpus = tinyCorpus({"T-AY-M IH-Z", "IH-Z N-AW", "T-AY-M"});
  const UnitDatabase database(corpus);
  const SpeechLabels line = tinyLabels("T-AY-M IH-Z N-AW", 9);
  const auto units = selectUnits(line, database, {});
  expectCover(units, line);
  expectSpells(units, line, database);
  ASSERT_EQ(units.size(), 2U);
  EXPECT_EQ(units[0].source.take.value, 0U) << "sil T AY M IH Z";
  EXPECT_LE(units[0].phones.last.value, 5U);
  EXPECT_GE(units[0].phones.last.value, 4U) << "IH and Z are in both takes";
  EXPECT_EQ(units[1].source.take.value, 1U);
}

/// Take 1 holds AE N IH Z before N AW too, so the cut may lie at any of these phones.
TEST(GreedySelection, TheCutLiesWhereTheLipsAgreeBest) {
  const Corpus corpus = tinyCorpus({"M-AE-N IH-Z", "AE-N IH-Z N-AW"});
  const UnitDatabase database(corpus);
  const SpeechLabels line = tinyLabels("M-AE-N IH-Z N-AW", 9);  // sil M AE N IH Z N AW sil
  const auto units = selectUnits(line, database, {});
  expectCover(units, line);
  expectSpells(units, line, database);
  ASSERT_EQ(units.size(), 2U);
  const SelectionCosts costs(line, database, SelectionWeights());
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t cut = 2; cut <= 5; ++cut) {
    least = std::min(
        least, costs.joinCost(PhoneIndex(cut), {TakeIndex(0), PhoneIndex(cut)}, {TakeIndex(1), PhoneIndex(cut - 1)}));
  }
  EXPECT_EQ(units[1].join_cost, least);
  EXPECT_EQ(units[1].join_cost,
            costs.joinCost(units[1].phones.first, {TakeIndex(0), units[1].phones.first}, units[1].source));
}

TEST(GreedySelection, OfEqualFragmentsTheOneOfLikeTimingWins) {
  const Corpus corpus = tinyCorpus({"T-AY-M", "T-AY-M", "T-AY-M", "T-AY-M"});
  const UnitDatabase database(corpus);
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const auto units = selectUnits(tinyLabels("T-AY-M", seed), database, {});
    ASSERT_EQ(units.size(), 1U);
    EXPECT_EQ(units[0].source.take.value, seed - 1) << "takes are timed by their seeds 1 to 4";
  }
}

TEST(GreedySelection, OfEqualFragmentsTheOneOfLikeContextWins) {
  // AE T is wanted after M; both takes have the same timing, one has it after M, one after N.
  Corpus corpus = tinyCorpus({"N-AE-T", "M-AE-T"});
  corpus.takes[1] = samples::tinyTake("take1", "M-AE-T", 1);
  const UnitDatabase database(corpus);
  const SpeechLabels line = tinyLabels("M-AE-T", 1);
  const SelectionCosts costs(line, database, SelectionWeights());
  const PhoneRange range{PhoneIndex(2), PhoneIndex(3)};
  EXPECT_LT(costs.targetCost(range, {TakeIndex(1), PhoneIndex(2)}),
            costs.targetCost(range, {TakeIndex(0), PhoneIndex(2)}));
}

TEST(GreedySelection, AFragmentThatWasNotSeenIsNotOffered) {
  Corpus corpus = tinyCorpus({"T-AY-M", "T-AY-M"});
  const SpeechLabels line = corpus.takes[0].labels;
  corpus.takes[0].motion.positions_mm.block<1, 3>(40, 0).setConstant(std::numeric_limits<double>::quiet_NaN());
  {
    const UnitDatabase database(corpus);
    const auto units = selectUnits(line, database, {});
    ASSERT_EQ(units.size(), 1U);
    EXPECT_EQ(units[0].source.take.value, 1U);
  }
  corpus.takes.pop_back();
  const UnitDatabase database(corpus);
  EXPECT_THROW(selectUnits(line, database, {}), InputError) << "no other take, and nothing alike";
}

TEST(GreedySelection, AMissingPairBecomesAStandInOfItsClass) {
  // M IY is not there; B IY is.
  const Corpus corpus = tinyCorpus({"AH-M AE-M", "B-IY AH M-AE"});
  const UnitDatabase database(corpus);
  const SpeechLabels line = tinyLabels("AH-M-IY", 3);
  const auto units = selectUnits(line, database, {});
  expectCover(units, line);
  const auto stand_in =
      std::find_if(units.begin(), units.end(), [](const SelectedUnit& unit) { return unit.is_backoff; });
  ASSERT_NE(stand_in, units.end());
  EXPECT_EQ(stand_in->phones.first.value, 2U);
  EXPECT_EQ(database.phoneAt(stand_in->source).phone, Phone::kB);
  EXPECT_EQ(database.phoneAt(advance(stand_in->source, 1)).phone, Phone::kIY);
}

TEST(GreedySelection, APairThatNothingResemblesIsNamed) {
  const Corpus corpus = tinyCorpus({"T-EH-N", "N-AW"});
  const UnitDatabase database(corpus);
  try {
    selectUnits(tinyLabels("F-B-IY", 1), database, {});
    FAIL() << "the lips never touch in this corpus";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), "phones F B: the corpus tiny has neither this pair nor one that looks alike");
  }
  SelectionOptions strict;
  strict.backoff = Backoff::kNone;
  EXPECT_THROW(selectUnits(tinyLabels("T-EH-T", 1), database, strict), InputError);
}

TEST(PaperUnits, AreSentencesWordsSyllablesAndDiphones) {
  const Corpus corpus = tinyCorpus({"M-AE-N T-AY-M", "AH M-AE-N"});
  const UnitDatabase database(corpus);
  SelectionOptions paper;
  paper.units = UnitScales::kPaper;
  const SpeechLabels line = tinyLabels("M-AE-N T-AY-D", 4);
  SelectionOptions strict;
  strict.backoff = Backoff::kNone;
  EXPECT_THROW(selectUnits(line, database, strict), InputError) << "no AY D";
  const SpeechLabels spoken = tinyLabels("AH M-AE-N T-AY-M", 4);
  const auto any = selectUnits(spoken, database, {});
  const auto units = selectUnits(spoken, database, paper);
  expectCover(units, spoken);
  expectSpells(units, spoken, database);
  ASSERT_EQ(any.size(), 2U);
  EXPECT_GT(units.size(), any.size()) << "M AE N T AY M sil is two words, no paper unit";
  for (const SelectedUnit& unit : units) {
    const std::size_t length = unit.phones.last.value - unit.phones.first.value + 1;
    EXPECT_LE(length, 5U) << "a word of three phones and one phone of context on each side";
  }
}

TEST(Viterbi, IsNeverDearerThanGreedy) {
  const Corpus corpus = tinyCorpus();
  const UnitDatabase database(corpus);
  SelectionOptions viterbi;
  viterbi.method = SelectionMethod::kViterbi;
  viterbi.candidates_kept = 1000;
  for (const char* words : {"T-AY-M IH-Z T-EH-N", "M-AE-N IH-Z N-AW", "N-UW-N | DH-AH M-AE-P", "M-EH-N AE-T T-EH-N"}) {
    const SpeechLabels line = tinyLabels(words, 77);
    const auto cheapest = selectUnits(line, database, viterbi);
    const auto greedy = selectUnits(line, database, {});
    expectCover(cheapest, line);
    expectSpells(cheapest, line, database);
    EXPECT_LE(totalCost(cheapest, viterbi.weights), totalCost(greedy, viterbi.weights) + 1e-9) << words;
  }
}

/// The dynamic programme against trying every cover, on a corpus small enough for that.
TEST(Viterbi, FindsTheLeastCostOfAllCovers) {
  const Corpus corpus = tinyCorpus({"T-AE-T", "T-AE-T", "T-AE"});
  const UnitDatabase database(corpus);
  const SpeechLabels line = tinyLabels("T-AE-T", 50);
  SelectionOptions options;
  options.method = SelectionMethod::kViterbi;
  options.candidates_kept = 1000;
  const UnitCandidates candidates(line, database, options);
  const SelectionCosts costs(line, database, options.weights);
  double least = std::numeric_limits<double>::infinity();
  const auto extend = [&](auto&& self, std::size_t first, double cost, const PhonePlace* before) -> void {
    if (first + 1 == line.phones.size()) {
      least = std::min(least, cost);
      return;
    }
    for (const CandidateRun& run : candidates.all(first)) {
      for (const PhonePlace& place : run.places) {
        const PhoneRange range{PhoneIndex(first), PhoneIndex(first + run.length - 1)};
        double own = options.weights["unit"] + costs.targetCost(range, place);
        if (before != nullptr) own += costs.joinCost(PhoneIndex(first), *before, place);
        const PhonePlace last = advance(place, run.length - 1);
        self(self, first + run.length - 1, cost + own, &last);
      }
    }
  };
  extend(extend, 0, 0, nullptr);
  EXPECT_NEAR(totalCost(selectUnits(line, database, options), options.weights), least, 1e-9);
}

/// Whatever the corpus: for each phone the longest runs of the unit's phones with it that are seen elsewhere, too, the
/// longest first and of a run the cheapest first; by looking at every place of every take.
TEST(OtherUnits, AreTheLongestRunsWithEachPhoneTheCheapestFirst) {
  const std::uint64_t first_seed = samples::firstSeed();
  std::size_t offered = 0, inside = 0;
  for (std::uint64_t seed = first_seed; seed < first_seed + 40; ++seed) {
    SCOPED_TRACE("MOUTHPIECE_SEED=" + std::to_string(seed));
    samples::Chance chance(seed);
    Corpus corpus = samples::randomCorpus(chance);
    if (chance.oneIn(2)) corpus.trajectory_model = samples::tinyModel(corpus);
    const UnitDatabase database(corpus);
    const SpeechLabels& line = corpus.takes[0].labels;
    const std::size_t first = chance.below(line.phones.size() - 1);
    const std::size_t count = 2 + chance.below(std::min<std::size_t>(6, line.phones.size() - first - 1));
    const SelectedUnit unit{{PhoneIndex(first), PhoneIndex(first + count - 1)}, {TakeIndex(0), PhoneIndex(first)}};
    const auto placesOf = [&](std::size_t begin, std::size_t phones) {
      std::vector<PhonePlace> places;
      for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
        for (std::size_t at = 0; at + phones <= corpus.takes[take].labels.phones.size(); ++at) {
          const PhonePlace place{TakeIndex(take), PhoneIndex(at)};
          const bool is_own = place == PhonePlace{TakeIndex(0), PhoneIndex(begin)};
          bool is_same = !is_own && database.isSeen(place, phones);
          for (std::size_t k = 0; k < phones; ++k)
            is_same = is_same && corpus.takes[take].labels.phones[at + k].phone == line.phones[begin + k].phone;
          if (is_same) places.push_back(place);
        }
      }
      return places;
    };
    std::vector<std::size_t> longest(count, 0);
    for (std::size_t length = 2; length <= count; ++length) {
      for (std::size_t begin = 0; begin + length <= count; ++begin) {
        if (!placesOf(first + begin, length).empty()) std::fill_n(&longest[begin], length, length);
      }
    }
    const auto isExpected = [&](std::size_t begin, std::size_t length) {
      const auto from = longest.begin() + signedIndex(begin);
      return std::any_of(from, from + signedIndex(length), [&](std::size_t own) { return own == length; });
    };
    const std::size_t most = 1 + chance.below(5);
    const auto others = otherUnits(line, database, {&unit, 1}, most);
    ASSERT_EQ(others.size(), 1U);
    auto other = others[0].begin();
    for (std::size_t length = count; length >= 2; --length) {
      for (std::size_t begin = 0; begin + length <= count; ++begin) {
        const std::vector<PhonePlace> places = placesOf(first + begin, length);
        if (!isExpected(begin, length)) continue;
        double before = 0;
        for (std::size_t i = 0; i < std::min(most, places.size()); ++i, ++other) {
          ASSERT_NE(other, others[0].end());
          EXPECT_EQ(other->phones.first.value, first + begin);
          EXPECT_EQ(other->phones.last.value, first + begin + length - 1);
          EXPECT_EQ(std::count(places.begin(), places.end(), other->source), 1);
          EXPECT_GE(other->target_cost, before);
          before = other->target_cost;
          EXPECT_EQ(other->join_cost, 0);
          EXPECT_FALSE(other->is_backoff);
          inside += begin > 0 ? 1U : 0U;
        }
      }
    }
    EXPECT_EQ(other, others[0].end());
    const auto all = otherUnits(line, database, {&unit, 1}, 1000)[0];
    for (const SelectedUnit& kept : others[0]) {
      const auto isKept = [&](const SelectedUnit& one) {
        return one.phones == kept.phones && one.source == kept.source;
      };
      EXPECT_TRUE(std::any_of(all.begin(), all.end(), isKept));
      for (const SelectedUnit& one : all) {
        const bool is_left =
            one.phones == kept.phones && std::none_of(others[0].begin(), others[0].end(), [&](auto& own) {
              return own.phones == one.phones && own.source == one.source;
            });
        EXPECT_TRUE(!is_left || one.target_cost >= kept.target_cost) << "asking for fewer gives the cheapest";
      }
    }
    offered += others[0].size();
  }
  EXPECT_GT(offered, 20U);
  EXPECT_GT(inside, 10U);
}

/// A pair that is chosen already stays, whatever else would suit; what it does not spell is a stand-in.
TEST(SettledPairs, AreKeptByTheLattice) {
  Corpus corpus = tinyCorpus({"M-AE-N T-AY-M", "M-AE-N IY-T", "P-AE-N T-AY-T"});
  corpus.trajectory_model = samples::tinyModel(corpus);
  const UnitDatabase database(corpus);
  const SpeechLabels& line = corpus.takes[0].labels;
  SelectionOptions options;
  options.method = SelectionMethod::kViterbi;
  ASSERT_EQ(selectUnits(line, database, options).size(), 1U) << "the take itself";
  options.settled.resize(2);
  options.settled[1] = PhonePlace{TakeIndex(1), PhoneIndex(1)};  // M AE
  const auto unitAt = [&](std::size_t pair) {
    for (const SelectedUnit& unit : selectUnits(line, database, options)) {
      if (unit.phones.first.value <= pair && pair < unit.phones.last.value) return unit;
    }
    return SelectedUnit{};
  };
  const SelectedUnit kept = unitAt(1);
  EXPECT_EQ(advance(kept.source, 1 - kept.phones.first.value), *options.settled[1]);
  EXPECT_FALSE(kept.is_backoff);
  expectCover(selectUnits(line, database, options), line);
  options.settled[1] = PhonePlace{TakeIndex(2), PhoneIndex(1)};  // P AE
  EXPECT_EQ(unitAt(1).source, *options.settled[1]);
  EXPECT_TRUE(unitAt(1).is_backoff);
  EXPECT_EQ(unitAt(1).phones.last.value, 2U) << "a unit of its own";
}

/// What is said as a take was, in its own time, is that take alone; a phone moved by a little makes it a line of pairs.
TEST(Lattice, ATakeInItsOwnTimeIsTakenWhole) {
  Corpus corpus = tinyCorpus({"M-AE-N T-AY-M", "M-AE-N T-AY-M", "T-AY-M M-AE-N"});
  corpus.trajectory_model = samples::tinyModel(corpus);
  const UnitDatabase database(corpus);
  SelectionOptions options;
  options.method = SelectionMethod::kViterbi;
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    const auto units = selectUnits(corpus.takes[take].labels, database, options);
    ASSERT_EQ(units.size(), 1U);
    EXPECT_EQ(units[0].source, (PhonePlace{TakeIndex(take), PhoneIndex(0)}));
    EXPECT_EQ(units[0].phones.last.value, corpus.takes[take].labels.phones.size() - 1);
    EXPECT_EQ(units[0].target_cost, 0);
    EXPECT_FALSE(units[0].is_backoff);
  }
}

TEST(Scales, AreNamedAfterTheirTake) {
  const SpeechLabels take = tinyLabels("DH-AH T-AY-M T-EH-N", 1);  // sil DH AH T AY M T EH N sil
  EXPECT_EQ(scaleOf(take, PhoneIndex(0), 10), "sentence");
  EXPECT_EQ(scaleOf(take, PhoneIndex(1), 6), "phrase");
  EXPECT_EQ(scaleOf(take, PhoneIndex(0), 4), "word");
  EXPECT_EQ(scaleOf(take, PhoneIndex(2), 2), "diphone");
  EXPECT_EQ(scaleOf(take, PhoneIndex(4), 3), "span");
}

TEST(VisemeDistance, RanksLikenessOfTheLips) {
  const auto distance = [](Phone a, Phone b) { return visemeDistance(a, b, PhonePart::kBegin); };
  EXPECT_EQ(distance(Phone::kM, Phone::kM), 0);
  EXPECT_LE(distance(Phone::kM, Phone::kP), kSameVisemeDistance);
  EXPECT_GT(distance(Phone::kM, Phone::kN), kLostContactDistance);
  EXPECT_GT(distance(Phone::kF, Phone::kM), kLostContactDistance);
  EXPECT_LT(distance(Phone::kIY, Phone::kIH), distance(Phone::kIY, Phone::kAA));
  EXPECT_LT(distance(Phone::kUW, Phone::kOW), distance(Phone::kUW, Phone::kIY));
  EXPECT_TRUE(std::isinf(distance(Phone::kSil, Phone::kT)));
  EXPECT_LT(visemeDistance(Phone::kAY, Phone::kIY, PhonePart::kEnd),
            visemeDistance(Phone::kAY, Phone::kIY, PhonePart::kBegin));
  for (std::size_t a = 0; a < kPhoneCount; ++a) {
    for (std::size_t b = 0; b < kPhoneCount; ++b) {
      EXPECT_EQ(distance(static_cast<Phone>(a), static_cast<Phone>(b)),
                distance(static_cast<Phone>(b), static_cast<Phone>(a)));
    }
  }
}

}  // namespace
}  // namespace mouthpiece
