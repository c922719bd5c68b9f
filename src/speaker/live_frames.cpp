// The frames of a LiveStream: made when their look-ahead is known, and pulled.
#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "base/index.h"
#include "base/smooth_step.h"
#include "exports/arkit.h"
#include "speaker/live_data.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

constexpr Seconds kToRest = 0.300;         ///< nextNow(): the mouth comes to rest within this
constexpr std::size_t kWeightsBehind = 3;  ///< frames shown before, that ARKit's weights go on from

}  // namespace

ShownFrame LiveStream::Data::restingFrame() const {
  const MarkerPositions& neutral = setup.corpus.data().actor.neutral_mm;
  ShownFrame made;
  made.markers_mm.assign(neutral.data(), neutral.data() + neutral.size());
  if (!setup.face) return made;
  MotionClip still{rate_hz, setup.corpus.markerNames(),
                   Eigen::Map<const Eigen::RowVectorXd>(neutral.data(), neutral.size())};
  const std::vector<LipPose> lips(1);
  const FaceMotion moved = setup.face->data().rig().retarget(still, &setup.corpus.data().actor, lips);
  const FacePose pose = moved.pose(FrameIndex(0));
  made.face_markers.assign(pose.markers.begin(), pose.markers.end());
  made.lip_gaps.assign(pose.lips.begin(), pose.lips.end());
  return made;
}

/// The frames whose look-ahead is known.
void LiveStream::Data::makeFrames(Seconds known_until, std::span<const PhoneSegment> guess) {
  constexpr double kRounding = 0.5;  // frames: a look-ahead is kept to half a frame
  const double last = std::floor((known_until - options.look_ahead) * rate_hz + kRounding);
  const auto due = std::min(static_cast<std::size_t>(std::max(0.0, last + 1)), frames_at_most);
  if (due > motion.frameCount()) show(motion.render(due - motion.frameCount(), guess));
  const std::scoped_lock lock(mutex);
  said_until = std::max(motion.saidUntil(), now());
}

/// Blinks, where they are wished for, in place of what lids and brows do with the mouth's fragments. Returns where the
/// eyes look, one a frame, or nothing.
std::vector<GazeTurn> LiveStream::Data::moveUpperFace(PositionMatrix& positions_mm) {
  if (!upper_face.blinks() && !upper_face.looks()) return {};
  const Corpus& corpus = setup.corpus.data().corpus;
  std::vector<GazeTurn> gaze;
  PositionMatrix weights = PositionMatrix::Zero(positions_mm.rows(), std::ssize(kArkitNames));
  for (Eigen::Index row = 0; row < positions_mm.rows(); ++row) {
    const LiveFace::Pose pose = upper_face.next();
    gaze.push_back(pose.gaze);
    weights(row, arkitIndex("EyeBlinkLeft")) = weights(row, arkitIndex("EyeBlinkRight")) = pose.closed;
  }
  if (upper_face.blinks()) {
    const PositionMatrix moves = shapeDisplacements(weights, corpus.layout, corpus.neutral_pose_mm);
    for (std::size_t i = 0; i < upper_columns.size(); ++i) {
      const auto column = signedIndex(i);
      if (upper_columns[i])
        positions_mm.col(column) = moves.col(column).array() + corpus.neutral_pose_mm.data()[column];
    }
  }
  if (!upper_face.looks()) gaze.clear();
  return gaze;
}

/// Weights of ARKit's shapes, a row a frame, that go on from those of the frames before.
RowMajorMatrixF LiveStream::Data::arkitWeights(const LiveFrames& frames, const std::vector<GazeTurn>& gaze) {
  PositionMatrix& behind = weights_clip.positions_mm;
  const Eigen::Index kept = std::min<Eigen::Index>(behind.rows(), signedIndex(kWeightsBehind));
  PositionMatrix joined(kept + frames.positions_mm.rows(), frames.positions_mm.cols());
  joined << behind.bottomRows(kept), frames.positions_mm;
  behind = std::move(joined);
  weights_lips.erase(weights_lips.begin(), weights_lips.end() - kept);
  weights_lips.insert(weights_lips.end(), frames.lips.begin(), frames.lips.end());
  const SharedCorpus::Data& corpus = setup.corpus.data();
  const Eigen::Index guessed = weights_behind.rows() - kept;  // of the same frame, but where frames were passed over
  const std::span<const float> guess =
      kept > 0 && guessed >= 0 ? std::span(&weights_behind(guessed, 0), kArkitShapes) : std::span<const float>();
  weights_behind = arkitFromMarkers(weights_clip, &corpus.actor.neutral_mm, weights_lips, corpus.actor.unseen, guess);
  RowMajorMatrixF weights = weights_behind.bottomRows(frames.positions_mm.rows());
  if (!gaze.empty()) addGaze(gaze, weights);
  return weights;
}

