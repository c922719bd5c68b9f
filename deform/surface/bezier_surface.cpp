#include "deform/surface/bezier_surface.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "base/errors.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

using Form = TriangleForm;
using Energy = Eigen::Matrix<double, 9, 9>;

std::array<Eigen::Vector2d, 3> cornersOf(const ControlMesh& mesh, const std::array<int, 3>& triangle) {
  return {mesh.domain.row(triangle[0]), mesh.domain.row(triangle[1]), mesh.domain.row(triangle[2])};
}

/// The same triangle as it lies along the skin at rest: stretched to where that is longer than its place in the plane,
/// in a fold that the plane sees from the front, or under the chin. Never shortened, or folds would make slivers.
std::array<Eigen::Vector2d, 3> cornersAlongSkin(const ControlMesh& mesh, const std::array<int, 3>& triangle) {
  std::array<Eigen::Vector2d, 3> corners = cornersOf(mesh, triangle);
  const Eigen::Vector3d last = mesh.rest.row(triangle[2]);
  Eigen::Matrix<double, 3, 2> skin;
  skin << mesh.rest.row(triangle[0]).transpose() - last, mesh.rest.row(triangle[1]).transpose() - last;
  Eigen::Matrix2d plane;
  plane << corners[0] - corners[2], corners[1] - corners[2];
  const Eigen::Matrix<double, 3, 2> skin_from_plane = skin * plane.inverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> metric(skin_from_plane.transpose() * skin_from_plane);
  const Eigen::Vector2d stretches = metric.eigenvalues().cwiseMax(1.0).cwiseSqrt();
  for (Eigen::Vector2d& corner : corners)
    corner = metric.eigenvectors() * stretches.asDiagonal() * metric.eigenvectors().transpose() * corner;
  return corners;
}

double areaOf(const std::array<Eigen::Vector2d, 3>& p) {
  return 0.5 * ((p[1] - p[0]).x() * (p[2] - p[0]).y() - (p[1] - p[0]).y() * (p[2] - p[0]).x());
}

/// How much nearness to samples counts against bending.
constexpr double kSampleWeight = 300;
/// How much the surface keeps to the flat triangles of its control mesh (0: bends least; larger: overshoots less).
constexpr double kTension = 1;

/// A corner of a triangle whose numbers are six slopes, x and y of each corner in turn: the row of slope `i`.
int slopeRow(const std::array<int, 3>& triangle, int i) { return 2 * triangle[unsignedIndex(i / 2)] + i % 2; }

/// Integral of |second derivatives|^2 + tension |slope - slope of the flat triangle|^2 over one cubic.
Energy cubicEnergy(const CubicPatch<Form>& patch, const std::array<Eigen::Vector2d, 3>& p,
                   const std::array<Form, 2>& flat_slope, double tension) {
  Eigen::Matrix2d plane;
  plane << p[0] - p[2], p[1] - p[2];
  const Eigen::Matrix2d inverse = plane.inverse();
  const auto& b = patch.net;
  Energy energy = Energy::Zero();
  // Second derivatives are linear: their squares are integrated exactly by the edges' middles.
  constexpr std::array<std::array<double, 3>, 3> kMiddles{{{0.5, 0.5, 0}, {0, 0.5, 0.5}, {0.5, 0, 0.5}}};
  for (const auto& [u, v, w] : kMiddles) {
    const Form rr = 6 * (u * (b[k300] - 2 * b[k201] + b[k102]) + v * (b[k210] - 2 * b[k111] + b[k012]) +
                         w * (b[k201] - 2 * b[k102] + b[k003]));
    const Form rs = 6 * (u * (b[k210] - b[k201] - b[k111] + b[k102]) + v * (b[k120] - b[k111] - b[k021] + b[k012]) +
                         w * (b[k111] - b[k102] - b[k012] + b[k003]));
    const Form ss = 6 * (u * (b[k120] - 2 * b[k111] + b[k102]) + v * (b[k030] - 2 * b[k021] + b[k012]) +
                         w * (b[k021] - 2 * b[k012] + b[k003]));
    const auto second = [&](int i, int j) -> Form {
      return inverse(0, i) * inverse(0, j) * rr + (inverse(0, i) * inverse(1, j) + inverse(1, i) * inverse(0, j)) * rs +
             inverse(1, i) * inverse(1, j) * ss;
    };
    const Form xx = second(0, 0), xy = second(0, 1), yy = second(1, 1);
    energy += xx * xx.transpose() + 2 * xy * xy.transpose() + yy * yy.transpose();
    const auto halves = patch.halves(u, v);
    const Form du = 3 * (halves.a - halves.c), dv = 3 * (halves.b - halves.c);
    for (int axis = 0; axis < 2; ++axis) {
      const Form slope = inverse(0, axis) * du + inverse(1, axis) * dv - flat_slope[unsignedIndex(axis)];
      energy += tension * slope * slope.transpose();
    }
  }
  return energy * (areaOf(p) / 3);
}

