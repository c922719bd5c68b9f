#include "hearing/alignment/phone_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <tuple>
#include <utility>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kStates = 3;
constexpr std::size_t kMostPhones = 100'000;
/// Words of a phone each may follow each other in as many ways as there are pairs of their ways. Row::ways has 14 bits
/// for which unit came before.
constexpr std::size_t kMostWays = 63, kMostPairs = 20'000'000, kMostBefore = 16'383;
constexpr float kUnheard = 1e30F;
/// Frames that are weighed at once, before each of which it is looked which words may be heard.
constexpr Eigen::Index kFramesAtOnce = 32;
/// So many words before and after the one that is heard are kept in mind.
constexpr std::size_t kWordsBeside = 100;
/// So many units' frames, 16 MB, lie back when something is settled: of a long text some 20 s.
constexpr std::size_t kSettled = 2'700'000;

/// A phone of the model after another, or a silence, as a path may go through it.
struct Unit {
  std::array<int, kStates> senones{};
  Phone phone = Phone::kSil;
  bool opens_phone = true, opens_word = false;
  std::size_t word = 0;  ///< its own, or the one before
  float price = 0, frame_price = 0;
  std::vector<std::uint32_t> before{};  ///< units that it may follow
};

/// The ways to go through words. A unit follows only ones that come before it.
class WordGraph {
 public:
  WordGraph(const WordWays& words, const HeardAs& heard, const TiedModel& model, const Pauses& pauses)
      : heard_(heard), model_(model), silence_(heard.at(Phone::kSil).front()) {
    std::size_t phones = 0;
    for (const auto& ways : words) {
      if (ways.size() > kMostWays)
        throw InputError("transcript", "",
                         fmt::format("has a word with {} ways to say it; expected at most {}", ways.size(), kMostWays));
      for (const auto& way : ways) phones += way.size();
    }
    if (phones > kMostPhones)
      throw InputError("transcript", "",
                       fmt::format("has {} phones; expected at most {} in one sound", phones, kMostPhones));
    addSilence(pauses.each, 0);
    for (std::size_t word = 0; word < words.size(); ++word) {
      const bool is_last = word + 1 == words.size();
      std::vector<End> ends;
      for (const auto& way : words[word]) addWay(way, word, ends);
      ends_ = std::move(ends);
      addSilence(pauses.each + (is_last ? 0 : pauses.inner), word, is_last ? 0 : pauses.inner_frame);
      word_ends_.push_back(units_.size());
    }
    countLeft();
  }

  [[nodiscard]] const std::vector<Unit>& units() const { return units_; }
  /// Whether a path may begin with a unit, or end.
  [[nodiscard]] bool mayBegin(std::size_t unit) const {
    return unit == 0 ||
           std::find(units_[unit].before.begin(), units_[unit].before.end(), 0U) != units_[unit].before.end();
  }
  [[nodiscard]] bool mayEnd(std::size_t unit) const {
    return std::any_of(ends_.begin(), ends_.end(), [&](const End& end) { return end.unit == unit; });
  }
  /// The fewest frames that a path has from the begin of a unit on.
  [[nodiscard]] Eigen::Index framesFrom(std::size_t unit) const { return left_[unit]; }
  [[nodiscard]] Eigen::Index fewestFrames() const { return left_[0] - signedIndex(kStates); }
  /// The units of the words near that of `unit`: [first, end).
  [[nodiscard]] std::pair<std::size_t, std::size_t> near(std::size_t unit) const {
    const std::size_t word = units_[unit].word;
    return {word > kWordsBeside ? word_ends_[word - kWordsBeside - 1] : 0,
            word_ends_[std::min(word + kWordsBeside, word_ends_.size() - 1)]};
  }

 private:
  /// Where a word or silence ends, with its last codebook.
  struct End {
    std::uint32_t unit;
    std::size_t code;
  };

  [[nodiscard]] const std::vector<std::size_t>& codesOf(Phone phone) const { return heard_.at(phone); }

