#pragma once

#include "retarget/sample_head/canonical_face.h"

namespace mouthpiece {

/// Two rows of teeth with gums and a tongue, fitted behind the lips of an opened canonical face. The teeth of both rows
/// are closed a millimetre apart at rest.
ModelMesh makeMouthParts(const OpenedFace& face);

/// Eyeballs with iris and pupil rings; channel kMouthDepth holds the angle from the front, in units of pi.
ModelMesh makeEyeBall(const EyeBall& eye);

/// Lashes along the upper lids of the finished face, thin blades.
ModelMesh makeLashes(const OpenedFace& face);

}  // namespace mouthpiece
