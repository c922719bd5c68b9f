// Markers from a few anchors.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"
#include "retarget/placing/actor_places.h"
#include "retarget/placing/anchors.h"
#include "retarget/placing/even_head.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

/// How stiff the warp is against the skin's pull, in units of the mouth's width: tried from 0.1 to 60 on the ICT head,
/// where 1 to 10 place the markers alike.
constexpr double kStiffness = 6;
/// Of the mouth's width: nothing moves further in a round.
constexpr double kStill = 1e-4;
constexpr int kMostRounds = 40;
/// Cosine between a triangle's normal and the direction out of the head: less is the inside of lips and nostrils.
constexpr double kFacesOut = 0.15;
/// Of the mouth's width: clicks at the mouth are moved no further than this.
constexpr double kClickSlack = 0.15;
constexpr double kOutsideSlit = 0.03;  ///< how far outside the slit's end a corner of the mouth is clicked
constexpr double kLeastLip = 0.04;     ///< the red edge is no nearer to a lip's rim
constexpr double kLeastApart = 0.01;   ///< markers that are nearer have come to one place

struct Pair {
  std::string name;
  Vector3d actor, mesh;
};

/// Anchors that the actor has too.
std::vector<Pair> pairsOf(const FaceMesh& mesh, const Anchors& anchors, const std::string& file,
                          const ActorPlaces& actor) {
  std::vector<Pair> pairs;
  for (const auto& [name, place] : actor.places()) {
    if (const auto at = placeOf(anchors, name, mesh, file)) pairs.push_back({name, place, *at});
  }
  return pairs;
}

/// All markers, or at least those that are needed and kLeastAnchors.
void expectEnough(const std::vector<Pair>& pairs, const Anchors& anchors, const std::string& file,
                  const std::vector<std::string>& marker_names) {
  const auto lacks = [&](const std::string& name) { return !anchors.markers.contains(name); };
  if (pairs.size() >= 3 && std::none_of(marker_names.begin(), marker_names.end(), lacks)) return;
  std::vector<std::string> missing;
  std::copy_if(requiredAnchors().begin(), requiredAnchors().end(), std::back_inserter(missing), lacks);
  if (missing.empty() && pairs.size() >= kLeastAnchors) return;
  throw InputError(file, "markers",
                   fmt::format("has {} anchors; expected all {} markers, or at least {} with {} among them{}",
                               pairs.size(), marker_names.size(), kLeastAnchors, fmt::join(requiredAnchors(), ", "),
                               missing.empty() ? "" : fmt::format(" (missing: {})", fmt::join(missing, ", "))));
}

Similarity similarityOf(const std::vector<Pair>& pairs) {
  MarkerPositions from(signedIndex(pairs.size()), 3), to = from;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    from.row(signedIndex(i)) = pairs[i].actor.transpose();
    to.row(signedIndex(i)) = pairs[i].mesh.transpose();
  }
  return similarityBetween(from, to);
}

/// The outward skin of a head, and of each lip. Each vertex belongs to the lip whose middle is nearer along the mesh:
/// the slit between the lips is no way.
struct SkinSheet {
  TriangleTree tree;
  EvenHead::Profile profile;  ///< of an even head; else empty
};
struct Skin {
  SkinSheet all, upper, lower;
};

Skin skinOf(const FaceMesh& mesh, const HeadTopology& topology, const std::optional<EvenHead>& even,
            const Vector3d& mouth, double mouth_width) {
  const std::vector<double>&to_upper = topology.wayToUpperLip(), &to_lower = topology.wayToLowerLip();
  // Out of the head: away from an upright axis through its middle.
  const double axis_x = mouth.x(), axis_z = mouth.z() - 1.5 * mouth_width;
  std::vector<Triangle> all, upper, lower;
  for (const Triangle& corners : trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips})) {
    const Vector3d a = pointAt(mesh.vertices, corners[0]), ab = pointAt(mesh.vertices, corners[1]) - a;
    const Vector3d normal = ab.cross(pointAt(mesh.vertices, corners[2]) - a).normalized();
    const Vector3d out(a.x() - axis_x, 0, a.z() - axis_z);
    const bool is_high_or_low = std::abs(normal.y()) > 0.8;  // chin, brows: they face neither way
    if (!(normal.dot(out.normalized()) > (is_high_or_low ? -kFacesOut : kFacesOut))) continue;
    all.push_back(corners);
    const auto are_nearer = [&](const std::vector<double>& near, const std::vector<double>& far) {
      return std::all_of(corners.begin(), corners.end(), [&](auto corner) { return near[corner] < far[corner]; });
    };
    if (are_nearer(to_upper, to_lower)) upper.push_back(corners);
    if (are_nearer(to_lower, to_upper)) lower.push_back(corners);
  }
  const auto sheetOf = [&](const std::vector<Triangle>& triangles) {
    return SkinSheet{{mesh.vertices, triangles}, even ? even->profileOf(mesh, triangles) : EvenHead::Profile()};
  };
  return {sheetOf(all), sheetOf(upper), sheetOf(lower)};
}

