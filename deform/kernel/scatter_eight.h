// Part of the x86 kernels: eight vertices from registers to their places. Local to each file that includes it.
#pragma once

#include <immintrin.h>

#include <cstdint>

namespace mouthpiece::kernel {
namespace {

/// Stores x y of one vertex as a pair, z behind it.
inline void storeVertex(float* place, __m128 xy_low, float z) {
  _mm_storel_pi(reinterpret_cast<__m64*>(place), xy_low);
  place[2] = z;
}

inline void scatterEight(__m256 x, __m256 y, __m256 z, const std::uint32_t* to, float* out) {
  const __m256 low = _mm256_unpacklo_ps(x, y);   // x0 y0 x1 y1 | x4 y4 x5 y5
  const __m256 high = _mm256_unpackhi_ps(x, y);  // x2 y2 x3 y3 | x6 y6 x7 y7
  alignas(32) float depth[8];
  _mm256_store_ps(depth, z);
  for (int half = 0; half < 2; ++half) {
    const __m128 first = half == 0 ? _mm256_castps256_ps128(low) : _mm256_extractf128_ps(low, 1);
    const __m128 second = half == 0 ? _mm256_castps256_ps128(high) : _mm256_extractf128_ps(high, 1);
    const std::uint32_t* at = to + 4 * half;
    const float* z_at = depth + 4 * half;
    storeVertex(out + at[0], first, z_at[0]);
    storeVertex(out + at[1], _mm_movehl_ps(first, first), z_at[1]);
    storeVertex(out + at[2], second, z_at[2]);
    storeVertex(out + at[3], _mm_movehl_ps(second, second), z_at[3]);
  }
}

}  // namespace
}  // namespace mouthpiece::kernel
