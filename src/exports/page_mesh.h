#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

struct FaceMesh;

/// What view.html is told of a mesh.
struct PageMesh {
  struct Part {
    std::string name;
    std::string_view kind;  ///< in the page's words: teeth of both jaws are "teeth"
    int material = -1;
  };
  std::vector<Part> parts;  ///< in the order of the GLB's materials: parts without triangles have none
  double metres_per_unit = 0;
};
PageMesh pageMeshOf(const FaceMesh& mesh);

}  // namespace mouthpiece
