#include "hearing/tags/vowel_network.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {

extern const std::string_view kVowelWeights;

namespace {

constexpr std::string_view kMagic = "MPVOWEL3";
constexpr int kContext = 12;
constexpr int kInputs = kVowelFeatureCount * (2 * kContext + 1);
constexpr std::uint32_t kLayers = 3;
constexpr std::uint32_t kMostUnits = 1024;
constexpr std::uint32_t kMostMembers = 8;
constexpr Eigen::Index kBlockFrames = 256;  // what is taken to the first layer in one product

/// Half precision: a sign, five bits of exponent, ten of fraction.
float floatFromHalf(std::uint16_t half) {
  const int exponent = (half >> 10U) & 0x1FU;
  const int fraction = half & 0x3FFU;
  if (exponent == 0x1F) return std::numeric_limits<float>::quiet_NaN();
  const double size = exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(fraction + 1024, exponent - 25);
  return asFloat((half & 0x8000U) != 0 ? -size : size);
}

float readHalf(ByteReader& reader) {
  const float value = floatFromHalf(reader.readU16());
  if (!std::isfinite(value)) reader.fail("a weight is not finite; expected numbers");
  return value;
}

/// The next weights in half precision, row after row.
Eigen::MatrixXf readHalfMatrix(ByteReader& reader, std::uint32_t rows, std::uint32_t columns) {
  const std::size_t bytes = std::size_t{2} * rows * columns;
  if (reader.remaining() < bytes) {
    reader.fail(fmt::format("found {} bytes; expected {} x {} weights", reader.remaining(), rows, columns));
  }
  Eigen::MatrixXf matrix(rows, columns);
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) matrix(row, column) = readHalf(reader);
  }
  return matrix;
}

/// The next numbers in single precision.
Eigen::RowVectorXf readFloats(ByteReader& reader, Eigen::Index count) {
  Eigen::RowVectorXf values(count);
  for (float& value : values) {
    value = reader.readF32();
    if (!std::isfinite(value)) reader.fail("a number is not finite");
  }
  return values;
}

/// The softmax of every column of `scores`, as rows.
Eigen::MatrixXf softmaxOfColumns(const Eigen::MatrixXf& scores) {
  Eigen::MatrixXf result(scores.cols(), scores.rows());
  for (Eigen::Index k = 0; k < scores.cols(); ++k) {
    const Eigen::ArrayXf powers = (scores.col(k).array() - scores.col(k).maxCoeff()).exp();
    result.row(k) = (powers / powers.sum()).matrix().transpose();
  }
  return result;
}

template <typename Expression>
Eigen::ArrayXf sigmoid(const Expression& x) {
  return 1 / (1 + (-x).exp());
}

/// The frames first - 12 to first + count + 11 side by side, a column a frame; beyond the ends the end frames stay.
Eigen::MatrixXf contextOf(const VowelFeatures& normalised, Eigen::Index first, Eigen::Index count) {
  Eigen::MatrixXf columns(kInputs, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    for (Eigen::Index offset = 0; offset <= 2 * kContext; ++offset) {
      const Eigen::Index frame = std::clamp<Eigen::Index>(first + k + offset - kContext, 0, normalised.rows() - 1);
      columns.col(k).segment(offset * kVowelFeatureCount, kVowelFeatureCount) = normalised.row(frame).transpose();
    }
  }
  return columns;
}

/// What a layer remembers from frame to frame.
struct LayerState {
  Eigen::ArrayXf cell;
  Eigen::VectorXf output;
};

/// A long short-term memory over the columns of `drive` = W x + b, which become its outputs (first rows).
Eigen::MatrixXf runLayer(const Eigen::MatrixXf& drive, const Eigen::MatrixXf& from_state, LayerState& state) {
  const Eigen::Index units = from_state.cols();
  Eigen::MatrixXf outputs(units, drive.cols());
  Eigen::VectorXf gates(4 * units);
  for (Eigen::Index k = 0; k < drive.cols(); ++k) {
    gates = drive.col(k);
    gates.noalias() += from_state * state.output;
    const auto gate = gates.array();
    state.cell = sigmoid(gate.segment(units, units)) * state.cell +
                 sigmoid(gate.head(units)) * gate.segment(2 * units, units).tanh();
    state.output = (sigmoid(gate.tail(units)) * state.cell.tanh()).matrix();
    outputs.col(k) = state.output;
  }
  return outputs;
}

}  // namespace

