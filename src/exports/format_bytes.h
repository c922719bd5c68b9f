#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "deform/kernel/face_animation.h"
#include "exports/shapes/principal_shapes.h"
#include "motion/motion_clip.h"
#include "synthesis/curve_ablation.h"
#include "synthesis/utterance_animation.h"

// Files as bytes, a function each; ARKit's are in exports/arkit.h, the GLB in exports/gltf/glb.h.
namespace mouthpiece {

struct ArkitCurves;
struct FaceMesh;

/// Every vertex of every frame, in the mesh's own vertex order and unit (docs/formats/pc2_mdd.md), written as they are
/// made. PC2, little-endian: 3ds Max, Blender's mesh cache, Houdini.
void writePc2(const std::filesystem::path& path, const FrameMaker& frames);
/// MDD, big-endian: LightWave, Blender, Maya plug-ins.
void writeMdd(const std::filesystem::path& path, const FrameMaker& frames);
/// One OBJ a frame, each with area-weighted normals (`vn`), all triangles, parts as `usemtl`; `take` gets them in
/// turn, since together they would be the largest thing in memory.
void objFrames(const FaceMesh& mesh, const FrameMaker& frames,
               const std::function<void(std::size_t frame, const std::string& bytes)>& take);

/// report.json (docs/formats/report.md): where each phone came from, how it was joined and how long it took (`timing`,
/// whatever the animation's own says). `of_head`: how well the head's own shapes follow; null where none were asked.
std::string reportJson(const UtteranceAnimation& animation, const StageTimings& timing,
                       const ArkitCurves* of_head = nullptr);

/// Another fragment that a unit of the line could be made of.
struct UnitOffer {
  PhoneRange phones;  ///< of the line
  std::string take;
  TakeIndex take_index;
  Seconds source_start = 0;
  double cost = 0;
};

/// What the curves move, as weights of the face's shapes, so that a page can show a change of a curve by itself.
struct CurvePoses {
  std::vector<std::string> names;  ///< of the curves: visemes, lipSpread, lipRound
  RowMajorMatrixF lips;            ///< a row a curve, a column a shape: at value 1
  std::vector<double> jaw_drop;    ///< of each curve's jaw part, mm at value 1
  Eigen::RowVectorXf jaw;          ///< weights for one mm of these
};

/// What view.html needs besides the line to be an editor of it.
struct ViewEdits {
  std::string edits = "[]";                    ///< those that made this line, JSON
  std::vector<std::vector<UnitOffer>> offers;  ///< a list a unit
  CurvePoses poses;
};

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

/// What view.html shows. Views only: everything must outlive the call.
struct ViewPage {
  const UtteranceAnimation& animation;
  std::string_view glb;  ///< glbBytes() of `mesh`
  const FaceMesh& mesh;  ///< for its parts' kinds and its unit
  std::string_view face_name;
  std::span<const std::string> marker_names;
  const PositionMatrix& markers;      ///< FaceMotion's: frames x (3 * markers), the mesh's unit
  const ViewEdits* edits = nullptr;   ///< null: nothing but the line itself
  std::string_view engine = {};       ///< WebAssembly that makes the line again after an edit; "": none
  std::string_view packed_line = {};  ///< what `engine` makes it of
  /// From the scene of `glb` to where the markers are, upright and in metres: a head's own GLB has any unit and turn.
  Eigen::Matrix3d shown_from_glb = Eigen::Matrix3d::Identity();
};

/// Where the template takes its data: this line, once.
inline constexpr std::string_view kViewPagePlaceholder = "<!-- mouthpiece:data -->";

/// The page, one file that opens from disk (viewer/): `page_template` with the face, the sound and the report in it.
/// Text from outside (words, names of takes) is data there and cannot become markup or script. Throws InputError when
/// the template has no placeholder.
std::string viewHtml(std::string_view page_template, const ViewPage& page);

/// A page, one file, with the variants' curves over each other, above the phones. `frame_rate_hz`: of the variants'
/// mouth. The first variant is the one that the others are compared with.
std::string ablationPage(std::string_view title, const SpeechLabels& labels, const std::vector<CurveVariant>& variants,
                         double frame_rate_hz);

}  // namespace mouthpiece
