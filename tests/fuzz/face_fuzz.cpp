// Any bytes as a `.face` file: what is read can be written and read again, and moves a mesh, or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "base/errors.h"
#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "retarget/rig/face_file.h"

namespace {

using namespace mouthpiece;

/// A mesh through the control points themselves, with teeth, hung on the patches one after the other.
void moveSomething(const ControlMesh& control, std::span<const std::uint32_t> guard) {
  constexpr std::size_t kMostPoints = 400;
  if (control.points.size() > kMostPoints) return;
  FaceMesh mesh;
  mesh.vertices = control.rest.cast<float>();
  for (const auto& [a, b, c] : control.triangles)
    mesh.triangles.push_back(
        {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(c)});
  const std::size_t count = mesh.triangles.size(), teeth = count / 4;
  mesh.parts = {
      {.name = "skin", .kind = PartKind::kSkin, .triangle_count = count - 2 * teeth},
      {.name = "upper", .kind = PartKind::kUpperTeeth, .first_triangle = count - 2 * teeth, .triangle_count = teeth},
      {.name = "lower", .kind = PartKind::kLowerTeeth, .first_triangle = count - teeth, .triangle_count = teeth}};
  FaceBinding binding;
  for (std::size_t v = 0; v < control.points.size(); ++v) {
    binding.patch.push_back(static_cast<std::int32_t>(v % count));
    binding.u.push_back(0.3F);
    binding.v.push_back(0.3F);
    binding.d.push_back(0);
    binding.skin_weight.push_back(1);
    binding.jaw_weight.push_back(0);
  }
  const FaceDeformer deformer(mesh, control, binding, {.guard = guard});
  const std::vector<LipGap> touching(lipPairs(control).size(), {.opened = 0});
  const MarkerPositions markers = control.rest.topRows(static_cast<Eigen::Index>(control.marker_count));
  VertexPositions out;
  deformer.deform({markers, touching}, {}, out);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const FaceFile face = parseFaceFile({reinterpret_cast<const char*>(data), size}, "fuzz.face");
    const std::string once = faceFileToBytes(face);
    if (faceFileToBytes(parseFaceFile(once, "once.face")) != once) std::abort();
    moveSomething(face.control, face.guard);
  } catch (const InputError&) {
  }
  return 0;
}
