#include "corpus_tools/research/models/actor_fit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/errors.h"
#include "base/matrix_solvers.h"
#include "base/parallel_for.h"
#include "base/statistics.h"
#include "corpus_tools/takes/head_tracking.h"
#include "corpus_tools/takes/pose_fit.h"
#include "corpus_tools/takes/take_files.h"
#include "corpus_tools/takes/take_poses.h"
#include "units/prediction/speech_segments.h"

namespace mouthpiece {
namespace {

// Searched for each component; the error is flat around the best (docs/theory/corpus_tools/actor_model.md).
constexpr Seconds kTimeConstants[] = {0.014, 0.018, 0.022, 0.028, 0.036};
constexpr Seconds kLeads[] = {-0.015, 0.0, 0.015};
constexpr int kGainRounds = 3;          ///< closures and gains depend on each other; it settles at once
constexpr std::size_t kSearchFold = 4;  ///< every fourth take judges the search

/// How far a contribution is held back, by kind of feature, relative to ActorFitOptions::ridge: the rarer the kind, the
/// more. From a search on the capture with whole words left out.
double ridgeFactor(const std::string& feature) {
  if (feature.starts_with("viseme ") || feature.starts_with("silence ")) return 0.05;
  if (feature.starts_with("phone ")) return 1;
  return feature.starts_with("left2 ") || feature.starts_with("right2 ") ? 6 : 3;
}

/// The features of all takes, numbered, and the segments that have them.
struct Features {
  std::vector<std::string> names;
  std::vector<std::vector<SpeechSegment>> segments;  ///< one list a take
  std::vector<Eigen::MatrixXd> shares;               ///< one a take: segments x features

  [[nodiscard]] Eigen::Index count() const { return signedIndex(names.size()); }
};

Features numberFeatures(const std::vector<CorpusTake>& takes) {
  Features features;
  std::map<std::string, Eigen::Index> numbers;
  for (const CorpusTake& take : takes) {
    features.segments.push_back(speechSegments(take.labels));
    for (const SpeechSegment& segment : features.segments.back()) {
      for (const SegmentFeature& feature : segment.features) {
        if (numbers.try_emplace(feature.name, features.count()).second) features.names.push_back(feature.name);
      }
    }
  }
  for (const std::vector<SpeechSegment>& segments : features.segments) {
    Eigen::MatrixXd shares = Eigen::MatrixXd::Zero(signedIndex(segments.size()), features.count());
    for (std::size_t i = 0; i < segments.size(); ++i) {
      for (const SegmentFeature& feature : segments[i].features) {
        shares(signedIndex(i), numbers.at(feature.name)) += feature.weight;
      }
    }
    features.shares.push_back(std::move(shares));
  }
  return features;
}

/// The least-squares problem: trajectories = (weights * shares) * targets, up to a constant of each take.
class TargetFit {
 public:
  TargetFit(const ActorCapture& capture, const std::vector<ActorDisplacements>& takes, const ActorBasis& basis,
            const Features& features)
      : capture_(capture), takes_(takes), basis_(basis), features_(features) {}

  /// Rows of one take; frames that do not count are zero, each column has mean zero over those that do.
  [[nodiscard]] Eigen::MatrixXd design(std::size_t take, const ActorDynamics& dynamics) const {
    const MotionClip& motion = capture_.takes[take].motion;
    return centred(segmentWeights(features_.segments[take], dynamics.time_constant, dynamics.lead, motion.frame_rate_hz,
                                  motion.frameCount()) *
                       features_.shares[take],
                   take);
  }
  [[nodiscard]] Eigen::MatrixXd captured(std::size_t take) const { return centred(basis_.trajectories[take], take); }

  /// Targets, features x components, from the takes that `use` names.
  [[nodiscard]] Eigen::MatrixXd solve(const ActorDynamics& dynamics, double ridge,
                                      const std::vector<std::size_t>& use) const {
    const Eigen::Index count = features_.count();
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(count, basis_.shapes.rows());
    for (const std::size_t take : use) {
      const Eigen::MatrixXd rows = design(take, dynamics);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
      right += rows.transpose() * captured(take);
    }
    for (Eigen::Index i = 0; i < count; ++i) {
      normal(i, i) += ridge * ridgeFactor(features_.names[unsignedIndex(i)]);
    }
    return solveSymmetric(std::move(normal), right);
  }

  /// Squared error of each component over `judges`.
  [[nodiscard]] Eigen::RowVectorXd errors(const ActorDynamics& dynamics, const Eigen::MatrixXd& targets,
                                          const std::vector<std::size_t>& judges) const {
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(targets.cols());
    for (const std::size_t take : judges) {
      sum += (captured(take) - design(take, dynamics) * targets).colwise().squaredNorm();
    }
    return sum;
  }

 private:
  [[nodiscard]] Eigen::MatrixXd centred(Eigen::MatrixXd rows, std::size_t take) const {
    const Eigen::VectorXd& seen = takes_[take].seen;
    const Eigen::RowVectorXd mean = seen.transpose() * rows / std::max(1.0, seen.sum());
    rows.rowwise() -= mean;
    return seen.asDiagonal() * rows;
  }

