#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "deform/kernel/face_animation.h"
#include "exports/shapes/principal_shapes.h"
#include "motion/arkit_shapes.h"
#include "motion/head_pose.h"
#include "motion/lip_pose.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

struct FaceMesh;
struct FaceShapes;

/// Pulls are shares of the mean shape's energy.
struct ArkitOptions {
  double smoothness = 0.01;  ///< pull between a weight's neighbours in time
  double thrift = 0.001;     ///< pull of every weight towards zero
  double sparsity = 0.003;   ///< push of every weight to zero, whatever its size: small ones vanish
  double symmetry = 0.02;    ///< pull between the weights of a left and a right shape
  double closure = 100;      ///< what all places count where the lips meet, per cent of what all rows of shapes do
  double press = 0.006;      ///< push of MouthClose and MouthPress up, of MouthFrown down, where the lips meet
};

/// Weights of ARKit's shapes over time.
struct ArkitCurves {
  double frame_rate_hz = 0;
  RowMajorMatrixF weights;      ///< frames x 52, each in [0, 1]; zero for shapes that the head lacks
  std::vector<bool> has_shape;  ///< 52
  double rms_error_mm = 0;      ///< of all vertices of skin that move, over all frames
  double largest_error_mm = 0;
  double rms_motion_mm = 0;         ///< what there was to reproduce: of the same vertices
  std::size_t closures = 0;         ///< frames in which the motion brings the lips together
  std::size_t closures_kept = 0;    ///< of these, in which the weights' lips meet as well
  std::vector<GazeTurn> gaze = {};  ///< one a frame, or none
  std::vector<HeadTurn> head = {};  ///< the same
};

/// Pairs of places that meet in some frames: how far the shapes move the two of each pair apart, and how far they may.
struct ShapeClosures {
  Eigen::MatrixXf shapes;           ///< pairs x 52
  Eigen::MatrixXf least = {};       ///< pairs x frames
  Eigen::MatrixXf most = {};        ///< the same
  std::vector<bool> in_frame = {};  ///< whether they meet there
};

/// min over W in [0, 1] of sum_t |S w_t - d_t|^2 + thrift |w_t|^2 + sparsity sum_k w_tk + symmetry |w_left - w_right|^2
/// + smoothness |w_t - w_(t-1)|^2, the pulls as shares of the mean energy of `shape_count` shapes; of shapes that undo
/// each other (JawLeft and JawRight, a smile and a frown of one side) one at most is over zero in a frame, and
/// MouthClose never exceeds JawOpen. `shapes`: S, rows x 52, a column of zeros where there is none; `seen`: frames x
/// 52, each d_t' S, all that is asked of the motion d; `guess`: 52 weights near which those of the first frame may lie,
/// for a search that ends sooner; or nothing. Returns frames x 52.
RowMajorMatrixF fitShapeWeights(const Eigen::MatrixXf& shapes, const RowMajorMatrixF& seen, std::size_t shape_count,
                                const ArkitOptions& options = {}, const ShapeClosures* closures = nullptr,
                                std::span<const float> guess = {});

/// Weights in [0, 1] that best reproduce `frames` of `mesh` with `shapes`: least squares over the vertices of skin
/// and lips, all frames at once with a pull between neighbouring frames, by projected Gauss-Seidel. Frames are gone
/// through three times, and take no room that grows with the line. Throws InputError when no shape has an ARKit name,
/// and for shapes of another mesh.
ArkitCurves fitArkit(const FrameMaker& frames, const FaceMesh& mesh, const FaceShapes& shapes,
                     const ArkitOptions& options = {});

/// What the head's own shapes of lids and brows (EyeBlink..., EyeWide..., EyeSquint..., Brow..., arkitIndexAmong()) do
/// in `frames`, of some or all vertices of `mesh`: frames x 52, or nothing where it has none of them or their region
/// rests. What they do is taken out of `frames`, and where they move the skin most they alone are
/// left to do it: a blink of the head's own slides over the eyeball, which a warp does not. None are held: all are made
/// once here, and anew when they are asked for.
RowMajorMatrixF takeLidsAndBrows(FrameMaker& frames, const FaceMesh& mesh, const FaceShapes& shapes);

/// ARKit's 52 weights that best reproduce marker motion: frames x 52, each in [0, 1]. What a shape does to the markers
/// of the default layout is learnt from a head that has them all (sample_data/arkit/face66_shapes.json); markers of
/// other names do not count. `neutral_mm`: the actor's neutral pose, in the motion's order of markers; null: the median
/// of the frames. `lips`: one a frame, or none; where they are sealed, and the markers of both lips no further apart
/// than touching lips stretch, the weights bring the learnt head's lips together; where they are rounded, MouthPucker
/// does what of it the capture has not seen (`unseen`). `guess` as for fitShapeWeights(). Throws InputError when no
/// marker is of the default layout.
RowMajorMatrixF arkitFromMarkers(const MotionClip& motion, const MarkerPositions* neutral_mm,
                                 std::span<const LipPose> lips = {}, const LipRounding& unseen = {},
                                 std::span<const float> guess = {});

/// Sets EyeLook... in `weights` (frames x 52) to where the eyes look; they are 1 at kWholeLook.
void addGaze(std::span<const GazeTurn> gaze, RowMajorMatrixF& weights);

/// Live Link Face's CSV: time code, 52 weights, and the head's and the eyes' turns, radians (docs/formats/arkit.md).
std::string liveLinkCsv(const ArkitCurves& curves);

/// `glb` with one weights animation, named "speech", in the place of those it had; everything else (materials,
/// textures, skins) stays. Shapes that have no curve rest. Throws InputError that begins with `file`.
std::string glbWithArkitAnimation(std::string_view glb, const std::string& file, const ArkitCurves& curves,
                                  std::string_view object = {});

/// Weights of ARKit's shapes over time, as an app recorded them.
struct ArkitTrack {
  double frame_rate_hz = 0;
  RowMajorMatrixF weights;      ///< frames x 52, zero or more; a frame without a face is NaN throughout
  std::vector<bool> has_shape;  ///< 52: the file has a column for it
  bool turns_head = false;      ///< HeadYaw, HeadPitch or HeadRoll are not zero throughout
};

/// Reads Live Link Face's CSV (docs/formats/arkit.md). Frames that the app dropped are put in between their neighbours,
/// or NaN where more than kLongestDrop are missing. `frame_rate_hz` 0: as the frame numbers of the time code count.
/// Of the head's and the eyes' columns only turns_head is read. Throws InputError with the line for what is no such
/// file.
ArkitTrack parseLiveLinkCsv(std::string_view text, std::string_view file, double frame_rate_hz = 0);

/// True when the first line is one of Live Link Face's.
bool isLiveLinkCsv(std::string_view text);

/// Dropped frames in a row that are still interpolated.
inline constexpr int kLongestDrop = 3;

}  // namespace mouthpiece
