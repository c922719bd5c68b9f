#include "units/prediction/trajectory_model.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace mouthpiece {
namespace {

constexpr Seconds kUsualLength = 0.080;  ///< at which a length is no feature
constexpr Seconds kShortestLength = 0.005;

bool sameDynamics(const ComponentDynamics& a, const ComponentDynamics& b) {
  return a.time_constant == b.time_constant && a.lead == b.lead;
}

}  // namespace

std::vector<SpeechSegment> predictionSegments(const SpeechLabels& labels, const SilenceTiming& timing) {
  std::vector<SpeechSegment> segments = speechSegments(labels, timing);
  for (SpeechSegment& segment : segments) {
    if (!segment.in_speech) continue;
    const double length = std::log(std::max(kShortestLength, segment.span.duration()) / kUsualLength);
    std::vector<SegmentFeature> lengths;
    for (const SegmentFeature& feature : segment.features) {
      if (feature.name.starts_with("viseme ") || feature.name.starts_with("phone ")) {
        lengths.push_back({"length " + feature.name, feature.weight * length});
      }
    }
    segment.features.insert(segment.features.end(), lengths.begin(), lengths.end());
  }
  return segments;
}

LinePrediction::LinePrediction(const TrajectoryModel& model, const SpeechLabels& labels, Keeps keeps)
    : model_(&model), segments_(predictionSegments(labels, model.silence)) {
  targets_ = Eigen::MatrixXd::Zero(signedIndex(segments_.size()), model.componentCount());
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    for (const SegmentFeature& feature : segments_[i].features) {
      const auto known = model.targets.find(feature.name);
      if (known == model.targets.end()) continue;
      targets_.row(signedIndex(i)) += feature.weight * known->second.transpose();
    }
    segments_[i].features = {};  // their names would take more than all else here
  }
  if (model.networks.empty()) return;
  context_ = contextSegments(labels, model.silence);
  if (keeps == Keeps::kNothing) return;
  for (const ContextNetwork& network : model.networks) given_.push_back(network.given(context_));
}

Eigen::MatrixXd LinePrediction::byNetworks(std::span<const Seconds> times) const {
  std::vector<ContextSegment> near;
  if (given_.empty() && !times.empty()) {
    const auto ends = std::minmax_element(times.begin(), times.end());
    const TimeSpan seen{*ends.first - kContextReach, *ends.second + kContextReach};
    std::copy_if(context_.begin(), context_.end(), std::back_inserter(near), [&](const ContextSegment& segment) {
      return segment.span.end >= seen.start && segment.span.start <= seen.end;
    });
  }
  const ContextView view = contextView(given_.empty() ? near : context_, times);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(signedIndex(times.size()), model_->componentCount());
  for (std::size_t i = 0; i < model_->networks.size(); ++i) {
    const ContextNetwork& network = model_->networks[i];
    sum += given_.empty() ? network.at(view, network.given(near)) : network.at(view, given_[i]);
  }
  return sum / asReal(model_->networks.size());
}

Eigen::MatrixXd LinePrediction::at(std::span<const Seconds> times) const {
  constexpr std::size_t kAtOnce = 8192;
  if (given_.empty() && times.size() > kAtOnce) {
    Eigen::MatrixXd values(std::ssize(times), model_->componentCount());
    for (std::size_t first = 0; first < times.size(); first += kAtOnce) {
      const std::span<const Seconds> part = times.subspan(first, std::min(kAtOnce, times.size() - first));
      values.middleRows(signedIndex(first), std::ssize(part)) = at(part);
    }
    return values;
  }
  const std::vector<ComponentDynamics>& dynamics = model_->dynamics;
  Eigen::MatrixXd values(signedIndex(times.size()), model_->componentCount());
  std::vector<bool> done(dynamics.size(), false);
  for (std::size_t first = 0; first < dynamics.size(); ++first) {
    if (done[first]) continue;
    std::vector<Eigen::Index> columns;
    for (std::size_t i = first; i < dynamics.size(); ++i) {
      if (!sameDynamics(dynamics[first], dynamics[i])) continue;
      done[i] = true;
      columns.push_back(signedIndex(i));
    }
    const Eigen::MatrixXd targets = targets_(Eigen::all, columns);
    values(Eigen::all, columns) =
        segmentResponse(segments_, dynamics[first].time_constant, dynamics[first].lead, times, targets);
  }
  if (!model_->networks.empty()) values += (byNetworks(times) - values) * model_->network_share.asDiagonal();
  values.rowwise() += model_->level;
  return values;
}

Eigen::MatrixXd TrajectoryModel::predict(const SpeechLabels& labels, std::span<const Seconds> times) const {
  return LinePrediction(*this, labels, LinePrediction::Keeps::kNothing).at(times);
}

}  // namespace mouthpiece
