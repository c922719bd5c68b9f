#include "exports/film/face_painter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "exports/film/painting.h"

namespace mouthpiece {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector3f;

/// Each pixel is the mean of this many samples squared.
constexpr int kSamples = 2;
/// Rows of samples that are drawn together, so that they stay in the cache.
constexpr int kBandRows = 32;
constexpr float kFieldOfViewDeg = 24, kRoomAround = 1.5F;
constexpr int kShadowWidth = 512;
/// Of the focus' reach: how far a shadow map reaches, how much nearer something must be to throw a shadow.
constexpr float kShadowReach = 2.2F, kShadowBias = 0.035F;
constexpr float kLeastOpenShare = 0.3F;
const Vector3f kBackgroundTop{46, 50, 56}, kBackgroundBottom{92, 96, 102};  // bytes of the screen

/// Rows: right, up, towards the viewer.
Matrix3f viewAlong(const Vector3f& towards_viewer) {
  Matrix3f view;
  view.row(2) = towards_viewer.normalized();
  view.row(0) = Vector3f::UnitY().cross(Vector3f(view.row(2))).normalized();
  view.row(1) = Vector3f(view.row(2)).cross(Vector3f(view.row(0)));
  return view;
}

/// What a light, or an eye far away, sees first: how near it is, in each of a square of places.
class DepthMap {
 public:
  DepthMap(const Vector3f& direction, const Vector3f& middle, float reach)
      : view_(viewAlong(direction)),
        middle_(middle),
        scale_(kShadowWidth / (2 * kShadowReach * reach)),
        bias_(kShadowBias * reach),
        nearest_(kShadowWidth * kShadowWidth, std::numeric_limits<float>::lowest()) {}

  void draw(const VertexPositions& vertices, std::span<const Triangle> triangles) {
    std::vector<RasterPoint<1>> points(unsignedIndex(vertices.rows()));
    for (std::size_t v = 0; v < points.size(); ++v) points[v] = pointOf(vertices.row(signedIndex(v)).transpose());
    for (const Triangle& t : triangles) {
      fillTriangle<1>({points[t[0]], points[t[1]], points[t[2]]}, kShadowWidth, 0, kShadowWidth,
                      [&](int row, int begin, int end, std::array<float, 1> depth, const std::array<float, 1>& step) {
                        float* at = &nearest_[unsignedIndex(row * kShadowWidth)];
                        for (int x = begin; x < end; ++x, depth[0] += step[0]) at[x] = std::max(at[x], depth[0]);
                      });
    }
  }

  /// The share of the light that comes to a place, softly over three by three of the map's.
  [[nodiscard]] float shareAt(const Vector3f& place) const {
    const RasterPoint<1> at = pointOf(place);
    // Before they are whole numbers: what lies far off would not fit into one.
    if (!(at.x >= 2 && at.y >= 2 && at.x < kShadowWidth - 2 && at.y < kShadowWidth - 2)) return 1;
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y);
    int lit = 0;
    for (int dy = -2; dy <= 2; dy += 2) {
      for (int dx = -2; dx <= 2; dx += 2)
        lit += nearest_[unsignedIndex((y + dy) * kShadowWidth + x + dx)] < at.channels[0] + bias_ ? 1 : 0;
    }
    return static_cast<float>(lit) / 9;
  }

 private:
  [[nodiscard]] RasterPoint<1> pointOf(const Vector3f& place) const {
    const Vector3f seen = view_ * (place - middle_);
    return {kShadowWidth / 2.0F + scale_ * seen.x(), kShadowWidth / 2.0F - scale_ * seen.y(), {seen.z()}};
  }

  Matrix3f view_;
  Vector3f middle_;
  float scale_, bias_;
  std::vector<float> nearest_;
};

/// Both sides of thin things are seen; a shell's inside is dark.
bool isSheet(PartKind kind) {
  return kind == PartKind::kHair || kind == PartKind::kMouthInside || kind == PartKind::kOther ||
         kind == PartKind::kTongue;
}

/// Some rows of samples, each the nearest of what was drawn there.
class Band {
 public:
  Band(int width, int height) : width_(width), height_(height) {}