  std::uint32_t add(Unit unit, std::span<const int> senones) {
    if (senones.size() != kStates)
      throw InputError("acoustic model", "",
                       fmt::format("has phones of {} states; expected {}", senones.size(), kStates));
    pairs_ += unit.before.size();
    if (unit.before.size() > kMostBefore || pairs_ > kMostPairs)
      throw InputError("transcript", "", "has words with too many ways to say them, one after another");
    std::copy(senones.begin(), senones.end(), unit.senones.begin());
    units_.push_back(std::move(unit));
    return static_cast<std::uint32_t>(units_.size() - 1);
  }

  void addSilence(double nats, std::size_t word, double frame_nats = 0) {
    Unit silence{.word = word, .price = asFloat(nats / kScoreUnit), .frame_price = asFloat(frame_nats / kScoreUnit)};
    for (const End& end : ends_) silence.before.push_back(end.unit);
    ends_.push_back({add(std::move(silence), model_.alone[silence_]), silence_});
  }

  void addWay(const std::vector<Phone>& phones, std::size_t word, std::vector<End>& ends) {
    std::map<std::size_t, std::vector<std::uint32_t>> before;  // by codebooks
    for (const End& end : ends_) before[end.code].push_back(end.unit);
    bool opens_word = true;
    for (const Phone phone : phones) {
      bool opens_phone = true;
      for (const std::size_t code : codesOf(phone)) {
        std::vector<std::uint32_t> own;  // as many as there are phones before it
        for (const auto& [left, units] : before) {
          own.push_back(
              add({.phone = phone, .opens_phone = opens_phone, .opens_word = opens_word, .word = word, .before = units},
                  model_.senonesOf(code, left, silence_, TiedModel::WordPlace::kAlone)));
        }
        before = {{code, std::move(own)}};
        opens_phone = opens_word = false;
      }
    }
    for (const auto& [code, units] : before) {
      for (const std::uint32_t unit : units) ends.push_back({unit, code});
    }
  }

  void countLeft() {
    left_.assign(units_.size(), std::numeric_limits<Eigen::Index>::max() / 2);
    for (const End& end : ends_) left_[end.unit] = kStates;
    for (std::size_t unit = units_.size(); unit-- > 0;) {
      for (const std::uint32_t before : units_[unit].before)
        left_[before] = std::min(left_[before], left_[unit] + signedIndex(kStates));
    }
  }

  const HeardAs& heard_;
  const TiedModel& model_;
  std::size_t silence_;
  std::vector<Unit> units_;
  std::vector<std::size_t> word_ends_;
  std::vector<End> ends_;  ///< of what was added last
  std::vector<Eigen::Index> left_;
  std::size_t pairs_ = 0;  ///< of units that may follow each other
};

/// Viterbi's search, frame by frame.
class PathSearch {
 public:
  PathSearch(const WordGraph& graph, Eigen::Index frames)
      : graph_(graph), units_(graph.units()), frames_(frames), states_(units_.size(), never()) {}

  void hear(const ScoresOf& scores) {
    for (Eigen::Index first = 0; first < frames_; first += kFramesAtOnce) {
      const Eigen::Index count = std::min(kFramesAtOnce, frames_ - first);
      chooseReach(first);
      const SenoneScorer::Scores& block = scores(first, count);
      for (Eigen::Index i = 0; i < count; ++i) {
        hearFrame(first + i, block.col(i).data());
        heard_ += rows_.back().ways.size();
        if (heard_ >= kSettled) settle(first + i);
      }
    }
  }

  /// The phones of the likeliest path that ends where it may; none where there is no such path.
  std::vector<DecodedPhone> path() {
    Place best{0, kStates - 1};
    float cost = kUnheard;
    for (std::size_t unit = first_; unit < end_; ++unit) {
      const float own = graph_.mayEnd(unit) ? states_[unit].cost[kStates - 1] : kUnheard;
      if (own < cost) std::tie(cost, best.unit) = std::pair(own, unit);
    }
    if (cost >= kUnheard) return {};
    goBack(frames_ - 1, best);
    return phonesOf(settled_cost_ + double{cost});
  }

