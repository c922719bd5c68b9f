#include "mouthpiece/performance.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "base/errors.h"
#include "base/files.h"
#include "base/memory.h"
#include "deform/mesh/mesh_files.h"
#include "deform/mesh/mesh_limits.h"
#include "exports/arkit.h"
#include "exports/format_bytes.h"
#include "exports/gltf/glb.h"
#include "motion/resample.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

std::optional<HeadAnimation> headTrack(const Performance::Data& line) {
  HeadAnimation track;
  for (const Eigen::Quaternionf& turn : line.headTurns())
    track.rotations.push_back({turn.x(), turn.y(), turn.z(), turn.w()});
  if (track.rotations.empty()) return std::nullopt;
  Eigen::Vector3d::Map(track.pivot_m.data()) = line.needFace().rig().metresPerUnit() * line.neckTop();
  return track;
}

}  // namespace

std::vector<Eigen::Quaternionf> Performance::Data::headTurns() const {
  std::vector<Eigen::Quaternionf> turns;
  for (const HeadTurn& head : animation.head) {
    // The mesh looks along Z, X to the subject's left: down and to the right shoulder are the positive turns.
    turns.push_back(Eigen::AngleAxisf(head.yaw, Eigen::Vector3f::UnitY()) *
                    Eigen::AngleAxisf(-head.pitch, Eigen::Vector3f::UnitX()) *
                    Eigen::AngleAxisf(head.roll, Eigen::Vector3f::UnitZ()));
  }
  return turns;
}

Eigen::Vector3d Performance::Data::neckTop() const {
  // Under and behind the outer corners of the eyes, in shares of the way between them.
  constexpr double kBelow = 0.4, kBehind = 0.75;
  const FaceFile& file = needFace().file;
  const auto place = [&](std::string_view name) -> std::optional<Eigen::Vector3d> {
    const auto found = std::find(file.marker_names.begin(), file.marker_names.end(), name);
    if (found == file.marker_names.end()) return std::nullopt;
    return file.marker_targets.row(found - file.marker_names.begin());
  };
  const auto right = place("CANTHUS_OUT_R"), left = place("CANTHUS_OUT_L");
  if (!right || !left) return file.marker_targets.colwise().mean();
  const double width = (*left - *right).norm();
  return 0.5 * (*left + *right) - width * Eigen::Vector3d(0, kBelow, kBehind);
}

const Labels& Performance::Data::shownLabels() const {
  const std::scoped_lock lock(mutex_);
  if (labels_) return *labels_;
  Labels& labels = labels_.emplace();
  const SpeechLabels& from = animation.labels;
  std::vector<std::optional<std::size_t>> named;  // of each word its place among those that have a text
  for (const LabelledWord& word : from.words) {
    named.push_back(word.text.empty() ? std::nullopt : std::optional(labels.words.size()));
    if (named.back()) labels.words.push_back({word.text, from.spanOf(word.phones)});
  }
  for (const LabelledPhone& phone : from.phones)
    labels.phones.push_back({std::string(phone.name()), std::string(visemeName(firstViseme(phone.phone))), phone.span,
                             phone.word ? named[*phone.word] : std::nullopt});
  return labels;
}

const std::vector<Curve>& Performance::Data::shownCurves() const {
  const std::scoped_lock lock(mutex_);
  if (curves_) return *curves_;
  std::vector<Curve>& curves = curves_.emplace();
  for (const AnimationCurve& curve : animation.curves) {
    Curve& shown = curves.emplace_back(Curve{curve.name, {}});
    for (const CurveKey& key : curve.keys) shown.keys.push_back({key.time, key.value, key.in, key.out});
  }
  return curves;
}

const std::vector<PerformedUnit>& Performance::Data::shownUnits() const {
  const std::scoped_lock lock(mutex_);
  if (units_) return *units_;
  std::vector<PerformedUnit>& units = units_.emplace();
  for (const PlacedUnit& unit : animation.units)
    units.push_back(
        {unit.phones.first.value, unit.phones.last.value, unit.take, unit.source_span, unit.span, unit.is_backoff});
  return units;
}

void Performance::Data::makePieces(const MotionInPieces::Take& take) const {
  const std::scoped_lock lock(mutex_);
  if (!later || whole_) return take(0, clip().positions_mm);
  double taking_ms = 0;
  MotionTold told = timed(later_ms_.motion, [&] {
    return later->forEachPiece([&](const MotionPiece& piece) {
      giveBackMemory();
      timed(taking_ms, [&] { take(piece.first_frame, piece.positions_mm); });
    });
  });
  later_ms_.motion -= taking_ms;
  if (std::exchange(is_told_, true)) return;
  animation.joins = std::move(told.joins);
  animation.shares = std::move(told.shares);
  animation.mouth = told.mouth;
  animation.settings.insert(animation.settings.end(), told.settings.begin(), told.settings.end());
}

