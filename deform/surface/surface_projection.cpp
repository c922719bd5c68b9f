#include "deform/surface/surface_projection.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

constexpr int kLattice = 4;                                            ///< samples along a patch's edge, less one
constexpr std::size_t kSamples = (kLattice + 1) * (kLattice + 2) / 2;  ///< of a patch
constexpr std::size_t kCandidates = 12;                                ///< patches tried for each point
constexpr int kMaxSteps = 30;
constexpr double kConverged = 1e-12;  ///< step in u and v

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

/// The nearest point of the patch's edges: each is searched by Newton's method in one variable.
Local closestOnEdges(const Patch& patch, const Eigen::Vector3d& point) {
  constexpr std::array<std::array<double, 4>, 3> kEdges{
      {{1, 0, -1, 1}, {0, 1, 0, -1}, {0, 0, 1, 0}}};  // u, v, their change
  Local best;
  for (const auto& [u0, v0, du, dv] : kEdges) {
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
  for (const Patch& patch : patches_) {
    Ball ball{Eigen::Vector3f::Zero(), 0};
    for (int i = 0; i <= kLattice; ++i) {
      for (int j = 0; i + j <= kLattice; ++j) {
        const SurfacePoint s = evaluate(patch, asReal(i) / kLattice, asReal(j) / kLattice);
        samples_.push_back({s.position.cast<float>(), s.normal().cast<float>()});
        ball.centre += samples_.back().position / asFloat(kSamples);
      }
    }
    for (auto sample = samples_.end() - kSamples; sample != samples_.end(); ++sample) {
      ball.radius = std::max(ball.radius, (sample->position - ball.centre).norm());
    }
    balls_.push_back(ball);
  }
}

std::optional<SurfaceFoot> SurfaceProjector::closest(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                                     double least_cosine, std::uint32_t forbidden) const {
  const Eigen::Vector3f p = point.cast<float>();
  const Eigen::Vector3f n = normal.cast<float>();
  const bool any_normal = normal.isZero();
  // The patches whose samples come nearest.
  std::array<std::pair<float, std::uint32_t>, kCandidates> nearest;
  nearest.fill({std::numeric_limits<float>::infinity(), 0});
  for (std::uint32_t patch = 0; patch < balls_.size(); ++patch) {
    if ((marks_[patch / 3] & forbidden) != 0) continue;
    const float off = (balls_[patch].centre - p).norm() - balls_[patch].radius;
    if (off > 0 && off * off >= nearest.back().first) continue;
    float squared = std::numeric_limits<float>::infinity();
    for (const Sample* sample = &samples_[kSamples * patch]; sample != &samples_[kSamples * patch] + kSamples;
         ++sample) {
      if (!any_normal && sample->normal.dot(n) < asFloat(least_cosine)) continue;
      squared = std::min(squared, (sample->position - p).squaredNorm());
    }
    if (squared >= nearest.back().first) continue;
    nearest.back() = {squared, patch};
    std::sort(nearest.begin(), nearest.end());
  }
  std::optional<SurfaceFoot> best;
  for (const auto& [squared, patch] : nearest) {
    if (!std::isfinite(squared)) break;
    // The patch's nearest point is at most about half its size from its nearest sample.
    if (best && std::sqrt(double{squared}) - 0.5 * double{balls_[patch].radius} > best->distance) continue;
    const Local local = closestOnPatch(patches_[patch], point);
    if (best && local.squared_distance >= best->distance * best->distance) continue;
    if (!any_normal && evaluate(patches_[patch], local.u, local.v).normal().dot(normal) < least_cosine) continue;
    const bool at_border = local.u + local.v > 1 - 1e-9 && border_[patch / 3][patch % 3];
    best = SurfaceFoot{trianglePlace(patch, local.u, local.v), std::sqrt(local.squared_distance), at_border};
  }
  return best;
}

}  // namespace mouthpiece
