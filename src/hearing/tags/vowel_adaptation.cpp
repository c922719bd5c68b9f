#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "hearing/tags/vowel_network.h"

namespace mouthpiece {
namespace {

// tools/vowel_adaptation.py has the same numbers.
constexpr Eigen::Index kVowels = 5;
constexpr Eigen::Index kSilence = 5;
constexpr std::uint32_t kMostDirections = kMelBandCount;
constexpr std::uint32_t kMostStarts = 64;
constexpr int kRounds = 10;
constexpr double kFrameCount = 0.04;  // a frame counts little, for its neighbours are like it
constexpr double kMostFrames = 600;   // no recording counts more than so many
constexpr double kVoiceShare = 0.5;
constexpr double kNetworkShare = 0.7;
constexpr Eigen::Index kReach = 35;  // frames to both sides that a decision leans on, if they sound alike
constexpr double kAlike = 12;        // squared distance
constexpr double kWide = 24;  // squared spread of a recording with several vowels; one vowel's is a third of it or less
constexpr double kLeastTrust = 0.5;
constexpr double kUsualScatter = 30;  // frames' worth of belief that a vowel's own frames scatter by 1 here too
constexpr std::size_t kFewestFrames = 5;
constexpr double kLeastShare = 1e-12;
constexpr Eigen::Index kNear = 3;  // frames to both sides whose squared distance tells how far the sound moves
constexpr double kMoving = 4;

Eigen::MatrixXd readMatrix(ByteReader& reader, Eigen::Index rows, Eigen::Index columns) {
  if (reader.remaining() < unsignedIndex(rows * columns) * sizeof(float)) {
    reader.fail(fmt::format("found {} bytes; expected {} x {} numbers", reader.remaining(), rows, columns));
  }
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index row = 0; row < rows; ++row) {
    for (Eigen::Index column = 0; column < columns; ++column) {
      matrix(row, column) = reader.readF32();
      if (!std::isfinite(matrix(row, column))) reader.fail("a number is not finite");
    }
  }
  return matrix;
}

/// Takes from every row of `logs` the logarithm of the sum of its powers, and returns those.
Eigen::VectorXd normaliseLogs(Eigen::MatrixXd& logs) {
  const Eigen::VectorXd top = logs.rowwise().maxCoeff();
  Eigen::VectorXd sums = top.array() + (logs.colwise() - top).array().exp().rowwise().sum().log();
  logs.colwise() -= sums;
  return sums;
}

/// Every frame's logarithms averaged with those of the frames around that sound alike: a held note is one vowel.
Eigen::MatrixXd leant(const Eigen::MatrixXd& logs, const Eigen::MatrixXd& places,
                      const std::vector<Eigen::Index>& frames) {
  Eigen::MatrixXd result(logs.rows(), logs.cols());
  const Eigen::Index count = std::ssize(frames);
  const auto time = [&frames](Eigen::Index k) { return frames[unsignedIndex(k)]; };
  Eigen::Index first = 0;
  for (Eigen::Index k = 0; k < count; ++k) {
    while (time(k) - time(first) > kReach) ++first;
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(logs.cols());
    double weights = 0;
    for (Eigen::Index other = first; other < count && time(other) - time(k) <= kReach; ++other) {
      const double weight = std::exp(-(places.row(other) - places.row(k)).squaredNorm() / kAlike);
      sum += weight * logs.row(other);
      weights += weight;
    }
    result.row(k) = sum / weights;
  }
  normaliseLogs(result);
  return result;
}

/// How far to believe the voice that was found: one vowel alone tells little of the others.
double trustIn(const Eigen::MatrixXd& places, const Eigen::VectorXd& steady) {
  const Eigen::RowVectorXd weight = steady.transpose() / (steady.sum() + kLeastShare);
  const Eigen::RowVectorXd middle = weight * places;
  const double spread = weight.dot((places.rowwise() - middle).rowwise().squaredNorm());
  return std::clamp(spread / kWide, kLeastTrust, 1.0);
}

}  // namespace

struct VowelAdaptation::Frames {
  Eigen::MatrixXd places;  // where they lie in the directions
  Eigen::MatrixXd heard;   // logarithms of the network's shares of the vowels
  Eigen::VectorXd steady;  // 1 for a held vowel, near 0 on the way from one sound to another
};

