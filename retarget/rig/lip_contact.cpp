// The lips of face_fit.h, measured on the mesh.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/virtual_points.h"
#include "retarget/rig/bared_teeth.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/lip_sights.h"
#include "retarget/rig/lip_surfaces.h"

namespace mouthpiece {
namespace {

// Lengths as shares of the mouth's width.
constexpr double kRegion = 0.25;          ///< the lips' surfaces reach this far from the line where they meet
constexpr double kInFront = 0.35;         ///< teeth and tongue that lips touch lie no further off than both
constexpr double kAtRims = 0.05;          ///< so near to that line what both lips have in common is their corner
constexpr double kLips = 0.12;            ///< and are looked at this far
constexpr double kBetweenCorners = 0.35;  ///< and this far to both sides: at the corners the lips are one
constexpr double kMostCuts = 64;          ///< points looked at on an edge
constexpr double kDeepest = 0.2;          ///< further behind a surface a point is elsewhere, not inside it
constexpr double kDeepInLip = 0.06;      ///< the same of a lip: where it is deeper in, other places are as deep as this
constexpr double kDoubtfulFrom = 0.005;  ///< what seems deeper in a lip is looked at twice
constexpr double kDeepInTongue = 0.06;   ///< and of the tongue, which is soft
constexpr double kStraight = 0.7;        ///< cosine to the normal of a way straight out of the tongue
constexpr std::size_t kColumns = LipContact::kColumns;
constexpr std::size_t kNoColumn = kColumns;
constexpr double kFacesIn = -0.2;  ///< how far a normal looks ahead: below it lies a lip's back, in teeth or not unseen
constexpr double kDeepSight = 0.18;  ///< behind the lips' fronts: what is deeper is seen, not the crease of thick lips

/// Chooses what is measured, once, on the mesh at rest.
class Chooser {
 public:
  Chooser(const FaceMesh& mesh, const ControlMesh& control, double step)
      : mesh_(mesh),
        topology_(mesh, openingsOf(control)),
        mouth_width_(control.mouth_width),
        step_(step * control.mouth_width),
        lips_(kLips * control.mouth_width) {
    const auto place = [&](const std::string& name) -> Eigen::Vector3d {
      const int point = findPoint(control, name);
      if (point < 0) throw InputError("found no point " + name + " on the control surface; expected a face's mouth");
      return control.rest.row(point).transpose();
    };
    for (const std::string& name : mouthRim()) rim_.push_back(place(name));
    from_ = place("LIP_CORNER_R");
    along_ = place("LIP_CORNER_L") - from_;
    for (std::size_t v = 0; v < mesh.vertexCount(); ++v) {
      const PartKind kind = topology_.kinds()[v];
      const bool may_be = isSkin(kind) || kind == PartKind::kMouthInside;
      const double off = may_be ? distanceToLine(vertex(v), rim_) : std::numeric_limits<double>::infinity();
      is_near_.push_back(off < kRegion * control.mouth_width);
      is_at_rims_.push_back(off < lips_);
    }
    const auto isFar = [&](const Triangle& t) {
      return std::none_of(t.begin(), t.end(), [&](std::uint32_t v) { return is_near_[v]; });
    };
    around_ = trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside});
    std::erase_if(around_, isFar);
    for (const Triangle& t : mesh.triangles) {
      if (isFar(t)) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [at, is_new] = ends_.insert(placesOf(t[k], t[(k + 1) % 3]));
        if (!is_new) ends_.erase(at);
      }
    }
  }

  /// The triangles of one lip: those off the other one's side. Large ones at the rims reach far from the mouth.
  [[nodiscard]] MeasuredLip lipOff(SideBit other) const {
    MeasuredLip lip;
    std::set<std::uint32_t> corners;
    for (const Triangle& triangle : around_) {
      const bool is_own = std::any_of(triangle.begin(), triangle.end(),
                                      [&](std::uint32_t v) { return (topology_.forbidden()[v] & other) != 0; });
      double lower = 0;
      for (const std::uint32_t v : triangle) lower += topology_.lowerShare(v) / 3;
      const bool is_near = std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t v) { return is_near_[v]; });
      const bool is_at_rims =
          std::any_of(triangle.begin(), triangle.end(), [&](std::uint32_t v) { return is_at_rims_[v]; });
      if (!(is_near || is_at_rims) || !is_own || (lower > 0.5) != (other == kUpperLip)) continue;
      lip.surface.triangles.push_back(triangle);
      if (is_near) lip.near.push_back(triangle);
      addPoints(triangle, corners, lip.points);
    }
    lip.surface.settle(mesh_.vertices);
    for (std::size_t t = 0; t < lip.surface.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = lip.surface.triangles[t][(k + 1) % 3], b = lip.surface.triangles[t][(k + 2) % 3];
        if (lip.surface.over[t][k] == LipSurface::kNone && ends_.contains(placesOf(a, b)))
          lip.surface.ends.emplace_back(a, b);
      }
    }
    return lip;
  }

  /// Where the lips of coarse heads are one further in than the mouth's corners, as shares of the way from the right
  /// corner to the left one.
  [[nodiscard]] std::pair<double, double> partedBetween(const MeasuredLip& upper, const MeasuredLip& lower) const {
    std::pair<double, double> between{0, 1};
    for (const auto& [v, triangles] : upper.surface.around) {
      if (!lower.surface.around.contains(v) || distanceToLine(vertex(v), rim_) > kAtRims * mouth_width_) continue;
      const double way = (vertex(v) - from_).dot(along_) / along_.squaredNorm();
      if (way < 0.5)
        between.first = std::max(between.first, way);
      else
        between.second = std::min(between.second, way);
    }
    return between;
  }

  /// A lip's skin that one sees from the front, were there nothing before it.
  [[nodiscard]] std::vector<Triangle> outsideOf(const MeasuredLip& lip) const {
    std::vector<Triangle> outside = lip.surface.triangles;
    std::erase_if(outside, [&](const Triangle& t) {
      return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return topology_.isInMouth(v); });
    });
    return outside;
  }

  /// The right corner of the mouth, and the way to the left one.
  [[nodiscard]] std::pair<Eigen::Vector3d, Eigen::Vector3d> corners() const { return {from_, along_}; }

  /// All that may lie before what one sees between the lips: large triangles reach far from them.
  [[nodiscard]] const std::vector<Triangle>& aroundLips() const { return around_; }

  /// Of teeth or a tongue those that lips can come to.
  [[nodiscard]] std::vector<Triangle> nearLips(std::vector<Triangle> triangles) const {
    const double reach = kRegion * mouth_width_ + kInFront * mouth_width_;
    std::erase_if(triangles, [&](const Triangle& t) { return distanceToLine(vertex(t[0]), rim_) > reach; });
    return triangles;
  }

 private:
  [[nodiscard]] Eigen::Vector3d vertex(std::size_t v) const { return pointAt(mesh_.vertices, v); }

  /// An edge by where its ends lie: vertices of a texture's seam lie twice in one place.
  using EdgePlaces = std::array<std::array<float, 3>, 2>;
  [[nodiscard]] EdgePlaces placesOf(std::uint32_t a, std::uint32_t b) const {
    const auto at = [&](std::uint32_t v) -> std::array<float, 3> {
      return {mesh_.vertices(v, 0), mesh_.vertices(v, 1), mesh_.vertices(v, 2)};
    };
    EdgePlaces places{at(a), at(b)};
    if (places[1] < places[0]) std::swap(places[0], places[1]);
    return places;
  }

  /// A regular net; corners that triangles share count once, and most edges. `taken`: corners that are there.
  void addPoints(const Triangle& triangle, std::set<std::uint32_t>& taken, std::vector<LipPoint>& points) const {
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, (vertex(triangle[k]) - vertex(triangle[(k + 1) % 3])).norm());
    const int cuts = static_cast<int>(std::clamp(std::ceil(longest / step_), 1.0, kMostCuts));
    for (int i = 0; i < cuts; ++i) {
      for (int j = 0; i + j < cuts; ++j) {
        if (i + j == 0 && !taken.insert(triangle[0]).second) continue;
        LipPoint point{triangle, Eigen::Vector3d(cuts - i - j, i, j) / cuts, kNoColumn};
        const Eigen::Vector3d p = placeOf(point, mesh_.vertices);
        if (distanceToLine(p, rim_) > lips_) continue;
        const double way = (p - from_).dot(along_) / along_.squaredNorm();
        if (std::abs(way - 0.5) > kBetweenCorners) continue;
        const double column = (way - 0.25) / 0.5 * asReal(kColumns);
        if (column >= 0 && column < asReal(kColumns)) point.column = unsignedIndex(wholePart(column));
        point.way = way;
        point.across = unsignedIndex(wholePart(std::clamp(way, 0.0, 0.999) * asReal(kLipColumns)));
        points.push_back(point);
      }
    }
  }

  const FaceMesh& mesh_;
  HeadTopology topology_;
  double mouth_width_, step_, lips_;
  std::vector<Eigen::Vector3d> rim_;
  Eigen::Vector3d from_, along_;
  std::vector<bool> is_near_, is_at_rims_;
  std::vector<Triangle> around_;  ///< skin and the mouth's inside near the lips
  std::set<EdgePlaces> ends_;     ///< edges near the lips that have one triangle
};

}  // namespace

