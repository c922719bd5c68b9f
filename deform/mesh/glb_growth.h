#pragma once

#include <string>
#include <string_view>

namespace mouthpiece {

struct FaceMesh;
struct GrownMesh;

/// `glb`, the file that `given` was read from (`object` of it), as `grown` has it: lips cut open, parts added; both in
/// the file's frame. Vertices that are new take all attributes, weights and shapes of their parents, each part that is
/// new is a primitive with a material of its name beside them, and all else stays as it was. Compressed meshes come out
/// plain. Throws InputError that begins with `file` for a damaged file, and where a part's vertices, or those that they
/// go with, are in several lists or outside the file.
std::string grownGlb(std::string_view glb, std::string_view file, std::string_view object, const FaceMesh& given,
                     const GrownMesh& grown);

}  // namespace mouthpiece
