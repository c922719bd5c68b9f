// Selection against looking at every cover, with costs computed as docs/theory/units/selection.md tells them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "support/random_corpus.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/costs/viseme_distance.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSinglePrecision = 2e-4;  ///< of costs up to some tens

/// The labels of a line or take, as far as they go.
std::optional<Phone> phoneAt(const SpeechLabels& labels, std::ptrdiff_t phone) {
  if (phone < 0 || phone >= std::ssize(labels.phones)) return std::nullopt;
  return labels.phones[static_cast<std::size_t>(phone)].phone;
}

double unlike(std::optional<Phone> wanted, std::optional<Phone> found, PhonePart facing) {
  if (wanted == found) return 0;
  if (!wanted || !found) return 1;
  return visemeDistance(*wanted, *found, facing) <= kSameVisemeDistance ? 0.5 : 1;
}

/// In words: which edges of its word (and its syllable, and a phrase) a phone is.
struct Edges {
  bool begins_word = false, ends_word = false, begins_syllable = false, ends_syllable = false, begins_phrase = false,
       ends_phrase = false, stressed = false;
};

Edges edgesOf(const SpeechLabels& labels, std::size_t phone) {
  Edges edges;
  const PhoneIndex own(phone);
  for (const LabelledWord& word : labels.words) {
    edges.begins_word = edges.begins_word || word.phones.first == own;
    edges.ends_word = edges.ends_word || word.phones.last == own;
  }
  for (const LabelledSyllable& syllable : labels.syllables) {
    edges.begins_syllable = edges.begins_syllable || syllable.phones.first == own;
    edges.ends_syllable = edges.ends_syllable || syllable.phones.last == own;
    if (syllable.phones.first <= own && own <= syllable.phones.last) edges.stressed = syllable.stress > 0;
  }
  if (labels.phones[phone].phone != Phone::kSil) {
    edges.begins_phrase = labels.phones[phone - 1].phone == Phone::kSil;
    edges.ends_phrase = labels.phones[phone + 1].phone == Phone::kSil;
  }
  return edges;
}

double different(std::initializer_list<std::pair<bool, bool>> pairs) {
  double count = 0;
  for (const auto& [a, b] : pairs) count += a != b ? 1 : 0;
  return count;
}

/// The costs of fragments for a line.
class FragmentOracle {
 public:
  FragmentOracle(const SpeechLabels& line, const UnitDatabase& database) : line_(line), database_(database) {}

  [[nodiscard]] double target(const PhoneRange& range, const PhonePlace& place) const {
    const SpeechLabels& take = database_.takeOf(place).labels;
    const std::size_t count = range.last.value - range.first.value + 1;
    const auto from = static_cast<std::ptrdiff_t>(range.first.value),
               to = static_cast<std::ptrdiff_t>(range.last.value);
    const auto at = static_cast<std::ptrdiff_t>(place.phone.value), end = at + to - from;
    double cost = weights_["context"] * (unlike(phoneAt(line_, from - 1), phoneAt(take, at - 1), PhonePart::kEnd) +
                                         unlike(phoneAt(line_, to + 1), phoneAt(take, end + 1), PhonePart::kBegin));
    for (std::size_t i = 0; i < count; ++i) {
      const LabelledPhone& wanted = line_.phones[range.first.value + i];
      const PhonePlace own = advance(place, i);
      const Edges a = edgesOf(line_, range.first.value + i), b = edgesOf(take, own.phone.value);
      double phone =
          weights_["word position"] * different({{a.begins_word, b.begins_word}, {a.ends_word, b.ends_word}}) +
          weights_["stress"] * different({{a.stressed, b.stressed}});
      if (wanted.phone != Phone::kSil)
        phone += weights_["duration"] *
                 std::abs(std::log(wanted.span.duration()) - std::log(database_.phoneAt(own).span.duration()));
      if (isBilabial(wanted.phone)) phone += weights_["closure"] * std::max(0.0, database_.openingLeft(own));
      cost += phone * (i == 0 || i + 1 == count ? 0.5 : 1);
    }
    return cost;
  }

