// Not a benchmark: the heads of docs/pictures/arap.png. Each frame that is named as OBJ by our deformer and by CGAL's
// as-rigid-as-possible deformation.
#include <fmt/format.h>

#include <exception>

#include "arap_deformer.h"
#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "motion/formats/motion_file.h"
#include "retarget/rig/face_file.h"
#include "retarget/rig/face_rig.h"

namespace mouthpiece {
namespace {

void writePoses(const std::filesystem::path& face_file, const std::filesystem::path& motion_file,
                const std::filesystem::path& out, std::span<char*> frames) {
  const FaceRig rig = FaceRig::load(face_file);
  const FaceFile face = readFaceFile(face_file);
  const MotionClip motion = readMotion(motion_file);
  const FaceMotion on_face = rig.retarget(motion);
  const FaceDeformer deformer(rig.mesh(), face.control, face.binding);
  ArapDeformer arap(rig.mesh(), face.marker_targets, deformer.movingVertices());
  FaceMesh posed = rig.mesh();
  for (const char* name : frames) {
    const FacePose pose = on_face.pose(FrameIndex{std::stoul(name)});
    rig.deform(pose, {}, posed.vertices);
    writeObj(out / fmt::format("ours_{}.obj", name), posed);
    // Teeth and tongue stay as ours: ARAP is told of the skin alone.
    arap.deform(pose.markers, posed.vertices);
    writeObj(out / fmt::format("arap_{}.obj", name), posed);
  }
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) try {
  if (argc < 5) {
    fmt::print(stderr, "Usage: arap_poses FACE MOTION FOLDER FRAME...\n");
    return 2;
  }
  mouthpiece::writePoses(argv[1], argv[2], argv[3], std::span(argv, static_cast<std::size_t>(argc)).subspan(4));
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