 private:
  /// Of the three states of a unit: what the best path to each costs, and where it was when the past was last settled.
  struct States {
    std::array<float, kStates> cost;
    std::array<std::uint32_t, kStates> origin;
  };
  static States never() { return {{kUnheard, kUnheard, kUnheard}, {}}; }
  struct Place {
    std::size_t unit, state;
  };
  /// How the best paths came to the units of a frame, and what they cost up to their ends.
  struct Row {
    std::size_t first = 0;
    double settled_cost = 0;
    std::vector<std::uint16_t>
        ways{};  ///< bits: to the last state, to the middle one; by which unit before to the first
    std::vector<float> costs{};

    [[nodiscard]] double costOf(std::size_t unit) const { return settled_cost + double{costs[unit - first]}; }
  };
  /// Where a path goes on to a unit.
  struct Begin {
    std::size_t unit;
    Eigen::Index frame;
    double cost;  ///< of all before
  };

  /// The units near the one that the best path has come to, and not those from which the end cannot be reached in the
  /// frames from `frame` on.
  void chooseReach(Eigen::Index frame) {
    std::size_t best = first_;
    float least = kUnheard;
    while (graph_.framesFrom(first_) - signedIndex(kStates) > frames_ - frame) states_[first_++] = never();
    for (std::size_t unit = first_; unit < end_; ++unit) {
      for (const float cost : states_[unit].cost) {
        if (cost < least) std::tie(least, best) = std::pair(cost, unit);
      }
    }
    const auto [first, end] = graph_.near(std::max(best, first_));
    for (; first_ < first; ++first_) states_[first_] = never();
    for (; end_ > end; --end_) states_[end_ - 1] = never();
    end_ = end;
  }

  void hearFrame(Eigen::Index frame, const std::int16_t* scores) {
    Row& row = rows_.emplace_back(Row{first_, settled_cost_});
    row.ways.resize(end_ - first_);
    row.costs.resize(end_ - first_);
    for (std::size_t unit = end_; unit-- > first_;) {
      const Unit& heard = units_[unit];
      States& own = states_[unit];
      unsigned way = 0;
      for (std::size_t state = kStates - 1; state > 0; --state) {
        if (own.cost[state - 1] < own.cost[state]) {
          own.cost[state] = own.cost[state - 1];
          own.origin[state] = own.origin[state - 1];
          way |= 1U << (kStates - 1 - state);
        }
        own.cost[state] += static_cast<float>(scores[heard.senones[state]]) + heard.frame_price;
      }
      if (frame == 0) {
        own.cost[0] = graph_.mayBegin(unit) ? heard.price : kUnheard;
      } else {
        for (std::size_t i = 0; i < heard.before.size(); ++i) {
          const States& before = states_[heard.before[i]];
          const float cost = before.cost[kStates - 1] + heard.price;
          if (cost >= own.cost[0]) continue;
          own.cost[0] = cost;
          own.origin[0] = before.origin[kStates - 1];
          way = (way & 3U) | static_cast<unsigned>(i + 1) << 2U;
        }
      }
      own.cost[0] += static_cast<float>(scores[heard.senones[0]]) + heard.frame_price;
      row.ways[unit - first_] = static_cast<std::uint16_t>(way);
      row.costs[unit - first_] = own.cost[kStates - 1];
    }
  }

