#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
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

/// From EDGE as published one departure more a row; then the default as it is, and with each cost and each trick off or at its plain setting, one at a time.
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
/// T and a dominance D = a exp(-theta |t - t_phone|^c), and the face is F(t) = sum D T / sum D.
class DominanceModel {
 public:
  /// Targets: the mean pose of each phone's middle frames. a (one per kind of phone), theta and c: a coarse grid, by
  /// the lip error over some takes of the corpus.
  static DominanceModel fit(const Corpus& corpus);

  /// `frames` frames of the layout's markers on the clock of `labels`.
  [[nodiscard]] MotionClip animate(const SpeechLabels& labels, double frame_rate_hz, std::size_t frames) const;

  /// Kinds of phones that share a magnitude a.
  enum class Kind : std::uint8_t { kSilence, kVowel, kRounded, kBilabial, kLabiodental, kSibilant, kOther };
  static constexpr std::size_t kKindCount = 7;
  static Kind kindOf(Phone phone);

  struct Parameters {
    std::array<double, kKindCount> magnitude{1, 1, 1, 1, 1, 1, 1};  ///< a
    double rate = 20;                                               ///< theta, 1 / s^c
    double power = 1;                                               ///< c
  };
  [[nodiscard]] const Parameters& parameters() const { return parameters_; }

 private:
  std::vector<std::string> marker_names_;
  std::array<Eigen::RowVectorXd, kPhoneCount> targets_;
  Parameters parameters_;
};

}  // namespace mouthpiece
