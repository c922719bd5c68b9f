#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <utility>

namespace mouthpiece {

template <typename Weights>
struct TunedField {
  const char* name;
  double Weights::*value;
};

/// "duration 1 -> 0.5, ..."; empty when nothing differs.
template <typename Weights>
std::string changesBetween(std::span<const TunedField<Weights>> fields, const Weights& before, const Weights& after) {
  std::string text;
  for (const TunedField<Weights>& field : fields) {
    if (before.*field.value == after.*field.value) continue;
    text += fmt::format("{}{} {:.3g} -> {:.3g}", text.empty() ? "" : ", ", field.name, before.*field.value,
                        after.*field.value);
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

  void searchAll(const std::function<void(std::size_t done, std::size_t total)>& progress) {
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
      next.*field.value *= factor;
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

}  // namespace mouthpiece
