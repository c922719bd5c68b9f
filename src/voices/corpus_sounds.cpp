#include "voices/corpus_voice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr Seconds kStep = 0.005;
constexpr double kEdge = 0.15;         // of a phone: no cut nearer to its ends
constexpr double kMostSlip = 0.25;     // of a phone: between the places of the two cuts
constexpr float kCepstralUnit = 0.7F;  // distance of neighbouring frames 5 ms apart, about (GRID s1: median)

/// What the faces of two phones differ by at a place of each (its share of the phone), in the first components; none
/// without a trajectory model.
class FaceDifference {
 public:
  FaceDifference(const UnitDatabase& database, const PhonePlace& left, const PhonePlace& right) {
    if (database.corpus().trajectory_model == nullptr) return;
    const auto left_over = [&](const PhonePlace& place) -> Eigen::RowVectorXf {
      const PhoneShape shape = database.shapeOf(place);
      return shape.captured() - shape.predicted();
    };
    left_ = left_over(left);
    right_ = left_over(right);
    components_ = left_.size() / PhoneShapes::kPoints;
  }

  [[nodiscard]] double mmAt(double share_left, double share_right) const {
    if (components_ == 0) return 0;
    const float apart = (at(left_, share_left) - at(right_, share_right)).norm();
    return std::isfinite(apart) ? apart : 0;
  }

 private:
  [[nodiscard]] Eigen::RowVectorXf at(const Eigen::RowVectorXf& points, double share) const {
    const auto last = asReal(PhoneShapes::kPoints - 1);
    const double place = std::clamp(share * asReal(PhoneShapes::kPoints) - 0.5, 0.0, last);
    const auto first = static_cast<Eigen::Index>(place);
    const Eigen::Index second = std::min<Eigen::Index>(first + 1, PhoneShapes::kPoints - 1);
    const auto part = asFloat(place - asReal(first));
    return (1 - part) * points.segment(first * components_, components_) +
           part * points.segment(second * components_, components_);
  }

  Eigen::RowVectorXf left_, right_;
  Eigen::Index components_ = 0;
};

}  // namespace

struct CorpusSounds::Recording {
  MarkedSound sound;
  SpectralFrames frames;
};

CorpusSounds::CorpusSounds(const UnitDatabase& database)
    : database_(database), weights_(database.corpus().sound_cut_weights) {}
CorpusSounds::~CorpusSounds() = default;

void CorpusSounds::setWeights(const SoundCutWeights& weights) {
  weights_ = weights;
  cuts_.clear();
}

CorpusSounds::Recording& CorpusSounds::recordingOf(TakeIndex take) {
  std::unique_ptr<Recording>& recording = recordings_[take.value];
  if (recording) return *recording;
  const Corpus& corpus = database_.corpus();
  const CorpusTake& from = database_.takeOf(take);
  AudioClip audio = from.audio;
  if (audio.samples.empty() && corpus.take_source) audio = corpus.take_source->loadAudio(take);
  if (audio.samples.empty() || audio.sample_rate_hz <= 0) {
    throw InputError(corpus.name, "take " + from.name, "found no sound; expected a recording to speak with");
  }
  if (sample_rate_hz_ == 0) sample_rate_hz_ = audio.sample_rate_hz;
  if (audio.sample_rate_hz != sample_rate_hz_) audio = resampleAudio(audio, sample_rate_hz_);
  recording = std::make_unique<Recording>();
  recording->frames = spectralFrames(audio, kStep);
  recording->sound = markSound(std::move(audio));
  return *recording;
}

const MarkedSound& CorpusSounds::soundOf(TakeIndex take) { return recordingOf(take).sound; }

SoundCut CorpusSounds::cut(const PhonePlace& left, const PhonePlace& right) {
  const auto known = cuts_.find({left, right});
  if (known != cuts_.end()) return known->second;
  const Recording &a = recordingOf(left.take), &b = recordingOf(right.take);
  const TimeSpan span_a = database_.phoneAt(left).span, span_b = database_.phoneAt(right).span;
  const auto places = [](const TimeSpan& span) {
    const auto count = static_cast<int>(std::max(1.0, std::ceil((1 - 2 * kEdge) * span.duration() / kStep)));
    std::vector<double> shares;
    for (int i = 0; i <= count; ++i) shares.push_back(kEdge + (1 - 2 * kEdge) * i / count);
    return shares;
  };
  const std::vector<double> shares_a = places(span_a), shares_b = places(span_b);
  const auto timeAt = [](const TimeSpan& span, double share) { return span.start + share * span.duration(); };
  float quietest = 0;
  for (const double share : shares_a) {
    quietest = std::min(quietest, a.frames.level_db(a.frames.rowAt(timeAt(span_a, share))));
  }
  const FaceDifference faces(database_, left, right);
  SoundCut best{span_a.middle(), span_b.middle(), INFINITY};
  for (const double share_a : shares_a) {
    const Seconds time_a = timeAt(span_a, share_a);
    const Eigen::Index row_a = a.frames.rowAt(time_a);
    const double hz_a = a.sound.pitch.hzAt(time_a);
    for (const double share_b : shares_b) {
      if (std::abs(share_a - share_b) > kMostSlip) continue;
      const Seconds time_b = timeAt(span_b, share_b);
      const Eigen::Index row_b = b.frames.rowAt(time_b);
      const double hz_b = b.sound.pitch.hzAt(time_b);
      // The first coefficient is the level, which has a term of its own.
      const float spectral = (a.frames.mfcc.row(row_a) - b.frames.mfcc.row(row_b)).tail<12>().norm() / kCepstralUnit;
      const double level = std::abs(a.frames.level_db(row_a) - b.frames.level_db(row_b));
      double cost = weights_.spectral * spectral + weights_.level_per_db * level +
                    weights_.slip * std::abs(share_a - share_b) + weights_.lip_per_mm * faces.mmAt(share_a, share_b) +
                    weights_.loud_per_db * (a.frames.level_db(row_a) - quietest);
      if (hz_a > 0 && hz_b > 0) {
        cost += weights_.per_octave * std::abs(std::log2(hz_a / hz_b));
      } else if ((hz_a > 0) != (hz_b > 0)) {
        cost += weights_.voicing;
      }
      if (cost < best.cost) best = {time_a, time_b, cost};
    }
  }
  return cuts_[{left, right}] = best;
}

}  // namespace mouthpiece