struct VowelAdaptation::Fit {
  Eigen::MatrixXd shares;
  double evidence = 0;
};

VowelAdaptation VowelAdaptation::read(ByteReader& reader) {
  const std::uint32_t directions = reader.readU32(), starts = reader.readU32();
  if (directions < 1 || directions > kMostDirections || starts > kMostStarts) {
    reader.fail(fmt::format("found {} directions and {} starts; expected 1 to {} and at most {}", directions, starts,
                            kMostDirections, kMostStarts));
  }
  VowelAdaptation adaptation;
  const Eigen::Index size = kVowels * directions;
  adaptation.directions_ = readMatrix(reader, kMelBandCount, directions);
  adaptation.mean_ = readMatrix(reader, size, 1);
  const Eigen::LLT<Eigen::MatrixXd> covariance(readMatrix(reader, size, size));
  if (covariance.info() != Eigen::Success) reader.fail("the voices' covariance is not positive");
  adaptation.precision_ = covariance.solve(Eigen::MatrixXd::Identity(size, size));
  adaptation.starts_ = readMatrix(reader, starts, size).transpose();
  return adaptation;
}

/// Logarithms of the normal densities of every frame, a vowel a column, but for a constant.
Eigen::MatrixXd VowelAdaptation::densities(const Eigen::MatrixXd& places, const Eigen::VectorXd& mean,
                                           const Eigen::MatrixXd& covariance, double scatter) const {
  const Eigen::Index n = directions_.cols();
  Eigen::MatrixXd result(places.rows(), kVowels);
  for (Eigen::Index vowel = 0; vowel < kVowels; ++vowel) {
    const Eigen::LLT<Eigen::MatrixXd> spread(scatter * Eigen::MatrixXd::Identity(n, n) +
                                             covariance.block(vowel * n, vowel * n, n, n));
    const Eigen::MatrixXd off = (places.rowwise() - mean.segment(vowel * n, n).transpose()).transpose();
    result.col(vowel) = -0.5 * spread.matrixL().solve(off).colwise().squaredNorm().transpose();
    result.col(vowel).array() -= spread.matrixLLT().diagonal().array().log().sum();
  }
  return result;
}

/// By how much (squared, in each direction) the frames scatter about the means, never less than they usually do: a
/// song's many pitches move a vowel. `counts`: how much of each frame is each vowel's.
double VowelAdaptation::scattered(const Eigen::MatrixXd& places, const Eigen::MatrixXd& counts,
                                  const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance) const {
  const Eigen::Index n = directions_.cols();
  double apart = 0;
  for (Eigen::Index vowel = 0; vowel < kVowels; ++vowel) {
    const Eigen::RowVectorXd middle = mean.segment(vowel * n, n).transpose();
    apart += counts.col(vowel).dot((places.rowwise() - middle).rowwise().squaredNorm());
    apart += counts.col(vowel).sum() * covariance.block(vowel * n, vowel * n, n, n).trace();
  }
  const double directions = asReal(n);
  const double usual = kUsualScatter * directions;
  return std::max((usual + apart) / (usual + directions * counts.sum()), 1.0);
}

/// Expectation and maximisation from these shares of the frames.
VowelAdaptation::Fit VowelAdaptation::fit(const Frames& frames, Eigen::MatrixXd shares) const {
  const Eigen::Index n = directions_.cols();
  const double steady = std::max(frames.steady.sum(), 1.0);
  const Eigen::VectorXd weight = kFrameCount * std::min(1.0, kMostFrames / steady) * frames.steady;
  Fit result{std::move(shares)};
  Eigen::VectorXd mean;
  Eigen::VectorXd sums;
  double scatter = 1;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXd inverse = precision_;
    Eigen::VectorXd drive = precision_ * mean_;
    const Eigen::MatrixXd counts = result.shares.array().colwise() * weight.array();
    const Eigen::MatrixXd weighted = frames.places.transpose() * counts;
    for (Eigen::Index vowel = 0; vowel < kVowels; ++vowel) {
      inverse.block(vowel * n, vowel * n, n, n).diagonal().array() += counts.col(vowel).sum() / scatter;
      drive.segment(vowel * n, n) += weighted.col(vowel) / scatter;
    }
    const Eigen::LLT<Eigen::MatrixXd> solver(inverse);
    mean = solver.solve(drive);
    const Eigen::MatrixXd covariance = solver.solve(Eigen::MatrixXd::Identity(inverse.rows(), inverse.cols()));
    scatter = scattered(frames.places, counts, mean, covariance);
    Eigen::MatrixXd logs =
        kVoiceShare * densities(frames.places, mean, covariance, scatter) + kNetworkShare * frames.heard;
    sums = normaliseLogs(logs);
    result.shares = logs.array().exp();
  }
  const Eigen::VectorXd off = mean - mean_;
  result.evidence = weight.dot(sums) - 0.5 * off.dot(precision_ * off);
  return result;
}

