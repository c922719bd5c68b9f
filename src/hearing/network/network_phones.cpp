#include "hearing/network/network_phones.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/network/word_network.h"
#include "phonetics/language/phone.h"

namespace mouthpiece {

extern const std::string_view kPhoneWeights, kElsewhereWeights;

namespace {

constexpr std::string_view kMagic = "MPPHONE1";
/// Frames before and after the one that is told.
constexpr Eigen::Index kContext = 2;
constexpr std::uint32_t kMostUnits = 1024;
/// The network's logarithms count so much where both are asked, the ear's for the rest; so in a noisy sound, of which
/// the ear tells little.
constexpr double kNetworkShare = 0.7, kShareInNoise = 0.95, kShareElsewhere = 0.85;
/// A phone that one of them thinks less likely than this still may be.
constexpr float kLeastLikely = 1e-4F;

/// One hidden layer of rectified units. Numbers that it takes are brought to a mean of 0 and a deviation of 1.
struct Perceptron {
  Eigen::VectorXf mean, inverse_deviation;
  Eigen::MatrixXf hidden, output;  ///< units x numbers of all frames, phones x units
  Eigen::VectorXf hidden_bias, output_bias;
};

/// Row after row, the upper 16 bits of each number.
Eigen::MatrixXf readMatrix(ByteReader& reader, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXf matrix(rows, columns);
  for (Eigen::Index row = 0; row < rows; ++row) {
    for (Eigen::Index column = 0; column < columns; ++column)
      matrix(row, column) = std::bit_cast<float>(std::uint32_t{reader.readU16()} << 16U);
  }
  if (!matrix.allFinite()) reader.fail("a weight is not finite; expected numbers");
  return matrix;
}

Perceptron readPerceptron(std::string_view bytes, std::string_view name) {
  ByteReader reader(bytes, name);
  if (reader.readBytes(kMagic.size()) != kMagic) reader.fail("found another file; expected weights of phones");
  const std::uint32_t units = reader.readU32();
  if (units < 1 || units > kMostUnits) reader.fail(fmt::format("found {} units; expected 1 to {}", units, kMostUnits));
  constexpr Eigen::Index kInputs = (2 * kContext + 1) * WordNetwork::kEncodedNumbers;
  Perceptron read;
  read.mean = readMatrix(reader, WordNetwork::kEncodedNumbers, 1);
  read.inverse_deviation = readMatrix(reader, WordNetwork::kEncodedNumbers, 1);
  read.hidden = readMatrix(reader, units, kInputs);
  read.hidden_bias = readMatrix(reader, units, 1);
  read.output = readMatrix(reader, signedIndex(kPhoneCount), units);
  read.output_bias = readMatrix(reader, signedIndex(kPhoneCount), 1);
  if (reader.remaining() != 0) reader.fail(fmt::format("found {} bytes more; expected the end", reader.remaining()));
  return read;
}

/// What is heard of a language that the network never learnt is told by what people say there where such is heard.
const Perceptron& perceptronOf(const Language& language) {
  if (&language == &english()) {
    static const Perceptron kEnglish = readPerceptron(kPhoneWeights, "network_phones.weights");
    return kEnglish;
  }
  static const Perceptron kElsewhere = readPerceptron(kElsewhereWeights, "network_phones_elsewhere.weights");
  return kElsewhere;
}

}  // namespace

Eigen::MatrixXf phonesOfEncoded(const Eigen::MatrixXf& encoded, const Language& language) {
  const Perceptron& perceptron = perceptronOf(language);
  MOUTHPIECE_EXPECT(encoded.rows() == perceptron.mean.size() && encoded.cols() > 0);
  const Eigen::Index numbers = encoded.rows(), frames = encoded.cols();
  const Eigen::MatrixXf normalised =
      ((encoded.colwise() - perceptron.mean).array().colwise() * perceptron.inverse_deviation.array()).matrix();
  Eigen::MatrixXf context(perceptron.hidden.cols(), frames);
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    for (Eigen::Index at = 0; at <= 2 * kContext; ++at) {
      context.col(frame).segment(at * numbers, numbers) =
          normalised.col(std::clamp<Eigen::Index>(frame + at - kContext, 0, frames - 1));
    }
  }
  const Eigen::MatrixXf units = ((perceptron.hidden * context).colwise() + perceptron.hidden_bias).cwiseMax(0.0F);
  Eigen::MatrixXf phones = (perceptron.output * units).colwise() + perceptron.output_bias;
  for (auto column : phones.colwise()) {
    column = (column.array() - column.maxCoeff()).exp().matrix();
    column /= column.sum();
  }
  return phones;
}

