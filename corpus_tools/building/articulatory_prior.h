#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace mouthpiece {

/// What features of segments (speechSegments()) bring is alike where the sounds that they name are made alike: a
/// Gaussian process over height, backness, rounding, place, manner and the lips' contact, of a sound and of its
/// neighbour (docs/theory/units/prediction.md). So a rare feature is drawn to those like it instead of to nothing, and
/// one that nobody said is placed by them.
class ArticulatoryPrior {
 public:
  /// The features that somebody said.
  explicit ArticulatoryPrior(std::vector<std::string> names);

  /// Of the usual covariance of what they bring, whose diagonal is 1: the inverse. features x features.
  [[nodiscard]] Eigen::MatrixXd precision() const;

  /// What phones, visemes and pairs of visemes that are not among them are expected to bring. `targets`: a row a
  /// feature.
  [[nodiscard]] std::map<std::string, Eigen::VectorXd> unsaid(const Eigen::MatrixXd& targets) const;

 private:
  /// Features of one kind; those of two have nothing to do with each other.
  struct Kind {
    std::vector<Eigen::Index> places;
    Eigen::MatrixXd precision;
  };
  std::vector<std::string> names_;
  std::vector<Kind> kinds_;
};

}  // namespace mouthpiece
