#include "hearing/alignment/noise_adaptation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/index.h"
#include "hearing/alignment/phone_decoder.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kStreams = 3;        ///< cepstra, first and second differences
constexpr double kQuietShare = 0.15;       ///< of the frames are background alone
constexpr Eigen::Index kSmoothFrames = 5;  ///< over which a frame's level is judged
constexpr double kSmallVariance = 1e-3;
constexpr int kRounds = 3;
constexpr Eigen::Index kMostFittedFrames = 600;  ///< that the surroundings are fitted to, evenly spaced
constexpr double kSpeechHeld = 30.0;             ///< precision of the first guess of the speaker's mean
/// Louder changes of the background than this are no steady noise: it stays unadapted.
constexpr double kMostUnsteadyDb = 2.7;

/// The speaker's and the room's mean, about which the model's means lie, and the background.
struct Surroundings {
  Eigen::VectorXd speech, noise;
  std::array<Eigen::VectorXd, kStreams> noise_variances;
};

/// How cepstra of speech and of noise add up: their energies do, band by band.
class Mixer {
 public:
  explicit Mixer(std::size_t count)
      : cosines_(frontEndCosines(count)),
        bands_(cosines_.transpose() * cosines_.rowwise().squaredNorm().cwiseInverse().asDiagonal()) {}

  struct Mixed {
    Eigen::VectorXd cepstra;
    Eigen::MatrixXd share;  ///< of a small change of the speech that comes through; the rest of one of the noise
  };
  [[nodiscard]] Eigen::MatrixXd bandsOf(const Eigen::MatrixXd& cepstra) const { return bands_ * cepstra; }
  [[nodiscard]] Mixed mix(const Eigen::VectorXd& speech, const Eigen::VectorXd& noise) const {
    constexpr double kMost = 200;  // e^200: nothing is left of the speech
    const Eigen::ArrayXd over = (bands_ * (noise - speech)).array().min(kMost).max(-kMost);
    const Eigen::ArrayXd added = (1 + over.exp()).log(), through = (1 + over.exp()).inverse();
    return {speech + cosines_ * added.matrix(), cosines_ * through.matrix().asDiagonal() * bands_};
  }

 private:
  Eigen::MatrixXd cosines_, bands_;
};

/// Of the differences that the model's features are: c(t + 2) - c(t - 2), and of these at t + 1 and t - 1.
Eigen::MatrixXd differences(const Eigen::MatrixXd& cepstra, Eigen::Index reach) {
  const Eigen::Index frames = cepstra.cols();
  Eigen::MatrixXd result(cepstra.rows(), frames);
  const auto at = [&](Eigen::Index t) { return cepstra.col(std::clamp<Eigen::Index>(t, 0, frames - 1)); };
  for (Eigen::Index t = 0; t < frames; ++t) result.col(t) = at(t + reach) - at(t - reach);
  return result;
}

/// The frames whose level, over some 50 ms, is lowest.
std::vector<Eigen::Index> quietFrames(const Eigen::MatrixXd& cepstra) {
  const Eigen::Index frames = cepstra.cols();
  Eigen::VectorXd level(frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const Eigen::Index first = std::max<Eigen::Index>(0, t - kSmoothFrames / 2);
    level(t) = cepstra.row(0).segment(first, std::min(kSmoothFrames, frames - first)).mean();
  }
  std::vector<Eigen::Index> order(unsignedIndex(frames));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return level(a) < level(b); });
  order.resize(std::max<std::size_t>(1, static_cast<std::size_t>(kQuietShare * asReal(frames))));
  return order;
}

Eigen::VectorXd varianceOf(const Eigen::MatrixXd& columns) {
  const Eigen::VectorXd mean = columns.rowwise().mean();
  return (columns.colwise() - mean).cwiseAbs2().rowwise().mean().cwiseMax(kSmallVariance);
}

