// Where the tracker of faces in videos sees a head's features: the head is painted, tracked, and the rays are followed
// back to its skin.
#include "face_finder/seen_anchors.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "deform/topology/mirror_plane.h"
#include "exports/film/face_painter.h"
#include "face_finder/chin.h"
#include "tracking/face_tracker.h"

namespace mouthpiece {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector2f;
using Eigen::Vector3f;

struct WantedAnchor {
  const char* name;
  std::array<Eigen::Index, 2> landmarks;  ///< in MediaPipe's numbering; it lies between them
};
constexpr std::array<WantedAnchor, 10> kWanted{{{"LIP_CORNER_R", {61, 61}},
                                                {"LIP_CORNER_L", {291, 291}},
                                                {"LIP_UP_MID", {0, 0}},
                                                {"LIP_LO_MID", {17, 17}},
                                                {"NOSE_TIP", {1, 4}},
                                                {"CHIN_LOW", {152, 152}},
                                                {"CANTHUS_OUT_R", {33, 33}},
                                                {"CANTHUS_OUT_L", {263, 263}},
                                                {"EYE_IN_R", {133, 133}},
                                                {"EYE_IN_L", {362, 362}}}};
enum Wanted : std::size_t { kCornerR, kCornerL, kUpper, kLower, kNose, kChin, kOuterR, kOuterL, kInnerR, kInnerL };
constexpr std::array<Wanted, 10> kMirrored{kCornerL, kCornerR, kUpper,  kLower,  kNose,
                                           kChin,    kOuterL,  kOuterR, kInnerL, kInnerR};
using Pixels = std::array<Vector2f, kWanted.size()>;

/// Of pictures in which a face is looked for, and of those in which it is looked at, pixels.
constexpr std::size_t kSearchSide = 320, kPictureSide = 512;
/// Of the likely views those in which a whole figure's head is looked for: Y or Z up. It is in the upper share of it:
/// a child's head is a fourth as high as the child, a grown person's an eighth.
constexpr std::size_t kFigureViews = 8;
constexpr std::array<float, 2> kHeadShares{0.3F, 0.17F};
/// Of the mesh's size: a smaller part is not looked at.
constexpr float kLeastFocus = 1e-3F;
/// Of the distance of the outer eye corners: half the box round a face, how far the nose stands out at least, how far
/// behind the rest of a face a place lies at most (the back of an empty eye socket lies deeper).
constexpr float kHalfWide = 0.85F, kHalfHigh = 1.05F, kLeastNose = 0.08F, kDeepest = 0.7F;
/// Turns about the face's up and right axes from which it is looked at, degrees.
constexpr std::array<std::array<float, 2>, 9> kViews{
    {{0, 0}, {-10, 0}, {10, 0}, {-20, 0}, {20, 0}, {0, -10}, {0, 10}, {-10, 8}, {10, 8}}};
constexpr std::size_t kLeastSeen = 5;

Matrix3f turn(float degrees, const Vector3f& axis) {
  return Eigen::AngleAxisf(degrees * std::numbers::pi_v<float> / 180, axis).toRotationMatrix();
}

/// What one picture shows: places of the wanted anchors on the skin, in the mesh's own axes.
struct Sight {
  std::array<Vector3f, kWanted.size()> places;
  double presence = 0;

  [[nodiscard]] const Vector3f& operator[](Wanted anchor) const { return places[anchor]; }
  [[nodiscard]] float eyeCorners() const { return (places[kOuterL] - places[kOuterR]).norm(); }
  [[nodiscard]] Vector3f mouth() const { return (places[kCornerL] + places[kCornerR]) / 2; }
  [[nodiscard]] Vector3f eyes() const { return (places[kOuterL] + places[kOuterR]) / 2; }

  /// Rows: the face's left, up and forward. Mouth and eyes make the upright plane.
  [[nodiscard]] Matrix3f faceFromMesh() const {
    Matrix3f axes;
    const Vector3f left = (places[kOuterL] - places[kOuterR] + places[kCornerL] - places[kCornerR]).normalized();
    const Vector3f forward = left.cross(eyes() - mouth()).normalized();
    axes << left.transpose(), forward.cross(left).transpose(), forward.transpose();
    return axes;
  }