/// The energy of a split triangle as a quadratic form in its nine numbers.
Energy triangleEnergy(const std::array<Eigen::Vector2d, 3>& p, const CloughTocher<double>& split, double tension) {
  const std::array<CubicPatch<Form>, 3> patches = patchForms(split);
  Eigen::Matrix2d plane;
  plane << p[0] - p[2], p[1] - p[2];
  const Eigen::Matrix2d inverse = plane.inverse();
  std::array<Form, 2> flat_slope;
  for (int axis = 0; axis < 2; ++axis) {
    flat_slope[unsignedIndex(axis)] =
        inverse(0, axis) * (Form::Unit(0) - Form::Unit(2)) + inverse(1, axis) * (Form::Unit(1) - Form::Unit(2));
  }
  const Eigen::Vector2d middle = (p[0] + p[1] + p[2]) / 3;
  Energy energy = Energy::Zero();
  for (std::size_t k = 0; k < 3; ++k)
    energy += cubicEnergy(patches[k], {p[k], p[(k + 1) % 3], middle}, flat_slope, tension);
  return energy;
}

using Sparse = Eigen::SparseMatrix<double>;
using Entries = std::vector<Eigen::Triplet<double, Eigen::Index>>;

Sparse sparse(Eigen::Index rows, Eigen::Index columns, const Entries& entries) {
  Sparse matrix(rows, columns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Slopes as `free * unknowns + given * values`: what the rims and the ring prescribe.
struct Constraints {
  Sparse free;   ///< 2 points x unknowns
  Sparse given;  ///< 2 points x points
};

/// Along the mouth's rim the slope follows from the rim's points alone, for the upper and the lower rim by the same
/// rule: rims whose points meet then meet everywhere.
void constrainRims(const ControlMesh& mesh, std::vector<Eigen::Vector2d>& direction, Entries& given) {
  const std::vector<std::string> names = mouthRim();
  std::vector<int> rim;
  for (const std::string& name : names) rim.push_back(findPoint(mesh, name));
  if (std::find(rim.begin(), rim.end(), -1) != rim.end()) return;
  const Eigen::Vector2d from = mesh.domain.row(rim[0]);
  const Eigen::Vector2d along = (mesh.domain.row(rim[rim.size() / 2]).transpose() - from).normalized();
  for (std::size_t k = 0; k < rim.size(); ++k) {
    if (k == 0 || k == rim.size() / 2) continue;
    const int before = rim[k - 1], at = rim[k], after = rim[(k + 1) % rim.size()];
    const Eigen::Vector2d slope = along / (mesh.domain.row(after) - mesh.domain.row(before)).dot(along);
    for (const auto& [point, sign] : {std::pair(before, -1), std::pair(after, 1)}) {
      given.emplace_back(2 * at, point, sign * slope.x());
      given.emplace_back(2 * at + 1, point, sign * slope.y());
    }
    direction[unsignedIndex(at)] = Eigen::Vector2d(-along.y(), along.x());
  }
}

Constraints constraintsOf(const ControlMesh& mesh, bool ring_is_flat) {
  const auto count = signedIndex(mesh.points.size());
  std::vector<Eigen::Vector2d> direction(mesh.points.size(),
                                         Eigen::Vector2d::Zero());  // the one free direction, if any
  Entries given, free;
  constrainRims(mesh, direction, given);
  Eigen::Index unknowns = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector2d& only = direction[unsignedIndex(i)];
    if (ring_is_flat && mesh.points[unsignedIndex(i)].fixed) continue;
    if (only.isZero()) {
      free.emplace_back(2 * i, unknowns++, 1);
      free.emplace_back(2 * i + 1, unknowns++, 1);
    } else {
      free.emplace_back(2 * i, unknowns, only.x());
      free.emplace_back(2 * i + 1, unknowns++, only.y());
    }
  }
  return {sparse(2 * count, unknowns, free), sparse(2 * count, count, given)};
}

struct TotalEnergy {
  Entries slope_slope;  ///< 2 points x 2 points
  Entries slope_value;  ///< 2 points x points
};

double areaOf(const ControlMesh& mesh) {
  double area = 0;
  for (const auto& triangle : mesh.triangles) area += areaOf(cornersOf(mesh, triangle));
  return area;
}

using Corners = std::array<Eigen::Vector2d, 3> (*)(const ControlMesh& mesh, const std::array<int, 3>& triangle);

/// corners: where each triangle's energy is measured.
TotalEnergy assemble(const ControlMesh& mesh, const std::vector<CloughTocher<double>>& splits, Corners corners) {
  TotalEnergy total;
  total.slope_slope.reserve(36 * mesh.triangles.size());
  total.slope_value.reserve(18 * mesh.triangles.size());
  const double scaled_tension = kTension * asReal(mesh.triangles.size()) / areaOf(mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& triangle = mesh.triangles[t];
    const Energy energy = triangleEnergy(corners(mesh, triangle), splits[t], scaled_tension);
    for (int i = 0; i < 6; ++i) {
      const int row = slopeRow(triangle, i);
      for (int j = 0; j < 6; ++j) total.slope_slope.emplace_back(row, slopeRow(triangle, j), energy(3 + i, 3 + j));
      for (int j = 0; j < 3; ++j) total.slope_value.emplace_back(row, triangle[unsignedIndex(j)], energy(3 + i, j));
    }
  }
  return total;
}

/// Slopes of least energy as a linear map of the values.
class LeastEnergy {
 public:
  LeastEnergy(const TotalEnergy& energy, const Constraints& constraints)
      : free_(constraints.free), given_(constraints.given) {
    const Eigen::Index count = given_.cols();
    const Sparse slope_slope = sparse(2 * count, 2 * count, energy.slope_slope);
    const Sparse slope_value = sparse(2 * count, count, energy.slope_value);
    right_ = free_.transpose() * Sparse(slope_value + Sparse(slope_slope * given_));
    const Sparse left = free_.transpose() * Sparse(slope_slope * free_);
    left_.compute(left);
    MOUTHPIECE_EXPECT(left_.info() == Eigen::Success);
  }

  [[nodiscard]] Eigen::MatrixXd slopesFrom(const Eigen::MatrixXd& values) const {
    const Eigen::MatrixXd right = right_ * values;
    const Eigen::MatrixXd unknowns = left_.solve(right);
    return given_ * values - free_ * unknowns;
  }

 private:
  Sparse free_, given_, right_;
  Eigen::SimplicialLDLT<Sparse> left_;
};

struct EdgeSide {
  int triangle = 0;
  int from = 0;  ///< corner numbers 0 to 2 within the triangle
  int to = 0;
};

SurfacePlace onEdge(const EdgeSide& side, double way) {
  std::array<double, 3> weight{0, 0, 0};
  weight[unsignedIndex(side.from)] = 1 - way;
  weight[unsignedIndex(side.to)] = way;
  return {side.triangle, weight[0], weight[1]};
}

double angleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

}  // namespace

