#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mouthpiece {

struct FaceMesh;
struct GrownMesh;

struct GrownObjText {
  std::string text;
  std::size_t kept = 0;  ///< so many vertices, the first ones, have the numbers that they had
};

/// `obj`, the text that `given` was read from, as `grown` has it (both in the file's frame): the vertices that moved, the
/// faces that got other corners, before the first of these the new vertices, which vertices of later objects are numbered
/// behind, and after the last of these the parts that are new (groups of their names, and materials where there are
/// some). Every other line stays as it was. A face whose triangles part is written as these; the texture coordinate and
/// normal of a corner stay with it. Throws InputError that begins with `file` where the text has other vertices than
/// `given`.
GrownObjText grownObj(std::string_view obj, std::string_view file, const FaceMesh& given, const GrownMesh& grown);

}  // namespace mouthpiece
