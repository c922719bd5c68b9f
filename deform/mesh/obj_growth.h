#pragma once

#include <string>
#include <string_view>

namespace mouthpiece {

struct FaceMesh;
struct GrownMesh;

/// `obj`, the text that `given` was read from, as `grown` has it (both in the file's frame): the vertices that moved,
/// those that are new behind the last one, the faces that got other corners, and behind all else the parts that are new
/// (a group and a material of their names). Every other line stays as it was. A face whose triangles part is written as
/// these; the texture coordinate and normal of a corner stay with it. Throws InputError that begins with `file` where
/// the text has other vertices than `given`.
std::string grownObj(std::string_view obj, std::string_view file, const FaceMesh& given, const GrownMesh& grown);

}  // namespace mouthpiece
