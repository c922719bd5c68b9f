// What the portable core's sources name and no packed line asks for: files, and faces that are not fitted yet. A linker
// for WebAssembly leaves the callers out before it looks for these.
#include "base/errors.h"
#include "base/files.h"
#include "deform/mesh/mesh_reader.h"
#include "deform/surface/control_steps.h"
#include "motion/formats/c3d_file.h"

namespace mouthpiece {
namespace {

[[noreturn]] void refuse() {
  throw InputError("the portable core reads no files and fits no faces; expected a packed line");
}

}  // namespace

std::string readFile(const std::filesystem::path& /*path*/, std::uint64_t /*max_bytes*/) { refuse(); }
void writeFileAtomically(const std::filesystem::path& /*path*/, std::string_view /*bytes*/) { refuse(); }
std::string sha256Hex(std::string_view /*bytes*/) { refuse(); }
FaceMesh parseObj(std::string_view /*bytes*/, std::string_view /*file*/) { refuse(); }
FaceMesh parsePly(std::string_view /*bytes*/, std::string_view /*file*/) { refuse(); }
FaceMesh parseOff(std::string_view /*bytes*/, std::string_view /*file*/) { refuse(); }
FaceMesh parseGlb(std::string_view /*bytes*/, std::string_view /*file*/, std::string_view /*object*/) { refuse(); }
FaceShapes parseGlbShapes(std::string_view /*bytes*/, std::string_view /*file*/, std::string_view /*object*/) {
  refuse();
}
std::vector<std::array<int, 3>> triangulate(const ControlMesh& /*mesh*/) { refuse(); }
std::vector<int> convexHull(const Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>& /*points*/) { refuse(); }
MotionClip readC3d(const std::filesystem::path& /*path*/) { refuse(); }

}  // namespace mouthpiece
