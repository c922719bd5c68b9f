#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mouthpiece::kernel {

/// Vertices are kept in blocks of this many, the widest register's lanes; a patch's last block repeats its last vertex.
constexpr std::size_t kBlock = 16;
/// A patch's net as the kernels want it: x y z of the ten points in CubicNet's order.
constexpr std::size_t kNetFloats = 30;

/// Vertices right above their place on a patch: V = B(u, v) + d n + base. The nets are relative to an origin; `base`
/// brings it back and takes up what rounding leaves of the rest vertex.
struct Block {
  float u[kBlock], v[kBlock], d[kBlock];
  float base[3][kBlock];
  std::uint32_t to[kBlock];  ///< 3 * vertex: where its x goes
};

/// Vertices that hang on a patch beside it, and only in part. With t = dB/du of length 1:
/// P = B + beside t + across (n x t) + d n + base, Q = rest + jaw (turn rest + shift), V = Q + weight (P - Q).
struct LooseBlock {
  float u[kBlock], v[kBlock], d[kBlock];
  float beside[kBlock], across[kBlock];
  float weight[kBlock], jaw[kBlock];
  float base[3][kBlock];
  float rest[3][kBlock];
  std::uint32_t to[kBlock];
};

/// Blocks [first, first + count) lie on `patch`; `vertices` of their lanes are in use.
struct Run {
  std::uint32_t patch, first, count, vertices;
};

struct Frame {
  const float* nets;  ///< kNetFloats a patch
  float jaw_turn[9];  ///< row by row
  float jaw_shift[3];
  float* out;  ///< x y z of each vertex
};

/// slopes(r, axis) = sum over points p of matrix[p * rows + r] * displacement[3 p + axis]; `rows` a multiple of kBlock;
/// slopes: three columns of `rows`.
struct Product {
  const float* matrix;
  const float* displacement;
  float* slopes;
  std::size_t rows, points;
};

/// One set of loops for a kind of processor.
struct Kernels {
  void (*bound)(const Frame&, const Run*, std::size_t runs, const Block*);
  void (*loose)(const Frame&, const Run*, std::size_t runs, const LooseBlock*);
  void (*multiply)(const Product&);
};

/// Every set that this machine can run, the best first and the portable one last; the same on every call.
const std::vector<const Kernels*>& kernelsHere();
const Kernels& bestKernels();
const Kernels& portableKernels();

}  // namespace mouthpiece::kernel
