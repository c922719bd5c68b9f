#include "deform/surface/virtual_points.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/errors.h"
#include "deform/surface/control_steps.h"

namespace mouthpiece {
namespace {

struct RimPoint {
  const char* name;
  const char* outer;  ///< the lip marker in front of it
  const char* right;  ///< that marker's neighbours along the lip
  const char* left;
  int landmark;
  const char* opposite;
};

/// The rim of the mouth: one point behind each outer lip marker.
constexpr RimPoint kRim[] = {
    {"RIM_UP_OUT_R", "LIP_UP_OUT_R", "LIP_CORNER_R", "LIP_UP_IN_R", 80, "RIM_LO_OUT_R"},
    {"RIM_UP_IN_R", "LIP_UP_IN_R", "LIP_UP_OUT_R", "LIP_UP_MID", 82, "RIM_LO_IN_R"},
    {"RIM_UP_MID", "LIP_UP_MID", "LIP_UP_IN_R", "LIP_UP_IN_L", 13, "RIM_LO_MID"},
    {"RIM_UP_IN_L", "LIP_UP_IN_L", "LIP_UP_MID", "LIP_UP_OUT_L", 312, "RIM_LO_IN_L"},
    {"RIM_UP_OUT_L", "LIP_UP_OUT_L", "LIP_UP_IN_L", "LIP_CORNER_L", 310, "RIM_LO_OUT_L"},
    {"RIM_LO_OUT_R", "LIP_LO_OUT_R", "LIP_CORNER_R", "LIP_LO_IN_R", 88, "RIM_UP_OUT_R"},
    {"RIM_LO_IN_R", "LIP_LO_IN_R", "LIP_LO_OUT_R", "LIP_LO_MID", 87, "RIM_UP_IN_R"},
    {"RIM_LO_MID", "LIP_LO_MID", "LIP_LO_IN_R", "LIP_LO_IN_L", 14, "RIM_UP_MID"},
    {"RIM_LO_IN_L", "LIP_LO_IN_L", "LIP_LO_MID", "LIP_LO_OUT_L", 317, "RIM_UP_IN_L"},
    {"RIM_LO_OUT_L", "LIP_LO_OUT_L", "LIP_LO_IN_L", "LIP_CORNER_L", 318, "RIM_UP_OUT_L"},
};

/// Corners of the mouth's opening. The rim just beside them is no point of the control mesh, it only tells how deep a
/// corner lies.
struct CornerPoint {
  const char* name;
  const char* outer;
  int landmark;
  const char* upper;  ///< the rim's next points
  const char* lower;
  const char* beside_upper;
  int beside_upper_landmark;
  const char* beside_lower;
  int beside_lower_landmark;
};
constexpr CornerPoint kCorners[] = {
    {"RIM_CORNER_R", "LIP_CORNER_R", 78, "RIM_UP_OUT_R", "RIM_LO_OUT_R", "RIM_UP_NEAR_R", 191, "RIM_LO_NEAR_R", 95},
    {"RIM_CORNER_L", "LIP_CORNER_L", 308, "RIM_UP_OUT_L", "RIM_LO_OUT_L", "RIM_UP_NEAR_L", 415, "RIM_LO_NEAR_L", 324}};

struct EyePoints {
  char side;
  const char* outer;
  const char* up;
  const char* lo;
  const char* in;
  const char* nose;  ///< marker that the inner corner leans on
  int in_landmark, up_out, up_in, lo_out, lo_in;
};
constexpr EyePoints kEyes[] = {
    {'R', "CANTHUS_OUT_R", "LID_UP_R", "LID_LO_R", "EYE_IN_R", "NOSE_ROOT", 133, 161, 157, 163, 154},
    {'L', "CANTHUS_OUT_L", "LID_UP_L", "LID_LO_L", "EYE_IN_L", "NOSE_ROOT", 362, 388, 384, 390, 381},
};

/// Where the lips part, as a share of the way from the upper outer line to the lower one.
constexpr double kLipsPartAt = 0.42;
/// The opening's corner lies this share of the way from the lip corner to the other one.
constexpr double kInnerCornerAt = 0.06;
/// Half the slit's width in the plane, as a share of its length: wide enough for a hole, too narrow to bend it.
constexpr double kSlitHalfWidth = 0.004;
/// A lid's arc follows the middle of the lid by this much, the eye's corners by the rest.
constexpr double kLidShare = 0.7;
/// Ring outside the markers: distance as a share of the head's half width, and points.
constexpr double kRingBelow = 0.7;
constexpr double kRingAbove = 0.4;
constexpr double kRingBeside = 0.25;  ///< the ears begin there
constexpr int kRingPoints = 28;

/// Builds the points one after the other.
class Placer {
 public:
  Placer(const std::vector<std::string>& names, const MarkerPositions& rest,
         const std::map<std::string, Eigen::Vector3d>& known, const SurfacePlan& plan)
      : known_(known), plan_(plan) {
    MOUTHPIECE_EXPECT(plan.lips.empty() || plan.lips.size() == names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      const LipSide side = plan.lips.empty() ? lipSideOf(names[i]) : plan.lips[i];
      add({.name = names[i], .rule = PointRule::kMarker, .side = side, .drivers = {}},
          rest.row(signedIndex(i)).transpose());
    }
    mesh_.marker_count = names.size();
  }

