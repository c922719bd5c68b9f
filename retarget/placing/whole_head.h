#pragma once

#include <string>

namespace mouthpiece {

struct FaceMesh;

/// Why a head that does not fit may be no whole one: half of one, whose skin ends in a plane across X (a mirror
/// modifier that was not applied), or two layers of skin in one place (levels of detail). "" for one that looks whole.
std::string whyNoWholeHead(const FaceMesh& mesh);

}  // namespace mouthpiece