void VowelNetwork::readPerceptrons(ByteReader& reader) {
  const std::uint32_t count = reader.readU32(), inputs = reader.readU32();
  const std::array<std::uint32_t, 2> hidden{reader.readU32(), reader.readU32()};
  recurrent_share_ = reader.readF32();
  const auto fits = [](std::uint32_t units) { return units >= 1 && units <= kMostUnits; };
  if (count < 1 || count > kMostMembers || inputs != VowelPerceptron::kInputs || !fits(hidden[0]) || !fits(hidden[1])) {
    reader.fail(fmt::format("found {} perceptrons of {} inputs, {} and {} units; expected 1 to {} of {}, at most {}",
                            count, inputs, hidden[0], hidden[1], kMostMembers, VowelPerceptron::kInputs, kMostUnits));
  }
  if (!(recurrent_share_ >= 0 && recurrent_share_ <= 1))
    reader.fail(fmt::format("found a share of {}; expected 0 to 1", recurrent_share_));
  for (std::uint32_t k = 0; k < count; ++k) perceptrons_.push_back(VowelPerceptron::read(reader, hidden));
}

VowelNetwork VowelNetwork::parse(std::string_view bytes, std::string_view name) {
  ByteReader reader(bytes, name);
  if (reader.readBytes(kMagic.size()) != kMagic) reader.fail("found another file; expected vowel network weights");
  const std::uint32_t members = reader.readU32();
  if (members < 1 || members > kMostMembers) {
    reader.fail(fmt::format("found {} networks; expected 1 to {}", members, kMostMembers));
  }
  const std::uint32_t inputs = reader.readU32(), layers = reader.readU32();
  const std::uint32_t units = reader.readU32(), classes = reader.readU32();
  if (inputs != kInputs || layers != kLayers || units < 1 || units > kMostUnits || classes != kSungVowelCount) {
    reader.fail(fmt::format("found {} inputs, {} layers of {} units, {} classes; expected {}, {} of at most {}, {}",
                            inputs, layers, units, classes, kInputs, kLayers, kMostUnits, kSungVowelCount));
  }
  VowelNetwork network;
  for (std::uint32_t k = 0; k < members; ++k) {
    Member member;
    member.mean = readFloats(reader, kVowelFeatureCount);
    member.inverse_deviation = readFloats(reader, kVowelFeatureCount);
    for (std::uint32_t layer = 0; layer < kLayers; ++layer) {
      Layer weights;
      weights.from_input = readHalfMatrix(reader, 4 * units, layer == 0 ? kInputs : units);
      weights.from_state = readHalfMatrix(reader, 4 * units, units);
      weights.bias = readHalfMatrix(reader, 4 * units, 1);
      member.layers.push_back(std::move(weights));
    }
    member.output = readHalfMatrix(reader, kSungVowelCount, units);
    member.output_bias = readHalfMatrix(reader, kSungVowelCount, 1);
    network.members_.push_back(std::move(member));
  }
  network.readPerceptrons(reader);
  network.adaptation_ = VowelAdaptation::read(reader);
  if (reader.remaining() != 0) reader.fail(fmt::format("found {} bytes more; expected the end", reader.remaining()));
  return network;
}

const VowelNetwork& VowelNetwork::shipped() {
  static const VowelNetwork network = parse(kVowelWeights, "vowel_network.weights");
  return network;
}

Eigen::MatrixXf VowelNetwork::Member::probabilities(const VowelFeatures& features) const {
  const VowelFeatures normalised = ((features.rowwise() - mean).array().rowwise() * inverse_deviation.array()).matrix();
  std::vector<LayerState> states;
  for (const Layer& layer : layers) {
    const Eigen::Index units = layer.from_state.cols();
    states.push_back({Eigen::ArrayXf::Zero(units), Eigen::VectorXf::Zero(units)});
  }
  Eigen::MatrixXf result(features.rows(), kSungVowelCount);
  for (Eigen::Index first = 0; first < features.rows(); first += kBlockFrames) {
    const Eigen::Index count = std::min(kBlockFrames, features.rows() - first);
    Eigen::MatrixXf values = contextOf(normalised, first, count);
    for (std::size_t i = 0; i < layers.size(); ++i) {
      Eigen::MatrixXf drive = layers[i].from_input * values;
      drive.colwise() += layers[i].bias;
      values = runLayer(drive, layers[i].from_state, states[i]);
    }
    Eigen::MatrixXf scores = output * values.cwiseMax(0.0F);
    scores.colwise() += output_bias;
    result.middleRows(first, count) = softmaxOfColumns(scores);
  }
  return result;
}

