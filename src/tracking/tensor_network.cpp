#include "tracking/tensor_network.h"

#include <fmt/format.h>
#include <xnnpack.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <string>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

std::size_t elementsOf(const std::vector<std::size_t>& shape) {
  return std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
}

bool isLayer(TensorOp op) {
  switch (op) {
    case TensorOp::kAdd:
    case TensorOp::kConvolution:
    case TensorOp::kDepthwiseConvolution:
    case TensorOp::kMaxPooling:
    case TensorOp::kPadding:
    case TensorOp::kParametricRelu:
    case TensorOp::kRelu:
      return true;
    default:
      return false;
  }
}

std::uint32_t narrow(std::size_t number) { return static_cast<std::uint32_t>(number); }

/// Layers one behind the other, as one XNNPACK runtime.
class LayerRun {
 public:
  LayerRun(const TfliteModel& model, std::size_t first, std::size_t last, std::vector<std::vector<float>>& values,
           std::string_view name)
      : model_(model), name_(name) {
    externals(first, last);
    xnn_subgraph_t graph = nullptr;
    check(xnn_create_subgraph(narrow(external_.size()), 0, &graph));
    graph_.reset(graph);
    for (std::size_t step = first; step < last; ++step) define(model.steps[step]);
    xnn_runtime_t runtime = nullptr;
    check(xnn_create_runtime_v2(graph, nullptr, 0, &runtime));
    runtime_.reset(runtime);
    std::vector<xnn_external_value> places;
    for (const auto& [tensor, id] : external_) places.push_back({id, values[tensor].data()});
    check(xnn_setup_runtime(runtime, places.size(), places.data()));
  }

  void run() const { MOUTHPIECE_EXPECT(xnn_invoke_runtime(runtime_.get()) == xnn_status_success); }

 private:
  void check(xnn_status status) const {
    if (status != xnn_status_success)
      throw InputError(std::string(name_), "",
                       fmt::format("is a network that XNNPACK does not take (status {})", static_cast<int>(status)));
  }

  /// What goes in or comes out of this run of steps.
  void externals(std::size_t first, std::size_t last) {
    const auto use = [&](std::size_t tensor) {
      if (model_.tensors[tensor].values.empty() && model_.tensors[tensor].numbers.empty())
        external_.try_emplace(tensor, narrow(external_.size()));
    };
    for (std::size_t step = first; step < last; ++step) {
      for (const std::size_t input : model_.steps[step].inputs) {
        if (!made_.contains(input)) use(input);
      }
      for (const std::size_t output : model_.steps[step].outputs) made_.insert(output);
    }
    for (const std::size_t output : model_.outputs) {
      if (made_.contains(output)) use(output);
    }
    for (std::size_t step = 0; step < model_.steps.size(); ++step) {
      if (step >= first && step < last) continue;
      for (const std::size_t input : model_.steps[step].inputs) {
        if (made_.contains(input)) use(input);
      }
    }
  }

  std::uint32_t idOf(std::size_t tensor) {
    if (const auto known = ids_.find(tensor); known != ids_.end()) return known->second;
    const TensorDescription& description = model_.tensors[tensor];
    const auto external = external_.find(tensor);
    const bool is_external = external != external_.end();
    std::vector<std::size_t> shape = description.shape;
    const void* data = description.values.empty() ? nullptr : description.values.data();
    // XNNPACK wants a slope a channel in one dimension.
    if (data != nullptr && shape.size() == 3) shape.erase(shape.begin(), shape.end() - 1);
    std::uint32_t id = 0;
    check(xnn_define_tensor_value(graph_.get(), xnn_datatype_fp32, shape.size(), shape.data(), data,
                                  is_external ? external->second : XNN_INVALID_VALUE_ID,
                                  !is_external             ? 0
                                  : made_.contains(tensor) ? XNN_VALUE_FLAG_EXTERNAL_OUTPUT
                                                           : XNN_VALUE_FLAG_EXTERNAL_INPUT,
                                  &id));
    ids_[tensor] = id;
    return id;
  }

