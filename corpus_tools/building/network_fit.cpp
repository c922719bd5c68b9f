#include "corpus_tools/building/prediction_parts.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "base/index.h"

namespace mouthpiece {
namespace {

using Matrix = ContextNetwork::Matrix;

/// In (-1, 1): std::uniform_real_distribution differs between standard libraries.
float symmetric(std::mt19937_64& random) {
  constexpr double kLargest = 9007199254740992.0;  // 2^53
  return asFloat(2 * (static_cast<double>(random() >> 11U) / kLargest) - 1);
}

/// A segment that a window holds a part of, at one time of a take.
struct Glimpse {
  Eigen::Index row, segment, window;
  float share;
};

std::vector<Glimpse> glimpsesOf(const NetworkTake& take) {
  std::vector<Glimpse> glimpses;
  std::vector<std::pair<Eigen::Index, float>> shares;
  for (std::size_t row = 0; row < take.times.size(); ++row) {
    if (!(take.seen(signedIndex(row)) > 0)) continue;
    for (std::size_t segment = 0; segment < take.segments.size(); ++segment) {
      windowShares(take.segments[segment].span, take.times[row], shares);
      for (const auto& [window, share] : shares)
        glimpses.push_back({signedIndex(row), signedIndex(segment), window, share});
    }
  }
  return glimpses;
}

/// The parameters of a network side by side, their gradient and Adam's moments.
class Adam {
 public:
  explicit Adam(Eigen::Index count)
      : gradient(Eigen::VectorXf::Zero(count)),
        mean_(Eigen::VectorXf::Zero(count)),
        square_(Eigen::VectorXf::Zero(count)) {}

  /// `decay` a parameter.
  void step(Eigen::VectorXf& parameters, const Eigen::VectorXf& decay, double rate) {
    constexpr float kMean = 0.9F, kSquare = 0.99F, kLeast = 1e-8F;
    ++steps_;
    mean_ = kMean * mean_ + (1 - kMean) * gradient;
    square_ = kSquare * square_ + (1 - kSquare) * gradient.cwiseAbs2();
    const auto correction =
        asFloat(rate * std::sqrt(1 - std::pow(double{kSquare}, steps_)) / (1 - std::pow(double{kMean}, steps_)));
    parameters.array() -= correction * mean_.array() / (square_.array().sqrt() + kLeast) +
                          asFloat(rate) * decay.array() * parameters.array();
    gradient.setZero();
  }

  Eigen::VectorXf gradient;

 private:
  Eigen::VectorXf mean_, square_;
  int steps_ = 0;
};

class NetworkFit {
 public:
  NetworkFit(const std::vector<NetworkTake>& takes, const std::vector<std::size_t>& use, Eigen::Index components,
             std::uint64_t seed, const NetworkFitOptions& options)
      : takes_(takes),
        order_(use),
        options_(options),
        random_(seed),
        hidden_(options.hidden),
        features_(std::ssize(contextFeatureNames())),
        is_said_(contextFeatureNames().size(), false),
        components_(components),
        parameters_(Eigen::VectorXf::Zero(inputs() + hidden_ + hidden_ * components)),
        decay_(Eigen::VectorXf::Zero(parameters_.size())),
        adam_(parameters_.size()) {
    for (const std::size_t take : use) {
      glimpses_.emplace_back(glimpsesOf(takes[take]));
      for (const ContextSegment& segment : takes[take].segments) {
        for (const auto& [feature, value] : segment.features) is_said_[unsignedIndex(feature)] = true;
      }
    }
    numbers_.resize(order_.size());
    std::iota(numbers_.begin(), numbers_.end(), std::size_t{0});
    begin();
  }

  ContextNetwork fit() {
    double frames = 0;
    for (const std::size_t take : order_) frames += double{takes_[take].seen.sum()};
    const auto steps = std::max<std::size_t>(1, order_.size() / options_.takes_a_step);
    const double frames_a_step = std::max(1.0, frames / asReal(steps));
    const double all_steps = options_.epochs * asReal(steps);
    std::size_t done = 0;
    for (int epoch = 0; epoch < options_.epochs; ++epoch) {
      for (std::size_t i = 0; i < numbers_.size(); ++i)
        std::swap(numbers_[i], numbers_[i + random_() % (numbers_.size() - i)]);
      for (std::size_t step = 0; step < steps; ++step, ++done) {
        const std::size_t begin = step * numbers_.size() / steps, end = (step + 1) * numbers_.size() / steps;
        for (std::size_t i = begin; i < end; ++i) learnFrom(numbers_[i], frames_a_step);
        const double rate = 0.5 * options_.rate * (1 + std::cos(std::numbers::pi * asReal(done) / all_steps));
        adam_.step(parameters_, decay_, rate);
      }
    }
    return network();
  }

 private:
  [[nodiscard]] Eigen::Index inputs() const { return features_ * kContextWindows * hidden_; }
  [[nodiscard]] Eigen::Map<Matrix> inputOf(Eigen::VectorXf& of) const {
    return {of.data(), features_, kContextWindows * hidden_};
  }
  [[nodiscard]] Eigen::Map<Eigen::RowVectorXf> biasOf(Eigen::VectorXf& of) const {
    return {of.data() + inputs(), hidden_};
  }
  [[nodiscard]] Eigen::Map<Matrix> outputOf(Eigen::VectorXf& of) const {
    return {of.data() + inputs() + hidden_, hidden_, components_};
  }

