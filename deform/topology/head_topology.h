#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "deform/topology/lip_line.h"

namespace mouthpiece {

enum class PartKind;
struct FaceMesh;

/// What each vertex belongs to. One that several parts share is skin or lips if one of them is, else the mouth's
/// inside.
std::vector<PartKind> vertexKinds(const FaceMesh& mesh);

/// Distance from `p` to the closed line through `line`; infinite where it has no point.
double distanceToLine(const Eigen::Vector3d& p, const std::vector<Eigen::Vector3d>& line);

/// Bits for the two sides of an opening of the face: a vertex on one must not hang on the other.
enum SideBit : std::uint32_t {
  kUpperLip = 1,
  kLowerLip = 2,
  kUpperLidRight = 4,
  kLowerLidRight = 8,
  kUpperLidLeft = 16,
  kLowerLidLeft = 32,
};

/// Where a face opens, the mesh's unit. All that HeadTopology knows of lips and lids comes from here: what finds them
/// better needs to give one of these, and nothing behind it changes (faceOpenings() reads them off a control mesh).
struct FaceOpenings {
  std::vector<Eigen::Vector3d> lip_line;  ///< where the lips meet, closed
  /// Vertices in one place that are nearer to the line may be two lips that touch; elsewhere they are a texture's seam.
  double lips_reach = 0;
  /// Places on the skin on both sides of an opening; empty where it is not known.
  struct Sides {
    std::vector<Eigen::Vector3d> upper, lower;
  };
  std::array<Sides, 3> sides;  ///< of the mouth, the right eye, the left eye: in the order of SideBit
  /// Where given, the line between the lips is traced, and tells the mouth's sides better than its places do.
  std::optional<MouthHints> mouth = {};
};

/// What hangs together in a head, and what lies on which side of its openings: found once for a mesh and handed on.
/// Copies share what the mesh alone tells. Const, safe to share between threads.
class HeadTopology {
 public:
  HeadTopology(const FaceMesh& mesh, const FaceOpenings& openings);
  /// The same mesh, its openings known better by now.
  [[nodiscard]] HeadTopology openedAt(const FaceOpenings& openings) const;

  [[nodiscard]] const std::vector<PartKind>& kinds() const;
  /// Number of each vertex' connected piece of the mesh; seams are closed, lips that touch are not.
  [[nodiscard]] const std::vector<std::uint32_t>& pieces() const { return pieces_; }
  /// Bits of the further side of each opening, by the way along the mesh, one entry a vertex.
  [[nodiscard]] const std::vector<std::uint32_t>& forbidden() const { return forbidden_; }
  /// The line between the lips; nullopt where no hints were given or they are no mouth's.
  [[nodiscard]] const std::optional<LipLine>& lipLine() const { return lip_line_; }
  /// Whether a vertex lies behind the line between the lips: on their backs or further in the mouth.
  [[nodiscard]] bool isInMouth(std::size_t vertex) const { return !in_mouth_.empty() && in_mouth_[vertex]; }
  /// The way along the mesh to either lip's skin (its places, without a line), one entry a vertex; infinite where none
  /// leads there.
  [[nodiscard]] const std::vector<double>& wayToUpperLip() const { return to_upper_lip_; }
  [[nodiscard]] const std::vector<double>& wayToLowerLip() const { return to_lower_lip_; }
  /// The way to the upper lip over the ways to both: 0 on the upper lip, 1 on the lower one, 0.5 where not known.
  [[nodiscard]] double lowerShare(std::size_t vertex) const;

  struct Reach {
    std::vector<double> distance;      ///< infinite where no seed reaches
    std::vector<std::int32_t> source;  ///< the seed that does; -1: none
  };
  /// Shortest ways along edges from `seeds`, over vertices where `may_pass` holds. Edges count as `longest` at most.
  [[nodiscard]] Reach reachFrom(const std::vector<std::uint32_t>& seeds,
                                const std::function<bool(std::uint32_t vertex)>& may_pass,
                                double longest = std::numeric_limits<double>::infinity()) const;
  /// The vertex of skin or lips nearest to a place; nullopt without such parts.
  [[nodiscard]] std::optional<std::uint32_t> nearestSkin(const Eigen::Vector3d& place) const;

 private:
  struct Net;
  HeadTopology(std::shared_ptr<const Net> net, const FaceOpenings& openings);
  [[nodiscard]] std::vector<std::uint32_t> nearestSkin(const std::vector<Eigen::Vector3d>& places) const;
  void findPieces();
  void findInside();

  std::shared_ptr<const Net> net_;
  std::vector<bool> at_lips_;  ///< vertices whose doubles are not joined
  std::vector<std::uint32_t> pieces_, forbidden_;
  std::vector<double> to_upper_lip_, to_lower_lip_;
  std::optional<LipLine> lip_line_;
  std::vector<bool> in_mouth_;  ///< empty without a line
};

}  // namespace mouthpiece
