#include "retarget/sample_head/head_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/smooth_step.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

using Color = Eigen::Vector3d;
using Eigen::Vector3d;

/// sRGB bytes to linear.
Color srgb(int red, int green, int blue) {
  const auto linear = [](int byte) { return linearFromSrgb(byte / 255.0); };
  return {linear(red), linear(green), linear(blue)};
}

Color mix(const Color& a, const Color& b, double share) { return a + std::clamp(share, 0.0, 1.0) * (b - a); }

/// Smooth noise in [-1, 1]: value noise over a lattice of `cell` millimetres.
double noise(const Vector3d& point, double cell) {
  const Vector3d q = point / cell;
  const Eigen::Array3d base = q.array().floor();
  const Eigen::Array3d f = q.array() - base;
  const auto corner = [&](int dx, int dy, int dz) {
    const auto hashed = [](double at, std::int64_t prime) { return static_cast<std::uint32_t>(wholePart(at) * prime); };
    std::uint32_t h = hashed(base[0] + dx, 73856093) ^ hashed(base[1] + dy, 19349663) ^ hashed(base[2] + dz, 83492791);
    h = (h ^ (h >> 13)) * 1274126177U;
    return asReal(h >> 8) / 8388608.0 - 1.0;
  };
  double value = 0;
  for (int k = 0; k < 8; ++k) {
    const int dx = k & 1;
    const int dy = (k >> 1) & 1;
    const int dz = k >> 2;
    const auto w = [](double t, int side) {
      const double s = smoothStep(t);
      return side != 0 ? s : 1 - s;
    };
    value += w(f[0], dx) * w(f[1], dy) * w(f[2], dz) * corner(dx, dy, dz);
  }
  return value;
}

double bump(const Vector3d& point, const Vector3d& centre, const Vector3d& reach) {
  return std::exp(-(point - centre).cwiseQuotient(reach).squaredNorm());
}

