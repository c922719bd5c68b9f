// The weights of ARKit's shapes, and the files that hold them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"
#include "exports/arkit.h"
#include "exports/gltf/glb.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kShapes = signedIndex(kArkitNames.size());
constexpr int kMostSweeps = 400;
constexpr double kStill = 1e-4;  ///< largest change of a weight in a sweep that ends the search

/// Numbers of two shapes, by name.
using ShapePair = std::array<Eigen::Index, 2>;
Eigen::Index numberOf(std::string_view name) {
  const auto found = std::find(kArkitNames.begin(), kArkitNames.end(), name);
  MOUTHPIECE_EXPECT(found != kArkitNames.end());
  return found - kArkitNames.begin();
}

/// No animator sets both of these.
const std::vector<ShapePair>& opposingShapes() {
  static const std::vector<ShapePair> pairs = [] {
    std::vector<ShapePair> list;
    for (const auto& [one, other] :
         std::initializer_list<std::pair<const char*, const char*>>{{"JawLeft", "JawRight"},
                                                                    {"MouthLeft", "MouthRight"},
                                                                    {"MouthSmileLeft", "MouthFrownLeft"},
                                                                    {"MouthSmileRight", "MouthFrownRight"},
                                                                    {"MouthPucker", "MouthStretchLeft"},
                                                                    {"MouthPucker", "MouthStretchRight"},
                                                                    {"MouthPucker", "MouthSmileLeft"},
                                                                    {"MouthPucker", "MouthSmileRight"},
                                                                    {"MouthFunnel", "MouthPressLeft"},
                                                                    {"MouthFunnel", "MouthPressRight"},
                                                                    {"MouthRollLower", "MouthLowerDownLeft"},
                                                                    {"MouthRollLower", "MouthLowerDownRight"},
                                                                    {"MouthRollUpper", "MouthUpperUpLeft"},
                                                                    {"MouthRollUpper", "MouthUpperUpRight"},
                                                                    {"EyeBlinkLeft", "EyeWideLeft"},
                                                                    {"EyeBlinkRight", "EyeWideRight"},
                                                                    {"BrowDownLeft", "BrowOuterUpLeft"},
                                                                    {"BrowDownRight", "BrowOuterUpRight"}})
      list.push_back({numberOf(one), numberOf(other)});
    return list;
  }();
  return pairs;
}

