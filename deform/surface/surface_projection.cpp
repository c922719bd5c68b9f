#include "deform/surface/surface_projection.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kCandidates = 12;  ///< patches tried for each point
constexpr int kMaxSteps = 30;
constexpr double kConverged = 1e-12;  ///< step in u and v

constexpr std::array<CubicNet, 10> kWholeNet{k300, k210, k201, k120, k111, k102, k030, k021, k012, k003};

using Patch = BezierSurface::Patch;

struct Local {
  double u = 0, v = 0;
  double squared_distance = std::numeric_limits<double>::infinity();
};

/// Derivatives of half the squared distance to `point`: gradient and Newton's matrix, made positive where it is not.
struct Descent {
  double squared_distance = 0;
  Eigen::Vector2d gradient;
  Eigen::Matrix2d matrix;
};

Descent descentAt(const Patch& patch, double u, double v, const Eigen::Vector3d& point) {
  const SurfacePoint s = evaluate(patch, u, v);
  const Eigen::Vector3d r = s.position - point;
  const auto& b = patch.net;
  const double w = 1 - u - v;
  const Eigen::Vector3d uu = 6 * (u * (b[k300] - 2 * b[k201] + b[k102]) + v * (b[k210] - 2 * b[k111] + b[k012]) +
                                  w * (b[k201] - 2 * b[k102] + b[k003]));
  const Eigen::Vector3d uv =
      6 * (u * (b[k210] - b[k201] - b[k111] + b[k102]) + v * (b[k120] - b[k111] - b[k021] + b[k012]) +
           w * (b[k111] - b[k102] - b[k012] + b[k003]));
  const Eigen::Vector3d vv = 6 * (u * (b[k120] - 2 * b[k111] + b[k102]) + v * (b[k030] - 2 * b[k021] + b[k012]) +
                                  w * (b[k021] - 2 * b[k012] + b[k003]));
  Descent d;
  d.squared_distance = r.squaredNorm();
  d.gradient = {s.du.dot(r), s.dv.dot(r)};
  Eigen::Matrix2d first;
  first << s.du.squaredNorm(), s.du.dot(s.dv), s.du.dot(s.dv), s.dv.squaredNorm();
  Eigen::Matrix2d second;
  second << uu.dot(r), uv.dot(r), uv.dot(r), vv.dot(r);
  d.matrix = first + second;
  if (d.matrix(0, 0) <= 0.1 * first(0, 0) || d.matrix.determinant() <= 0.01 * first.determinant()) d.matrix = first;
  return d;
}

bool isInside(double u, double v) { return u >= 0 && v >= 0 && u + v <= 1; }

/// Newton's method over the whole patch; nothing if it leaves the triangle.
std::optional<Local> closestInside(const Patch& patch, const Eigen::Vector3d& point, double u, double v) {
  Descent here = descentAt(patch, u, v, point);
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Vector2d move = -here.matrix.inverse() * here.gradient;
    if (!move.allFinite()) return std::nullopt;
    if (move.cwiseAbs().maxCoeff() < kConverged) break;
    bool better = false;
    for (int halving = 0; halving < 8 && !better; ++halving, move *= 0.5) {
      if (!isInside(u + move.x(), v + move.y())) {
        if (halving < 7) continue;
        return std::nullopt;
      }
      const Descent there = descentAt(patch, u + move.x(), v + move.y(), point);
      better = there.squared_distance <= here.squared_distance;
      if (better) {
        u += move.x();
        v += move.y();
        here = there;
        break;
      }
    }
    if (!better) break;
  }
  return Local{u, v, here.squared_distance};
}

/// No place of the hull of some of a patch's points is nearer to `point`, squared: a curve or patch stays in its
/// points' hull.
double leastSquared(const Patch& patch, std::span<const CubicNet> points, const Eigen::Vector3d& point) {
  Eigen::Array3d low = patch.net[points[0]].array(), high = low;
  for (const CubicNet at : points) {
    low = low.min(patch.net[at].array());
    high = high.max(patch.net[at].array());
  }
  return (low - point.array()).max(point.array() - high).max(0.0).matrix().squaredNorm();
}

