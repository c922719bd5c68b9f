#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "deform/surface/binding.h"
#include "deform/surface/control_surface.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mouth/jaw.h"
#include "deform/mouth/lip_watch.h"
#include "deform/mouth/teeth_shell.h"

namespace mouthpiece {

/// Keeps the lips of a deformed mesh out of each other and out of the teeth, and closed where they shall touch. Each
/// vertex near the line where the lips meet watches the place of the other lip that is nearest when the mouth is
/// closed, and is pushed back where it gets behind the plane there; lips give way by half each, teeth not at all. Lips
/// that touch but stay a little apart on the mesh are drawn together as they are, column by column. Continuous in the
/// pose.
class LipGuard {
 public:
  /// `closed`: the mesh's vertices with the lips brought together, unguarded.
  LipGuard(const FaceMesh& mesh, const VertexPositions& closed, const ControlMesh& control, const FaceBinding& binding);

  /// `out`: x y z of each vertex of the posed mesh; `points`: the pose's leadingPoints(); `gaps`: of lipPairs(), or
  /// none. Allocates nothing once a thread has posed this face.
  void separate(const MarkerPositions& points, std::span<const LipGap> gaps, const AddedMotion& jaw, float* out) const;

 private:
  // Lengths as shares of the mouth's width.
  static constexpr double kWatched = 0.08;      ///< a watch sees the other lip this far around the place it watches
  static constexpr double kDeepInTeeth = 0.08;  ///< what is deeper is in the mouth
  static constexpr double kStill = 0.0005;      ///< pushes below this are not worth another sweep
  static constexpr std::size_t kColumns = 12;   ///< across the mouth

  struct ToothWatch {
    std::uint32_t vertex;
    bool around_edge;  ///< the other lip's teeth, which it may meet from below or above
    float allowed;     ///< depth at rest
    float free;        ///< less than this, squared, it may have moved without touching
    Eigen::Vector3f rest;
  };
  /// A vertex of a lip that goes along when the lips are drawn together.
  struct Drawn {
    std::uint32_t vertex;
    std::uint32_t column;  ///< and the next one
    float next, share;     ///< the next one's weight; of the way, negative for the upper lip
  };

  // Once for a face (lip_guard_watches.cpp).
  void takeLips(const FaceMesh& mesh, const VertexPositions& closed, const FaceBinding& binding,
                const std::vector<std::uint32_t>& patch_sides);
  void watchLips(const VertexPositions& rest, const VertexPositions& closed, const std::vector<std::uint32_t>& own,
                 const std::vector<std::uint32_t>& others, const std::vector<Triangle>& other,
                 const VertexPositions& normals, const VertexPositions& rest_normals);
  void watchTeeth(const VertexPositions& rest, const std::vector<std::uint32_t>& own, const TeethShell& shell,
                  bool around_edge, std::vector<ToothWatch>& watches) const;
  void boundTeeth(TeethShell& shell, std::vector<ToothWatch>& watches) const;
  void draw(const VertexPositions& rest, const std::vector<std::uint32_t>& own, float share);
  [[nodiscard]] float columnOf(const Eigen::Vector3f& p) const;

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
  void drawTogether(const MarkerPositions& points, std::span<const LipGap> gaps,
                    const std::vector<const LipWatch*>& near, float* out) const;

  std::vector<LipWatch> lips_;
  TeethShell upper_teeth_, lower_teeth_;
  std::vector<ToothWatch> at_upper_teeth_, at_lower_teeth_;
  std::vector<Drawn> drawn_;
  std::vector<float> resting_gaps_;  ///< by column: what stays of the gap where lips rest against each other
  std::vector<LipPair> pairs_;
  std::vector<float> pair_columns_;  ///< where the pairs lie
  std::vector<Eigen::Vector3f> rim_;
  Eigen::Vector3f from_ = Eigen::Vector3f::Zero(), along_ = Eigen::Vector3f::UnitX();
  double mouth_width_ = 0;
};

}  // namespace mouthpiece