void LiveStream::Data::show(LiveFrames frames) {
  const std::vector<GazeTurn> gaze = moveUpperFace(frames.positions_mm);
  const auto count = unsignedIndex(frames.positions_mm.rows());
  RowMajorMatrixF weights = RowMajorMatrixF::Zero(frames.positions_mm.rows(), kArkitShapes);
  if (options.arkit) weights = arkitWeights(frames, gaze);
  FaceMotion face;
  if (setup.face)
    face = setup.face->data().rig().retarget({rate_hz, weights_clip.marker_names, frames.positions_mm},
                                             &setup.corpus.data().actor, frames.lips, gaze);
  const std::scoped_lock lock(mutex);
  for (std::size_t i = 0; i < count; ++i) {
    const auto row = signedIndex(i);
    ShownFrame& made = ring.add();
    const double* markers = frames.positions_mm.row(row).data();
    made.markers_mm.assign(markers, markers + frames.positions_mm.cols());
    Eigen::Map<Eigen::RowVectorXf>(made.arkit.data(), kArkitShapes) = weights.row(row);
    made.lips = frames.lips[i];
    made.tongue = frames.tongue[i];
    if (!gaze.empty()) made.gaze = gaze[i];
    if (!setup.face) continue;
    const FacePose pose = face.pose(FrameIndex(i));
    made.face_markers.assign(pose.markers.begin(), pose.markers.end());
    made.lip_gaps.assign(pose.lips.begin(), pose.lips.end());
  }
}

Seconds LiveStream::saidUntil() const {
  const std::scoped_lock lock(data_->mutex);
  return std::max(data_->said_until, asReal(data_->counts.frames + data_->ring.size()) / data_->rate_hz);
}

const Frame* LiveStream::Data::pulled() {
  frame.index = counts.frames++;
  frame.time = asReal(frame.index) / rate_hz;
  frame.markers_mm = current.markers_mm;
  frame.arkit = current.arkit;
  return &frame;
}

void LiveStream::Data::poseMesh() {
  const FaceRig& rig = setup.face->data().rig();
  rig.deform(FacePose(current.face_markers, current.lip_gaps), current.tongue, vertices);
  if (upper_face.looks()) rig.turnEyes(current.gaze, vertices);
  frame.vertices = {vertices.data(), unsignedIndex(vertices.size())};
}

const Frame* LiveStream::next() {
  Data& data = *data_;
  const Frame* frame = nullptr;
  {
    const std::scoped_lock lock(data.mutex);
    if (data.ring.size() == 0) return nullptr;
    data.ring.take(data.current);
    data.at_rest = 0;
    frame = data.pulled();
  }
  if (!data.setup.face) return frame;
  data.poseMesh();
  return frame;
}

const Frame* LiveStream::nextNow() {
  Data& data = *data_;
  data.is_in_time = true;
  if (const Frame* known = next()) return known;
  {
    const std::scoped_lock lock(data.mutex);
    if (data.at_rest++ == 0) data.stalled_from = data.current;
    ++data.unshown;
    ++data.counts.frames_at_rest;
    lerpFrame(data.stalled_from, data.resting, smoothStep(asReal(data.at_rest) / data.rate_hz / kToRest), data.current);
    data.pulled();
  }
  if (data.setup.face) data.poseMesh();
  return &data.frame;
}

bool LiveStream::isFinished() const {
  const std::scoped_lock lock(data_->mutex);
  return data_->is_finished && data_->ring.size() == 0;
}

double LiveStream::frameRateHz() const { return data_->rate_hz; }

LiveCounts LiveStream::counts() const {
  const std::scoped_lock lock(data_->mutex);
  return data_->counts;
}

}  // namespace mouthpiece
