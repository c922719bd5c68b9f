#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "corpus_tools/research/tuning/tuning.h"

namespace mouthpiece {

/// A weight that is searched, and its name for people.
template <typename Weights>
struct TunedField {
  std::string_view name;
  std::function<double&(Weights&)> value;
};

/// "duration 1 -> 0.5, ..."; empty when nothing differs.
template <typename Weights>
std::string changesBetween(std::span<const TunedField<Weights>> fields, Weights before, Weights after) {
  std::string text;
  for (const TunedField<Weights>& field : fields) {
    const double old_value = field.value(before), new_value = field.value(after);
    if (old_value == new_value) continue;
    text += fmt::format("{}{} {:.3g} -> {:.3g}", text.empty() ? "" : ", ", field.name, old_value, new_value);
  }
  return text;
}

/// Each weight up, else down, by the round's factor, while that lowers the score.
template <typename Weights>
class CoordinateSearch {
 public:
  using Score = std::function<double(const Weights&)>;

  CoordinateSearch(Score score, std::span<const TunedField<Weights>> fields, const Weights& start)
      : score_(std::move(score)), fields_(fields), best_(start), best_score_(score_(start)) {}

  void searchAll(const TuningProgress& progress) {
    constexpr std::array<double, 2> kSteps{2, 1.4};  // factor up and down, a round each
    std::size_t done = 0;
    for (const double factor : kSteps) {
      for (const TunedField<Weights>& field : fields_) {
        if (!gainsBy(field, factor)) gainsBy(field, 1 / factor);
        if (progress) progress(++done, kSteps.size() * fields_.size());
      }
    }
  }
  [[nodiscard]] const Weights& best() const { return best_; }
  [[nodiscard]] double bestScore() const { return best_score_; }
  [[nodiscard]] std::size_t tried() const { return tried_; }

 private:
  bool gainsBy(const TunedField<Weights>& field, double factor) {
    constexpr int kMostSteps = 2;
    constexpr double kLeastGain = 1e-3;  // of the score: a step that gains less is chance
    bool gained = false;
    for (int step = 0; step < kMostSteps; ++step) {
      Weights next = best_;
      field.value(next) *= factor;
      const double score = score_(next);
      ++tried_;
      if (!(score < best_score_ - kLeastGain)) break;
      best_ = next;
      best_score_ = score;
      gained = true;
    }
    return gained;
  }

  Score score_;
  std::span<const TunedField<Weights>> fields_;
  Weights best_;
  double best_score_;
  std::size_t tried_ = 1;
};

/// Throws InputError for fewer folds than that, or fewer than four takes a fold.
void expectFolds(std::size_t corpus_takes, const TuningOptions& options, std::size_t least_folds);

template <typename Score>
double totalOf(const Score& score) {
  if constexpr (std::is_arithmetic_v<Score>)
    return score;
  else
    return score.sum();
}

/// Searches the fields on the takes of every other fold, and judges what it found on the takes of the folds between.
/// Of a Trial: `Score`; measure(first, weights), what is measured of all takes held out in the folds first, first + 2,
/// ..., an entry a take; scoreOf(measures); errorOfDifference(before, after), the standard error of what their scores
/// differ by. `takes`: in all folds.
template <typename Weights, typename Trial>
Tuned<Weights, typename Trial::Score> searchAndJudge(const Trial& trial, std::span<const TunedField<Weights>> fields,
                                                     const Weights& start, std::size_t takes, bool always,
                                                     const TuningProgress& progress) {
  const auto searched = [&](const Weights& weights) { return totalOf(trial.scoreOf(trial.measure(0, weights))); };
  CoordinateSearch<Weights> search(searched, fields, start);
  Tuned<Weights, typename Trial::Score> tuned;
  tuned.search_before = search.bestScore();
  search.searchAll(progress);
  tuned.search_after = search.bestScore();
  tuned.settings = search.tried();
  tuned.changes = changesBetween(fields, start, search.best());

  const auto before = trial.measure(1, start);
  const auto after = trial.measure(1, search.best());
  tuned.judge_takes = before.size();
  tuned.search_takes = takes - before.size();
  tuned.judge_before = trial.scoreOf(before);
  tuned.judge_after = trial.scoreOf(after);
  tuned.judge_error = trial.errorOfDifference(before, after);
  const bool changed = !tuned.changes.empty();
  tuned.helps = changed && totalOf(tuned.judge_after) + tuned.judge_error < totalOf(tuned.judge_before);
  tuned.taken = tuned.helps || (always && changed);
  tuned.weights = tuned.taken ? search.best() : start;
  return tuned;
}

}  // namespace mouthpiece
