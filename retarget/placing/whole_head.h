#pragma once

#include <string>

namespace mouthpiece {

struct FaceMesh;

/// Throws InputError, which begins with `file`, for what is no one head: half of one, whose skin ends in a plane across
/// X (a mirror modifier that was not applied), or two layers of skin in one place (levels of detail).
void refuseNoWholeHead(const FaceMesh& mesh, const std::string& file);

}  // namespace mouthpiece
