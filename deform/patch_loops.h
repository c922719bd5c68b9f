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

/// Adds d times the unit normal.
inline void offsetAlongNormal(Spot& spot, Lanes d) {
  const Lanes nx = mulSub(spot.du[1], spot.dv[2], spot.du[2] * spot.dv[1]);
  const Lanes ny = mulSub(spot.du[2], spot.dv[0], spot.du[0] * spot.dv[2]);
  const Lanes nz = mulSub(spot.du[0], spot.dv[1], spot.du[1] * spot.dv[0]);
  // A patch crushed to a line has no normal: the offset is then left out.
  const Lanes squared = mulAdd(nx, nx, mulAdd(ny, ny, mulAdd(nz, nz, Lanes::all(1e-30F))));
  const Lanes scale = d / squareRoot(squared);
  spot.x[0] = mulAdd(scale, nx, spot.x[0]);
  spot.x[1] = mulAdd(scale, ny, spot.x[1]);
  spot.x[2] = mulAdd(scale, nz, spot.x[2]);
}

void bound(const Frame& frame, const Run* runs, std::size_t run_count, const Block* blocks) {
  const Lanes ox = Lanes::all(frame.origin[0]), oy = Lanes::all(frame.origin[1]), oz = Lanes::all(frame.origin[2]);
  for (std::size_t r = 0; r < run_count; ++r) {
    const float* net = frame.nets + kNetFloats * runs[r].patch;
    const Block* block = blocks + runs[r].first;
    for (std::uint32_t k = 0; k < runs[r].count; ++k, ++block) {
      for (std::size_t lane = 0; lane < kBlock; lane += Lanes::kCount) {
        Spot spot = spotAt(net, Lanes::load(block->u + lane), Lanes::load(block->v + lane));
        offsetAlongNormal(spot, Lanes::load(block->d + lane));
        scatter(spot.x[0] + ox, spot.x[1] + oy, spot.x[2] + oz, block->vertex + lane, frame.out);
      }
    }
  }
}

void loose(const Frame& frame, const Run* runs, std::size_t run_count, const LooseBlock* blocks) {
  for (std::size_t r = 0; r < run_count; ++r) {
    const float* net = frame.nets + kNetFloats * runs[r].patch;
    const LooseBlock* block = blocks + runs[r].first;
    for (std::uint32_t k = 0; k < runs[r].count; ++k, ++block) {
      for (std::size_t lane = 0; lane < kBlock; lane += Lanes::kCount) {
        Spot spot = spotAt(net, Lanes::load(block->u + lane), Lanes::load(block->v + lane));
        offsetAlongNormal(spot, Lanes::load(block->d + lane));
        const Lanes along_u = Lanes::load(block->along_u + lane), along_v = Lanes::load(block->along_v + lane);
        const Lanes weight = Lanes::load(block->weight + lane), jaw = Lanes::load(block->jaw + lane);
        const Lanes rest[3] = {Lanes::load(block->rest[0] + lane), Lanes::load(block->rest[1] + lane), Lanes::load(block->rest[2] + lane)};
        Lanes moved[3];
        for (int axis = 0; axis < 3; ++axis) {
          const Lanes on_patch = mulAdd(along_u, spot.du[axis], mulAdd(along_v, spot.dv[axis], spot.x[axis])) + Lanes::all(frame.origin[axis]);
          const float* turn = frame.jaw_turn + 3 * axis;
          const Lanes swung = mulAdd(Lanes::all(turn[0]), rest[0],
                                     mulAdd(Lanes::all(turn[1]), rest[1], mulAdd(Lanes::all(turn[2]), rest[2], Lanes::all(frame.jaw_shift[axis]))));
          const Lanes inside = mulAdd(jaw, swung, rest[axis]);
          moved[axis] = mulAdd(weight, on_patch - inside, inside);
        }
        scatter(moved[0], moved[1], moved[2], block->vertex + lane, frame.out);
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
