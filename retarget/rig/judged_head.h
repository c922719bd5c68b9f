#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "deform/mouth/lip_tuck.h"
#include "deform/topology/welding.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_judge.h"

namespace mouthpiece {

/// The largest that was seen of something, and where.
struct WorstSeen {
  double value = 0;
  std::size_t item = 0;
  void take(double now, std::size_t at) {
    if (now > value) *this = {now, at};
  }
};

/// A vertex may go so many times as far beside the furthest marker of the face as beside its own ones.
constexpr double kOfAnyMarker = 1.5;

/// What one pose shows: vertices and triangles are the welded mesh's, millimetres as FaceJudgement has them.
struct PoseSeen {
  LipContact contact;  ///< the mesh's unit
  bool is_measured = false;
  WorstSeen ratio, growth, jump, off_markers;  ///< items: edges, edges, vertices, vertices
  double growth_mm = 0, jump_mm = 0, turned_mm2 = 0;
  bool jumps_past_all = false;  ///< `jump` is told by the furthest of all markers, divided by kOfAnyMarker
  std::vector<std::uint32_t> turned, stretched, jumped, off, torn;
  double marker_squares = 0, skin_squares = 0, lip_marker_squares = 0, lip_skin_squares = 0;
};

/// A fitted head as its judge looks at it: edges, triangles and markers are found once. `rig` and `face` outlive it.
class JudgedHead {
 public:
  JudgedHead(const FaceRig& rig, const FaceFile& face);

  /// The mesh with its split vertices welded, which all vertices here are of.
  [[nodiscard]] const FaceMesh& mesh() const { return mesh_; }
  /// `moved`: positions of the head's vertices, or of mesh()'s already.
  [[nodiscard]] VertexPositions welded(VertexPositions moved) const {
    return moved.rows() == mesh_.vertices.rows() ? std::move(moved) : welding_.weldedFromGiven(moved);
  }
  /// The number that a welded vertex has in the head's file.
  [[nodiscard]] std::uint32_t givenOf(std::uint32_t vertex) const {
    return welding_.isNothing() ? vertex : welding_.given_of[vertex];
  }
  [[nodiscard]] double mm() const { return mm_; }                                ///< in the mesh's unit
  [[nodiscard]] double mouthWidth() const { return face_.control.mouth_width; }  ///< the mesh's unit
  [[nodiscard]] const LipContact& atRest() const { return at_rest_; }

  /// Looks at edges and triangles, and at the lips' contact if `widest_gap` is given (LipContactMeter::measure).
  void lookAtPose(const VertexPositions& now, std::optional<double> widest_gap, PoseSeen& seen) const;
  void lookAtContact(const VertexPositions& now, double widest_gap, PoseSeen& seen) const;
  /// How far skin and markers are from rest in frame `row`.
  void lookAtMotion(const VertexPositions& now, const FaceMotion& motion, std::size_t row, PoseSeen& seen) const;
  /// How far skin goes in frame `row` from rest beyond all that the markers and rims around it do.
  void lookAtMarkersAround(const VertexPositions& now, const FaceMotion& motion, std::size_t row, PoseSeen& seen) const;
  /// How far vertices go from frame row - 1 to `row`, beside their markers, and beside any.
  void lookAtStep(const VertexPositions& before, const VertexPositions& now, const FaceMotion& motion, std::size_t row,
                  PoseSeen& seen) const;
  /// Adds what is found of the warp.
  void lookAtWarp(const JudgedPoses& poses, const ActorPose& actor, FaceJudgement& found) const;

  /// For messages: "vertex 12 beside CHIN".
  [[nodiscard]] std::string placeOf(std::uint32_t vertex) const;
  /// "an edge of 1.20 mm gets `does` at ..."; "" where there are no edges.
  [[nodiscard]] std::string edgeText(std::size_t edge, const std::string& does) const;
  /// Triangles that have one of `vertices`, a picture's worth of them.
  [[nodiscard]] std::vector<std::uint32_t> trianglesAt(const std::vector<std::uint32_t>& vertices) const;
  /// Triangles under the lips' markers.
  [[nodiscard]] std::vector<std::uint32_t> mouth() const;

 private:
  struct Edge {
    std::uint32_t from, to;
    float length;
  };

  void findMoving();
  void findEdges();
  void findTriangles();
  void findMarkers();
  void findLeading();
  void lookAtEdges(const VertexPositions& now, PoseSeen& seen) const;
  void lookAtTriangles(const VertexPositions& now, PoseSeen& seen) const;
  /// Markers and rims of the lips in frame `row`; points of the control mesh that follow others are at rest.
  [[nodiscard]] MarkerPositions leadingAt(const FaceMotion& motion, std::size_t row) const;

  const FaceFile& face_;
  double mm_;
  Welding welding_;
  const FaceMesh& mesh_;
  LipContactMeter meter_;
  LipContact at_rest_;
  std::vector<PartKind> kinds_;
  std::vector<bool> moves_;
  std::vector<Edge> edges_;
  std::vector<Triangle> moving_;           ///< triangles on the control surface
  std::vector<std::uint32_t> moving_ids_;  ///< their numbers
  std::vector<double> areas_mm2_;          ///< and areas at rest
  /// Of `moving_`: pairs over an edge that is not folded at rest.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> neighbours_;
  std::vector<std::vector<int>> markers_of_;   ///< of each patch of the control surface
  std::vector<std::vector<int>> rims_of_;      ///< points of the mouth's rim that a patch goes along with
  std::vector<std::vector<int>> opposite_of_;  ///< outer markers of the lip that a patch at the rim comes off
  std::vector<std::int32_t> patch_;            ///< of each vertex
  LipTuck tuck_;
  struct Outside {
    std::uint32_t vertex;
    std::array<int, 8> around;  ///< the nearest markers and points of the mouth's rim
  };
  std::vector<Outside> outside_;        ///< skin that moves and is not in the mouth
  std::vector<std::uint32_t> skin_at_;  ///< vertex of the skin under each marker
  std::vector<bool> is_lip_;
};

}  // namespace mouthpiece
