#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/time.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// How fast one component of the face moves towards its targets.
struct ActorDynamics {
  Seconds time_constant = 0.02;  ///< of each of the four equal first-order stages
  Seconds lead = 0.0;            ///< the middle of a movement comes this long before the phone's boundary
};

/// Lip opening (LIP_UP_MID to LIP_LO_MID, along Y) that some phones must reach, relative to the neutral pose, mm.
struct ActorClosures {
  double bilabial_mm = 0.4;     ///< B P M
  double labiodental_mm = 2.0;  ///< F V: the lower lip at the teeth
  double contact_mm = -0.8;     ///< lips pressed together come no closer than this
};

/// A speaker's way of moving, learnt from a capture (docs/theory/corpus_tools/actor_model.md). Components are numbered
/// in the order of their share of the motion; one unit is the standard deviation of that component in the captured
/// speech.
struct ActorModel {
  std::string credit;  ///< whose face it was; must travel with the numbers
  std::vector<std::string> marker_names;
  MarkerPositions neutral_mm;           ///< face axes: origin between the outer canthi, X left, Y up, Z out
  Eigen::MatrixXd component_shapes;     ///< components x (3 * markers), mm a unit
  std::vector<ActorDynamics> dynamics;  ///< one a component
  Eigen::VectorXd gain;                 ///< one a component: brings the variance back that least squares takes
  Eigen::VectorXd speech_mean;          ///< the mean target in speech, about which `gain` acts
  Eigen::VectorXd closing;              ///< components that open the lips by 1 mm, as they do together
  ActorClosures closures;
  Eigen::RowVectorXd blink_shape;  ///< mm a marker coordinate: the lids shut
  Eigen::RowVectorXd brow_shape;   ///< mm: the brows one standard deviation up
  /// Contributions to a phone's target by feature ("phone B", "left MBP Ah", ...): speech_segments.h.
  std::map<std::string, Eigen::VectorXd> targets;

  [[nodiscard]] Eigen::Index componentCount() const { return component_shapes.rows(); }
  /// Lip opening in mm of one unit of each component.
  [[nodiscard]] Eigen::VectorXd openings() const;
};

/// Throws InputError, with `file` in front, for JSON that is no actor model or contradicts itself.
ActorModel parseActorModel(std::string_view json_text, std::string_view file);
std::string actorModelToJson(const ActorModel& model);

/// The actor of the sample corpus (sample_data/actor/grid_s1_actor.json, built in).
const ActorModel& sampleActor();

}  // namespace mouthpiece
