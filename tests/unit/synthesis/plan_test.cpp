// The plan of a line: what it is made of, on random lines and random corpora, and what becomes of a changed one.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "base/errors.h"
#include "base/parallel_for.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {
namespace {

using samples::tinyCorpus;
using samples::tinyLabels;
using Kind = Segment::Kind;

/// Few enough that pairs come again, and of every kind.
constexpr std::array kSymbols = {"M", "B", "F", "AA", "IY", "UW", "T", "S", "N", "K"};
constexpr std::size_t kWithoutLips = 3;  ///< the first of those in which lips neither close nor touch the teeth

/// Words of one to four of the symbols; of those without lips from `first_symbol` on.
std::string randomWords(std::mt19937& random, std::size_t words, std::size_t first_symbol = 0) {
  std::string text;
  const std::size_t symbols = kSymbols.size() - first_symbol;
  for (std::size_t word = 0; word < words; ++word) {
    if (word > 0) text += random() % 5 == 0 ? " | " : " ";
    const std::size_t length = 1 + random() % 4;
    for (std::size_t i = 0; i < length; ++i)
      text += (i > 0 ? "-" : "") + std::string(kSymbols[first_symbol + random() % symbols]);
  }
  return text;
}

Corpus randomCorpus(std::mt19937& random, std::size_t first_symbol = 0) {
  std::vector<std::string> lines;
  for (std::size_t take = 0; take < 3 + random() % 4; ++take)
    lines.push_back(randomWords(random, 2 + random() % 5, first_symbol));
  return tinyCorpus(lines);
}

/// All pairs of phones that some take says.
std::set<std::pair<Phone, Phone>> pairsOf(const Corpus& corpus) {
  std::set<std::pair<Phone, Phone>> pairs;
  for (const CorpusTake& take : corpus.takes) {
    const auto& phones = take.labels.phones;
    for (std::size_t i = 0; i + 1 < phones.size(); ++i) pairs.emplace(phones[i].phone, phones[i + 1].phone);
  }
  return pairs;
}

void expectWhole(const SynthesisPlan& plan, std::size_t phone_count) {
  ASSERT_FALSE(plan.segments.empty());
  EXPECT_EQ(plan.segments.front().phones.first.value, 0U);
  EXPECT_EQ(plan.segments.back().phones.last.value, phone_count - 1);
  for (std::size_t i = 0; i < plan.segments.size(); ++i) {
    const Segment& own = plan.segments[i];
    EXPECT_LT(own.phones.first, own.phones.last);
    if (own.unit) {
      EXPECT_EQ(own.unit->phones, own.phones);
    }
    if (i == 0) continue;
    EXPECT_EQ(own.phones.first, plan.segments[i - 1].phones.last) << "neighbours share a phone";
    EXPECT_TRUE(own.unit || plan.segments[i - 1].unit) << "curves beside curves are one segment";
  }
}

/// Whether the captured segments hold the line's phones.
void expectRightPhones(const SynthesisPlan& plan, const SpeechLabels& labels, const UnitDatabase& database) {
  for (const Segment& segment : plan.segments) {
    if (segment.kind() != Kind::kCaptured) continue;
    for (std::size_t i = segment.phones.first.value; i <= segment.phones.last.value; ++i) {
      const PhonePlace place = advance(segment.unit->source, i - segment.phones.first.value);
      EXPECT_EQ(database.phoneAt(place).phone, labels.phones[i].phone) << "phone " << i;
    }
  }
}

SynthesisOptions filling(SelectionMethod method = SelectionMethod::kGreedy) {
  SynthesisOptions options;
  options.curves.fill_gaps = true;
  options.selection.method = method;
  return options;
}

TEST(Plan, CurvesMakeJustThePairsThatNoTakeHas) {
  std::mt19937 random(11);
  std::size_t gaps = 0, captured = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Corpus corpus = randomCorpus(random);
    const UnitDatabase database(corpus);
    const std::set<std::pair<Phone, Phone>> known = pairsOf(corpus);
    const SpeechLabels labels = tinyLabels(randomWords(random, 1 + random() % 6), random());
    const auto method = trial % 2 == 0 ? SelectionMethod::kGreedy : SelectionMethod::kViterbi;
    const SynthesisPlan plan = planLine(labels, database, filling(method));
    expectWhole(plan, labels.phones.size());
    expectRightPhones(plan, labels, database);
    for (const Segment& segment : plan.segments) {
      EXPECT_NE(segment.kind(), Kind::kStandIn);
      const bool is_gap = segment.kind() == Kind::kCurves;
      const std::size_t first = segment.phones.first.value, last = segment.phones.last.value;
      bool any_known = false;
      for (std::size_t i = first; i < last; ++i) {
        const bool is_known = known.contains({labels.phones[i].phone, labels.phones[i + 1].phone});
        any_known |= is_known;
        EXPECT_TRUE(is_gap || is_known) << "trial " << trial << " phone " << i;
      }
      EXPECT_FALSE(is_gap && any_known) << "trial " << trial << " phone " << first;
      (is_gap ? gaps : captured) += last - first;
    }
  }
  EXPECT_GT(gaps, 100U) << "else nothing was tried";
  EXPECT_GT(captured, 100U);
}