struct BezierSurface::Slopes : LeastEnergy {
  using LeastEnergy::LeastEnergy;
};

BezierSurface::BezierSurface(const ControlMesh& mesh) : triangles_(mesh.triangles), rest_(mesh.rest) {
  for (const auto& triangle : triangles_) splits_.emplace_back(cornersOf(mesh, triangle));
  slopes_ = std::make_shared<const Slopes>(assemble(mesh, splits_, cornersAlongSkin), constraintsOf(mesh, true));
  const auto of_rest = [&] {
    return MarkerPositions(
        LeastEnergy(assemble(mesh, splits_, cornersOf), constraintsOf(mesh, false)).slopesFrom(rest_));
  };
  rest_pose_ = netsOf(rest_, mesh.rest_slopes.rows() > 0 ? mesh.rest_slopes : of_rest());
}

Eigen::MatrixXd BezierSurface::slopesFrom(const Eigen::MatrixXd& displacements) const {
  MOUTHPIECE_EXPECT(displacements.rows() == rest_.rows());
  return slopes_->slopesFrom(displacements);
}

BezierSurface::Pose BezierSurface::netsOf(const MarkerPositions& values, const MarkerPositions& slopes) const {
  Pose pose(3 * triangles_.size());
  std::array<Eigen::Vector3d, 3> value, gx, gy;
  std::array<Patch, 3> patches;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int point = triangles_[t][i];
      value[i] = values.row(point).transpose();
      gx[i] = slopes.row(2 * point).transpose();
      gy[i] = slopes.row(2 * point + 1).transpose();
    }
    splits_[t].nets(value, gx, gy, patches);
    std::copy(patches.begin(), patches.end(), &pose[3 * t]);
  }
  return pose;
}

