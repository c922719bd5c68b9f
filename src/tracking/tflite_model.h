#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// What an operator of a network does; those that MediaPipe's two face networks need.
enum class TensorOp : std::uint8_t {
  kAdd,
  kConcatenation,
  kConvolution,
  kDepthwiseConvolution,
  kMaxPooling,
  kMultiplication,
  kPadding,
  kParametricRelu,
  kRelu,
  kReshape,
  kLandmarksToMatrix,   ///< MediaPipe's Landmarks2TransformMatrix
  kTransformTensor,     ///< MediaPipe's TransformTensorBilinear
  kTransformLandmarks,  ///< MediaPipe's TransformLandmarks
};

struct TensorDescription {
  std::vector<std::size_t> shape;     ///< batch, height, width, channels
  std::vector<float> values;          ///< of a constant; empty for what is computed
  std::vector<std::int32_t> numbers;  ///< of a constant of whole numbers
};

struct TensorStep {
  TensorOp op = TensorOp::kAdd;
  std::vector<std::size_t> inputs, outputs;  ///< places in TfliteModel::tensors
  bool same_padding = false;                 ///< zeros around the input, as TensorFlow's SAME has them
  std::size_t stride_x = 1, stride_y = 1;
  std::size_t filter_x = 1, filter_y = 1;  ///< of kMaxPooling
};

/// A network of one graph in the order in which it is computed.
struct TfliteModel {
  std::vector<TensorDescription> tensors;
  std::vector<TensorStep> steps;
  std::size_t input = 0;
  std::vector<std::size_t> outputs;
};

/// Reads a TensorFlow Lite model (FlatBuffers, schema version 3); half-precision weights become single. Throws
/// InputError for what is no such model, is cut off, or has an operator that is not in TensorOp; `name` is for
/// messages.
TfliteModel parseTfliteModel(std::string_view bytes, std::string_view name);

}  // namespace mouthpiece