TEST(Plan, StandInsMakeTheSamePairsWhereCurvesMayNot) {
  std::mt19937 random(12);
  std::size_t stand_ins = 0, refused = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Corpus corpus = randomCorpus(random);
    const UnitDatabase database(corpus);
    const std::set<std::pair<Phone, Phone>> known = pairsOf(corpus);
    const SpeechLabels labels = tinyLabels(randomWords(random, 1 + random() % 6), random());
    SynthesisOptions options = filling();
    options.curves.fill_gaps = false;
    try {
      const SynthesisPlan plan = planLine(labels, database, options);
      expectWhole(plan, labels.phones.size());
      for (const Segment& segment : plan.segments) {
        ASSERT_NE(segment.kind(), Kind::kCurves);
        const std::size_t first = segment.phones.first.value;
        const bool is_known = known.contains({labels.phones[first].phone, labels.phones[first + 1].phone});
        EXPECT_EQ(segment.kind() == Kind::kCaptured, is_known) << "trial " << trial << " phone " << first;
        stand_ins += segment.kind() == Kind::kStandIn ? 1U : 0U;
      }
    } catch (const InputError&) {
      ++refused;
      const SynthesisPlan filled = planLine(labels, database, filling());
      EXPECT_TRUE(std::any_of(filled.segments.begin(), filled.segments.end(),
                              [](const Segment& segment) { return !segment.unit; }));
    }
  }
  EXPECT_GT(stand_ins, 20U);
  EXPECT_LT(refused, 60U);
}

TEST(Plan, APredictionLeadsStandInsAsLongAsThereAreSome) {
  std::mt19937 random(13);
  std::size_t led = 0, drawn = 0;
  for (int trial = 0; trial < 40; ++trial) {
    // Where no take closes the lips, nothing stands in for two phones in a row that do.
    Corpus corpus = randomCorpus(random, trial % 2 == 0 ? 0 : kWithoutLips);
    corpus.trajectory_model = samples::tinyModel(corpus);
    const UnitDatabase database(corpus);
    const SpeechLabels labels = tinyLabels(randomWords(random, 2 + random() % 4), random());
    const SynthesisOptions options = filling(SelectionMethod::kViterbi);
    const SynthesisPlan plan = planLine(labels, database, options);
    expectWhole(plan, labels.phones.size());
    const bool has_curves = std::any_of(plan.segments.begin(), plan.segments.end(),
                                        [](const Segment& segment) { return segment.kind() == Kind::kCurves; });
    const bool has_stand_ins = std::any_of(plan.segments.begin(), plan.segments.end(),
                                           [](const Segment& segment) { return segment.kind() == Kind::kStandIn; });
    EXPECT_FALSE(has_curves && has_stand_ins);
    led += has_stand_ins ? 1U : 0U;
    drawn += has_curves ? 1U : 0U;
    if (!has_curves) continue;
    EXPECT_THROW(selectUnits(labels, database, options.selection), InputError) << "trial " << trial;
  }
  EXPECT_GT(led, 3U);
  EXPECT_GT(drawn, 3U);
}

