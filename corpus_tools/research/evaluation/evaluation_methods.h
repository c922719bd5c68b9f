#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "corpus_tools/research/evaluation/evaluation.h"
#include "motion/motion_clip.h"
#include "synthesis/synthesis.h"
#include "units/file/corpus.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// A row of the table: animates a take from its labels, at the frame rate and length of its own motion. Notes about
/// units and joins go into the row.
struct EvaluationMethod {
  std::string name;
  std::function<MotionClip(const CorpusTake& take, EvaluationRow& row)> animate;
};

/// The rows, in the table's order. They refer to both arguments. To add one, append it in evaluation_methods.cpp.
std::vector<EvaluationMethod> evaluationMethods(const Corpus& corpus, const UnitDatabase& database);

/// From EDGE as published one departure more a row; then the default as it is, and with each cost and each trick off or
/// at its plain setting, one at a time.
std::vector<EvaluationMethod> ablationMethods(const Corpus& corpus, const UnitDatabase& database);

/// What a line of words that the corpus never heard meets: the ways to place what it lacks, and the methods beside.
std::vector<EvaluationMethod> backoffMethods(const Corpus& corpus, const UnitDatabase& database);

/// Greedy and guided alone.
std::vector<EvaluationMethod> selectionMethods(const Corpus& corpus, const UnitDatabase& database);

/// A row of VOCAL's speech curves alone, their poses learnt from the database's corpus.
EvaluationMethod curvesMethod(std::string name, const UnitDatabase& database);

/// A row of what is predicted, without any fragment or contact.
EvaluationMethod predictionMethod(std::string name, const UnitDatabase& database);

/// A row that joins units by `options` (its frame rate is set to each take's).
EvaluationMethod unitMethod(std::string name, const UnitDatabase& database, const SynthesisOptions& options);

/// Cohen and Massaro's coarticulation (1993), the model that unit selection is compared with: each phone has a target
/// T and a dominance D = a exp(-theta |t - t_phone|^c), theta one before and one after its middle, and the face is
/// F(t) = sum D T / sum D.
class DominanceModel {
 public:
  /// All of it by the least squared error of the lips: c and one theta for all from a grid, then a and both thetas of
  /// each phone by coordinate search over some takes, the targets by linear least squares each time and last over all.
  static DominanceModel fit(const Corpus& corpus);

  /// `frames` frames of the layout's markers on the clock of `labels`.
  [[nodiscard]] MotionClip animate(const SpeechLabels& labels, double frame_rate_hz, std::size_t frames) const;

  struct PhoneParameters {
    double magnitude = 1;                      ///< a
    double rate_before = 20, rate_after = 20;  ///< theta, 1 / s^c
  };
  [[nodiscard]] const std::array<PhoneParameters, kPhoneCount>& parameters() const { return parameters_; }
  [[nodiscard]] double power() const { return power_; }

  /// times x kPhoneCount: how much of each phone's target shows; rows add up to 1.
  [[nodiscard]] Eigen::MatrixXd sharesOf(const SpeechLabels& labels, std::span<const Seconds> times) const;

 private:
  class Trial;
  /// The dominance at `times` of all that is said of `phone`, each by `own`.
  [[nodiscard]] Eigen::VectorXd dominanceOf(Phone phone, const PhoneParameters& own, const SpeechLabels& labels,
                                            std::span<const Seconds> times) const;
  /// times x kPhoneCount.
  [[nodiscard]] Eigen::MatrixXd dominancesOf(const SpeechLabels& labels, std::span<const Seconds> times) const;
  std::vector<std::string> marker_names_;
  Eigen::RowVectorXd mean_;
  Eigen::MatrixXd targets_;  ///< phones x (3 * markers), mm from the mean pose
  std::array<PhoneParameters, kPhoneCount> parameters_{};
  double power_ = 1;  ///< c
};

}  // namespace mouthpiece
