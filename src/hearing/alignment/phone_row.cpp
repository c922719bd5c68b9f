#include "hearing/alignment/phone_row.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "base/index.h"

namespace mouthpiece {
namespace {

/// The states that may be heard in a frame: [first, end) of all, and where what is known of them is kept.
struct Reach {
  std::size_t first = 0, end = 0, at = 0;

  [[nodiscard]] std::size_t place(std::size_t state) const { return at + state - first; }
  /// 0 for a state that is not heard.
  [[nodiscard]] double of(const std::vector<double>& values, std::size_t state) const {
    return state >= first && state < end ? values[place(state)] : 0.0;
  }
};

/// All states of a row by their frames. Every path takes as many steps from state to state, so that what a step costs
/// changes nothing.
class RowStates {
 public:
  RowStates(std::span<const RowPhone> row, Eigen::Index frames) : row_(row) {
    std::vector<std::size_t> ends;
    for (const RowPhone& phone : row) {
      senones_.insert(senones_.end(), phone.senones.begin(), phone.senones.end());
      ends.push_back(senones_.size());
    }
    std::size_t first = 0, end = 0;
    for (Eigen::Index t = 0; t < frames; ++t) {
      while (first < row.size() && row[first].end <= t) ++first;
      while (end < row.size() && row[end].first <= t) ++end;
      const std::size_t from = first > 0 ? ends[first - 1] : 0, to = end > 0 ? ends[end - 1] : 0;
      reaches_.push_back({from, std::max(from, to), likelihoods_.size()});
      likelihoods_.resize(likelihoods_.size() + reaches_.back().end - from);
    }
  }

  void weigh(const ScoresOf& scores) {
    constexpr std::size_t kBlock = 64;
    for (std::size_t first = 0; first < reaches_.size(); first += kBlock) {
      const std::size_t count = std::min(kBlock, reaches_.size() - first);
      const SenoneScorer::Scores& block = scores(signedIndex(first), signedIndex(count));
      for (std::size_t i = 0; i < count; ++i) weighFrame(reaches_[first + i], block.col(signedIndex(i)).data());
    }
  }

  /// Whether the row can be heard up to the last frame.
  bool passOn() {
    forward_.resize(likelihoods_.size());
    for (std::size_t t = 0; t < reaches_.size(); ++t) {
      const Reach& now = reaches_[t];
      double sum = 0;
      for (std::size_t s = now.first; s < now.end; ++s) {
        double before = s == 0 ? 1.0 : 0.0;
        if (t > 0) before = reaches_[t - 1].of(forward_, s) + (s > 0 ? reaches_[t - 1].of(forward_, s - 1) : 0.0);
        sum += forward_[now.place(s)] = before * double{likelihoods_[now.place(s)]};
      }
      if (!(sum > 0)) return false;
      for (std::size_t s = now.first; s < now.end; ++s) forward_[now.place(s)] /= sum;
    }
    return true;
  }

  /// How many frames each phone is expected to last, after passOn(). Empty where no path leads to the last phone.
  [[nodiscard]] std::vector<double> passBack() const {
    std::vector<double> in_state(senones_.size(), 0.0), now, after;
    for (std::size_t t = reaches_.size(); t-- > 0;) {
      const Reach here{reaches_[t].first, reaches_[t].end, 0};
      now.assign(here.end - here.first, 0.0);
      double sum = 0;
      for (std::size_t s = here.first; s < here.end; ++s) {
        double& back = now[here.place(s)] = s + 1 == senones_.size() ? 1.0 : 0.0;
        if (t + 1 < reaches_.size()) {
          const Reach next{reaches_[t + 1].first, reaches_[t + 1].end, 0};
          back = next.of(after, s) + next.of(after, s + 1);
        }
        sum += back * forward_[reaches_[t].place(s)];
      }
      if (!(sum > 0)) return {};
      for (std::size_t s = here.first; s < here.end; ++s) {
        double& back = now[here.place(s)];
        in_state[s] += back * forward_[reaches_[t].place(s)] / sum;
        back *= double{likelihoods_[reaches_[t].place(s)]} / sum;
      }
      std::swap(now, after);
    }
    std::vector<double> lasts;
    auto state = in_state.begin();
    for (const RowPhone& phone : row_) {
      double& sum = lasts.emplace_back(0);
      for (std::size_t s = 0; s < phone.senones.size(); ++s) sum += *state++;
    }
    return lasts;
  }

 private:
  /// A state's likelihood against the best of its frame.
  void weighFrame(const Reach& reach, const std::int16_t* scores) {
    constexpr float kLeast = 1e-30F;
    int best = INT16_MAX;
    for (std::size_t s = reach.first; s < reach.end; ++s) best = std::min<int>(best, scores[senones_[s]]);
    for (std::size_t s = reach.first; s < reach.end; ++s)
      likelihoods_[reach.place(s)] =
          std::max(kLeast, std::exp(-asFloat(kScoreUnit) * static_cast<float>(scores[senones_[s]] - best)));
  }

  std::span<const RowPhone> row_;
  std::vector<int> senones_;  ///< of all states
  std::vector<Reach> reaches_;
  std::vector<float> likelihoods_;
  std::vector<double> forward_;  ///< frame by frame, each frame's add up to 1
};

}  // namespace

std::vector<double> expectedBorders(std::span<const RowPhone> row, Eigen::Index frames, const ScoresOf& scores) {
  RowStates states(row, frames);
  states.weigh(scores);
  if (frames == 0 || !states.passOn()) return {};
  std::vector<double> borders = states.passBack();
  if (borders.empty()) return {};
  std::partial_sum(borders.begin(), borders.end(), borders.begin());
  borders.pop_back();
  return borders;
}

}  // namespace mouthpiece