TEST(Plan, GivenUnitsAreTakenAsTheyAre) {
  const Corpus corpus = tinyCorpus();
  const UnitDatabase database(corpus);
  const SpeechLabels labels = tinyLabels("DH-AH T-AY-M B-AE-D N-AW", 3);
  const std::vector<SelectedUnit> units = selectUnits(labels, database, {});
  SynthesisOptions options;
  const SynthesisPlan as_given = planLine(labels, database, options, units);
  ASSERT_EQ(as_given.segments.size(), units.size());
  for (std::size_t i = 0; i < units.size(); ++i) EXPECT_EQ(as_given.segments[i].unit->source, units[i].source);
  options.curves.fill_gaps = true;
  const SynthesisPlan filled = planLine(labels, database, options, units);
  expectWhole(filled, labels.phones.size());
  for (const Segment& segment : filled.segments) EXPECT_NE(segment.kind(), Kind::kStandIn);
  options.curves.alone = CurveStyle::kSpeech;
  const SynthesisPlan drawn = planLine(labels, database, options, units);
  ASSERT_EQ(drawn.segments.size(), 1U);
  EXPECT_EQ(drawn.segments[0].kind(), Kind::kCurves);
  expectWhole(drawn, labels.phones.size());
}

TEST(Plan, FewerThanTwoPhonesNeedNone) {
  const Corpus corpus = tinyCorpus();
  const UnitDatabase database(corpus);
  SpeechLabels silence;
  EXPECT_TRUE(planLine(silence, database, {}).segments.empty());
  silence.phones.push_back({Phone::kSil, {0, 1}, std::nullopt, std::nullopt});
  EXPECT_TRUE(planLine(silence, database, {}).segments.empty());
  SynthesisRequest request;
  request.labels = silence;
  const UtteranceAnimation rest = renderPlan({}, request, database);
  const Eigen::Map<const Eigen::RowVectorXd> neutral(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  EXPECT_EQ(rest.motion.frameCount(), 60U);
  EXPECT_EQ((rest.motion.positions_mm.rowwise() - neutral).cwiseAbs().maxCoeff(), 0);
}

/// Who moves each pair of phones, to compare a plan with: the take and phone that its first phone comes from.
struct PairOwner {
  bool is_curves = true;
  PhonePlace source;
  bool operator==(const PairOwner&) const = default;
};

std::vector<PairOwner> ownersOf(const SynthesisPlan& plan, std::size_t phone_count) {
  std::vector<PairOwner> owners(phone_count - 1);
  for (const Segment& segment : plan.segments) {
    for (std::size_t i = segment.phones.first.value; i < segment.phones.last.value; ++i) {
      if (segment.unit) owners[i] = {false, advance(segment.unit->source, i - segment.phones.first.value)};
    }
  }
  return owners;
}

/// Segments are laid at random, over and over; beside it a list of who owns each pair, which is easy to keep.
TEST(Plan, LayingSegmentsChangesThosePairsAndNoOthers) {
  std::mt19937 random(14);
  constexpr std::size_t kPhones = 20;
  for (int trial = 0; trial < 50; ++trial) {
    SynthesisPlan plan;
    plan.segments.push_back({{PhoneIndex(0), PhoneIndex(kPhones - 1)}, std::nullopt});
    std::vector<PairOwner> wanted(kPhones - 1);
    for (int step = 0; step < 30; ++step) {
      const std::size_t first = random() % (kPhones - 1);
      const std::size_t last = first + 1 + random() % (kPhones - 1 - first);
      Segment laid{{PhoneIndex(first), PhoneIndex(last)}, std::nullopt};
      if (random() % 3 > 0) {
        laid.unit = SelectedUnit{laid.phones, {TakeIndex(random() % 5), PhoneIndex(random() % 50)}};
      }
      plan.lay(laid);
      for (std::size_t i = first; i < last; ++i)
        wanted[i] = laid.unit ? PairOwner{false, advance(laid.unit->source, i - first)} : PairOwner{};
      expectWhole(plan, kPhones);
      ASSERT_EQ(ownersOf(plan, kPhones), wanted) << "trial " << trial << " step " << step;
    }
  }
}

TEST(Plan, LayingASegmentTwiceIsLayingItOnce) {
  const Corpus corpus = tinyCorpus();
  const UnitDatabase database(corpus);
  const SpeechLabels labels = tinyLabels("DH-AH T-AY-M IH-Z T-EH-N", 6);
  SynthesisPlan once = planLine(labels, database, {});
  const std::vector<PairOwner> before = ownersOf(once, labels.phones.size());
  for (const Segment& own : SynthesisPlan(once).segments) once.lay(own);
  EXPECT_EQ(ownersOf(once, labels.phones.size()), before) << "a plan's own segments change nothing";
  const Segment curves{{PhoneIndex(3), PhoneIndex(6)}, std::nullopt};
  once.lay(curves);
  SynthesisPlan twice = once;
  twice.lay(curves);
  EXPECT_EQ(twice.segments.size(), once.segments.size());
  EXPECT_EQ(ownersOf(twice, labels.phones.size()), ownersOf(once, labels.phones.size()));
}

bool isSame(const UtteranceAnimation& a, const UtteranceAnimation& b) {
  const PositionMatrix &left = a.motion.positions_mm, &right = b.motion.positions_mm;
  return left.rows() == right.rows() && left.cols() == right.cols() &&
         std::memcmp(left.data(), right.data(), sizeof(double) * static_cast<std::size_t>(left.size())) == 0;
}

SynthesisRequest selectedRequest(const SpeechLabels& labels, SelectionMethod method) {
  SynthesisRequest request;
  request.labels = labels;
  request.options = filling(method);
  return request;
}

TEST(Plan, RendersToTheSameBytesAgainAndAsSynthesised) {
  std::mt19937 random(15);
  for (int trial = 0; trial < 10; ++trial) {
    Corpus corpus = randomCorpus(random);
    if (trial % 2 == 0) corpus.trajectory_model = samples::tinyModel(corpus);
    const UnitDatabase database(corpus);
    const SynthesisRequest request =
        selectedRequest(tinyLabels(randomWords(random, 3), random()), SelectionMethod::kViterbi);
    const SynthesisPlan plan = planLine(request.labels, database, request.options);
    const UtteranceAnimation once = renderPlan(plan, request, database);
    EXPECT_TRUE(once.motion.positions_mm.allFinite()) << "trial " << trial;
    EXPECT_TRUE(isSame(once, renderPlan(plan, request, database)));
    EXPECT_TRUE(isSame(once, renderPlan(plan, request, UnitDatabase(corpus)))) << "nothing is left in a database";
    const UtteranceAnimation synthesised = synthesise(request, database);
    EXPECT_TRUE(isSame(once, synthesised));
    EXPECT_EQ(once.units.size(), plan.segments.size());
    EXPECT_EQ(once.joins.size(), synthesised.joins.size());
  }
}

TEST(Plan, AnyNumberOfThreadsMakesTheSameBytes) {
  std::mt19937 random(16);
  Corpus corpus = tinyCorpus();
  corpus.trajectory_model = samples::tinyModel(corpus);
  std::vector<SynthesisRequest> requests;
  for (int line = 0; line < 12; ++line)
    requests.push_back(selectedRequest(tinyLabels(randomWords(random, 3), random()), SelectionMethod::kViterbi));
  std::vector<UtteranceAnimation> alone;
  for (const SynthesisRequest& request : requests) alone.push_back(synthesise(request, corpus));
  for (const std::size_t threads : {1U, 2U, 5U}) {
    const UnitDatabase shared(corpus);
    const CurveModel model(shared);
    std::vector<UtteranceAnimation> made(requests.size());
    parallelFor(requests.size(), threads, [&](std::size_t i) {
      SynthesisRequest request = requests[i];
      request.options.curves.model = &model;
      made[i] = synthesise(request, shared);
    });
    for (std::size_t i = 0; i < made.size(); ++i)
      EXPECT_TRUE(isSame(made[i], alone[i])) << "line " << i << ", " << threads << " threads";
  }
}

TEST(Plan, AStretchTurnedIntoCurvesMovesTheFaceThereOnly) {
  const Corpus corpus = tinyCorpus();
  const UnitDatabase database(corpus);
  const SynthesisRequest request =
      selectedRequest(tinyLabels("DH-AH T-AY-M IH-Z T-EH-N M-AE-N", 6), SelectionMethod::kGreedy);
  SynthesisPlan plan = planLine(request.labels, database, request.options);
  const UtteranceAnimation captured = renderPlan(plan, request, database);
  const PhoneRange stretch{PhoneIndex(6), PhoneIndex(8)};
  plan.lay({stretch, std::nullopt});
  const UtteranceAnimation drawn = renderPlan(plan, request, database);
  EXPECT_EQ(std::count_if(drawn.units.begin(), drawn.units.end(),
                          [](const PlacedUnit& unit) { return unit.scale == "curves"; }),
            1);
  // A join of captured units in a shared phone, or a blend with the curves, may lie in the phones beside.
  const TimeSpan reach = request.labels.spanOf({PhoneIndex(4), PhoneIndex(10)});
  double inside = 0, outside = 0;
  for (Eigen::Index row = 0; row < drawn.motion.positions_mm.rows(); ++row) {
    const double change =
        (drawn.motion.positions_mm.row(row) - captured.motion.positions_mm.row(row)).cwiseAbs().maxCoeff();
    const Seconds time = drawn.motion.timeOf(FrameIndex(static_cast<std::size_t>(row)));
    if (request.labels.spanOf(stretch).contains(time)) inside = std::max(inside, change);
    if (!reach.contains(time)) outside = std::max(outside, change);
  }
  EXPECT_GT(inside, 1) << "mm";
  EXPECT_LT(outside, 1e-6) << "mm";
}

TEST(Plan, AnotherFragmentMayBePutInItsPlace) {
  const Corpus corpus = tinyCorpus({"M-AE-N", "M-AE-N", "N-AE-M"});
  const UnitDatabase database(corpus);
  const SpeechLabels labels = corpus.takes[0].labels;
  SynthesisRequest request = selectedRequest(labels, SelectionMethod::kGreedy);
  SynthesisPlan plan = planLine(labels, database, request.options);
  const PhoneRange whole{PhoneIndex(0), PhoneIndex(labels.phones.size() - 1)};
  for (const std::size_t take : {0U, 1U}) {
    plan.lay({whole, SelectedUnit{whole, {TakeIndex(take), PhoneIndex(0)}}});
    const UtteranceAnimation made = renderPlan(plan, request, database);
    ASSERT_EQ(made.units.size(), 1U);
    EXPECT_EQ(made.units[0].take, "take" + std::to_string(take));
    EXPECT_EQ(made.units[0].scale, "sentence");
    EXPECT_TRUE(made.joins.empty());
  }
}

}  // namespace
}  // namespace mouthpiece
