// The deformer's inner loops, written once over `Lanes`: several vertices side by side. Highway compiles them for each
// kind of processor; the best is chosen at the first call. Fused multiply-adds are asked for by name, so the result
// does not depend on the compiler.
#include "deform/kernel/patch_kernel.h"

#include <cstring>

// Their vectors have no size that a Spot could hold.
// Of what is left those are made that bestKernels() chooses from: AVX-512, AVX2 and what every processor has.
#ifndef HWY_DISABLED_TARGETS
#define HWY_DISABLED_TARGETS \
  (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/kernel/patch_kernel.cpp"
#include <hwy/foreach_target.h>
// Behind the line above, which includes this file again for each target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace mouthpiece::kernel::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<float, kBlock> kTag{};
using Lanes = hn::Vec<decltype(kTag)>;

HWY_INLINE Lanes all(float x) { return hn::Set(kTag, x); }
HWY_INLINE Lanes load(const float* from) { return hn::LoadU(kTag, from); }

/// Puts each lane's x y z to its place.
HWY_INLINE void scatter(Lanes x, Lanes y, Lanes z, const std::uint32_t* to, float* out) {
  HWY_ALIGN float places[3 * kBlock];
  hn::StoreInterleaved3(x, y, z, kTag, places);
  for (std::size_t i = 0; i < hn::Lanes(kTag); ++i) std::memcpy(out + to[i], places + 3 * i, 3 * sizeof(float));
}

/// Position and tangents at the lanes' (u, v) of one cubic Bezier triangle, relative to the net's origin.
struct Spot {
  Lanes x[3];
  Lanes du[3];
  Lanes dv[3];
};

HWY_INLINE Spot spotAt(const float* net, Lanes u, Lanes v) {
  const Lanes w = all(1.0F) - u - v;
  const Lanes two_u = u + u, two_v = v + v;
  const Lanes uu = u * u, vv = v * v, ww = w * w, uv = two_u * v, uw = two_u * w, vw = two_v * w;
  Spot spot;
  for (int axis = 0; axis < 3; ++axis) {
    const float* b = net + axis;
    // Ten points, three quadratics: u a + v b + w c is the patch, a - c and b - c its tangents over 3.
    const Lanes b210 = all(b[3]), b201 = all(b[6]), b120 = all(b[9]), b111 = all(b[12]);
    const Lanes b102 = all(b[15]), b021 = all(b[21]), b012 = all(b[24]);
    Lanes first = uu * all(b[0]);
    Lanes second = uu * b210;
    Lanes third = uu * b201;
    first = hn::MulAdd(uv, b210, first);
    second = hn::MulAdd(uv, b120, second);
    third = hn::MulAdd(uv, b111, third);
    first = hn::MulAdd(uw, b201, first);
    second = hn::MulAdd(uw, b111, second);
    third = hn::MulAdd(uw, b102, third);
    first = hn::MulAdd(vv, b120, first);
    second = hn::MulAdd(vv, all(b[18]), second);
    third = hn::MulAdd(vv, b021, third);
    first = hn::MulAdd(vw, b111, first);
    second = hn::MulAdd(vw, b021, second);
    third = hn::MulAdd(vw, b012, third);
    first = hn::MulAdd(ww, b102, first);
    second = hn::MulAdd(ww, b012, second);
    third = hn::MulAdd(ww, all(b[27]), third);
    spot.du[axis] = first - third;
    spot.dv[axis] = second - third;
    spot.x[axis] = hn::MulAdd(u, spot.du[axis], hn::MulAdd(v, spot.dv[axis], third));
  }
  return spot;
}

/// A patch crushed to a line has no normal: offsets along it are then left out.
constexpr float kLeastSquare = 1e-30F;

/// Normal of the tangents, not of length 1.
HWY_INLINE void crossProduct(const Lanes* a, const Lanes* b, Lanes* out) {
  out[0] = hn::MulSub(a[1], b[2], a[2] * b[1]);
  out[1] = hn::MulSub(a[2], b[0], a[0] * b[2]);
  out[2] = hn::MulSub(a[0], b[1], a[1] * b[0]);
}

HWY_INLINE Lanes squaredLength(const Lanes* a) {
  return hn::MulAdd(a[0], a[0], hn::MulAdd(a[1], a[1], hn::MulAdd(a[2], a[2], all(kLeastSquare))));
}

void bound(const Frame& frame, const Run* runs, std::size_t run_count, const Block* blocks) {
  for (std::size_t r = 0; r < run_count; ++r) {
    const float* net = frame.nets + kNetFloats * runs[r].patch;
    const Block* block = blocks + runs[r].first;
    for (std::size_t begin = 0; begin < runs[r].vertices; begin += kBlock, ++block) {
      for (std::size_t lane = 0; lane < kBlock && begin + lane < runs[r].vertices; lane += hn::Lanes(kTag)) {
        const Spot spot = spotAt(net, load(block->u + lane), load(block->v + lane));
        Lanes normal[3];
        crossProduct(spot.du, spot.dv, normal);
        const Lanes scale = load(block->d + lane) / hn::Sqrt(squaredLength(normal));
        Lanes moved[3];
        for (int axis = 0; axis < 3; ++axis)
          moved[axis] = hn::MulAdd(scale, normal[axis], spot.x[axis]) + load(block->base[axis] + lane);
        scatter(moved[0], moved[1], moved[2], block->to + lane, frame.out);
      }
    }
  }
}

void loose(const Frame& frame, const Run* runs, std::size_t run_count, const LooseBlock* blocks) {
  for (std::size_t r = 0; r < run_count; ++r) {
    const float* net = frame.nets + kNetFloats * runs[r].patch;
    const LooseBlock* block = blocks + runs[r].first;
    for (std::size_t begin = 0; begin < runs[r].vertices; begin += kBlock, ++block) {
      for (std::size_t lane = 0; lane < kBlock && begin + lane < runs[r].vertices; lane += hn::Lanes(kTag)) {
        const Spot spot = spotAt(net, load(block->u + lane), load(block->v + lane));
        Lanes normal[3], across[3];
        crossProduct(spot.du, spot.dv, normal);
        crossProduct(normal, spot.du, across);
        const Lanes along_normal = load(block->d + lane) / hn::Sqrt(squaredLength(normal));
        const Lanes along_tangent = load(block->beside + lane) / hn::Sqrt(squaredLength(spot.du));
        const Lanes along_across = load(block->across + lane) / hn::Sqrt(squaredLength(across));
        const Lanes weight = load(block->weight + lane), jaw = load(block->jaw + lane);
        const Lanes rest[3] = {load(block->rest[0] + lane), load(block->rest[1] + lane), load(block->rest[2] + lane)};
        Lanes moved[3];
        for (int axis = 0; axis < 3; ++axis) {
          const Lanes offset = hn::MulAdd(along_normal, normal[axis],
                                          hn::MulAdd(along_tangent, spot.du[axis], along_across * across[axis]));
          const Lanes on_patch = spot.x[axis] + offset + load(block->base[axis] + lane);
          const float* turn = frame.jaw_turn + 3 * axis;
          const Lanes swung = hn::MulAdd(
              all(turn[0]), rest[0],
              hn::MulAdd(all(turn[1]), rest[1], hn::MulAdd(all(turn[2]), rest[2], all(frame.jaw_shift[axis]))));
          const Lanes inside = hn::MulAdd(jaw, swung, rest[axis]);
          moved[axis] = hn::MulAdd(weight, on_patch - inside, inside);
        }
        scatter(moved[0], moved[1], moved[2], block->to + lane, frame.out);
      }
    }
  }
}

void multiply(const Product& product) {
  for (std::size_t row = 0; row < product.rows; row += hn::Lanes(kTag)) {
    Lanes x = all(0), y = x, z = x;
    const float* matrix = product.matrix + row;
    const float* displacement = product.displacement;
    for (std::size_t p = 0; p < product.points; ++p, matrix += product.rows, displacement += 3) {
      const Lanes factor = load(matrix);
      x = hn::MulAdd(factor, all(displacement[0]), x);
      y = hn::MulAdd(factor, all(displacement[1]), y);
      z = hn::MulAdd(factor, all(displacement[2]), z);
    }
    hn::StoreU(x, kTag, product.slopes + row);
    hn::StoreU(y, kTag, product.slopes + product.rows + row);
    hn::StoreU(z, kTag, product.slopes + 2 * product.rows + row);
  }
}

const Kernels* kernels() {
  static constexpr Kernels kMade{bound, loose, multiply};
  return &kMade;
}

}  // namespace
}  // namespace mouthpiece::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mouthpiece::kernel {
namespace {

#if (HWY_TARGETS) & (HWY_AVX2 | HWY_AVX3)
/// Highway's loops for AVX2 use F16C and LZCNT, too: every processor with these has them, and clang 14 cannot ask.
bool hasAvx2() {
  return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0 &&
         __builtin_cpu_supports("bmi") != 0 && __builtin_cpu_supports("bmi2") != 0;
}
#endif

}  // namespace

// Highway's own choice stands in a library of its own, which times the processor's clock whenever a program starts.
const std::vector<const Kernels*>& kernelsHere() {
  static const std::vector<const Kernels*> best_first = [] {
    std::vector<const Kernels*> sets;
#if (HWY_TARGETS) & HWY_AVX3
    const bool has_avx3 = __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
                          __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
                          __builtin_cpu_supports("avx512cd") != 0;
    if (has_avx3 && hasAvx2()) sets.push_back(N_AVX3::kernels());
#endif
#if (HWY_TARGETS) & HWY_AVX2
    if (hasAvx2()) sets.push_back(N_AVX2::kernels());
#endif
    sets.push_back(HWY_STATIC_DISPATCH(kernels)());
    return sets;
  }();
  return best_first;
}

const Kernels& bestKernels() { return *kernelsHere().front(); }
const Kernels& portableKernels() { return *kernelsHere().back(); }

}  // namespace mouthpiece::kernel
#endif