  void define(const TensorStep& step) {
    const float low = -std::numeric_limits<float>::infinity(), high = std::numeric_limits<float>::infinity();
    const std::uint32_t in = idOf(step.inputs[0]), out = idOf(step.outputs[0]);
    const std::uint32_t padding = step.same_padding ? XNN_FLAG_TENSORFLOW_SAME_PADDING : 0;
    const std::uint32_t stride_x = narrow(step.stride_x), stride_y = narrow(step.stride_y);
    switch (step.op) {
      case TensorOp::kAdd:
        return check(xnn_define_add2(graph_.get(), low, high, in, idOf(second(step)), out, 0));
      case TensorOp::kParametricRelu:
        return check(xnn_define_prelu(graph_.get(), in, idOf(second(step)), out, 0));
      case TensorOp::kRelu:
        return check(xnn_define_clamp(graph_.get(), 0, high, in, out, 0));
      case TensorOp::kMaxPooling:
        return check(xnn_define_max_pooling_2d(graph_.get(), 0, 0, 0, 0, narrow(step.filter_y), narrow(step.filter_x),
                                               stride_y, stride_x, 1, 1, low, high, in, out, padding));
      case TensorOp::kPadding:
        return definePadding(step, in, out);
      case TensorOp::kConvolution: {
        const auto [filter, bias] = weights(step);
        const auto& shape = model_.tensors[step.inputs[1]].shape;  // out, height, width, in
        return check(xnn_define_convolution_2d(graph_.get(), 0, 0, 0, 0, narrow(shape[1]), narrow(shape[2]), stride_y,
                                               stride_x, 1, 1, 1, shape[3], shape[0], low, high, in, filter, bias, out,
                                               padding));
      }
      case TensorOp::kDepthwiseConvolution: {
        const auto [filter, bias] = weights(step);
        const auto& shape = model_.tensors[step.inputs[1]].shape;  // 1, height, width, channels
        return check(xnn_define_depthwise_convolution_2d(graph_.get(), 0, 0, 0, 0, narrow(shape[1]), narrow(shape[2]),
                                                         stride_y, stride_x, 1, 1, 1, shape[3], low, high, in, filter,
                                                         bias, out, padding));
      }
      default:
        check(xnn_status_unsupported_parameter);
    }
  }

  [[nodiscard]] std::size_t second(const TensorStep& step) const {
    if (step.inputs.size() < 2) check(xnn_status_invalid_parameter);
    return step.inputs[1];
  }

  std::pair<std::uint32_t, std::uint32_t> weights(const TensorStep& step) {
    if (step.inputs.size() < 3 || model_.tensors[step.inputs[1]].shape.size() != 4 ||
        model_.tensors[step.inputs[1]].values.empty() || model_.tensors[step.inputs[2]].values.empty())
      check(xnn_status_invalid_parameter);
    return {idOf(step.inputs[1]), idOf(step.inputs[2])};
  }

  void definePadding(const TensorStep& step, std::uint32_t in, std::uint32_t out) {
    const std::vector<std::int32_t>& numbers = model_.tensors[second(step)].numbers;
    if (numbers.size() != 2 * model_.tensors[step.inputs[0]].shape.size()) check(xnn_status_invalid_parameter);
    std::vector<std::size_t> before, after;
    for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
      if (numbers[i] < 0 || numbers[i + 1] < 0) check(xnn_status_invalid_parameter);
      before.push_back(unsignedIndex(numbers[i]));
      after.push_back(unsignedIndex(numbers[i + 1]));
    }
    check(xnn_define_static_constant_pad(graph_.get(), before.data(), after.data(), 0, in, out, 0));
  }

  const TfliteModel& model_;
  std::string_view name_;
  std::map<std::size_t, std::uint32_t> external_;  ///< tensor -> XNNPACK's number
  std::map<std::size_t, std::uint32_t> ids_;
  std::set<std::size_t> made_;  ///< tensors that these layers compute
  /// Owned from the start on: a network that is refused half way leaves nothing behind.
  std::unique_ptr<xnn_subgraph, decltype(&xnn_delete_subgraph)> graph_{nullptr, &xnn_delete_subgraph};
  std::unique_ptr<xnn_runtime, decltype(&xnn_delete_runtime)> runtime_{nullptr, &xnn_delete_runtime};
};