Eigen::MatrixXf atFramesOfEar(const Eigen::MatrixXf& phones, Seconds start, Eigen::Index first, Eigen::Index count) {
  Eigen::MatrixXf at(phones.rows(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Seconds middle = kEarShift + (asReal(first + i) + 0.5) * kEarStep;
    const double place = std::clamp((middle - start) / WordNetwork::kEncodedStep - 0.5, 0.0, asReal(phones.cols() - 1));
    const auto before = static_cast<Eigen::Index>(place);
    const auto share = asFloat(place - asReal(before));
    at.col(i) = (1 - share) * phones.col(before) + share * phones.col(std::min(before + 1, phones.cols() - 1));
  }
  return at;
}

HeardPhones hearPhones(WordNetwork& network, std::span<const std::int16_t> samples, const Language& language) {
  constexpr Eigen::Index kPart = 1800, kBeside = 100;  // frames of 10 ms; an encoding of over 21 s is too long to read
  constexpr std::size_t kFrame = 160;                  // samples
  const auto frames = signedIndex((samples.size() + kFrame - 1) / kFrame);
  HeardPhones phones = HeardPhones::Constant(signedIndex(kPhoneCount), frames, asFloat(1.0 / asReal(kPhoneCount)));
  std::size_t asked = 0;
  for (Eigen::Index first = 0; first < frames; first += kPart) {
    const Eigen::Index count = std::min(kPart, frames - first), from = std::max<Eigen::Index>(0, first - kBeside);
    const std::size_t begin = unsignedIndex(from) * kFrame,
                      end = std::min(samples.size(), unsignedIndex(first + count + kBeside) * kFrame);
    if (++asked % WordNetwork::kAskedOfOneProgram == 0) network.endWaiting();
    const Eigen::MatrixXf encoded = network.encode(samples.subspan(begin, end - begin));
    if (encoded.cols() > 0)
      phones.middleCols(first, count) =
          atFramesOfEar(phonesOfEncoded(encoded, language), asReal(from) * kEarStep, first, count);
  }
  return phones;
}

HeardPhones phonesBesideText(WordNetwork& network, std::span<const std::int16_t> samples, const Language& language,
                             std::string& fault) {
  const bool is_known = &language == &english();
  if (!network.isThere() || (is_known && noisinessOf(samples) <= 0)) return {};
  try {
    return hearPhones(network, samples, language);
  } catch (const InputError& error) {
    fault = fmt::format("the network that hears phones was not heard ({})", error.what());
    return {};
  }
}

Eigen::MatrixXf heardByBoth(const Eigen::Ref<const Eigen::MatrixXf>& by_ear,
                            const Eigen::Ref<const Eigen::MatrixXf>& by_network, double noisiness,
                            const Language& language) {
  const double in_silence = &language == &english() ? kNetworkShare : kShareElsewhere;
  const auto share = asFloat(in_silence + noisiness * (kShareInNoise - in_silence));
  Eigen::MatrixXf both =
      (share * (by_network.array() + kLeastLikely).log() + (1 - share) * (by_ear.array() + kLeastLikely).log())
          .exp()
          .matrix();
  for (auto column : both.colwise()) column /= column.sum();
  return both;
}

}  // namespace mouthpiece