  void clear(int first_row) {
    first_row_ = first_row;
    depth_.assign(unsignedIndex(width_ * kBandRows), 0);
    colors_.resize(depth_.size());
    for (int row = 0; row < kBandRows; ++row) {
      const float share = static_cast<float>(first_row + row) / static_cast<float>(height_);
      const Vector3f color = (1 - share) * kBackgroundTop + share * kBackgroundBottom;
      std::fill_n(colors_.begin() + row * width_, width_, packed(color.x(), color.y(), color.z()));
    }
  }

  void draw(const std::array<RasterPoint<4>, 3>& triangle) {
    fillTriangle<4>(triangle, width_, first_row_, std::min(first_row_ + kBandRows, height_),
                    [&](int row, int begin, int end, const std::array<float, 4>& at, const std::array<float, 4>& step) {
                      const std::size_t start = unsignedIndex((row - first_row_) * width_);
                      for (int x = begin; x < end; ++x) {
                        const float along = static_cast<float>(x - begin), nearness = at[0] + along * step[0];
                        float& nearest = depth_[start + unsignedIndex(x)];
                        if (nearness <= nearest) continue;
                        nearest = nearness;
                        colors_[start + unsignedIndex(x)] =
                            packed(at[1] + along * step[1], at[2] + along * step[2], at[3] + along * step[3]);
                      }
                    });
  }

  /// The band's pixels, each the mean of its samples.
  void show(Picture& picture) const {
    const std::size_t first = unsignedIndex(first_row_ / kSamples);
    for (std::size_t y = 0; y < kBandRows / kSamples && first + y < picture.height; ++y) {
      std::uint8_t* pixel = &picture.rgb[3 * (first + y) * picture.width];
      const std::uint32_t* upper = &colors_[kSamples * y * unsignedIndex(width_)];
      const std::uint32_t* lower = upper + width_;
      for (std::size_t x = 0; x < picture.width; ++x, upper += 2, lower += 2) {
        for (const unsigned shift : {16U, 8U, 0U}) {
          const auto part = [shift](std::uint32_t color) { return (color >> shift) & 0xFFU; };
          *pixel++ =
              static_cast<std::uint8_t>((part(upper[0]) + part(upper[1]) + part(lower[0]) + part(lower[1]) + 2) / 4);
        }
      }
    }
  }

 private:
  static std::uint32_t packed(float red, float green, float blue) {
    const auto byte = [](float value) { return static_cast<std::uint32_t>(std::min(std::max(0.0F, value), 255.0F)); };
    return byte(red) << 16U | byte(green) << 8U | byte(blue);
  }

  int width_, height_, first_row_ = 0;
  std::vector<float> depth_;  ///< one over the distance from the eye
  std::vector<std::uint32_t> colors_;
};

}  // namespace

FacePainter::FacePainter(const FaceMesh& mesh, const Eigen::AlignedBox3f& focus, std::size_t width, std::size_t height,
                         const Vector3f& towards_camera)
    : mesh_(mesh),
      view_from_mesh_(viewAlong(towards_camera)),
      middle_(focus.center()),
      reach_(focus.sizes().norm() / 2),
      width_(width),
      height_(height) {
  for (const MeshPart& part : mesh.parts) {
    std::vector<std::uint32_t> corner_of(mesh.vertexCount(), 0xFFFFFFFFU);
    for (const Triangle& triangle : trianglesOf(mesh, part)) {
      Triangle& own = triangles_.emplace_back(triangle);
      for (std::uint32_t& vertex : own) {
        std::uint32_t& corner = corner_of[vertex];
        if (corner == 0xFFFFFFFFU) {
          corner = static_cast<std::uint32_t>(corners_.size());
          Vector3f color(part.base_color[0], part.base_color[1], part.base_color[2]);
          if (!mesh.vertex_colors.empty())
            color.array() *= Eigen::Map<const Eigen::Array3f>(mesh.vertex_colors[vertex].data());
          corners_.push_back({vertex, part.kind, color, part.roughness});
        }
        vertex = corner;
      }
    }
  }
  const float half = kFieldOfViewDeg * std::numbers::pi_v<float> / 360;
  const float wide = std::tan(half) * static_cast<float>(width) / static_cast<float>(height);
  const Vector3f size = focus.sizes();
  const float distance = kRoomAround * std::max(size.y() / 2 / std::tan(half), size.x() / 2 / wide) + size.z() / 2;
  eye_ = middle_ + distance * view_from_mesh_.row(2).transpose();
  focal_length_ = kSamples * static_cast<float>(height) / 2 / std::tan(half);
}