  ControlMesh place() {
    checkFace();
    mesh_.mouth_width = (at("LIP_CORNER_L") - at("LIP_CORNER_R")).norm();
    addLipRims();
    addEyes();
    finishRest();
    cylinder_ = cylinderOf(mesh_);
    if (at("LIP_UP_MID").z() < cylinder_.axis_z + 0.1 * cylinder_.radius) {
      throw InputError("control surface: found lips behind the sides of the face; expected Z out of the face");
    }
    mesh_.domain.resize(mesh_.rest.rows(), 2);
    for (Eigen::Index i = 0; i < mesh_.rest.rows(); ++i)
      mesh_.domain.row(i) = cylinder_.unrolled(mesh_.rest.row(i).transpose()).transpose();
    straightenSlit();
    addRing();
    wantTriangles();
    return std::move(mesh_);
  }

 private:
  static LipSide sideOfLip(const std::string& name) {
    if (name.starts_with("RIM_UP_")) return LipSide::kUpper;
    if (name.starts_with("RIM_LO_")) return LipSide::kLower;
    return lipSideOf(name);
  }

  void add(ControlPoint point, const Eigen::Vector3d& rest) {
    mesh_.points.push_back(std::move(point));
    rest_.push_back(rest);
  }

  [[nodiscard]] int find(const std::string& name) const { return findPoint(mesh_, name); }
  [[nodiscard]] bool has(const std::string& name) const { return find(name) >= 0; }
  [[nodiscard]] Eigen::Vector3d at(const std::string& name) const { return rest_[unsignedIndex(find(name))]; }
  [[nodiscard]] Eigen::Vector3d knownOr(const std::string& name, const Eigen::Vector3d& estimate) const {
    const auto place = known_.find(name);
    return place != known_.end() && place->second.allFinite() ? place->second : estimate;
  }

  void checkFace() const {
    for (const RimPoint& rim : kRim) {
      if (!has(rim.outer))
        throw InputError(std::string("control surface: found no marker ") + rim.outer + "; expected all lip markers");
    }
    for (const CornerPoint& corner : kCorners) {
      if (!has(corner.outer))
        throw InputError(std::string("control surface: found no marker ") + corner.outer +
                         "; expected all lip markers");
    }
    for (std::size_t i = 0; i < rest_.size(); ++i) {
      if (!rest_[i].allFinite()) throw InputError("control surface: found no finite place for " + mesh_.points[i].name);
    }
    if (at("LIP_CORNER_L").x() <= at("LIP_CORNER_R").x() || at("LIP_UP_MID").y() <= at("LIP_LO_MID").y()) {
      throw InputError(
          "control surface: found lips upside down or left for right; expected Y up and X towards the subject's left");
    }
  }

