#pragma once

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include <functional>
#include <random>
#include <string>

#include "heads/head_generator.h"

namespace mouthpiece::test {

using SkinSurface = CGAL::Surface_mesh<CGAL::Simple_cartesian<double>::Point_3>;

constexpr double kMouthMm = 51;  ///< the width of the mouth of a head of usual size

/// Chance that starts from a seed.
class Chance {
 public:
  explicit Chance(unsigned seed) : random_(seed) {}
  double number(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  bool happens(double share) { return number(0, 1) < share; }
  Eigen::Vector3d vector(double most) { return {number(-most, most), number(-most, most), number(-most, most)}; }

 private:
  std::mt19937 random_;
};

inline Eigen::Vector3d clickOf(const ClickedHead& head, const std::string& name) {
  return std::get<Eigen::Vector3d>(head.clicks.markers.at(name));
}

/// Takes the head's scale from the width of its mouth.
void setScale(ClickedHead& head);

// Each of these changes a head and says so in `head.changes`.

/// Proportions, smooth lumps, the lips' thickness and the corners' height. All are maps of space: what touches goes on
/// touching.
void shape(ClickedHead& head, Chance& chance);
/// What cartoonists do to a face, by `amount`, 1 at most: a map of space, too. `style`: of kStyles.
void stylise(ClickedHead& head, int style, double amount);
constexpr int kStyles = 12;
/// Opens the mouth: what is nearer along the mesh to the lower lip than to the upper one goes down with it.
void openMouth(ClickedHead& head, double open_mm);
void remesh(ClickedHead& head, double edge_mm);
void decimate(ClickedHead& head, double share);
/// Each triangle becomes four.
void subdivide(ClickedHead& head);
void unweld(ClickedHead& head);
void addNoise(ClickedHead& head, Chance& chance, double most_mm);

/// `change` of the skin as one surface; the other parts as they are. The surface has the mesh's vertices, numbered as
/// they are, where no edge has more than two triangles.
void changeSkin(ClickedHead& head, const std::function<void(SkinSurface&)>& change);

/// Moves the clicks by up to 2 mm; they land on what is seen from the front.
void jitter(ClickedHead& head, Chance& chance);

}  // namespace mouthpiece::test
