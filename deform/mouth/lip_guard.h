#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "deform/mesh/triangles.h"
#include "deform/mouth/jaw.h"
#include "deform/mouth/lip_meeting.h"
#include "deform/surface/binding.h"
#include "deform/surface/control_surface.h"

namespace mouthpiece {

struct FaceMesh;

/// Nothing is divided by less.
inline constexpr float kLeastLength = 1e-30F;

/// A place on one lip: a vertex, or between the two ends of an edge.
struct LipPlace {
  std::uint32_t ends[2];
  float along;  ///< 0 at the first end, 1 at the second

  [[nodiscard]] bool isVertex() const { return ends[0] == ends[1]; }
  /// `vertices`: x y z of each.
  [[nodiscard]] Eigen::Vector3f in(const float* vertices) const {
    const Eigen::Map<const Eigen::Vector3f> first(vertices + 3 * std::size_t{ends[0]});
    if (isVertex()) return first;
    return first + along * (Eigen::Map<const Eigen::Vector3f>(vertices + 3 * std::size_t{ends[1]}) - first);
  }
};

/// What a watch sees aside may be further away than it looks: by this share of Sight::aside.
inline constexpr float kUnsure = 0.25F;

/// A place on one lip that watches the place of the other which is nearest when the mouth is closed. The other lip's
/// shape around that place is taken along in the frame of its triangle.
struct LipWatch {
  LipPlace own;
  std::uint32_t corners[3];
  float weights[2];  ///< of the second and third at the place watched
  float bend[5];     ///< how the lip leaves the triangle's plane: x, y, x^2, x y, y^2, in units of what is seen
  float away[3];     ///< where the triangle faced in the closed mouth
  float allowed;     ///< signed distance at rest where it is below zero
  float firm;        ///< share of what it says that counts: less beside the mouth's corners, where the lips are one
  std::uint32_t column;
  float unsure = 0;  ///< kUnsure where lips that stay open are pressed: what only seems to touch keeps none apart

  struct Sight {
    float distance;
    float aside;           ///< how far beside the watched place it looks: the square of the way there over `reach`
    Eigen::Vector3f away;  ///< unit length
  };
  /// Where the own place is to the other lip, `reach` around the watched place; further off or where the triangle has
  /// tipped over the watch goes blind and sees it `reach` away. `vertices`: x y z of each of the posed mesh.
  [[nodiscard]] Sight look(const float* vertices, float reach) const;

  /// Takes the shape of the other lip in the closed mouth: `lip` are its vertices by rising x.
  void takeShape(const VertexPositions& closed, const VertexPositions& normals, const std::vector<std::uint32_t>& lip,
                 float reach);
};

/// A row of teeth with its gum as lips meet it: how far it reaches from an upright axis inside the dental arch, over
/// direction and height. Whatever the teeth look like, a point is looked up in a few operations, wherever the lips have
/// slid to.
class TeethShell {
 public:
  /// How far behind the shell a point is, and the way out.
  struct Depth {
    float depth = 0;  ///< 0 outside
    Eigen::Vector3f out = Eigen::Vector3f::Zero();
  };

  TeethShell() = default;
  /// `triangles` of `vertices`: one row of teeth; `hangs`: the upper one, whose edge is its lower end. `cell`: width of
  /// the net over direction and height; coarser where teeth of that size would need millions of samples.
  TeethShell(const VertexPositions& vertices, const std::vector<Triangle>& triangles, bool hangs, float cell);

  [[nodiscard]] bool empty() const { return reach_.size() == 0; }

  /// What is deeper than `deepest` is in the mouth, not at the lips, and counts as outside; from half of that on the
  /// depth fades. `around_edge`: where it is nearer, the way out is around the edge of the teeth.
  [[nodiscard]] Depth depthAt(const Eigen::Vector3f& p, float deepest, bool around_edge) const;
  /// False where depthAt() is 0 for certain, all around as far as bound() was told; a few operations.
  [[nodiscard]] bool mayTouch(const Eigen::Vector3f& p) const {
    const float x = p.x() - axis_x_, z = p.z() - axis_z_;
    const float around = std::abs(x) + std::abs(z);
    const float turns = z >= 0 ? x / around : std::copysign(2 - std::abs(x) / around, x);
    const float column = turns * columns_per_turn_ + middle_column_, row = (p.y() - lowest_) * rows_per_height_ + 0.5F;
    if (!(column >= 0 && column < asFloat(reach_.cols()) && row > -bounded_rows_ &&
          row < asFloat(reach_.rows()) + bounded_rows_))
      return false;
    return x * x + z * z < bounds_(wholePart(std::clamp(row, 0.0F, asFloat(reach_.rows() - 1))), wholePart(column));
  }
  /// Prepares mayTouch(): points that are moved by less than `margin` afterwards are counted in.
  void bound(float margin);

