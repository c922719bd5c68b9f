#include "tracking/face_tracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "tracking/face_regions.h"
#include "tracking/tensor_network.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxModelBytes = 64 << 20;
constexpr std::size_t kDetectorSide = 128, kLandmarkSide = 192;
constexpr double kLeastScore = 0.5;  // of a detected face, and that a face is still there
constexpr double kCropMargin = 1.5;  // a face's crop is larger than the box round it by this
// Both networks see faces in the grey ghosts that a decoder leaves where a key frame is missing: in GRID's they have a
// contrast of 0.05 at most, its faces 0.26 and more, also where light is far too strong or weak.
constexpr double kLeastContrast = 0.07;
constexpr std::size_t kOuterRightEye = 33, kOuterLeftEye = 263;

/// A square of the image, turned by `angle` (clockwise as seen).
struct Crop {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  double side = 0, angle = 0;

  /// From the crop's own coordinates, -0.5 to 0.5, to the image's pixels.
  [[nodiscard]] Eigen::Vector2d toImage(double u, double v) const {
    const double c = std::cos(angle), s = std::sin(angle);
    return middle + side * Eigen::Vector2d(c * u - s * v, s * u + c * v);
  }
};

/// Keys' cubic convolution (a = -0.5) at four neighbours; the third power keeps an enlarged face's edges sharp.
std::array<float, 4> cubicWeights(double t) {
  const double t2 = t * t, t3 = t2 * t;
  return {asFloat(-0.5 * t3 + t2 - 0.5 * t), asFloat(1.5 * t3 - 2.5 * t2 + 1), asFloat(-1.5 * t3 + 2 * t2 + 0.5 * t),
          asFloat(0.5 * t3 - 0.5 * t2)};
}

class Sampler {
 public:
  explicit Sampler(const VideoImage& image)
      : image_(image), last_x_(signedIndex(image.width) - 1), last_y_(signedIndex(image.height) - 1) {}

  /// Adds `weight` times the colour at a place in pixels; (0.5, 0.5) is the middle of the first. What lies outside is
  /// as the border.
  void add(const Eigen::Vector2d& place, float weight, float* colour) const {
    const double x = place.x() - 0.5, y = place.y() - 0.5;
    const double left = std::floor(x), top = std::floor(y);
    const std::array<float, 4> across = cubicWeights(x - left), down = cubicWeights(y - top);
    for (int row = 0; row < 4; ++row) {
      const auto at_y = clamped(top + row - 1, last_y_);
      for (int column = 0; column < 4; ++column) {
        const auto at_x = clamped(left + column - 1, last_x_);
        const float share = weight * down[unsignedIndex(row)] * across[unsignedIndex(column)];
        const std::uint8_t* pixel = &image_.rgb[3 * (at_y * image_.width + at_x)];
        for (std::size_t i = 0; i < 3; ++i) colour[i] += share * pixel[i];
      }
    }
  }

 private:
  static std::size_t clamped(double place, Eigen::Index last) {
    return unsignedIndex(static_cast<Eigen::Index>(std::clamp(place, 0.0, asReal(last))));
  }

  const VideoImage& image_;
  Eigen::Index last_x_, last_y_;
};

/// The crop as `side` x `side` colours, each low + value * scale. A crop with more pixels than that is averaged.
void fillCrop(const VideoImage& image, const Crop& crop, std::size_t side, float low, float scale, bool border_is_black,
              std::span<float> values) {
  const Sampler sampler(image);
  const int splits = std::clamp(static_cast<int>(std::lround(crop.side / asReal(side))), 1, 8);
  const float weight = 1.0F / static_cast<float>(splits * splits);
  for (std::size_t row = 0; row < side; ++row) {
    for (std::size_t column = 0; column < side; ++column) {
      std::array<float, 3> colour{};
      for (int part = 0; part < splits * splits; ++part) {
        const double u = (asReal(column) + (part % splits + 0.5) / splits) / asReal(side) - 0.5;
        const double v = (asReal(row) + (part / splits + 0.5) / splits) / asReal(side) - 0.5;
        const Eigen::Vector2d place = crop.toImage(u, v);
        const bool inside =
            place.x() >= 0 && place.y() >= 0 && place.x() < asReal(image.width) && place.y() < asReal(image.height);
        if (inside || !border_is_black) sampler.add(place, weight, colour.data());
      }
      float* out = &values[3 * (row * side + column)];
      for (std::size_t i = 0; i < 3; ++i) out[i] = low + scale * std::clamp(colour[i], 0.0F, 255.0F);
    }
  }
}

