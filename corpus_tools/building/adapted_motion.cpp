#include "corpus_tools/building/adapted_motion.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "corpus_tools/building/build_state.h"
#include "corpus_tools/takes/pose_fit.h"

namespace mouthpiece {

Placing::Placing(const Corpus& large, const Corpus& own) {
  const std::vector<std::string> names = large.layout.markerNames();
  for (const std::string& name : own.layout.markerNames()) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end() || names.size() != own.layout.markers.size())
      throw InputError(large.name, found == names.end() ? name : "",
                       fmt::format("has {} markers, {} has {}; expected the same ones", names.size(), own.name,
                                   own.layout.markers.size()));
    sources_.push_back(unsignedIndex(found - names.begin()));
  }
  const auto fit = fitPose(pickMarkers(large.neutral_pose_mm, sources_), own.neutral_pose_mm, PoseScale::kFree);
  if (!fit) throw InputError(large.name, "neutral pose", "cannot be laid over that of " + own.name);
  scale_ = fit->scale;
  turn_ = scale_ * fit->target_from_source.rotation.transpose();
}

MotionClip AdaptedMotion::load(TakeIndex take) const {
  if (take.value < own_.takes.size()) return motionOf(own_, take);
  const TakeIndex theirs(take.value - own_.takes.size());
  const MotionClip motion = motionOf(large_, theirs);
  const Eigen::Map<const Eigen::RowVectorXd> their_neutral(large_.neutral_pose_mm.data(),
                                                           large_.neutral_pose_mm.size());
  const Eigen::Map<const Eigen::RowVectorXd> own_neutral(own_.neutral_pose_mm.data(), own_.neutral_pose_mm.size());
  const Eigen::MatrixXd displacements = motion.positions_mm.rowwise() - their_neutral;
  const Eigen::MatrixXd moves = valuesOf(displacements, motion, large_.takes[theirs.value].labels) * change_;
  MotionClip mapped{motion.frame_rate_hz, own_.layout.markerNames(), placing_(displacements) + moves};
  mapped.positions_mm.rowwise() += own_neutral + shift_;
  roundToFile(mapped);
  return mapped;
}

AudioClip AdaptedMotion::loadAudio(TakeIndex take) const {
  if (take.value >= own_.takes.size()) return {large_.takes[take.value - own_.takes.size()].audio.sample_rate_hz, {}};
  return own_.take_source != nullptr ? own_.take_source->loadAudio(take) : own_.takes[take.value].audio;
}

Eigen::MatrixXd AdaptedMotion::valuesOf(const Eigen::MatrixXd& displacements, const MotionClip& motion,
                                        const SpeechLabels& labels) const {
  const TrajectoryModel& model = *large_.trajectory_model;
  Eigen::MatrixXd values = displacements.array().isFinite().select(displacements, 0.0) * model.analysis;
  const auto speaks = (model.analysis.array() != 0).rowwise().any().eval();
  std::vector<Seconds> times;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    if ((displacements.row(row).transpose().array().isFinite() || !speaks).all()) continue;
    rows.push_back(row);
    times.push_back(asReal(row) / motion.frame_rate_hz);
  }
  if (!rows.empty()) values(rows, Eigen::all) = model.predict(labels, times);
  return values;
}

}  // namespace mouthpiece