/// Landmarks in a feature map's pixels -> the 4 x 4 matrix from a region's own grid to the map: the region's box,
/// turned level and one and a half times as large.
void landmarksToMatrix(std::span<const float> landmarks, const TensorNetwork::Region& region, double grid,
                       std::span<float> matrix) {
  const auto axis = [&](std::size_t landmark, std::size_t n) { return double{landmarks[3 * landmark + n]}; };
  const double turn = std::atan2(axis(region.left_end, 1) - axis(region.right_end, 1),
                                 axis(region.left_end, 0) - axis(region.right_end, 0));
  const double c = std::cos(turn), s = std::sin(turn);
  double low_x = 1e9, low_y = 1e9, high_x = -1e9, high_y = -1e9;
  for (const int landmark : region.landmarks) {
    const double x = axis(unsignedIndex(landmark), 0), y = axis(unsignedIndex(landmark), 1);
    low_x = std::min(low_x, c * x + s * y), high_x = std::max(high_x, c * x + s * y);
    low_y = std::min(low_y, c * y - s * x), high_y = std::max(high_y, c * y - s * x);
  }
  const double middle_x = (low_x + high_x) / 2, middle_y = (low_y + high_y) / 2;
  const double scale_x = 1.5 * (high_x - low_x) / grid, scale_y = 1.5 * (high_y - low_y) / grid;
  const double shift_x = middle_x - scale_x * grid / 2, shift_y = middle_y - scale_y * grid / 2;
  std::fill(matrix.begin(), matrix.end(), 0.0F);
  matrix[0] = asFloat(c * scale_x), matrix[1] = asFloat(-s * scale_y), matrix[3] = asFloat(c * shift_x - s * shift_y);
  matrix[4] = asFloat(s * scale_x), matrix[5] = asFloat(c * scale_y), matrix[7] = asFloat(s * shift_x + c * shift_y);
  matrix[10] = matrix[15] = 1;
}

/// The map seen through the matrix, bilinear between the middles of its pixels; zero outside.
void transformTensor(std::span<const float> map, const std::vector<std::size_t>& map_shape,
                     std::span<const float> matrix, std::span<float> grid, const std::vector<std::size_t>& shape) {
  const std::size_t height = map_shape[1], width = map_shape[2], channels = map_shape[3];
  std::fill(grid.begin(), grid.end(), 0.0F);
  for (std::size_t row = 0; row < shape[1]; ++row) {
    for (std::size_t column = 0; column < shape[2]; ++column) {
      const double u = asReal(column) + 0.5, v = asReal(row) + 0.5;
      const double x = matrix[0] * u + matrix[1] * v + matrix[3] - 0.5;
      const double y = matrix[4] * u + matrix[5] * v + matrix[7] - 0.5;
      if (!(x >= 0 && x <= asReal(width - 1) && y >= 0 && y <= asReal(height - 1))) continue;
      const auto left = static_cast<std::size_t>(x), top = static_cast<std::size_t>(y);
      const std::size_t right = std::min(left + 1, width - 1), bottom = std::min(top + 1, height - 1);
      const float a = asFloat(x - asReal(left)), b = asFloat(y - asReal(top));
      float* out = &grid[(row * shape[2] + column) * channels];
      const auto corner = [&](std::size_t r, std::size_t c) { return &map[(r * width + c) * channels]; };
      const float *q11 = corner(top, left), *q21 = corner(top, right), *q12 = corner(bottom, left),
                  *q22 = corner(bottom, right);
      for (std::size_t i = 0; i < channels; ++i)
        out[i] = (1 - b) * ((1 - a) * q11[i] + a * q21[i]) + b * ((1 - a) * q12[i] + a * q22[i]);
    }
  }
}

void transformLandmarks(std::span<const float> from, std::span<const float> matrix, std::span<float> to) {
  for (std::size_t i = 0; i + 1 < from.size(); i += 2) {
    to[i] = matrix[0] * from[i] + matrix[1] * from[i + 1] + matrix[3];
    to[i + 1] = matrix[4] * from[i] + matrix[5] * from[i + 1] + matrix[7];
  }
}

}  // namespace

class TensorNetwork::Parts {
 public:
  Parts(TfliteModel model, std::span<const Region> regions, std::string_view name)
      : model_(std::move(model)), name_(name), regions_(regions.begin(), regions.end()) {
    if (xnn_initialize(nullptr) != xnn_status_success)
      throw InputError(name_, "", "cannot be run: XNNPACK does not know this processor");
    checkShapes();
    for (const TensorDescription& tensor : model_.tensors) {
      std::vector<float> value = tensor.values;
      // XNNPACK may read a little past the end.
      if (value.empty()) value.resize(elementsOf(tensor.shape) + XNN_EXTRA_BYTES / sizeof(float));
      values_.push_back(std::move(value));
    }
    for (std::size_t step = 0; step < model_.steps.size();) {
      std::size_t last = step;
      while (last < model_.steps.size() && isLayer(model_.steps[last].op)) ++last;
      runs_.push_back(last > step ? std::make_unique<LayerRun>(model_, step, last, values_, name_) : nullptr);
      starts_.push_back(step);
      step = std::max(last, step + 1);
    }
  }