BezierSurface::Pose BezierSurface::pose(const MarkerPositions& control_points) const {
  MOUTHPIECE_EXPECT(control_points.rows() == rest_.rows());
  const MarkerPositions displacement = control_points - rest_;
  Pose pose = netsOf(displacement, slopesFrom(displacement));
  for (std::size_t p = 0; p < pose.size(); ++p) {
    for (std::size_t i = 0; i < pose[p].net.size(); ++i) pose[p].net[i] += rest_pose_[p].net[i];
  }
  return pose;
}

double BezierSurface::maxNormalAngleAcrossEdges(const Pose& pose, int samples) const {
  std::map<std::pair<int, int>, EdgeSide> open;
  double largest = 0;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const EdgeSide side{static_cast<int>(t), k, next};
      const int from = triangles_[t][unsignedIndex(k)], to = triangles_[t][unsignedIndex(next)];
      const auto twin = open.find({to, from});
      if (twin == open.end()) {
        open.emplace(std::pair(from, to), side);
      }
      for (int s = 0; s < samples; ++s) {
        const double way = asReal(s) / (samples - 1);
        if (twin != open.end()) {
          largest = std::max(largest, angleDeg(evaluate(pose, onEdge(side, way)).normal(),
                                               evaluate(pose, onEdge(twin->second, 1 - way)).normal()));
        }
        // The inner edge from corner k + 1 to the centroid: patches k and k + 1 of the split.
        const auto first = evaluate(pose[3 * t + unsignedIndex(k)], 0, 1 - way);
        const auto second = evaluate(pose[3 * t + unsignedIndex(next)], 1 - way, 0);
        largest = std::max(largest, angleDeg(first.normal(), second.normal()));
      }
    }
  }
  return largest;
}

TriangleForm formAt(const BezierSurface& surface, const SurfacePlace& place) {
  const PatchPlace at = patchPlace(place);
  const auto halves = patchForms(surface.splits()[unsignedIndex(place.triangle)])[at.patch % 3].halves(at.u, at.v);
  return at.u * halves.a + at.v * halves.b + (1 - at.u - at.v) * halves.c;
}

MarkerPositions slopesNear(const ControlMesh& mesh, const std::vector<SurfaceSample>& samples) {
  const BezierSurface surface(mesh);
  TotalEnergy total = assemble(mesh, surface.splits(), cornersOf);
  // Energies weigh bends against distances at the scale of one triangle.
  const double area = areaOf(mesh), cell = area / asReal(mesh.triangles.size());
  const double weight = kSampleWeight * area / (asReal(std::max<std::size_t>(samples.size(), 1)) * cell * cell);
  const auto count = signedIndex(mesh.points.size());
  Eigen::MatrixXd right = -(sparse(2 * count, count, total.slope_value) * Eigen::MatrixXd(mesh.rest));
  // Samples of one triangle are added up before they go into the sum.
  std::vector<Eigen::Matrix<double, 6, 6>> nearness(mesh.triangles.size(), Eigen::Matrix<double, 6, 6>::Zero());
  for (const SurfaceSample& sample : samples) {
    const auto& triangle = mesh.triangles[unsignedIndex(sample.place.triangle)];
    const Form form = formAt(surface, sample.place);
    Eigen::RowVector3d miss = sample.position.transpose();
    for (int i = 0; i < 3; ++i) miss -= form[i] * mesh.rest.row(triangle[unsignedIndex(i)]);
    const Eigen::Matrix<double, 6, 1> slope_form = form.tail<6>();
    nearness[unsignedIndex(sample.place.triangle)] += weight * sample.weight * slope_form * slope_form.transpose();
    for (int i = 0; i < 6; ++i) right.row(slopeRow(triangle, i)) += weight * sample.weight * slope_form[i] * miss;
  }
  for (std::size_t t = 0; t < nearness.size(); ++t) {
    const auto& triangle = mesh.triangles[t];
    for (int i = 0; i < 36; ++i)
      total.slope_slope.emplace_back(slopeRow(triangle, i / 6), slopeRow(triangle, i % 6), nearness[t](i / 6, i % 6));
  }
  const Eigen::SimplicialLDLT<Sparse> solver(sparse(2 * count, 2 * count, total.slope_slope));
  MOUTHPIECE_EXPECT(solver.info() == Eigen::Success);
  return solver.solve(right);
}

PatchPlace patchPlace(const SurfacePlace& place) {
  const std::array<double, 3> weight{place.u, place.v, 1 - place.u - place.v};
  // The patch opposite the corner with the least weight holds the place.
  std::size_t opposite = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (weight[i] < weight[opposite]) opposite = i;
  }
  const std::size_t first = (opposite + 1) % 3;
  return {3 * unsignedIndex(place.triangle) + first, weight[first] - weight[opposite],
          weight[(first + 1) % 3] - weight[opposite]};
}

}  // namespace mouthpiece
