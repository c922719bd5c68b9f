// Compiled with -mavx512f -mavx512dq; only called on processors that have both. See patch_kernel_avx2.cpp.
#include <immintrin.h>

#include "deform/kernel/patch_kernel.h"
#include "deform/kernel/scatter_eight.h"

namespace mouthpiece::kernel {
namespace {

struct Lanes {
  static constexpr std::size_t kCount = 16;
  __m512 value;

  static Lanes all(float x) { return {_mm512_set1_ps(x)}; }
  static Lanes load(const float* from) { return {_mm512_loadu_ps(from)}; }
  void store(float* to) const { _mm512_storeu_ps(to, value); }
};

inline Lanes operator+(Lanes a, Lanes b) { return {_mm512_add_ps(a.value, b.value)}; }
inline Lanes operator-(Lanes a, Lanes b) { return {_mm512_sub_ps(a.value, b.value)}; }
inline Lanes operator*(Lanes a, Lanes b) { return {_mm512_mul_ps(a.value, b.value)}; }
inline Lanes operator/(Lanes a, Lanes b) { return {_mm512_div_ps(a.value, b.value)}; }
inline Lanes mulAdd(Lanes a, Lanes b, Lanes c) { return {_mm512_fmadd_ps(a.value, b.value, c.value)}; }
inline Lanes mulSub(Lanes a, Lanes b, Lanes c) { return {_mm512_fmsub_ps(a.value, b.value, c.value)}; }
inline Lanes squareRoot(Lanes a) { return {_mm512_sqrt_ps(a.value)}; }

inline void scatter(Lanes x, Lanes y, Lanes z, const std::uint32_t* to, float* out) {
  scatterEight(_mm512_castps512_ps256(x.value), _mm512_castps512_ps256(y.value), _mm512_castps512_ps256(z.value), to,
               out);
  scatterEight(_mm512_extractf32x8_ps(x.value, 1), _mm512_extractf32x8_ps(y.value, 1),
               _mm512_extractf32x8_ps(z.value, 1), to + 8, out);
}

}  // namespace
}  // namespace mouthpiece::kernel

#include "deform/kernel/patch_loops.h"

namespace mouthpiece::kernel {

extern const Kernels kAvx512Kernels;
const Kernels kAvx512Kernels{bound, loose, multiply};

}  // namespace mouthpiece::kernel
