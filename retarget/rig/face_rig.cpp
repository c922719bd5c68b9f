#include "retarget/rig/face_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <mutex>
#include <optional>
#include <set>

#include "base/errors.h"
#include "base/smooth_step.h"
#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/virtual_points.h"
#include "deform/topology/welding.h"
#include "motion/arkit_shapes.h"
#include "motion/lip_gauge.h"
#include "retarget/rig/eyeballs.h"
#include "retarget/rig/face_file.h"

namespace mouthpiece {

struct FaceRig::Data {
  FaceFile file;
  std::shared_ptr<const FaceMesh> mesh;
  RbfWarp warp;
  Welding welding;        ///< of `mesh`
  FaceDeformer deformer;  ///< of the welded mesh
  std::vector<std::uint32_t> moving;
  LarynxBump larynx;
  struct LateEyes {
    std::once_flag found;
    Eyeballs eyes;
  };
  std::unique_ptr<LateEyes> late_eyes = std::make_unique<LateEyes>();  ///< most lines do not turn them

  [[nodiscard]] const Eyeballs& eyes() const {
    std::call_once(late_eyes->found, [&] { late_eyes->eyes = Eyeballs(*mesh); });
    return late_eyes->eyes;
  }

  void deform(const FacePose& pose, const TonguePose& tongue, VertexPositions& out) const;
  /// Positions of `moving` only.
  void deformMoving(const FacePose& pose, const TonguePose& tongue, std::span<float> out) const;

