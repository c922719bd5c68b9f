#include "hearing/alignment/voice_transform.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/index.h"
#include "hearing/alignment/acoustic_model.h"

namespace mouthpiece {
namespace {

/// Frames of the model's own speech that are heard beside those of the voice.
constexpr double kHeldFrames = 150;
/// A phone that is less likely in a frame than this is not said there.
constexpr float kLeastSaid = 0.05F;
/// Which densities a frame is of is found so often, and each row of the matrix.
constexpr int kSteps = 2, kSweeps = 12;

/// Sums over the frames and densities of what the likelihood goes by; x: a stream's features and a 1.
struct Sums {
  explicit Sums(Eigen::Index size)
      : squares(unsignedIndex(size), Eigen::MatrixXd::Zero(size + 1, size + 1)),
        products(Eigen::MatrixXd::Zero(size + 1, size)) {}

  double count = 0;                      ///< frames, of each stream
  std::vector<Eigen::MatrixXd> squares;  ///< by feature: of x x' over its variance
  Eigen::MatrixXd products;              ///< a column a feature: of x times its mean over its variance

  /// `precisions`, `pulls`: features x frames, sums over the densities of 1 / variance and mean / variance.
  void add(const Eigen::MatrixXd& x, const Eigen::MatrixXd& precisions, const Eigen::MatrixXd& pulls) {
    for (std::size_t i = 0; i < squares.size(); ++i)
      squares[i] += x * precisions.row(signedIndex(i)).asDiagonal() * x.transpose();
    products += x * pulls.transpose();
  }
};

/// Features with a row of ones under cepstra, which may be shifted, and of zeros under differences, which may not.
Eigen::MatrixXd withShift(const Eigen::MatrixXd& features, std::size_t stream) {
  Eigen::MatrixXd x(features.rows() + 1, features.cols());
  x << features, Eigen::RowVectorXd::Constant(features.cols(), stream == 0 ? 1.0 : 0.0);
  return x;
}

Eigen::VectorXd usualWeights(const TiedModel::Codebook& codebook, std::size_t stream) {
  const Eigen::VectorXd sums = codebook.weights[stream].cast<double>().colwise().sum();
  return (sums / std::max(sums.sum(), 1e-12)).cwiseMax(1e-12);
}

/// How much each density of a codebook (rows) makes of each frame.
Eigen::MatrixXd sharesOf(const TiedModel::Codebook& codebook, std::size_t stream, const Eigen::MatrixXf& frames) {
  const Eigen::Index size = frames.rows();
  Eigen::MatrixXf terms(2 * size + 1, frames.cols());
  terms << frames.cwiseAbs2(), frames, Eigen::RowVectorXf::Ones(frames.cols());
  Eigen::MatrixXf likely = codebook.gaussians[stream] * terms;
  likely.colwise() += usualWeights(codebook, stream).array().log().matrix().cast<float>();
  likely.rowwise() -= likely.colwise().maxCoeff();
  Eigen::MatrixXd shares = likely.array().exp().matrix().cast<double>();
  shares.array().rowwise() /= shares.colwise().sum().array();
  return shares;
}

/// The phone of a codebook by its number; 0 for silence, breath and noise.
Eigen::Index phoneOf(const TiedModel::Codebook& codebook) {
  return static_cast<Eigen::Index>(phoneFromName(codebook.phone).value_or(Phone::kSil));
}

/// `said`: of each codebook, in how many frames it is.
void addHeard(const TiedModel& model, const HeardFrames& heard, const VoiceTransform& before, std::vector<double>& said,
              Sums& sums) {
  const Eigen::MatrixXf moved = before(heard.features);
  const Eigen::Index size = model.stream_sizes[0];
  for (std::size_t stream = 0; stream < model.stream_sizes.size(); ++stream) {
    const Eigen::Index row = signedIndex(stream) * size;
    Eigen::MatrixXd precisions = Eigen::MatrixXd::Zero(size, moved.cols()), pulls = precisions;
    for (std::size_t book = 0; book < model.codebooks.size(); ++book) {
      const TiedModel::Codebook& codebook = model.codebooks[book];
      const Eigen::Index phone = phoneOf(codebook);
      if (phone == 0) continue;
      std::vector<Eigen::Index> frames;
      for (Eigen::Index t = 0; t < moved.cols(); ++t) {
        if (heard.posteriors(phone, t) >= kLeastSaid) frames.push_back(t);
      }
      if (frames.empty()) continue;
      const Eigen::VectorXd weights = heard.posteriors(phone, frames).transpose().cast<double>();
      const Eigen::MatrixXd shares =
          sharesOf(codebook, stream, moved.middleRows(row, size)(Eigen::all, frames)) * weights.asDiagonal();
      const Densities densities = densitiesOf(codebook.gaussians[stream]);
      const Eigen::MatrixXd inverse = densities.variances.cwiseInverse();
      precisions(Eigen::all, frames) += inverse * shares;
      pulls(Eigen::all, frames) += densities.means.cwiseProduct(inverse) * shares;
      sums.count += weights.sum();
      said[book] += weights.sum();
    }
    sums.add(withShift(heard.features.middleRows(row, size).cast<double>(), stream), precisions, pulls);
  }
}

/// What frames of the model's own would add, by how often each codebook was heard: they fit best as they are.
void addHeld(const TiedModel& model, const std::vector<double>& said, double total, Sums& sums) {
  for (std::size_t book = 0; book < model.codebooks.size(); ++book) {
    const double frames = kHeldFrames * said[book] / total;
    if (frames <= 0) continue;
    for (std::size_t stream = 0; stream < model.stream_sizes.size(); ++stream) {
      const Densities densities = densitiesOf(model.codebooks[book].gaussians[stream]);
      const Eigen::MatrixXd inverse =
          densities.variances.cwiseInverse() * (frames * usualWeights(model.codebooks[book], stream)).asDiagonal();
      sums.add(withShift(densities.means, stream), inverse, densities.means.cwiseProduct(inverse));
      for (std::size_t i = 0; i < sums.squares.size(); ++i) {
        const Eigen::VectorXd spread = densities.variances * inverse.row(signedIndex(i)).transpose();
        sums.squares[i].diagonal().head(spread.size()) += spread;
      }
      sums.count += frames;
    }
  }
}

/// The matrix and shift that maximise count log |matrix| + sum over rows w of w'products - w'squares w / 2, row by row
/// (Gales, 1998, section 2 and appendix).
VoiceTransform likeliest(const Sums& sums) {
  const Eigen::Index size = sums.products.cols();
  VoiceTransform transform{Eigen::MatrixXd::Identity(size, size), Eigen::VectorXd::Zero(size)};
  std::vector<Eigen::MatrixXd> inverse;
  for (const Eigen::MatrixXd& square : sums.squares) inverse.push_back(square.inverse());
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (Eigen::Index i = 0; i < size; ++i) {
      const Eigen::MatrixXd& own = inverse[unsignedIndex(i)];
      Eigen::VectorXd cofactors(size + 1);  // over the determinant
      cofactors << transform.matrix.inverse().col(i), 0;
      const double squared = cofactors.dot(own * cofactors), met = cofactors.dot(own * sums.products.col(i));
      // The determinant's sign stays as it is.
      const double step = (std::sqrt(met * met + 4 * squared * sums.count) - met) / (2 * squared);
      const Eigen::VectorXd row = own * (step * cofactors + sums.products.col(i));
      transform.matrix.row(i) = row.head(size).transpose();
      transform.shift(i) = row(size);
    }
  }
  return transform;
}

}  // namespace

