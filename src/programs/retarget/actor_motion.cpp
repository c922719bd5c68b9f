#include "programs/retarget/actor_motion.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/counted.h"
#include "base/errors.h"
#include "base/index.h"
#include "motion/cleaning/repairs.h"
#include "motion/cleaning/rigid.h"

namespace mouthpiece {
namespace {

constexpr double kTurnedDeg = 5, kMovedMm = 5;  ///< skin alone makes a still head seem to turn or move by less
/// The mean place of most markers is no further from the neutral pose, that of any (a chin in a long "ah") than twice
/// that.
constexpr double kFarMm = 25, kMostFar = 0.25;
constexpr double kSwappedMm = 10;  ///< what exchanging two names brings them nearer by at least
/// Heads differ by a quarter at most, with what a tracker adds (metresPerUnit()); 1.3 tore a face by 10 mm. What is
/// told.
constexpr double kLargest = 1.28, kOdd = 1.18;
constexpr double kGlitchMm = 5;  ///< what a marker leaves its path by, to be bridged

/// The motion's columns of the actor's markers, and the actor's rows, side by side.
struct SharedMarkers {
  std::vector<Eigen::Index> columns, rows;
  std::vector<bool> stable;
};

SharedMarkers sharedMarkers(const MotionClip& motion, const std::vector<std::string>& names,
                            const MarkerLayout& layout) {
  SharedMarkers shared;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto marker = motion.findMarker(names[i]);
    if (!marker) continue;
    shared.columns.push_back(marker->row());
    shared.rows.push_back(signedIndex(i));
    shared.stable.push_back(std::any_of(layout.markers.begin(), layout.markers.end(),
                                        [&](const LayoutMarker& one) { return one.name == names[i] && one.stable; }));
  }
  return shared;
}

/// The seen samples' mean of each shared marker; NaN where none was seen.
MarkerPositions meanPlaces(const MotionClip& motion, const SharedMarkers& shared) {
  MarkerPositions mean = MarkerPositions::Zero(signedIndex(shared.columns.size()), 3);
  for (Eigen::Index i = 0; i < mean.rows(); ++i) {
    double seen = 0;
    for (Eigen::Index frame = 0; frame < motion.positions_mm.rows(); ++frame) {
      const Eigen::RowVector3d place = motion.positions_mm.block<1, 3>(frame, 3 * shared.columns[unsignedIndex(i)]);
      if (!place.allFinite()) continue;
      mean.row(i) += place;
      ++seen;
    }
    mean.row(i) /= seen;
  }
  return mean;
}

/// What one line of several markers tells: the first, and how many more.
std::string andMore(const std::string& first, std::size_t count) {
  return count > 1 ? fmt::format("{} and {} more", first, count - 1) : first;
}

class Intake {
 public:
  Intake(MotionClip&& motion, const std::vector<std::string>& names, const MarkerPositions& neutral,
         const MarkerLayout& layout, const std::string& file)
      : made_{std::move(motion), {}}, names_(names), neutral_(neutral), layout_(layout), file_(file) {
    leaveOutUnseen();
    shared_ = sharedMarkers(made_.motion, names, layout);
    if (shared_.columns.empty()) return;
    holdStill();
    refuseOtherSizes();
    refuseSwappedNames();
    refuseFarMarkers();
    refuseGaps();
    bridgeGlitches();
  }

  ActorMotion take() && { return std::move(made_); }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(file_, "", what); }

  [[nodiscard]] const std::string& nameOf(std::size_t shared) const {
    return names_[unsignedIndex(shared_.rows[shared])];
  }
  [[nodiscard]] MarkerPositions neutralOfShared() const { return neutral_(shared_.rows, Eigen::all); }

  void leaveOutUnseen() {
    std::vector<std::string> seen, unseen;
    for (std::size_t m = 0; m < made_.motion.markerCount(); ++m) {
      const bool is_seen =
          made_.motion.positions_mm.middleCols<3>(3 * signedIndex(m)).rowwise().sum().array().isFinite().any() ||
          made_.motion.frameCount() == 0;
      (is_seen ? seen : unseen).push_back(made_.motion.marker_names[m]);
    }
    if (unseen.empty()) return;
    made_.motion = selectMarkers(made_.motion, seen);
    made_.notices.push_back(
        fmt::format("{}: no frame shows {}; the face moves without", file_, andMore(unseen[0], unseen.size())));
  }