Vector3f FacePainter::onPicture(const Vector3f& place) const {
  const Vector3f seen = view_from_mesh_ * (place - eye_);
  const float nearness = -1 / std::min(seen.z(), -1e-3F * reach_);
  return {static_cast<float>(width_) / 2 + focal_length_ / kSamples * seen.x() * nearness,
          static_cast<float>(height_) / 2 - focal_length_ / kSamples * seen.y() * nearness, nearness};
}

Vector3f FacePainter::fromPicture(const Vector3f& seen) const {
  const float scale = kSamples / (focal_length_ * seen.z());
  const Vector3f from_eye((seen.x() - static_cast<float>(width_) / 2) * scale,
                          (static_cast<float>(height_) / 2 - seen.y()) * scale, -1 / seen.z());
  return eye_ + view_from_mesh_.transpose() * from_eye;
}

void FacePainter::paint(const VertexPositions& vertices, Picture& picture) const {
  DepthMap key(keyLightDirection(), middle_, reach_), front(Vector3f(0, 0.12F, 1), middle_, reach_);
  key.draw(vertices, mesh_.triangles);
  front.draw(vertices, mesh_.triangles);
  const VertexPositions normals = vertexNormals(vertices, mesh_.triangles);

  const int width = kSamples * static_cast<int>(width_), height = kSamples * static_cast<int>(height_);
  std::vector<RasterPoint<4>> points(corners_.size());
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const Corner& corner = corners_[i];
    const Eigen::Index vertex = signedIndex(std::size_t{corner.vertex});
    const Vector3f place = vertices.row(vertex);
    LitPoint point{normals.row(vertex), (eye_ - place).normalized(), corner.color, corner.roughness, corner.kind, 1, 1};
    if (isSheet(corner.kind) && point.normal.dot(point.to_camera) < 0) point.normal = -point.normal;
    // From a little off the surface, or what is lit at a slant would throw shadows on itself.
    const Vector3f before = place + kShadowBias * reach_ * point.normal;
    point.key_share = key.shareAt(before);
    point.open_share = kLeastOpenShare + (1 - kLeastOpenShare) * front.shareAt(before);
    const Vector3f color = litColor(point), seen = view_from_mesh_ * (place - eye_);
    const float nearness = -1 / std::min(seen.z(), -1e-3F * reach_);
    points[i] = {static_cast<float>(width) / 2 + focal_length_ * seen.x() * nearness,
                 static_cast<float>(height) / 2 - focal_length_ * seen.y() * nearness,
                 {nearness, static_cast<float>(screenByte(color.x())), static_cast<float>(screenByte(color.y())),
                  static_cast<float>(screenByte(color.z()))}};
  }

  std::vector<std::vector<std::uint32_t>> in_band(unsignedIndex((height + kBandRows - 1) / kBandRows));
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    const auto [low, high] =
        std::minmax({points[triangles_[t][0]].y, points[triangles_[t][1]].y, points[triangles_[t][2]].y});
    if (!(high > 0 && low < static_cast<float>(height))) continue;
    const int last_row = static_cast<int>(std::min(high, static_cast<float>(height - 1)));
    const std::size_t last = unsignedIndex(last_row / kBandRows);
    for (std::size_t band = unsignedIndex(static_cast<int>(std::max(low, 0.0F)) / kBandRows); band <= last; ++band)
      in_band[band].push_back(t);
  }
  picture.width = width_;
  picture.height = height_;
  picture.rgb.resize(3 * width_ * height_);
  Band band(width, height);
  for (std::size_t b = 0; b < in_band.size(); ++b) {
    band.clear(static_cast<int>(b) * kBandRows);
    for (const std::uint32_t t : in_band[b]) {
      std::array<RasterPoint<4>, 3> triangle{points[triangles_[t][0]], points[triangles_[t][1]],
                                             points[triangles_[t][2]]};
      const auto& [p, q, r] = triangle;
      const bool is_behind = (q.x - p.x) * (r.y - p.y) - (r.x - p.x) * (q.y - p.y) > 0;  // rows count downwards
      if (is_behind && !isSheet(corners_[triangles_[t][0]].kind)) {
        for (RasterPoint<4>& corner : triangle) {
          for (std::size_t i = 1; i < 4; ++i) corner.channels[i] *= 0.25F;
        }
      }
      band.draw(triangle);
    }
    band.show(picture);
  }
}

}  // namespace mouthpiece