/// How much brightness differs within the face that a crop is laid round: its standard deviation by the distance of its
/// mean from black or white, whichever is nearer, for there it cannot differ more.
double contrastOf(std::span<const float> crop) {
  const auto margin = static_cast<std::size_t>(std::lround((1 - 1 / kCropMargin) / 2 * asReal(kLandmarkSide)));
  double count = 0, sum = 0, sum_of_squares = 0;
  for (std::size_t row = margin; row < kLandmarkSide - margin; ++row) {
    for (std::size_t column = margin; column < kLandmarkSide - margin; ++column) {
      const float* colour = &crop[3 * (row * kLandmarkSide + column)];
      const double brightness = (colour[0] + colour[1] + colour[2]) / 3;
      count += 1;
      sum += brightness;
      sum_of_squares += brightness * brightness;
    }
  }
  const double mean = sum / count;
  const double room = std::min(mean, 1 - mean);
  return room > 0 ? std::sqrt(std::max(0.0, sum_of_squares / count - mean * mean)) / room : 0;
}

double sigmoid(double x) { return 1 / (1 + std::exp(-std::clamp(x, -100.0, 100.0))); }

/// Box and eyes in the detector's own coordinates, 0 to 1.
struct Detection {
  double score = 0;
  std::array<double, 8> values{};  ///< left, top, right, bottom, right eye x y, left eye x y
  [[nodiscard]] double area() const { return (values[2] - values[0]) * (values[3] - values[1]); }
};

double overlap(const Detection& a, const Detection& b) {
  const double width = std::min(a.values[2], b.values[2]) - std::max(a.values[0], b.values[0]);
  const double height = std::min(a.values[3], b.values[3]) - std::max(a.values[1], b.values[1]);
  if (width <= 0 || height <= 0) return 0;
  return width * height / (a.area() + b.area() - width * height);
}

/// The middles of the detector's 896 boxes: two in each of 16 x 16 fields, then six in each of 8 x 8.
std::vector<Eigen::Vector2d> boxMiddles() {
  std::vector<Eigen::Vector2d> middles;
  for (const auto& [fields, boxes] : {std::pair<std::size_t, int>{16, 2}, {8, 6}}) {
    for (std::size_t field = 0; field < fields * fields; ++field) {
      const Eigen::Vector2d middle((asReal(field % fields) + 0.5) / asReal(fields),
                                   (asReal(field / fields) + 0.5) / asReal(fields));
      for (int box = 0; box < boxes; ++box) middles.push_back(middle);
    }
  }
  return middles;
}

std::vector<Detection> detectionsFrom(std::span<const float> boxes, std::span<const float> scores) {
  static const std::vector<Eigen::Vector2d> middles = boxMiddles();
  std::vector<Detection> found;
  for (std::size_t i = 0; i < middles.size(); ++i) {
    const double score = sigmoid(scores[i]);
    if (score < kLeastScore) continue;
    const auto value = [&](std::size_t n) { return double{boxes[16 * i + n]} / asReal(kDetectorSide); };
    const double x = middles[i].x(), y = middles[i].y();
    found.push_back({score,
                     {x + value(0) - value(2) / 2, y + value(1) - value(3) / 2, x + value(0) + value(2) / 2,
                      y + value(1) + value(3) / 2, x + value(4), y + value(5), x + value(6), y + value(7)}});
  }
  return found;
}

