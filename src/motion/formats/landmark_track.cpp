#include "motion/formats/landmark_track.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/errors.h"
#include "base/files.h"
#include "base/statistics.h"
#include "motion/formats/motion_rows.h"
#include "motion/position_limits.h"

namespace mouthpiece {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kMaxTrackBytes = std::uint64_t{1} << 30U;
/// The subject's outer eye corners in FaceMesh's numbering.
constexpr std::size_t kRightCorner = 33, kLeftCorner = 263;
/// Beyond this many image widths a coordinate is no landmark.
constexpr double kFarthestCoordinate = 1e6;

Json parsed(std::string_view text, std::string_view file) {
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    throw InputError(file, fmt::format("byte {}", error.byte), "is no valid JSON; expected a landmark track");
  } catch (const Json::exception&) {
    throw InputError(file, "", "holds a number out of range; expected a landmark track");
  }
}

class TrackReader {
 public:
  TrackReader(const Json& root, std::string_view file) : root_(root), file_(file) {
    width_ = numberOr("width", 1.0);
    height_ = numberOr("height", 1.0);
    if (root_.is_object() && root_.contains("width") != root_.contains("height")) {
      throw InputError(file_, "", "has one of \"width\" and \"height\"; expected both, or coordinates in pixels");
    }
  }

  [[nodiscard]] const Json& frames() const {
    const Json* frames = &root_;
    if (root_.is_object()) frames = root_.contains("frames") ? &root_["frames"] : nullptr;
    if (frames == nullptr || !frames->is_array() || frames->size() < 2) {
      throw InputError(file_, "", "holds no frames; expected a list \"frames\" of at least two");
    }
    return *frames;
  }

  /// Image right, up, towards the camera, in pixels; nullopt when no face was found.
  [[nodiscard]] std::optional<MarkerPositions> landmarksOf(std::size_t number) const {
    const Json* points = pointsOf(frames()[number]);
    if (points == nullptr || points->is_null() || (points->is_array() && points->empty())) return std::nullopt;
    if (!points->is_array() || (points->size() != 468 && points->size() != 478)) {
      fail(number, fmt::format("found {} landmarks; expected 468 or 478", points->size()));
    }
    MarkerPositions positions(static_cast<Eigen::Index>(points->size()), 3);
    for (std::size_t i = 0; i < points->size(); ++i) {
      const std::array<double, 3> point = pointOf((*points)[i], number);
      // FaceMesh gives z in image widths, smaller nearer to the camera.
      positions.row(static_cast<Eigen::Index>(i)) << point[0] * width_, -point[1] * height_, -point[2] * width_;
    }
    return positions;
  }

  [[nodiscard]] double frameRate(double wanted_hz) const {
    if (wanted_hz > 0) return wanted_hz;
    if (root_.is_object() && root_.contains("fps")) return numberOr("fps", 0.0);
    const auto first = timeOf(0), last = timeOf(frames().size() - 1);
    if (!first || !last || !(*last > *first)) {
      throw InputError(file_, "", "does not tell its frame rate; expected \"fps\", times, or --fps");
    }
    const double rate_hz = static_cast<double>(frames().size() - 1) / (*last - *first);
    for (std::size_t i = 0; i < frames().size(); ++i) {
      const double expected = *first + static_cast<double>(i) / rate_hz;
      if (const auto time = timeOf(i); time && std::abs(*time - expected) > 0.5 / rate_hz) {
        fail(i, fmt::format("is at {:.3f} s; expected even steps, {:.3f} s", *time, expected));
      }
    }
    return rate_hz;
  }

 private:
  [[noreturn]] void fail(std::size_t frame, const std::string& what) const {
    throw InputError(file_, fmt::format("frame {}", frame), what);
  }

  [[nodiscard]] double numberOr(const char* key, double otherwise) const {
    if (!root_.is_object() || !root_.contains(key)) return otherwise;
    const Json& value = root_[key];
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (!(number > 0 && number <= kFarthestCoordinate)) {
      throw InputError(file_, key, "found no positive number; expected one");
    }
    return number;
  }

