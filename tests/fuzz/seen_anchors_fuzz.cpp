// Any mesh, and a tracker that sees a face wherever the input says: anchors on the mesh, or none.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"
#include "face_finder/seen_anchors.h"
#include "tracking/face_tracker.h"

namespace {

/// The landmarks that the finder asks for.
constexpr std::array<int, 11> kAsked{61, 291, 0, 17, 1, 4, 152, 33, 263, 133, 362};
/// Bytes that say what is seen: one for presence, four for pictures without a face, x and y of each landmark.
constexpr std::size_t kSaid = 5 + 2 * kAsked.size();

}  // namespace

namespace mouthpiece {

/// In place of src/tracking's, whose networks see no face in what a fuzzer makes up.
class FaceTracker::Parts {
 public:
  FaceLandmarks landmarks = FaceLandmarks::Zero();
  double presence = 0;
  std::uint32_t blind = 0;  ///< of 32 pictures those that show no face, a bit each
  std::uint32_t pictures = 0;
};
FaceTracker::FaceTracker(const std::filesystem::path& said) : parts_(std::make_unique<Parts>()) {
  const auto at = [&](std::size_t i) { return static_cast<std::uint8_t>(said.native()[i]); };
  parts_->presence = at(0) / 255.0;
  for (std::size_t i = 1; i < 5; ++i) parts_->blind = parts_->blind << 8U | at(i);
  for (std::size_t i = 0; i < kAsked.size(); ++i)
    parts_->landmarks.row(kAsked[i]) << at(5 + 2 * i) / 255.0, at(6 + 2 * i) / 255.0, 0;
}
FaceTracker::~FaceTracker() = default;
std::optional<FaceLandmarks> FaceTracker::track(const VideoImage& image) {
  if (image.rgb.size() != 3 * image.width * image.height) std::abort();
  if ((parts_->blind >> (parts_->pictures++ % 32U) & 1U) != 0) return std::nullopt;
  // From a quarter of the picture before its edges to a quarter behind.
  return FaceLandmarks((1.5 * parts_->landmarks.array() - 0.25) * static_cast<double>(image.width));
}
void FaceTracker::reset() {}
double FaceTracker::presence() const { return parts_->presence; }

}  // namespace mouthpiece

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mouthpiece;
  if (size <= kSaid + 1 || size > 20'000) return 0;  // each input is painted some thirty times
  const std::string_view said(reinterpret_cast<const char*>(data), kSaid), bytes(said.data() + kSaid, size - kSaid);
  try {
    const FaceMesh mesh = parseFaceMesh(bytes.substr(1), bytes[0] == 'p'   ? "fuzz.ply"
                                                         : bytes[0] == 'g' ? "fuzz.glb"
                                                                           : "fuzz.obj");
    FaceTracker tracker{std::filesystem::path(said)};
    const std::optional<SeenFace> face = seenFace(mesh, tracker);
    if (!face) return 0;
    const Eigen::RowVector3d low = mesh.vertices.colwise().minCoeff().cast<double>(),
                             high = mesh.vertices.colwise().maxCoeff().cast<double>();
    const double slack = 1e-3 * (high - low).norm();
    if (face->anchors.size() != 10 || face->seen > face->pictures || !(face->eye_corners > 0)) std::abort();
    for (const auto& [name, anchor] : face->anchors) {
      const auto place = anchor.place.transpose().array();
      if (!(place >= low.array() - slack).all() || !(place <= high.array() + slack).all() || !(anchor.spread >= 0))
        std::abort();
    }
  } catch (const InputError&) {
  }
  return 0;
}
