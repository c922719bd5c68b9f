// The deformer's inner loops, written once over `Lanes`: several vertices side by side. Included by one source file for
// each kind of processor, after Lanes is defined; everything here is local to that file, so that no code made for one
// processor reaches another through the linker.

namespace mouthpiece::kernel {
namespace {

/// Position and tangents at the lanes' (u, v) of one cubic Bezier triangle, relative to the net's origin.
struct Spot {
  Lanes x[3];
  Lanes du[3];
  Lanes dv[3];
};

inline Spot spotAt(const float* net, Lanes u, Lanes v) {
  const Lanes w = Lanes::all(1.0F) - u - v;
  const Lanes two_u = u + u, two_v = v + v;
  const Lanes uu = u * u, vv = v * v, ww = w * w, uv = two_u * v, uw = two_u * w, vw = two_v * w;
  Spot spot;
  for (int axis = 0; axis < 3; ++axis) {
    const float* b = net + axis;
    // Ten points, three quadratics: u a + v b + w c is the patch, a - c and b - c its tangents over 3.
    const Lanes b210 = Lanes::all(b[3]), b201 = Lanes::all(b[6]), b120 = Lanes::all(b[9]), b111 = Lanes::all(b[12]);
    const Lanes b102 = Lanes::all(b[15]), b021 = Lanes::all(b[21]), b012 = Lanes::all(b[24]);
    Lanes first = uu * Lanes::all(b[0]);
    Lanes second = uu * b210;
    Lanes third = uu * b201;
    first = mulAdd(uv, b210, first);
    second = mulAdd(uv, b120, second);
    third = mulAdd(uv, b111, third);
    first = mulAdd(uw, b201, first);
    second = mulAdd(uw, b111, second);
    third = mulAdd(uw, b102, third);
    first = mulAdd(vv, b120, first);
    second = mulAdd(vv, Lanes::all(b[18]), second);
    third = mulAdd(vv, b021, third);
    first = mulAdd(vw, b111, first);
    second = mulAdd(vw, b021, second);
    third = mulAdd(vw, b012, third);
    first = mulAdd(ww, b102, first);
    second = mulAdd(ww, b012, second);
    third = mulAdd(ww, Lanes::all(b[27]), third);
    spot.du[axis] = first - third;
    spot.dv[axis] = second - third;
    spot.x[axis] = mulAdd(u, spot.du[axis], mulAdd(v, spot.dv[axis], third));
  }
  return spot;
}

/// A patch crushed to a line has no normal: offsets along it are then left out.
constexpr float kLeastSquare = 1e-30F;

/// Normal of the tangents, not of length 1.
inline void crossProduct(const Lanes* a, const Lanes* b, Lanes* out) {
  out[0] = mulSub(a[1], b[2], a[2] * b[1]);
  out[1] = mulSub(a[2], b[0], a[0] * b[2]);
  out[2] = mulSub(a[0], b[1], a[1] * b[0]);
}

inline Lanes squaredLength(const Lanes* a) {
  return mulAdd(a[0], a[0], mulAdd(a[1], a[1], mulAdd(a[2], a[2], Lanes::all(kLeastSquare))));
}

void bound(const Frame& frame, const Run* runs, std::size_t run_count, const Block* blocks) {
  for (std::size_t r = 0; r < run_count; ++r) {
    const float* net = frame.nets + kNetFloats * runs[r].patch;
    const Block* block = blocks + runs[r].first;
    for (std::size_t begin = 0; begin < runs[r].vertices; begin += kBlock, ++block) {
      for (std::size_t lane = 0; lane < kBlock && begin + lane < runs[r].vertices; lane += Lanes::kCount) {
        const Spot spot = spotAt(net, Lanes::load(block->u + lane), Lanes::load(block->v + lane));
        Lanes normal[3];
        crossProduct(spot.du, spot.dv, normal);
        const Lanes scale = Lanes::load(block->d + lane) / squareRoot(squaredLength(normal));
        Lanes moved[3];
        for (int axis = 0; axis < 3; ++axis)
          moved[axis] = mulAdd(scale, normal[axis], spot.x[axis]) + Lanes::load(block->base[axis] + lane);
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
      for (std::size_t lane = 0; lane < kBlock && begin + lane < runs[r].vertices; lane += Lanes::kCount) {
        const Spot spot = spotAt(net, Lanes::load(block->u + lane), Lanes::load(block->v + lane));
        Lanes normal[3], across[3];
        crossProduct(spot.du, spot.dv, normal);
        crossProduct(normal, spot.du, across);
        const Lanes along_normal = Lanes::load(block->d + lane) / squareRoot(squaredLength(normal));
        const Lanes along_tangent = Lanes::load(block->beside + lane) / squareRoot(squaredLength(spot.du));
        const Lanes along_across = Lanes::load(block->across + lane) / squareRoot(squaredLength(across));
        const Lanes weight = Lanes::load(block->weight + lane), jaw = Lanes::load(block->jaw + lane);
        const Lanes rest[3] = {Lanes::load(block->rest[0] + lane), Lanes::load(block->rest[1] + lane),
                               Lanes::load(block->rest[2] + lane)};
        Lanes moved[3];
        for (int axis = 0; axis < 3; ++axis) {
          const Lanes offset =
              mulAdd(along_normal, normal[axis], mulAdd(along_tangent, spot.du[axis], along_across * across[axis]));
          const Lanes on_patch = spot.x[axis] + offset + Lanes::load(block->base[axis] + lane);
          const float* turn = frame.jaw_turn + 3 * axis;
          const Lanes swung = mulAdd(Lanes::all(turn[0]), rest[0],
                                     mulAdd(Lanes::all(turn[1]), rest[1],
                                            mulAdd(Lanes::all(turn[2]), rest[2], Lanes::all(frame.jaw_shift[axis]))));
          const Lanes inside = mulAdd(jaw, swung, rest[axis]);
          moved[axis] = mulAdd(weight, on_patch - inside, inside);
        }
        scatter(moved[0], moved[1], moved[2], block->to + lane, frame.out);
      }
    }
  }
}

void multiply(const Product& product) {
  for (std::size_t row = 0; row < product.rows; row += Lanes::kCount) {
    Lanes x = Lanes::all(0), y = x, z = x;
    const float* matrix = product.matrix + row;
    const float* displacement = product.displacement;
    for (std::size_t p = 0; p < product.points; ++p, matrix += product.rows, displacement += 3) {
      const Lanes factor = Lanes::load(matrix);
      x = mulAdd(factor, Lanes::all(displacement[0]), x);
      y = mulAdd(factor, Lanes::all(displacement[1]), y);
      z = mulAdd(factor, Lanes::all(displacement[2]), z);
    }
    x.store(product.slopes + row);
    y.store(product.slopes + product.rows + row);
    z.store(product.slopes + 2 * product.rows + row);
  }
}

}  // namespace
}  // namespace mouthpiece::kernel
