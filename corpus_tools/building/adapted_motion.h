#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "base/index.h"
#include "units/file/corpus.h"
#include "units/prediction/trajectory_model.h"

namespace mouthpiece {

/// Another's markers in the person's order, size and axes.
class Placing {
 public:
  /// Throws InputError where the two have not the same markers, or their neutral poses cannot be laid over each other.
  Placing(const Corpus& large, const Corpus& own);

  /// Rows of displacements, 3 * markers wide.
  template <typename Rows>
  [[nodiscard]] Eigen::MatrixXd operator()(const Eigen::MatrixBase<Rows>& rows) const {
    Eigen::MatrixXd placed(rows.rows(), rows.cols());
    for (std::size_t i = 0; i < sources_.size(); ++i)
      placed.middleCols(signedIndex(3 * i), 3) = rows.middleCols(signedIndex(3 * sources_[i]), 3) * turn_;
    return placed;
  }
  [[nodiscard]] double scale() const { return scale_; }

 private:
  std::vector<std::size_t> sources_;  ///< the other's marker for each of the person's
  Eigen::Matrix3d turn_;              ///< on rows, with the size
  double scale_ = 1;
};

/// The person's takes, then the other's as the person would have moved.
class AdaptedMotion final : public TakeSource {
 public:
  /// `base`: the large corpus' model, placed; `model`: this person's. Refers to both corpora.
  AdaptedMotion(const Corpus& large, const Corpus& own, const Placing& placing, const TrajectoryModel& base,
                const TrajectoryModel& model)
      : large_(large),
        own_(own),
        placing_(placing),
        change_(model.shapes - base.shapes),
        shift_((model.level - base.level) * model.shapes) {}

  [[nodiscard]] MotionClip load(TakeIndex take) const override;
  [[nodiscard]] AudioClip loadAudio(TakeIndex take) const override;

 private:
  /// Components, as captured; as predicted where a speaking marker was not seen.
  [[nodiscard]] Eigen::MatrixXd valuesOf(const Eigen::MatrixXd& displacements, const MotionClip& motion,
                                         const SpeechLabels& labels) const;

  const Corpus &large_, &own_;
  Placing placing_;
  Eigen::MatrixXd change_;    ///< of the shapes, from the other's, placed
  Eigen::RowVectorXd shift_;  ///< of the level
};

}  // namespace mouthpiece