  /// Whether a tooth is at the height of `p`, at most `distance` further in.
  [[nodiscard]] bool isNear(const Eigen::Vector3f& p, float distance) const;

 private:
  friend class LipGuard;
  struct Sample {
    float reach = 0, filled = 0;           ///< mean over the filled corners of the net's cell, and their weight
    float per_column = 0, per_height = 0;  ///< slopes
  };
  void take(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c, Eigen::Index cuts);
  void fillGrooves(Eigen::Index cells);
  [[nodiscard]] float columnOf(float x, float z) const;
  [[nodiscard]] Sample sampleAt(float column, float row) const;

  using Net = Eigen::ArrayXXf;
  Net reach_;            ///< heights x directions; 0: no tooth
  Eigen::ArrayXf edge_;  ///< height of the teeth's edge by direction; NaN: no tooth
  Net bounds_;           ///< of `reach_`, squared
  float columns_per_turn_ = 0, middle_column_ = 0, rows_per_height_ = 1, bounded_rows_ = 0;
  float axis_x_ = 0, axis_z_ = 0, lowest_ = 0, cell_ = 1, farthest_ = 0;
  bool hangs_ = false;
};

/// Keeps the lips of a deformed mesh out of each other and out of the teeth, and closed where they shall touch. Each
/// vertex near the line where the lips meet, and places on the edges of coarse lips, watch the place of the other lip
/// that is nearest when the mouth is closed, and are pushed back where it gets behind the plane there; lips give way by
/// half each, teeth not at all. Lips that touch but stay a little apart on the mesh are drawn together as they are,
/// column by column. Continuous in the pose.
class LipGuard {
 public:
  /// `closed`: the mesh's vertices with the lips brought together, unguarded. `found`: words() of the same face's
  /// guard, which spares the search; without them, or where another version of the program found them, all is found
  /// anew. `topology`: as LipMeeting's. Throws InputError where they are none of this mesh.
  LipGuard(const FaceMesh& mesh, const VertexPositions& closed, const ControlMesh& control, const FaceBinding& binding,
           std::span<const std::uint32_t> found = {}, const HeadTopology* topology = nullptr);

  /// What was found out about the face (docs/formats/face.md).
  [[nodiscard]] std::vector<std::uint32_t> words() const;

  /// `out`: x y z of each vertex of the posed mesh; `points`: the pose's leadingPoints(); `gaps`: of lipPairs(), or
  /// none. Allocates nothing once a thread has posed this face.
  void separate(const MarkerPositions& points, std::span<const LipGap> gaps, const AddedMotion& jaw, float* out) const;
  /// The last step, where the binding asks for it: LipMeeting.
  void meet(const MarkerPositions& points, std::span<const LipGap> gaps, float* out) const;
  /// Lips that have been moved since separate() leave the teeth once more.
  void leaveTeeth(const AddedMotion& jaw, float* out) const;

 private:
  // Lengths as shares of the mouth's width.
  static constexpr double kWatched = 0.08;      ///< a watch sees the other lip this far around the place it watches
  static constexpr double kDeepInTeeth = 0.08;  ///< what is deeper is in the mouth
  static constexpr double kStill = 0.0005;      ///< pushes below this are not worth another sweep
  static constexpr std::size_t kColumns = kLipColumns;

  struct ToothWatch {
    std::uint32_t vertex;
    std::uint32_t around_edge;  ///< 1: the other lip's teeth, which it may meet from below or above
    float allowed;              ///< depth at rest
    float free;                 ///< less than this, squared, it may have moved without touching
    Eigen::Vector3f rest;
  };
  /// A vertex of a lip that goes along when the lips are drawn together.
  struct Drawn {
    std::uint32_t vertex;
    std::uint32_t column;  ///< and the next one
    float next, share;     ///< the next one's weight; of the way, negative for the upper lip
  };
  /// A vertex that goes so far up where the lips are shut in its column.
  struct Levelled {
    std::uint32_t vertex, column;
    float way;
  };

  // What is kept of a face (lip_guard_words.cpp).
  template <typename Guard, typename Visit>
  static void visitFound(Guard& guard, const Visit& visit);
  /// False where `words` are none or another version's. Throws InputError.
  bool takeFound(std::span<const std::uint32_t> words, std::size_t vertex_count);

