#include "exports/shapes/trajectories.h"

namespace mouthpiece {
namespace {

// Vectors of the compiler's own kind, four or eight floats; they live in registers and never cross a call. Memory is
// read and written one vector at a time: copying whole rows makes the compiler keep them on the stack.
using Lanes4 = float __attribute__((vector_size(16)));
using Lanes8 = float __attribute__((vector_size(32)));
// clang 14 drops `aligned` from a `using`.
typedef float UnalignedLanes4 __attribute__((vector_size(16), aligned(4), may_alias));  // NOLINT(modernize-use-using)
typedef float UnalignedLanes8 __attribute__((vector_size(32), aligned(4), may_alias));  // NOLINT(modernize-use-using)

using Ints4 = std::int32_t __attribute__((vector_size(16)));
using Ints8 = std::int32_t __attribute__((vector_size(32)));
using Shorts4 = std::int16_t __attribute__((vector_size(8)));
using Shorts8 = std::int16_t __attribute__((vector_size(16)));
typedef std::int16_t UnalignedShorts4
    __attribute__((vector_size(8), aligned(2), may_alias));  // NOLINT(modernize-use-using)
typedef std::int16_t UnalignedShorts8
    __attribute__((vector_size(16), aligned(2), may_alias));  // NOLINT(modernize-use-using)

struct Narrow {
  using Lanes = Lanes4;
  using Ints = Ints4;
  using Shorts = Shorts4;
  using UnalignedShorts = UnalignedShorts4;
  static constexpr int kCount = 4;
  static constexpr int kRows = 2;  // two rows of six sums fill the sixteen registers
};
struct Wide {
  using Lanes = Lanes8;
  using Ints = Ints8;
  using Shorts = Shorts8;
  using UnalignedShorts = UnalignedShorts8;
  static constexpr int kCount = 8;
  static constexpr int kRows = 4;  // four rows of three sums
};

#define MOUTHPIECE_INLINE inline __attribute__((always_inline))

template <typename Width>
inline constexpr int kPerRow = static_cast<int>(kPanelWidth) / Width::kCount;
template <typename Width>
inline constexpr int kPerAxis = kPerRow<Width> / 3;

// No memcpy: g++ 12 would go over the stack.
MOUTHPIECE_INLINE void load(const float* from, Lanes4& lanes) {
  lanes = *reinterpret_cast<const UnalignedLanes4*>(from);
}
MOUTHPIECE_INLINE void load(const float* from, Lanes8& lanes) {
  lanes = *reinterpret_cast<const UnalignedLanes8*>(from);
}
MOUTHPIECE_INLINE void store(const Lanes4& lanes, float* to) { *reinterpret_cast<UnalignedLanes4*>(to) = lanes; }
MOUTHPIECE_INLINE void store(const Lanes8& lanes, float* to) { *reinterpret_cast<UnalignedLanes8*>(to) = lanes; }

/// Keeps max(|row|^2) of each vertex.
template <typename Width>
MOUTHPIECE_INLINE void keepLargestSquare(const typename Width::Lanes* row, typename Width::Lanes* largest) {
  constexpr int kAxis = kPerAxis<Width>;
  for (int i = 0; i < kAxis; ++i) {
    const auto square = row[i] * row[i] + row[i + kAxis] * row[i + kAxis] + row[i + 2 * kAxis] * row[i + 2 * kAxis];
    largest[i] = square > largest[i] ? square : largest[i];
  }
}

template <typename Width>
MOUTHPIECE_INLINE void loadDisplacements(const float* positions, std::ptrdiff_t row_stride, std::ptrdiff_t frames,
                                         const float* rest, float* panel, float* largest_squared) {
  typename Width::Lanes largest[kPerAxis<Width>] = {};
  typename Width::Lanes not_finite[kPerAxis<Width>] = {};  // a comparison would lose a NaN
  for (std::ptrdiff_t f = 0; f < frames; ++f) {
    const float* from = positions + f * row_stride;
    float* to = panel + f * kPanelWidth;
    for (std::ptrdiff_t v = 0; v < kPanelVertices; ++v) {
      to[v] = from[3 * v] - rest[3 * v];
      to[v + kPanelVertices] = from[3 * v + 1] - rest[3 * v + 1];
      to[v + 2 * kPanelVertices] = from[3 * v + 2] - rest[3 * v + 2];
    }
    typename Width::Lanes row[kPerRow<Width>];
    for (int i = 0; i < kPerRow<Width>; ++i) {
      load(to + i * Width::kCount, row[i]);
      not_finite[i % kPerAxis<Width>] += row[i] - row[i];
    }
    keepLargestSquare<Width>(row, largest);
  }
  for (int i = 0; i < kPerAxis<Width>; ++i) {
    largest[i] += not_finite[i];
    store(largest[i], largest_squared + i * Width::kCount);
  }
}

/// Rounded to the nearest whole number and held within 16 bits; 0 for no number.
template <typename Width>
MOUTHPIECE_INLINE typename Width::Shorts wholeSteps(typename Width::Lanes steps) {
  constexpr float kMost = 32'767;
  constexpr float kRounds = 0x1.8p23F;  // no room for fractions above it
  steps = steps > kMost ? typename Width::Lanes{} + kMost : steps;
  steps = steps < -kMost ? typename Width::Lanes{} - kMost : steps;
  steps = steps == steps ? steps : typename Width::Lanes{};
  return __builtin_convertvector(__builtin_convertvector((steps + kRounds) - kRounds, typename Width::Ints),
                                 typename Width::Shorts);
}

/// x y z x y z ... of eight vertices as x of all, y of all, z of all.
MOUTHPIECE_INLINE void storeApart(const std::int16_t* together, std::int16_t* apart) {
  const Shorts8 a = *reinterpret_cast<const UnalignedShorts8*>(together),
                b = *reinterpret_cast<const UnalignedShorts8*>(together + 8),
                c = *reinterpret_cast<const UnalignedShorts8*>(together + 16);
  const Shorts8 x = __builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, -1, -1);
  const Shorts8 y = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, -1, -1, -1);
  const Shorts8 z = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, -1, -1, -1);
  *reinterpret_cast<UnalignedShorts8*>(apart) = __builtin_shufflevector(x, c, 0, 1, 2, 3, 4, 5, 10, 13);
  *reinterpret_cast<UnalignedShorts8*>(apart + 8) = __builtin_shufflevector(y, c, 0, 1, 2, 3, 4, 8, 11, 14);
  *reinterpret_cast<UnalignedShorts8*>(apart + 16) = __builtin_shufflevector(z, c, 0, 1, 2, 3, 4, 9, 12, 15);
}

