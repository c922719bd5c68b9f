#include "hearing/alignment/senone_kernels.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <numbers>

#include "base/index.h"

namespace mouthpiece {
namespace {

#if defined(__x86_64__)
#define MOUTHPIECE_AVX2 __attribute__((target("avx2")))

constexpr std::size_t kLanes = 8;

MOUTHPIECE_AVX2 inline __m256 all(float x) { return _mm256_set1_ps(x); }
MOUTHPIECE_AVX2 inline __m256 timesPlus(__m256 a, __m256 b, __m256 c) { return _mm256_add_ps(_mm256_mul_ps(a, b), c); }

/// Whole numbers in the order of the values, of equal ones the earlier place first: their larger and smaller are found
/// without a branch, which would be guessed wrong half of the time.
std::int64_t keyOf(float value, Eigen::Index place) {
  auto bits = std::bit_cast<std::int32_t>(value);
  bits ^= (bits >> 31) & std::numeric_limits<std::int32_t>::max();
  return (std::int64_t{bits} << 32) | (std::numeric_limits<std::uint32_t>::max() - static_cast<std::uint32_t>(place));
}
Eigen::Index placeOf(std::int64_t key) {
  return std::numeric_limits<std::uint32_t>::max() - static_cast<std::uint32_t>(key);
}

/// kRegisters * kLanes rows from `first` on.
template <std::size_t kRegisters>
MOUTHPIECE_AVX2 void multiplyRows(const Eigen::MatrixXf& gaussians, Eigen::Index first, const float* terms,
                                  float* densities) {
  const Eigen::Index rows = gaussians.rows();
  __m256 sums[kRegisters];
#pragma GCC unroll 8
  for (std::size_t r = 0; r < kRegisters; ++r) sums[r] = _mm256_setzero_ps();
  const float* factors = gaussians.data() + first;
  for (Eigen::Index term = 0; term < gaussians.cols(); ++term, factors += rows) {
    const __m256 value = all(terms[term]);
#pragma GCC unroll 8
    for (std::size_t r = 0; r < kRegisters; ++r)
      sums[r] = _mm256_add_ps(_mm256_mul_ps(_mm256_loadu_ps(factors + kLanes * r), value), sums[r]);
  }
#pragma GCC unroll 8
  for (std::size_t r = 0; r < kRegisters; ++r) _mm256_storeu_ps(densities + first + kLanes * r, sums[r]);
}

MOUTHPIECE_AVX2 void findAvx2(const Eigen::MatrixXf& gaussians, const float* terms,
                              const std::array<Eigen::Index, 4>& likely, float* densities, LikeliestDensities& found) {
  constexpr std::size_t kRegisters = 8;
  constexpr Eigen::Index kAtOnce = kRegisters * kLanes;
  Eigen::Index first = 0;
  for (; first + kAtOnce <= gaussians.rows(); first += kAtOnce)
    multiplyRows<kRegisters>(gaussians, first, terms, densities);
  for (; first < gaussians.rows(); first += signedIndex(kLanes)) multiplyRows<1>(gaussians, first, terms, densities);
  // As many are no less than the least of these, so that what is less is not kept.
  float least = densities[likely[0]];
  for (const Eigen::Index place : likely) least = std::min(least, densities[place]);
  const __m256 least_of_all = all(least);
  constexpr Eigen::Index kMaskBits = 64;
  std::array<std::int64_t, 4> keys;
  keys.fill(std::numeric_limits<std::int64_t>::min());
  for (first = 0; first < gaussians.rows(); first += kMaskBits) {
    std::uint64_t kept = 0;
    const Eigen::Index end = std::min(first + kMaskBits, gaussians.rows());
    for (Eigen::Index i = first; i < end; i += signedIndex(kLanes)) {
      const __m256 is_kept = _mm256_cmp_ps(_mm256_loadu_ps(densities + i), least_of_all, _CMP_GE_OQ);
      kept |= std::uint64_t{static_cast<unsigned>(_mm256_movemask_ps(is_kept))} << (i - first);
    }
    for (; kept != 0; kept &= kept - 1) {
      const Eigen::Index place = first + __builtin_ctzll(kept);
      std::int64_t key = keyOf(densities[place], place);
      for (std::int64_t& better : keys) {
        const std::int64_t larger = std::max(better, key);
        key = std::min(better, key);
        better = larger;
      }
    }
  }
  for (std::size_t k = 0; k < keys.size() && keys[k] != std::numeric_limits<std::int64_t>::min(); ++k) {
    found.density[k] = placeOf(keys[k]);
    found.log_density[k] = densities[found.density[k]];
  }
}

MOUTHPIECE_AVX2 float mixAvx2(const MixedStream* streams, std::size_t stream_count, Eigen::Index senones,
                              float* likelihoods) {
  __m256 most = _mm256_setzero_ps();
  Eigen::Index i = 0;
  for (; i + signedIndex(kLanes) <= senones; i += signedIndex(kLanes)) {
    __m256 product{};
    for (std::size_t s = 0; s < stream_count; ++s) {
      const MixedStream& stream = streams[s];
      __m256 sum = _mm256_mul_ps(_mm256_loadu_ps(stream.weights[0] + i), all(stream.shares[0]));
      for (std::size_t k = 1; k < stream.weights.size(); ++k)
        sum = _mm256_add_ps(sum, _mm256_mul_ps(_mm256_loadu_ps(stream.weights[k] + i), all(stream.shares[k])));
      product = s == 0 ? sum : _mm256_mul_ps(product, sum);
    }
    _mm256_storeu_ps(likelihoods + i, product);
    most = _mm256_max_ps(most, product);
  }
  alignas(32) float lanes[kLanes];
  _mm256_store_ps(lanes, most);
  float largest = *std::max_element(lanes, lanes + kLanes);
  for (; i < senones; ++i) {
    float product = 0;
    for (std::size_t s = 0; s < stream_count; ++s) {
      const MixedStream& stream = streams[s];
      float sum = stream.weights[0][i] * stream.shares[0];
      for (std::size_t k = 1; k < stream.weights.size(); ++k) sum += stream.weights[k][i] * stream.shares[k];
      product = s == 0 ? sum : product * sum;
    }
    likelihoods[i] = product;
    largest = std::max(largest, product);
  }
  return largest;
}

/// Cephes' logarithm in Eigen's order of operations, of numbers between the least normal one and 1.
MOUTHPIECE_AVX2 __m256 logOf(__m256 value) {
  const __m256i bits = _mm256_castps_si256(value);
  __m256 exponent = _mm256_cvtepi32_ps(_mm256_sub_epi32(_mm256_srli_epi32(bits, 23), _mm256_set1_epi32(126)));
  __m256 x = _mm256_castsi256_ps(_mm256_or_si256(_mm256_and_si256(bits, _mm256_set1_epi32(0x007FFFFF)),
                                                 _mm256_set1_epi32(0x3F000000)));  // 0.5 to 1
  const __m256 is_low = _mm256_cmp_ps(x, all(0.707106781186547524F), _CMP_LT_OQ), low = _mm256_and_ps(x, is_low);
  x = _mm256_add_ps(_mm256_sub_ps(x, all(1)), low);
  exponent = _mm256_sub_ps(exponent, _mm256_and_ps(all(1), is_low));
  const __m256 x2 = _mm256_mul_ps(x, x), x3 = _mm256_mul_ps(x2, x);
  const __m256 first = timesPlus(timesPlus(all(7.0376836292E-2F), x, all(-1.1514610310E-1F)), x, all(1.1676998740E-1F));
  const __m256 second =
      timesPlus(timesPlus(all(-1.2420140846E-1F), x, all(1.4249322787E-1F)), x, all(-1.6668057665E-1F));
  const __m256 third = timesPlus(timesPlus(all(2.0000714765E-1F), x, all(-2.4999993993E-1F)), x, all(3.3333331174E-1F));
  const __m256 sum = _mm256_mul_ps(timesPlus(timesPlus(first, x3, second), x3, third), x3);
  x = _mm256_add_ps(x, timesPlus(all(-0.5F), x2, sum));
  return timesPlus(exponent, all(std::numbers::ln2_v<float>), x);
}

MOUTHPIECE_AVX2 void scoreAvx2(const float* likelihoods, Eigen::Index senones, float best, float unit,
                               std::int16_t* scores) {
  for (Eigen::Index first = 0; first < senones; first += signedIndex(kLanes)) {
    const std::size_t count = std::min(kLanes, unsignedIndex(senones - first));
    alignas(32) std::array<float, kLanes> values;
    values.fill(best);
    std::copy_n(likelihoods + first, count, values.begin());
    const __m256 share =
        _mm256_max_ps(_mm256_div_ps(_mm256_load_ps(values.data()), all(best)), all(std::numeric_limits<float>::min()));
    const __m256 score = _mm256_add_ps(_mm256_mul_ps(logOf(share), all(unit)), all(0.5F));
    alignas(32) std::array<std::int32_t, kLanes> whole;
    _mm256_store_si256(reinterpret_cast<__m256i*>(whole.data()), _mm256_cvttps_epi32(score));
    for (std::size_t i = 0; i < count; ++i) scores[first + signedIndex(i)] = static_cast<std::int16_t>(whole[i]);
  }
}

constexpr SenoneKernels kAvx2{findAvx2, mixAvx2, scoreAvx2};
#endif

}  // namespace

const SenoneKernels* senoneKernels() {
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (has_avx2) return &kAvx2;
#endif
  return nullptr;
}

}  // namespace mouthpiece