  [[nodiscard]] double join(std::size_t shared, const PhonePlace& before, const PhonePlace& after) const {
    const PhoneLips &a = database_.lipsOf(before), &b = database_.lipsOf(after);
    const double markers = static_cast<double>(a.positions_mm.cols()) / 3;
    double least = 100;
    for (Eigen::Index k = 0; k < PhoneLips::kPoints; ++k) {
      double distance = 0, change = 0;
      for (Eigen::Index i = 0; i < a.positions_mm.cols(); ++i) {
        distance += std::pow(a.positions_mm(k, i) - b.positions_mm(k, i), 2);
        change += std::pow(a.steps_mm(k, i) - b.steps_mm(k, i), 2);
      }
      const double cost =
          weights_["join position"] * std::sqrt(distance / markers) +
          weights_["join velocity"] * std::sqrt(change / markers) / line_.phones[shared].span.duration();
      if (cost < least) least = cost;
    }
    return least;
  }

 private:
  const SpeechLabels& line_;
  const UnitDatabase& database_;
  SelectionWeights weights_;
};

/// The costs of pairs for a line.
class PairOracle {
 public:
  PairOracle(const SpeechLabels& line, const UnitDatabase& database)
      : line_(line), database_(database), predicted_(predictedShapes(model(), line)) {}

  [[nodiscard]] double target(std::size_t first, const PhonePlace& place) const {
    const SpeechLabels& take = database_.takeOf(place).labels;
    const auto from = static_cast<std::ptrdiff_t>(first), at = static_cast<std::ptrdiff_t>(place.phone.value);
    const auto facing = [&](std::ptrdiff_t of_line, std::ptrdiff_t of_take, PhonePart part) {
      return unlike(phoneAt(line_, of_line).value_or(Phone::kSil), phoneAt(take, of_take).value_or(Phone::kSil), part);
    };
    const double neighbours =
        facing(from - 2, at - 2, PhonePart::kEnd) + 2 * facing(from - 1, at - 1, PhonePart::kEnd) +
        2 * facing(from + 2, at + 2, PhonePart::kBegin) + facing(from + 3, at + 3, PhonePart::kBegin);
    return weights_["neighbours"] * neighbours / 6 + (phone(first, place) + phone(first + 1, advance(place, 1))) / 2;
  }

  [[nodiscard]] double join(std::size_t shared, const PhonePlace& before, const PhonePlace& after) const {
    const PhoneShape a = database_.shapeOf(before), b = database_.shapeOf(after);
    const Eigen::RowVectorXd left = (a.captured() - a.predicted() - b.captured() + b.predicted()).cast<double>();
    const Eigen::Index points = PhoneShapes::kPoints, components = left.size() / points;
    const auto at = [&](Eigen::Index point) { return left.segment(point * components, components); };
    const Seconds spacing = line_.phones[shared].span.duration() / static_cast<double>(points);
    double least = kInfinity;
    for (Eigen::Index k = 0; k < points; ++k) {
      const Eigen::Index next = std::min(k + 1, points - 1), last = std::max<Eigen::Index>(k - 1, 0);
      const double speed = (at(next) - at(last)).norm() / (spacing * static_cast<double>(next - last));
      // tinyModel() opens the lips along y with its first component only.
      const double cost = weights_["join position"] * at(k).norm() + weights_["join velocity"] * speed +
                          weights_["join opening"] * std::abs(at(k)(0));
      if (cost < least) least = cost;
    }
    return least + weights_["unit"];
  }

 private:
  [[nodiscard]] const TrajectoryModel& model() const { return *database_.corpus().trajectory_model; }

  static double rate(const SpeechLabels& labels, std::size_t phone) {
    const auto isSpeech = [&](std::size_t at) {
      return at < labels.phones.size() && labels.phones[at].phone != Phone::kSil;
    };
    std::size_t first = phone, last = phone;
    for (int i = 0; i < 3 && first > 0 && isSpeech(first - 1); ++i) --first;
    for (int i = 0; i < 3 && isSpeech(last + 1); ++i) ++last;
    return static_cast<double>(last - first + 1) / (labels.phones[last].span.end - labels.phones[first].span.start);
  }