  using ChangeVertices = std::function<void(std::size_t frame, std::span<float> places)>;
  /// `frames` with the vertices `more`, as they are moved or at rest, after `change`. `more` must outlive them.
  [[nodiscard]] FrameMaker with(FrameMaker frames, const std::vector<std::uint32_t>& more, ChangeVertices change) const;
};

namespace {

/// Nothing where the markers that tell the face's size are missing.
LarynxBump larynxOf(const FaceFile& file, const FaceMesh& mesh) {
  const auto place = [&](std::string_view name) -> std::optional<Eigen::Vector3d> {
    const auto found = std::find(file.marker_names.begin(), file.marker_names.end(), name);
    if (found == file.marker_names.end()) return std::nullopt;
    return file.marker_targets.row(found - file.marker_names.begin());
  };
  const auto chin = place("CHIN_MID"), right = place("CANTHUS_OUT_R"), left = place("CANTHUS_OUT_L");
  if (!chin || !right || !left) return {};
  return {mesh, *chin, (*left - *right).norm()};
}

}  // namespace

FaceRig::FaceRig() = default;
FaceRig::FaceRig(FaceRig&&) noexcept = default;
FaceRig& FaceRig::operator=(FaceRig&&) noexcept = default;
FaceRig::~FaceRig() = default;

FaceRig FaceRig::load(const std::filesystem::path& face_file) {
  FaceFile file = readFaceFile(face_file);
  std::shared_ptr<const FaceMesh> mesh = meshOf(file, face_file, readMeshBytesOf(file, face_file));
  return of(std::move(file), std::move(mesh), face_file.string());
}

FaceRig FaceRig::of(FaceFile file, FaceMesh mesh, const std::string& name) {
  return of(std::move(file), std::make_shared<const FaceMesh>(std::move(mesh)), name);
}

FaceRig FaceRig::of(FaceFile file, std::shared_ptr<const FaceMesh> shared_mesh, const std::string& name,
                    const HeadTopology* topology) {
  const FaceMesh& mesh = *shared_mesh;
  checkBinding(file.binding, mesh, file.control, name);
  RbfWarp warp = [&] {
    try {
      return RbfWarp::fit(file.actor_neutral_mm, file.marker_targets, file.warp);
    } catch (const InputError& error) {
      throw InputError(name, "warp", error.what());
    }
  }();
  Welding welding = weldSplitTriangles(mesh);
  FaceDeformer deformer = [&] {
    const DeformerOptions options{.guard = file.guard, .topology = welding.isNothing() ? topology : nullptr};
    try {
      return welding.isNothing()
                 ? FaceDeformer(mesh, file.control, file.binding, options)
                 : FaceDeformer(welding.mesh, file.control, weldedBinding(file.binding, welding), options);
    } catch (const InputError& error) {
      throw InputError(name, "guard", error.what());
    }
  }();
  std::vector<std::uint32_t> moving = deformer.movingVertices();
  if (!welding.isNothing()) {
    const std::set<std::uint32_t> moves(moving.begin(), moving.end());
    moving.clear();
    for (std::uint32_t v = 0; v < welding.welded_of.size(); ++v) {
      if (moves.contains(welding.welded_of[v])) moving.push_back(v);
    }
  }
  LarynxBump larynx = larynxOf(file, mesh);
  FaceRig rig;
  rig.data_ = std::make_unique<Data>(Data{std::move(file), std::move(shared_mesh), std::move(warp), std::move(welding),
                                          std::move(deformer), std::move(moving), std::move(larynx)});
  return rig;
}

const FaceMesh& FaceRig::mesh() const { return *data_->mesh; }
const VertexPositions& FaceRig::restVertices() const { return data_->mesh->vertices; }
double FaceRig::metresPerUnit() const { return data_->mesh->metres_per_unit; }
const std::string& FaceRig::name() const { return data_->file.name; }
FaceFile FaceRig::withSetUp(FaceFile face) const {
  face.mesh = data_->mesh;
  face.guard = data_->deformer.guardWords();
  return face;
}
const std::vector<std::string>& FaceRig::markerNames() const { return data_->file.marker_names; }

namespace {

/// Lips that touch stretch before they part. How far, as shares of the closed mouth's height.
struct LipSlack {
  double always = 0;  ///< the capture's own noise
  double sealed = 0;  ///< more, where they stick: half of the closures lie above the median
};

/// In captured B P M the outer lip markers are further apart than at rest though the lips touch. Where phones tell that
/// the lips are shut (`is_told`) they hold longer: labels are some hundredths of a second beside the motion, and a
/// captured mouth rests a little open.
LipSlack lipSlack(double neutral_mm, double closed_lips_mm, bool is_told) {
  constexpr double kScatter = 1.6;
  constexpr double kNoiseMm = 0.5;
  constexpr double kMostSlack = 0.3;
  constexpr double kHeld = 0.22;
  if (!(neutral_mm > 0)) return {};
  const double stretch_mm = closed_lips_mm > 0 ? std::max(0.0, closed_lips_mm - neutral_mm) : 0.0;
  const double always = std::min(kNoiseMm / neutral_mm, kMostSlack);
  const double least = is_told ? std::max(0.0, kHeld - always) : 0.0;
  return {always, std::clamp(kScatter * stretch_mm / neutral_mm, least, kMostSlack - always)};
}

/// Between lips that the tongue's tip goes through, as a share of the closed mouth's height.
constexpr double kWidestParting = 0.12;

/// Of the lips at rest; 0 where one of the two is missing.
double openingOf(const MarkerPositions& places, const std::vector<std::string>& names) {
  const LipGauge lips(names);
  return lips.hasLips() ? lips.opening(Eigen::Map<const Eigen::RowVectorXd>(places.data(), places.size())) : 0;
}

/// The pose at rest of whoever moves, a row for each marker of `motion`; those that the face has not are not used.
MarkerPositions neutralOf(const MotionClip& motion, const ActorPose* actor, const FaceFile& file) {
  if (actor != nullptr) return actor->neutral_mm;
  MarkerPositions neutral = MarkerPositions::Zero(signedIndex(motion.marker_names.size()), 3);
  for (std::size_t i = 0; i < file.marker_names.size(); ++i) {
    if (const auto marker = motion.findMarker(file.marker_names[i]))
      neutral.row(signedIndex(marker->value)) = file.actor_neutral_mm.row(signedIndex(i));
  }
  return neutral;
}

/// What rounding adds to each marker's place: to the lips wholly, to what lies around them less and less.
MarkerPositions roundingOf(const FaceFile& file, const LipRounding& unseen) {
  constexpr double kFades = 0.9;        // over so many half widths and heights of the mouth
  constexpr double kCornersStay = 0.4;  // of the way forward
  MarkerPositions added = MarkerPositions::Zero(file.marker_targets.rows(), 3);
  const LipGauge lips(file.marker_names);
  if (!lips.hasLips() || !lips.has(MarkerRole::kRightLipCorner) || !lips.has(MarkerRole::kLeftLipCorner)) return added;
  const auto place = [&](MarkerRole role) -> Eigen::RowVector3d {
    return file.marker_targets.row(lips.column(role) / 3);
  };
  const Eigen::RowVector3d right = place(MarkerRole::kRightLipCorner), left = place(MarkerRole::kLeftLipCorner);
  const Eigen::RowVector3d upper = place(MarkerRole::kUpperLip), lower = place(MarkerRole::kLowerLip);
  const double half_width = 0.5 * (left - right).norm(), half_height = 0.5 * (upper - lower).norm();
  const Eigen::RowVector3d middle = 0.5 * (right + left);
  for (Eigen::Index m = 0; m < added.rows(); ++m) {
    const Eigen::RowVector3d off = file.marker_targets.row(m) - middle;
    const double x = off.x() / half_width, y = off.y() / half_height;
    const double share = 1 - smoothStep((std::hypot(x, y) - 1) / kFades);
    added(m, 0) = -share * unseen.narrowing * off.x();
    added(m, 2) = share * unseen.protrusion * 2 * half_width * (1 - kCornersStay * std::min(1.0, x * x));
  }
  return added;
}

/// How far each of lipPairs() is from the middle of the mouth: 0 there, 1 at a corner.
std::vector<double> waysToCorners(const ControlMesh& control, std::span<const LipPair> pairs) {
  const int right = findPoint(control, "LIP_CORNER_R"), left = findPoint(control, "LIP_CORNER_L");
  std::vector<double> ways(pairs.size(), 0.0);
  if (right < 0 || left < 0) return ways;
  const Eigen::RowVector3d from = control.rest.row(right), across = control.rest.row(left) - from;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::RowVector3d rims = 0.5 * (control.rest.row(pairs[i].upper_rim) + control.rest.row(pairs[i].lower_rim));
    ways[i] = std::abs(2 * (rims - from).dot(across) / across.squaredNorm() - 1);
  }
  return ways;
}

/// Rounded lips come together from the corners of the mouth on, and between them a round hole stays: what lies inside
/// the lips' outer edges no marker tells. `way`: of waysToCorners(); `height`: of the closed lips.
LipGap rounded(LipGap gap, double rounding, double way, double height) {
  constexpr double kHole = 0.1, kShut = 0.7;  // of the way to a corner: the hole's middle, and where no hole is
  constexpr double kHoleHeight = 0.25;        // of the closed lips' height
  const double beside = smoothStep(kHole, kShut, way);
  const double share = rounding * rounding;  // in R and SH the lips hardly meet beside the hole
  gap.opened *= 1 - share * beside;
  gap.least = (1 - share) * gap.least + share * (1 - beside) * std::max(gap.least, kHoleHeight * height);
  return gap;
}

/// A pair of lids on the head: the markers' rows, and the way from the lower one to the upper.
struct LidPair {
  std::string side;
  Eigen::Index upper, lower;
  Eigen::RowVector3d opening;
};

std::vector<LidPair> lidPairs(const FaceFile& file) {
  const auto row = [&](const std::string& name) {
    return std::find(file.marker_names.begin(), file.marker_names.end(), name) - file.marker_names.begin();
  };
  std::vector<LidPair> pairs;
  for (const char* side : {"R", "L"}) {
    const Eigen::Index upper = row(fmt::format("LID_UP_{}", side)), lower = row(fmt::format("LID_LO_{}", side));
    if (std::max(upper, lower) >= file.marker_targets.rows()) continue;
    const Eigen::RowVector3d opening = file.marker_targets.row(upper) - file.marker_targets.row(lower);
    if (opening.norm() > 0) pairs.push_back({side, upper, lower, opening});
  }
  return pairs;
}

/// How far up the lids go with eyes that look wholly up or down, as shares of the eye's opening: by the head that
/// ARKit's shapes were learnt from.
struct LidFollow {
  double upper = 0, lower = 0;
};

LidFollow lidFollow(std::string_view side, bool looks_up) {
  const ArkitMarkerMoves& learnt = arkitMarkerMoves();
  const auto rise = [&](std::string_view shape, std::string_view lid) {
    const auto of_shape =
        std::find(kArkitNames.begin(), kArkitNames.end(), fmt::format("{}{}", shape, side == "R" ? "Right" : "Left"));
    const auto marker = std::find(learnt.markers.begin(), learnt.markers.end(), fmt::format("LID_{}_{}", lid, side));
    if (marker == learnt.markers.end()) return 0.0;
    return learnt.moves_mm[unsignedIndex(of_shape - kArkitNames.begin())](marker - learnt.markers.begin(), 1);
  };
  const double opening = rise("EyeBlink", "LO") - rise("EyeBlink", "UP");
  if (!(opening > 0)) return {};
  const std::string_view look = looks_up ? "EyeLookUp" : "EyeLookDown";
  return {rise(look, "UP") / opening, rise(look, "LO") / opening};
}

/// Lids follow the eyes up and down, the less the more they are closed: lids that meet stay where they are.
void followGaze(const FaceFile& file, std::span<const GazeTurn> gaze, PositionMatrix& markers) {
  for (const LidPair& lids : gaze.empty() ? std::vector<LidPair>() : lidPairs(file)) {
    const LidFollow up = lidFollow(lids.side, true), down = lidFollow(lids.side, false);
    for (Eigen::Index f = 0; f < markers.rows(); ++f) {
      const double pitch = double{gaze[unsignedIndex(f)].pitch};
      const double share = std::min(1.0, std::abs(pitch) / kWholeLook);
      auto upper = markers.block<1, 3>(f, 3 * lids.upper), lower = markers.block<1, 3>(f, 3 * lids.lower);
      const double open = std::clamp((upper - lower).dot(lids.opening) / lids.opening.squaredNorm(), 0.0, 1.0);
      const LidFollow& follow = pitch > 0 ? up : down;
      upper += share * open * follow.upper * lids.opening;
      lower += share * open * follow.lower * lids.opening;
    }
  }
}

/// Lids come as near to each other on the head as the actor's do, as a share of the eye's opening at rest: the warp
/// carries millimetres, and a blink of a wide eye takes a narrow eye's upper lid through the lower one.
void shareLids(const FaceFile& file, const MarkerPositions& neutral, const PositionMatrix& frames,
               PositionMatrix& markers) {
  constexpr double kWhole = 0.3;  // of the opening: lids that have closed by it go by their share alone
  for (const auto& [side, upper, lower, of_head] : lidPairs(file)) {
    const Eigen::RowVector3d of_actor = neutral.row(upper) - neutral.row(lower);
    if (!(of_actor.norm() > 0)) continue;
    const Eigen::RowVector3d up = of_head.normalized();
    for (Eigen::Index f = 0; f < frames.rows(); ++f) {
      const auto apart = [&, above = upper, below = lower](const PositionMatrix& at) -> Eigen::RowVector3d {
        return at.block<1, 3>(f, 3 * above) - at.block<1, 3>(f, 3 * below);
      };
      const double share = apart(frames).dot(of_actor) / of_actor.squaredNorm();
      if (share >= 1) continue;
      const double wanted = std::max(share, 0.0) * of_head.norm();
      markers.block<1, 3>(f, 3 * upper) += smoothStep((1 - share) / kWhole) * (wanted - apart(markers).dot(up)) * up;
    }
  }
}

}  // namespace

