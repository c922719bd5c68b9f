#pragma once

#include "retarget/sample_head/canonical_face.h"

namespace mouthpiece {

/// Closes the canonical face to a head: skull, jaw's underside and neck, joined to the face's outline. Open at the
/// neck's foot.
void addHeadShell(ModelMesh& face);

/// Signed distance to the head's outer form, millimetres; negative inside. The shell lies on its zero level.
double headDistance(const Eigen::Vector3d& point);

/// Two ears, closed surfaces set into the head.
ModelMesh makeEars();

/// A cap of short hair over the skull of the finished head: the shell's triangles where hair grows, lifted.
ModelMesh makeHair(const ModelMesh& head);

}  // namespace mouthpiece
