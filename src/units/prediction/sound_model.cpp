#include "units/prediction/sound_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "audio/spectral_frames.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr Seconds kHeardWithin = 0.035;
constexpr std::array<Seconds, 3> kLags{-0.06, 0, 0.06};
constexpr std::array<Seconds, 5> kLagsInSilence{-0.12, -0.06, 0, 0.06, 0.12};
static_assert(signedIndex(kLags.size() + kLagsInSilence.size()) * kSoundMeasures == kSoundFeatures);
constexpr double kNotBelieved = 3;  ///< departures whose mean square is so many times the widest usual one

std::vector<Phone> phonesOfRows(const SpeechLabels& labels, Eigen::Index rows) {
  std::vector<Phone> phones(unsignedIndex(rows), Phone::kSil);
  for (const LabelledPhone& phone : labels.phones) {
    const auto rowFrom = [&](Seconds time) {
      return std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::ceil(time / SoundMeasures::kStep)), 0, rows);
    };
    for (Eigen::Index row = rowFrom(phone.span.start); row < rowFrom(phone.span.end); ++row)
      phones[unsignedIndex(row)] = phone.phone;
  }
  return phones;
}

/// By a Gaussian of kHeardWithin; the ends are held. A column at a time: an hour's rows are 37 MB.
void smoothRows(Eigen::Ref<Eigen::MatrixXd> rows) {
  const auto reach = static_cast<Eigen::Index>(std::ceil(3 * kHeardWithin / SoundMeasures::kStep));
  const Eigen::Index last = rows.rows() - 1;
  for (Eigen::Index column = 0; column < rows.cols(); ++column) {
    const auto given = rows.col(column);
    Eigen::VectorXd smooth = Eigen::VectorXd::Zero(rows.rows());
    double sum = 0;
    for (Eigen::Index away = -reach; away <= reach; ++away) {
      const double u = asReal(away) * SoundMeasures::kStep / kHeardWithin, weight = std::exp(-0.5 * u * u);
      sum += weight;
      for (Eigen::Index row = 0; row <= last; ++row)
        smooth[row] += weight * given[std::clamp<Eigen::Index>(row + away, 0, last)];
    }
    rows.col(column) = smooth / sum;
  }
}

}  // namespace

SoundMeasures soundMeasures(const AudioClip& clip) {
  SoundMeasures measures;
  if (clip.samples.empty()) return measures;
  const SpectralFrames frames = spectralFrames(clip, SoundMeasures::kStep);
  measures.rows.resize(frames.mfcc.rows(), kSoundMeasures);
  measures.rows.col(0) = frames.level_db.cast<double>();
  measures.rows.rightCols(kSoundMeasures - 1) = frames.mfcc.rightCols(kSoundMeasures - 1).cast<double>();
  return measures;
}

SoundDeviations::SoundDeviations(SoundMeasures measures, const SpeechLabels& labels, const Eigen::MatrixXd& expected)
    : rows_(std::move(measures.rows)), silence_(rows_.rows()) {
  const std::vector<Phone> phones = phonesOfRows(labels, rows_.rows());
  std::array<Eigen::RowVectorXd, 2> sums{Eigen::RowVectorXd::Zero(kSoundMeasures),
                                         Eigen::RowVectorXd::Zero(kSoundMeasures)};
  std::array<double, 2> counts{0, 0};
  for (Eigen::Index row = 0; row < rows_.rows(); ++row) {
    const Phone phone = phones[unsignedIndex(row)];
    rows_.row(row) -= expected.row(static_cast<Eigen::Index>(phone));
    silence_(row) = phone == Phone::kSil ? 1 : 0;
    const std::size_t kind = phone == Phone::kSil ? 1 : 0;
    sums[kind] += rows_.row(row);
    counts[kind] += 1;
  }
  for (Eigen::Index row = 0; row < rows_.rows(); ++row) {
    const std::size_t kind = silence_(row) > 0 ? 1 : 0;
    rows_.row(row) -= sums[kind] / counts[kind];
  }
  if (rows_.rows() == 0) return;
  smoothRows(rows_);
  smoothRows(silence_);
}

Eigen::RowVectorXd SoundDeviations::spreadInSpeech() const {
  Eigen::RowVectorXd squares = Eigen::RowVectorXd::Zero(kSoundMeasures);
  double count = 0;
  for (Eigen::Index row = 0; row < rows_.rows(); ++row) {
    squares += (1 - silence_(row)) * rows_.row(row).cwiseAbs2();
    count += 1 - silence_(row);
  }
  return (squares / std::max(1.0, count)).cwiseSqrt();
}

Eigen::RowVectorXd SoundDeviations::at(Seconds time) const {
  const double place = time / SoundMeasures::kStep;
  if (!(place >= 0 && place <= asReal(rows_.rows() - 1))) return Eigen::RowVectorXd::Zero(kSoundMeasures);
  const auto before = static_cast<Eigen::Index>(place);
  const Eigen::Index after = std::min<Eigen::Index>(before + 1, rows_.rows() - 1);
  const double part = place - asReal(before);
  return (1 - part) * rows_.row(before) + part * rows_.row(after);
}

Eigen::MatrixXd SoundDeviations::featuresAt(std::span<const Seconds> times, const Eigen::RowVectorXd& scale) const {
  Eigen::MatrixXd features = Eigen::MatrixXd::Zero(std::ssize(times), kSoundFeatures);
  if (rows_.rows() == 0) return features;
  for (std::size_t i = 0; i < times.size(); ++i) {
    Eigen::Index column = 0;
    const auto put = [&](Seconds lag, double share) {
      features.row(signedIndex(i)).segment(column, kSoundMeasures) = share * at(times[i] + lag).cwiseProduct(scale);
      column += kSoundMeasures;
    };
    const auto row = std::clamp<Eigen::Index>(std::lround(times[i] / SoundMeasures::kStep), 0, rows_.rows() - 1);
    for (const Seconds lag : kLags) put(lag, 1);
    for (const Seconds lag : kLagsInSilence) put(lag, silence_(row));
  }
  return features;
}

HeardLine::HeardLine(const SoundModel& model, SoundMeasures measures, const SpeechLabels& labels)
    : model_(&model), deviations_(std::move(measures), labels, model.expected) {
  const Eigen::RowVectorXd ratio = deviations_.spreadInSpeech().cwiseQuotient(model.widest_spread);
  strangeness_ = ratio.squaredNorm() / asReal(kSoundMeasures);
  // Noise beside a signal of known width: least squares keeps the signal's share of the variance.
  scale_ = ratio.cwiseAbs2().cwiseMax(1).cwiseInverse().cwiseQuotient(model.spread);
  believed_ = std::clamp((kNotBelieved - strangeness_) / (kNotBelieved - 1), 0.0, 1.0);
}

Eigen::MatrixXd HeardLine::at(std::span<const Seconds> times) const {
  return believed_ * deviations_.featuresAt(times, scale_) * model_->weights;
}

}  // namespace mouthpiece
