#pragma once

#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "retarget/placing/anchors.h"

namespace mouthpiece {
struct Corpus;
}

namespace mouthpiece::test {

/// A head to fit: its mesh and the ten places that a user clicks on it.
struct ClickedHead {
  std::string name;
  FaceMesh mesh;
  Anchors clicks;             ///< points, the mesh's unit
  std::string changes;        ///< what was done to it, in words
  double mm_per_unit = 1;     ///< by the width of its mouth
  bool has_polygons = false;  ///< its file has quads and polygons of more corners
};

/// The head's mesh as an OBJ file; where it has polygons, neighbouring triangles are joined to them.
std::string objOf(const ClickedHead& head);

/// Heads of ../shared/faces and the default one, each with its ten anchors of tests/data/anchors; those that are not
/// there are left out. `sources`: the checkout.
std::vector<ClickedHead> clickedHeads(const std::filesystem::path& sources, const std::filesystem::path& share);

/// Another head from `head`, by chance: its proportions, asymmetry, the thickness of its lips, the height of its
/// mouth's corners, how far its mouth is open at rest; its mesh made finer, coarser, remeshed, noisy, taken apart at
/// every edge, joined to polygons; its anchors clicked up to 2 mm beside their places. `head` must stand upright and
/// face +Z.
ClickedHead variedHead(const ClickedHead& head, unsigned seed);

/// A cartoon's head by chance: `stylise`, its mesh coarser, remeshed, noisy or joined to polygons, ten clicks up to 2
/// mm beside their places. `head` must stand upright and face +Z.
ClickedHead stylisedHead(const ClickedHead& head, unsigned seed);

/// A head whose lower lip lies in the upper one at rest, by 0.3, 0.8 or 2 mm (in turn, by `seed`) as the lips' own
/// meter tells: proportions as those of `variedHead`, its mesh finer, coarser or remeshed, ten clicks up to 2 mm beside
/// their places. `corpus`: whose actor `head` is fitted to, for the meter.
ClickedHead crossedHead(const ClickedHead& head, unsigned seed, const Corpus& corpus);

}  // namespace mouthpiece::test
