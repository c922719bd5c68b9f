// Where a head's features are, by the geometry of what its own shapes move.
#include "retarget/placing/shape_anchors.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/errors.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/topology/lip_line.h"
#include "deform/topology/lip_slit.h"
#include "retarget/placing/upright_head.h"

namespace mouthpiece {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

Vector3f placeAt(const FaceMesh& mesh, std::uint32_t v) { return mesh.vertices.row(v).transpose(); }

/// Of `vertices` the one that `score` likes best; nullopt without any that it likes at all (above minus infinity).
template <typename Score>
std::optional<std::uint32_t> best(const std::vector<std::uint32_t>& vertices, const Score& score) {
  std::optional<std::uint32_t> found;
  float most = -std::numeric_limits<float>::infinity();
  for (const std::uint32_t v : vertices) {
    const float own = score(v);
    if (own > most) {
      most = own;
      found = v;
    }
  }
  return found;
}
constexpr float kNever = -std::numeric_limits<float>::infinity();
constexpr float kRedEdge = 0.16F;  ///< a lip's red edge from the lips' meeting, of the mouth's width

class AnchorFinder {
 public:
  AnchorFinder(const FaceMesh& mesh, const TellingShapes& shapes)
      : mesh_(mesh), shapes_(shapes), skin_(skinVertices(mesh, false)), front_(frontOf(mesh)) {}

  std::map<std::string, std::uint32_t> find(const std::string& file) {
    std::vector<SlitPair> slit;
    for (const SlitPair& pair : lipSlit(mesh_, shapes_.jaw_open)) {
      if (slit.empty() || slit.back().step != pair.step) slit.push_back(pair);  // the one in front
    }
    if (slit.size() < 4) {
      throw InputError(
          file, "",
          "shows no slit between the lips where its jaw opens: they are one surface, or the mouth's shapes "
          "move other parts; cut them open (`retarget cut`) or click the anchors (`retarget pick`)");
    }
    findMouth(slit);
    findProfile();
    findEye(true);
    findEye(false);
    return std::move(anchors_);
  }

 private:
  /// The surface as seen from the front: crossings(x, y) are depths along z.
  static TriangleTree frontOf(const FaceMesh& mesh) {
    VertexPositions turned(mesh.vertices.rows(), 3);
    turned << mesh.vertices.col(0), mesh.vertices.col(2), mesh.vertices.col(1);
    return TriangleTree(turned, mesh.triangles);
  }

  struct Seen {
    float z;
    std::size_t triangle;
  };
  [[nodiscard]] std::optional<Seen> seenAt(float x, float y) const {
    std::optional<Seen> seen;
    for (const TriangleTree::Crossing& crossing : front_.crossings(static_cast<double>(x), static_cast<double>(y))) {
      const auto z = static_cast<float>(crossing.height);
      if (!seen || z > seen->z) seen = Seen{z, crossing.triangle};
    }
    return seen;
  }
  [[nodiscard]] const MeshPart* partOf(std::size_t triangle) const {
    for (const MeshPart& part : mesh_.parts) {
      if (triangle >= part.first_triangle && triangle < part.first_triangle + part.triangle_count) return &part;
    }
    return nullptr;
  }

  std::uint32_t nearestSkin(const Vector3f& place) const {
    return *best(skin_, [&](std::uint32_t v) { return -(placeAt(mesh_, v) - place).norm(); });
  }

  void findMouth(const std::vector<SlitPair>& slit) {
    const auto middleOf = [&](const SlitPair& pair) -> Vector3f {
      return 0.5F * (placeAt(mesh_, pair.upper) + placeAt(mesh_, pair.lower));
    };
    // The head's right is at lower x: it looks at us.
    Vector3f right = middleOf(slit.front()), left = middleOf(slit.back());
    carryOn(right, left);
    centre_x_ = 0.5F * (right.x() + left.x());
    width_ = left.x() - right.x();
    const auto middle = std::min_element(slit.begin(), slit.end(), [&](const SlitPair& a, const SlitPair& b) {
      return std::abs(middleOf(a).x() - centre_x_) < std::abs(middleOf(b).x() - centre_x_);
    });
    stomion_ = middleOf(*middle);
    anchors_["LIP_CORNER_R"] = nearestSkin(right);
    anchors_["LIP_CORNER_L"] = nearestSkin(left);
    anchors_["LIP_UP_MID"] = skinOnProfile(redEdge(1));
    anchors_["LIP_LO_MID"] = skinOnProfile(redEdge(-1));
  }

  /// Takes the ends of the slit outwards to the corners of the lips' line: a shape that opens the middle alone parts
  /// nothing there (Ready Player Me's mouthOpen ends a third before them).
  void carryOn(Vector3f& right, Vector3f& left) const {
    const Vector3f middle = 0.5F * (right + left), lip(0, kRedEdge * (left - right).norm(), 0);
    const auto line = traceLipLine(
        mesh_.vertices, trianglesOf(mesh_, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside}),
        {right.cast<double>(), left.cast<double>(), (middle + lip).cast<double>(), (middle - lip).cast<double>()});
    if (!line || !line->is_parted) return;
    if (line->corner_right.x() < static_cast<double>(right.x())) right = line->corner_right.cast<float>();
    if (line->corner_left.x() > static_cast<double>(left.x())) left = line->corner_left.cast<float>();
  }

  [[nodiscard]] std::optional<float> profile(float y) const {
    // A beard or a cigar before the face is not its profile.
    std::optional<float> z;
    for (const TriangleTree::Crossing& crossing :
         front_.crossings(static_cast<double>(centre_x_ + 1e-4F * width_), static_cast<double>(y))) {
      const MeshPart* part = partOf(crossing.triangle);
      if (part == nullptr || !isSkin(part->kind) || part->stands_off) continue;
      if (!z || static_cast<float>(crossing.height) > *z) z = static_cast<float>(crossing.height);
    }
    return z;
  }