/// Of each shape its mirror image; -1 where it has none, or where the two undo each other.
std::vector<Eigen::Index> mirrorShapes() {
  std::vector<Eigen::Index> mirrors(kArkitNames.size(), -1);
  for (std::size_t k = 0; k < kArkitNames.size(); ++k) {
    const std::string_view name = kArkitNames[k];
    if (!name.ends_with("Left") || name == "JawLeft" || name == "MouthLeft") continue;
    const Eigen::Index right = numberOf(std::string(name.substr(0, name.size() - 4)) + "Right");
    mirrors[k] = right;
    mirrors[unsignedIndex(right)] = signedIndex(k);
  }
  return mirrors;
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Every weight in turn takes a better value for the others, until none changes. Each step lowers the energy, which is
/// convex while no weight is shut. The weight of MouthClose moves as much of JawOpen, which it takes back at the lips:
/// so it never exceeds JawOpen, and what a jaw does behind closed lips is one weight, not two that hinder each other.
class WeightDescent {
 public:
  WeightDescent(const Eigen::MatrixXf& shapes, const RowMajorMatrixF& seen, std::size_t shape_count,
                const ArkitOptions& options, const ShapeClosures* closures)
      : gram_((shapes.transpose() * shapes).cast<double>()),
        right_(seen.cast<double>()),
        weights_(RowMajor::Zero(seen.rows(), kShapes)),
        pulled_(RowMajor::Zero(seen.rows(), kShapes)),
        shut_(decltype(shut_)::Zero(seen.rows(), kShapes)) {
    for (Eigen::Index k = 0; k < kShapes; ++k) {
      if (gram_(k, k) > 0) present_.push_back(k);
      Eigen::Index& mirror = mirrors_[unsignedIndex(k)];
      if (mirror >= 0 && !(gram_(mirror, mirror) > 0)) mirror = -1;
    }
    const double energy = gram_.trace() / std::max(asReal(shape_count), 1.0);
    pull_ = options.smoothness * energy;
    thrift_ = options.thrift * energy;
    push_ = options.sparsity * energy;
    symmetry_ = options.symmetry * energy;
    press_ = options.press * energy;
    for (const char* name : {"MouthClose", "MouthPressLeft", "MouthPressRight"})
      presses_[unsignedIndex(numberOf(name))] = 1;
    for (const char* name : {"MouthFrownLeft", "MouthFrownRight"}) presses_[unsignedIndex(numberOf(name))] = -1;
    closes_jaw_ = gram_(jaw_, jaw_) > 0 && gram_(close_, close_) > 0;
    if (closes_jaw_) {
      gram_.col(close_) += gram_.col(jaw_);
      gram_.row(close_) += gram_.row(jaw_);
      right_.col(close_) += right_.col(jaw_);
    }
    if (closures == nullptr || closures->shapes.rows() == 0) return;
    closed_ = closures->in_frame;
    least_ = closures->least.transpose().cast<double>();
    most_ = closures->most.transpose().cast<double>();
    parting_ = closures->shapes.transpose().cast<double>();
    if (closes_jaw_) parting_.row(close_) += parting_.row(jaw_);
    parted_ = RowMajor::Zero(least_.rows(), least_.cols());
    closure_ = options.closure * asReal(shapes.rows()) / (100 * asReal(parting_.cols()));
  }

  /// A first guess: each frame as it is by itself after the one before, from whose weights it goes on, as the first
  /// does from `guess`, or from none.
  void begin(std::span<const float> guess) {
    for (Eigen::Index t = 0; t < weights_.rows(); ++t) {
      if (t == 0 && !guess.empty()) {
        weights_.row(0) = Eigen::Map<const Eigen::RowVectorXf>(guess.data(), kShapes).cast<double>();
        if (closes_jaw_) weights_(0, jaw_) = std::max(0.0, weights_(0, jaw_) - weights_(0, close_));
        for (Eigen::Index k = 0; k < kShapes; ++k) weights_(0, k) *= gram_(k, k) > 0 ? 1 : 0;
        pulled_.row(0) = weights_.row(0) * gram_;
      }
      if (t > 0) {
        weights_.row(t) = weights_.row(t - 1);
        pulled_.row(t) = pulled_.row(t - 1);
      }
      if (isClosed(t)) parted_.row(t) = weights_.row(t) * parting_;
      begun_ = t + 1;
      for (int sweep = 0; sweep < kMostSweeps && settle(t) >= kStill;) ++sweep;
    }
  }

  void descend() {
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
      double change = 0;
      for (Eigen::Index step = 0; step < weights_.rows(); ++step) {
        const Eigen::Index t = sweep % 2 == 0 ? step : weights_.rows() - 1 - step;  // news travels both ways
        change = std::max(change, settle(t));
      }
      if (change < kStill) break;
    }
  }

  /// Of two shapes that undo each other the one goes that does less around the frame. True when any did.
  bool shutOpposing() {
    constexpr Eigen::Index kAround = 4;  // frames to each side: neighbours decide alike
    bool any = false;
    for (const auto& [one, other] : opposingShapes()) {
      for (Eigen::Index t = 0; t < weights_.rows(); ++t) {
        if (weights_(t, one) < kZero || weights_(t, other) < kZero) continue;
        const Eigen::Index first = std::max<Eigen::Index>(0, t - kAround),
                           last = std::min(weights_.rows() - 1, t + kAround);
        const auto doneBy = [&](Eigen::Index k) {
          return weights_.col(k).segment(first, last - first + 1).sum() * std::sqrt(gram_(k, k));
        };
        const Eigen::Index less = doneBy(one) < doneBy(other) ? one : other;
        shut_(t, less) = 1;
        set(t, less, 0);
        any = true;
      }
    }
    return any;
  }

  [[nodiscard]] RowMajorMatrixF weights() const {
    RowMajorMatrixF weights = (weights_.array() < kZero).select(0.0, weights_).cast<float>();
    if (closes_jaw_) weights.col(jaw_) += weights.col(close_);
    return weights;
  }

 private:
  static constexpr double kZero = 0.004;  ///< nobody sees less

  /// Settles all weights of a frame, each in turn; returns the largest change.
  double settle(Eigen::Index t) {
    const bool is_closed = isClosed(t);
    const double* const right = &right_(t, 0);
    const double* const pulled = &pulled_(t, 0);
    const double* const weights = &weights_(t, 0);
    const double* const before = t > 0 ? weights - kShapes : nullptr;
    const double* const after = t + 1 < begun_ ? weights + kShapes : nullptr;
    const double around = thrift_ + (before ? pull_ : 0) + (after ? pull_ : 0);
    double largest = 0;
    for (const Eigen::Index k : present_) {
      if (!mayMove(t, k)) continue;
      const double own = gram_(k, k);
      double target = right[k] - push_ - pulled[k] + own * weights[k];
      double share = own + around;
      if (is_closed) target += press_ * presses_[unsignedIndex(k)];
      if (before) target += pull_ * before[k];
      if (after) target += pull_ * after[k];
      if (const Eigen::Index mirror = mirrors_[unsignedIndex(k)]; mirror >= 0) {
        target += symmetry_ * weights[mirror];
        share += symmetry_;
      }
      if (target <= 0 && weights[k] == 0 && !is_closed) continue;  // most weights rest most of the time
      const double most = closes_jaw_ && k == jaw_     ? 1 - weights[close_]
                          : closes_jaw_ && k == close_ ? 1 - weights[jaw_]
                                                       : 1;
      const double best = is_closed ? bestOfClosed(t, k, target, share, most) : std::clamp(target / share, 0.0, most);
      largest = std::max(largest, std::abs(best - weights[k]));
      set(t, k, best);
    }
    return largest;
  }

  [[nodiscard]] bool mayMove(Eigen::Index t, Eigen::Index k) const { return shut_(t, k) == 0; }

  [[nodiscard]] bool isClosed(Eigen::Index t) const { return !closed_.empty() && closed_[unsignedIndex(t)]; }

  /// Where places meet: the weight of shape `k` at which share x - target and what those places pull that are out of
  /// their bounds are in balance, by Newton's method.
  [[nodiscard]] double bestOfClosed(Eigen::Index t, Eigen::Index k, double target, double share, double most) const {
    constexpr int kSteps = 5;
    double best = weights_(t, k);
    for (int step = 0; step < kSteps; ++step) {
      double off = 0, bend = 0;
      for (Eigen::Index row = 0; row < parted_.cols(); ++row) {
        const double moves = parting_(k, row), at = parted_(t, row) + (best - weights_(t, k)) * moves;
        const double beyond = at - std::clamp(at, least_(t, row), most_(t, row));
        off += moves * beyond;
        bend += beyond == 0 ? 0 : moves * moves;
      }
      const double before = best;
      best = std::clamp((target + closure_ * (bend * best - off)) / (share + closure_ * bend), 0.0, most);
      if (std::abs(best - before) < kStill / 10) break;
    }
    return best;
  }

  /// Most weights rest most of the time: the products follow what changes, instead of being made again.
  void set(Eigen::Index t, Eigen::Index k, double weight) {
    const double change = weight - weights_(t, k);
    if (change == 0) return;
    pulled_.row(t) += change * gram_.row(k);
    if (isClosed(t)) parted_.row(t) += change * parting_.row(k);
    weights_(t, k) = weight;
  }

  RowMajor gram_;   ///< 52 x 52
  RowMajor right_;  ///< frames x 52, as those that follow
  RowMajor weights_;
  Eigen::Index begun_ = 0;  ///< frames that have weights
  RowMajor pulled_;         ///< of each frame the Gram matrix times the weights
  Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> shut_;  ///< 1: stays 0
  RowMajor parting_;                ///< 52 x places that meet: how far apart a shape moves them
  RowMajor parted_, least_, most_;  ///< frames x places: how far apart they are, and how far they may be
  double closure_ = 0;
  std::vector<bool> closed_;                            ///< frames in which the lips meet
  std::vector<Eigen::Index> mirrors_ = mirrorShapes();  ///< -1 also where the head has no mirror image
  std::vector<Eigen::Index> present_;                   ///< shapes that the head has
  Eigen::Index jaw_ = numberOf("JawOpen"), close_ = numberOf("MouthClose");
  bool closes_jaw_ = false;                                                   ///< the head has both
  std::vector<double> presses_ = std::vector<double>(kArkitNames.size(), 0);  ///< where lips meet: 1 more, -1 less
  double pull_ = 0, thrift_ = 0, push_ = 0, symmetry_ = 0, press_ = 0;
};

}  // namespace

