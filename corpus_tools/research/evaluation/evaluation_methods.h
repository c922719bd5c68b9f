#pragma once

#include <functional>
#include <string>
#include <vector>

#include "corpus_tools/research/evaluation/evaluation.h"
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

/// Viterbi as it is, and with each cost and each trick off or at its plain setting, one at a time.
std::vector<EvaluationMethod> ablationMethods(const Corpus& corpus, const UnitDatabase& database);

/// Greedy and viterbi alone.
std::vector<EvaluationMethod> selectionMethods(const Corpus& corpus, const UnitDatabase& database);

/// A row of VOCAL's speech curves alone, their poses learnt from the database's corpus.
EvaluationMethod curvesMethod(std::string name, const UnitDatabase& database);

/// A row that joins units by `options` (its frame rate is set to each take's).
EvaluationMethod unitMethod(std::string name, const UnitDatabase& database, const SynthesisOptions& options);

}  // namespace mouthpiece
