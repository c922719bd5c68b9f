#include "deform/kernel/patch_kernel.h"

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
inline Lanes squareRoot(Lanes a) {
  return {Lanes::Vector{std::sqrt(a.value[0]), std::sqrt(a.value[1]), std::sqrt(a.value[2]), std::sqrt(a.value[3])}};
}

inline void scatter(Lanes x, Lanes y, Lanes z, const std::uint32_t* to, float* out) {
  for (int i = 0; i < 4; ++i) {
    float* place = out + to[i];
    place[0] = x.value[i];
    place[1] = y.value[i];
    place[2] = z.value[i];
  }
}

}  // namespace
}  // namespace mouthpiece::kernel

#include "deform/kernel/patch_loops.h"

namespace mouthpiece::kernel {

#ifdef MOUTHPIECE_X86
extern const Kernels kAvx2Kernels;
extern const Kernels kAvx512Kernels;
#endif

const Kernels& portableKernels() {
  static constexpr Kernels kernels{bound, loose, multiply};
  return kernels;
}

const Kernels& bestKernels() {
#ifdef MOUTHPIECE_X86
  static const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  static const bool has_avx512 = has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
  if (has_avx512) return kAvx512Kernels;
  if (has_avx2) return kAvx2Kernels;
#endif
  return portableKernels();
}

}  // namespace mouthpiece::kernel