MotionInPieces Performance::Data::motionInPieces() const {
  const MotionClip& motion = animation.motion;
  return {motion.frame_rate_hz, motion.marker_names, motion.frameCount(),
          [this](const MotionInPieces::Take& take) { makePieces(take); }};
}

const MotionClip& Performance::Data::clip() const {
  if (!later) return animation.motion;
  const std::scoped_lock lock(mutex_);
  if (!whole_) {
    const MotionClip& known = animation.motion;
    MotionClip all{known.frame_rate_hz, known.marker_names,
                   PositionMatrix(signedIndex(known.frameCount()), signedIndex(3 * known.markerCount()))};
    makePieces([&](std::size_t first, const PositionMatrix& rows) {
      all.positions_mm.middleRows(signedIndex(first), rows.rows()) = rows;
    });
    whole_ = std::move(all);
  }
  return *whole_;
}

const Sound& Performance::Data::shownSound() const {
  const std::scoped_lock lock(mutex_);
  if (!sound_) sound_ = Sound{animation.audio.sample_rate_hz, animation.audio.samples};
  return *sound_;
}

const Motion& Performance::Data::shownMotion() const {
  const std::scoped_lock lock(mutex_);
  if (!motion_) {
    const PositionMatrix& positions = clip().positions_mm;
    motion_ = Motion{animation.motion.frame_rate_hz, animation.motion.marker_names,
                     std::vector<double>(positions.data(), positions.data() + positions.size())};
  }
  return *motion_;
}

const SharedFace::Data& Performance::Data::needFace() const {
  if (!face) throw InputError("the performance has no face; expected a speaker with one");
  return face->data();
}

const FaceMotion& Performance::Data::faceMotion() const {
  const std::scoped_lock lock(mutex_);
  if (!face_motion_) {
    face_motion_ = timed(later_ms_.retarget, [&] {
      return needFace().rig().retarget(clip(), actor ? &*actor : nullptr, animation.lips, animation.gaze);
    });
  }
  return *face_motion_;
}

const PrincipalShapes& Performance::Data::shapes() const {
  const std::scoped_lock lock(mutex_);
  if (shapes_) return *shapes_;
  const FaceMotion& moving_markers = faceMotion();
  shapes_ = timed(later_ms_.deform, [&] {
    const FaceRig& rig = needFace().rig();
    std::vector<double> larynx;
    if (const AnimationCurve* curve = findCurve(animation.curves, "larynx"))
      larynx = sampleCurve(*curve, frameTimes(0, animation.motion.frameCount(), animation.motion.frame_rate_hz));
    // Motion from elsewhere comes with every vertex: which of them the shapes are sampled from decides their values,
    // and a motion that is applied again shall give the same file.
    const FrameMaker frames = corpus ? rig.movingFrames(moving_markers, animation.tongue,
                                                        animation.motion.frame_rate_hz, larynx, animation.gaze)
                                     : uprightFrames();
    const FaceShapes own = ownShapes();
    if (own.names.empty()) return principalShapes(frames, rig.restVertices(), rig.metresPerUnit());
    return principalShapes(driveOwnShapes(own, frames), rig.restVertices(), rig.metresPerUnit());
  });
  return *shapes_;
}

const PrincipalShapes& Performance::Data::wholeShapes() const {
  const std::scoped_lock lock(mutex_);
  const PrincipalShapes& few = shapes();
  if (!own_shapes_) return few;
  if (!whole_shapes_) {
    const FaceRig& rig = needFace().rig();
    whole_shapes_ = timed(later_ms_.deform,
                          [&] { return principalShapes(uprightFrames(), rig.restVertices(), rig.metresPerUnit()); });
  }
  return *whole_shapes_;
}

const ShapeNormals& Performance::Data::normals() const {
  const std::scoped_lock lock(mutex_);
  if (!normals_) normals_ = shapeNormals(needFace().triangles(), shapes());
  return *normals_;
}

FaceShapes Performance::Data::ownShapes() const {
  const SharedFace::Data& own = needFace();
  const std::filesystem::path mesh = own.meshPath();
  if (!isGlb(mesh)) return {};
  FaceShapes shapes = parseFaceShapes(readFile(mesh, kMaxMeshBytes), mesh, own.file.mesh_object);
  for (VertexPositions& moves : shapes.moves)
    moves = (moves * own.file.upright_from_mesh.cast<float>().transpose()).eval();
  return shapes;
}