  void addLipRims() {
    for (const RimPoint& rim : kRim) {
      const bool is_upper = sideOfLip(rim.name) == LipSide::kUpper;
      const double way = is_upper ? kLipsPartAt : 1 - kLipsPartAt;
      const std::string facing = std::string("LIP_") + (is_upper ? "LO" : "UP") + std::string(rim.outer).substr(6);
      const Eigen::Vector3d estimate = at(rim.outer) + way * (at(facing) - at(rim.outer));
      add({.name = rim.name,
           .rule = PointRule::kInnerLip,
           .side = sideOfLip(rim.name),
           .drivers = {{find(rim.outer), 1}, {find(rim.right), 0}, {find(rim.left), 0}}},
          knownOr(rim.name, estimate));
    }
    for (const RimPoint& rim : kRim) mesh_.points[unsignedIndex(find(rim.name))].opposite = find(rim.opposite);
    const Eigen::Vector3d across = at("LIP_CORNER_L") - at("LIP_CORNER_R");
    for (const CornerPoint& c : kCorners) {
      const double inward = c.outer == std::string("LIP_CORNER_R") ? kInnerCornerAt : -kInnerCornerAt;
      const Eigen::Vector3d corner = knownOr(c.name, at(c.outer) + inward * across);
      // The corner proper is a pit; a surface through its bottom would have a spike there. Its rim will do.
      const Eigen::Vector3d outer = at(c.outer);
      const Eigen::Vector3d past =
          0.5 * (knownOr(c.beside_upper, at(c.upper)) + knownOr(c.beside_lower, at(c.lower))) - outer;
      const double way = std::clamp((corner - outer).dot(past) / past.squaredNorm(), 0.2, 0.8);
      add({.name = c.name, .rule = PointRule::kFollow, .drivers = {{find(c.outer), 1}}}, outer + way * past);
    }
  }

  void addEyes() {
    for (const EyePoints& eye : kEyes) {
      if (!has(eye.outer) || !has(eye.up) || !has(eye.lo) || !has(eye.nose)) continue;
      const Eigen::Vector3d middle = 0.5 * (at(eye.up) + at(eye.lo));
      add({.name = eye.in, .rule = PointRule::kFollow, .drivers = {{find(eye.nose), 0.5}, {find(eye.outer), 0.5}}},
          knownOr(eye.in, middle + 0.9 * (middle - at(eye.outer))));
      const std::string end = std::string("_") + eye.side;
      addLid("LID_UP_OUT" + end, eye.up, eye.outer);
      addLid("LID_UP_IN" + end, eye.up, eye.in);
      addLid("LID_LO_OUT" + end, eye.lo, eye.outer);
      addLid("LID_LO_IN" + end, eye.lo, eye.in);
    }
  }

  void addLid(const std::string& name, const std::string& lid, const std::string& corner) {
    add({.name = name, .rule = PointRule::kFollow, .drivers = {{find(lid), kLidShare}, {find(corner), 1 - kLidShare}}},
        knownOr(name, 0.55 * at(lid) + 0.45 * at(corner) + 0.15 * (at(lid) - 0.5 * (at(lid) + at(corner)))));
  }

  void finishRest() {
    mesh_.rest.resize(signedIndex(rest_.size()), 3);
    for (std::size_t i = 0; i < rest_.size(); ++i) mesh_.rest.row(signedIndex(i)) = rest_[i].transpose();
  }

  /// The rims lie on one straight line in the plane, so that both have the same curve when they touch.
  void straightenSlit() {
    const Eigen::Vector2d from = mesh_.domain.row(find("RIM_CORNER_R"));
    const Eigen::Vector2d along = mesh_.domain.row(find("RIM_CORNER_L")).transpose() - from;
    const Eigen::Vector2d up = kSlitHalfWidth * Eigen::Vector2d(-along.y(), along.x());
    double last = 0;
    for (const char* end : {"OUT_R", "IN_R", "MID", "IN_L", "OUT_L"}) {
      const int upper = find(std::string("RIM_UP_") + end);
      const int lower = find(std::string("RIM_LO_") + end);
      const Eigen::Vector2d middle = 0.5 * (mesh_.domain.row(upper) + mesh_.domain.row(lower)).transpose();
      const double way = (middle - from).dot(along) / along.squaredNorm();
      if (!(way > last + 0.01 && way < 0.995)) {
        // Rims that are crowded at an end of the slit belong to markers beyond it.
        if (way < 0.1 || way > 0.9)
          throw InputError(
              fmt::format("control surface: found the slit between the lips to end before the outer lip "
                          "markers on the {}; expected lips that are apart from corner to corner",
                          way < 0.5 ? "right" : "left"));
        throw InputError("control surface: found lip markers out of order; expected them from right to left");
      }
      last = way;
      mesh_.domain.row(upper) = (from + way * along + up).transpose();
      mesh_.domain.row(lower) = (from + way * along - up).transpose();
    }
  }