struct LipContactMeter::Data {
  Eigen::Vector3d from, along;  ///< the mouth's right corner, and the way to the left one
  double deepest = 0, deep_in_lip = 0, deep_in_tongue = 0, doubtful_from = 0;
  MeasuredLip upper, lower;
  std::vector<Triangle> around;
  std::pair<double, double> parted{0, 1};  ///< of Chooser::partedBetween
  std::array<bool, kColumns> are_one{};    ///< nothing parts in the half of it or more
  LipSurface teeth, tongue;
  BaredTeeth upper_teeth, lower_teeth;
};

LipContactMeter::LipContactMeter(const FaceMesh& mesh, const ControlMesh& control, double step) {
  const Chooser chooser(mesh, control, step);
  auto data = std::make_unique<Data>();
  std::tie(data->from, data->along) = chooser.corners();
  data->deepest = kDeepest * control.mouth_width;
  data->deep_in_lip = kDeepInLip * control.mouth_width;
  data->doubtful_from = kDoubtfulFrom * control.mouth_width;
  data->deep_in_tongue = kDeepInTongue * control.mouth_width;
  data->upper = chooser.lipOff(kLowerLip);
  data->lower = chooser.lipOff(kUpperLip);
  data->parted = chooser.partedBetween(data->upper, data->lower);
  const auto [first, last] = data->parted;
  for (std::size_t c = 0; c < kColumns; ++c) {
    // In a sliver of a column beside a corner there need be no place where lips touch.
    const double middle = 0.25 + 0.5 * (asReal(c) + 0.5) / asReal(kColumns);
    data->are_one[c] = middle <= first || middle >= last;
  }
  data->around = chooser.aroundLips();
  data->teeth.triangles = chooser.nearLips(trianglesOf(mesh, {PartKind::kUpperTeeth, PartKind::kLowerTeeth}));
  data->teeth.settle(mesh.vertices);
  const auto bared = [&](const MeasuredLip& lip, PartKind teeth) {
    return BaredTeeth(mesh.vertices, chooser.outsideOf(lip), chooser.nearLips(trianglesOf(mesh, {teeth})),
                      data->deepest);
  };
  data->upper_teeth = bared(data->upper, PartKind::kUpperTeeth);
  data->lower_teeth = bared(data->lower, PartKind::kLowerTeeth);
  data->tongue.triangles = chooser.nearLips(trianglesOf(mesh, {PartKind::kTongue}));
  data->tongue.settle(mesh.vertices);
  data_ = std::move(data);
}

