#include "deform/mesh/face_mesh.h"
#include "exports/format_bytes.h"

namespace mouthpiece {
namespace {

std::string_view kindName(PartKind kind) {
  switch (kind) {
    case PartKind::kSkin:
      return "skin";
    case PartKind::kLips:
      return "lips";
    case PartKind::kUpperTeeth:
    case PartKind::kLowerTeeth:
      return "teeth";
    case PartKind::kTongue:
      return "tongue";
    case PartKind::kMouthInside:
      return "mouth";
    case PartKind::kEye:
      return "eye";
    case PartKind::kHair:
      return "hair";
    case PartKind::kOther:
      break;
  }
  return "other";
}

}  // namespace

PageMesh pageMeshOf(const FaceMesh& mesh) {
  PageMesh told{{}, mesh.metres_per_unit};
  for (const MeshPart& part : mesh.parts) {
    if (part.triangle_count > 0) told.parts.push_back({part.name, kindName(part.kind), part.material});
  }
  return told;
}

}  // namespace mouthpiece