  [[nodiscard]] std::span<float> value(std::size_t tensor) {
    return {values_[tensor].data(), elementsOf(model_.tensors[tensor].shape)};
  }
  [[nodiscard]] const TfliteModel& model() const { return model_; }

  void run() {
    std::size_t region = 0;
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      if (runs_[i] != nullptr) {
        runs_[i]->run();
      } else {
        runHere(model_.steps[starts_[i]], region);
      }
    }
  }

 private:
  [[noreturn]] void refuse() const {
    throw InputError(name_, "", "has an operator whose tensors do not fit; expected one of MediaPipe's face networks");
  }

  /// The steps that are not XNNPACK's have tensors of the sizes they are computed with.
  void checkShapes() const {
    std::size_t region = 0;
    for (const TensorStep& step : model_.steps) {
      if (isLayer(step.op)) continue;
      const auto elements = [&](std::size_t tensor) { return elementsOf(model_.tensors[tensor].shape); };
      const auto& shape = model_.tensors[step.outputs[0]].shape;
      const std::size_t in = elements(step.inputs[0]), out = elements(step.outputs[0]);
      const std::size_t other = step.inputs.size() > 1 ? elements(step.inputs[1]) : 0;
      bool fits = true;
      switch (step.op) {
        case TensorOp::kReshape:
          fits = in == out;
          break;
        case TensorOp::kConcatenation:
          fits = in + other == out && step.inputs.size() == 2;
          break;
        case TensorOp::kMultiplication:
          fits = in == out && (other == 1 || other == in);
          break;
        case TensorOp::kLandmarksToMatrix:
          fits = in == 3 * 468 && out == 16 && region++ < regions_.size();
          break;
        case TensorOp::kTransformTensor:
          fits = other == 16 && shape.size() == 4 && model_.tensors[step.inputs[0]].shape.size() == 4 &&
                 shape[3] == model_.tensors[step.inputs[0]].shape[3];
          break;
        default:
          fits = other == 16 && in == out && in % 2 == 0;
          break;
      }
      if (!fits) refuse();
    }
  }

  void runHere(const TensorStep& step, std::size_t& region) {
    const std::span<float> in = value(step.inputs[0]), out = value(step.outputs[0]);
    const std::span<float> other = step.inputs.size() > 1 ? value(step.inputs[1]) : std::span<float>();
    const auto& shape = model_.tensors[step.outputs[0]].shape;
    switch (step.op) {
      case TensorOp::kConcatenation: {
        std::copy(in.begin(), in.end(), out.begin());
        std::copy(other.begin(), other.end(), out.begin() + signedIndex(in.size()));
        return;
      }
      case TensorOp::kMultiplication:
        for (std::size_t i = 0; i < in.size(); ++i) out[i] = in[i] * other[other.size() == 1 ? 0 : i];
        return;
      case TensorOp::kLandmarksToMatrix:
        return landmarksToMatrix(in, regions_[region++], kRegionGrid, out);
      case TensorOp::kTransformTensor:
        return transformTensor(in, model_.tensors[step.inputs[0]].shape, other, out, shape);
      case TensorOp::kTransformLandmarks:
        return transformLandmarks(in, other, out);
      default:
        std::copy(in.begin(), in.end(), out.begin());
    }
  }

  /// Rows and columns of what a region's own network sees.
  static constexpr double kRegionGrid = 16;

  TfliteModel model_;
  std::string name_;
  std::vector<Region> regions_;
  std::vector<std::vector<float>> values_;
  std::vector<std::unique_ptr<LayerRun>> runs_;  ///< null: one step of ours
  std::vector<std::size_t> starts_;
};

TensorNetwork::TensorNetwork(TfliteModel model, std::span<const Region> regions, std::string_view name)
    : parts_(std::make_unique<Parts>(std::move(model), regions, name)) {}
TensorNetwork::~TensorNetwork() = default;

std::span<float> TensorNetwork::input() { return parts_->value(parts_->model().input); }
void TensorNetwork::run() { parts_->run(); }
std::size_t TensorNetwork::outputCount() const { return parts_->model().outputs.size(); }
std::span<const float> TensorNetwork::output(std::size_t number) const {
  return parts_->value(parts_->model().outputs[number]);
}

}  // namespace mouthpiece
