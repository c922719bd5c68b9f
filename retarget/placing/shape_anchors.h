#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// The shapes of a head that tell where its features are: moves of each vertex at weight 1, the mesh's unit; without
/// rows where the head has none.
struct TellingShapes {
  VertexPositions jaw_open;
  VertexPositions blink_right, blink_left;  ///< the head's own sides
};

/// Vertices of the ten suggested anchors (face_page.h) by what the shapes move and what is seen from the front: the
/// slit between the lips where the jaw parts close places, carried on along their line to its corners; red edges, nose
/// and chin by the profile, eyes by their visible part or the lids that close. The mesh may be turned any way
/// (uprightFromGiven). What cannot be told is left out. Throws InputError that begins with `file` where no slit is
/// found.
std::map<std::string, std::uint32_t> anchorsFromShapes(const FaceMesh& mesh, const TellingShapes& shapes,
                                                       const std::string& file);

}  // namespace mouthpiece