const RowMajorMatrixF& Performance::Data::arkitOfHead() const {
  const std::scoped_lock lock(mutex_);
  if (!face) return arkit();
  if (!arkit_of_head_) {
    const FaceShapes shapes = ownShapes();
    const bool has_arkit = std::any_of(shapes.names.begin(), shapes.names.end(),
                                       [](const std::string& name) { return arkitIndex(name) >= 0; });
    arkit_of_head_ = arkit();
    if (has_arkit) {
      // EyeLook... takes the lids along by itself: what is fitted looks ahead.
      const FaceRig& rig = needFace().rig();
      const FaceMotion ahead = rig.retarget(clip(), actor ? &*actor : nullptr, animation.lips);
      fit_of_head_ = fitArkit(framesOf(ahead, {}), rig.mesh(), shapes);
      arkit_of_head_ = std::exchange(fit_of_head_->weights, {});
    }
    addGaze(animation.gaze, *arkit_of_head_);
  }
  return *arkit_of_head_;
}

FrameMaker Performance::Data::driveOwnShapes(const FaceShapes& shapes, FrameMaker moving) const {
  RowMajorMatrixF weights = takeLidsAndBrows(moving, needFace().rig().mesh(), shapes);
  if (weights.size() == 0) return moving;
  const Eigen::RowVectorXf most = weights.colwise().maxCoeff();
  own_shapes_ = OwnShapeWeights{std::move(weights), [most, names = shapes.names](std::string_view name) {
                                  const int shape = arkitIndexAmong(name, names);
                                  return shape >= 0 && most(shape) > 0 ? shape : -1;
                                }};
  return moving;
}

std::string Performance::Data::glb() const {
  const SharedFace::Data& own = needFace();
  const PrincipalShapes& moving = shapes();
  // A head that came as GLB keeps its materials, textures and skins.
  const std::filesystem::path mesh = own.meshPath();
  if (isGlb(mesh)) {
    const std::scoped_lock lock(mutex_);
    if (given_glb_) return *given_glb_;
    given_glb_ = glbWithShapes(readFile(mesh, kMaxMeshBytes), mesh.string(), moving, own.file.upright_from_mesh,
                               own.file.mesh_object, own_shapes_ ? &*own_shapes_ : nullptr);
    if (given_glb_) return *given_glb_;
  }
  const std::optional<HeadAnimation> head = headTrack(*this);
  return glbBytes(own.rig().mesh(), moving, own.rig().name(), {}, head ? &*head : nullptr, &normals());
}

std::string Performance::Data::smallGlb() const {
  const SharedFace::Data& own = needFace();
  if (isGlb(own.meshPath())) return glb();
  const std::optional<HeadAnimation> head = headTrack(*this);
  return smallGlbBytes(own.rig().mesh(), shapes(), own.rig().name(), head ? &*head : nullptr, &normals());
}

Eigen::Matrix3d Performance::Data::shownFromGlb() const {
  const SharedFace::Data& own = needFace();
  const std::scoped_lock lock(mutex_);
  if (!given_glb_) return Eigen::Matrix3d::Identity();
  return own.rig().metresPerUnit() * own.file.upright_from_mesh;
}

VertexPositions Performance::Data::verticesOf(const FaceMotion& moving, FrameIndex frame,
                                              std::span<const GazeTurn> gaze) const {
  VertexPositions vertices;
  const TonguePose tongue = frame.value < animation.tongue.size() ? animation.tongue[frame.value] : TonguePose{};
  needFace().rig().deform(moving.pose(frame), tongue, vertices);
  if (frame.value < gaze.size()) needFace().rig().turnEyes(gaze[frame.value], vertices);
  return vertices;
}

VertexPositions Performance::Data::verticesAt(FrameIndex frame) const {
  return verticesOf(faceMotion(), frame, animation.gaze);
}

FrameMaker Performance::Data::framesOf(const FaceMotion& moving, std::span<const GazeTurn> gaze) const {
  const auto make = [this, &moving, gaze](Eigen::Index frame, std::span<float> out) {
    const VertexPositions vertices = verticesOf(moving, FrameIndex(unsignedIndex(frame)), gaze);
    std::copy_n(vertices.data(), out.size(), out.data());
  };
  return {animation.motion.frame_rate_hz,
          signedIndex(animation.motion.frameCount()),
          needFace().rig().restVertices().size(),
          {},
          make};
}