  void holdStill() {
    MotionClip& motion = made_.motion;
    const MarkerPositions neutral = neutralOfShared();
    MarkerPositions known = neutral;
    for (std::size_t i = 0; i < shared_.stable.size(); ++i) {
      if (!shared_.stable[i]) known.row(signedIndex(i)).setConstant(std::nan(""));
    }
    std::vector<RigidMotion> still;
    double turned = 0, moved = 0;
    std::size_t farthest = 0;
    const auto count = signedIndex(shared_.columns.size());
    for (std::size_t f = 0; f < motion.frameCount(); ++f) {
      const MarkerPositions pose = motion.pose(FrameIndex{f})(shared_.columns, Eigen::all);
      const auto found = fitRigidMotion(pose, known);
      if (!found && still.empty()) return;  // no stable markers, or none seen at first
      still.push_back(found ? *found : still.back());
      const double turn = Eigen::AngleAxisd(still[f].rotation).angle() * 180 / std::numbers::pi;
      const RigidMotion head = still[f].inverse();
      const Eigen::Vector3d middle = neutral.colwise().mean().transpose();
      const double move = (head.apply(middle) - middle).norm();
      if (std::max(turn / kTurnedDeg, move / kMovedMm) > std::max(turned / kTurnedDeg, moved / kMovedMm)) farthest = f;
      turned = std::max(turned, turn);
      moved = std::max(moved, move);
    }
    if (turned <= kTurnedDeg && moved <= kMovedMm) return;
    for (Eigen::Index f = 0; f < motion.positions_mm.rows(); ++f) {
      for (Eigen::Index i = 0; i < count; ++i) {
        auto place = motion.positions_mm.block<1, 3>(f, 3 * shared_.columns[unsignedIndex(i)]);
        place = still[unsignedIndex(f)].apply(place.transpose()).transpose().eval();
      }
    }
    made_.notices.push_back(
        fmt::format("{}: the head turns by up to {:.0f} degrees and moves by up to {:.0f} mm, most at {:.2f} s; it is "
                    "held still",
                    file_, turned, moved, motion.timeOf(FrameIndex{farthest})));
  }

  /// By the stable markers where there are some: an open mouth makes a face longer.
  void refuseOtherSizes() {
    constexpr std::size_t kEnough = 4;
    MarkerPositions neutral = neutralOfShared(), mean = meanPlaces(made_.motion, shared_);
    std::vector<Eigen::Index> stable;
    for (std::size_t i = 0; i < shared_.stable.size(); ++i) {
      if (shared_.stable[i]) stable.push_back(signedIndex(i));
    }
    if (stable.size() >= kEnough) {
      neutral = neutral(stable, Eigen::all).eval();
      mean = mean(stable, Eigen::all).eval();
    }
    const MarkerPositions from_middle = neutral.rowwise() - neutral.colwise().mean();
    const MarkerPositions here = mean.rowwise() - mean.colwise().mean();
    const double size = (here.array() * from_middle.array()).sum() / from_middle.squaredNorm();
    if (!(size > 0) || (size < kOdd && size > 1 / kOdd)) return;  // mirrored or of other axes: markers are far off
    if (size < kLargest && size > 1 / kLargest) {
      made_.notices.push_back(fmt::format("{}: its face is {:.2f} times as large as the actor's", file_, size));
      return;
    }
    fail(
        fmt::format("its face is {:.3g} times as large as the actor's; expected millimetres, and --corpus of the actor "
                    "who moves where it is another than the face was fitted with",
                    size));
  }

  void refuseSwappedNames() const {
    const MarkerPositions neutral = neutralOfShared(), mean = meanPlaces(made_.motion, shared_);
    for (Eigen::Index i = 0; i < mean.rows(); ++i) {
      for (Eigen::Index k = i + 1; k < mean.rows(); ++k) {
        const double as_named = (mean.row(i) - neutral.row(i)).norm() + (mean.row(k) - neutral.row(k)).norm();
        const double exchanged = (mean.row(i) - neutral.row(k)).norm() + (mean.row(k) - neutral.row(i)).norm();
        if (!(as_named - exchanged >= kSwappedMm && exchanged <= as_named / 2)) continue;
        fail(fmt::format("{} lies where the actor has {}, and the other way round; expected them to change names",
                         nameOf(unsignedIndex(i)), nameOf(unsignedIndex(k))));
      }
    }
  }

