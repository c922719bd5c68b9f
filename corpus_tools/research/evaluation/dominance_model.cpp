// DominanceModel of evaluation_methods.h.
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"
#include "corpus_tools/takes/lip_measures.h"

namespace mouthpiece {
namespace {

/// Enough takes to tell the grid's points apart; more only cost time.
constexpr std::size_t kTrainingTakes = 24;
constexpr std::array<double, 3> kPowers = {1.0, 1.5, 2.0};
/// D falls to 1/e this far from the phone's middle.
constexpr std::array<Seconds, 7> kReaches = {0.02, 0.03, 0.045, 0.065, 0.09, 0.12, 0.16};
constexpr std::array<double, 6> kMagnitudes = {0.25, 0.5, 1.0, 2.0, 4.0, 8.0};
constexpr int kMagnitudeRounds = 2;

/// The frame nearest to the middle of each phone, averaged; a phone that never occurs takes the overall mean.
std::array<Eigen::RowVectorXd, kPhoneCount> meanPoses(const Corpus& corpus) {
  const auto width = signedIndex(3 * corpus.layout.markers.size());
  std::array<Eigen::RowVectorXd, kPhoneCount> sums;
  sums.fill(Eigen::RowVectorXd::Zero(width));
  std::array<double, kPhoneCount> counts{};
  for (const CorpusTake& take : corpus.takes) {
    for (const LabelledPhone& phone : take.labels.phones) {
      const auto frame = signedIndex(std::lround(phone.span.middle() * take.motion.frame_rate_hz));
      if (frame >= take.motion.positions_mm.rows() || !take.motion.positions_mm.row(frame).allFinite()) continue;
      sums[static_cast<std::size_t>(phone.phone)] += take.motion.positions_mm.row(frame);
      counts[static_cast<std::size_t>(phone.phone)] += 1;
    }
  }
  const Eigen::RowVectorXd neutral =
      Eigen::Map<const Eigen::RowVectorXd>(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  for (std::size_t phone = 0; phone < kPhoneCount; ++phone) {
    if (counts[phone] > 0) sums[phone] /= counts[phone];
    if (counts[phone] <= 0) sums[phone] = neutral;
  }
  return sums;
}

}  // namespace

DominanceModel::Kind DominanceModel::kindOf(Phone phone) {
  if (phone == Phone::kSil) return Kind::kSilence;
  if (isBilabial(phone)) return Kind::kBilabial;
  if (isLabiodental(phone)) return Kind::kLabiodental;
  const VisemeRow& viseme = rowOf(firstViseme(phone));
  if (viseme.sibilant) return Kind::kSibilant;
  constexpr double kRounded = 0.7;
  if (viseme.round >= kRounded) return Kind::kRounded;
  return isVowel(phone) ? Kind::kVowel : Kind::kOther;
}

MotionClip DominanceModel::animate(const SpeechLabels& labels, double frame_rate_hz, std::size_t frames) const {
  MotionClip clip{frame_rate_hz, marker_names_, {}};
  clip.positions_mm.resize(signedIndex(frames), signedIndex(3 * marker_names_.size()));
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const Seconds time = clip.timeOf(FrameIndex(frame));
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(clip.positions_mm.cols());
    double total = 0;
    for (const LabelledPhone& phone : labels.phones) {
      // A long silence holds its target to its edge; a middle alone would let go of it.
      const Seconds away = phone.phone == Phone::kSil ? std::max({0.0, phone.span.start - time, time - phone.span.end})
                                                      : std::abs(time - phone.span.middle());
      const double dominance = parameters_.magnitude[static_cast<std::size_t>(kindOf(phone.phone))] *
                               std::exp(-parameters_.rate * std::pow(away, parameters_.power));
      sum += dominance * targets_[static_cast<std::size_t>(phone.phone)];
      total += dominance;
    }
    // Far from every phone all dominances underflow; the mouth rests there.
    clip.positions_mm.row(signedIndex(frame)) =
        total > 0 ? Eigen::RowVectorXd(sum / total) : targets_[static_cast<std::size_t>(Phone::kSil)];
  }
  return clip;
}

DominanceModel DominanceModel::fit(const Corpus& corpus) {
  MOUTHPIECE_EXPECT(!corpus.takes.empty());
  DominanceModel model;
  model.marker_names_ = corpus.layout.markerNames();
  model.targets_ = meanPoses(corpus);
  const std::size_t step = std::max<std::size_t>(1, corpus.takes.size() / kTrainingTakes);
  const auto error_of = [&](const Parameters& parameters) {
    DominanceModel candidate = model;
    candidate.parameters_ = parameters;
    LipMeasures sum;
    for (std::size_t take = 0; take < corpus.takes.size(); take += step) {
      const CorpusTake& known = corpus.takes[take];
      const MotionClip made = candidate.animate(known.labels, known.motion.frame_rate_hz, known.motion.frameCount());
      sum += measureLips(known.motion, made, known.labels, corpus.layout);
    }
    return sum.lipRms();
  };
  double least = std::numeric_limits<double>::infinity();
  const auto keep_if_better = [&](const Parameters& parameters) {
    if (const double error = error_of(parameters); error < least) {
      least = error;
      model.parameters_ = parameters;
    }
  };
  for (const double power : kPowers) {
    for (const Seconds reach : kReaches) {
      Parameters parameters;
      parameters.power = power;
      parameters.rate = std::pow(reach, -power);
      keep_if_better(parameters);
    }
  }
  for (int round = 0; round < kMagnitudeRounds; ++round) {
    for (std::size_t kind = 0; kind < kKindCount; ++kind) {
      const Parameters before = model.parameters_;
      for (const double magnitude : kMagnitudes) {
        Parameters parameters = before;
        parameters.magnitude[kind] = magnitude;
        keep_if_better(parameters);
      }
    }
  }
  return model;
}

}  // namespace mouthpiece