  /// A frame is a list of points, or holds one, or holds one for each face.
  static const Json* pointsOf(const Json& frame) {
    const Json* points = &frame;
    if (frame.is_object()) {
      points = nullptr;
      for (const char* key : {"landmarks", "faceLandmarks", "face_landmarks", "multiFaceLandmarks"}) {
        if (frame.contains(key)) points = &frame[key];
      }
    }
    const bool lists_faces = points != nullptr && points->is_array() && points->size() == 1 &&
                             (*points)[0].is_array() && (*points)[0].size() > 3;
    return lists_faces ? &(*points)[0] : points;
  }

  [[nodiscard]] std::array<double, 3> pointOf(const Json& point, std::size_t frame) const {
    std::array<double, 3> values{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Json* value = nullptr;
      const char* key = std::array{"x", "y", "z"}[axis];
      if (point.is_array() && point.size() >= 3) value = &point[axis];
      if (point.is_object() && point.contains(key)) value = &point[key];
      if (value != nullptr && value->is_number()) values[axis] = value->get<double>();
      const bool is_good = value != nullptr && value->is_number() && std::abs(values[axis]) <= kFarthestCoordinate;
      if (!is_good) fail(frame, "found a landmark without usable x, y and z; expected numbers");
    }
    return values;
  }

  [[nodiscard]] std::optional<double> timeOf(std::size_t number) const {
    const Json& frame = frames()[number];
    if (!frame.is_object()) return std::nullopt;
    if (frame.contains("time_s") && frame["time_s"].is_number()) return frame["time_s"].get<double>();
    if (frame.contains("timestamp_ms") && frame["timestamp_ms"].is_number()) {
      return 1e-3 * frame["timestamp_ms"].get<double>();
    }
    return std::nullopt;
  }

  const Json& root_;
  std::string file_;
  double width_ = 1, height_ = 1;
};

}  // namespace

MotionClip parseLandmarkTrack(std::string_view json_text, std::string_view file, const MarkerLayout& layout,
                              const LandmarkTrackOptions& options) {
  const Json root = parsed(json_text, file);
  const TrackReader track(root, file);
  std::vector<std::size_t> landmarks;
  MotionClip clip;
  for (const LayoutMarker& marker : layout.markers) {
    if (marker.mediapipe_landmark < 0) continue;
    clip.marker_names.push_back(marker.name);
    landmarks.push_back(static_cast<std::size_t>(marker.mediapipe_landmark));
  }
  if (landmarks.empty()) {
    throw InputError(layout.name, "", "has no marker with a \"mediapipe_landmark\"; expected a layout with some");
  }
  clip.frame_rate_hz = track.frameRate(options.frame_rate_hz);
  expectFrameRate(clip.frame_rate_hz, file, "");
  const std::size_t frames = track.frames().size();
  clip.positions_mm =
      PositionMatrix::Constant(static_cast<Eigen::Index>(frames), static_cast<Eigen::Index>(3 * landmarks.size()),
                               std::numeric_limits<double>::quiet_NaN());
  std::vector<double> eye_distances;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const auto points = track.landmarksOf(frame);
    if (!points) continue;
    eye_distances.push_back((points->row(kLeftCorner) - points->row(kRightCorner)).norm());
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(landmarks[i]);
      if (row >= points->rows()) continue;  // the irises are in tracks of 478 points only
      clip.positions_mm.block<1, 3>(static_cast<Eigen::Index>(frame), static_cast<Eigen::Index>(3 * i)) =
          points->row(row);
    }
  }
  if (eye_distances.empty()) throw InputError(file, "", "shows no face in any frame; expected one");
  const double eye_distance = median(std::move(eye_distances));
  if (!(eye_distance > 0)) throw InputError(file, "", "has both outer eye corners in one place; expected a face");
  clip.positions_mm *= options.eye_corners_mm / eye_distance;
  if ((clip.positions_mm.array().abs() > kMaxPositionMm).any()) {
    throw InputError(file, "", "has landmarks kilometres away for a face of that size; expected one face");
  }
  return clip;
}

MotionClip readLandmarkTrack(const std::filesystem::path& path, const MarkerLayout& layout,
                             const LandmarkTrackOptions& options) {
  return parseLandmarkTrack(readFile(path, kMaxTrackBytes), path.string(), layout, options);
}

}  // namespace mouthpiece