const SkinSheet& sheetFor(const Skin& skin, const std::string& name) {
  if (name.starts_with("LIP_UP_") && !skin.upper.tree.empty()) return skin.upper;
  if (name.starts_with("LIP_LO_") && !skin.lower.tree.empty()) return skin.lower;
  return skin.all;
}

std::optional<Vector3d> closestSkin(const SkinSheet& sheet, const Vector3d& place) {
  const auto foot = sheet.tree.closest(place);
  return foot ? std::optional(foot->point) : std::nullopt;
}

/// The skin of an even head closest to the place that `right` and `left`, markers of the same kind on both sides, tell
/// of together: on the right; in the middle, where `right` is of such a marker, on the profile.
std::optional<Vector3d> evenSkin(const EvenHead& even, const SkinSheet& sheet, bool is_middle, const Vector3d& right,
                                 const Vector3d& left) {
  const Vector3d between = even.halfway(right, left);
  if (is_middle && !sheet.profile.empty()) return closestOn(sheet.profile, between);
  return closestSkin(sheet, between);
}

/// Ends of the names of the outer lip markers that stand in pairs, LIP_UP_ over LIP_LO_, and of the rims behind them.
constexpr std::array<const char*, 5> kLipPairEnds{"OUT_R", "IN_R", "MID", "IN_L", "OUT_L"};

bool hasRim(const Anchors& anchors, const std::string& end) {
  return anchors.markers.contains("RIM_UP_" + end) || anchors.markers.contains("RIM_LO_" + end);
}

/// Puts the clicked points of the mouth where the traced line says that they are: the corners on the skin just outside
/// the slit's ends, the lips' middles on their own lips. Clicks that lie far off are meant.
void settleMouth(const FaceMesh& mesh, const LipLine& line, const Skin& skin, double width, const std::string& file,
                 Anchors& anchors) {
  const auto settle = [&](const std::string& name, const SkinSheet& sheet, const Vector3d& place) {
    const auto clicked = placeOf(anchors, name, mesh, file);
    const auto foot = closestSkin(sheet, place);
    if (clicked && foot && (*foot - *clicked).norm() < kClickSlack * width) anchors.markers[name] = *foot;
  };
  const Vector3d across = (line.corner_left - line.corner_right).normalized();
  const auto settleCorner = [&](const std::string& name, const Vector3d& end, const Vector3d& outwards) {
    const Vector3d off = *placeOf(anchors, name, mesh, file) - end;
    const double out = off.dot(outwards) / width;
    const bool is_outside = out > 0.5 * kOutsideSlit && out < 2.5 * kOutsideSlit;
    if (is_outside && std::abs(off.y()) < kOutsideSlit * width) return;
    settle(name, skin.all, end + kOutsideSlit * width * outwards);
  };
  settleCorner("LIP_CORNER_R", line.corner_right, -across);
  settleCorner("LIP_CORNER_L", line.corner_left, across);
  for (const std::string name : {"LIP_UP_MID", "LIP_LO_MID"}) {
    const Vector3d clicked = *placeOf(anchors, name, mesh, file);
    const LipLine::Pair rims = line.at(clicked);
    const bool is_upper = name == "LIP_UP_MID";
    const Vector3d up = (is_upper ? 1 : -1) * Vector3d::UnitY();
    const Vector3d rim = is_upper ? rims.upper : rims.lower;
    if ((clicked - rim).dot(up) < kLeastLip * width) settle(name, sheetFor(skin, name), rim + kLeastLip * width * up);
  }
}

/// nullopt of a head that is not alike on both sides, or of an actor without eye corners to tell where to look.
std::optional<EvenHead> evenHeadOf(const FaceMesh& mesh, const Similarity& mesh_from_actor, const ActorPlaces& actor) {
  const auto end = actor.places().end();
  const auto eye_right = actor.places().find("CANTHUS_OUT_R"), eye_left = actor.places().find("CANTHUS_OUT_L"),
             mouth_right = actor.places().find("LIP_CORNER_R"), mouth_left = actor.places().find("LIP_CORNER_L");
  if (eye_right == end || eye_left == end || mouth_right == end || mouth_left == end) return std::nullopt;
  return EvenHead::of(mesh, {mesh_from_actor(eye_right->second), mesh_from_actor(eye_left->second),
                             mesh_from_actor(0.5 * (mouth_right->second + mouth_left->second))});
}

