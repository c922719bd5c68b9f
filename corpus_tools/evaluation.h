#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "corpus_tools/lip_measures.h"
#include "units/corpus.h"
#include "units/unit_database.h"

namespace mouthpiece {

/// One way of animating, measured over all takes (docs/theory/evaluation.md).
struct EvaluationRow {
  std::string method;
  LipMeasures lips;                ///< over all takes
  std::vector<LipMeasures> takes;  ///< of each take, for intervals
  // The rest is zero for methods that do not join units.
  std::size_t phones = 0;
  std::size_t units = 0;
  std::size_t pairs = 0;                         ///< of neighbouring phones
  std::size_t backoff_pairs = 0;                 ///< spelt by a stand-in
  std::vector<double> join_jumps_mm;             ///< largest marker step across each join
  std::vector<double> join_limits_mm;            ///< 95th percentile of the corpus' own steps at that join's frame rate
  std::vector<double> velocity_jumps_mm_s;       ///< largest change of a marker's velocity at each join
  std::vector<double> velocity_mismatches_mm_s;  ///< between the fragments that meet there, before they are blended
  std::vector<double> velocity_limits_mm_s;      ///< 95th percentile of the corpus' own
  std::vector<double> captured_velocity_jumps_mm_s;  ///< of the take itself at the same frames
  std::vector<double> added_velocity_jumps_mm_s;     ///< jump less the take's own there, as shown at 60 Hz or more

  [[nodiscard]] double unitsPerPhone() const;
  [[nodiscard]] double phonesPerUnit() const;
  [[nodiscard]] double backoffShare() const;
  [[nodiscard]] double joinJump95() const;                ///< 95th percentile, mm; NaN without joins
  [[nodiscard]] double usualStep() const;                 ///< mean limit, mm; NaN without joins
  [[nodiscard]] double joinsOverLimit() const;            ///< share of joins beyond their limit; NaN without
  [[nodiscard]] double meanVelocityJump() const;          ///< mm/s; NaN without joins
  [[nodiscard]] double meanVelocityMismatch() const;      ///< mm/s; NaN without joins
  [[nodiscard]] double velocitiesOverLimit() const;       ///< share of joins; NaN without
  [[nodiscard]] double meanCapturedVelocityJump() const;  ///< mm/s; NaN without joins
  [[nodiscard]] double meanAddedVelocityJump() const;     ///< mm/s; NaN without joins
  EvaluationRow& operator+=(const EvaluationRow& other);  ///< the same method over other takes
};

struct Evaluation {
  std::string corpus;
  std::vector<std::string> takes;
  std::vector<EvaluationRow> rows;
};

/// Called from one thread, with the number of takes animated over all rows.
using EvaluationProgress = std::function<void(std::size_t done, std::size_t total)>;

struct EvaluationMethod;
/// The rows of a table, which refer to both arguments; evaluation_methods.h has those there are.
using EvaluationMethods = std::function<std::vector<EvaluationMethod>(const Corpus&, const UnitDatabase&)>;

/// Animates each of `captured` from its labels with the material of `corpus` by each method and compares. Throws
/// InputError when `captured` is empty or the layout lacks lips.
Evaluation evaluateCorpus(const Corpus& corpus, const std::vector<CorpusTake>& captured,
                          const EvaluationMethods& methods, const EvaluationProgress& progress = {});

/// Every take once, animated with the material of the takes of the other folds (take i is in fold i mod `folds`), to
/// which the trajectory model is fitted anew. Throws InputError for fewer than two folds or fewer takes than folds.
Evaluation crossValidate(const Corpus& corpus, std::size_t folds, const EvaluationMethods& methods,
                         const EvaluationProgress& progress = {});

/// Every fifth take, animated with the material of `sizes` others, drawn with a fixed seed: a larger set holds the
/// smaller ones. Rows are the methods' with the number of takes. Throws InputError for a size that is 0 or too large.
Evaluation learningCurve(const Corpus& corpus, const std::vector<std::size_t>& sizes, const EvaluationMethods& methods,
                         const EvaluationProgress& progress = {});

/// Moves a random `share` of the takes (at least one, and one stays) out of the corpus, and fits its trajectory model,
/// if it has one, to what stays. The same seed, the same takes. Throws InputError for fewer than two takes, or a share
/// that is not in (0, 1).
std::vector<CorpusTake> holdOut(Corpus& corpus, double share, std::uint64_t seed);

/// A corpus without some of its takes, and these.
struct SplitTakes {
  Corpus rest;
  std::vector<CorpusTake> held;
};

/// Holds out the takes i with i mod `folds` = `fold`, and fits the trajectory model to the others.
SplitTakes splitTakes(const Corpus& corpus, std::size_t folds, std::size_t fold);

/// Captures slower or faster than the synthesis offers (24 to 240 Hz) at the nearest rate that it does.
std::vector<CorpusTake> atOfferedRates(std::vector<CorpusTake> takes);

/// A table for people, and the same as JSON.
std::string evaluationTable(const Evaluation& evaluation);
std::string evaluationJson(const Evaluation& evaluation);

}  // namespace mouthpiece
