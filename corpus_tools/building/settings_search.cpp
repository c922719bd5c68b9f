#include "corpus_tools/building/settings_search.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace mouthpiece {

double tuningScore(const LipMeasures& measures) {
  const double lost = measures.closures > 0 ? 1 - measures.closureRecall() : 0;
  const double invented = measures.open_phones > 0 ? measures.falseClosureShare() : 0;
  return measures.lipRms() + lost + invented;
}

double LipTrial::scoreOf(const TakeMeasures& takes) {
  LipMeasures sum;
  for (const auto& take : takes) {
    if (take) sum += *take;
  }
  return tuningScore(sum);
}

double LipTrial::errorOfDifference(const TakeMeasures& before, const TakeMeasures& after) {
  constexpr std::size_t kDraws = 500;
  constexpr std::uint64_t kSeed = 1;
  std::mt19937_64 random(kSeed);
  double sum = 0, squares = 0;
  for (std::size_t draw = 0; draw < kDraws; ++draw) {
    LipMeasures drawn_before, drawn_after;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const std::size_t take = random() % before.size();
      if (before[take]) drawn_before += *before[take];
      if (after[take]) drawn_after += *after[take];
    }
    const double difference = tuningScore(drawn_after) - tuningScore(drawn_before);
    sum += difference;
    squares += difference * difference;
  }
  constexpr auto kCount = asReal(kDraws);
  return std::sqrt(std::max(0.0, squares / kCount - (sum / kCount) * (sum / kCount)));
}

std::vector<TunedField<LatticeWeights>> tunedLatticeFields() {
  std::vector<TunedField<LatticeWeights>> fields;
  const std::span<const CostTerm> terms = pairTerms();
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (terms[i].ablation.empty()) continue;
    fields.push_back({terms[i].name, [i](LatticeWeights& weights) -> double& { return weights.values()[i]; }});
  }
  return fields;
}

}  // namespace mouthpiece
