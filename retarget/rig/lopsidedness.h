#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "deform/mesh/triangles.h"
#include "retarget/rig/judged_head.h"

namespace mouthpiece {

class EvenHead;

/// A head that is alike on both sides, moved as an actor would whose sides do the same: how far its own sides do not.
/// Skin is compared with the skin that lies at its mirror image at rest; nothing but the head's evenness is taken to be
/// right.
class Lopsidedness {
 public:
  /// nullopt where the head is not alike on both sides. `head` of `rig` and `face`.
  static std::optional<Lopsidedness> of(const JudgedHead& head, const FaceRig& rig, const FaceFile& face,
                                        const JudgedPoses& poses, const ActorPose& actor);

  struct Seen {
    double off = 0;                       ///< nine in ten places around the mouth are off by no more, the mesh's unit
    std::size_t row = 0;                  ///< of the poses
    std::vector<std::uint32_t> vertices;  ///< of the head, that are off by as much or more
  };
  /// `rig`: as FaceJudge::judge() takes it.
  [[nodiscard]] Seen look(const JudgedHead& head, const FaceRig& rig) const;

 private:
  /// A vertex in front of the mouth, and the skin that lies at its mirror image.
  struct Compared {
    std::uint32_t vertex;
    Triangle image;
    Eigen::Vector3d weights;
  };

  void findCompared(const FaceMesh& mesh, const FaceFile& face, const EvenHead& even);

  Eigen::Matrix3d mirror_;  ///< of displacements
  std::vector<Compared> compared_;
  std::vector<std::size_t> rows_;   ///< of the poses
  std::optional<FaceMotion> even_;  ///< a frame for each of `rows_`
  std::vector<TonguePose> tongue_;
};

}  // namespace mouthpiece