RowMajorMatrixF fitShapeWeights(const Eigen::MatrixXf& shapes, const RowMajorMatrixF& seen, std::size_t shape_count,
                                const ArkitOptions& options, const ShapeClosures* closures,
                                std::span<const float> guess) {
  MOUTHPIECE_EXPECT(guess.empty() || std::ssize(guess) == kShapes);
  WeightDescent descent(shapes, seen, shape_count, options, closures);
  descent.begin(guess);
  descent.descend();
  // What one of two may do changes once the other is shut, and may meet a third.
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds && descent.shutOpposing(); ++round) descent.descend();
  descent.shutOpposing();
  return descent.weights();
}

std::string liveLinkCsv(const ArkitCurves& curves) {
  constexpr std::array<std::string_view, 9> kHeadAndEyes{"HeadYaw",     "HeadPitch",     "HeadRoll",
                                                         "LeftEyeYaw",  "LeftEyePitch",  "LeftEyeRoll",
                                                         "RightEyeYaw", "RightEyePitch", "RightEyeRoll"};
  std::string text = "Timecode,BlendShapeCount";
  for (const std::string_view name : kArkitNames) text.append(",").append(name);
  for (const std::string_view name : kHeadAndEyes) text.append(",").append(name);
  text += '\n';
  const auto frames_a_second = std::max<std::int64_t>(1, std::llround(curves.frame_rate_hz));
  for (Eigen::Index t = 0; t < curves.weights.rows(); ++t) {
    const std::int64_t seconds = t / frames_a_second;
    text += fmt::format("{:02}:{:02}:{:02}:{:02}.000,{}", seconds / 3600, seconds / 60 % 60, seconds % 60,
                        t % frames_a_second, kArkitNames.size() + kHeadAndEyes.size());
    for (Eigen::Index k = 0; k < kShapes; ++k) text += fmt::format(",{:.6f}", curves.weights(t, k));
    const HeadTurn head = curves.head.empty() ? HeadTurn{} : curves.head[unsignedIndex(t)];
    const GazeTurn eye = curves.gaze.empty() ? GazeTurn{} : curves.gaze[unsignedIndex(t)];
    for (const float turn : {head.yaw, head.pitch, head.roll, eye.yaw, eye.pitch, 0.0F, eye.yaw, eye.pitch, 0.0F})
      text += fmt::format(",{:.6f}", turn);
    text += '\n';
  }
  return text;
}

std::string glbWithArkitAnimation(std::string_view glb, const std::string& file, const ArkitCurves& curves,
                                  std::string_view object) {
  auto made = glbWithWeights(glb, file, curves.frame_rate_hz, {curves.weights, arkitIndex}, object);
  if (!made) throw InputError(file, "", "holds no shape with an ARKit name");
  return *std::move(made);
}

}  // namespace mouthpiece