FaceMotion FaceRig::retarget(const MotionClip& motion, const ActorPose* actor, std::span<const LipPose> lips,
                             std::span<const GazeTurn> gaze) const {
  MOUTHPIECE_EXPECT(lips.empty() || lips.size() == motion.frameCount());
  MOUTHPIECE_EXPECT(gaze.empty() || gaze.size() == motion.frameCount());
  const std::vector<std::string>& names = data_->file.marker_names;
  const CompletedMarkers completed = completedMarkers(motion, neutralOf(motion, actor, data_->file),
                                                      data_->file.control, data_->file.actor_neutral_mm);
  const MarkerPositions& neutral = completed.neutral_mm;
  const PositionMatrix& frames = completed.positions_mm;
  if (!frames.allFinite()) {
    throw InputError(
        "the motion has markers that were not seen in some frames; expected gaps to be filled (`corpus clean`)");
  }
  const MarkerPositions closing = closingOffsets(data_->file.control);
  const LipSlack slack =
      lipSlack(openingOf(neutral, names), actor != nullptr ? actor->closed_lips_mm : data_->file.actor_closed_lips_mm,
               !lips.empty());
  const std::vector<LipPair> pairs = lipPairs(data_->file.control);
  PositionMatrix markers = data_->warp.targetFromActorRelative(frames, neutral);
  markers.rowwise() += Eigen::Map<const Eigen::RowVectorXd>(closing.data(), closing.size());
  if (!lips.empty()) {
    const MarkerPositions rounding =
        roundingOf(data_->file, actor != nullptr ? actor->unseen : data_->file.actor_unseen);
    const Eigen::Map<const Eigen::RowVectorXd> added(rounding.data(), rounding.size());
    for (Eigen::Index frame = 0; frame < markers.rows(); ++frame)
      markers.row(frame) += double{lips[unsignedIndex(frame)].rounding} * added;
  }
  shareLids(data_->file, neutral, frames, markers);
  followGaze(data_->file, gaze, markers);
  const std::vector<double> ways = waysToCorners(data_->file.control, pairs);
  FaceMotion result(std::move(markers), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Index upper = pairs[i].upper_marker, lower = pairs[i].lower_marker;
    const double height = (neutral.row(upper) - neutral.row(lower)).norm();
    const double lips_height = (data_->file.marker_targets.row(upper) - data_->file.marker_targets.row(lower)).norm();
    const double least = kWidestParting * lips_height;
    for (Eigen::Index frame = 0; frame < frames.rows(); ++frame) {
      const LipPose pose = lips.empty() ? LipPose{} : lips[unsignedIndex(frame)];
      // Whether lips touch is the actor's matter, measured on the actor: the warp shears, so that lips which move
      // together there are carried different ways on the head.
      const double apart = (frames.block<1, 3>(frame, 3 * upper) - frames.block<1, 3>(frame, 3 * lower)).norm();
      const double stretch = height > 0 ? apart / height - 1 : 0;
      const LipGap gap{partedShare(stretch, slack.always + pose.seal * slack.sealed), pose.parting * least, pose.tuck};
      result.setLipGap(FrameIndex{unsignedIndex(frame)}, i,
                       rounded(gap, double{pose.rounding} * double{1 - pose.seal}, ways[i], lips_height));
    }
  }
  return result;
}