template <typename Width>
MOUTHPIECE_INLINE void storeSteps(const float* positions, std::ptrdiff_t row_stride, std::ptrdiff_t frames,
                                  const float* rest, float steps_a_unit, std::int16_t* steps, float* farthest) {
  typename Width::Lanes most[kPerRow<Width>], at_rest[kPerRow<Width>];
  for (int i = 0; i < kPerRow<Width>; ++i) {
    load(farthest + i * Width::kCount, most[i]);
    load(rest + i * Width::kCount, at_rest[i]);
  }
  std::int16_t row[kPanelWidth];
  for (std::ptrdiff_t f = 0; f < frames; ++f, steps += kPanelWidth) {
    const float* from = positions + f * row_stride;
    for (int i = 0; i < kPerRow<Width>; ++i) {
      typename Width::Lanes lanes;
      load(from + i * Width::kCount, lanes);
      lanes = (lanes - at_rest[i]) * steps_a_unit;
      const typename Width::Lanes away = lanes > -lanes ? lanes : -lanes;
      most[i] = away > most[i] ? away : most[i];
      most[i] += lanes - lanes;  // a comparison would lose a NaN
      *reinterpret_cast<typename Width::UnalignedShorts*>(row + i * Width::kCount) = wholeSteps<Width>(lanes);
    }
    storeApart(row, steps);
  }
  for (int i = 0; i < kPerRow<Width>; ++i) store(most[i], farthest + i * Width::kCount);
}