/// The frames' shares by the voices found from what the network heard and from those known, each as it fits.
Eigen::MatrixXd VowelAdaptation::byVoices(const Frames& frames) const {
  std::vector<Fit> fits{fit(frames, frames.heard.array().exp())};
  const Eigen::MatrixXd nothing = Eigen::MatrixXd::Zero(mean_.size(), mean_.size());
  for (Eigen::Index start = 0; start < starts_.cols(); ++start) {
    Eigen::MatrixXd begin = kVoiceShare * densities(frames.places, starts_.col(start), nothing, 1);
    normaliseLogs(begin);
    fits.push_back(fit(frames, begin.array().exp()));
  }
  const auto less = [](const Fit& one, const Fit& other) { return one.evidence < other.evidence; };
  const double best = std::max_element(fits.begin(), fits.end(), less)->evidence;
  Eigen::MatrixXd shares = Eigen::MatrixXd::Zero(frames.heard.rows(), kVowels);
  double weights = 0;
  for (const Fit& one : fits) {
    shares += std::exp(one.evidence - best) * one.shares;
    weights += std::exp(one.evidence - best);
  }
  return shares / weights;
}

Eigen::MatrixXf VowelAdaptation::adapt(const VowelEnvelopes& envelopes, const Eigen::MatrixXf& shares) const {
  MOUTHPIECE_EXPECT(envelopes.levels.rows() == shares.rows() && envelopes.pitch_hz.size() == shares.rows());
  MOUTHPIECE_EXPECT(shares.cols() == kVowels + 1 && envelopes.levels.cols() == kMelBandCount);
  std::vector<Eigen::Index> voiced;
  for (Eigen::Index frame = 0; frame < shares.rows(); ++frame) {
    Eigen::Index likeliest = 0;
    shares.row(frame).maxCoeff(&likeliest);
    if (likeliest != kSilence && envelopes.pitch_hz(frame) > 0) voiced.push_back(frame);
  }
  if (voiced.size() < kFewestFrames) return shares;
  const Eigen::Index count = std::ssize(voiced);
  const Eigen::Index last = shares.rows() - 1;
  Frames frames{Eigen::MatrixXd(count, directions_.cols()), Eigen::MatrixXd(count, kVowels), Eigen::VectorXd(count)};
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index frame = voiced[unsignedIndex(k)];
    const auto move = envelopes.levels.row(std::min(frame + kNear, last)) -
                      envelopes.levels.row(std::max<Eigen::Index>(frame - kNear, 0));
    frames.places.row(k) = envelopes.levels.row(frame) * directions_;
    frames.steady(k) = std::exp(-(move * directions_).squaredNorm() / kMoving);
    frames.heard.row(k) = (shares.row(frame).head(kVowels).cast<double>().array() + kLeastShare).log();
  }
  normaliseLogs(frames.heard);
  const double trust = trustIn(frames.places, frames.steady);
  const Eigen::MatrixXd found =
      trust * (byVoices(frames).array() + kLeastShare).log() + (1 - trust) * frames.heard.array();
  const Eigen::MatrixXd logs = leant(found, frames.places, voiced);
  Eigen::MatrixXf result = shares;
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index frame = voiced[unsignedIndex(k)];
    const double sounding = 1.0 - shares(frame, kSilence);
    result.row(frame).head(kVowels) = (sounding * logs.row(k).array().exp()).matrix().cast<float>();
  }
  return result;
}

}  // namespace mouthpiece
