#include <algorithm>
#include <array>

#include "base/errors.h"
#include "base/index.h"
#include "exports/arkit.h"
#include "motion/lip_gauge.h"

namespace mouthpiece {

namespace {

/// Lids follow the gaze, but no marker sees it: lids that move are blinks.
bool isGaze(std::string_view shape) { return shape.starts_with("EyeLook"); }

Eigen::RowVectorXd medianOf(const PositionMatrix& positions) {
  Eigen::RowVectorXd median(positions.cols());
  std::vector<double> column(unsignedIndex(positions.rows()));
  for (Eigen::Index c = 0; c < positions.cols(); ++c) {
    Eigen::VectorXd::Map(column.data(), positions.rows()) = positions.col(c);
    const auto middle = column.begin() + positions.rows() / 2;
    std::nth_element(column.begin(), middle, column.end());
    median(c) = *middle;
  }
  return median;
}

/// Lips touch in a frame that is sealed and whose lips' middles are apart by no more than touching lips stretch
/// (FaceRig's slack): by 22 % of their rest where phones tell it, else by 0.5 mm.
std::vector<bool> closedFrames(const MotionClip& motion, const Eigen::RowVectorXd& rest,
                               std::span<const LipPose> lips) {
  constexpr double kMostStretch = 0.22, kNoiseMm = 0.5;
  constexpr float kSealed = 0.98F;
  std::vector<bool> closed(motion.frameCount(), false);
  const LipGauge gauge(motion.marker_names);
  if (!gauge.hasLips()) return closed;
  const double at_rest = gauge.opening(rest);
  const double widest = lips.empty() ? at_rest + kNoiseMm : (1 + kMostStretch) * at_rest;
  for (std::size_t t = 0; t < closed.size(); ++t)
    closed[t] = (lips.empty() || lips[t].seal > kSealed) &&
                gauge.opening(motion.positions_mm.row(signedIndex(t))) <= widest;  // false for NaN
  return closed;
}

/// On the learnt head lips touch at rest, so what closes them does not part their rims, whatever is captured of their
/// outer edges.
ShapeClosures closuresOf(const Eigen::MatrixXd& rims_parted_mm, std::vector<bool> closed) {
  ShapeClosures closures;
  closures.shapes = rims_parted_mm.cast<float>();
  closures.least = closures.most = Eigen::MatrixXf::Zero(closures.shapes.rows(), signedIndex(closed.size()));
  closures.in_frame = std::move(closed);
  return closures;
}

/// The weight of MouthPucker that comes nearest to rounded lips on the learnt head.
double puckerOf(const LipRounding& rounding) {
  const ArkitMarkerMoves& learnt = arkitMarkerMoves();
  const LipGauge gauge(learnt.markers);
  const auto row = [](const MarkerPositions& positions) -> Eigen::RowVectorXd {
    return Eigen::Map<const Eigen::RowVectorXd>(positions.data(), positions.size());
  };
  const Eigen::RowVectorXd rest = row(learnt.neutral_mm);
  const Eigen::RowVectorXd puckered = rest + row(learnt.moves_mm[unsignedIndex(arkitIndex("MouthPucker"))]);
  const double width = gauge.width(rest);
  const Eigen::Vector2d does{(width - gauge.width(puckered)) / width,
                             (gauge.protrusion(puckered) - gauge.protrusion(rest)) / width};
  return std::max(0.0, does.dot(Eigen::Vector2d{rounding.narrowing, rounding.protrusion}) / does.squaredNorm());
}

}  // namespace

RowMajorMatrixF arkitFromMarkers(const MotionClip& motion, const MarkerPositions* neutral_mm,
                                 std::span<const LipPose> lips, const LipRounding& unseen,
                                 std::span<const float> guess) {
  const ArkitMarkerMoves& learnt = arkitMarkerMoves();
  if (motion.frameCount() == 0) return RowMajorMatrixF::Zero(0, signedIndex(kArkitNames.size()));
  MOUTHPIECE_EXPECT(lips.empty() || lips.size() == motion.frameCount());
  MOUTHPIECE_EXPECT(neutral_mm == nullptr || neutral_mm->size() == motion.positions_mm.cols());
  const Eigen::RowVectorXd rest =
      neutral_mm != nullptr
          ? Eigen::RowVectorXd(Eigen::Map<const Eigen::RowVectorXd>(neutral_mm->data(), neutral_mm->size()))
          : medianOf(motion.positions_mm);
  std::vector<std::pair<Eigen::Index, Eigen::Index>> known;  // of the learnt markers, of the motion's
  for (std::size_t i = 0; i < learnt.markers.size(); ++i) {
    if (const auto marker = motion.findMarker(learnt.markers[i])) known.emplace_back(signedIndex(i), marker->row());
  }
  if (known.empty()) throw InputError("found no marker of the default layout; expected some for ARKit's shapes");
  Eigen::MatrixXf shapes = Eigen::MatrixXf::Zero(3 * signedIndex(known.size()), signedIndex(kArkitNames.size()));
  Eigen::MatrixXf moves(shapes.rows(), motion.positions_mm.rows());
  for (Eigen::Index row = 0; row < signedIndex(known.size()); ++row) {
    const auto [marker, column] = known[unsignedIndex(row)];
    for (std::size_t k = 0; k < kArkitNames.size(); ++k) {
      if (!isGaze(kArkitNames[k]))
        shapes.block<3, 1>(3 * row, signedIndex(k)) = learnt.moves_mm[k].row(marker).transpose().cast<float>();
    }
    moves.middleRows<3>(3 * row) =
        (motion.positions_mm.middleCols<3>(3 * column).rowwise() - rest.segment<3>(3 * column))
            .transpose()
            .cast<float>();
  }
  const auto pucker = asFloat(puckerOf(unseen));
  for (std::size_t t = 0; t < lips.size(); ++t)
    moves.col(signedIndex(t)) += lips[t].rounding * pucker * shapes.col(arkitIndex("MouthPucker"));
  const ShapeClosures closures = closuresOf(learnt.rims_parted_mm, closedFrames(motion, rest, lips));
  return fitShapeWeights(shapes, moves.array().isNaN().select(0.0F, moves).matrix().transpose() * shapes,
                         kArkitNames.size(), {.closure = 300}, &closures, guess);
}

void addGaze(std::span<const GazeTurn> gaze, RowMajorMatrixF& weights) {
  MOUTHPIECE_EXPECT(gaze.empty() || std::ssize(gaze) == weights.rows());
  struct Look {
    std::string_view shape;
    float GazeTurn::*turn;
    float sign;
  };
  constexpr std::array<Look, 8> kLooks{{{"EyeLookOutLeft", &GazeTurn::yaw, 1},
                                        {"EyeLookInLeft", &GazeTurn::yaw, -1},
                                        {"EyeLookInRight", &GazeTurn::yaw, 1},
                                        {"EyeLookOutRight", &GazeTurn::yaw, -1},
                                        {"EyeLookUpLeft", &GazeTurn::pitch, 1},
                                        {"EyeLookDownLeft", &GazeTurn::pitch, -1},
                                        {"EyeLookUpRight", &GazeTurn::pitch, 1},
                                        {"EyeLookDownRight", &GazeTurn::pitch, -1}}};
  for (const Look& look : kLooks) {
    for (std::size_t k = 0; k < gaze.size(); ++k)
      weights(signedIndex(k), arkitIndex(look.shape)) =
          std::clamp(look.sign * gaze[k].*look.turn / kWholeLook, 0.0F, 1.0F);
  }
}

}  // namespace mouthpiece