  [[nodiscard]] double phone(std::size_t at, const PhonePlace& place) const {
    const SpeechLabels& take = database_.takeOf(place).labels;
    const PhoneShape shape = database_.shapeOf(place);
    const auto line = predicted_.row(static_cast<Eigen::Index>(at));
    const double points = static_cast<double>(PhoneShapes::kPoints);
    const Edges a = edgesOf(line_, at), b = edgesOf(take, place.phone.value);
    double cost = weights_["prediction"] * (shape.captured() - line).squaredNorm() / points +
                  weights_["context"] * (shape.predicted() - line).squaredNorm() / points +
                  weights_["position"] * different({{a.begins_word, b.begins_word},
                                                    {a.ends_word, b.ends_word},
                                                    {a.begins_syllable, b.begins_syllable},
                                                    {a.ends_syllable, b.ends_syllable},
                                                    {a.begins_phrase, b.begins_phrase},
                                                    {a.ends_phrase, b.ends_phrase}}) +
                  weights_["stress"] * different({{a.stressed, b.stressed}});
    const LabelledPhone& wanted = line_.phones[at];
    if (wanted.phone != Phone::kSil) {
      cost += weights_["duration"] *
              std::abs(std::log(wanted.span.duration() / take.phones[place.phone.value].span.duration()));
      cost += weights_["rate"] * std::abs(std::log(rate(line_, at) / rate(take, place.phone.value)));
    }
    if (isBilabial(wanted.phone)) {
      const double open = database_.tightestMm(place) - model().closed_opening_mm;
      if (open > 0) cost += weights_["closure"] * open;
    }
    return std::isnan(cost) ? kInfinity : cost;
  }

  const SpeechLabels& line_;
  const UnitDatabase& database_;
  LatticeWeights weights_;
  PhoneShapes::Matrix predicted_;
};

/// All frames of the phones have all markers, and the take's motion lasts as long as its speech.
bool isWholeInCapture(const CorpusTake& take, std::size_t first, std::size_t length) {
  const MotionClip& motion = take.motion;
  const LabelledPhone& last = take.labels.phones[first + length - 1];
  const double speech_end = last.phone == Phone::kSil ? last.span.start : last.span.end;
  if (speech_end * motion.frame_rate_hz > static_cast<double>(motion.positions_mm.rows())) return false;
  for (Eigen::Index row = 0; row < motion.positions_mm.rows(); ++row) {
    const auto frame = static_cast<double>(row);
    const bool is_inside = frame >= std::floor(take.labels.phones[first].span.start * motion.frame_rate_hz) &&
                           frame <= std::ceil(last.span.end * motion.frame_rate_hz);
    if (is_inside && !motion.positions_mm.row(row).allFinite()) return false;
  }
  return true;
}

/// A diphone, or a sentence, word or syllable with at most one phone more at either side.
bool isPaperUnit(const SpeechLabels& take, std::size_t first, std::size_t length) {
  if (length == 2) return true;
  const auto isCore = [&](std::size_t from, std::size_t to) {
    const auto is = [&](const auto& entry) {
      return entry.phones.first.value == from && entry.phones.last.value == to;
    };
    return (from == 0 && to + 1 == take.phones.size()) || std::any_of(take.words.begin(), take.words.end(), is) ||
           std::any_of(take.syllables.begin(), take.syllables.end(), is);
  };
  const std::size_t last = first + length - 1;
  return isCore(first, last) || isCore(first + 1, last) || isCore(first, last - 1) || isCore(first + 1, last - 1);
}

struct Fragment {
  PhoneRange phones;
  PhonePlace place;
};

/// Every fragment for phones [first, ...] of the line that was seen, found by looking at every place.
std::vector<Fragment> fragmentsFrom(const SpeechLabels& line, std::size_t first, const Corpus& corpus,
                                    UnitScales units) {
  std::vector<Fragment> found;
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    const SpeechLabels& labels = corpus.takes[take].labels;
    for (std::size_t at = 0; at < labels.phones.size(); ++at) {
      for (std::size_t length = 1; first + length <= line.phones.size() && at + length <= labels.phones.size() &&
                                   labels.phones[at + length - 1].phone == line.phones[first + length - 1].phone;
           ++length) {
        if (length < 2 || !isWholeInCapture(corpus.takes[take], at, length)) continue;
        if (units == UnitScales::kPaper && !isPaperUnit(labels, at, length)) continue;
        found.push_back({{PhoneIndex(first), PhoneIndex(first + length - 1)}, {TakeIndex(take), PhoneIndex(at)}});
      }
    }
  }
  return found;
}

