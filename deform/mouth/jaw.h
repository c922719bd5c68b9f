#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "deform/surface/control_surface.h"
#include "motion/tongue_pose.h"

namespace mouthpiece {

struct FaceMesh;

/// x -> x + turn * x + shift: a rigid motion as what it adds to a point, so that rest adds exactly nothing.
struct AddedMotion {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
};

/// The lower jaw as a hinge: it turns about a point between its joints (opening, and a little to the side) and slides
/// forward; least squares over the chin's and jaw's markers. A free rigid fit would take skin that stretches for bone
/// that turns.
class JawHinge {
 public:
  /// Without chin or jaw markers among the points the jaw never moves.
  explicit JawHinge(const ControlMesh& mesh);

  /// `control_points`: controlPoints()'s, of which only markers are used.
  [[nodiscard]] AddedMotion motion(const MarkerPositions& control_points) const;
  [[nodiscard]] const Eigen::Vector3d& pivot() const { return pivot_; }

 private:
  struct Guide {
    int point;
    double weight;
    Eigen::Vector3d rest;
  };
  std::vector<Guide> guides_;
  Eigen::Vector3d pivot_ = Eigen::Vector3d::Zero();
  double lever_ = 1;  ///< distance of the chin from the pivot: makes turns and slides comparable
};

/// The lips' rims where they are furthest apart, the mesh's unit. Without lips nothing is in a tongue's way.
struct PartedLips {
  double apart = std::numeric_limits<double>::infinity();
  double upper_y = std::numeric_limits<double>::infinity(), lower_y = -std::numeric_limits<double>::infinity();
};

/// A simple morph of the tongue (EDGE 7): the jaw carries it; the tip reaches for the ridge behind the upper teeth or
/// between the teeth as far as these are apart, the back for the palate, wherever the jaw has taken it.
class TongueMorph {
 public:
  /// `vertices`: those of the tongue. Reads the teeth's places from the mesh's parts, where it has teeth.
  TongueMorph(const FaceMesh& mesh, std::vector<std::uint32_t> vertices);

  /// A tongue goes no further out than the teeth where the lips are shut, and out between the lips, not through them.
  void deform(const AddedMotion& jaw, const TonguePose& pose, const PartedLips& lips, float* out) const;

 private:
  struct Item {
    std::uint32_t vertex;
    Eigen::Vector3f rest;
    float tip;   ///< share of the tip's movement
    float back;  ///< share of the back's
  };
  void findTeeth(const FaceMesh& mesh);
  /// Heights between which the tip comes out.
  struct WayOut {
    float lower_z = 0;  ///< of the lower front teeth, from behind
    float over = 0, under = 0;
  };
  [[nodiscard]] float keptInWayOut(const Eigen::Vector3f& place, const WayOut& way_out) const;

  std::vector<Item> items_;
  Eigen::Vector3d tip_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d back_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d ridge_ = Eigen::Vector3d::Zero();       ///< behind the upper front teeth
  Eigen::Vector3d behind_ = Eigen::Vector3d::Zero();      ///< at their edge, from behind
  Eigen::Vector3d between_ = Eigen::Vector3d::Zero();     ///< under their edge
  Eigen::Vector3d lower_edge_ = Eigen::Vector3d::Zero();  ///< of the lower front teeth, from behind
  Eigen::Vector3d palate_ = Eigen::Vector3d::Zero();
  double length_ = 0;
  bool has_teeth_ = false;
};

}  // namespace mouthpiece