/// The face that covers most, each the mean of the boxes that overlap its surest one, weighted by their scores.
std::optional<Detection> largestFace(std::vector<Detection> found) {
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.score > b.score; });
  std::optional<Detection> largest;
  while (!found.empty()) {
    const Detection surest = found.front();
    Detection mean;
    std::erase_if(found, [&](const Detection& other) {
      if (overlap(surest, other) < 0.3) return false;
      for (std::size_t i = 0; i < mean.values.size(); ++i) mean.values[i] += other.score * other.values[i];
      mean.score += other.score;
      return true;
    });
    for (double& value : mean.values) value /= mean.score;
    mean.score = surest.score;
    if (!largest || mean.area() > largest->area()) largest = mean;
  }
  return largest;
}

TensorNetwork networkIn(const std::filesystem::path& file, std::span<const TensorNetwork::Region> regions) {
  return {parseTfliteModel(readFile(file, kMaxModelBytes), file.string()), regions, file.string()};
}

std::array<TensorNetwork::Region, 3> attentionRegions() {
  return {{{kLipLandmarks, 61, 291}, {kRightEyeLandmarks, 33, 133}, {kLeftEyeLandmarks, 362, 263}}};
}

/// The crop for the next image.
Crop cropAround(const FaceLandmarks& landmarks) {
  const Eigen::RowVector3d low = landmarks.colwise().minCoeff(), high = landmarks.colwise().maxCoeff();
  const Eigen::RowVector3d eyes = landmarks.row(kOuterLeftEye) - landmarks.row(kOuterRightEye);
  return {((low + high) / 2).head<2>().transpose(), kCropMargin * (high - low).head<2>().maxCoeff(),
          std::atan2(eyes.y(), eyes.x())};
}

}  // namespace

class FaceTracker::Parts {
 public:
  explicit Parts(const std::filesystem::path& models)
      : detector_(networkIn(models / "face_detection.tflite", {})),
        landmarks_(networkIn(models / "face_landmarks.tflite", attentionRegions())) {
    const bool fits = detector_.input().size() == 3 * kDetectorSide * kDetectorSide && detector_.outputCount() == 2 &&
                      detector_.output(0).size() == 16 * 896 && detector_.output(1).size() == 896 &&
                      landmarks_.input().size() == 3 * kLandmarkSide * kLandmarkSide && landmarks_.outputCount() == 7 &&
                      landmarks_.output(0).size() == 3 * 468 && landmarks_.output(1).size() == 2 * 80 &&
                      landmarks_.output(2).size() == 2 * 71 && landmarks_.output(3).size() == 2 * 71 &&
                      landmarks_.output(4).size() == 2 * 5 && landmarks_.output(5).size() == 2 * 5;
    if (!fits)
      throw InputError(models.string(), "", "holds other networks; expected those of @mediapipe/face_mesh 0.4");
  }

  std::optional<FaceLandmarks> track(const VideoImage& image) {
    presence_ = 0;
    const bool is_new = !crop_;
    if (is_new) crop_ = detect(image);
    std::optional<FaceLandmarks> found;
    if (crop_) found = follow(image);
    // The detector's crop is a rough one: landmarks of it lay 0.9 mm from the next image's, where 0.45 is usual.
    if (is_new && crop_) found = follow(image);
    return found;
  }

  void reset() { crop_.reset(); }
  [[nodiscard]] double presence() const { return presence_; }

 private:
  /// The landmarks in the crop, which is then laid round them; neither where there is no face.
  std::optional<FaceLandmarks> follow(const VideoImage& image) {
    fillCrop(image, *crop_, kLandmarkSide, 0, 1.0F / 255, false, landmarks_.input());
    std::optional<FaceLandmarks> found;
    if (contrastOf(landmarks_.input()) >= kLeastContrast) {
      landmarks_.run();
      presence_ = sigmoid(landmarks_.output(6)[0]);
      if (presence_ >= kLeastScore) found = landmarksOf(*crop_);
    }
    crop_.reset();
    if (found && found->allFinite()) crop_ = cropAround(*found);
    return found;
  }