void FaceRig::deform(const FacePose& pose, const TonguePose& tongue, VertexPositions& out) const {
  data_->deform(pose, tongue, out);
}

void FaceRig::Data::deform(const FacePose& pose, const TonguePose& tongue, VertexPositions& out) const {
  if (welding.isNothing()) return deformer.deform(pose, tongue, out);
  thread_local VertexPositions welded;
  deformer.deform(pose, tongue, welded);
  welding.givenFromWelded(welded, out);
}

void FaceRig::Data::deformMoving(const FacePose& pose, const TonguePose& tongue, std::span<float> out) const {
  if (welding.isNothing()) return deformer.deformMoving(pose, tongue, out);
  thread_local VertexPositions given;
  deform(pose, tongue, given);
  for (std::size_t i = 0; i < moving.size(); ++i) std::copy_n(given.row(moving[i]).data(), 3, &out[3 * i]);
}

FrameMaker FaceRig::Data::with(FrameMaker frames, const std::vector<std::uint32_t>& more, ChangeVertices change) const {
  FrameMaker all = frames;
  all.vertices.clear();
  std::set_union(frames.vertices.begin(), frames.vertices.end(), more.begin(), more.end(),
                 std::back_inserter(all.vertices));
  const auto places_of = [&](const std::vector<std::uint32_t>& vertices) {
    std::vector<std::size_t> places;
    for (const std::uint32_t vertex : vertices) {
      const auto at = std::lower_bound(all.vertices.begin(), all.vertices.end(), vertex);
      places.push_back(3 * unsignedIndex(at - all.vertices.begin()));
    }
    return places;
  };
  all.make = [this, &more, change = std::move(change), make = std::move(frames.make),
              moving_at = places_of(frames.vertices), more_at = places_of(more),
              moved = std::vector<float>(3 * frames.vertices.size()),
              changed = std::vector<float>(3 * more.size())](Eigen::Index f, std::span<float> out) mutable {
    for (std::size_t i = 0; i < more_at.size(); ++i)
      std::copy_n(mesh->vertices.row(more[i]).data(), 3, &out[more_at[i]]);
    make(f, moved);
    for (std::size_t i = 0; i < moving_at.size(); ++i) std::copy_n(&moved[3 * i], 3, &out[moving_at[i]]);
    for (std::size_t i = 0; i < more_at.size(); ++i) std::copy_n(&out[more_at[i]], 3, &changed[3 * i]);
    change(unsignedIndex(f), changed);
    for (std::size_t i = 0; i < more_at.size(); ++i) std::copy_n(&changed[3 * i], 3, &out[more_at[i]]);
  };
  return all;
}

