#include "programs/corpus/studio_advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kRightCorner = 33, kLeftCorner = 263, kForehead = 10, kChin = 152;
constexpr std::array<Eigen::Index, 20> kInnerLips{78,  95,  88,  178, 87,  14, 317, 402, 318, 324,
                                                  308, 415, 310, 311, 312, 13, 82,  81,  80,  191};
// Below 45 pixels between the outer eye corners the lips are fewer pixels than their movements need (GRID has 65).
constexpr double kLeastEyePixels = 45, kMostEyeShare = 0.42;
constexpr double kMostTurnDegrees = 15, kMostNodDegrees = 22;
constexpr double kDarkest = 50, kBrightest = 215, kMostUneven = 2.2;  // of 255; one half of the face against the other

double degreesOf(double radians) { return radians * 180 / std::numbers::pi; }

/// Mean brightness of the face's right and left half (the subject's), 0 to 255.
std::array<double, 2> brightness(const VideoImage& image, const FaceLandmarks& face) {
  const double middle = (face(kRightCorner, 0) + face(kLeftCorner, 0)) / 2;
  const double half = 0.8 * std::abs(face(kLeftCorner, 0) - face(kRightCorner, 0));
  std::array<double, 2> sums{}, counts{};
  const auto bounded = [](double value, std::size_t size) {
    return static_cast<std::size_t>(std::clamp(value, 0.0, asReal(size)));
  };
  const std::size_t top = bounded(std::min(face(kForehead, 1), face(kChin, 1)), image.height);
  const std::size_t bottom = bounded(std::max(face(kForehead, 1), face(kChin, 1)), image.height);
  for (std::size_t y = top; y < bottom; ++y) {
    for (std::size_t x = bounded(middle - half, image.width); x < bounded(middle + half, image.width); ++x) {
      const std::uint8_t* pixel = &image.rgb[3 * (y * image.width + x)];
      const std::size_t side = asReal(x) < middle ? 0 : 1;
      sums[side] += 0.3 * pixel[0] + 0.59 * pixel[1] + 0.11 * pixel[2];
      counts[side] += 1;
    }
  }
  return {sums[0] / std::max(counts[0], 1.0), sums[1] / std::max(counts[1], 1.0)};
}

void adviseOnPlace(const VideoImage& image, const FaceLandmarks& face, std::vector<std::string>& advice) {
  const Eigen::RowVector3d eyes = face.row(kLeftCorner) - face.row(kRightCorner);
  if (eyes.norm() < kLeastEyePixels) advice.emplace_back("Come closer to the camera.");
  if (eyes.norm() > kMostEyeShare * asReal(image.width)) advice.emplace_back("Move back a little.");
  const Eigen::RowVector3d low = face.colwise().minCoeff(), high = face.colwise().maxCoeff();
  if (low.x() < 0 || low.y() < 0 || high.x() > asReal(image.width) || high.y() > asReal(image.height))
    advice.emplace_back("Part of your face is outside the picture: move to its middle.");
  const double turn = degreesOf(std::atan2(eyes.z(), eyes.x())), tilt = degreesOf(std::atan2(eyes.y(), eyes.x()));
  if (std::abs(turn) > kMostTurnDegrees) advice.emplace_back("Turn your face towards the camera.");
  if (std::abs(tilt) > kMostTurnDegrees) advice.emplace_back("Hold your head upright.");
  const Eigen::RowVector3d down = face.row(kChin) - face.row(kForehead);
  if (std::abs(degreesOf(std::atan2(down.z(), down.y()))) > kMostNodDegrees)
    advice.emplace_back("Bring the camera to the height of your eyes.");
}

void adviseOnLight(const VideoImage& image, const FaceLandmarks& face, std::vector<std::string>& advice) {
  const auto [right, left] = brightness(image, face);
  const double mean = (right + left) / 2;
  if (mean < kDarkest) advice.emplace_back("It is too dark: turn on a light in front of you.");
  if (mean > kBrightest) advice.emplace_back("Your face is too bright: dim the light, or move away from it.");
  if (std::max(right, left) > kMostUneven * std::max(1.0, std::min(right, left)))
    advice.emplace_back("The light comes from one side: turn, or light the other side, too.");
}

}  // namespace

StudioLook studioLook(const VideoImage& image, const std::optional<FaceLandmarks>& face) {
  StudioLook look;
  if (!face) {
    look.advice.emplace_back(
        "No face is seen: sit in the middle of the picture, an arm's length away, and look into the camera.");
    return look;
  }
  look.has_face = true;
  const auto draw = [&](Eigen::Index landmark) {
    look.points.emplace_back((*face)(landmark, 0) / asReal(image.width), (*face)(landmark, 1) / asReal(image.height));
  };
  for (const LayoutMarker& marker : defaultLayout().markers) {
    if (marker.mediapipe_landmark >= 0) draw(marker.mediapipe_landmark);
  }
  for (const Eigen::Index landmark : kInnerLips) draw(landmark);
  adviseOnPlace(image, *face, look.advice);
  adviseOnLight(image, *face, look.advice);
  return look;
}

std::vector<std::string> takeFaults(const FaceTrack& track) {
  constexpr double kLeastSeen = 0.95, kMostLost = 0.05, kLeastRateHz = 20, kClipped = 0.98, kQuietDb = -45;
  std::vector<std::string> faults;
  const double seen = std::min(1.0, track.seenShare() / (1 - track.lostShare()));  // of the pictures that came
  if (seen < kLeastSeen)
    faults.push_back(fmt::format("Your face was lost: it is seen in {:.0f} % of the pictures.", 100 * seen));
  if (track.lostShare() > kMostLost)
    faults.push_back(
        fmt::format("{:.0f} % of the pictures were dropped: close other programs.", 100 * track.lostShare()));
  if (track.frame_rate_hz < kLeastRateHz)
    faults.push_back(
        fmt::format("The camera gave only {:.0f} pictures a second: more light helps.", track.frame_rate_hz));
  if (track.sound.samples.empty()) {
    faults.emplace_back("No sound was recorded.");
    return faults;
  }
  const auto clipped = std::count_if(track.sound.samples.begin(), track.sound.samples.end(),
                                     [](float sample) { return std::abs(sample) >= kClipped; });
  if (asReal(clipped) > 5e-4 * asReal(track.sound.samples.size()))
    faults.emplace_back("The sound is clipped: turn the microphone down, or speak more softly.");
  double power = 0;
  for (const float sample : track.sound.samples) power += double{sample} * sample;
  if (10 * std::log10(power / asReal(track.sound.samples.size()) + 1e-12) < kQuietDb)
    faults.emplace_back("You are hardly heard: turn the microphone up, or come closer.");
  return faults;
}

std::optional<std::string> wordFault(const TakeLabeller::Labels& found) {
  const std::size_t words = found.labels.words.size(), doubtful = found.doubtful.size();
  if (3 * doubtful <= words) return std::nullopt;
  std::string which;
  for (const DoubtfulWord& word : found.doubtful) which += fmt::format(" “{}”", word.text);
  return fmt::format("Other words were heard than those of the sentence, at{}.", which);
}

}  // namespace mouthpiece
