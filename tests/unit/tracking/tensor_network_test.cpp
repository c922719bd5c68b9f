// Layers of a network as XNNPACK and we compute them, against plain loops over made-up ones.
#include "tracking/tensor_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "base/errors.h"

namespace mouthpiece {
namespace {

using Shape = std::vector<std::size_t>;
using Numbers = std::vector<float>;

constexpr double kRounding = 2e-5;

std::size_t sizeOf(const Shape& shape) {
  return std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
}

class Layers : public ::testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};
  std::size_t count(std::size_t least, std::size_t most) {
    return std::uniform_int_distribution<std::size_t>(least, most)(random_);
  }
  Numbers numbers(const Shape& shape) {
    std::uniform_real_distribution<float> any(-1, 1);
    Numbers made(sizeOf(shape));
    for (float& number : made) number = any(random_);
    return made;
  }
  /// height x width x channels of an image.
  Shape image() { return {1, count(3, 11), count(3, 11), count(1, 5)}; }

  std::size_t add(const Shape& shape, Numbers values = {}) {
    model_.tensors.push_back({shape, std::move(values), {}});
    return model_.tensors.size() - 1;
  }
  /// What comes out where `input` goes in.
  Numbers computed(const Numbers& input, std::span<const TensorNetwork::Region> regions = {}) {
    TensorNetwork network(model_, regions, "made up");
    EXPECT_EQ(network.input().size(), input.size());
    std::copy(input.begin(), input.end(), network.input().begin());
    network.run();
    network.run();  // a second time as the first
    EXPECT_EQ(network.outputCount(), model_.outputs.size());
    const auto out = network.output(0);
    return {out.begin(), out.end()};
  }
  static void expectNear(const Numbers& found, const Numbers& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      ASSERT_NEAR(found[i], expected[i], kRounding * (1 + std::abs(double{expected[i]}))) << i;
  }

  TfliteModel model_;
};
INSTANTIATE_TEST_SUITE_P(Seeds, Layers, ::testing::Range(1U, 16U));

/// Where the windows of a layer lie along one side: how many there are, and how far the first begins before the input.
struct Windows {
  std::size_t out;
  std::ptrdiff_t before;
  Windows(std::size_t in, std::size_t filter, std::size_t stride, bool same) {
    out = same ? (in + stride - 1) / stride : (in - filter) / stride + 1;
    const auto needed = static_cast<std::ptrdiff_t>((out - 1) * stride + filter) - static_cast<std::ptrdiff_t>(in);
    before = same ? std::max<std::ptrdiff_t>(0, needed) / 2 : 0;
  }
};

/// Calls `take(out row, out column, row, column, filter row, filter column)` for every place that a window covers.
template <typename Take>
void eachCovered(const Shape& in, const Windows& rows, const Windows& columns, std::size_t filter_y,
                 std::size_t filter_x, std::size_t stride_y, std::size_t stride_x, const Take& take) {
  for (std::size_t r = 0; r < rows.out; ++r) {
    for (std::size_t c = 0; c < columns.out; ++c) {
      for (std::size_t ky = 0; ky < filter_y; ++ky) {
        for (std::size_t kx = 0; kx < filter_x; ++kx) {
          const auto y = static_cast<std::ptrdiff_t>(r * stride_y + ky) - rows.before;
          const auto x = static_cast<std::ptrdiff_t>(c * stride_x + kx) - columns.before;
          if (y < 0 || x < 0 || y >= static_cast<std::ptrdiff_t>(in[1]) || x >= static_cast<std::ptrdiff_t>(in[2]))
            continue;
          take(r, c, static_cast<std::size_t>(y), static_cast<std::size_t>(x), ky, kx);
        }
      }
    }
  }
}