/// The least cost of all covers from phone `first` on, behind a unit that ends at `before`.
class EveryCover {
 public:
  EveryCover(const SpeechLabels& line, const UnitDatabase& database, UnitScales units)
      : line_(line), oracle_(line, database), unit_cost_(SelectionWeights()["unit"]) {
    for (std::size_t i = 0; i + 1 < line.phones.size(); ++i)
      fragments_.push_back(fragmentsFrom(line, i, database.corpus(), units));
  }
  [[nodiscard]] bool hasAllPairs() const {
    return std::none_of(fragments_.begin(), fragments_.end(), [](const auto& from) { return from.empty(); });
  }
  [[nodiscard]] const std::vector<Fragment>& from(std::size_t first) const { return fragments_[first]; }
  [[nodiscard]] const FragmentOracle& costs() const { return oracle_; }

  double least(std::size_t first = 0, std::optional<PhonePlace> before = {}) {
    if (first + 1 == line_.phones.size()) return 0;
    const auto [known, is_new] = known_.try_emplace({first, before}, kInfinity);
    if (!is_new) return known->second;
    double best = kInfinity;
    for (const Fragment& fragment : fragments_[first]) {
      const std::size_t last = fragment.phones.last.value;
      double own = unit_cost_ + oracle_.target(fragment.phones, fragment.place);
      if (before) own += oracle_.join(first, *before, fragment.place);
      best = std::min(best, own + least(last, advance(fragment.place, last - first)));
    }
    return known_[{first, before}] = best;
  }

 private:
  const SpeechLabels& line_;
  FragmentOracle oracle_;
  double unit_cost_;
  std::vector<std::vector<Fragment>> fragments_;
  std::map<std::pair<std::size_t, std::optional<PhonePlace>>, double> known_;
};

PhonePlace endOf(const SelectedUnit& unit) {
  return advance(unit.source, unit.phones.last.value - unit.phones.first.value);
}

double sumOf(const std::vector<SelectedUnit>& units) {
  double cost = 0;
  for (const SelectedUnit& unit : units) cost += unit.target_cost + unit.join_cost;
  return cost;
}

/// What holds whatever selects: the units cover the line, share a phone with their neighbours, spell the line and were
/// seen; a stand-in stands only where no captured pair does.
void expectCover(const std::vector<SelectedUnit>& units, const SpeechLabels& line, const UnitDatabase& database) {
  ASSERT_FALSE(units.empty());
  ASSERT_EQ(units.front().phones.first.value, 0U);
  ASSERT_EQ(units.back().phones.last.value + 1, line.phones.size());
  for (std::size_t u = 0; u < units.size(); ++u) {
    const SelectedUnit& unit = units[u];
    const std::size_t count = unit.phones.last.value - unit.phones.first.value + 1;
    ASSERT_GE(count, 2U);
    if (u > 0) {
      ASSERT_EQ(units[u - 1].phones.last, unit.phones.first);
    }
    ASSERT_GE(unit.target_cost, 0);
    ASSERT_GE(unit.join_cost, 0);
    ASSERT_LE(unit.source.phone.value + count, database.takeOf(unit.source).labels.phones.size());
    if (unit.is_backoff) {
      ASSERT_EQ(count, 2U);
      ASSERT_TRUE(fragmentsFrom(line, unit.phones.first.value, database.corpus(), UnitScales::kAny).empty());
      continue;
    }
    for (std::size_t i = 0; i < count; ++i)
      ASSERT_EQ(database.phoneAt(advance(unit.source, i)).phone, line.phones[unit.phones.first.value + i].phone);
    ASSERT_TRUE(isWholeInCapture(database.takeOf(unit.source), unit.source.phone.value, count));
  }
}