  [[nodiscard]] FaceFrame frame() const { return {faceFromMesh(), 0.5F * (eyes() + mouth()), eyeCorners()}; }

  /// How far the nose stands out of the plane of eyes and mouth, of the eyes' distance.
  [[nodiscard]] float noseOut() const { return faceFromMesh().row(2).dot(places[kNose] - mouth()) / eyeCorners(); }

  /// Whether it is a face's shape that was seen: mouth under the eyes, between them the nose, standing out.
  [[nodiscard]] bool isFace() const {
    const float eyes_apart = eyeCorners();
    if (!(eyes_apart > 0)) return false;
    const Matrix3f axes = faceFromMesh();
    if (!axes.allFinite()) return false;
    const auto at = [&](Wanted anchor) -> Vector3f { return axes * (places[anchor] - mouth()) / eyes_apart; };
    return noseOut() > kLeastNose && at(kNose).y() > 0.05F && at(kNose).y() < at(kOuterR).y() + 0.15F &&
           at(kUpper).y() > at(kLower).y() && at(kLower).y() > at(kChin).y() && at(kOuterR).x() < at(kInnerR).x() &&
           at(kInnerR).x() < at(kInnerL).x() && at(kInnerL).x() < at(kOuterL).x() &&
           at(kCornerR).x() < at(kCornerL).x();
  }
};

Picture inMirror(const Picture& picture) {
  Picture mirrored = picture;
  for (std::size_t y = 0; y < picture.height; ++y) {
    for (std::size_t x = 0; x < picture.width; ++x)
      std::copy_n(&picture.rgb[3 * (y * picture.width + x)], 3, &mirrored.rgb[3 * ((y + 1) * picture.width - 1 - x)]);
  }
  return mirrored;
}

class Onlooker {
 public:
  Onlooker(const FaceMesh& mesh, FaceTracker& tracker) : mesh_(mesh), tracker_(tracker), skin_(mesh) {
    for (const MeshPart& part : mesh.parts) {
      if (part.stands_off || part.kind == PartKind::kHair) continue;
      for (const Triangle& triangle : trianglesOf(mesh, part)) solid_.push_back({triangle, isSkin(part.kind)});
    }
    size_ = (mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff()).norm();
  }

  std::optional<Sight> look(const Matrix3f& view_from_mesh, const Eigen::AlignedBox3f& focus,
                            std::size_t side = kPictureSide) {
    // A flat mesh has no upper part when it lies, and what is a speck in the mesh is no face.
    if (!(focus.sizes().maxCoeff() > kLeastFocus * size_)) return std::nullopt;
    const VertexPositions seen = mesh_.vertices * view_from_mesh.transpose();
    const FacePainter painter(mesh_, focus, side, side, Vector3f::UnitZ());
    Picture picture;
    painter.paint(seen, picture);
    auto pixels = track(picture);
    if (!pixels) return std::nullopt;
    const double presence = tracker_.presence();
    // In a mirror the tracker errs to the other side.
    if (const auto mirrored = track(inMirror(picture))) {
      for (std::size_t i = 0; i < pixels->size(); ++i) {
        const Vector2f other = (*mirrored)[kMirrored[i]];
        (*pixels)[i] = ((*pixels)[i] + Vector2f(static_cast<float>(side) - other.x(), other.y())) / 2;
      }
    }
    auto sight = castBack(*pixels, painter, seen, view_from_mesh);
    if (sight) sight->presence = presence;
    return sight;
  }

  /// All of the mesh as seen.
  [[nodiscard]] Eigen::AlignedBox3f whole(const Matrix3f& view_from_mesh) const {
    const VertexPositions seen = mesh_.vertices * view_from_mesh.transpose();
    return {Vector3f(seen.colwise().minCoeff()), Vector3f(seen.colwise().maxCoeff())};
  }

