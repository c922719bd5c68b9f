#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "deform/topology/lip_line.h"
#include "programs/program.h"
#include "retarget/placing/anchors.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_judge.h"

namespace mouthpiece {

struct Corpus;
struct CorpusTake;
struct FaceMesh;
struct MarkerLayout;
struct PageDressing;

// One source file a subcommand of `retarget`.
Command anchorsCommand();
Command applyCommand();
Command checkCommand();
Command cutCommand();
Command fitCommand();
Command ownCommand();
Command pickCommand();
Command sampleCommand();
Command shapesCommand();

/// How anchors are found: by named nodes and bones, the head's own shapes, as it looks, or each by the first that
/// tells.
enum class AnchorSource { kAny, kBones, kShapes, kLooks };
struct FoundAnchors {
  Anchors anchors;
  std::string how;      ///< a line: what they were found by, and how sure that is
  std::string missing;  ///< names of those of the ten that were not found, each with a space before it
};
/// The ten anchors of a head, `mesh` as read from these bytes. Throws InputError, one line that names `retarget pick`,
/// where no mouth or face is found.
FoundAnchors findAnchors(const FaceMesh& mesh, std::string_view bytes, const std::filesystem::path& file,
                         const std::string& object, AnchorSource source);

/// The anchors of a file, or, where none is `given`, those that findAnchors() finds: then a notice says so. `file` is
/// for messages about them.
struct NamedAnchors {
  Anchors anchors;
  std::string file;
};
NamedAnchors anchorsFor(const FaceMesh& mesh, std::string_view bytes, const std::filesystem::path& file,
                        const std::string& object, const std::filesystem::path& given, bool quiet);

/// Throws InputError where a scene shows several heads and the anchors lie on more than one of them: `object` names
/// which is meant, and is empty. `bytes`, those of a GLB, are what `mesh` was read from.
void refuseSeveralHeads(const FaceMesh& mesh, std::string_view bytes, const std::filesystem::path& file,
                        const std::string& object, const NamedAnchors& anchors);

/// Throws InputError where `out` ends otherwise than a mesh that is written: .obj, or, of a GLB, .glb.
void expectMeshEnding(const std::filesystem::path& out, const std::filesystem::path& mesh);

/// The line between the lips as the anchors tell where to look for it, in the head's upright frame.
struct TracedLips {
  Eigen::Matrix3d upright_from_mesh;
  LipLine line;
};
/// Throws InputError that names an anchor which is missing, or tells that no skin lies between the corners.
TracedLips tracedLips(const FaceMesh& mesh, const NamedAnchors& anchors);

/// What fitFace() needs to know of a corpus' actor; the mesh's file and hash are left to the caller.
FitRequest fitRequestFor(const std::string& face_name, const Corpus& corpus);

/// The frames of a take's B P M in which the captured mouth is closed furthest, where it closes at all, and, of every
/// eighth of the other phones but silence, those in which it is open widest.
struct LipFrames {
  std::vector<std::size_t> closed, open;
};
/// `others`: how many other phones there were in the takes before.
LipFrames lipFrames(const CorpusTake& take, const MarkerLayout& layout, std::size_t& others);

/// What a face is judged by: some of the captured closures, steps drawn at random from all takes, and a song of every
/// vowel that the corpus' own poses sing. The same on every call.
JudgedPoses judgedPoses(const Corpus& corpus);

/// All that is found out about a fitted face.
struct FaceReport {
  FaceCheck check;
  JudgedPoses poses;
  ActorPose actor;          ///< whose they are
  FaceJudgement judgement;  ///< by these poses
  std::string not_judged;   ///< why it is empty; "" where it is not

  /// A line each; empty when all is well.
  [[nodiscard]] std::vector<std::string> faults() const;
};

/// Looks at a face at rest and moves it as `corpus` and a song do; null: as the default corpus does, if it is there.
FaceReport reportOn(const FaceFile& face, const FaceRig& rig, const Corpus* corpus);

/// What a page shows of the file `mesh` with these bytes besides its surface: a GLB's textures.
PageDressing dressingOf(std::string_view mesh_bytes, const std::filesystem::path& mesh);
/// The same with the line between the lips, traced where `anchors` tell of a mouth and hold no rims of its lips.
PageDressing dressingOf(std::string_view mesh_bytes, const std::filesystem::path& mesh, const FaceMesh& head,
                        const NamedAnchors& anchors);

/// Writes a page that shows the markers on the face, or, where it has faults that show, the pose in which the first of
/// them is worst, with the triangles in red.
void writeFacePage(const std::filesystem::path& path, const FaceFile& face, const FaceRig& rig,
                   const FaceReport& report, const Anchors& given, const PageDressing& dressing);

/// All markers and both lips' rims as the fit has placed them, in the frame of the mesh's file, into which `mesh`,
/// which stands upright, is turned back; `given` keeps what else it says, and the vertices that have stayed.
Anchors placedOn(const FaceFile& face, FaceMesh& mesh, const Anchors& given);

/// A fitted face and what is found out about it, as JSON and as lines to read.
nlohmann::json faceFacts(const FaceFile& face, const FaceReport& report);
std::string faceText(const FaceFile& face, const FaceReport& report);
/// A line on stderr where the face was not judged, which says why.
void noticeNotJudged(const FaceFile& face, const FaceReport& report);
/// The facts on stdout, and without the text that line.
void printFace(const FaceFile& face, const FaceReport& report, bool json, bool quiet);

}  // namespace mouthpiece