class CheapestCover : public ::testing::Test {
 protected:
  /// Calls check(chance, corpus, line) for corpora and lines at random.
  template <typename Check>
  void forRandomLines(std::uint64_t rounds, const Check& check) {
    const std::uint64_t first = samples::firstSeed();
    for (std::uint64_t seed = first; seed < first + rounds && !HasFatalFailure(); ++seed) {
      SCOPED_TRACE("MOUTHPIECE_SEED=" + std::to_string(seed));
      samples::Chance chance(seed);
      const Corpus corpus = samples::randomCorpus(chance);
      check(chance, corpus, samples::tinyLabels(samples::randomWords(chance), 1 + chance.below(1'000'000)));
    }
    EXPECT_GT(compared_, rounds / 20) << "of " << rounds << " lines hardly one could be compared";
  }

  std::size_t compared_ = 0;
};

TEST_F(CheapestCover, OfFragmentsIsTheLeastOfAll) {
  forRandomLines(300, [&](samples::Chance& chance, const Corpus& corpus, const SpeechLabels& line) {
    const UnitDatabase database(corpus);
    SelectionOptions options{.method = SelectionMethod::kViterbi, .candidates_kept = 1000};
    options.units = chance.oneIn(2) ? UnitScales::kPaper : UnitScales::kAny;
    EveryCover every(line, database, options.units);
    if (!every.hasAllPairs()) return;
    ++compared_;
    const auto units = selectUnits(line, database, options);
    expectCover(units, line, database);
    const double unit_costs = static_cast<double>(units.size()) * options.weights["unit"];
    ASSERT_NEAR(sumOf(units) + unit_costs, every.least(), kSinglePrecision);
    for (std::size_t u = 0; u < units.size(); ++u) {
      ASSERT_NEAR(units[u].target_cost, every.costs().target(units[u].phones, units[u].source), kSinglePrecision);
      if (u > 0) {
        ASSERT_NEAR(units[u].join_cost,
                    every.costs().join(units[u].phones.first.value, endOf(units[u - 1]), units[u].source),
                    kSinglePrecision);
      }
      const std::size_t count = units[u].phones.last.value - units[u].phones.first.value + 1;
      const SpeechLabels& take = database.takeOf(units[u].source).labels;
      ASSERT_TRUE(options.units == UnitScales::kAny || isPaperUnit(take, units[u].source.phone.value, count));
    }
  });
}

/// Greedy takes the longest fragment there is, and of those the one with the least cost behind the unit before.
TEST_F(CheapestCover, OfGreedyIsTheLongestAndThenTheCheapestEachTime) {
  forRandomLines(300, [&](samples::Chance& chance, const Corpus& corpus, const SpeechLabels& line) {
    const UnitDatabase database(corpus);
    SelectionOptions options;
    options.units = chance.oneIn(3) ? UnitScales::kAny : UnitScales::kPaper;
    EveryCover every(line, database, options.units);
    if (!every.hasAllPairs()) return;
    ++compared_;
    const auto units = selectUnits(line, database, options);
    expectCover(units, line, database);
    std::vector<SelectedUnit> expected;
    double joins = 0;
    for (std::size_t first = 0; first + 1 < line.phones.size(); first = expected.back().phones.last.value) {
      SelectedUnit best;
      double least = kInfinity;
      for (const Fragment& fragment : every.from(first)) {
        SelectedUnit unit{fragment.phones, fragment.place, every.costs().target(fragment.phones, fragment.place)};
        if (!expected.empty()) unit.join_cost = every.costs().join(first, endOf(expected.back()), fragment.place);
        const bool is_longer = unit.phones.last > best.phones.last;
        const double cost = unit.target_cost + unit.join_cost;
        if (least < kInfinity && (unit.phones.last < best.phones.last || (!is_longer && cost >= least))) continue;
        best = unit;
        least = cost;
      }
      expected.push_back(best);
      joins += best.join_cost;
    }
    ASSERT_EQ(units.size(), expected.size());
    double found_joins = 0;
    for (const SelectedUnit& unit : units) found_joins += unit.join_cost;
    if (options.units == UnitScales::kPaper) {
      ASSERT_NEAR(sumOf(units), sumOf(expected), kSinglePrecision);
    } else {  // the cut moves, but only to where the lips agree better
      ASSERT_LE(found_joins, joins + kSinglePrecision);
      for (std::size_t u = 0; u < units.size(); ++u) ASSERT_EQ(endOf(units[u]).take, endOf(expected[u]).take);
    }
  });
}

