#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "corpus_tools/sample/actor_model.h"
#include "corpus_tools/sample/actor_performance.h"
#include "corpus_tools/takes/lip_measures.h"
#include "motion/marker_layout.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// A capture ready to learn from: heads still, in the face's axes, the neutral pose at its place.
struct ActorCapture {
  MarkerLayout layout;
  MarkerPositions neutral_mm;
  std::vector<CorpusTake> takes;
};

/// Reads every `stride`-th take of a folder and takes the head motion off. Throws InputError.
ActorCapture readActorCapture(const std::filesystem::path& folder, std::size_t stride = 1);

struct ActorFitOptions {
  Eigen::Index components = 10;
  double ridge = 3;  ///< shrinks contributions of rare features; in frames
  double largest_gain = 1.8;
  std::string credit;
};

/// Learns an actor by least squares (docs/theory/corpus_tools/actor_model.md). Throws InputError for a capture with too
/// little in it.
ActorModel fitActor(const ActorCapture& capture, const ActorFitOptions& options);

/// `model` performs the labels of `takes`, compared with what was captured, in one sum.
LipMeasures scoreActor(const ActorModel& model, const ActorCapture& capture, ActorOptions options);

/// The takes whose index modulo `fold_count` is (or is not) `fold`.
ActorCapture withoutFold(const ActorCapture& capture, std::size_t fold_count, std::size_t fold);
ActorCapture onlyFold(const ActorCapture& capture, std::size_t fold_count, std::size_t fold);

/// The displacements of one take from its own neutral pose: frames x (3 * markers), mm; and the frames that count (all
/// markers seen).
struct ActorDisplacements {
  Eigen::MatrixXd mm;
  Eigen::VectorXd seen;    ///< 1 or 0 a frame
  Eigen::VectorXd speech;  ///< 1 or 0 a frame: seen, and neither silence nor breath
};

std::vector<ActorDisplacements> actorDisplacements(const ActorCapture& capture);

/// Symmetric principal components of the speaking part of the face, and the trajectories along them.
struct ActorBasis {
  Eigen::MatrixXd shapes;                     ///< components x (3 * markers), mm for one deviation in speech
  std::vector<Eigen::MatrixXd> trajectories;  ///< one a take: frames x components
};

ActorBasis actorBasis(const std::vector<ActorDisplacements>& takes, const MarkerLayout& layout,
                      Eigen::Index components);

/// `rows` averaged with its mirror image in the layout; frames x (3 * markers), displacements or (`neutral`) positions.
Eigen::MatrixXd symmetrized(const Eigen::MatrixXd& rows, const MarkerLayout& layout);

/// ActorModel::blink_shape and brow_shape.
Eigen::RowVectorXd blinkShape(const std::vector<ActorDisplacements>& takes, const MarkerLayout& layout);
Eigen::RowVectorXd browShape(const std::vector<ActorDisplacements>& takes, const MarkerLayout& layout);

}  // namespace mouthpiece