  /// In the whole image, then in parts of it, for the detector sees faces of a fifth of its side and more.
  std::optional<Crop> detect(const VideoImage& image) {
    const double width = asReal(image.width), height = asReal(image.height);
    if (const auto found = detectIn(image, {{width / 2, height / 2}, std::max(width, height), 0})) return found;
    for (const double share : {1.0, 0.6}) {
      const double side = share * std::min(width, height);
      std::optional<Crop> largest;
      for (const double x : {0.5, 0.0, 1.0}) {
        for (const double y : {0.5, 0.0, 1.0}) {
          const Crop part{{side / 2 + x * (width - side), side / 2 + y * (height - side)}, side, 0};
          const auto found = detectIn(image, part);
          if (found && (!largest || found->side > largest->side)) largest = found;
        }
      }
      if (largest) return largest;
    }
    return std::nullopt;
  }

  std::optional<Crop> detectIn(const VideoImage& image, const Crop& part) {
    fillCrop(image, part, kDetectorSide, -1, 2.0F / 255, true, detector_.input());
    detector_.run();
    const auto face = largestFace(detectionsFrom(detector_.output(0), detector_.output(1)));
    if (!face) return std::nullopt;
    const auto& v = face->values;
    return Crop{part.toImage((v[0] + v[2]) / 2 - 0.5, (v[1] + v[3]) / 2 - 0.5),
                kCropMargin * part.side * std::max(v[2] - v[0], v[3] - v[1]), std::atan2(v[7] - v[5], v[6] - v[4])};
  }

  [[nodiscard]] FaceLandmarks landmarksOf(const Crop& crop) const {
    FaceLandmarks found;
    const double scale = 1 / asReal(kLandmarkSide);
    const std::span<const float> mesh = landmarks_.output(0);
    for (Eigen::Index i = 0; i < 468; ++i) {
      const float* point = &mesh[3 * unsignedIndex(i)];
      found.row(i) << crop.toImage(point[0] * scale - 0.5, point[1] * scale - 0.5).transpose(),
          point[2] * scale * crop.side;
    }
    const auto refine = [&](std::size_t output, const auto& place_of) {
      const std::span<const float> points = landmarks_.output(output);
      for (std::size_t i = 0; 2 * i < points.size(); ++i) {
        const Eigen::Vector2d place = crop.toImage(points[2 * i] * scale - 0.5, points[2 * i + 1] * scale - 0.5);
        found(place_of(i), 0) = place.x();
        found(place_of(i), 1) = place.y();
      }
    };
    refine(1, [](std::size_t i) { return kLipLandmarks[i]; });
    refine(2, [](std::size_t i) { return kRightEyeLandmarks[i]; });
    refine(3, [](std::size_t i) { return kLeftEyeLandmarks[i]; });
    refine(4, [](std::size_t i) { return kRightIris + signedIndex(i); });
    refine(5, [](std::size_t i) { return kLeftIris + signedIndex(i); });
    setIrisDepth(found, kRightIris, kRightEyeLandmarks);
    setIrisDepth(found, kLeftIris, kLeftEyeLandmarks);
    return found;
  }

  static void setIrisDepth(FaceLandmarks& found, Eigen::Index iris, std::span<const int> eye) {
    double sum = 0;
    for (const int landmark : eye.first(kEyeEdgeLandmarks)) sum += found(landmark, 2);
    found.col(2).segment<5>(iris).setConstant(sum / asReal(kEyeEdgeLandmarks));
  }

  TensorNetwork detector_, landmarks_;
  std::optional<Crop> crop_;
  double presence_ = 0;
};

FaceTracker::FaceTracker(const std::filesystem::path& models) : parts_(std::make_unique<Parts>(models)) {}
FaceTracker::~FaceTracker() = default;
std::optional<FaceLandmarks> FaceTracker::track(const VideoImage& image) { return parts_->track(image); }
void FaceTracker::reset() { parts_->reset(); }
double FaceTracker::presence() const { return parts_->presence(); }

}  // namespace mouthpiece
