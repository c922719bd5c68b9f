#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "corpus_tools/takes/lip_measures.h"
#include "units/file/corpus.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// What a page draws of a take, at the capture's rate; NaN where it was not seen.
struct LipCurves {
  std::vector<float> opening_mm, width_mm, protrusion_mm;  ///< protrusion: how far both lips stand out, Z
  std::vector<Seconds> joins;                              ///< middles of the blends
};

/// One way of animating, measured over all takes (docs/theory/corpus_tools/evaluation.md).
struct EvaluationRow {
  std::string method;
  LipMeasures lips;                ///< over all takes
  std::vector<LipMeasures> takes;  ///< of each take, for intervals
  std::vector<LipCurves> curves;   ///< of each take, where they are kept
  // The rest is zero for methods that do not join units.
  std::size_t phones = 0;
  std::size_t units = 0;
  std::size_t pairs = 0;                         ///< of neighbouring phones
  std::size_t backoff_pairs = 0;                 ///< spelt by a stand-in
  std::vector<Seconds> join_times;               ///< of all takes, one after another
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

/// A take that was compared, and how it was captured.
struct ComparedTake {
  std::string name, text;
  SpeechLabels labels;
  double frame_rate_hz = 0;
  LipCurves captured;
};

struct Evaluation {
  std::string corpus;
  std::vector<std::string> takes;
  std::vector<EvaluationRow> rows;
  std::vector<ComparedTake> compared = {};  ///< as `takes`, where curves are kept

  Evaluation& operator+=(const Evaluation& other);  ///< the same rows over other takes
};

/// Called from one thread, with the number of takes animated over all rows.
using EvaluationProgress = std::function<void(std::size_t done, std::size_t total)>;

struct EvaluationOptions {
  EvaluationProgress progress = {};
  bool keep_curves = false;                      ///< for evaluationHtml()
  std::map<std::string, MotionClip> truth = {};  ///< by take: compared with this in place of the capture
  /// What of each take is measured; none: all.
  std::function<MeasuredStretches(const CorpusTake& take)> stretches = {};
  std::uint64_t draw = 1;                ///< of learningCurve(): which random choice of the takes to learn from
  const Corpus* adapted_from = nullptr;  ///< of learningCurve(): beside each size, this corpus adapted to those takes
};

struct EvaluationMethod;
/// The rows of a table, which refer to both arguments; evaluation_methods.h has those there are.
using EvaluationMethods = std::function<std::vector<EvaluationMethod>(const Corpus&, const UnitDatabase&)>;

/// Animates each of `captured` from its labels with the material of `corpus` by each method and compares. Throws
/// InputError when `captured` is empty or the layout lacks lips.
Evaluation evaluateCorpus(const Corpus& corpus, const std::vector<CorpusTake>& captured,
                          const EvaluationMethods& methods, const EvaluationOptions& options = {});

/// Every take once, animated with the material of the takes of the other folds (take i is in fold i mod `folds`), to
/// which the trajectory model is fitted anew. Throws InputError for fewer than two folds or fewer takes than folds.
Evaluation crossValidate(const Corpus& corpus, std::size_t folds, const EvaluationMethods& methods,
                         const EvaluationOptions& options = {});

/// What the corpus is made to have never heard.
enum class Unseen {
  kWords,   ///< whole words: every take with the word is taken out
  kPairs,   ///< whole pairs of phones
  kPhones,  ///< whole phones
};

struct UnseenOptions {
  std::size_t most_rounds = 12;  ///< evenly chosen; each fits a corpus anew
  std::size_t most_takes = 32;   ///< of those taken out, measured in a round; evenly chosen
  /// Of that many parts of the rounds, and which: settings are chosen on one and judged on another.
  std::size_t parts = 1, part = 0;
};

/// Each word (pair, phone) that not every other take has is taken out of the corpus with all takes that have it,
/// several at once where they leave 70 % of the takes, and the model fitted to what stays; of those takes only the
/// stretches that say it are measured. Throws InputError where nothing can be taken out.
Evaluation evaluateUnseen(const Corpus& corpus, Unseen unseen, const EvaluationMethods& methods,
                          const EvaluationOptions& options = {}, const UnseenOptions& limits = {});

/// Every fifth take, animated with the material of `sizes` others, drawn with a fixed seed: a larger set holds the
/// smaller ones. Rows are the methods' with the number of takes. With `adapted_from`, rows before them are of that
/// corpus alone, only turned and sized, and after each size come those of it adapted (adaptCorpus()). Throws InputError
/// for a size that is 0 or too large.
Evaluation learningCurve(const Corpus& corpus, const std::vector<std::size_t>& sizes, const EvaluationMethods& methods,
                         const EvaluationOptions& options = {});

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

/// Of a corpus with more takes than `most`, that many.
Corpus evenlySpacedTakes(const Corpus& corpus, std::size_t most);

/// Captures slower or faster than the synthesis offers (24 to 240 Hz) at the nearest rate that it does.
std::vector<CorpusTake> atOfferedRates(std::vector<CorpusTake> takes);

/// The motion that is known to be true of each take of `corpus`, from NAME.c3d in `folder` (`corpus sample --truth`),
/// in the corpus' frame: one rigid motion a take. Throws InputError where one is missing or does not fit its take.
std::map<std::string, MotionClip> readTruth(const Corpus& corpus, const std::filesystem::path& folder);

struct Interval {
  double low = 0, high = 0;  ///< NaN where the measure is, and of a single take
};

/// The 95 % bootstrap interval of a measure of a row: 1,000 draws of as many takes as the row has, with replacement and
/// a fixed seed.
Interval bootstrapInterval(const EvaluationRow& row, const std::function<double(const LipMeasures&)>& measure);

/// A table for people, and the same as JSON.
std::string evaluationTable(const Evaluation& evaluation);
std::string evaluationJson(const Evaluation& evaluation);

/// The same as a page by itself (no other file, no network), with the curves of each take over each other where they
/// are kept: opening, width and protrusion of the lips, phones and joins under them. Takes whose curves would make it
/// larger than `most_curve_bytes` are left out, those at the end first.
std::string evaluationHtml(const Evaluation& evaluation, std::size_t most_curve_bytes = std::size_t{24} << 20U);

}  // namespace mouthpiece
