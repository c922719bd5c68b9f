#pragma once

#include <Eigen/Core>
#include <random>
#include <string>
#include <vector>

namespace mouthpiece::test {

/// From `least` to `most`, the same with every compiler (the standard's distributions are not).
inline double numberBetween(double least, double most, std::mt19937& random) {
  return least + (most - least) * (static_cast<double>(random()) / 4294967296.0);
}

/// What a test makes, held against what the program made when it was last kept: laws say what must be so, this says
/// that nothing else has changed. Of the numbers their count and eight sums with pseudo-random signs are kept, in
/// stored/kept_numbers.json. `MOUTHPIECE_KEEP=1 build/test_bin/unit_deform --gtest_filter='*Kept*'` keeps them anew:
/// only for a change that is meant, and said in its commit.
class KeptNumbers {
 public:
  /// Two runs may differ by `rms` a number, root mean square: compilers and processors do in the last digits.
  explicit KeptNumbers(std::string name, double rms = 1e-4) : name_(std::move(name)), rms_(rms) {}
  KeptNumbers(const KeptNumbers&) = delete;
  KeptNumbers& operator=(const KeptNumbers&) = delete;
  /// Compares.
  ~KeptNumbers();

  KeptNumbers& add(double number) {
    numbers_.push_back(number);
    return *this;
  }
  template <typename Derived>
  KeptNumbers& add(const Eigen::DenseBase<Derived>& numbers) {
    for (Eigen::Index r = 0; r < numbers.rows(); ++r) {
      for (Eigen::Index c = 0; c < numbers.cols(); ++c) add(static_cast<double>(numbers(r, c)));
    }
    return *this;
  }
  template <typename Number>
  KeptNumbers& add(const std::vector<Number>& numbers) {
    for (const auto& number : numbers) add(number);
    return *this;
  }

 private:
  std::string name_;
  double rms_;
  std::vector<double> numbers_;
};

}  // namespace mouthpiece::test