/// The nearest point of the patch's edges: each is searched by Newton's method in one variable.
Local closestOnEdges(const Patch& patch, const Eigen::Vector3d& point) {
  constexpr std::array<std::array<double, 4>, 3> kEdges{
      {{1, 0, -1, 1}, {0, 1, 0, -1}, {0, 0, 1, 0}}};  // u, v, their change
  constexpr std::array<std::array<CubicNet, 4>, 3> kEdgePoints{
      {{k300, k210, k120, k030}, {k030, k021, k012, k003}, {k003, k102, k201, k300}}};
  Local best;
  for (std::size_t edge = 0; edge < 3; ++edge) {
    if (leastSquared(patch, kEdgePoints[edge], point) >= best.squared_distance) continue;
    const auto& [u0, v0, du, dv] = kEdges[edge];
    const Eigen::Vector2d along(du, dv);
    double way = 0.5;
    Local start;
    for (int s = 0; s <= 4; ++s) {
      const double at = s / 4.0;
      const double squared = (evaluate(patch, u0 + at * du, v0 + at * dv).position - point).squaredNorm();
      if (squared < start.squared_distance) {
        start.squared_distance = squared;
        way = at;
      }
    }
    for (int step = 0; step < kMaxSteps; ++step) {
      const Descent here = descentAt(patch, u0 + way * du, v0 + way * dv, point);
      const double curvature = along.dot(here.matrix * along);
      const double next = std::clamp(way - along.dot(here.gradient) / curvature, 0.0, 1.0);
      if (std::abs(next - way) < kConverged) break;
      way = next;
    }
    const double u = u0 + way * du, v = v0 + way * dv;
    const double squared = (evaluate(patch, u, v).position - point).squaredNorm();
    if (squared < best.squared_distance) best = {u, v, squared};
  }
  return best;
}

Local closestOnPatch(const Patch& patch, const Eigen::Vector3d& point) {
  const Local edge = closestOnEdges(patch, point);
  const std::optional<Local> inside = closestInside(patch, point, 1.0 / 3, 1.0 / 3);
  if (inside && inside->squared_distance < edge.squared_distance) return *inside;
  // Newton's method left the triangle from its middle, or got stuck: once more from near the best edge point.
  const double u = 0.9 * edge.u + 0.1 / 3, v = 0.9 * edge.v + 0.1 / 3;
  const std::optional<Local> again = closestInside(patch, point, u, v);
  return again && again->squared_distance < edge.squared_distance ? *again : edge;
}

/// From weights within patch 3 t + k to weights in triangle t.
SurfacePlace trianglePlace(std::size_t patch, double u, double v) {
  const std::size_t k = patch % 3;
  const double centre = std::max(0.0, 1 - u - v) / 3;
  std::array<double, 3> weight{centre, centre, centre};
  weight[k] += u;
  weight[(k + 1) % 3] += v;
  return {static_cast<int>(patch / 3), weight[0], weight[1]};
}

}  // namespace

