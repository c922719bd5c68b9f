#pragma once

#include <Eigen/Geometry>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "exports/arkit.h"
#include "exports/format_bytes.h"
#include "exports/gltf/glb.h"
#include "exports/shapes/principal_shapes.h"
#include "motion/motion_pieces.h"
#include "mouthpiece/corpus.h"
#include "mouthpiece/face.h"
#include "mouthpiece/performance.h"
#include "retarget/rig/face_file.h"
#include "retarget/rig/face_rig.h"
#include "synthesis/curve_model.h"
#include "synthesis/line_motion.h"
#include "synthesis/synthesis.h"
#include "units/file/corpus.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

struct FaceShapes;

/// What a corpus is behind the front door: the file, its index, and the viseme poses of its actor.
struct SharedCorpus::Data {
  explicit Data(const std::filesystem::path& file);

  std::filesystem::path path;
  Corpus corpus;
  mutable UnitDatabase units;  ///< gives back what it has loaded when it is told to
  CurveModel curve_model;
  ActorPose actor;
};

struct SharedFace::Data {
  explicit Data(const std::filesystem::path& face_file);
  /// Of the mesh that the face was fitted to.
  [[nodiscard]] std::filesystem::path meshPath() const;
  [[nodiscard]] const std::vector<Triangle>& triangles() const;

  /// Made on a thread of its own from when the face was opened: waits for it. Throws InputError where parts of the
  /// file contradict each other.
  [[nodiscard]] const FaceRig& rig() const { return rig_.get(); }

  std::filesystem::path path;
  FaceFile file;

 private:
  std::shared_future<FaceRig> rig_;
};

/// A performance behind the front door. What takes long is made when it is first asked for, under `mutex`.
struct Performance::Data {
  /// Of a line whose motion was left for `later` with frames of no markers; joins, shares, mouth and what was heard
  /// come when its motion is first made, under the mutex.
  mutable UtteranceAnimation animation;
  std::unique_ptr<LineMotion> later;  ///< null: the animation has its motion
  std::optional<SharedFace> face;
  std::optional<ActorPose> actor;      ///< who moves the face; none: the actor it was fitted with
  std::optional<SharedCorpus> corpus;  ///< none: motion from elsewhere
  AudioTags tags;                      ///< what was heard in the sound
  bool tells_timing = true;            ///< off: timing() is all zero
  /// What the line was made of, for a page that shall make it again: its labels before any border was moved, its sound
  /// left out; none: the page has no engine.
  std::optional<SynthesisRequest> to_make_again;
  std::vector<double> confidence;  ///< of each phone of a line that was recognised; else empty
  VocalStyle style;                ///< of the curves
  std::string edits = "[]";        ///< an animator's, JSON, as they were asked for
  std::vector<GuessedWord> guesses;

  // The animation's parts as the front door shows them.
  const Labels& shownLabels() const;
  const std::vector<Curve>& shownCurves() const;
  const std::vector<PerformedUnit>& shownUnits() const;
  const Sound& shownSound() const;
  const Motion& shownMotion() const;