Eigen::MatrixXf VoiceTransform::operator()(const Eigen::MatrixXf& features) const {
  if (isNone()) return features;
  const Eigen::MatrixXf by = matrix.cast<float>();
  Eigen::MatrixXf moved(features.rows(), features.cols());
  for (Eigen::Index row = 0; row < features.rows(); row += by.rows())
    moved.middleRows(row, by.rows()).noalias() = by * features.middleRows(row, by.rows());
  moved.topRows(by.rows()).colwise() += shift.cast<float>();
  return moved;
}

double VoiceTransform::logStretch() const { return isNone() ? 0.0 : std::log(std::abs(matrix.determinant())); }

VoiceTransform fitVoice(const TiedModel& model, std::span<const HeardFrames> heard) {
  const Eigen::Index size = model.stream_sizes.front();
  const bool are_differences = std::all_of(model.stream_sizes.begin(), model.stream_sizes.end(),
                                           [&](Eigen::Index stream) { return stream == size; });
  if (!are_differences) return {};
  VoiceTransform transform;
  for (int step = 0; step < kSteps; ++step) {
    Sums sums(size);
    std::vector<double> said(model.codebooks.size(), 0.0);
    for (const HeardFrames& frames : heard) addHeard(model, frames, transform, said, sums);
    if (sums.count <= 0) return {};
    addHeld(model, said, sums.count, sums);
    transform = likeliest(sums);
  }
  return transform;
}

}  // namespace mouthpiece