  // Once for a face (lip_guard_watches.cpp).
  void takeLips(const FaceMesh& mesh, const VertexPositions& unlevelled, const ControlMesh& control,
                const FaceBinding& binding);
  void watchLips(const VertexPositions& rest, const VertexPositions& closed, const std::vector<LipPlace>& own,
                 const std::vector<std::uint32_t>& others, const std::vector<Triangle>& other,
                 const VertexPositions& normals, const VertexPositions& rest_normals);
  [[nodiscard]] std::vector<LipPlace> placesOn(const VertexPositions& rest, const std::vector<std::uint32_t>& own,
                                               const std::vector<Triangle>& triangles) const;
  void watchTeeth(const VertexPositions& rest, const std::vector<std::uint32_t>& own, const TeethShell& shell,
                  bool around_edge, std::vector<ToothWatch>& watches) const;
  void boundTeeth(TeethShell& shell, std::vector<ToothWatch>& watches) const;
  void draw(const VertexPositions& rest, const std::vector<std::uint32_t>& own, float share);
  [[nodiscard]] float columnOf(const Eigen::Vector3f& p) const;
  static float middleOf(std::size_t column) { return asFloat(column) + 0.5F; }
  [[nodiscard]] bool isBetweenPairs(float column) const {
    return !pair_columns_.empty() && column > pair_columns_.front() && column < pair_columns_.back();
  }
  /// The least distance that watches see in each column; where none is in a column, what its neighbours see.
  [[nodiscard]] std::array<float, kColumns> gapsSeen(std::span<const LipWatch* const> watches, const float* out) const;
  /// 0 at the corners of the mouth, 1 from a little beside them on.
  [[nodiscard]] float besideCorners(const Eigen::Vector3f& p) const;
  /// Whether the lips close here without moving.
  [[nodiscard]] bool restsClosed(const LipPlace& place, const VertexPositions& rest,
                                 const VertexPositions& closed) const;
  /// Distance from the line where the lips meet.
  [[nodiscard]] float toRim(const Eigen::Vector3f& p) const;
  /// A length that is told as a share of the mouth's width.
  [[nodiscard]] float lengthOf(double share) const { return asFloat(share * mouth_width_); }

  // In every frame.
  /// A rigid motion: turn * p + shift.
  struct Moved {
    bool moves = false;
    Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();
    Eigen::Vector3f shift = Eigen::Vector3f::Zero();
    [[nodiscard]] Eigen::Vector3f back(const Eigen::Vector3f& p) const {
      return moves ? Eigen::Vector3f(turn.transpose() * (p - shift)) : p;
    }
  };
  [[nodiscard]] double narrowestGap(const MarkerPositions& points) const;
  void findNearLips(const float* out, std::vector<const LipWatch*>& near) const;
  static void findNearTeeth(const TeethShell& shell, const std::vector<ToothWatch>& watches, const Moved& with,
                            const float* out, std::vector<const ToothWatch*>& near);
  float partLips(float share, float ease, std::vector<const LipWatch*>& near, float* out) const;
  float leaveTeeth(const TeethShell& shell, std::vector<const ToothWatch*>& near, const Moved& with, float ease,
                   float* out) const;
  [[nodiscard]] float shutShare(const LipGap& gap) const;
  /// What `of` tells of each pair, a float, in each column.
  template <typename Of>
  [[nodiscard]] std::array<float, kColumns> inColumns(const Of& of) const;
  [[nodiscard]] std::array<float, kColumns> untucked(std::span<const LipGap> gaps) const;
  void level(const MarkerPositions& points, std::span<const LipGap> gaps, float* out) const;
  void drawTogether(const MarkerPositions& points, std::span<const LipGap> gaps,
                    const std::vector<const LipWatch*>& near, float* out) const;

  std::vector<LipWatch> lips_;
  TeethShell upper_teeth_, lower_teeth_;
  std::vector<ToothWatch> at_upper_teeth_, at_lower_teeth_;
  std::vector<Drawn> drawn_;
  std::vector<Levelled> levelled_;
  std::optional<LipMeeting> meeting_;
  std::vector<std::uint32_t> watched_columns_;  ///< those that have a watch, rising
  std::vector<float> resting_gaps_;             ///< by column: what stays of the gap where lips rest against each other
  std::vector<float> drawn_further_;            ///< by column: pressed lips are drawn together from further apart
  std::vector<LipPair> pairs_;
  std::vector<float> pair_columns_;  ///< where the pairs lie
  std::vector<Eigen::Vector3d> rim_;
  Eigen::Vector3f from_ = Eigen::Vector3f::Zero(), along_ = Eigen::Vector3f::UnitX();
  double mouth_width_ = 0;
};

}  // namespace mouthpiece