  const ActorCapture& capture_;
  const std::vector<ActorDisplacements>& takes_;
  const ActorBasis& basis_;
  const Features& features_;
};

/// The time constant and lead of each component with the least error on the takes left out of the search.
std::vector<ActorDynamics> searchDynamics(const TargetFit& fit, std::size_t take_count, Eigen::Index components,
                                          double ridge) {
  std::vector<std::size_t> use, judges;
  for (std::size_t take = 0; take < take_count; ++take) (take % kSearchFold == 0 ? judges : use).push_back(take);
  std::vector<ActorDynamics> candidates;
  for (const Seconds time_constant : kTimeConstants) {
    for (const Seconds lead : kLeads) candidates.push_back({time_constant, lead});
  }
  std::vector<Eigen::RowVectorXd> errors(candidates.size());
  parallelFor(candidates.size(), [&](std::size_t i) {
    errors[i] = fit.errors(candidates[i], fit.solve(candidates[i], ridge, use), judges);
  });
  std::vector<ActorDynamics> best;
  for (Eigen::Index component = 0; component < components; ++component) {
    const auto least = std::min_element(errors.begin(), errors.end(),
                                        [&](const auto& a, const auto& b) { return a(component) < b(component); });
    best.push_back(candidates[unsignedIndex(least - errors.begin())]);
  }
  return best;
}

void fitTargets(const TargetFit& fit, const Features& features, double ridge, std::size_t take_count,
                ActorModel& model) {
  std::vector<std::size_t> all(take_count);
  for (std::size_t take = 0; take < take_count; ++take) all[take] = take;
  for (const std::string& name : features.names) model.targets[name] = Eigen::VectorXd::Zero(model.componentCount());
  std::vector<bool> solved(model.dynamics.size(), false);
  for (std::size_t first = 0; first < model.dynamics.size(); ++first) {
    if (solved[first]) continue;
    const Eigen::MatrixXd targets = fit.solve(model.dynamics[first], ridge, all);
    for (std::size_t i = first; i < model.dynamics.size(); ++i) {
      if (model.dynamics[i].time_constant != model.dynamics[first].time_constant ||
          model.dynamics[i].lead != model.dynamics[first].lead) {
        continue;
      }
      solved[i] = true;
      for (Eigen::Index f = 0; f < features.count(); ++f) {
        const auto component = signedIndex(i);
        model.targets[features.names[unsignedIndex(f)]](component) = targets(f, component);
      }
    }
  }
}

/// Captured and performed components in speech, frames x components; each take's capture moved to the performance's
/// mean.
struct SpeechFrames {
  Eigen::MatrixXd captured, performed;
  std::vector<double> labiodental_openings_mm;
};

SpeechFrames speechFrames(const ActorModel& model, const ActorCapture& capture,
                          const std::vector<ActorDisplacements>& takes, const ActorBasis& basis, bool close_lips) {
  SpeechFrames frames;
  std::vector<Eigen::RowVectorXd> captured_rows, performed_rows;
  const Eigen::VectorXd openings = model.openings();
  for (std::size_t take = 0; take < takes.size(); ++take) {
    const MotionClip& motion = capture.takes[take].motion;
    const Eigen::MatrixXd performed = actorComponents(
        model, capture.takes[take].labels,
        {.frame_rate_hz = motion.frame_rate_hz, .frame_count = motion.frameCount(), .close_lips = close_lips});
    const Eigen::VectorXd& seen = takes[take].seen;
    Eigen::MatrixXd captured = basis.trajectories[take];
    const Eigen::RowVectorXd offset = seen.transpose() * (performed - captured) / std::max(1.0, seen.sum());
    captured.rowwise() += offset;
    for (Eigen::Index frame = 0; frame < captured.rows(); ++frame) {
      if (!(takes[take].speech(frame) > 0)) continue;
      captured_rows.emplace_back(captured.row(frame));
      performed_rows.emplace_back(performed.row(frame));
    }
    for (const LabelledPhone& phone : capture.takes[take].labels.phones) {
      if (!isLabiodental(phone.phone)) continue;
      double least = 1e9;
      for (Eigen::Index frame = 0; frame < captured.rows(); ++frame) {
        const Seconds time = asReal(frame) / motion.frame_rate_hz;
        if (time < phone.span.start - 0.04 || time > phone.span.end || !(seen(frame) > 0)) continue;
        least = std::min(least, captured.row(frame).dot(openings));
      }
      if (least < 1e9) frames.labiodental_openings_mm.push_back(least);
    }
  }
  const auto rows = signedIndex(captured_rows.size());
  frames.captured.resize(rows, model.componentCount());
  frames.performed.resize(rows, model.componentCount());
  for (Eigen::Index row = 0; row < rows; ++row) {
    frames.captured.row(row) = captured_rows[unsignedIndex(row)];
    frames.performed.row(row) = performed_rows[unsignedIndex(row)];
  }
  return frames;
}

Eigen::MatrixXd centredRows(const Eigen::MatrixXd& rows) { return rows.rowwise() - rows.colwise().mean(); }

void fitClosures(const SpeechFrames& frames, ActorModel& model) {
  const Eigen::MatrixXd captured = centredRows(frames.captured);
  // The components that move with the lip opening, by regression on it.
  const Eigen::VectorXd with_opening = captured.transpose() * (captured * model.openings());
  model.closing = with_opening / model.openings().dot(with_opening);
  if (frames.labiodental_openings_mm.empty()) return;
  model.closures.labiodental_mm = std::clamp(median(frames.labiodental_openings_mm), 0.8, 3.0);
}

/// Makes the performance in speech, closures and all, vary as much as the capture.
void adjustGains(const SpeechFrames& frames, double largest_gain, ActorModel& model) {
  const Eigen::RowVectorXd captured = centredRows(frames.captured).colwise().squaredNorm();
  const Eigen::RowVectorXd performed = centredRows(frames.performed).colwise().squaredNorm().cwiseMax(1e-9);
  model.gain.array() *= (captured.array() / performed.array()).sqrt().transpose();
  model.gain = model.gain.cwiseMax(1.0).cwiseMin(largest_gain);
}

ActorCapture pickFold(const ActorCapture& capture, std::size_t fold_count, std::size_t fold, bool inside) {
  ActorCapture picked{capture.layout, capture.neutral_mm, {}};
  for (std::size_t take = 0; take < capture.takes.size(); ++take) {
    if ((take % fold_count == fold) == inside) picked.takes.push_back(capture.takes[take]);
  }
  return picked;
}

}  // namespace

ActorModel fitActor(const ActorCapture& capture, const ActorFitOptions& options) {
  if (capture.takes.size() < 2 * kSearchFold) {
    throw InputError("capture", "", "found " + std::to_string(capture.takes.size()) + " takes; expected at least 8");
  }
  const std::vector<ActorDisplacements> takes = actorDisplacements(capture);
  const ActorBasis basis = actorBasis(takes, capture.layout, options.components);
  const Features features = numberFeatures(capture.takes);
  const TargetFit fit(capture, takes, basis, features);

  ActorModel model;
  model.credit = options.credit;
  model.marker_names = capture.layout.markerNames();
  const Eigen::Map<const Eigen::RowVectorXd> neutral(capture.neutral_mm.data(), capture.neutral_mm.size());
  const Eigen::MatrixXd healthy = symmetrized(neutral, capture.layout);
  model.neutral_mm = Eigen::Map<const MarkerPositions>(healthy.data(), capture.neutral_mm.rows(), 3);
  model.component_shapes = basis.shapes;
  model.dynamics = searchDynamics(fit, takes.size(), options.components, options.ridge);
  model.gain = Eigen::VectorXd::Ones(options.components);
  model.speech_mean = model.closing = Eigen::VectorXd::Zero(options.components);
  fitTargets(fit, features, options.ridge, takes.size(), model);
  const SpeechFrames plain = speechFrames(model, capture, takes, basis, false);
  model.speech_mean = plain.performed.colwise().mean().transpose();
  fitClosures(plain, model);
  for (int round = 0; round < kGainRounds; ++round) {
    adjustGains(speechFrames(model, capture, takes, basis, true), options.largest_gain, model);
  }
  model.blink_shape = blinkShape(takes, capture.layout);
  model.brow_shape = browShape(takes, capture.layout);
  return model;
}

LipMeasures scoreActor(const ActorModel& model, const ActorCapture& capture, ActorOptions options) {
  LipMeasures measures;
  for (const CorpusTake& take : capture.takes) {
    options.frame_rate_hz = take.motion.frame_rate_hz;
    options.frame_count = take.motion.frameCount();
    ++options.seed;
    measures += measureLips(take.motion, performSpeech(model, take.labels, options), take.labels, capture.layout);
  }
  return measures;
}

ActorCapture withoutFold(const ActorCapture& capture, std::size_t fold_count, std::size_t fold) {
  return pickFold(capture, fold_count, fold, false);
}

ActorCapture onlyFold(const ActorCapture& capture, std::size_t fold_count, std::size_t fold) {
  return pickFold(capture, fold_count, fold, true);
}

ActorCapture readActorCapture(const std::filesystem::path& folder, std::size_t stride) {
  ActorCapture capture{defaultLayout(), {}, {}};
  std::vector<RawTake> raw;
  const std::vector<TakeFiles> files = findTakes(folder).takes;
  for (std::size_t i = 0; i < files.size(); i += stride) raw.push_back(readTake(files[i], capture.layout, Lexicon()));

  const HeadReference reference = estimateHeadReference(raw, capture.layout);
  for (const RawTake& take : raw) {
    const HeadTrack track = trackHead(take, reference, capture.layout);
    capture.takes.push_back({take.name, take.text, take.labels, withoutHeadMotion(take.face, track), {}});
  }
  capture.neutral_mm = neutralPose(capture.takes, capture.layout).pose_mm;
  const RigidMotion face_from_head = faceFromHead(capture.neutral_mm, capture.layout);
  transform(capture.neutral_mm, face_from_head);
  for (CorpusTake& take : capture.takes) transform(take.motion, face_from_head);
  return capture;
}

}  // namespace mouthpiece
