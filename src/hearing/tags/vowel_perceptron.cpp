#include "hearing/tags/vowel_perceptron.h"

#include <algorithm>

#include "hearing/tags/vowel_spectra.h"
#include "base/errors.h"
#include "hearing/tags/weight_reader.h"

namespace mouthpiece {
namespace {

constexpr std::uint32_t kClasses = 6;

}  // namespace

VowelFeatures perceptronColumns(const VowelFeatures& features, const VowelEnvelopes& envelopes) {
  MOUTHPIECE_EXPECT(features.cols() == kVowelFeatureCount && envelopes.levels.rows() == features.rows());
  Eigen::MatrixXd levels = envelopes.levels;
  takeOffLoudMean(levels, envelopes.levels);
  VowelFeatures columns(features.rows(), VowelPerceptron::kColumns);
  columns.leftCols(kMelBandCount) = features.middleCols(kMfccCount, kMelBandCount);
  columns.rightCols(kMelBandCount) = levels.cast<float>();
  return columns;
}

VowelPerceptron VowelPerceptron::read(ByteReader& reader, const std::array<std::uint32_t, 2>& hidden) {
  VowelPerceptron perceptron;
  perceptron.mean_ = readFloats(reader, kColumns);
  perceptron.inverse_deviation_ = readFloats(reader, kColumns);
  std::uint32_t inputs = kInputs;
  for (std::size_t i = 0; i < perceptron.layers_.size(); ++i) {
    const std::uint32_t outputs = i < hidden.size() ? hidden[i] : kClasses;
    perceptron.layers_[i].weights = readHalfMatrix(reader, outputs, inputs);
    perceptron.layers_[i].bias = readHalfMatrix(reader, outputs, 1);
    inputs = outputs;
  }
  return perceptron;
}

Eigen::MatrixXf VowelPerceptron::probabilities(const VowelFeatures& columns) const {
  constexpr Eigen::Index kBlockFrames = 256;
  const VowelFeatures normalised =
      ((columns.rowwise() - mean_).array().rowwise() * inverse_deviation_.array()).matrix();
  Eigen::MatrixXf result(columns.rows(), kClasses);
  for (Eigen::Index first = 0; first < columns.rows(); first += kBlockFrames) {
    const Eigen::Index count = std::min(kBlockFrames, columns.rows() - first);
    Eigen::MatrixXf values(kInputs, count);
    for (Eigen::Index k = 0; k < count; ++k) {
      for (std::size_t i = 0; i < kOffsets.size(); ++i) {
        const Eigen::Index frame = std::clamp<Eigen::Index>(first + k + kOffsets[i], 0, columns.rows() - 1);
        values.col(k).segment(static_cast<Eigen::Index>(i) * kColumns, kColumns) = normalised.row(frame).transpose();
      }
    }
    for (const Layer& layer : layers_) {
      if (&layer != &layers_.front()) values = values.cwiseMax(0.0F).eval();
      values = ((layer.weights * values).colwise() + layer.bias).eval();
    }
    result.middleRows(first, count) = softmaxOfColumns(values);
  }
  return result;
}

}  // namespace mouthpiece