TEST_P(Layers, ConvolutionsAreSumsOverTheirWindows) {
  for (const bool is_depthwise : {false, true}) {
    model_ = {};
    const Shape in = image();
    const std::size_t outs = is_depthwise ? in[3] : count(1, 6);
    TensorStep step{.op = is_depthwise ? TensorOp::kDepthwiseConvolution : TensorOp::kConvolution,
                    .inputs = {},
                    .outputs = {},
                    .same_padding = count(0, 1) == 1,
                    .stride_x = count(1, 2),
                    .stride_y = count(1, 2)};
    const std::size_t filter_y = count(1, 3), filter_x = count(1, 3);
    const Windows rows(in[1], filter_y, step.stride_y, step.same_padding),
        columns(in[2], filter_x, step.stride_x, step.same_padding);
    const Shape filter_shape{is_depthwise ? 1 : outs, filter_y, filter_x, in[3]};
    const Numbers input = numbers(in), filter = numbers(filter_shape), bias = numbers({outs});
    model_.input = add(in);
    step.inputs = {model_.input, add(filter_shape, filter), add({outs}, bias)};
    const Shape out{1, rows.out, columns.out, outs};
    step.outputs = model_.outputs = {add(out)};
    model_.steps = {step};
    Numbers expected(sizeOf(out));
    for (std::size_t i = 0; i < expected.size(); ++i) expected[i] = bias[i % outs];
    eachCovered(in, rows, columns, filter_y, filter_x, step.stride_y, step.stride_x,
                [&](auto r, auto c, auto y, auto x, auto ky, auto kx) {
                  for (std::size_t o = 0; o < outs; ++o) {
                    float& sum = expected[(r * columns.out + c) * outs + o];
                    for (std::size_t i = 0; i < in[3]; ++i) {
                      if (is_depthwise && i != o) continue;
                      const std::size_t own = is_depthwise ? 0 : o;
                      sum += input[(y * in[2] + x) * in[3] + i] *
                             filter[((own * filter_y + ky) * filter_x + kx) * in[3] + i];
                    }
                  }
                });
    expectNear(computed(input), expected);
  }
}

TEST_P(Layers, PoolingTakesTheLargestOfItsWindow) {
  const Shape in{1, 2 * count(2, 5), 2 * count(2, 5), count(1, 5)};
  model_.input = add(in);
  const Windows rows(in[1], 2, 2, false), columns(in[2], 2, 2, false);
  const Shape out{1, rows.out, columns.out, in[3]};
  model_.outputs = {add(out)};
  model_.steps = {{.op = TensorOp::kMaxPooling,
                   .inputs = {model_.input},
                   .outputs = model_.outputs,
                   .same_padding = count(0, 1) == 1,
                   .stride_x = 2,
                   .stride_y = 2,
                   .filter_x = 2,
                   .filter_y = 2}};
  const Numbers input = numbers(in);
  Numbers expected(sizeOf(out), -9);
  eachCovered(in, rows, columns, 2, 2, 2, 2, [&](auto r, auto c, auto y, auto x, auto, auto) {
    for (std::size_t i = 0; i < in[3]; ++i) {
      float& most = expected[(r * columns.out + c) * in[3] + i];
      most = std::max(most, input[(y * in[2] + x) * in[3] + i]);
    }
  });
  expectNear(computed(input), expected);
}