FrameMaker Performance::Data::uprightFrames() const { return framesOf(faceMotion(), animation.gaze); }

FrameMaker Performance::Data::frames() const {
  FrameMaker frames = uprightFrames();
  const Eigen::Matrix3d& upright_from_mesh = needFace().file.upright_from_mesh;
  if (upright_from_mesh.isIdentity(0)) return frames;
  frames.make = [upright = std::move(frames.make), turn = Eigen::Matrix3f(upright_from_mesh.cast<float>())](
                    Eigen::Index frame, std::span<float> out) {
    upright(frame, out);
    Eigen::Map<VertexPositions> places(out.data(), signedIndex(out.size() / 3), 3);
    places = (places * turn).eval();
  };
  return frames;
}

const RowMajorMatrixF& Performance::Data::arkit() const {
  const std::scoped_lock lock(mutex_);
  if (!arkit_) {
    arkit_ = arkitFromMarkers(clip(), corpus ? &corpus->data().corpus.neutral_pose_mm : nullptr, animation.lips,
                              actor  ? actor->unseen
                              : face ? face->data().file.actor_unseen
                                     : LipRounding{});
    addGaze(animation.gaze, *arkit_);
  }
  return *arkit_;
}

StageTimings Performance::Data::timing() const {
  if (!tells_timing) return {};
  const std::scoped_lock lock(mutex_);
  StageTimings all = animation.timing_ms;
  all.motion += later_ms_.motion;
  all.retarget += later_ms_.retarget;
  all.deform += later_ms_.deform;
  all.write += later_ms_.write;
  return all;
}

UtteranceAnimation Performance::Data::timedAnimation() const {
  const MotionClip& motion = clip();
  UtteranceAnimation told = animation;
  told.motion = motion;
  told.timing_ms = timing();
  return told;
}

std::string Performance::Data::report() const {
  const std::scoped_lock lock(mutex_);
  if (later && !is_told_) makePieces([](std::size_t, const PositionMatrix&) {});
  if (later) later->release();  // a report is the last file
  return reportJson(animation, timing(), fit_of_head_ ? &*fit_of_head_ : nullptr);
}

void Performance::Data::addWriting(double milliseconds) const {
  const std::scoped_lock lock(mutex_);
  later_ms_.write += milliseconds;
}

Performance::Performance(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
const std::string& Performance::text() const { return data_->animation.text; }
const std::string& Performance::voice() const { return data_->animation.voice; }
double Performance::frameRateHz() const { return data_->animation.motion.frame_rate_hz; }
std::size_t Performance::frameCount() const { return data_->animation.motion.frameCount(); }
Seconds Performance::duration() const { return data_->animation.motion.duration(); }
const Sound& Performance::sound() const { return data_->shownSound(); }
const Labels& Performance::labels() const { return data_->shownLabels(); }
const Motion& Performance::motion() const { return data_->shownMotion(); }
const std::vector<Curve>& Performance::curves() const { return data_->shownCurves(); }
const std::vector<PerformedUnit>& Performance::units() const { return data_->shownUnits(); }
const std::vector<GuessedWord>& Performance::guesses() const { return data_->guesses; }
const std::vector<std::string>& Performance::warnings() const { return data_->animation.warnings; }
const std::vector<std::string>& Performance::notices() const { return data_->animation.notices; }
std::string Performance::report() const { return data_->report(); }
bool Performance::hasFace() const { return data_->face.has_value(); }

double Performance::realTimeFactor() const {
  const StageTimings timing = data_->timing();
  return 1e-3 * (timing.load + timing.selection + timing.motion + timing.retarget + timing.deform + timing.write) /
         std::max(duration(), 1e-9);
}

std::vector<float> Performance::vertices(std::size_t frame) const {
  if (frame >= frameCount()) throw InputError(fmt::format("found frame {}; expected 0 to {}", frame, frameCount() - 1));
  const VertexPositions vertices = data_->verticesAt(FrameIndex(frame));
  return {vertices.data(), vertices.data() + vertices.size()};
}

std::array<float, kArkitShapes> Performance::arkitWeights(std::size_t frame) const {
  if (frame >= frameCount()) throw InputError(fmt::format("found frame {}; expected 0 to {}", frame, frameCount() - 1));
  std::array<float, kArkitShapes> weights{};
  Eigen::Map<Eigen::RowVectorXf>(weights.data(), kArkitShapes) = data_->arkit().row(signedIndex(frame));
  return weights;
}

std::string_view arkitName(std::size_t shape) { return kArkitNames.at(shape); }

}  // namespace mouthpiece
