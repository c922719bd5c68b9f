#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "hearing/tags/vowel_envelope.h"
#include "hearing/tags/vowel_features.h"
#include "base/byte_reader.h"

namespace mouthpiece {

/// What the perceptrons hear of each frame: the mel bands of `features`, and `envelopes` less half of their loud
/// frames' mean. Frames x 52.
VowelFeatures perceptronColumns(const VowelFeatures& features, const VowelEnvelopes& envelopes);

/// A small network that tells the sung vowel of a frame from it and four frames around it, with two hidden layers of
/// rectified units (docs/theory/vowel_network.md). Immutable: may be shared by threads.
class VowelPerceptron {
 public:
  /// Of that many units in the hidden layers. Throws InputError for sizes that do not fit the bytes and numbers that
  /// are not finite.
  static VowelPerceptron read(ByteReader& reader, const std::array<std::uint32_t, 2>& hidden);

  static constexpr std::array<int, 5> kOffsets{-9, -4, 0, 4, 9};
  static constexpr int kColumns = 2 * kMelBandCount;
  static constexpr int kInputs = kColumns * static_cast<int>(kOffsets.size());

  /// Frames x 6, every row sums to 1.
  [[nodiscard]] Eigen::MatrixXf probabilities(const VowelFeatures& columns) const;

 private:
  struct Layer {
    Eigen::MatrixXf weights;
    Eigen::VectorXf bias;
  };
  Eigen::RowVectorXf mean_, inverse_deviation_;
  std::array<Layer, 3> layers_;
};

}  // namespace mouthpiece