double distanceToSegment(const Vector3d& point, const Vector3d& from, const Vector3d& to, double& way) {
  const Vector3d axis = to - from;
  way = std::clamp((point - from).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return (point - from - way * axis).norm();
}

/// The brows' upper and lower edges, from the nose outward (landmarks of the right brow, then the left).
constexpr std::array<std::array<std::uint32_t, 5>, 2> kBrowUpper{{{107, 66, 105, 63, 70}, {336, 296, 334, 293, 300}}};
constexpr std::array<std::array<std::uint32_t, 5>, 2> kBrowLower{{{55, 65, 52, 53, 46}, {285, 295, 282, 283, 276}}};

/// 1 in the middle of a brow, 0 outside; thins towards the temple.
double browShare(const ModelMesh& model, const Vector3d& point, std::size_t side) {
  double best = 0;
  for (std::size_t i = 0; i + 1 < 5; ++i) {
    const auto middle = [&](std::size_t k) {
      return Vector3d(0.56 * model.point(kBrowUpper[side][k]) + 0.44 * model.point(kBrowLower[side][k]));
    };
    double way = 0;
    const double distance = distanceToSegment(point, middle(i), middle(i + 1), way);
    const double along = (asReal(i) + way) / 4.0;
    const double half = 3.9 * (1 - 0.62 * along) * (0.7 + 0.3 * smoothStep(0, 0.2, along));
    const double ends = (0.35 + 0.65 * smoothStep(0.0, 0.22, along)) * (1 - 0.7 * smoothStep(0.85, 1.0, along));
    best = std::max(best, ends * (1 - smoothStep(0.35 * half, 1.2 * half, distance)));
  }
  return best;
}

struct Palette {
  Color skin = srgb(226, 176, 148);
  Color skin_low = srgb(214, 160, 132);
  Color blush = srgb(214, 128, 112);
  Color brow = srgb(66, 44, 32);
  Color lip = srgb(188, 108, 100);
  Color lip_inside = srgb(122, 50, 50);
  Color mouth = srgb(52, 14, 16);
  Color lid = srgb(196, 128, 112);
  Color lid_edge = srgb(150, 84, 76);
  Color nostril = srgb(74, 30, 26);
  Color sclera = srgb(226, 220, 214);
  Color vein = srgb(222, 168, 156);
  Color iris = srgb(84, 108, 118);
  Color iris_rim = srgb(34, 46, 58);
  Color iris_core = srgb(128, 112, 78);
  Color pupil = srgb(8, 8, 9);
  Color tooth = srgb(226, 216, 196);
  Color tooth_root = srgb(222, 204, 170);
  Color gum = srgb(196, 104, 102);
  Color tongue = srgb(190, 96, 96);
  Color hair = srgb(58, 40, 30);
};

class Painter {
 public:
  explicit Painter(const ModelMesh& model) : model_(model) {
    const auto at = [&](std::uint32_t landmark) { return model.point(landmark); };
    cheeks_ = {at(50), at(280)};
    lids_ = {Vector3d(0.5 * (at(159) + at(27))), Vector3d(0.5 * (at(386) + at(257)))};
    nostrils_ = {nostrilCentre(model, 0), nostrilCentre(model, 1)};
    lid_edges_ = {at(159), at(386)};
    nose_ = at(4);
  }

  [[nodiscard]] Color skin(std::uint32_t vertex) const {
    const Vector3d p = model_.point(vertex);
    const double shell = model_.vertices(vertex, kShell);
    Color color = mix(palette_.skin, palette_.skin_low, smoothStep(-20, -130, p.y()));
    for (const Vector3d& cheek : cheeks_)
      color = mix(color, palette_.blush, 0.34 * bump(p, cheek + Vector3d(0, -4, 0), {22, 17, 30}));
    color = mix(color, palette_.blush, 0.22 * bump(p, nose_, {13, 10, 14}));
    for (const Vector3d& lid : lids_)
      color = mix(color, palette_.lid, 0.42 * bump(p, lid, {17, 5.5, 14}) * (1 - shell));
    color *= 1 + 0.035 * noise(p, 7) + 0.025 * noise(p, 2.6);
    color = mix(color, palette_.lid_edge, 0.85 * smoothStep(0.1, 0.8, model_.vertices(vertex, kFlush)));
    if (shell < 0.5) {
      for (std::size_t side = 0; side < 2; ++side) {
        const double brow = browShare(model_, p, side);
        color =
            mix(color, palette_.brow, 0.82 * brow * (0.85 + 0.15 * noise(Vector3d(p.x() * 2.2, p.y(), p.z()), 1.7)));
      }
    }
    for (std::size_t side = 0; side < 2; ++side) {
      color = mix(color, palette_.nostril, 1.5 * bump(p, nostrils_[side] + Vector3d(0, 1.4, 0.6), {3.9, 3.4, 5.6}));
    }
    const double vermilion = smoothStep(0.36, 0.58, model_.vertices(vertex, kVermilion));
    return mix(color, lipColor(vertex), vermilion);
  }

  [[nodiscard]] Color lipColor(std::uint32_t vertex) const {
    const Vector3d p = model_.point(vertex);
    const Color color = palette_.lip * (1 + 0.07 * noise(Vector3d(2.4 * p.x(), 0.5 * p.y(), 0.5 * p.z()), 2.0));
    return mix(mix(color, palette_.lip_inside, smoothStep(0.0, 0.2, model_.vertices(vertex, kMouthDepth))),
               palette_.mouth, smoothStep(0.25, 0.9, model_.vertices(vertex, kMouthDepth)));
  }

  /// The upper lid's shadow on the ball.
  [[nodiscard]] Color eye(std::uint32_t vertex) const {
    const Vector3d p = model_.point(vertex);
    const std::size_t side = p.x() < 0 ? 0 : 1;
    const double below_lid = lid_edges_[side].y() - p.y();
    const double shade = 0.42 + 0.58 * smoothStep(-0.5, 4.2, below_lid);
    return shade * bareEye(vertex);
  }

  /// Less of the light that comes through the lips reaches the mouth's depth.
  [[nodiscard]] double lightWithin(std::uint32_t vertex) const {
    constexpr double kFrontTeethMm = 6;  // behind the line where the lips meet
    constexpr double kReachMm = 15;
    const double depth = model_.point(13).z() - kFrontTeethMm - model_.point(vertex).z();
    return 0.12 + 0.88 * std::exp(-std::max(depth, 0.0) / kReachMm);
  }

  [[nodiscard]] Color bareEye(std::uint32_t vertex) const {
    const double degrees = 180 * model_.vertices(vertex, kMouthDepth);
    const Vector3d p = model_.point(vertex);
    if (degrees < 8.1) return palette_.pupil;
    if (degrees < 24.5) {
      const Color ring = mix(palette_.iris_core, palette_.iris, smoothStep(9, 15, degrees));
      const Color streaked = ring * (1 + 0.28 * noise(Vector3d(p.x() * 1.5, p.y() * 1.5, 0), 0.9));
      return mix(streaked, palette_.iris_rim, smoothStep(18.5, 23.5, degrees));
    }
    return mix(palette_.sclera, palette_.vein, smoothStep(40, 75, degrees));
  }

  [[nodiscard]] Color colorOf(std::uint32_t vertex, int part) const {
    switch (part) {
      case kPartMouth:
        return lipColor(vertex);
      case kPartEyes:
        return eye(vertex);
      case kPartUpperGums:
      case kPartLowerGums:
        return lightWithin(vertex) * palette_.gum * (1 + 0.06 * noise(model_.point(vertex), 2.5));
      case kPartUpperTeeth:
      case kPartLowerTeeth:
        return lightWithin(vertex) * palette_.tooth;
      case kPartTongue:
        return lightWithin(vertex) * palette_.tongue * (1 + 0.08 * noise(model_.point(vertex), 1.8));
      case kPartLashes:
        return 0.5 * palette_.hair;
      case kPartHair:
        return palette_.hair * (1 + 0.35 * noise(model_.point(vertex).cwiseProduct(Vector3d(1, 0.25, 0.4)), 2.2));
      default:
        return skin(vertex);
    }
  }

  static Vector3d nostrilCentre(const ModelMesh& model, std::size_t side) {
    constexpr std::array<std::array<std::uint32_t, 4>, 2> kAround{{{75, 20, 79, 60}, {305, 250, 309, 290}}};
    Vector3d centre = Vector3d::Zero();
    for (const std::uint32_t landmark : kAround[side]) centre += 0.25 * model.point(landmark);
    return centre;
  }

 private:
  const ModelMesh& model_;
  Palette palette_;
  std::array<Vector3d, 2> cheeks_, lids_, lid_edges_, nostrils_;
  Vector3d nose_;
};

}  // namespace