template <typename Width>
MOUTHPIECE_INLINE void loadSteps(const std::int16_t* steps, std::ptrdiff_t frames, float step, float* panel,
                                 float* largest_squared) {
  typename Width::Lanes largest[kPerAxis<Width>] = {};
  for (std::ptrdiff_t f = 0; f < frames; ++f, steps += kPanelWidth, panel += kPanelWidth) {
    typename Width::Lanes row[kPerRow<Width>];
    for (int i = 0; i < kPerRow<Width>; ++i) {
      const typename Width::Shorts shorts =
          *reinterpret_cast<const typename Width::UnalignedShorts*>(steps + i * Width::kCount);
      row[i] =
          step * __builtin_convertvector(__builtin_convertvector(shorts, typename Width::Ints), typename Width::Lanes);
      store(row[i], panel + i * Width::kCount);
    }
    keepLargestSquare<Width>(row, largest);
  }
  for (int i = 0; i < kPerAxis<Width>; ++i) store(largest[i], largest_squared + i * Width::kCount);
}

/// sums[r] = sum over p of factors[r][columnOf(p)] * panel[p], several rows side by side so that each panel row is
/// loaded once.
template <typename Width, typename ColumnOf>
MOUTHPIECE_INLINE void multiplyRows(const float* factors, std::ptrdiff_t row_stride, std::ptrdiff_t inner,
                                    const ColumnOf& columnOf, const float* panel,
                                    typename Width::Lanes (&sums)[Width::kRows][kPerRow<Width>]) {
  for (std::ptrdiff_t p = 0; p < inner; ++p) {
    typename Width::Lanes row[kPerRow<Width>];
    for (int i = 0; i < kPerRow<Width>; ++i) load(panel + p * kPanelWidth + i * Width::kCount, row[i]);
    const float* column = factors + columnOf(p);
    for (int r = 0; r < Width::kRows; ++r) {
      const float factor = column[r * row_stride];
      for (int i = 0; i < kPerRow<Width>; ++i) sums[r][i] += factor * row[i];
    }
  }
}

struct EveryColumn {
  MOUTHPIECE_INLINE std::ptrdiff_t operator()(std::ptrdiff_t p) const { return p; }
};
struct SomeColumns {
  const std::int32_t* columns;
  MOUTHPIECE_INLINE std::ptrdiff_t operator()(std::ptrdiff_t p) const { return columns[p]; }
};

template <typename Width>
MOUTHPIECE_INLINE void multiply(const float* factors, std::ptrdiff_t rows, std::ptrdiff_t inner, const float* panel,
                                float* product) {
  for (std::ptrdiff_t first = 0; first < rows; first += Width::kRows) {
    typename Width::Lanes sums[Width::kRows][kPerRow<Width>] = {};
    multiplyRows<Width>(factors + first * inner, inner, inner, EveryColumn{}, panel, sums);
    for (int r = 0; r < Width::kRows; ++r) {
      float* row = product + (first + r) * kPanelWidth;
      for (int i = 0; i < kPerRow<Width>; ++i) store(sums[r][i], row + i * Width::kCount);
    }
  }
}

template <typename Width>
MOUTHPIECE_INLINE void largestResidual(const float* weights, std::ptrdiff_t row_stride, std::ptrdiff_t frames,
                                       const std::int32_t* columns, std::ptrdiff_t shape_count, const float* panel,
                                       const float* shapes, float* largest_squared) {
  typename Width::Lanes largest[kPerAxis<Width>] = {};
  for (std::ptrdiff_t f = 0; f < frames; f += Width::kRows) {
    typename Width::Lanes sums[Width::kRows][kPerRow<Width>] = {};
    multiplyRows<Width>(weights + f * row_stride, row_stride, shape_count, SomeColumns{columns}, shapes, sums);
    for (int r = 0; r < Width::kRows; ++r) {
      const float* row = panel + (f + r) * kPanelWidth;
      for (int i = 0; i < kPerRow<Width>; ++i) {
        typename Width::Lanes wanted;
        load(row + i * Width::kCount, wanted);
        sums[r][i] = wanted - sums[r][i];
      }
      keepLargestSquare<Width>(sums[r], largest);
    }
  }
  for (int i = 0; i < kPerAxis<Width>; ++i) store(largest[i], largest_squared + i * Width::kCount);
}