/// Layers one after the other, some of them ours, which cut XNNPACK's into runs: relu, a slope a channel, a sum with
/// what went in, zeros around it, another shape, two side by side, times a number.
TEST_P(Layers, ChainsAreComputedStepByStep) {
  const Shape in = image();
  const Numbers input = numbers(in), slopes = numbers({1, 1, in[3]}), other = numbers(in);
  model_.input = add(in);
  const std::size_t slope = add({1, 1, in[3]}, slopes), constant = add(in, other), bent = add(in), summed = add(in),
                    cut = add(in);
  const std::size_t top = count(0, 2), bottom = count(0, 2), left = count(0, 2), right = count(1, 2);
  const Shape padded_shape{1, in[1] + top + bottom, in[2] + left + right, in[3]};
  const std::size_t paddings = add({4, 2}), padded = add(padded_shape);
  for (const std::size_t side :
       {std::size_t{0}, std::size_t{0}, top, bottom, left, right, std::size_t{0}, std::size_t{0}})
    model_.tensors[paddings].numbers.push_back(static_cast<std::int32_t>(side));
  const std::size_t total = sizeOf(padded_shape);
  const std::size_t flat = add({1, total}), scaled = add({1, total}), both = add({1, 2 * total});
  const std::size_t factor = add({1}, {1.75F});
  model_.steps = {{.op = TensorOp::kParametricRelu, .inputs = {model_.input, slope}, .outputs = {bent}},
                  {.op = TensorOp::kAdd, .inputs = {bent, constant}, .outputs = {summed}},
                  {.op = TensorOp::kRelu, .inputs = {summed}, .outputs = {cut}},
                  {.op = TensorOp::kPadding, .inputs = {cut, paddings}, .outputs = {padded}},
                  {.op = TensorOp::kReshape, .inputs = {padded}, .outputs = {flat}},
                  {.op = TensorOp::kMultiplication, .inputs = {flat, factor}, .outputs = {scaled}},
                  {.op = TensorOp::kConcatenation, .inputs = {flat, scaled}, .outputs = {both}}};
  model_.outputs = {both};
  Numbers expected(2 * total, 0.0F);
  for (std::size_t y = 0; y < in[1]; ++y) {
    for (std::size_t x = 0; x < in[2]; ++x) {
      for (std::size_t i = 0; i < in[3]; ++i) {
        const float value = input[(y * in[2] + x) * in[3] + i];
        const float sum = (value < 0 ? slopes[i] * value : value) + other[(y * in[2] + x) * in[3] + i];
        const std::size_t place = ((y + top) * padded_shape[2] + x + left) * in[3] + i;
        expected[place] = std::max(0.0F, sum);
        expected[total + place] = 1.75F * expected[place];
      }
    }
  }
  expectNear(computed(input), expected);
}

/// A region's own grid laid over the map: turned level with its lower edge and half as large again as its box, so that
/// points that go through the matrix come to lie where they are seen.
TEST_P(Layers, RegionsAreSeenLevelAndHalfAsLargeAgain) {
  std::uniform_real_distribution<float> any(0, 1);
  constexpr std::size_t kGrid = 16;
  const float turn = 1.2F * any(random_) - 0.6F, c = std::cos(turn), s = std::sin(turn);
  const float width = 6 + 10 * any(random_), height = 4 + 6 * any(random_), at_x = 20 + 10 * any(random_), at_y = 20;
  Numbers landmarks(3 * std::size_t{468}, 1000.0F);
  const std::vector<int> own{5, 9, 40, 300};
  const float corners[4][2] = {{-0.5F, -0.5F}, {0.5F, -0.5F}, {-0.5F, 0.5F}, {0.5F, 0.5F}};
  for (std::size_t k = 0; k < 4; ++k) {
    const float x = corners[k][0] * width, y = corners[k][1] * height;
    landmarks[3 * static_cast<std::size_t>(own[k])] = at_x + c * x - s * y;
    landmarks[3 * static_cast<std::size_t>(own[k]) + 1] = at_y + s * x + c * y;
  }
  const TensorNetwork::Region region{own, 40, 300};
  model_.input = add({1, 1, 1, 3 * 468});
  const std::size_t matrix = add({1, 4, 4}),
                    points = add({1, 4, 2}, {0, 0, kGrid, 0, 0, kGrid, kGrid / 2.0F, kGrid / 2.0F});
  const std::size_t map = add({1, 48, 64, 2}), seen = add({1, kGrid, kGrid, 2}), moved = add({1, 4, 2});
  // The map tells each of its pixels where it is.
  for (std::size_t y = 0; y < 48; ++y) {
    for (std::size_t x = 0; x < 64; ++x) {
      model_.tensors[map].values.push_back(static_cast<float>(x) + 0.5F);
      model_.tensors[map].values.push_back(static_cast<float>(y) + 0.5F);
    }
  }
  model_.steps = {{.op = TensorOp::kLandmarksToMatrix, .inputs = {model_.input}, .outputs = {matrix}},
                  {.op = TensorOp::kTransformTensor, .inputs = {map, matrix}, .outputs = {seen}},
                  {.op = TensorOp::kTransformLandmarks, .inputs = {points, matrix}, .outputs = {moved}}};
  const auto placeOf = [&](float u, float v) {  // of the grid, 0 to 1
    const float x = 1.5F * width * (u - 0.5F), y = 1.5F * height * (v - 0.5F);
    return std::array{at_x + c * x - s * y, at_y + s * x + c * y};
  };
  model_.outputs = {moved};
  const Numbers corners_seen = computed(landmarks, {&region, 1});
  const float places[4][2] = {{0, 0}, {1, 0}, {0, 1}, {0.5F, 0.5F}};
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t n = 0; n < 2; ++n)
      EXPECT_NEAR(corners_seen[2 * k + n], placeOf(places[k][0], places[k][1])[n], 1e-3F);
  }
  model_.outputs = {seen};
  const Numbers grid = computed(landmarks, {&region, 1});
  std::size_t inside = 0;
  for (std::size_t row = 0; row < kGrid; ++row) {
    for (std::size_t column = 0; column < kGrid; ++column) {
      const auto place = placeOf((static_cast<float>(column) + 0.5F) / kGrid, (static_cast<float>(row) + 0.5F) / kGrid);
      const float* found = &grid[2 * (row * kGrid + column)];
      const bool is_in = place[0] > 0.51F && place[0] < 63.49F && place[1] > 0.51F && place[1] < 47.49F;
      const bool is_out = place[0] < 0.49F || place[0] > 63.51F || place[1] < 0.49F || place[1] > 47.51F;
      for (std::size_t n = 0; n < 2; ++n) {
        if (is_in) {
          EXPECT_NEAR(found[n], place[n], 1e-3F) << row << " " << column;
        } else if (is_out) {
          EXPECT_EQ(found[n], 0) << "outside of the map";
        }
      }
      inside += is_in ? 1U : 0U;
    }
  }
  EXPECT_GT(inside, kGrid * kGrid / 2);
}

