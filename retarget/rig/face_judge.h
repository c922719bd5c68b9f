#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "motion/lip_pose.h"
#include "motion/tongue_pose.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_rig.h"

namespace mouthpiece {

/// What makes a face unfit for use; docs/guides/fit_a_face.md has the same table, and a test compares the two.
struct FaceLimit {
  std::string_view name;
  double limit;
  std::string_view unit;
  bool at_least;  ///< what is found must not be less; otherwise it must not be more
};
std::span<const FaceLimit> faceLimits();
/// The limit of that name, which must be one of the table's.
double limitNamed(std::string_view name);

/// Poses that a face is judged by, one a row of `motion`.
struct JudgedPoses {
  struct Row {
    std::string where;     ///< for messages: "take.wav at 1.20 s (M)"
    bool closed = false;   ///< the captured lips touch
    bool follows = false;  ///< one frame after the row before
    bool is_way = false;   ///< only how far vertices go to the next row is looked at
  };
  MotionClip motion;  ///< all markers seen
  std::vector<LipPose> lips;
  std::vector<TonguePose> tongue;
  std::vector<Row> rows;
};

/// A limit that a face does not keep.
struct FaceFault {
  std::string_view limit;                ///< its name
  std::string what;                      ///< with what was found, what is allowed, and where
  std::vector<std::uint32_t> triangles;  ///< of the mesh, where it shows
  std::optional<std::size_t> pose;       ///< row of the poses in which it shows most; none: at rest
};

/// The worst of all poses. Lengths in millimetres of the target.
struct FaceJudgement {
  std::size_t poses = 0, steps = 0;  ///< looked at; steps from one frame to the next
  std::size_t closures = 0, touching = 0;
  double lips_overlap_mm = 0;  ///< more than at rest
  double in_teeth_mm = 0;      ///< of a lip inside teeth or gums, more than at rest
  double in_tongue_mm = 0;     ///< of a lip inside the tongue, more than at rest
  double edge_ratio = 0;       ///< of an edge's length to that at rest
  /// Of an edge; of one over 20 mm long in parts of what it is allowed (docs/guides/fit_a_face.md).
  double edge_growth_mm = 0;
  double turned_over_mm2 = 0;  ///< of triangles that are folded onto two of their neighbours in a pose, not at rest
  /// How far skin goes beyond all that the markers around it do, and the rims of the lips beside it.
  double off_markers_mm = 0;
  double jump_ratio = 0;        ///< of a vertex' step to its markers', or 2/3 of that to any marker's if more
  double motion_share = 0;      ///< of the markers' motion that the skin under them goes along with
  double lip_motion_share = 0;  ///< the same of the lips' markers
  /// How far nine in ten places around the mouth, at most, move otherwise than their mirror images do while an actor's
  /// sides do the same; nullopt of a head that is not alike on both sides.
  std::optional<double> lopsided_mm;
  double warp_stretch_least = 0;  ///< the least determinant of the warp's Jacobian over that in the face's middle
  std::size_t warp_points = 0, warp_folds = 0;  ///< places of markers and skin in poses; where the warp folds over
  std::vector<FaceFault> faults;
  /// Vertices where edges, triangles or steps of any pose break their limits or come within a sixth of them, rising.
  std::vector<std::uint32_t> torn;
  /// What four of five closures leave open at most in each column of LipContact::gaps, the mesh's unit.
  std::array<double, LipContact::kColumns> left_open{};
  /// How far the lips get into each other in each column of LipContact::overlaps, more than at rest, the mesh's unit.
  std::array<double, kLipColumns> overlaps{};
};

/// Moves the face as it will be moved and looks at its mesh. Deterministic; threads share the work. `actor`: whose the
/// poses are.
FaceJudgement judgeFace(const FaceRig& rig, const FaceFile& face, const JudgedPoses& poses, const ActorPose& actor);

/// Judges a face with one binding after the other: what does not hang on that is looked at once.
class FaceJudge {
 public:
  /// `rig`'s mesh, `face` and `poses` must outlive it.
  FaceJudge(const FaceRig& rig, const FaceFile& face, const JudgedPoses& poses, const ActorPose& actor);
  ~FaceJudge();

  /// `rig`: of the same face, but for what of its binding mending changes (relaxed, pressed, levelled, meets), and of
  /// the same mesh or that with its split vertices welded, whose judgement is the same.
  [[nodiscard]] FaceJudgement judge(const FaceRig& rig) const;
  /// The same, if more than `touching` closures touch: nothing else is looked at where not.
  [[nodiscard]] std::optional<FaceJudgement> judgeIfMoreTouch(const FaceRig& rig, std::size_t touching) const;
  /// The mesh of such a rig in each pose in which the captured lips touch.
  [[nodiscard]] std::vector<VertexPositions> closures(const FaceRig& rig) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// What the mesh shows in each of `poses` (vertices of rig.mesh(), whatever moved them; `rows` tell what they are), a
/// judgement each: edges, triangles and how the lips lie. `closures` is 1 where the row says that the lips touch; its
/// left_open and overlaps are those of that pose.
std::vector<FaceJudgement> judgeShapes(const FaceRig& rig, const FaceFile& face, std::span<const VertexPositions> poses,
                                       std::span<const JudgedPoses::Row> rows);

/// All that is wrong with a face, in words: as it was checked at rest and as it was judged.
std::vector<std::string> faultsOf(const FaceCheck& check, const FaceJudgement& judgement);

/// The pose out of `count` in which the skin breaks the limits of edges most, as a fault; nullopt where it keeps them in
/// all. `posed` gives the vertices of rig.mesh() in one; threads share the work.
std::optional<FaceFault> mostTorn(const FaceRig& rig, const FaceFile& face, std::size_t count,
                                  const std::function<VertexPositions(std::size_t)>& posed);

/// Whether a face that is judged as `tried` is better than one that is judged as `kept`: it has fewer faults and closes
/// the mouth and moves where the other does, or has as many and closes it more often.
bool mendsMore(const FaceJudgement& tried, const FaceJudgement& kept);

/// Whether the lips meet as they should and the face moves: all that is wrong is skin that tears, and its edges break
/// their limits by no more than once again, so that relaxing it further may mend it.
bool isTornAlone(const FaceJudgement& found);

/// Where skin tears it is relaxed (relaxAround), step by step further around, lips that stay apart are pressed together
/// by as much, lips that get into each other held apart (FaceBinding::pressed), and all is judged again: what mends
/// more is kept. Where faults stay the same is tried with coarse skin bound over its long edges
/// (BindingOptions::longest_edge), which is kept if it has none. `face` is changed, and `rig` is then that of it;
/// `bound`: how it was bound. Returns the judgement of what they have become.
FaceJudgement mendFace(FaceFile& face, FaceRig& rig, const JudgedPoses& poses, const ActorPose& actor,
                       FaceJudgement judged, BindingOptions bound = {});

}  // namespace mouthpiece
