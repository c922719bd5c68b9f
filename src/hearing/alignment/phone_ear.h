#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "phonetics/language/language.h"

namespace mouthpiece {

/// How likely each phone is at each time of a sound, whatever is said (PhoneLoop). Not thread-safe.
class PhoneEar {
 public:
  /// The language's acoustic model and its order of phones. Throws InputError without the first.
  explicit PhoneEar(const Language& language = english());
  ~PhoneEar();

  /// Rows: phones by their number; a column every 10 ms, from 8 ms on. samples: 16 kHz.
  Eigen::MatrixXf posteriors(std::span<const std::int16_t> samples);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A phone heard, to 10 ms.
struct HeardPhone {
  Phone phone = Phone::kSil;
  std::size_t first = 0, end = 0;  ///< frames
  double confidence = 0;           ///< its posterior in the mean
};

/// The row of phones that is right in the most frames that can be expected, where a phone that looks like the right
/// one counts by `likeness` (phones x phones, 0 to 1); each at least three frames long. `posteriors`: of PhoneEar.
/// `change`: what one more phone costs, in frames.
std::vector<HeardPhone> likeliestPhones(const Eigen::MatrixXf& posteriors, const Eigen::MatrixXf& likeness,
                                        double change);

}  // namespace mouthpiece