LipContactMeter::LipContactMeter(LipContactMeter&&) noexcept = default;
LipContactMeter::~LipContactMeter() = default;

LipContact LipContactMeter::measure(const VertexPositions& vertices, double widest) const {
  PosedLipSurface upper(data_->upper.surface, vertices), lower(data_->lower.surface, vertices),
      teeth(data_->teeth, vertices), tongue(data_->tongue, vertices);
  LipContact contact;
  std::array<double, kColumns>& gaps = contact.gaps;
  for (std::size_t c = 0; c < kColumns; ++c) gaps[c] = data_->are_one[c] ? 0 : widest;
  // Of a triangle's points most can be told by what was found at the first: no distance changes faster than the place.
  struct Known {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    double distance = 0;
    [[nodiscard]] double least(const Eigen::Vector3d& p) const { return distance - (p - at).norm(); }
  };
  const auto look = [&](const MeasuredLip& own, PosedLipSurface& other) {
    const LipFacing facing(own.surface, vertices);
    std::optional<Triangle> triangle;
    Known to_lip, to_teeth, to_tongue;
    for (const LipPoint& point : own.points) {
      if (triangle != point.triangle) to_lip = to_teeth = to_tongue = {};
      triangle = point.triangle;
      const Eigen::Vector3d p = placeOf(point, vertices);
      // What is neither nearer than `enough` nor less deep inside than `deep` is not asked for.
      const auto isSeen = [&](PosedLipSurface& surface, double enough, double deep, double cosine, Known& known) {
        if (known.least(p) > enough) return std::optional<double>();
        const double within = std::max(enough, deep);
        const auto distance = surface.signedDistance(p, point.triangle, facing.at(point), within, cosine);
        // Where lips are one, as at their corners, which reach far on coarse heads, they do not meet.
        const bool is_one = distance && std::isnan(*distance);
        known = {p, is_one ? 0 : distance.value_or(within)};
        return distance && *distance > -deep ? distance : std::nullopt;
      };
      const double gap_here = point.column == kNoColumn ? 0.0 : std::max(0.0, gaps[point.column]);
      double& overlap = contact.overlaps[point.across];
      // Beyond the mesh's own corners the lips are one surface, whose folds are none of one lip in the other.
      const bool are_two = point.way >= data_->parted.first && point.way <= data_->parted.second;
      if (const auto gap = are_two ? isSeen(other, gap_here, data_->deep_in_lip, 0, to_lip) : std::nullopt) {
        const double depth = -*gap;
        const bool is_seen = facing.at(point).z() >= kFacesIn;
        const double deep = is_seen && depth > 0 ? other.depthOfLast(depth) : 0;
        contact.seeming_overlap = std::max(contact.seeming_overlap, deep);
        if (depth <= std::max(overlap, data_->doubtful_from) || other.surrounds(p)) {
          overlap = std::max(overlap, deep);
          if (point.column != kNoColumn) gaps[point.column] = std::min(gaps[point.column], *gap);
        }
      }
      if (const auto gap = isSeen(tongue, 0, data_->deep_in_tongue, kStraight, to_tongue))
        contact.in_tongue = std::max(contact.in_tongue, -*gap);
      if (facing.at(point).z() < kFacesIn) continue;
      if (const auto gap = isSeen(teeth, 0, data_->deepest, 0, to_teeth))
        contact.in_teeth = std::max(contact.in_teeth, -*gap);
    }
  };
  look(data_->lower, upper);
  look(data_->upper, lower);
  contact.in_teeth =
      std::max({contact.in_teeth, data_->upper_teeth.measure(vertices), data_->lower_teeth.measure(vertices)});
  contact.gap = *std::max_element(gaps.begin(), gaps.end());
  contact.overlap = *std::max_element(contact.overlaps.begin(), contact.overlaps.end());
  if (std::isfinite(widest)) return contact;
  const LipSights sights(vertices, data_->from, data_->along);
  const std::array<double, LipSights::kSections> slits = sights.slits(
      sights.fronts(data_->upper), sights.fronts(data_->lower), kDeepSight * data_->along.norm(), data_->around);
  for (std::size_t s = 0; s < LipSights::kSections; ++s) {
    const double way = LipSights::kFrom + (1 - 2 * LipSights::kFrom) * (asReal(s) + 0.5) / asReal(LipSights::kSections);
    const double column = std::clamp((way - 0.25) / 0.5 * asReal(kColumns), 0.0, asReal(kColumns) - 0.5);
    double& tallest = contact.slits[unsignedIndex(wholePart(column))];
    tallest = std::max(tallest, slits[s]);
  }
  return contact;
}

}  // namespace mouthpiece
