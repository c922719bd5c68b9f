// retarget sample: the face that comes with Mouthpiece.
#include <CLI/CLI.hpp>

#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"
#include "programs/retarget/commands.h"
#include "retarget/sample_head/default_face.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

struct SampleArguments {
  std::filesystem::path out, canonical, corpus;
  bool quiet = false, json = false;
};

int runSample(const SampleArguments& given) {
  const Corpus corpus = readCorpus(given.corpus);
  const DefaultFace made = makeDefaultFace(readFaceMesh(given.canonical), given.canonical.string());
  const std::filesystem::path mesh_path = given.out / "default.obj";
  const std::string bytes = objBytes(made.mesh);
  FaceMesh mesh = parseFaceMesh(bytes, mesh_path);
  FitRequest request = fitRequestFor("default", corpus);
  request.mesh_file = mesh_path.filename().string();
  request.mesh_sha256 = sha256Hex(bytes);
  const FaceFile face = fitFace(mesh, made.anchors, given.canonical.string(), request);
  writeFileAtomically(mesh_path, bytes);
  const FaceRig rig = FaceRig::of(face, std::move(mesh), mesh_path.string());
  writeFaceFile(given.out / "default.face", rig.withSetUp(face));
  const FaceReport report = reportOn(face, rig, &corpus);
  printFace(face, report, given.json, given.quiet);
  return report.faults().empty() ? kExitDone : kExitBadInput;
}

void addOptions(CLI::App& command, SampleArguments& options) {
  command.add_option("--out", options.out, "Folder")->required();
  command
      .add_option("--canonical", options.canonical,
                  "MediaPipe's canonical face (`make data` brings it: build/third_party/canonical_face.obj)")
      ->required();
  command.add_option("--corpus", options.corpus, "Corpus whose actor shall move the face")->required();
  addJsonFlag(command, options.json);
}

}  // namespace

Command sampleCommand() {
  return makeCommand("sample", "Make the face that comes with Mouthpiece: default.obj, default.face",
                     "retarget sample --out share --canonical canonical_face.obj --corpus sample.corpus", addOptions,
                     runSample);
}

}  // namespace mouthpiece