  /// Fixed points outside the markers: motion fades to nothing on the way to them.
  void addRing() {
    const std::vector<int> hull = convexHull(mesh_.domain);
    const Eigen::Vector2d centre =
        0.5 * (mesh_.domain.colwise().maxCoeff() + mesh_.domain.colwise().minCoeff()).transpose();
    const auto inner = mesh_.rest.rows();
    mesh_.rest.conservativeResize(inner + kRingPoints, Eigen::NoChange);
    mesh_.domain.conservativeResize(inner + kRingPoints, Eigen::NoChange);
    for (int k = 0; k < kRingPoints; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 0.5) / kRingPoints;
      const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
      const auto [flat, solid] = hullPoint(hull, centre, direction);
      const double margin =
          cylinder_.radius *
          (kRingBeside + ((direction.y() < 0 ? kRingBelow : kRingAbove) - kRingBeside) * std::abs(direction.y()));
      const double theta = std::atan2(solid.x() - cylinder_.axis_x, solid.z() - cylinder_.axis_z);
      const Eigen::Vector3d outward(std::sin(theta), 0, std::cos(theta));
      const Eigen::Vector3d beside(std::cos(theta), 0, -std::sin(theta));
      // The head curves away from the outline: more above and below than at the sides.
      const double bend = (20 + 40 * std::abs(direction.y())) * std::numbers::pi / 180;
      const Eigen::Vector3d on = direction.x() * beside + direction.y() * Eigen::Vector3d::UnitY();
      mesh_.points.push_back(
          {.name = "RING_" + std::to_string(k), .rule = PointRule::kFollow, .drivers = {}, .fixed = true});
      mesh_.rest.row(inner + k) = (solid + margin * (std::cos(bend) * on - std::sin(bend) * outward)).transpose();
      mesh_.domain.row(inner + k) = (flat + margin * direction).transpose();
    }
  }

  void wantTriangles() {
    for (const std::array<std::string, 3>& names : plan_.triangles) {
      std::array<int, 3> triangle{};
      bool upper = false, lower = false;
      for (std::size_t k = 0; k < 3; ++k) {
        triangle[k] = find(names[k]);
        if (triangle[k] < 0) {
          throw InputError("control surface: found no point " + printable(names[k]) +
                           ", which a triangle of the layout names; expected a marker or a virtual point");
        }
        const LipSide side = mesh_.points[unsignedIndex(triangle[k])].side;
        upper |= side == LipSide::kUpper;
        lower |= side == LipSide::kLower;
      }
      if (upper && lower)
        throw InputError("control surface: found a triangle of the layout that joins the lips: " + names[0] + ", " +
                         names[1] + ", " + names[2]);
      mesh_.wanted_triangles.push_back(triangle);
    }
  }

  /// Where a ray from `centre` leaves the hull, in the plane and in space.
  [[nodiscard]] std::pair<Eigen::Vector2d, Eigen::Vector3d> hullPoint(const std::vector<int>& hull,
                                                                      const Eigen::Vector2d& centre,
                                                                      const Eigen::Vector2d& direction) const {
    for (std::size_t i = 0; i < hull.size(); ++i) {
      const int from = hull[i];
      const int to = hull[(i + 1) % hull.size()];
      const Eigen::Vector2d a = mesh_.domain.row(from).transpose() - centre;
      const Eigen::Vector2d b = mesh_.domain.row(to).transpose() - centre;
      const double side_a = direction.x() * a.y() - direction.y() * a.x();
      const double side_b = direction.x() * b.y() - direction.y() * b.x();
      if (side_a > 0 || side_b <= 0) continue;
      const double way = side_a / (side_a - side_b);
      return {centre + a + way * (b - a),
              (mesh_.rest.row(from) + way * (mesh_.rest.row(to) - mesh_.rest.row(from))).transpose()};
    }
    throw InputError("control surface: found markers on one line; expected them all over the face");
  }