  /// As high as it is wide, around the middle of what is up there.
  [[nodiscard]] Eigen::AlignedBox3f upperPart(const Matrix3f& view_from_mesh, float share) const {
    const Eigen::AlignedBox3f whole = this->whole(view_from_mesh);
    const float high = share * whole.sizes().y(), floor = whole.max().y() - high / 2;
    const VertexPositions seen = mesh_.vertices * view_from_mesh.transpose();
    Eigen::AlignedBox3f top;
    for (const Triangle& triangle : skin_.triangles()) {
      for (const std::uint32_t v : triangle) {
        const Vector3f place = seen.row(signedIndex(std::size_t{v})).transpose();
        if (place.y() > floor) top.extend(place);
      }
    }
    const Vector3f middle = top.isEmpty() ? Vector3f(whole.center()) : Vector3f(top.center());
    const Vector3f half(high / 2, high / 2, high / 2), centre(middle.x(), whole.max().y() - high / 2, middle.z());
    return {Vector3f(centre - half), Vector3f(centre + half)};
  }

  /// Some of it as seen, with half as much again around.
  [[nodiscard]] Eigen::AlignedBox3f around(const Matrix3f& view_from_mesh, std::span<const std::uint32_t> some) const {
    Eigen::AlignedBox3f box;
    for (const std::uint32_t v : some) box.extend(view_from_mesh * skin_.vertex(v));
    const Vector3f half = 0.75F * box.sizes();
    return {Vector3f(box.center() - half), Vector3f(box.center() + half)};
  }

  [[nodiscard]] const FaceSkin& skin() const { return skin_; }

 private:
  struct Solid {
    Triangle corners;
    bool is_skin;
  };
  struct Hit {
    float nearness = 0;
    bool is_skin = false;
  };

  /// The wanted anchors in a picture by itself.
  std::optional<Pixels> track(const Picture& picture) {
    tracker_.reset();
    const auto landmarks = tracker_.track({picture.width, picture.height, picture.rgb});
    if (!landmarks) return std::nullopt;
    Pixels pixels;
    for (std::size_t i = 0; i < kWanted.size(); ++i) {
      const auto& [first, second] = kWanted[i].landmarks;
      pixels[i] = ((landmarks->row(first) + landmarks->row(second)) / 2).head<2>().cast<float>().transpose();
    }
    return pixels;
  }

  [[nodiscard]] std::optional<Sight> castBack(const Pixels& pixels, const FacePainter& painter,
                                              const VertexPositions& seen, const Matrix3f& view_from_mesh) const {
    std::vector<Vector3f> points(unsignedIndex(seen.rows()));
    for (std::size_t v = 0; v < points.size(); ++v) points[v] = painter.onPicture(seen.row(signedIndex(v)).transpose());
    std::array<Hit, kWanted.size()> hits;
    for (const Solid& solid : solid_) {
      const Vector3f &a = points[solid.corners[0]], &b = points[solid.corners[1]], &c = points[solid.corners[2]];
      const float area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
      if (!(std::abs(area) > 1e-9F)) continue;
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        const Vector2f from = pixels[i] - a.head<2>();
        const float u = (from.x() * (c.y() - a.y()) - (c.x() - a.x()) * from.y()) / area;
        const float w = ((b.x() - a.x()) * from.y() - from.x() * (b.y() - a.y())) / area;
        if (u < 0 || w < 0 || u + w > 1) continue;
        const float nearness = (1 - u - w) * a.z() + u * b.z() + w * c.z();
        if (nearness > hits[i].nearness) hits[i] = {nearness, solid.is_skin};
      }
    }
    std::array<float, kWanted.size()> depths;
    for (std::size_t i = 0; i < hits.size(); ++i) depths[i] = hits[i].nearness > 0 ? 1 / hits[i].nearness : 1e30F;
    std::nth_element(depths.begin(), depths.begin() + depths.size() / 2, depths.end());
    const float middle = depths[depths.size() / 2];
    if (!(middle < 1e29F)) return std::nullopt;  // it has seen a face in what is no surface
    const auto placeAt = [&](const Vector2f& pixel, float nearness) {
      return painter.fromPicture({pixel.x(), pixel.y(), nearness});
    };
    const float reach = kDeepest * (placeAt(pixels[kOuterL], 1 / middle) - placeAt(pixels[kOuterR], 1 / middle)).norm();
    Sight sight;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      Vector3f place;
      if (hits[i].nearness > 0 && std::abs(1 / hits[i].nearness - middle) < reach)
        place = placeAt(pixels[i], hits[i].nearness);
      else
        place = seen.row(nearestInPicture(pixels[i], points, middle, reach)).transpose();
      sight.places[i] = view_from_mesh.transpose() * place;
      if (!hits[i].is_skin) sight.places[i] = skin_.nearest(sight.places[i]);
    }
    return sight;
  }

  /// The vertex of the skin that lies nearest to a place in the picture, of those as deep as a face.
  [[nodiscard]] Eigen::Index nearestInPicture(const Vector2f& pixel, const std::vector<Vector3f>& points, float middle,
                                              float reach) const {
    std::uint32_t nearest = skin_.triangles().front()[0];
    float least = std::numeric_limits<float>::max();
    for (const Triangle& triangle : skin_.triangles()) {
      for (const std::uint32_t v : triangle) {
        const float far = (points[v].head<2>() - pixel).squaredNorm();
        if (far < least && std::abs(1 / points[v].z() - middle) < reach) {
          least = far;
          nearest = v;
        }
      }
    }
    return signedIndex(std::size_t{nearest});
  }

  const FaceMesh& mesh_;
  FaceTracker& tracker_;
  float size_ = 0;  ///< of all of the mesh
  FaceSkin skin_;
  std::vector<Solid> solid_;
};

