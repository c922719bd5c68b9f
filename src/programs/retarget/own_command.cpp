// retarget own: a head in the shape of a captured person's face.
#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <variant>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "deform/mesh/face_mesh.h"
#include "programs/outputs.h"
#include "programs/retarget/commands.h"
#include "retarget/rig/face_file.h"
#include "retarget/warp/rbf_warp.h"
#include "speaker/shared_files.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

struct OwnArguments {
  fs::path corpus, face, out;
  double smooth = 0;
  bool quiet = false;
};

/// The person's resting markers, and where the face has them. Round the eyes the head stays in its own shape, turned
/// and sized: lids that are bent tear when they blink.
struct Places {
  MarkerPositions on_face, on_person_mm;
};
Places placesOf(const Corpus& corpus, const FaceFile& face) {
  const std::vector<std::string> names = corpus.layout.markerNames();
  std::vector<Eigen::Index> eyes, on_person;
  for (std::size_t i = 0; i < face.marker_names.size(); ++i) {
    const auto found = std::find(names.begin(), names.end(), face.marker_names[i]);
    if (found == names.end())
      throw InputError(corpus.name, face.marker_names[i], "is missing; expected all markers of the face");
    const auto marker = found - names.begin();
    const std::string& region = corpus.layout.markers[unsignedIndex(marker)].region;
    if (region == "lid" || region == "canthus" || region == "brow") eyes.push_back(signedIndex(i));
    on_person.push_back(marker);
  }
  Places places{face.marker_targets, corpus.neutral_pose_mm(on_person, Eigen::all)};
  const Similarity person_from_face = similarityBetween(places.on_face, places.on_person_mm);
  for (const Eigen::Index eye : eyes)
    places.on_person_mm.row(eye) = person_from_face(places.on_face.row(eye).transpose()).transpose();
  return places;
}

/// The face's own head, bent so that each marker lies where it lies on the person, in millimetres. What lies between
/// and behind the markers follows the same warp as motion does (EDGE 6).
int runOwn(const OwnArguments& given) {
  if (lowerCase(given.out.extension().string()) != ".obj")
    throw InputError(given.out.string(), "", "expected an .obj to write");
  const Corpus corpus = readCorpus(given.corpus, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
  const fs::path face_path = given.face.empty() ? findSharedFile("default.face", "make it with `make`") : given.face;
  const FaceFile face = readFaceFile(face_path);
  FaceMesh mesh = readMeshOf(face, face_path);
  FaceMesh as_given = mesh;
  Anchors anchors = placedOn(face, as_given, {});
  const Places places = placesOf(corpus, face);
  WarpOptions options;
  options.regularization = given.smooth;
  const RbfWarp warp = RbfWarp::fit(places.on_face, places.on_person_mm, options);
  const Eigen::Matrix3d upright = face.upright_from_mesh;
  for (auto& [name, place] : anchors.markers) {
    auto* point = std::get_if<Eigen::Vector3d>(&place);
    if (point == nullptr) continue;
    const MarkerPositions stood = (upright * *point).transpose();
    *point = warp.targetFromActor(stood).row(0).transpose();
  }
  mesh.vertices = warp.targetFromActor(mesh.vertices.cast<double>()).cast<float>();
  anchors.part_kinds = face.part_kinds;
  anchors.metres_per_unit = mesh.metres_per_unit = 0.001;
  FilesTogether files;
  writeFileAtomically(given.out, objBytes(mesh));
  writeFileAtomically(fs::path(given.out).replace_extension(".anchors.json"), anchorsBytes(anchors));
  files.commit();
  return kExitDone;
}

void addOptions(CLI::App& command, OwnArguments& options) {
  command.add_option("--corpus", options.corpus, "The person's corpus: its markers at rest give the shape")->required();
  command.add_option("--face", options.face, "The fitted head to bend (default: the sample face)");
  command.add_option("--smooth", options.smooth, "More bends less at single markers; 0 meets each exactly")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command.add_option("-o,--out", options.out, "The head to write, .obj; its .anchors.json comes beside it")->required();
  checkOutputs(command, {{"--out"}});
}

}  // namespace

Command ownCommand() {
  return makeCommand("own", "A head in the shape of a captured person's face, to be fitted",
                     "retarget own --corpus me/own.corpus --out me.obj", addOptions, runOwn);
}

}  // namespace mouthpiece
