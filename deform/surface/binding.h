#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "deform/surface/bezier_surface.h"
#include "deform/surface/control_surface.h"

namespace mouthpiece {

struct FaceMesh;
struct Welding;

struct BindingOptions {
  /// A vertex binds to a patch only where their normals differ by less (EDGE 6).
  double max_normal_angle_deg = 75;
  /// Behind lips, lids and nostrils the motion fades along the mesh; an edge counts there as so long at most, mouth
  /// widths. The rims and corners of coarse lips are an edge away from what is bound, however long that is.
  double longest_edge = std::numeric_limits<double>::infinity();
};

/// What each mesh vertex hangs on: EDGE eq. (3), V = B(u, v) + d n(u, v). One entry a vertex in every column but the
/// last. Plain data; `.face` files hold it as it is.
struct FaceBinding {
  std::vector<std::int32_t> patch;  ///< triangle of the control mesh; -1: none
  std::vector<float> u;             ///< weight of the triangle's first point, in the plane
  std::vector<float> v;             ///< of its second
  std::vector<float> d;             ///< offset along the normal, the mesh's unit
  std::vector<float> skin_weight;   ///< share of eq. (3) in the vertex' motion, [0, 1]
  std::vector<float> jaw_weight;    ///< share of the jaw's rigid motion in the rest, [0, 1]
  /// Vertices that turn as the surface does there the less the further they are from their place, beyond kTurnsAlong
  /// not at all, rising: lashes, whose tips would fly apart where the lid turns sharply, and what lies behind the lips.
  std::vector<std::uint32_t> carried = {};
  /// Vertices that go where others take them, because at their own places they would tear (relaxAround). Rows of a
  /// sparse matrix over displacements from rest.
  struct Relaxed {
    std::vector<std::uint32_t> vertices;  ///< one a row, rising
    std::vector<std::uint32_t> ends;      ///< of each row: one past its last entry
    std::vector<std::uint32_t> from;      ///< an entry's vertex, which is not relaxed itself
    std::vector<float> weights;           ///< and its weight, [0, 1]; those of a row make 1 at most
    bool operator==(const Relaxed&) const = default;
  } relaxed = {};
  /// By how much further than LipGuard sees the lips shall come together where they close, the mesh's unit: one of each
  /// of its kLipColumns columns across the mouth; below zero they are held apart by as much. Empty: none.
  std::vector<float> pressed = {};
  /// How far vertices of the lips go, upright, where the lips are shut (LipLevelling), the mesh's unit.
  struct Levelled {
    std::vector<std::uint32_t> vertices;  ///< rising
    std::vector<float> ways;              ///< of each
    bool operator==(const Levelled&) const = default;
  } levelled = {};
  bool meets = false;  ///< whether the lips are brought to meet by their surfaces in every pose (LipMeeting)
  float tuck = 1;  ///< share of the way that the lips go in F and V (LipTuck), [0, 1]: thick ones have no room for all

  bool operator==(const FaceBinding&) const = default;

  /// Where a vertex hangs on the surface; its patch must not be -1.
  [[nodiscard]] SurfacePlace placeOf(std::size_t vertex) const {
    return {patch[vertex], double{u[vertex]}, double{v[vertex]}};
  }
};

/// Columns from the right corner of the mouth to the left one in which lips are looked at.
inline constexpr std::size_t kLipColumns = 24;

/// How far from its place a carried vertex still turns, as a share of the mouth's width.
inline constexpr double kTurnsAlong = 0.08;

/// Whether `vertex` is among binding.carried.
bool isCarried(const FaceBinding& binding, std::size_t vertex);

/// Binds every vertex of `mesh` to the surface over `control`.
FaceBinding bindFace(const FaceMesh& mesh, const HeadTopology& topology, const ControlMesh& control,
                     const BindingOptions& options = {});
/// The same with the openings that `control` tells.
FaceBinding bindFace(const FaceMesh& mesh, const ControlMesh& control, const BindingOptions& options = {});

/// Makes the displacements of the vertices of `torn`, and of skin, gums and mouth within `reach` of them along edges
/// (the mesh's unit), harmonic: means of their neighbours', by the inverse lengths of the edges, so that what two
/// neighbours were torn apart by is spread over all of them. Adds to binding.relaxed. Vertices in one place and on one
/// side of the face's openings count as one. `held`: vertices, of each or none, that are relaxed only where they are
/// torn themselves. An edge counts as `longest_edge` at most for what is within reach, so that some rings of coarse
/// skin are. `keeps_needles`: whether a vertex that is the apex of a thin triangle rather goes with the ends of its
/// long edge, the more the thinner that is, so that it stays on its side.
void relaxAround(const FaceMesh& mesh, const HeadTopology& topology, const std::vector<std::uint32_t>& torn,
                 const std::vector<bool>& held, double reach, FaceBinding& binding,
                 double longest_edge = std::numeric_limits<double>::infinity(), bool keeps_needles = false);

/// The same of displacements themselves, and solved for them: of one pose.
class SkinRelaxing {
 public:
  /// As relaxAround's.
  SkinRelaxing(const FaceMesh& mesh, const HeadTopology& topology, const std::vector<std::uint32_t>& torn,
               const std::vector<bool>& held, double reach);
  SkinRelaxing(SkinRelaxing&&) noexcept;
  SkinRelaxing& operator=(SkinRelaxing&&) noexcept;
  ~SkinRelaxing();

  /// `moves`: displacements of all vertices of the mesh from rest.
  void relax(VertexPositions& moves) const;

 private:
  friend void relaxAround(const FaceMesh&, const HeadTopology&, const std::vector<std::uint32_t>&,
                          const std::vector<bool>&, double, FaceBinding&, double, bool);
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// The binding of a welded mesh from that of the given one, and back.
FaceBinding weldedBinding(const FaceBinding& given, const Welding& welding);
FaceBinding givenBinding(const FaceBinding& welded, const Welding& welding);

/// Checks sizes, ranges and finiteness of a binding read from a file. Throws InputError that begins with `file`.
void checkBinding(const FaceBinding& binding, const FaceMesh& mesh, const ControlMesh& control,
                  const std::string& file);

/// How a face is bound: for `retarget check`.
struct BindingReport {
  std::size_t vertices = 0;
  std::size_t skin_vertices = 0;    ///< vertices of skin and lips, but for those in the mouth
  std::size_t bound_vertices = 0;   ///< moved by the control surface
  std::size_t lip_side_errors = 0;  ///< vertices of one lip on a patch of the other: must be 0
  /// The way over skin and lips, not through the mouth, from the middle of the upper lip's edge to the lower one's,
  /// over the straight way around the nearest corner of the mouth, the markers' or where the slit between the lips
  /// ends: about 1 or more where the lips can part, about a half where they are one surface.
  double way_between_lips = 0;
  bool lips_are_one = false;  ///< they hang together right behind the line between them (LipLine::is_parted)
  double coverage = 0;  ///< bound share of the skin vertices in front of what the markers span (their convex hull)
  double largest_offset = 0;  ///< |d|, the mesh's unit
};
BindingReport inspectBinding(const FaceBinding& binding, const FaceMesh& mesh, const ControlMesh& control);

}  // namespace mouthpiece