SurfaceProjector::SurfaceProjector(const BezierSurface& surface, const ControlMesh& mesh,
                                   std::vector<std::uint32_t> triangle_marks)
    : patches_(surface.restPose()), marks_(std::move(triangle_marks)), border_(mesh.triangles.size()) {
  MOUTHPIECE_EXPECT(marks_.size() == mesh.triangles.size());
  std::set<std::pair<int, int>> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.emplace(t[k], t[(k + 1) % 3]);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k)
      border_[t][k] = !edges.contains({mesh.triangles[t][(k + 1) % 3], mesh.triangles[t][k]});
  }
  balls_.resize(signedIndex(patches_.size()), 4);
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    Samples& samples = samples_.emplace_back();
    int row = 0;
    for (int i = 0; i <= kLattice; ++i) {
      for (int j = 0; i + j <= kLattice; ++j, ++row) {
        const SurfacePoint s = evaluate(patches_[p], asReal(i) / kLattice, asReal(j) / kLattice);
        samples.position.row(row) = s.position.cast<float>().transpose().array();
        samples.normal.row(row) = s.normal().cast<float>().transpose().array();
      }
    }
    samples.position.row(kSamples) = samples.position.row(kSamples - 1);
    samples.normal.row(kSamples) = samples.normal.row(kSamples - 1);
    const Eigen::RowVector3f centre = samples.position.topRows<kSamples>().colwise().mean();
    const float radius = (samples.position.matrix().rowwise() - centre).rowwise().norm().maxCoeff();
    balls_.row(signedIndex(p)) << centre.x(), centre.y(), centre.z(), radius;
  }
}

std::optional<SurfaceFoot> SurfaceProjector::closest(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                                     double least_cosine, std::uint32_t forbidden) const {
  const Eigen::Vector3f p = point.cast<float>();
  const Eigen::Vector3f n = normal.cast<float>();
  const bool any_normal = normal.isZero();
  // The patches whose samples come nearest; those are looked into first whose balls do, so that few others need be.
  const Eigen::ArrayXf off =
      ((balls_.col(0) - p.x()).square() + (balls_.col(1) - p.y()).square() + (balls_.col(2) - p.z()).square()).sqrt() -
      balls_.col(3);
  std::array<std::pair<float, std::uint32_t>, kCandidates> nearest;
  nearest.fill({std::numeric_limits<float>::infinity(), 0});
  const float soon = std::max(off.minCoeff(), 0.0F) + balls_.col(3).mean();
  for (const bool is_soon : {true, false}) {
    for (std::uint32_t patch = 0; patch < samples_.size(); ++patch) {
      const float ball = off[patch];
      if ((ball <= soon) != is_soon || (marks_[patch / 3] & forbidden) != 0) continue;
      if (ball > 0 && ball * ball > nearest.back().first) continue;
      const Samples& at = samples_[patch];
      Eigen::Array<float, kSamples + 1, 1> squared =
          (at.position.col(0) - p.x()).square() +
          ((at.position.col(1) - p.y()).square() + (at.position.col(2) - p.z()).square());
      if (!any_normal) {
        const Eigen::Array<float, kSamples + 1, 1> cosine =
            at.normal.col(0) * n.x() + (at.normal.col(1) * n.y() + at.normal.col(2) * n.z());
        squared = (cosine < asFloat(least_cosine)).select(std::numeric_limits<float>::infinity(), squared);
      }
      const std::pair here(squared.minCoeff(), patch);
      if (here >= nearest.back()) continue;
      const auto place = std::upper_bound(nearest.begin(), nearest.end(), here);
      std::move_backward(place, nearest.end() - 1, nearest.end());
      *place = here;
    }
  }
  std::optional<SurfaceFoot> best;
  for (const auto& [squared, patch] : nearest) {
    if (!std::isfinite(squared)) break;
    // The patch's nearest point is at most about half its size from its nearest sample.
    if (best && std::sqrt(double{squared}) - 0.5 * double{balls_(patch, 3)} > best->distance) continue;
    if (best && leastSquared(patches_[patch], kWholeNet, point) >= best->distance * best->distance) continue;
    const Local local = closestOnPatch(patches_[patch], point);
    if (best && local.squared_distance >= best->distance * best->distance) continue;
    if (!any_normal && evaluate(patches_[patch], local.u, local.v).normal().dot(normal) < least_cosine) continue;
    const bool at_border = local.u + local.v > 1 - 1e-9 && border_[patch / 3][patch % 3];
    best = SurfaceFoot{trianglePlace(patch, local.u, local.v), std::sqrt(local.squared_distance), at_border};
  }
  return best;
}

}  // namespace mouthpiece