void FaceRig::turnEyes(const GazeTurn& gaze, VertexPositions& vertices) const {
  const std::vector<std::uint32_t>& turned = data_->eyes().vertices();
  std::vector<float> places(3 * turned.size());
  data_->eyes().places(*data_->mesh, gaze, places);
  for (std::size_t i = 0; i < turned.size(); ++i) std::copy_n(&places[3 * i], 3, vertices.row(turned[i]).data());
}

FrameMaker FaceRig::movingFrames(const FaceMotion& motion, std::span<const TonguePose> tongues, double frame_rate_hz,
                                 std::span<const double> larynx, std::span<const GazeTurn> gaze) const {
  MOUTHPIECE_EXPECT(gaze.empty() || gaze.size() == motion.frameCount());
  MOUTHPIECE_EXPECT(tongues.size() == motion.frameCount());
  MOUTHPIECE_EXPECT(larynx.empty() || larynx.size() == tongues.size());
  FrameMaker frames;
  frames.vertices = data_->moving;
  frames.make = [this, &motion, tongues](Eigen::Index f, std::span<float> out) {
    const FrameIndex frame(unsignedIndex(f));
    data_->deformMoving(motion.pose(frame), tongues[frame.value], out);
  };
  const std::vector<std::uint32_t>& raised = data_->larynx.vertices();
  if (!raised.empty() && std::any_of(larynx.begin(), larynx.end(), [](double height) { return height != 0; })) {
    std::vector<float> added(3 * raised.size());
    frames = data_->with(std::move(frames), raised,
                         [this, larynx, added](std::size_t frame, std::span<float> places) mutable {
                           data_->larynx.displacements(larynx[frame], added);
                           std::transform(added.begin(), added.end(), places.begin(), places.begin(), std::plus<>());
                         });
  }
  if (frames.vertices.empty()) {
    throw InputError(
        fmt::format("the face '{}' binds no vertex; expected a mesh around its markers", data_->file.name));
  }
  if (!gaze.empty() && !data_->eyes().vertices().empty()) {
    frames = data_->with(std::move(frames), data_->eyes().vertices(),
                         [this, gaze](std::size_t frame, std::span<float> places) {
                           data_->eyes().places(*data_->mesh, gaze[frame], places);
                         });
  }
  frames.frame_rate_hz = frame_rate_hz;
  frames.frame_count = signedIndex(motion.frameCount());
  frames.width = 3 * signedIndex(frames.vertices.size());
  return frames;
}

}  // namespace mouthpiece