TEST(TensorNetwork, RefusesTensorsThatDoNotFitTheirOperator) {
  const auto refused = [](TensorOp op, const Shape& in, const Shape& other, const Shape& out) {
    TfliteModel model;
    model.tensors = {{in, {}, {}}, {other, Numbers(sizeOf(other), 0), {}}, {out, {}, {}}};
    model.steps = {{.op = op, .inputs = {0, 1}, .outputs = {2}}};
    model.outputs = {2};
    try {
      const TensorNetwork network(model, {}, "made up");
    } catch (const InputError& error) {
      return std::string(error.what()).starts_with("made up");
    }
    return false;
  };
  EXPECT_FALSE(refused(TensorOp::kReshape, {1, 2, 6}, {1}, {1, 12}));
  EXPECT_TRUE(refused(TensorOp::kReshape, {1, 2, 6}, {1}, {1, 13}));
  EXPECT_TRUE(refused(TensorOp::kConcatenation, {1, 4}, {1, 3}, {1, 8}));
  EXPECT_FALSE(refused(TensorOp::kConcatenation, {1, 4}, {1, 3}, {1, 7}));
  EXPECT_TRUE(refused(TensorOp::kMultiplication, {1, 4}, {2}, {1, 4}));
  EXPECT_TRUE(refused(TensorOp::kMultiplication, {1, 4}, {1}, {1, 5}));
  EXPECT_TRUE(refused(TensorOp::kLandmarksToMatrix, {1, 3 * 468}, {1}, {1, 16})) << "no region was given";
  EXPECT_TRUE(refused(TensorOp::kTransformTensor, {1, 4, 4, 2}, {1, 16}, {1, 4, 4, 3}));
  EXPECT_TRUE(refused(TensorOp::kTransformTensor, {1, 4, 4, 2}, {1, 15}, {1, 4, 4, 2}));
  EXPECT_TRUE(refused(TensorOp::kTransformLandmarks, {1, 5}, {1, 16}, {1, 5}));
  EXPECT_TRUE(refused(TensorOp::kConvolution, {1, 4, 4, 2}, {3, 1, 1, 2}, {1, 4, 4, 3})) << "without a bias";
}

}  // namespace
}  // namespace mouthpiece
