#include "tracking/tflite_model.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

// Numbers of TensorFlow Lite's schema (schema_generated.h): fields by their place in their table.
constexpr std::size_t kMaxTensors = 20000;
constexpr std::size_t kMaxElements = std::size_t{1} << 24U;
constexpr int kFloat32 = 0, kFloat16 = 1, kInt32 = 2;
constexpr int kDequantize = 6, kStridedSlice = 45, kCustom = 32;

/// A FlatBuffers table: a place, and where its fields lie from there.
class Table {
 public:
  Table(std::string_view bytes, std::string_view name, std::size_t place) : bytes_(bytes), name_(name), place_(place) {
    const auto back = static_cast<std::int64_t>(reader(place).readI32());
    const std::int64_t table = static_cast<std::int64_t>(place) - back;
    if (table < 0) fail();
    vtable_ = unsignedIndex(table);
    vtable_bytes_ = reader(vtable_).readU16();
  }

  /// Where the field lies; nullopt when it has its usual value.
  [[nodiscard]] std::optional<std::size_t> find(std::size_t field) const {
    const std::size_t entry = 4 + 2 * field;
    if (entry + 2 > vtable_bytes_) return std::nullopt;
    const std::size_t offset = reader(vtable_ + entry).readU16();
    return offset == 0 ? std::nullopt : std::optional(place_ + offset);
  }

  [[nodiscard]] std::int32_t integer(std::size_t field) const {
    const auto place = find(field);
    return place ? reader(*place).readI32() : 0;
  }
  [[nodiscard]] int byte(std::size_t field) const {
    const auto place = find(field);
    return place ? reader(*place).readI8() : 0;
  }
  [[nodiscard]] std::size_t count(std::size_t field) const {
    const std::int32_t number = integer(field);
    if (number < 0) fail();
    return unsignedIndex(number);
  }

  /// First element and number of elements of a vector.
  [[nodiscard]] std::pair<std::size_t, std::size_t> vector(std::size_t field) const {
    const auto place = find(field);
    if (!place) return {0, 0};
    const std::size_t start = *place + reader(*place).readU32();
    const std::size_t size = reader(start).readU32();
    if (size > bytes_.size()) fail();
    return {start + 4, size};
  }

  [[nodiscard]] std::vector<std::size_t> indices(std::size_t field) const {
    const auto [first, size] = vector(field);
    std::vector<std::size_t> numbers;
    for (std::size_t i = 0; i < size; ++i) {
      const std::int32_t number = reader(first + 4 * i).readI32();
      if (number < 0) fail();
      numbers.push_back(unsignedIndex(number));
    }
    return numbers;
  }

  [[nodiscard]] std::vector<Table> tables(std::size_t field) const {
    const auto [first, size] = vector(field);
    std::vector<Table> found;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t place = first + 4 * i;
      found.emplace_back(bytes_, name_, place + reader(place).readU32());
    }
    return found;
  }

  [[nodiscard]] std::optional<Table> table(std::size_t field) const {
    const auto place = find(field);
    if (!place) return std::nullopt;
    return Table(bytes_, name_, *place + reader(*place).readU32());
  }

  [[nodiscard]] std::string_view text(std::size_t field) const {
    const auto [first, size] = vector(field);
    return reader(first).readBytes(size);
  }

  [[nodiscard]] ByteReader reader(std::size_t place) const {
    ByteReader at(bytes_, name_);
    at.seek(place);
    return at;
  }
  [[noreturn]] void fail() const { reader(0).fail("is no network that can be read; expected a TensorFlow Lite model"); }

 private:
  std::string_view bytes_, name_;
  std::size_t place_, vtable_ = 0, vtable_bytes_ = 0;
};

float floatFromHalf(std::uint16_t half) {
  const int exponent = (half >> 10U) & 31U;
  const auto mantissa = static_cast<float>(half & 1023U);
  const float magnitude = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024.0F + mantissa, exponent - 25);
  return (half & 0x8000U) != 0 ? -magnitude : magnitude;
}

