// Any vertices, triangles, colours and focus: a picture, and nothing read or written beside it.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "exports/film/face_painter.h"

namespace {

/// Takes numbers off the front of what the fuzzer made up; zeros when it is used up.
struct Supply {
  const std::uint8_t* data;
  std::size_t size;

  template <typename Number>
  Number next() {
    Number number{};
    if (size >= sizeof(Number)) {
      std::memcpy(&number, data, sizeof(Number));
      data += sizeof(Number);
      size -= sizeof(Number);
    } else {
      size = 0;
    }
    return number;
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mouthpiece;
  Supply supply{data, size};
  const std::size_t vertices = 3U + supply.next<std::uint8_t>() % 30U,
                    triangles = 1U + supply.next<std::uint8_t>() % 40U;
  const std::size_t width = 1U + supply.next<std::uint8_t>() % 90U, height = 1U + supply.next<std::uint8_t>() % 90U;
  FaceMesh mesh;
  mesh.parts.push_back({.name = "all",
                        .kind = static_cast<PartKind>(supply.next<std::uint8_t>() % 9),
                        .triangle_count = triangles,
                        .base_color = {supply.next<float>(), supply.next<float>(), supply.next<float>(), 1}});
  Eigen::AlignedBox3f focus;
  for (int corner = 0; corner < 2; ++corner)
    focus.extend(Eigen::Vector3f(supply.next<float>(), supply.next<float>(), supply.next<float>()));
  for (std::size_t i = 0; i < triangles; ++i) {
    Triangle& triangle = mesh.triangles.emplace_back();
    for (std::uint32_t& corner : triangle) corner = supply.next<std::uint8_t>() % static_cast<std::uint32_t>(vertices);
  }
  mesh.vertices = VertexPositions::NullaryExpr(signedIndex(vertices), 3, [&] { return supply.next<float>(); });
  Picture picture;
  FacePainter(mesh, focus, width, height).paint(mesh.vertices, picture);
  if (picture.rgb.size() != 3 * width * height) std::abort();
  return 0;
}