  /// The best path is followed back to where it was when this was done last; other paths that were elsewhere then are
  /// given up, and what lies before is told.
  void settle(Eigen::Index frame) {
    Place best{first_, 0};
    const auto costAt = [&](const Place& place) { return states_[place.unit].cost[place.state]; };
    for (std::size_t unit = first_; unit < end_; ++unit) {
      for (std::size_t state = 0; state < kStates; ++state) {
        if (costAt({unit, state}) < costAt(best)) best = {unit, state};
      }
    }
    const std::uint32_t origin = states_[best.unit].origin[best.state];
    const float cost = costAt(best);
    const bool has_origins = origin_frame_ > 0;
    if (has_origins) {
      goBack(origin_frame_, {origin / kStates, origin % kStates});
      rows_.erase(rows_.begin(), rows_.begin() + (origin_frame_ - rows_from_));
      rows_from_ = origin_frame_;
    }
    for (std::size_t unit = first_; unit < end_; ++unit) {
      for (std::size_t state = 0; state < kStates; ++state) {
        States& own = states_[unit];
        const bool stays = !has_origins || own.origin[state] == origin;
        own.cost[state] = stays && own.cost[state] < kUnheard ? own.cost[state] - cost : kUnheard;
        own.origin[state] = static_cast<std::uint32_t>(kStates * unit + state);
      }
    }
    settled_cost_ += double{cost};
    origin_frame_ = frame;
    heard_ = 0;
  }

  /// Tells where the path that is at `place` in frame `last` went on to units, in what is not told yet.
  void goBack(Eigen::Index last, Place place) {
    std::vector<Begin> begins;
    for (Eigen::Index frame = last; frame >= told_; --frame) {
      const Row& row = rows_[unsignedIndex(frame - rows_from_)];
      const unsigned way = row.ways[place.unit - row.first];
      if (place.state > 0) {
        if ((way >> (kStates - 1 - place.state) & 1U) != 0) --place.state;
        continue;
      }
      const bool begins_here = frame == 0 || way >> 2U != 0;
      if (!begins_here) continue;
      const std::size_t before = frame == 0 ? place.unit : units_[place.unit].before[(way >> 2U) - 1];
      const double cost = frame == 0 ? 0 : rows_[unsignedIndex(frame - 1 - rows_from_)].costOf(before);
      begins.push_back({place.unit, frame, cost});
      place = {before, kStates - 1};
    }
    told_ = last + 1;
    begins_.insert(begins_.end(), begins.rbegin(), begins.rend());
  }

  [[nodiscard]] std::vector<DecodedPhone> phonesOf(double cost) const {
    std::vector<DecodedPhone> phones;
    for (std::size_t i = 0; i < begins_.size(); ++i) {
      const auto& [unit, frame, cost_before] = begins_[i];
      const bool is_last = i + 1 == begins_.size();
      if (units_[unit].opens_phone)
        phones.push_back({.phone = units_[unit].phone,
                          .opens_word = units_[unit].opens_word,
                          .span = {},
                          .first_frame = unsignedIndex(frame)});
      phones.back().frames += static_cast<int>((is_last ? frames_ : begins_[i + 1].frame) - frame);
      phones.back().score -= (is_last ? cost : begins_[i + 1].cost) - cost_before;
    }
    return phones;
  }

  const WordGraph& graph_;
  const std::vector<Unit>& units_;
  Eigen::Index frames_;
  std::vector<States> states_;
  std::size_t first_ = 0, end_ = 0;  ///< units that are heard
  std::deque<Row> rows_;
  Eigen::Index rows_from_ = 0, told_ = 0, origin_frame_ = 0;
  std::size_t heard_ = 0;  ///< units' frames since something was settled last
  double settled_cost_ = 0;
  std::vector<Begin> begins_;
};

}  // namespace

std::vector<DecodedPhone> likeliestPath(const WordWays& words, const HeardAs& heard, const TiedModel& model,
                                        const Pauses& pauses, Eigen::Index frames, const ScoresOf& scores) {
  const WordGraph graph(words, heard, model, pauses);
  if (frames < graph.fewestFrames()) return {};
  PathSearch search(graph, frames);
  search.hear(scores);
  return search.path();
}

}  // namespace mouthpiece
