#pragma once

#include <Eigen/Core>
#include <vector>

#include "corpus_tools/research/models/actor_fit.h"

namespace mouthpiece {

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