  std::uint32_t skinOnProfile(float y) const { return nearestSkin({centre_x_, y, profile(y).value_or(stomion_.z())}); }

  /// The red edge of a lip on the midline: from the lips' meeting outwards (`way`: 1 up, -1 down) the profile swells
  /// and falls back. A snout's lip does not fall back: its edge is where a person's is.
  [[nodiscard]] float redEdge(float way) const {
    constexpr int kSteps = 30;
    const float step = 0.01F * width_;
    const auto yAt = [&](int i) { return stomion_.y() + way * step * static_cast<float>(i); };
    int swelling = 0;
    float most = kNever;
    for (int i = 3; i <= kSteps; ++i) {
      const auto z = profile(yAt(i));
      if (!z) break;
      if (*z > most) {
        most = *z;
        swelling = i;
      }
    }
    return swelling == 0 || swelling == kSteps ? stomion_.y() + way * kRedEdge * width_ : yAt(swelling);
  }

  /// From the lower lip down the profile, the first place from which on it goes back faster than half as much as it
  /// goes down: a throat and a chest lie beyond. nullopt where the profile ends before.
  [[nodiscard]] std::optional<float> underChin() const {
    constexpr int kFirst = 30, kLast = 180, kPast = 15;
    const float step = 0.01F * width_;
    int lowest = 0;
    float most = kNever;
    for (int i = kFirst; i <= kLast; ++i) {
      const float y = stomion_.y() - step * static_cast<float>(i);
      const auto z = profile(y);
      const float score = z ? -y + 0.5F * *z : kNever;
      if (score > most) {
        most = score;
        lowest = i;
      } else if (i > lowest + kPast || !z) {
        break;
      }
    }
    if (lowest == 0 || lowest == kLast) return std::nullopt;
    return stomion_.y() - step * static_cast<float>(lowest);
  }

  void findProfile() {
    const auto onMiddle = [&](std::uint32_t v, float share) {
      return std::abs(mesh_.vertices(v, 0) - centre_x_) < share * width_;
    };
    const auto nose = best(skin_, [&](std::uint32_t v) {
      const float up = (mesh_.vertices(v, 1) - stomion_.y()) / width_;
      return onMiddle(v, 0.25F) && up > 0.25F && up < 1.4F ? mesh_.vertices(v, 2) : kNever;
    });
    if (nose) anchors_["NOSE_TIP"] = *nose;
    if (const auto y = underChin()) anchors_["CHIN_LOW"] = skinOnProfile(*y);
  }

  /// The eye between its corners, as far as it is seen; else the lid that closes.
  void findEye(bool right) {
    const float side = right ? -1.0F : 1.0F;
    std::optional<Vector3f> inner, outer;
    const auto take = [&](const Vector3f& place) {
      const float out = side * (place.x() - centre_x_);
      if (!inner || out < side * (inner->x() - centre_x_)) inner = place;
      if (!outer || out > side * (outer->x() - centre_x_)) outer = place;
    };
    constexpr int kAcross = 110, kUp = 60;
    for (int i = 0; i < kAcross; ++i) {
      for (int k = 0; k < kUp; ++k) {
        const float x = centre_x_ + side * width_ * (0.1F + 1.1F * static_cast<float>(i) / kAcross);
        const float y = stomion_.y() + width_ * (0.6F + 1.3F * static_cast<float>(k) / kUp);
        const auto seen = seenAt(x, y);
        const MeshPart* part = seen ? partOf(seen->triangle) : nullptr;
        if (part != nullptr && part->kind == PartKind::kEye) take({x, y, seen->z});
      }
    }
    const VertexPositions& blink = right ? shapes_.blink_right : shapes_.blink_left;
    if (!inner && blink.rows() > 0) {
      float most = 0;
      for (const std::uint32_t v : skin_) most = std::max(most, blink.row(v).norm());
      for (const std::uint32_t v : skin_) {
        if (most > 0 && blink.row(v).norm() > 0.25F * most && side * (mesh_.vertices(v, 0) - centre_x_) > 0)
          take(placeAt(mesh_, v));
      }
    }
    if (!inner || !outer) return;
    anchors_[right ? "EYE_IN_R" : "EYE_IN_L"] = nearestSkin(*inner);
    anchors_[right ? "CANTHUS_OUT_R" : "CANTHUS_OUT_L"] = nearestSkin(*outer);
  }

  const FaceMesh& mesh_;
  const TellingShapes& shapes_;
  std::vector<std::uint32_t> skin_;
  TriangleTree front_;
  float centre_x_ = 0, width_ = 0;  ///< of the mouth
  Vector3f stomion_ = Vector3f::Zero();
  std::map<std::string, std::uint32_t> anchors_;
};

}  // namespace

std::map<std::string, std::uint32_t> anchorsFromShapes(const FaceMesh& mesh, const TellingShapes& shapes,
                                                       const std::string& file) {
  MOUTHPIECE_EXPECT(shapes.jaw_open.rows() == mesh.vertices.rows());
  const Eigen::Matrix3f turn = uprightFromGiven(mesh, skinVertices(mesh, false), shapes);
  FaceMesh turned = mesh;
  TellingShapes turned_shapes = shapes;
  for (VertexPositions* rows :
       {&turned.vertices, &turned_shapes.jaw_open, &turned_shapes.blink_left, &turned_shapes.blink_right})
    *rows = (*rows * turn.transpose()).eval();
  return AnchorFinder(turned, turned_shapes).find(file);
}

}  // namespace mouthpiece
