#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "corpus_tools/takes/lip_measures.h"
#include "units/costs/cost_terms.h"

namespace mouthpiece {

using TuningProgress = std::function<void(std::size_t done, std::size_t total)>;

/// What a search for weights found. A score is a number, or has a sum() that is one; less is better.
template <typename Weights, typename Score>
struct Tuned {
  Weights weights;           ///< the best found where `taken`, else those that it began with
  bool helps = false;        ///< also on the judging takes, by more than `judge_error`
  bool taken = false;        ///< `weights` are the best found
  std::size_t settings = 0;  ///< tried
  std::size_t search_takes = 0, judge_takes = 0;
  double search_before = 0, search_after = 0;
  Score judge_before{}, judge_after{};
  double judge_error = 0;  ///< standard error of the difference of the judging takes' scores
  std::string changes;     ///< "duration 1 -> 0.5, ..." of the best found; empty when it is where it began
};

/// How they were learnt, in a line, for people and for the build log; Score is a number.
template <typename Weights>
std::string describeTuning(const Tuned<Weights, double>& tuned) {
  return fmt::format(
      "{}: {} settings tried on {} takes, score {:.3f} -> {:.3f}; judged on {} others, {:.3f} -> {:.3f} (standard "
      "error of the difference {:.3f}); best found: {}",
      tuned.taken ? "learnt" : "kept as they were", tuned.settings, tuned.search_takes, tuned.search_before,
      tuned.search_after, tuned.judge_takes, tuned.judge_before, tuned.judge_after, tuned.judge_error,
      tuned.changes.empty() ? "no change" : tuned.changes);
}

/// An entry a take; nullopt where nothing could be made of it.
using TakeMeasures = std::vector<std::optional<LipMeasures>>;

/// Lip error in mm, and 1 for all closures lost, and 1 for all open phones closed
/// (docs/theory/units/selection.md).
double tuningScore(const LipMeasures& measures);

/// What a trial whose takes are measured by their lips has in common with others: tuningScore() of all takes, and the
/// standard error of a difference by bootstrap over takes.
struct LipTrial {
  using Score = double;
  static double scoreOf(const TakeMeasures& takes);
  static double errorOfDifference(const TakeMeasures& before, const TakeMeasures& after);
};

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

  /// One round by a factor of 2; a second one by 1.4.
  void searchAll(const TuningProgress& progress, std::size_t rounds = 2) {
    const auto steps = std::span(kFactors).first(rounds);
    std::size_t done = 0;
    for (const double factor : steps) {
      for (const TunedField<Weights>& field : fields_) {
        if (!gainsBy(field, factor)) gainsBy(field, 1 / factor);
        if (progress) progress(++done, steps.size() * fields_.size());
      }
    }
  }
  [[nodiscard]] const Weights& best() const { return best_; }
  [[nodiscard]] double bestScore() const { return best_score_; }
  [[nodiscard]] std::size_t tried() const { return tried_; }

 private:
  static constexpr std::array<double, 2> kFactors{2, 1.4};

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

/// Those of the lattice's weights that the ablation can do without: the stand-ins' price decides nothing where the
/// corpus has the pair.
std::vector<TunedField<LatticeWeights>> tunedLatticeFields();

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
                                                     const TuningProgress& progress, std::size_t rounds = 2) {
  const auto searched = [&](const Weights& weights) { return totalOf(trial.scoreOf(trial.measure(0, weights))); };
  CoordinateSearch<Weights> search(searched, fields, start);
  Tuned<Weights, typename Trial::Score> tuned;
  tuned.search_before = search.bestScore();
  search.searchAll(progress, rounds);
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
