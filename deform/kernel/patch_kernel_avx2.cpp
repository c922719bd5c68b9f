// Compiled with -mavx2 -mfma; only called on processors that have both. Fused multiply-adds are asked for by name, so
// the result does not depend on the compiler.
#include <immintrin.h>

#include "deform/kernel/patch_kernel.h"
#include "deform/kernel/scatter_eight.h"

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

inline void scatter(Lanes x, Lanes y, Lanes z, const std::uint32_t* to, float* out) {
  scatterEight(x.value, y.value, z.value, to, out);
}

}  // namespace
}  // namespace mouthpiece::kernel

#include "deform/kernel/patch_loops.h"

namespace mouthpiece::kernel {

extern const Kernels kAvx2Kernels;
const Kernels kAvx2Kernels{bound, loose, multiply};

}  // namespace mouthpiece::kernel