/// Evens out clicks on an even head: each is the mean of what was clicked on both sides. Clicks that lie far from the
/// other's mirror image are meant.
void evenClicks(const FaceMesh& mesh, const EvenHead& even, const Skin& skin, double width, const std::string& file,
                const ActorPlaces& actor, Anchors& anchors) {
  const Anchors clicked = anchors;
  for (const auto& [name, actors] : actor.places()) {
    const std::string other = otherSideOf(name);
    const auto here = placeOf(clicked, name, mesh, file), there = placeOf(clicked, other, mesh, file);
    if (!here || !there || (*here - even.mirrored(*there)).norm() > kClickSlack * width) continue;
    if (const auto place = evenSkin(even, sheetFor(skin, name), other == name, *here, *there))
      anchors.markers[name] = *place;
  }
}

/// Over a hollow the skin closest to two markers may be one place: they are put apart there as they lie before it
/// (`now`). `wanted`: places on the skin, anchors first; those stay.
void partFromEachOther(const Skin& skin, const std::vector<std::string>& unplaced, double width,
                       const MarkerPositions& now, MarkerPositions& wanted) {
  const Eigen::Index anchor_count = wanted.rows() - signedIndex(unplaced.size());
  const MarkerPositions met = wanted;
  for (Eigen::Index i = anchor_count; i < wanted.rows(); ++i) {
    for (Eigen::Index j = 0; j < wanted.rows(); ++j) {
      if (i == j || (met.row(i) - met.row(j)).norm() >= kLeastApart * width) continue;
      const Vector3d apart = (j < anchor_count ? 1 : 0.5) * (now.row(i) - now.row(j)).transpose();
      const Vector3d place = met.row(i).transpose() + apart;
      if (const auto foot = closestSkin(sheetFor(skin, unplaced[unsignedIndex(i - anchor_count)]), place))
        wanted.row(i) = foot->transpose();
    }
  }
}

/// The rims behind the outer lip markers and the corners, from the line between the lips.
void addLipRims(const FaceMesh& mesh, const LipLine& line, const std::string& file, Anchors& anchors) {
  std::map<std::string, LipLine::Pair> found;
  for (const std::string end : kLipPairEnds) {
    const auto above = placeOf(anchors, "LIP_UP_" + end, mesh, file);
    const auto below = placeOf(anchors, "LIP_LO_" + end, mesh, file);
    if (!above || !below) continue;
    found[end] = line.at(0.5 * (*above + *below));
    if (hasRim(anchors, end)) continue;
    anchors.markers["RIM_UP_" + end] = found[end].upper;
    anchors.markers["RIM_LO_" + end] = found[end].lower;
  }
  for (const std::string side : {"_R", "_L"}) {
    const auto out = found.find("OUT" + side);
    if (out == found.end() || anchors.markers.contains("RIM_CORNER" + side)) continue;
    const Vector3d corner = side == "_R" ? line.corner_right : line.corner_left;
    const LipLine::Pair near = line.at(0.5 * (corner + 0.5 * (out->second.upper + out->second.lower)));
    anchors.markers["RIM_CORNER" + side] = corner;
    anchors.markers["RIM_UP_NEAR" + side] = near.upper;
    anchors.markers["RIM_LO_NEAR" + side] = near.lower;
  }
}

}  // namespace

const std::vector<std::string>& requiredAnchors() {
  static const std::vector<std::string> names{"LIP_CORNER_R", "LIP_CORNER_L", "LIP_UP_MID", "LIP_LO_MID"};
  return names;
}

Similarity meshFromActor(const FaceMesh& mesh, const Anchors& anchors, const std::string& anchors_file,
                         const std::vector<std::string>& marker_names, const MarkerPositions& actor_neutral_mm) {
  const std::vector<Pair> pairs = pairsOf(mesh, anchors, anchors_file, ActorPlaces(marker_names, actor_neutral_mm));
  expectEnough(pairs, anchors, anchors_file, marker_names);
  return similarityOf(pairs);
}

bool leavesPlacesOpen(const Anchors& anchors, const std::vector<std::string>& marker_names) {
  return std::any_of(marker_names.begin(), marker_names.end(),
                     [&](const std::string& name) { return !anchors.markers.contains(name); }) ||
         std::any_of(kLipPairEnds.begin(), kLipPairEnds.end(), [&](const char* end) { return !hasRim(anchors, end); });
}

FaceOpenings openingsOf(const FaceMesh& mesh, const Anchors& anchors, const std::string& anchors_file) {
  const auto at = [&](const std::string& name) {
    const auto place = placeOf(anchors, name, mesh, anchors_file);
    if (!place) throw InputError(anchors_file, "markers", "is without " + name + "; expected the four of the mouth");
    return *place;
  };
  const Vector3d upper = at("LIP_UP_MID"), lower = at("LIP_LO_MID");
  FaceOpenings openings;
  openings.lip_line = {0.5 * (upper + lower)};
  openings.lips_reach = (at("LIP_CORNER_L") - at("LIP_CORNER_R")).norm();
  openings.sides[0] = {{upper}, {lower}};
  openings.mouth = MouthHints{at("LIP_CORNER_R"), at("LIP_CORNER_L"), upper, lower};
  for (const std::string end : kLipPairEnds) {
    for (const std::string lip : {"RIM_UP_", "RIM_LO_"}) {
      if (const auto rim = placeOf(anchors, lip + end, mesh, anchors_file)) openings.mouth->on_line.push_back(*rim);
    }
  }
  return openings;
}