TEST_F(CheapestCover, OfPairsIsTheLeastOfAll) {
  forRandomLines(300, [&](samples::Chance& /*chance*/, const Corpus& plain, const SpeechLabels& line) {
    Corpus corpus = plain;
    corpus.trajectory_model = samples::tinyModel(corpus);
    for (const CorpusTake& take : corpus.takes) {
      if (isSaidAlike(line, take.labels)) return;  // a take in its own time is not searched for
    }
    const UnitDatabase database(corpus);
    const PairOracle oracle(line, database);
    const SelectionOptions options{.method = SelectionMethod::kViterbi, .pairs_kept = 1000};
    std::map<PhonePlace, double> least;  // of the ways to each place of a pair
    for (std::size_t first = 0; first + 1 < line.phones.size(); ++first) {
      std::map<PhonePlace, double> next;
      for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
        const auto& phones = corpus.takes[take].labels.phones;
        for (std::size_t at = 0; at + 1 < phones.size(); ++at) {
          if (phones[at].phone != line.phones[first].phone || phones[at + 1].phone != line.phones[first + 1].phone)
            continue;
          const PhonePlace place{TakeIndex(take), PhoneIndex(at)};
          double best = first == 0 ? 0 : kInfinity;
          for (const auto& [before, cost] : least) {
            const PhonePlace end = advance(before, 1);
            best = std::min(best, cost + (end == place ? 0 : oracle.join(first, end, place)));
          }
          const double cost = best + oracle.target(first, place);
          if (cost < kInfinity) next[place] = cost;
        }
      }
      if (next.empty()) return;  // only a stand-in has this pair
      least = std::move(next);
    }
    ++compared_;
    const auto cheapest =
        std::min_element(least.begin(), least.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    const auto units = selectUnits(line, database, options);
    ASSERT_NEAR(sumOf(units), cheapest->second, kSinglePrecision);
    for (std::size_t u = 0; u + 1 < units.size(); ++u) {
      ASSERT_EQ(units[u].phones.last, units[u + 1].phones.first);
      ASSERT_NE(endOf(units[u]), units[u + 1].source) << "what follows in the take is the same unit";
    }
  });
}

/// Fewer places to choose from never make a line cheaper, and none but the line's own take beats that take.
TEST_F(CheapestCover, NeverFallsWhenLessIsKept) {
  forRandomLines(150, [&](samples::Chance& chance, const Corpus& corpus, const SpeechLabels& line) {
    Corpus modelled = corpus;
    if (chance.oneIn(2)) modelled.trajectory_model = samples::tinyModel(modelled);
    const UnitDatabase database(modelled);
    double before = -1;
    for (const std::size_t kept : {1000U, 4U, 1U}) {
      SelectionOptions options{.method = SelectionMethod::kViterbi, .candidates_kept = kept, .pairs_kept = kept};
      try {
        const auto units = selectUnits(line, database, options);
        const bool by_pairs = modelled.trajectory_model != nullptr;
        const double sum =
            sumOf(units) + (by_pairs ? 0.0 : static_cast<double>(units.size()) * options.weights["unit"]);
        ASSERT_GE(sum, before - 1e-9) << kept;
        before = sum;
        ++compared_;
      } catch (const MissingPairError&) {
        return;
      }
    }
    const SpeechLabels& own = modelled.takes[0].labels;
    if (!isWholeInCapture(modelled.takes[0], 0, own.phones.size())) return;
    const auto units = selectUnits(own, database, {.method = SelectionMethod::kViterbi});
    ASSERT_EQ(units.size(), 1U);
    ASSERT_NEAR(units[0].join_cost, 0, 1e-12);
  });
}

}  // namespace
}  // namespace mouthpiece