  const std::map<std::string, Eigen::Vector3d>& known_;
  const SurfacePlan& plan_;
  ControlMesh mesh_;
  std::vector<Eigen::Vector3d> rest_;
  Cylinder cylinder_;
};

}  // namespace

ControlMesh placePoints(const std::vector<std::string>& marker_names, const MarkerPositions& marker_rest,
                        const std::map<std::string, Eigen::Vector3d>& known, const SurfacePlan& plan) {
  MOUTHPIECE_EXPECT(signedIndex(marker_names.size()) == marker_rest.rows());
  return Placer(marker_names, marker_rest, known, plan).place();
}

Eigen::Vector2d Cylinder::unrolled(const Eigen::Vector3d& p) const {
  return {radius * std::atan2(p.x() - axis_x, p.z() - axis_z), p.y()};
}

Cylinder cylinderOf(const ControlMesh& mesh) {
  const auto markers = mesh.rest.topRows(signedIndex(mesh.marker_count));
  Eigen::Index right = 0, left = 0;
  const double right_x = markers.col(0).minCoeff(&right);
  const double left_x = markers.col(0).maxCoeff(&left);
  Cylinder cylinder{0.5 * (left_x - right_x), 0.5 * (left_x + right_x), 0.5 * (markers(right, 2) + markers(left, 2))};
  // All markers stay well in front of the axis.
  cylinder.axis_z = std::min(cylinder.axis_z, markers.col(2).minCoeff() + 0.2 * cylinder.radius);
  return cylinder;
}

int findPoint(const ControlMesh& mesh, const std::string& name) {
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (mesh.points[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

std::vector<std::string> mouthRim() {
  return {"RIM_CORNER_R", "RIM_LO_OUT_R", "RIM_LO_IN_R", "RIM_LO_MID", "RIM_LO_IN_L", "RIM_LO_OUT_L",
          "RIM_CORNER_L", "RIM_UP_OUT_L", "RIM_UP_IN_L", "RIM_UP_MID", "RIM_UP_IN_R", "RIM_UP_OUT_R"};
}

std::vector<std::string> eyeRim(char side) {
  const std::string end = std::string("_") + side;
  return {"CANTHUS_OUT" + end, "LID_LO_OUT" + end, "LID_LO" + end, "LID_LO_IN" + end,
          "EYE_IN" + end,      "LID_UP_IN" + end,  "LID_UP" + end, "LID_UP_OUT" + end};
}

std::vector<std::string> outerLipLine() {
  return {"LIP_CORNER_R", "LIP_LO_OUT_R", "LIP_LO_IN_R", "LIP_LO_MID", "LIP_LO_IN_L", "LIP_LO_OUT_L",
          "LIP_CORNER_L", "LIP_UP_OUT_L", "LIP_UP_IN_L", "LIP_UP_MID", "LIP_UP_IN_R", "LIP_UP_OUT_R"};
}

const std::vector<VirtualPointPlace>& virtualPointPlaces() {
  static const std::vector<VirtualPointPlace> places = [] {
    std::vector<VirtualPointPlace> all;
    for (const RimPoint& rim : kRim) all.push_back({rim.name, rim.landmark});
    for (const CornerPoint& c : kCorners) {
      all.push_back({c.name, c.landmark});
      all.push_back({c.beside_upper, c.beside_upper_landmark});
      all.push_back({c.beside_lower, c.beside_lower_landmark});
    }
    for (const EyePoints& eye : kEyes) {
      const std::string end = std::string("_") + eye.side;
      all.push_back({eye.in, eye.in_landmark});
      all.push_back({"LID_UP_OUT" + end, eye.up_out});
      all.push_back({"LID_UP_IN" + end, eye.up_in});
      all.push_back({"LID_LO_OUT" + end, eye.lo_out});
      all.push_back({"LID_LO_IN" + end, eye.lo_in});
    }
    return all;
  }();
  return places;
}

}  // namespace mouthpiece
