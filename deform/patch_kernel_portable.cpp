#include "deform/patch_kernel.h"

#include <cmath>

namespace mouthpiece::kernel {
namespace {

/// Four floats; the compiler makes them one register where the processor has such (SSE2, NEON).
struct Lanes {
  static constexpr std::size_t kCount = 4;
  using Vector = float __attribute__((vector_size(16)));
  Vector value;

  static Lanes all(float x) { return {Vector{x, x, x, x}}; }
  static Lanes load(const float* from) { return {Vector{from[0], from[1], from[2], from[3]}}; }
  void store(float* to) const {
    for (int i = 0; i < 4; ++i) to[i] = value[i];
  }
};

inline Lanes operator+(Lanes a, Lanes b) { return {a.value + b.value}; }
inline Lanes operator-(Lanes a, Lanes b) { return {a.value - b.value}; }
inline Lanes operator*(Lanes a, Lanes b) { return {a.value * b.value}; }
inline Lanes operator/(Lanes a, Lanes b) { return {a.value / b.value}; }
inline Lanes mulAdd(Lanes a, Lanes b, Lanes c) { return {a.value * b.value + c.value}; }
inline Lanes mulSub(Lanes a, Lanes b, Lanes c) { return {a.value * b.value - c.value}; }
inline Lanes squareRoot(Lanes a) { return {Lanes::Vector{std::sqrt(a.value[0]), std::sqrt(a.value[1]), std::sqrt(a.value[2]), std::sqrt(a.value[3])}}; }

inline void scatter(Lanes x, Lanes y, Lanes z, const std::uint32_t* vertex, float* out) {
  for (int i = 0; i < 4; ++i) {
    float* to = out + 3 * static_cast<std::size_t>(vertex[i]);
    to[0] = x.value[i];
    to[1] = y.value[i];
    to[2] = z.value[i];
  }
}

}  // namespace
}  // namespace mouthpiece::kernel

#include "deform/patch_loops.h"

namespace mouthpiece::kernel {

#ifdef MOUTHPIECE_AVX2
extern const Kernels kAvx2Kernels;
#endif

const Kernels& portableKernels() {
  static constexpr Kernels kernels{bound, loose, multiply};
  return kernels;
}

const Kernels& bestKernels() {
#ifdef MOUTHPIECE_AVX2
  static const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (has_avx2) return kAvx2Kernels;
#endif
  return portableKernels();
}

}  // namespace mouthpiece::kernel
