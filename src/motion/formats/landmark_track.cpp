#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "base/errors.h"
#include "base/files.h"
#include "base/json_fields.h"
#include "base/statistics.h"
#include "motion/formats/motion_file.h"
#include "motion/position_limits.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxTrackBytes = std::uint64_t{1} << 30U;
/// The subject's outer eye corners in FaceMesh's numbering.
constexpr std::size_t kRightCorner = 33, kLeftCorner = 263;
/// Beyond this many image widths a coordinate is no landmark.
constexpr double kFarthestCoordinate = 1e6;

class TrackReader {
 public:
  explicit TrackReader(const JsonField& root)
      : root_(root), width_(positiveOr("width", 1)), height_(positiveOr("height", 1)) {
    if (root_.isObject() && root_["width"].exists() != root_["height"].exists())
      root_.fail("has one of \"width\" and \"height\"; expected both, or coordinates in pixels");
    const JsonField frames = root_.isObject() ? root_["frames"] : root_;
    if (frames.size() < 2) root_.fail("holds no frames; expected a list \"frames\" of at least two");
    frames_ = frames.list();
  }

  [[nodiscard]] std::size_t frameCount() const { return frames_.size(); }

  /// Image right, up, towards the camera, in pixels; nullopt when no face was found.
  [[nodiscard]] std::optional<MarkerPositions> landmarksOf(std::size_t number) const {
    const std::optional<JsonField> found = pointsOf(frames_[number]);
    if (!found) return std::nullopt;
    const std::vector<JsonField> points = found->list();
    if (points.size() != 468 && points.size() != 478) found->refuse("a list of 468 or 478 landmarks");
    MarkerPositions positions(signedIndex(points.size()), 3);
    for (Eigen::Index i = 0; i < positions.rows(); ++i) {
      const JsonField& point = points[unsignedIndex(i)];
      const std::vector<JsonField> axes =
          point.isObject() ? std::vector{point["x"], point["y"], point["z"]} : point.list(3);
      const auto axis = [&](std::size_t n) { return axes[n].number(-kFarthestCoordinate, kFarthestCoordinate); };
      // FaceMesh gives z in image widths, smaller nearer to the camera.
      positions.row(i) = Eigen::RowVector3d(axis(0) * width_, -axis(1) * height_, -axis(2) * width_);
    }
    return positions;
  }

  [[nodiscard]] double frameRate(double wanted_hz) const {
    if (wanted_hz > 0) return wanted_hz;
    const double told_hz = positiveOr("fps", 0);
    const auto first = timeOf(frames_.front()), last = timeOf(frames_.back());
    if (told_hz > 0 && (!first || !last)) return told_hz;
    if (!first || !last || !(*last > *first))
      root_.fail("does not tell its frame rate; expected \"fps\", times, or a rate given with it");
    const double rate_hz = told_hz > 0 ? told_hz : asReal(frames_.size() - 1) / (*last - *first);
    const double drift = told_hz > 0 ? 0.02 : 0;  // what is told may be rounded
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const double expected = *first + asReal(i) / rate_hz, most = (0.5 + drift * asReal(i)) / rate_hz;
      if (const auto time = timeOf(frames_[i]); time && std::abs(*time - expected) > most)
        frames_[i].fail(fmt::format("is at {:.3f} s; expected even steps, {:.3f} s", *time, expected));
    }
    return rate_hz;
  }

 private:
  [[nodiscard]] double positiveOr(const char* key, double otherwise) const {
    if (!root_.isObject() || !root_[key].exists()) return otherwise;
    const double number = root_[key].number(0, kFarthestCoordinate);
    if (number == 0) root_[key].refuse("a positive number");
    return number;
  }

  /// A frame is a list of points, or holds one, or holds one for each face.
  static std::optional<JsonField> pointsOf(const JsonField& frame) {
    std::optional<JsonField> points = frame;
    if (frame.isObject()) {
      points.reset();
      for (const char* key : {"landmarks", "faceLandmarks", "face_landmarks", "multiFaceLandmarks"}) {
        if (frame[key].exists()) points = frame[key];
      }
    }
    if (!points || points->isNull() || (points->isList() && points->size() == 0)) return std::nullopt;
    if (points->isList() && points->size() == 1) {
      const JsonField face = points->list().front();
      if (face.isList() && face.size() > 3) return face;
    }
    return points;
  }

  static std::optional<double> timeOf(const JsonField& frame) {
    if (!frame.isObject()) return std::nullopt;
    if (frame["time_s"].isNumber()) return frame["time_s"].number();
    if (frame["timestamp_ms"].isNumber()) return 1e-3 * frame["timestamp_ms"].number();
    return std::nullopt;
  }

  JsonField root_;
  double width_, height_;
  std::vector<JsonField> frames_;
};

}  // namespace

MotionClip parseLandmarkTrack(std::string_view json_text, std::string_view file, const MarkerLayout& layout,
                              const LandmarkTrackOptions& options) {
  const TrackReader track(parseJson(json_text, file, "a landmark track"));
  std::vector<Eigen::Index> landmarks;
  MotionClip clip;
  for (const LayoutMarker& marker : layout.markers) {
    if (marker.mediapipe_landmark < 0) continue;
    clip.marker_names.push_back(marker.name);
    landmarks.push_back(marker.mediapipe_landmark);
  }
  if (landmarks.empty())
    throw InputError(layout.name, "", "has no marker with a \"mediapipe_landmark\"; expected a layout with some");
  clip.frame_rate_hz = track.frameRate(options.frame_rate_hz);
  expectFrameRate(clip.frame_rate_hz, file, "");
  clip.positions_mm.setConstant(signedIndex(track.frameCount()), signedIndex(3 * landmarks.size()),
                                std::numeric_limits<double>::quiet_NaN());
  std::vector<double> eye_distances;
  for (std::size_t frame = 0; frame < track.frameCount(); ++frame) {
    const auto points = track.landmarksOf(frame);
    if (!points) continue;
    eye_distances.push_back((points->row(kLeftCorner) - points->row(kRightCorner)).norm());
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      if (landmarks[i] >= points->rows()) continue;  // the irises are in tracks of 478 points only
      clip.positions_mm.block<1, 3>(signedIndex(frame), signedIndex(3 * i)) = points->row(landmarks[i]);
    }
  }
  if (eye_distances.empty()) throw InputError(file, "", "shows no face in any frame; expected one");
  const double eye_distance = median(std::move(eye_distances));
  if (!(eye_distance > 0)) throw InputError(file, "", "has both outer eye corners in one place; expected a face");
  clip.positions_mm *= options.eye_corners_mm / eye_distance;
  if ((clip.positions_mm.array().abs() > kMaxPositionMm).any())
    throw InputError(file, "", "has landmarks kilometres away for a face of that size; expected one face");
  return clip;
}

MotionClip readLandmarkTrack(const std::filesystem::path& path, const MarkerLayout& layout,
                             const LandmarkTrackOptions& options) {
  return parseLandmarkTrack(readFile(path, kMaxTrackBytes), path.string(), layout, options);
}

}  // namespace mouthpiece
