#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "units/prediction/context_network.h"
#include "units/prediction/sound_model.h"
#include "units/prediction/speech_segments.h"

namespace mouthpiece {

/// How fast a component moves towards its targets (movementStep).
struct ComponentDynamics {
  Seconds time_constant = 0.025;
  Seconds lead = 0;  ///< the middle of a movement comes this long before the phone's boundary
};

/// What a speaker's face does when it says something, predicted from labels alone: principal components of the speaking
/// face, each moving with critically damped steps towards targets that are sums over the features of a phone and its
/// neighbours (docs/theory/units/prediction.md). Fitted to the corpus when it is built
/// (corpus_tools/building/trajectory_fit.h) and kept in its file. Component values are in mm: as far as lips that move
/// alone move in the root mean square.
struct TrajectoryModel {
  Eigen::MatrixXd analysis;  ///< (3 * markers) x components: values = (pose - neutral) * analysis
  Eigen::MatrixXd shapes;    ///< components x (3 * markers), mm: what the markers do with a component
  std::vector<ComponentDynamics> dynamics;
  Eigen::RowVectorXd level;                        ///< about which the components move
  std::map<std::string, Eigen::VectorXd> targets;  ///< contribution of each feature to the components
  std::vector<ContextNetwork> networks;            ///< their mean is the other part of the prediction; may be none
  Eigen::RowVectorXd network_share;  ///< 0 to 1 a component; as many as components where there are networks
  double gain = 1;                   ///< brings back the variance that least squares takes
  Eigen::RowVectorXd closing;        ///< 3 * markers, mm: the lips' way when LIP_UP_MID and LIP_LO_MID part by 1 mm
  SilenceTiming silence;             ///< when it opens and settles
  SoundModel sound;                  ///< what a recording adds; may be empty
  double closed_opening_mm = 0;  ///< their median distance in B P M at the tightest; 0: the layout has no such markers

  [[nodiscard]] Eigen::Index componentCount() const { return shapes.rows(); }
  [[nodiscard]] Eigen::Index columnCount() const { return shapes.cols(); }

  /// LinePrediction::at(), for one use.
  [[nodiscard]] Eigen::MatrixXd predict(const SpeechLabels& labels, std::span<const Seconds> times) const;
};

/// The prediction for one line or take. Refers to the model.
class LinePrediction {
 public:
  /// What its networks make of the labels (some 80 kB a second each) is kept for all moments that will be asked for;
  /// or, where few will be, is made for each call anew, some thousands of moments at a time.
  enum class Keeps { kAll, kNothing };
  LinePrediction(const TrajectoryModel& model, const SpeechLabels& labels, Keeps keeps = Keeps::kAll);
  /// times x components, not amplified by the gain. Features that the model does not know add nothing.
  [[nodiscard]] Eigen::MatrixXd at(std::span<const Seconds> times) const;

 private:
  [[nodiscard]] Eigen::MatrixXd byNetworks(std::span<const Seconds> times) const;

  const TrajectoryModel* model_;
  std::vector<SpeechSegment> segments_;
  Eigen::MatrixXd targets_;  ///< segments x components
  std::vector<ContextSegment> context_;
  std::vector<ContextNetwork::Matrix> given_;  ///< by each network; none where nothing is kept
};

/// The segments of speechSegments(), each with the logarithm of its length as two more features (of its viseme and of
/// its phone): short vowels do not reach as far as long ones.
std::vector<SpeechSegment> predictionSegments(const SpeechLabels& labels, const SilenceTiming& timing = {});

}  // namespace mouthpiece
