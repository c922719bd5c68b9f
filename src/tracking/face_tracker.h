#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

namespace mouthpiece {

/// Rows of red, green, blue bytes, the top row first.
struct VideoImage {
  std::size_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// 478 landmarks x 3 in MediaPipe's numbering, pixels: x to the image's right, y down, z in the same scale, smaller
/// nearer to the camera, about zero in the head's middle. The last ten are the irises: middle, then right, top, left,
/// bottom of each, the subject's right eye first.
using FaceLandmarks = Eigen::Matrix<double, 478, 3, Eigen::RowMajor>;

/// The first of five landmarks of each iris.
inline constexpr Eigen::Index kRightIris = 468, kLeftIris = 473;

/// Finds one face and follows it from image to image, as MediaPipe's FaceMesh does with refined landmarks: its two
/// networks, its way from a face to the next image's crop, nothing smoothed (docs/theory/tracking/face_tracker.md).
/// Values do not depend on the machine's graphics. One thread at a time.
class FaceTracker {
 public:
  /// Reads face_detection.tflite and face_landmarks.tflite in `models`. Throws InputError when they are missing or
  /// others.
  explicit FaceTracker(const std::filesystem::path& models);
  FaceTracker(const FaceTracker&) = delete;
  FaceTracker& operator=(const FaceTracker&) = delete;
  ~FaceTracker();

  /// The largest face of the next image; nullopt when there is none.
  std::optional<FaceLandmarks> track(const VideoImage& image);
  /// The next image is of something else.
  void reset();
  /// How sure the network was that the last image shows a face, 0 to 1.
  [[nodiscard]] double presence() const;

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace mouthpiece