TensorDescription tensorFrom(const Table& table, const std::vector<Table>& buffers) {
  TensorDescription tensor{table.indices(0), {}, {}};
  std::size_t elements = 1;
  for (const std::size_t size : tensor.shape) {
    if (size == 0 || size > kMaxElements / elements) table.fail();
    elements *= size;
  }
  const std::size_t buffer = table.count(2);
  if (buffer >= buffers.size()) table.fail();
  const auto [first, size] = buffers[buffer].vector(0);
  if (size == 0) return tensor;
  const int type = table.byte(1);
  if (size != elements * (type == kFloat16 ? 2 : 4)) table.fail();
  ByteReader data = table.reader(first);
  for (std::size_t i = 0; i < elements; ++i) {
    if (type == kFloat32) {
      tensor.values.push_back(data.readF32());
    } else if (type == kFloat16) {
      tensor.values.push_back(floatFromHalf(data.readU16()));
    } else if (type == kInt32) {
      tensor.numbers.push_back(data.readI32());
    } else {
      table.fail();
    }
  }
  return tensor;
}

/// nullopt for what is done while reading: weights made single, a slice that takes all.
std::optional<TensorOp> opFrom(int code, std::string_view custom, const Table& table) {
  switch (code) {
    case 0:
      return TensorOp::kAdd;
    case 2:
      return TensorOp::kConcatenation;
    case 3:
      return TensorOp::kConvolution;
    case 4:
      return TensorOp::kDepthwiseConvolution;
    case 17:
      return TensorOp::kMaxPooling;
    case 18:
      return TensorOp::kMultiplication;
    case 19:
      return TensorOp::kRelu;
    case 22:
      return TensorOp::kReshape;
    case 34:
      return TensorOp::kPadding;
    case 54:
      return TensorOp::kParametricRelu;
    case kDequantize:
    case kStridedSlice:
      return std::nullopt;
    case kCustom:
      if (custom == "Landmarks2TransformMatrix") return TensorOp::kLandmarksToMatrix;
      if (custom == "TransformTensorBilinear") return TensorOp::kTransformTensor;
      if (custom == "TransformLandmarks") return TensorOp::kTransformLandmarks;
      [[fallthrough]];
    default:
      table.reader(0).fail(fmt::format("has the operator {} {}, which is not known", code, printable(custom)));
  }
}

void readOptions(const Table& operation, TensorStep& step) {
  const auto options = operation.table(4);
  const bool has_stride = step.op == TensorOp::kConvolution || step.op == TensorOp::kDepthwiseConvolution ||
                          step.op == TensorOp::kMaxPooling;
  if (!options || !has_stride) return;
  step.same_padding = options->byte(0) == 0;
  step.stride_x = options->count(1);
  step.stride_y = options->count(2);
  if (step.op == TensorOp::kMaxPooling) {
    step.filter_x = options->count(3);
    step.filter_y = options->count(4);
  }
  if (step.stride_x == 0 || step.stride_y == 0) operation.fail();
}

}  // namespace

TfliteModel parseTfliteModel(std::string_view bytes, std::string_view name) {
  ByteReader header(bytes, name);
  const std::size_t root_place = header.readU32();
  if (bytes.size() < 8 || bytes.substr(4, 4) != "TFL3") header.fail("is no TensorFlow Lite model; expected TFL3 here");
  const Table root(bytes, name, root_place);
  const std::vector<Table> codes = root.tables(1), graphs = root.tables(2), buffers = root.tables(4);
  if (graphs.empty()) root.fail();
  const Table& graph = graphs.front();
  TfliteModel model;
  for (const Table& tensor : graph.tables(0)) model.tensors.push_back(tensorFrom(tensor, buffers));
  if (model.tensors.empty() || model.tensors.size() > kMaxTensors) root.fail();
  const auto checked = [&](std::vector<std::size_t> places) {
    for (const std::size_t place : places) {
      if (place >= model.tensors.size()) root.fail();
    }
    return places;
  };
  const std::vector<std::size_t> inputs = checked(graph.indices(1));
  if (inputs.size() != 1) root.fail();
  model.input = inputs.front();
  model.outputs = checked(graph.indices(2));
  for (const Table& operation : graph.tables(3)) {
    const std::size_t code = operation.count(0);
    if (code >= codes.size()) root.fail();
    const int number = codes[code].find(3) ? codes[code].integer(3) : codes[code].byte(0);
    const auto op = opFrom(number, codes[code].text(1), operation);
    TensorStep step;
    step.inputs = checked(operation.indices(1));
    step.outputs = checked(operation.indices(2));
    if (step.inputs.empty() || step.outputs.size() != 1) root.fail();
    if (!op && number == kDequantize) {
      model.tensors[step.outputs[0]].values = model.tensors[step.inputs[0]].values;
      continue;
    }
    step.op = op.value_or(TensorOp::kReshape);
    readOptions(operation, step);
    model.steps.push_back(std::move(step));
  }
  return model;
}

}  // namespace mouthpiece