void loadPortable(const float* positions, std::ptrdiff_t row_stride, std::ptrdiff_t frames, const float* rest,
                  float* panel, float* largest_squared) {
  loadDisplacements<Narrow>(positions, row_stride, frames, rest, panel, largest_squared);
}
void storeStepsPortable(const float* positions, std::ptrdiff_t row_stride, std::ptrdiff_t frames, const float* rest,
                        float steps_a_unit, std::int16_t* steps, float* farthest) {
  storeSteps<Narrow>(positions, row_stride, frames, rest, steps_a_unit, steps, farthest);
}
void loadStepsPortable(const std::int16_t* steps, std::ptrdiff_t frames, float step, float* panel,
                       float* largest_squared) {
  loadSteps<Narrow>(steps, frames, step, panel, largest_squared);
}
void multiplyPortable(const float* factors, std::ptrdiff_t rows, std::ptrdiff_t inner, const float* panel,
                      float* product) {
  multiply<Narrow>(factors, rows, inner, panel, product);
}
void residualPortable(const float* weights, std::ptrdiff_t row_stride, std::ptrdiff_t frames,
                      const std::int32_t* columns, std::ptrdiff_t shape_count, const float* panel, const float* shapes,
                      float* largest_squared) {
  largestResidual<Narrow>(weights, row_stride, frames, columns, shape_count, panel, shapes, largest_squared);
}
constexpr PanelKernels kPortable{loadPortable, storeStepsPortable, loadStepsPortable, multiplyPortable,
                                 residualPortable};

#if defined(__x86_64__)
#define MOUTHPIECE_AVX2 __attribute__((target("avx2")))
MOUTHPIECE_AVX2 void loadAvx2(const float* positions, std::ptrdiff_t row_stride, std::ptrdiff_t frames,
                              const float* rest, float* panel, float* largest_squared) {
  loadDisplacements<Wide>(positions, row_stride, frames, rest, panel, largest_squared);
}
MOUTHPIECE_AVX2 void storeStepsAvx2(const float* positions, std::ptrdiff_t row_stride, std::ptrdiff_t frames,
                                    const float* rest, float steps_a_unit, std::int16_t* steps, float* farthest) {
  storeSteps<Wide>(positions, row_stride, frames, rest, steps_a_unit, steps, farthest);
}
MOUTHPIECE_AVX2 void loadStepsAvx2(const std::int16_t* steps, std::ptrdiff_t frames, float step, float* panel,
                                   float* largest_squared) {
  loadSteps<Wide>(steps, frames, step, panel, largest_squared);
}
MOUTHPIECE_AVX2 void multiplyAvx2(const float* factors, std::ptrdiff_t rows, std::ptrdiff_t inner, const float* panel,
                                  float* product) {
  multiply<Wide>(factors, rows, inner, panel, product);
}
MOUTHPIECE_AVX2 void residualAvx2(const float* weights, std::ptrdiff_t row_stride, std::ptrdiff_t frames,
                                  const std::int32_t* columns, std::ptrdiff_t shape_count, const float* panel,
                                  const float* shapes, float* largest_squared) {
  largestResidual<Wide>(weights, row_stride, frames, columns, shape_count, panel, shapes, largest_squared);
}
constexpr PanelKernels kAvx2{loadAvx2, storeStepsAvx2, loadStepsAvx2, multiplyAvx2, residualAvx2};
#endif

}  // namespace

const PanelKernels& portablePanelKernels() { return kPortable; }

const PanelKernels& panelKernels() {
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (has_avx2) return kAvx2;
#endif
  return kPortable;
}

}  // namespace mouthpiece