/// Ways in which a head may stand, the likely ones first: Y up, then Z up, and so on, looking along each other axis.
/// The tracker knows a face that is turned by as much as lies between them.
std::vector<Matrix3f> likelyViews() {
  const Vector3f x = Vector3f::UnitX(), y = Vector3f::UnitY(), z = Vector3f::UnitZ();
  std::vector<Matrix3f> views;
  for (const Matrix3f& upright :
       {Matrix3f(Matrix3f::Identity()), turn(-90, x), turn(90, x), turn(180, z), turn(90, z), turn(-90, z)}) {
    for (const float about : {0.0F, 180.0F, 90.0F, -90.0F}) views.emplace_back(turn(about, y) * upright);
  }
  return views;
}

Eigen::AlignedBox3f boxOfFace(const Sight& sight, const Matrix3f& view_from_mesh) {
  const Vector3f middle = view_from_mesh * sight.frame().middle;
  const Vector3f half = sight.eyeCorners() * Vector3f(kHalfWide, kHalfHigh, kHalfWide);
  return {Vector3f(middle - half), Vector3f(middle + half)};
}

/// From the front of the face that was seen, closer, until it stays.
std::optional<Sight> fromTheFront(Onlooker& onlooker, Sight sight) {
  constexpr int kMostLooks = 5;
  constexpr float kStill = 1.5F * std::numbers::pi_v<float> / 180;
  for (int i = 0; i < kMostLooks; ++i) {
    const Matrix3f view = sight.faceFromMesh();
    const auto next = onlooker.look(view, boxOfFace(sight, view));
    if (!next || !next->isFace()) return std::nullopt;
    sight = *next;
    if (Eigen::AngleAxisf(Matrix3f(sight.faceFromMesh() * view.transpose())).angle() < kStill) break;
  }
  return sight;
}

/// The face of what is known to be a head, from its front.
std::optional<Sight> faceOfHead(Onlooker& onlooker, std::span<const std::uint32_t> head) {
  for (const Matrix3f& view : likelyViews()) {
    const auto sight = onlooker.look(view, onlooker.around(view, head), kSearchSide);
    if (!sight || !sight->isFace()) continue;
    if (const auto front = fromTheFront(onlooker, *sight)) return front;
  }
  return std::nullopt;
}