  void refuseFarMarkers() const {
    const Eigen::VectorXd off = (meanPlaces(made_.motion, shared_) - neutralOfShared()).rowwise().norm();
    Eigen::Index worst = 0;
    const double most = off.maxCoeff(&worst);
    if (!(most > 2 * kFarMm) && asReal((off.array() > kFarMm).count()) < kMostFar * asReal(off.size())) return;
    fail(
        fmt::format("{} of {} markers lie over {:.0f} mm from the actor's neutral pose, {} by {:.0f} mm in the mean; "
                    "expected motion of the actor whom --corpus names, X to the subject's left, Y up, Z out of the "
                    "face",
                    (off.array() > kFarMm).count(), off.size(), kFarMm, nameOf(unsignedIndex(worst)), off[worst]));
  }

  void refuseGaps() const {
    std::size_t samples = 0, markers = 0;
    const Gap* first = nullptr;
    std::optional<MarkerIndex> last;
    const std::vector<Gap> gaps = findGaps(made_.motion);
    for (const Gap& gap : gaps) {
      const bool is_shared =
          std::find(shared_.columns.begin(), shared_.columns.end(), gap.marker.row()) != shared_.columns.end();
      if (!is_shared) continue;
      if (first == nullptr || gap.first < first->first) first = &gap;
      samples += gap.last.value - gap.first.value;
      if (!last || last->value != gap.marker.value) ++markers;
      last = gap.marker;
    }
    if (first == nullptr) return;
    fail(
        fmt::format("{} is not seen from {:.2f} s on for {}, the first gap of {} ({} in all); expected gaps to be "
                    "filled (`corpus clean`)",
                    made_.motion.marker_names[first->marker.value], made_.motion.timeOf(first->first),
                    counted(first->last.value - first->first.value, "frame"), counted(markers, "marker"),
                    counted(samples, "sample")));
  }

  void bridgeGlitches() {
    MotionClip& motion = made_.motion;
    std::vector<Spike> glitches = hideSpikes(motion).spikes;
    std::erase_if(glitches, [](const Spike& spike) { return spike.distance_mm < kGlitchMm; });
    if (glitches.empty()) return;
    MotionClip hidden = motion;
    const auto samplesOf = [](MotionClip& clip, const Spike& spike) {
      return clip.positions_mm.block(signedIndex(spike.first.value), 3 * spike.marker.row(),
                                     signedIndex(spike.last.value - spike.first.value), 3);
    };
    for (const Spike& spike : glitches) samplesOf(hidden, spike).setConstant(std::nan(""));
    MotionClip filled = fillShortGaps(hidden).clip;
    std::erase_if(glitches, [&](const Spike& spike) { return !samplesOf(filled, spike).allFinite(); });
    for (const Spike& spike : glitches) samplesOf(motion, spike) = samplesOf(filled, spike);
    if (glitches.empty()) return;
    const Spike& worst = *std::max_element(glitches.begin(), glitches.end(), [](const Spike& one, const Spike& other) {
      return one.distance_mm < other.distance_mm;
    });
    made_.notices.push_back(fmt::format(
        "{}: {} jumps {:.0f} mm off its path at {:.2f} s ({} such in all); it is led past", file_,
        motion.marker_names[worst.marker.value], worst.distance_mm, motion.timeOf(worst.first), glitches.size()));
  }

  ActorMotion made_;
  const std::vector<std::string>& names_;
  const MarkerPositions& neutral_;
  const MarkerLayout& layout_;
  const std::string& file_;
  SharedMarkers shared_;
};

}  // namespace

ActorMotion actorMotion(MotionClip motion, const std::vector<std::string>& names, const MarkerPositions& neutral_mm,
                        const MarkerLayout& layout, const std::string& file) {
  return Intake(std::move(motion), names, neutral_mm, layout, file).take();
}

}  // namespace mouthpiece
