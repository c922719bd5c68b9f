#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "corpus_tools/lip_measures.h"
#include "units/corpus.h"

namespace mouthpiece {

/// One way of animating, measured over all takes (docs/theory/evaluation.md).
struct EvaluationRow {
  std::string method;
  LipMeasures lips;
  // The rest is zero for methods that do not join units.
  std::size_t phones = 0;
  std::size_t units = 0;
  std::size_t pairs = 0;               ///< of neighbouring phones
  std::size_t backoff_pairs = 0;       ///< spelt by a stand-in
  std::vector<double> join_jumps_mm;   ///< largest marker step across each join
  std::vector<double> join_limits_mm;  ///< 95th percentile of the corpus' own steps at that join's frame rate

  [[nodiscard]] double unitsPerPhone() const;
  [[nodiscard]] double backoffShare() const;
  [[nodiscard]] double joinJumpPercentile(double share) const;  ///< NaN without joins
  [[nodiscard]] double usualStep() const;                       ///< mean limit, mm; NaN without joins
  [[nodiscard]] double joinsOverLimit() const;                  ///< share of joins beyond their limit; NaN without
};

struct Evaluation {
  std::string corpus;
  std::vector<std::string> takes;
  std::vector<EvaluationRow> rows;
};

/// Called from one thread, with the number of takes animated over all rows.
using EvaluationProgress = std::function<void(std::size_t done, std::size_t total)>;

/// Animates each of `captured` from its labels with the material of `corpus` and compares: greedy and viterbi unit
/// selection, the dominance model, the mean pose. Throws InputError when `captured` is empty or the layout lacks lips.
Evaluation evaluateCorpus(const Corpus& corpus, const std::vector<CorpusTake>& captured,
                          const EvaluationProgress& progress = {});

/// Moves a random `share` of the takes (at least one, and one stays) out of the corpus. The same seed, the same takes.
/// Throws InputError for fewer than two takes, or a share that is not in (0, 1).
std::vector<CorpusTake> holdOut(Corpus& corpus, double share, std::uint64_t seed);

/// A table for people, and the same as JSON.
std::string evaluationTable(const Evaluation& evaluation);
std::string evaluationJson(const Evaluation& evaluation);

}  // namespace mouthpiece
