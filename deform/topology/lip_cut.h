#pragma once

#include "deform/mesh/face_mesh.h"
#include "deform/topology/lip_line.h"

namespace mouthpiece {

/// `mesh` with its lips cut open along `line`, whose lips are one surface: the edges that keep nearest to the line are
/// doubled and drawn onto it, and a mouth bag of its own part ("mouth_inside") joins them. The first vertices are
/// those of `mesh`. Throws InputError where the lips are apart already or no edges lead from corner to corner.
GrownMesh cutLips(const FaceMesh& mesh, const LipLine& line);

/// `mesh` with a mouth bag of its own part ("mouth_inside") where the lips along `line` end at the edge of a hole, deep
/// enough for teeth and a tongue; as it is where there is no hole.
GrownMesh withMouthBag(const FaceMesh& mesh, const LipLine& line);

}  // namespace mouthpiece
