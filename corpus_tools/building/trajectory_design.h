#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "units/corpus.h"
#include "units/trajectory_model.h"

namespace mouthpiece {

/// What the parts of fitTrajectoryModel() share.

/// How much each column of the motion counts as speech: lips most, the upper face not at all.
struct SpeechColumns {
  Eigen::VectorXd weights;
  double lip_norm = 0;  ///< so that lips which move alone by 1 mm give a component vector of length 1
  std::optional<std::pair<Eigen::Index, Eigen::Index>> lip_pair;  ///< x columns of LIP_UP_MID and LIP_LO_MID
};
SpeechColumns speechColumns(const Corpus& corpus);

/// A take as the fit sees it.
struct FitTake {
  std::size_t index = 0;          ///< in the corpus
  std::vector<Seconds> times;     ///< of its rows: the capture, thinned
  Eigen::VectorXd seen;           ///< 1 where all speaking markers are, else 0
  Eigen::MatrixXf displacements;  ///< from the take's mean, mm; zero where not seen
  Eigen::RowVectorXd mean;        ///< that mean less the neutral pose
  Eigen::VectorXd openings;       ///< LIP_UP_MID to LIP_LO_MID, mm; 0 where not seen

  /// Within 20 ms of `span`; infinite when none was seen.
  [[nodiscard]] double tightestOpening(const TimeSpan& span) const;
};
/// Takes of which most frames are seen; of a large corpus every n-th, so that memory stays bounded.
std::vector<FitTake> fitTakes(const Corpus& corpus, const SpeechColumns& columns, double fit_rate_hz);

using SparseRow = std::vector<std::pair<Eigen::Index, double>>;

/// The features of all takes' segments, numbered.
class SegmentFeatures {
 public:
  SegmentFeatures(const Corpus& corpus, const std::vector<FitTake>& takes);
  [[nodiscard]] Eigen::Index count() const { return static_cast<Eigen::Index>(names_.size()); }
  [[nodiscard]] const std::string& name(Eigen::Index feature) const {
    return names_[static_cast<std::size_t>(feature)];
  }
  [[nodiscard]] const std::vector<SpeechSegment>& segments(std::size_t take) const { return segments_[take]; }
  [[nodiscard]] const std::vector<SparseRow>& shares(std::size_t take) const { return shares_[take]; }
  /// How far each target is held back: the rarer the kind of feature, the more.
  [[nodiscard]] Eigen::VectorXd ridgeFactors() const;

 private:
  std::vector<std::string> names_;
  std::vector<std::vector<SpeechSegment>> segments_;  ///< one list a take
  std::vector<std::vector<SparseRow>> shares_;        ///< of each segment
};

/// One take's rows of the least-squares problem: values = rows * targets, less each column's mean over the seen rows.
struct DesignRows {
  std::vector<SparseRow> rows;
  Eigen::VectorXd seen;  ///< 1 or 0
  Eigen::VectorXd mean;

  /// Zero where not seen.
  [[nodiscard]] Eigen::MatrixXd times(const Eigen::MatrixXd& targets) const;
};
DesignRows designRows(const FitTake& take, const SegmentFeatures& features, std::size_t take_number,
                      const ComponentDynamics& dynamics);

/// A few dozen of a thousand features are at work at any time: sums over pairs of those only.
class NormalEquations {
 public:
  NormalEquations(Eigen::Index features, Eigen::Index components);
  void add(const DesignRows& design, const Eigen::MatrixXd& values);
  /// Targets, features x components.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::VectorXd& ridge) const;

 private:
  Eigen::MatrixXd normal_;  ///< lower triangle
  Eigen::MatrixXd right_;
};

}  // namespace mouthpiece