PlacedAnchors placeMarkers(const FaceMesh& mesh, const HeadTopology& topology, const Anchors& given,
                           const std::string& anchors_file, const std::vector<std::string>& marker_names,
                           const MarkerPositions& actor_neutral_mm) {
  const ActorPlaces actor(marker_names, actor_neutral_mm);
  expectEnough(pairsOf(mesh, given, anchors_file, actor), given, anchors_file, marker_names);
  const FaceOpenings mouth = openingsOf(mesh, given, anchors_file);
  const double width = mouth.lips_reach;
  if (!topology.nearestSkin(mouth.lip_line[0]))
    throw InputError("found no skin in the mesh; expected a part of kind skin or lips");
  const std::optional<EvenHead> even = evenHeadOf(mesh, similarityOf(pairsOf(mesh, given, anchors_file, actor)), actor);
  const Skin skin = skinOf(mesh, topology, even, mouth.lip_line[0], width);
  const std::optional<LipLine>& line = topology.lipLine();
  Anchors anchors = given;
  std::vector<std::string> unplaced;
  for (const std::string& name : marker_names) {
    if (!anchors.markers.contains(name)) unplaced.push_back(name);
  }
  // Who gave all markers knows what he does.
  if (line && line->is_parted && !unplaced.empty()) settleMouth(mesh, *line, skin, width, anchors_file, anchors);
  if (even && !unplaced.empty()) evenClicks(mesh, *even, skin, width, anchors_file, actor, anchors);
  const std::vector<Pair> pairs = pairsOf(mesh, anchors, anchors_file, actor);
  const Similarity similarity = similarityOf(pairs);
  const Eigen::Index anchor_count = signedIndex(pairs.size());
  const Eigen::Index count = anchor_count + signedIndex(unplaced.size());
  MarkerPositions start(count, 3), wanted(count, 3);  // anchors first
  for (Eigen::Index i = 0; i < anchor_count; ++i) {
    start.row(i) = similarity(pairs[unsignedIndex(i)].actor).transpose();
    wanted.row(i) = pairs[unsignedIndex(i)].mesh.transpose();
  }
  for (std::size_t i = 0; i < unplaced.size(); ++i)
    start.row(anchor_count + signedIndex(i)) = similarity(actor.places().at(unplaced[i])).transpose();

  Eigen::VectorXd stiffness = Eigen::VectorXd::Constant(count, kStiffness * width);
  stiffness.head(anchor_count).setZero();
  const MarkerPositions anchors_start = start.topRows(anchor_count);
  const MarkerPositions anchors_move = wanted.topRows(anchor_count) - anchors_start;
  MarkerPositions now =
      start + SmoothedMoves(anchors_start, anchors_move, Eigen::VectorXd::Zero(anchor_count)).at(start);
  PlacedAnchors placing{anchors, pairs.size(), unplaced.size()};
  while (placing.rounds++ < kMostRounds) {
    for (Eigen::Index i = anchor_count; i < count; ++i) {
      const std::string& name = unplaced[unsignedIndex(i - anchor_count)];
      const Vector3d here = now.row(i).transpose();
      const auto other = std::find(unplaced.begin(), unplaced.end(), otherSideOf(name));
      const auto foot = even && other != unplaced.end()
                            ? evenSkin(*even, sheetFor(skin, name), *other == name, here,
                                       now.row(anchor_count + (other - unplaced.begin())).transpose())
                            : closestSkin(sheetFor(skin, name), here);
      if (!foot) throw InputError(anchors_file, "markers", "found no skin that faces outwards around the anchors");
      wanted.row(i) = foot->transpose();
    }
    const MarkerPositions next = start + SmoothedMoves(start, MarkerPositions(wanted - start), stiffness).at(start);
    placing.last_move = (next - now).rowwise().norm().maxCoeff();
    now = next;
    if (placing.last_move < kStill * width) break;
  }
  partFromEachOther(skin, unplaced, width, now, wanted);
  for (std::size_t i = 0; i < unplaced.size(); ++i)
    placing.anchors.markers[unplaced[i]] = Vector3d(wanted.row(anchor_count + signedIndex(i)).transpose());
  if (line) addLipRims(mesh, *line, anchors_file, placing.anchors);
  return placing;
}

}  // namespace mouthpiece