  /// The animation's motion, all of it; what was left for later is made and kept.
  const MotionClip& clip() const;
  /// The same for writers that need not have all of it at once; made anew each time, unless it is kept already. This
  /// must outlive it.
  [[nodiscard]] MotionInPieces motionInPieces() const;
  /// The markers on the face; throws InputError without one.
  const FaceMotion& faceMotion() const;
  /// The moving vertices as few shapes.
  const PrincipalShapes& shapes() const;
  /// How the shapes turn the face's normals.
  const ShapeNormals& normals() const;
  /// face.glb.
  [[nodiscard]] std::string glb() const;
  /// The same packed; as it is of a head that came as GLB.
  [[nodiscard]] std::string smallGlb() const;
  /// From the scene of what glb() gave to upright metres.
  [[nodiscard]] Eigen::Matrix3d shownFromGlb() const;
  /// Every vertex of every frame, the mesh's unit and orientation as its file has them. This must outlive the frames.
  [[nodiscard]] FrameMaker frames() const;
  /// The same, upright as the face was fitted.
  [[nodiscard]] FrameMaker uprightFrames() const;
  [[nodiscard]] VertexPositions verticesAt(FrameIndex frame) const;
  /// Upright, of another motion of the same frames; it and `gaze` must outlive the frames.
  [[nodiscard]] FrameMaker framesOf(const FaceMotion& moving, std::span<const GazeTurn> gaze) const;
  [[nodiscard]] VertexPositions verticesOf(const FaceMotion& moving, FrameIndex frame,
                                           std::span<const GazeTurn> gaze) const;
  /// The moving vertices as few shapes, nothing of it left to shapes that the head has of its own.
  const PrincipalShapes& wholeShapes() const;
  /// frames x 52, fitted to the markers.
  const RowMajorMatrixF& arkit() const;
  /// The same, fitted to the geometry of the face's own shapes where it has ARKit's.
  const RowMajorMatrixF& arkitOfHead() const;
  [[nodiscard]] const SharedFace::Data& needFace() const;
  /// How the head turns about the top of the neck, a rotation a frame, and where that is, the mesh's unit; none: still.
  [[nodiscard]] std::vector<Eigen::Quaternionf> headTurns() const;
  [[nodiscard]] Eigen::Vector3d neckTop() const;
  /// What the page needs to be an editor of the line; of motion from elsewhere nothing.
  [[nodiscard]] std::optional<ViewEdits> viewEdits() const;
  /// The same for a page that makes the line again: a LinePackage; `edits` are viewEdits(). "" without `to_make_again`,
  /// and for a head that came with shapes of its own.
  [[nodiscard]] std::string packedLine(const ViewEdits& edits) const;
  /// All wall times so far.
  [[nodiscard]] StageTimings timing() const;
  /// The animation with them, as reports tell it.
  [[nodiscard]] UtteranceAnimation timedAnimation() const;
  /// The same by shapes of known names, those that the head has or else made ones (exports/shape_sets): ARKit's with
  /// the weights that follow the motion best, or visemes that follow the phones.
  enum class NamedShapes { kArkit, kVisemes };
  [[nodiscard]] std::string namedGlb(NamedShapes kind) const;
  /// A film of the face, 1280 x 720, at the motion's rate or the largest whole part of it that is at most 30 a second.
  /// The path's ending tells the kind (exports/film/film_file.h). Throws InputError.
  void film(const std::filesystem::path& path) const;
  mutable std::function<void(std::size_t done, std::size_t all)> tell_film;  ///< how far it is; empty: nobody asks
  /// report.json, of what is known by now.
  [[nodiscard]] std::string report() const;
  /// Adds to the time that writing took.
  void addWriting(double milliseconds) const;

 private:
  /// The face's own shapes, upright as the face was fitted; none where it did not come as a GLB.
  [[nodiscard]] FaceShapes ownShapes() const;
  /// What is left of `moving` once lids and brows are left to the head's own `shapes`, where it has such and the motion
  /// moves them.
  [[nodiscard]] FrameMaker driveOwnShapes(const FaceShapes& shapes, FrameMaker moving) const;

  void makePieces(const MotionInPieces::Take& take) const;

  mutable std::recursive_mutex mutex_;
  mutable StageTimings later_ms_;  ///< what came after the synthesis: motion left for later, retarget, deform, write
  mutable std::optional<MotionClip> whole_;  ///< of what was left for later
  mutable bool is_told_ = false;             ///< whether the animation has what is told of that
  mutable std::optional<Labels> labels_;
  mutable std::optional<std::vector<Curve>> curves_;
  mutable std::optional<std::vector<PerformedUnit>> units_;
  mutable std::optional<Sound> sound_;
  mutable std::optional<Motion> motion_;
  mutable std::optional<FaceMotion> face_motion_;
  mutable std::optional<PrincipalShapes> shapes_;
  mutable std::optional<ShapeNormals> normals_;
  mutable std::optional<OwnShapeWeights> own_shapes_;  ///< what the head's own shapes of lids and brows take over
  mutable std::optional<std::string> given_glb_;       ///< of a head that came as GLB; the page holds it, too
  mutable std::optional<RowMajorMatrixF> arkit_, arkit_of_head_;
  mutable std::optional<ArkitCurves>
      fit_of_head_;  ///< how well arkit_of_head_ follows the head's own shapes; no weights
  mutable std::optional<PrincipalShapes> whole_shapes_;
};

/// The take of the corpus that a unit of `line` was taken from, as it was captured; its one unit is the fragment.
/// Throws InputError where curves move the face.
Performance sourceOf(const Performance& line, std::size_t unit);

/// The result of `work`, whose wall time is added to `milliseconds`.
template <typename Work>
auto timed(double& milliseconds, Work&& work) {
  struct Stopwatch {
    double& total;
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
    ~Stopwatch() {
      total += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    }
  } stopwatch{milliseconds};
  return std::forward<Work>(work)();
}

}  // namespace mouthpiece
