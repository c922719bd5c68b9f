// Compiled with -mavx2 -mfma; only called on processors that have both. Fused multiply-adds are asked for by name, so the
// result does not depend on the compiler.
#include <immintrin.h>

#include "deform/patch_kernel.h"

namespace mouthpiece::kernel {
namespace {

struct Lanes {
  static constexpr std::size_t kCount = 8;
  __m256 value;

  static Lanes all(float x) { return {_mm256_set1_ps(x)}; }
  static Lanes load(const float* from) { return {_mm256_loadu_ps(from)}; }
  void store(float* to) const { _mm256_storeu_ps(to, value); }
};

inline Lanes operator+(Lanes a, Lanes b) { return {_mm256_add_ps(a.value, b.value)}; }
inline Lanes operator-(Lanes a, Lanes b) { return {_mm256_sub_ps(a.value, b.value)}; }
inline Lanes operator*(Lanes a, Lanes b) { return {_mm256_mul_ps(a.value, b.value)}; }
inline Lanes operator/(Lanes a, Lanes b) { return {_mm256_div_ps(a.value, b.value)}; }
inline Lanes mulAdd(Lanes a, Lanes b, Lanes c) { return {_mm256_fmadd_ps(a.value, b.value, c.value)}; }
inline Lanes mulSub(Lanes a, Lanes b, Lanes c) { return {_mm256_fmsub_ps(a.value, b.value, c.value)}; }
inline Lanes squareRoot(Lanes a) { return {_mm256_sqrt_ps(a.value)}; }

/// Stores x y of one vertex as a pair, z behind it.
inline void storeVertex(float* out, std::uint32_t vertex, __m128 xy_low, float z) {
  float* to = out + 3 * static_cast<std::size_t>(vertex);
  _mm_storel_pi(reinterpret_cast<__m64*>(to), xy_low);
  to[2] = z;
}

inline void scatter(Lanes x, Lanes y, Lanes z, const std::uint32_t* vertex, float* out) {
  const __m256 low = _mm256_unpacklo_ps(x.value, y.value);   // x0 y0 x1 y1 | x4 y4 x5 y5
  const __m256 high = _mm256_unpackhi_ps(x.value, y.value);  // x2 y2 x3 y3 | x6 y6 x7 y7
  alignas(32) float depth[8];
  _mm256_store_ps(depth, z.value);
  for (int half = 0; half < 2; ++half) {
    const __m128 first = half == 0 ? _mm256_castps256_ps128(low) : _mm256_extractf128_ps(low, 1);
    const __m128 second = half == 0 ? _mm256_castps256_ps128(high) : _mm256_extractf128_ps(high, 1);
    const std::uint32_t* at = vertex + 4 * half;
    const float* z_at = depth + 4 * half;
    storeVertex(out, at[0], first, z_at[0]);
    storeVertex(out, at[1], _mm_movehl_ps(first, first), z_at[1]);
    storeVertex(out, at[2], second, z_at[2]);
    storeVertex(out, at[3], _mm_movehl_ps(second, second), z_at[3]);
  }
}

}  // namespace
}  // namespace mouthpiece::kernel

#include "deform/patch_loops.h"

namespace mouthpiece::kernel {

extern const Kernels kAvx2Kernels;
const Kernels kAvx2Kernels{bound, loose, multiply};

}  // namespace mouthpiece::kernel