/// The densities of all that may be in the sound, side by side.
Densities densitiesOfAll(const TiedModel& model, const std::vector<bool>& wanted) {
  std::vector<Densities> all;
  Eigen::Index count = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!wanted[i]) continue;
    all.push_back(densitiesOf(model.codebooks[i].gaussians[0]));
    count += all.back().means.cols();
  }
  Densities joined{Eigen::MatrixXd(model.stream_sizes[0], count), Eigen::MatrixXd(model.stream_sizes[0], count)};
  Eigen::Index at = 0;
  for (const Densities& own : all) {
    joined.means.middleCols(at, own.means.cols()) = own.means;
    joined.variances.middleCols(at, own.means.cols()) = own.variances;
    at += own.means.cols();
  }
  return joined;
}

/// What is left of a variance of the speech, and what the noise brings; never less than the speech's own, since the
/// background is steadier in its quietest moments than in others.
Eigen::VectorXd mixedVariance(const Eigen::MatrixXd& share, const Eigen::VectorXd& speech,
                              const Eigen::VectorXd& noise) {
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(share.rows(), share.cols()) - share;
  return (share.cwiseAbs2() * speech + rest.cwiseAbs2() * noise).cwiseMax(speech);
}

/// One step of Gauss and Newton for the speaker's mean: each frame is the likeliest density's.
void refine(Surroundings& around, const Mixer& mixer, const Densities& densities, const Eigen::MatrixXd& frames) {
  const Eigen::Index size = frames.rows(), count = densities.means.cols();
  std::vector<Mixer::Mixed> mixed;
  Eigen::MatrixXd variances(size, count);
  Eigen::MatrixXf rows(count, 2 * size + 1);
  for (Eigen::Index i = 0; i < count; ++i) {
    mixed.push_back(mixer.mix(densities.means.col(i) + around.speech, around.noise));
    variances.col(i) = mixedVariance(mixed.back().share, densities.variances.col(i), around.noise_variances[0]);
    rows.row(i) = densityRow(mixed.back().cepstra, variances.col(i));
  }
  Eigen::MatrixXf terms(2 * size + 1, frames.cols());
  terms << frames.cwiseAbs2().cast<float>(), frames.cast<float>(), Eigen::RowVectorXf::Ones(frames.cols());
  const Eigen::MatrixXf likely = rows * terms;

  Eigen::MatrixXd normal = kSpeechHeld * Eigen::MatrixXd::Identity(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  for (Eigen::Index t = 0; t < frames.cols(); ++t) {
    Eigen::Index best = 0;
    likely.col(t).maxCoeff(&best);
    const Mixer::Mixed& own = mixed[unsignedIndex(best)];
    const Eigen::MatrixXd weighed = own.share.transpose() * variances.col(best).cwiseInverse().asDiagonal();
    normal += weighed * own.share;
    right += weighed * (frames.col(t) - own.cepstra);
  }
  around.speech += normal.ldlt().solve(right);
}

double unsteadinessDb(const Eigen::MatrixXd& cepstra, const Mixer& mixer) {
  constexpr double kDecibels = 10 / std::numbers::ln10;
  const Eigen::MatrixXd bands = mixer.bandsOf(cepstra);
  const auto around = [&](Eigen::Index t) -> Eigen::VectorXd {
    const Eigen::Index first = std::clamp<Eigen::Index>(t - kSmoothFrames / 2, 0, bands.cols() - 1);
    return bands.middleCols(first, std::min(kSmoothFrames, bands.cols() - first)).rowwise().mean();
  };
  double sum = 0, count = 0;
  for (const Eigen::Index t : quietFrames(cepstra)) {
    if (t < kSmoothFrames || t + kSmoothFrames >= bands.cols()) continue;
    sum += (around(t + kSmoothFrames) - around(t - kSmoothFrames)).squaredNorm() / asReal(bands.rows());
    count += 1;
  }
  return kDecibels * std::sqrt(sum / std::max(1.0, count));
}

Surroundings surroundingsOf(const Eigen::MatrixXd& cepstra, const Mixer& mixer, const Densities& densities) {
  const std::vector<Eigen::Index> quiet = quietFrames(cepstra);
  const Eigen::MatrixXd first = differences(cepstra, 2), second = differences(first, 1);
  Surroundings around;
  around.noise = cepstra(Eigen::all, quiet).rowwise().mean();
  around.noise_variances = {varianceOf(cepstra(Eigen::all, quiet)), varianceOf(first(Eigen::all, quiet)),
                            varianceOf(second(Eigen::all, quiet))};
  // What is loud is speech: its mean against the model's.
  const double middle = cepstra.row(0).mean();
  Eigen::VectorXd loud = Eigen::VectorXd::Zero(cepstra.rows());
  double count = 0;
  for (Eigen::Index t = 0; t < cepstra.cols(); ++t) {
    if (cepstra(0, t) < middle) continue;
    loud += cepstra.col(t);
    count += 1;
  }
  around.speech = loud / std::max(1.0, count) - densities.means.rowwise().mean();
  const Eigen::Index every = cepstra.cols() / kMostFittedFrames + 1;
  const Eigen::MatrixXd some = cepstra(Eigen::all, Eigen::seq(0, Eigen::last, every));
  for (int round = 0; round < kRounds; ++round) refine(around, mixer, densities, some);
  return around;
}

/// The differences have densities of their own: the codebook's usual share of speech counts for them.
void adaptCodebook(TiedModel::Codebook& codebook, const Mixer& mixer, const Surroundings& around,
                   const Eigen::VectorXd& level) {
  const Eigen::Index size = level.size();
  const Densities plain = densitiesOf(codebook.gaussians[0]);
  const Eigen::RowVectorXd weights = codebook.weights[0].cast<double>().colwise().sum();
  Eigen::MatrixXd usual = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index i = 0; i < plain.means.cols(); ++i) {
    const Mixer::Mixed mixed = mixer.mix(plain.means.col(i) + around.speech, around.noise);
    usual += weights(i) / std::max(weights.sum(), 1e-12) * mixed.share;
    codebook.gaussians[0].row(i) = densityRow(
        mixed.cepstra - level, mixedVariance(mixed.share, plain.variances.col(i), around.noise_variances[0]));
  }
  for (std::size_t stream = 1; stream < kStreams; ++stream) {
    const Densities moving = densitiesOf(codebook.gaussians[stream]);
    for (Eigen::Index i = 0; i < moving.means.cols(); ++i) {
      codebook.gaussians[stream].row(i) = densityRow(
          usual * moving.means.col(i), mixedVariance(usual, moving.variances.col(i), around.noise_variances[stream]));
    }
  }
}

}  // namespace

double unsteadinessDb(const Eigen::MatrixXd& cepstra) {
  return cepstra.cols() > 0 ? unsteadinessDb(cepstra, Mixer(unsignedIndex(cepstra.rows()))) : 0.0;
}

bool isSteady(const Eigen::MatrixXd& cepstra) { return unsteadinessDb(cepstra) <= kMostUnsteadyDb; }

TiedModel adaptedToNoise(const TiedModel& model, const Eigen::MatrixXd& cepstra, const std::vector<bool>& wanted) {
  const bool is_known = model.stream_sizes == std::vector<Eigen::Index>(kStreams, cepstra.rows());
  if (!is_known || cepstra.cols() == 0) return model;
  if (!isSteady(cepstra)) return model;
  const Mixer mixer(unsignedIndex(cepstra.rows()));
  const Surroundings around = surroundingsOf(cepstra, mixer, densitiesOfAll(model, wanted));
  TiedModel adapted = model;
  const Eigen::VectorXd level = cepstra.rowwise().mean();
  for (TiedModel::Codebook& codebook : adapted.codebooks) adaptCodebook(codebook, mixer, around, level);
  return adapted;
}

}  // namespace mouthpiece
