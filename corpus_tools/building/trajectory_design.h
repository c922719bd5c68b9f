#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "motion/lip_gauge.h"
#include "units/file/corpus.h"
#include "units/prediction/trajectory_model.h"

namespace mouthpiece {

/// What the parts of fitTrajectoryModel() share.

/// How much each column of the motion counts as speech: lips most, the upper face not at all.
struct SpeechColumns {
  Eigen::VectorXd weights;
  double lip_norm = 0;  ///< so that lips which move alone by 1 mm give a component vector of length 1
  LipGauge lips;
};
SpeechColumns speechColumns(const Corpus& corpus);

/// A take as the fit sees it.
struct FitTake {
  std::size_t index = 0;          ///< in the corpus
  std::vector<Seconds> times;     ///< of its rows: the capture, thinned
  Eigen::VectorXd seen;           ///< 1 where all speaking markers are, else 0
  Eigen::MatrixXf displacements;  ///< from the take's mean, mm; zero where not seen
  Eigen::RowVectorXd mean;        ///< that mean less the neutral pose
  Eigen::VectorXd openings;       ///< of the outer lips, mm; 0 where not seen

  /// Within 20 ms of `span`; infinite when none was seen.
  [[nodiscard]] double tightestOpening(const TimeSpan& span) const;
};
/// Take `index`; nullopt when most of its frames are not seen.
std::optional<FitTake> fitTake(const Corpus& corpus, std::size_t index, const SpeechColumns& columns,
                               double fit_rate_hz);

/// Takes to keep in memory: all that can be used, or of a corpus with more than `most_frames` every n-th.
struct FitTakes {
  std::vector<FitTake> takes;
  bool are_all = true;
};
FitTakes fitTakes(const Corpus& corpus, const SpeechColumns& columns, double fit_rate_hz, double most_frames);

using SparseRow = std::vector<std::pair<Eigen::Index, double>>;

/// A take's segments, and the share of each feature in each of them.
struct TakeSegments {
  std::vector<SpeechSegment> segments;
  std::vector<SparseRow> shares;
};

/// The features of a corpus' segments, numbered.
class SegmentFeatures {
 public:
  /// `takes`: whose features there are. Of more features than `most` only those that most segments have.
  SegmentFeatures(const Corpus& corpus, const std::vector<std::size_t>& takes, std::size_t most,
                  const SilenceTiming& timing);
  [[nodiscard]] Eigen::Index count() const { return signedIndex(names_.size()); }
  [[nodiscard]] const std::string& name(Eigen::Index feature) const { return names_[unsignedIndex(feature)]; }
  [[nodiscard]] TakeSegments of(const SpeechLabels& labels) const;
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// How far each target is held back: the rarer the kind of feature, the more.
  [[nodiscard]] Eigen::VectorXd ridgeFactors() const;

 private:
  SilenceTiming timing_;
  std::vector<std::string> names_;
  std::unordered_map<std::string, Eigen::Index> numbers_;
};

/// One take's rows of the least-squares problem: values = rows * targets, less each column's mean over the seen rows.
struct DesignRows {
  std::vector<SparseRow> rows;
  Eigen::VectorXd seen;  ///< 1 or 0
  Eigen::VectorXd mean;

  /// Zero where not seen.
  [[nodiscard]] Eigen::MatrixXd times(const Eigen::MatrixXd& targets) const;
};
DesignRows designRows(const FitTake& take, const TakeSegments& segments, Eigen::Index features,
                      const ComponentDynamics& dynamics);

/// A few dozen of a thousand features are at work at any time: sums over pairs of those only.
class NormalEquations {
 public:
  NormalEquations(Eigen::Index features, Eigen::Index components);
  void add(const DesignRows& design, const Eigen::MatrixXd& values);
  /// Targets, features x components.
  /// `ridge`: the matrix that holds them back.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& ridge) const;

 private:
  Eigen::MatrixXd normal_;  ///< lower triangle
  Eigen::MatrixXd right_;
};

/// What brings back the variance that least squares takes: from the squares of what is predicted of takes left out, and
/// of what was captured.
double gainFor(double predicted, double captured);
/// Least squares says nothing about each take's own level: the mean over takes. The model's level is zero before.
void fitLevel(const std::vector<FitTake>& takes, const Corpus& corpus, TrajectoryModel& model);
/// The lips' way when they part, and how far apart they are in B P M; the model keeps the latter where none is said.
void fitClosing(const std::vector<FitTake>& takes, const Corpus& corpus, const SpeechColumns& columns,
                TrajectoryModel& model);

}  // namespace mouthpiece