  void begin() {
    constexpr float kInput = 0.25F, kOutput = 0.5F;
    const auto firstSound = features_ - 2 * signedIndex(kPhoneCount);
    for (Eigen::Index i = 0; i < inputs(); ++i) parameters_(i) = kInput * symmetric(random_);
    inputOf(parameters_).bottomRows(features_ - firstSound).setZero();
    for (Eigen::Index feature = 0; feature < firstSound; ++feature) {  // nothing would ever move it from chance
      if (!is_said_[unsignedIndex(feature)]) inputOf(parameters_).row(feature).setZero();
    }
    for (float& weight : outputOf(parameters_).reshaped()) weight = kOutput * symmetric(random_);
    inputOf(decay_).setConstant(asFloat(1e-2 * options_.decay));
    inputOf(decay_).bottomRows(features_ - firstSound).setConstant(asFloat(1e-2 * options_.sound_decay));
    outputOf(decay_).setConstant(asFloat(1e-2 * options_.decay));
  }

  /// Of each segment: all features, or only those below its own sound's, so that a sound that nobody said is not the
  /// first to come without.
  std::vector<Eigen::Index> featuresKnown(std::size_t segments) {
    std::vector<Eigen::Index> known(segments, features_);
    for (Eigen::Index& own : known) {
      const double draw = 0.5 * (1 + double{symmetric(random_)});
      if (draw < options_.forgotten) own = features_ - 2 * signedIndex(kPhoneCount);
    }
    return known;
  }

  void learnFrom(std::size_t number, double frames_a_step) {
    const NetworkTake& take = takes_[order_[number]];
    const auto input = inputOf(parameters_);
    const std::vector<Eigen::Index> known = featuresKnown(take.segments.size());
    given_.setZero(std::ssize(take.segments), input.cols());
    for (std::size_t i = 0; i < take.segments.size(); ++i) {
      for (const auto& [feature, value] : take.segments[i].features) {
        if (feature < known[i]) given_.row(signedIndex(i)) += value * input.row(feature);
      }
    }
    active_ = biasOf(parameters_).replicate(std::ssize(take.times), 1);
    for (const Glimpse& glimpse : glimpses_[number])
      active_.row(glimpse.row) +=
          glimpse.share * given_.row(glimpse.segment).segment(glimpse.window * hidden_, hidden_);
    active_ = active_.array().tanh().matrix();

    const auto output = outputOf(parameters_);
    Matrix error = take.seen.asDiagonal() * (active_ * output);
    const Eigen::RowVectorXf mean = error.colwise().sum() / std::max(1.0F, take.seen.sum());
    error -= take.seen * mean + take.values;  // what is not seen has neither
    error /= asFloat(frames_a_step);

    outputOf(adam_.gradient) += active_.transpose() * error;
    const Matrix back = ((error * output.transpose()).array() * (1 - active_.array().square())).matrix();
    biasOf(adam_.gradient) += back.colwise().sum();
    given_.setZero();
    for (const Glimpse& glimpse : glimpses_[number])
      given_.row(glimpse.segment).segment(glimpse.window * hidden_, hidden_) += glimpse.share * back.row(glimpse.row);
    auto gradient = inputOf(adam_.gradient);
    for (std::size_t i = 0; i < take.segments.size(); ++i) {
      for (const auto& [feature, value] : take.segments[i].features) {
        if (feature < known[i]) gradient.row(feature) += value * given_.row(signedIndex(i));
      }
    }
  }

  ContextNetwork network() { return {inputOf(parameters_), biasOf(parameters_), outputOf(parameters_)}; }

  const std::vector<NetworkTake>& takes_;
  std::vector<std::size_t> order_, numbers_;
  NetworkFitOptions options_;
  std::mt19937_64 random_;
  Eigen::Index hidden_, features_;
  std::vector<bool> is_said_;  ///< features
  Eigen::Index components_;
  Eigen::VectorXf parameters_, decay_;
  Adam adam_;
  std::vector<std::vector<Glimpse>> glimpses_;
  Matrix given_, active_;
};

}  // namespace

ContextNetwork fitContextNetwork(const std::vector<NetworkTake>& takes, const std::vector<std::size_t>& use,
                                 Eigen::Index components, std::uint64_t seed, const NetworkFitOptions& options) {
  return NetworkFit(takes, use, components, seed, options).fit();
}

Eigen::MatrixXd centredPrediction(const ContextNetwork& network, const NetworkTake& take) {
  Eigen::MatrixXd values = network.at(contextView(take.segments, take.times), network.given(take.segments));
  const Eigen::VectorXd seen = take.seen.cast<double>();
  const Eigen::RowVectorXd mean = seen.transpose() * values / std::max(1.0, seen.sum());
  values.rowwise() -= mean;
  return seen.asDiagonal() * values;
}

}  // namespace mouthpiece
