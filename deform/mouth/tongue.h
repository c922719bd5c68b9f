#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/mouth/jaw.h"
#include "motion/tongue_pose.h"

namespace mouthpiece {

/// A simple morph of the tongue (EDGE 7): the jaw carries it; the tip reaches for the ridge behind the upper teeth or
/// between the teeth as far as these are apart, the back for the palate, wherever the jaw has taken it.
class TongueMorph {
 public:
  /// `vertices`: those of the tongue. Reads the teeth's places from the mesh's parts, where it has teeth.
  TongueMorph(const FaceMesh& mesh, std::vector<std::uint32_t> vertices);

  void deform(const AddedMotion& jaw, const TonguePose& pose, float* out) const;

 private:
  struct Item {
    std::uint32_t vertex;
    Eigen::Vector3f rest;
    float tip;   ///< share of the tip's movement
    float back;  ///< share of the back's
  };
  void findTeeth(const FaceMesh& mesh);
  [[nodiscard]] float keptBetweenTeeth(const Eigen::Vector3f& place, const Eigen::Vector3f& lower_edge) const;

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