std::vector<std::array<float, 3>> paintFace(const ModelMesh& model) {
  const Painter painter(model);
  // Where two parts share a vertex the first one's colour counts: the skin's lips paint themselves.
  std::vector<int> part(unsignedIndex(model.vertices.rows()), -1);
  for (std::size_t i = 0; i < model.triangles.size(); ++i) {
    for (const std::uint32_t vertex : model.triangles[i]) {
      int& known = part[vertex];
      known = known < 0 ? model.part_of_triangle[i] : std::min(known, model.part_of_triangle[i]);
    }
  }
  std::vector<std::array<float, 3>> colors;
  colors.reserve(part.size());
  for (std::uint32_t vertex = 0; vertex < part.size(); ++vertex) {
    const Color color = painter.colorOf(vertex, part[vertex]).cwiseMax(0.0).cwiseMin(1.0);
    // Four digits keep the file short; nobody sees more.
    const auto digits = [](double c) { return asFloat(std::round(c * 1e4) / 1e4); };
    colors.push_back({digits(color[0]), digits(color[1]), digits(color[2])});
  }
  return colors;
}

void carveNostrils(ModelMesh& model) {
  for (std::size_t side = 0; side < 2; ++side) {
    const Vector3d centre = Painter::nostrilCentre(model, side);
    for (std::uint32_t vertex = 0; vertex < model.vertices.rows(); ++vertex) {
      const Vector3d p = model.point(vertex);
      const double depth = bump(p, centre, {3.0, 3.0, 4.6});
      if (depth > 1e-3) model.setPoint(vertex, p + depth * Vector3d(0, 3.4, -0.6));
    }
  }
}

}  // namespace mouthpiece
