#pragma once

#include <string>
#include <string_view>

namespace mouthpiece {

struct FaceMesh;
struct LipCut;

/// `glb`, the file that `given` was read from, with the lips cut as `cut` has them; both in the file's frame. Vertices
/// that are new take all attributes and shapes of their parents, the bag is a primitive with a material of its own
/// beside them, and all else stays as it was. Compressed meshes come out plain. Throws InputError that begins with
/// `file` for a damaged file, and where the lips' vertices are in several lists or outside the file.
std::string cutGlb(std::string_view glb, std::string_view file, const FaceMesh& given, const LipCut& cut);

}  // namespace mouthpiece