Eigen::MatrixXf VowelNetwork::probabilities(const VowelFeatures& features, const VowelEnvelopes& envelopes) const {
  MOUTHPIECE_EXPECT(features.cols() == kVowelFeatureCount && envelopes.levels.rows() == features.rows());
  Eigen::MatrixXf recurrent = Eigen::MatrixXf::Zero(features.rows(), kSungVowelCount), framewise = recurrent;
  for (const Member& member : members_) recurrent += member.probabilities(features);
  const VowelFeatures columns = perceptronColumns(features, envelopes);
  for (const VowelPerceptron& perceptron : perceptrons_) framewise += perceptron.probabilities(columns);
  return recurrent_share_ / asFloat(asReal(members_.size())) * recurrent +
         (1 - recurrent_share_) / asFloat(asReal(perceptrons_.size())) * framewise;
}

VowelFeatures perceptronColumns(const VowelFeatures& features, const VowelEnvelopes& envelopes) {
  MOUTHPIECE_EXPECT(features.cols() == kVowelFeatureCount && envelopes.levels.rows() == features.rows());
  VowelFeatures columns(features.rows(), VowelPerceptron::kColumns);
  columns.leftCols(kMelBandCount) = features.middleCols(kMfccCount, kMelBandCount);
  columns.rightCols(kMelBandCount) = withoutLoudMean(envelopes.levels, envelopes.levels).cast<float>();
  return columns;
}

VowelPerceptron VowelPerceptron::read(ByteReader& reader, const std::array<std::uint32_t, 2>& hidden) {
  VowelPerceptron perceptron;
  perceptron.mean_ = readFloats(reader, kColumns);
  perceptron.inverse_deviation_ = readFloats(reader, kColumns);
  std::uint32_t inputs = kInputs;
  for (std::size_t i = 0; i < perceptron.layers_.size(); ++i) {
    const std::uint32_t outputs = i < hidden.size() ? hidden[i] : std::uint32_t{kSungVowelCount};
    perceptron.layers_[i].weights = readHalfMatrix(reader, outputs, inputs);
    perceptron.layers_[i].bias = readHalfMatrix(reader, outputs, 1);
    inputs = outputs;
  }
  return perceptron;
}

Eigen::MatrixXf VowelPerceptron::probabilities(const VowelFeatures& columns) const {
  const VowelFeatures normalised =
      ((columns.rowwise() - mean_).array().rowwise() * inverse_deviation_.array()).matrix();
  Eigen::MatrixXf result(columns.rows(), kSungVowelCount);
  for (Eigen::Index first = 0; first < columns.rows(); first += kBlockFrames) {
    const Eigen::Index count = std::min(kBlockFrames, columns.rows() - first);
    Eigen::MatrixXf values(kInputs, count);
    for (Eigen::Index k = 0; k < count; ++k) {
      for (std::size_t i = 0; i < kOffsets.size(); ++i) {
        const Eigen::Index frame = std::clamp<Eigen::Index>(first + k + kOffsets[i], 0, columns.rows() - 1);
        values.col(k).segment(signedIndex(i) * kColumns, kColumns) = normalised.row(frame).transpose();
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

std::vector<VowelLikelihood> hearVowels(const AudioClip& clip) {
  const VowelNetwork& network = VowelNetwork::shipped();
  const VowelEnvelopes envelopes = vowelEnvelopes(clip);
  const Eigen::MatrixXf probabilities =
      network.adaptation().adapt(envelopes, network.probabilities(vowelFeatures(clip), envelopes));
  std::vector<VowelLikelihood> vowels;
  vowels.reserve(unsignedIndex(probabilities.rows()));
  for (Eigen::Index frame = 0; frame < probabilities.rows(); ++frame) {
    const auto p = probabilities.row(frame);
    vowels.push_back({.time = asReal(frame) / kVowelFeatureRateHz,
                      .a = p(0),
                      .e = p(1),
                      .i = p(2),
                      .o = p(3),
                      .u = p(4),
                      .silence = p(5)});
  }
  return vowels;
}

}  // namespace mouthpiece