/// A face on any side, seen from its front. What looks like one upside down is told from one by which stands out more.
std::optional<Sight> anyFace(Onlooker& onlooker) {
  const std::vector<Matrix3f> views = likelyViews();
  for (std::size_t i = 0; i < views.size() + kHeadShares.size() * kFigureViews; ++i) {
    const bool is_figure = i >= views.size();
    const std::size_t figure = is_figure ? i - views.size() : 0;
    const Matrix3f& view = views[is_figure ? figure % kFigureViews : i];
    const auto sight = onlooker.look(
        view, is_figure ? onlooker.upperPart(view, kHeadShares[figure / kFigureViews]) : onlooker.whole(view),
        kSearchSide);
    if (!sight || !sight->isFace()) continue;
    const auto front = fromTheFront(onlooker, *sight);
    if (!front) continue;
    const Matrix3f over = turn(180, Vector3f::UnitZ()) * front->faceFromMesh();
    const auto turned = onlooker.look(over, boxOfFace(*front, over));
    const auto other = turned && turned->isFace() ? fromTheFront(onlooker, *turned) : std::nullopt;
    return other && other->noseOut() > front->noseOut() ? other : front;
  }
  return std::nullopt;
}

Vector3f medianOf(std::vector<Vector3f> places) {
  Vector3f median;
  std::vector<float> values(places.size());
  for (Eigen::Index k = 0; k < 3; ++k) {
    std::transform(places.begin(), places.end(), values.begin(), [k](const Vector3f& place) { return place[k]; });
    std::sort(values.begin(), values.end());
    median[k] = (values[(values.size() - 1) / 2] + values[values.size() / 2]) / 2;
  }
  return median;
}

}  // namespace

std::optional<SeenFace> seenFace(const FaceMesh& mesh, FaceTracker& tracker, std::span<const std::uint32_t> head) {
  if (trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips}).empty()) return std::nullopt;
  Onlooker onlooker(mesh, tracker);
  std::optional<Sight> front = head.empty() ? std::nullopt : faceOfHead(onlooker, head);
  if (!front) front = anyFace(onlooker);
  if (!front) return std::nullopt;

  const Matrix3f face_from_mesh = front->faceFromMesh();
  SeenFace face;
  std::array<std::vector<Vector3f>, kWanted.size()> places;
  face.presence = 1;
  for (const auto& [about_up, about_right] : kViews) {
    const Matrix3f view = turn(about_right, Vector3f::UnitX()) * turn(about_up, Vector3f::UnitY()) * face_from_mesh;
    const auto sight = onlooker.look(view, boxOfFace(*front, view));
    ++face.pictures;
    if (!sight || !sight->isFace()) continue;
    ++face.seen;
    face.presence = std::min(face.presence, sight->presence);
    for (std::size_t i = 0; i < kWanted.size(); ++i) places[i].push_back(sight->places[i]);
  }
  if (face.seen < kLeastSeen) return std::nullopt;
  Sight mean = *front;
  for (std::size_t i = 0; i < kWanted.size(); ++i) mean.places[i] = medianOf(places[i]);
  const FaceSkin& skin = onlooker.skin();
  if (const auto mirrored = mirrorPlane(skin, mean.frame())) {
    const Sight one_sided = mean;
    for (std::size_t i = 0; i < kWanted.size(); ++i)
      mean.places[i] = (one_sided.places[i] + (*mirrored)(one_sided.places[kMirrored[i]])) / 2;
  }
  const Sight as_seen = mean;
  mean.places[kChin] = chinOnProfile(skin, mean.frame(), mean.places[kChin]);
  for (std::size_t i = 0; i < kWanted.size(); ++i) {
    mean.places[i] = skin.nearest(mean.places[i]);
    std::vector<double> off;
    for (const Vector3f& place : places[i]) off.push_back(double{(place - as_seen.places[i]).norm()});
    std::sort(off.begin(), off.end());
    face.anchors[kWanted[i].name] = {mean.places[i].cast<double>(), off[off.size() / 2]};
  }
  if (!mean.isFace()) return std::nullopt;
  face.eye_corners = double{mean.eyeCorners()};
  return face;
}

}  // namespace mouthpiece
