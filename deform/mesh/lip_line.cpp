#include "deform/mesh/lip_line.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <unordered_map>

namespace mouthpiece {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Lengths as shares of the mouth's width.
constexpr double kRegion = 1.6;         ///< triangles further from the mouth's middle are not looked at
constexpr double kStep = 0.012;         ///< between the places of an outline that are tried as rims
constexpr double kOutline = 1.0;        ///< an outline is followed this far
constexpr double kBeyondRed = 0.08;     ///< outlines start this far above and below the hints
constexpr double kAhead = 0.06;         ///< which way an outline leads is told by where it is so far on
constexpr double kPocket = 0.12;        ///< a mouth's pocket is longer than it is wide by so much in the middle
constexpr double kLeastPocket = 0.02;   ///< and by so much at its corners
constexpr double kLeastDeep = 0.5;      ///< of its own opening: less is a crease
constexpr double kWidest = 0.9;         ///< lips are not further apart
constexpr double kBesideLine = 0.06;    ///< places known to be on the line tell this far to both sides
constexpr double kRimDepth = 0.03;      ///< what is no further behind a rim is still part of it
constexpr double kClearSide = 0.4;      ///< of the skin's way beside a corner, on either side of it
constexpr double kColumn = 0.02;        ///< between two sections
constexpr double kBeyondCorner = 0.24;  ///< sections are tried this far beyond the clicked corners
constexpr double kCornerEnd = 0.001;    ///< how exactly the corners are found

/// What a millimetre further back costs, in millimetres of gap between the rims.
constexpr double kBehind = 0.4;
/// What a millimetre above or below the hints' middle costs a crease, in millimetres of its depth.
constexpr double kCreaseAside = 0.1;
/// What a millimetre away from the neighbouring section's rims costs, or from places known to be on the line.
constexpr double kAside = 0.3;
constexpr double kOffLine = 2;
/// Sections are cut beside round numbers, where symmetric meshes have whole rows of vertices.
constexpr double kOffMiddle = 1.234e-5;
/// Lips are one surface where fewer of the sections between the clicked corners show two.
constexpr double kLeastParted = 0.4;

/// A place on an outline: depth and height in the section's plane, and the edge that the plane cuts there.
struct OutlinePoint {
  Vector2d at;
  std::uint32_t a = 0, b = 0;
  double way = 0;  ///< along the outline from its start
};

/// One lip's outline in a section.
struct Outline {
  std::vector<OutlinePoint> points;
  std::vector<double> joins;     ///< ways at which two edges of the mesh lie in one place without being one
  std::optional<double> joined;  ///< the way at which it reaches the other outline's start
};

struct Rims {
  Vector2d upper, lower;
  double upper_way = 0, lower_way = 0;
};

struct Section {
  double way = 0;  ///< across the mouth: 0 at the right corner, 1 at the left one
  Rims rims;
  Vector2d crease = Vector2d::Zero();  ///< where the lips seem to meet, where they are one
  bool is_parted = false, has_crease = false;
  Outline upper, lower;
};

class Tracer {
 public:
  Tracer(const VertexPositions& vertices, std::span<const Triangle> triangles, const MouthHints& hints)
      : vertices_(vertices), hints_(hints), origin_(hints.corner_right) {
    across_ = hints.corner_left - hints.corner_right;
    width_ = across_.norm();
    across_ /= width_;
    up_ = hints.upper - hints.lower;
    up_ -= up_.dot(across_) * across_;
    // Clicks on lips that are thin tell less of where is up than the head itself.
    up_ = (up_ / width_ + 0.2 * (Vector3d::UnitY() - across_.y() * across_)).normalized();
    forward_ = across_.cross(up_);
    takeRegion(triangles);
  }

  [[nodiscard]] bool isMouth() const {
    return width_ > 0 && std::isfinite(width_) && across_.allFinite() && forward_.allFinite() && forward_.z() > 0.2 &&
           !region_.empty();
  }

  std::optional<LipLine> trace() {
    std::vector<Section> sections = cutAll();
    const auto middle = middleSection(sections);
    if (!middle) return welded(sections);
    grow(sections, *middle);
    std::size_t first = *middle, last = *middle;
    while (first > 0 && sections[first - 1].is_parted) --first;
    while (last + 1 < sections.size() && sections[last + 1].is_parted) ++last;
    if (sections[last].way - sections[first].way < kLeastParted) return welded(sections);
    smooth(sections, first, last);
    LipLine line = lineOf(sections, first, last);
    line.corner_right = cornerBeyond(sections[first], first > 0 ? sections[first - 1].way : sections[first].way);
    line.corner_left =
        cornerBeyond(sections[last], last + 1 < sections.size() ? sections[last + 1].way : sections[last].way);
    return line;
  }

 private:
  struct Cut {
    std::uint32_t low, high;  ///< places of the edge's ends
    bool operator==(const Cut& other) const = default;
  };
  struct CutHash {
    std::size_t operator()(const Cut& cut) const {
      return std::hash<std::uint64_t>()((std::uint64_t{cut.low} << 32U) ^ (cut.high * 0x9e3779b9U));
    }
  };
  /// A plane's cuts through edges and triangles.
  struct Plane {
    struct Node {
      Vector2d at;
      std::vector<std::uint32_t> pieces;
    };
    struct Piece {
      std::uint32_t triangle;
      std::array<std::uint32_t, 2> nodes;
      std::array<std::array<std::uint32_t, 2>, 2> edges;  ///< vertices of the edges cut
    };
    std::vector<Node> nodes;
    std::vector<Piece> pieces;
  };

  void takeRegion(std::span<const Triangle> triangles) {
    const Vector3d middle = 0.5 * (hints_.corner_right + hints_.corner_left);
    std::map<std::array<float, 3>, std::uint32_t> first_at;
    for (const Triangle& triangle : triangles) {
      const Vector3d p = pointAt(vertices_, triangle[0]);
      if (!((p - middle).norm() < kRegion * width_)) continue;
      region_.push_back(triangle);
      for (const std::uint32_t v : triangle) {
        if (place_.contains(v)) continue;
        const auto found = first_at.try_emplace({vertices_(v, 0), vertices_(v, 1), vertices_(v, 2)}, v).first;
        place_[v] = found->second;
        way_[found->second] = (pointAt(vertices_, v) - origin_).dot(across_) / width_;
      }
    }
    places_.reserve(region_.size());
    ways_.reserve(region_.size());
    for (const Triangle& triangle : region_) {
      auto& places = places_.emplace_back();
      auto& ways = ways_.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        places[k] = place_.at(triangle[k]);
        ways[k] = way_.at(places[k]);
      }
    }
  }

  [[nodiscard]] Vector2d inSection(const Vector3d& p) const {
    return {(p - origin_).dot(forward_) / width_, (p - origin_).dot(up_) / width_};
  }
  [[nodiscard]] Vector3d inSpace(double way, const Vector2d& p) const {
    return origin_ + width_ * (way * across_ + p.x() * forward_ + p.y() * up_);
  }

  [[nodiscard]] Plane cut(double way) const {
    Plane plane;
    std::unordered_map<Cut, std::uint32_t, CutHash> number;
    for (std::uint32_t t = 0; t < region_.size(); ++t) {
      const std::array<double, 3>& ways = ways_[t];
      const bool above[3] = {ways[0] >= way, ways[1] >= way, ways[2] >= way};
      if (above[0] == above[1] && above[1] == above[2]) continue;
      Plane::Piece piece{t, {}, {}};
      std::size_t count = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = (k + 1) % 3;
        if (above[k] == above[next]) continue;
        std::uint32_t low = places_[t][k], high = places_[t][next];
        piece.edges[count] = {region_[t][k], region_[t][next]};
        if (low > high) std::swap(low, high);
        const auto [at, is_new] = number.try_emplace({low, high}, static_cast<std::uint32_t>(plane.nodes.size()));
        if (is_new) {
          const double a = way_.at(low), b = way_.at(high);
          const Vector3d from = pointAt(vertices_, low), to = pointAt(vertices_, high);
          plane.nodes.push_back({inSection(from + (way - a) / (b - a) * (to - from)), {}});
        }
        plane.nodes[at->second].pieces.push_back(static_cast<std::uint32_t>(plane.pieces.size()));
        piece.nodes[count++] = at->second;
      }
      plane.pieces.push_back(piece);
    }
    return plane;
  }

  /// The foremost piece at a height, near a depth.
  [[nodiscard]] static std::optional<std::uint32_t> frontAt(const Plane& plane, const Vector2d& near) {
    std::optional<std::uint32_t> front;
    double most = near.x() - 0.5, limit = near.x() + 0.5;
    for (std::uint32_t i = 0; i < plane.pieces.size(); ++i) {
      const Vector2d &a = plane.nodes[plane.pieces[i].nodes[0]].at, &b = plane.nodes[plane.pieces[i].nodes[1]].at;
      if ((a.y() >= near.y()) == (b.y() >= near.y())) continue;
      const double depth = a.x() + (near.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      if (depth <= most || depth > limit) continue;
      most = depth;
      front = i;
    }
    return front;
  }

  /// The piece beyond a node; `joins`: no edge of the mesh joins the two.
  [[nodiscard]] std::optional<std::uint32_t> beyond(const Plane& plane, std::uint32_t from, std::size_t end,
                                                    bool& joins) const {
    const Plane::Piece& piece = plane.pieces[from];
    const std::array<std::uint32_t, 2>& edge = piece.edges[end];
    std::optional<std::uint32_t> touching;
    for (const std::uint32_t other : plane.nodes[piece.nodes[end]].pieces) {
      if (other == from) continue;
      const Plane::Piece& next = plane.pieces[other];
      const std::size_t its_end = next.nodes[0] == piece.nodes[end] ? 0 : 1;
      const std::array<std::uint32_t, 2>& its_edge = next.edges[its_end];
      if (std::minmax(edge[0], edge[1]) == std::minmax(its_edge[0], its_edge[1])) {
        joins = false;
        return other;
      }
      // Two triangles on one side of an edge are no surface.
      if (place_.at(edge[0]) == place_.at(its_edge[1])) touching = other;
    }
    joins = touching.has_value();
    return touching;
  }

  /// From the middle of a piece over its node `end`; until the surface ends, `goal` is reached or far enough.
  [[nodiscard]] Outline follow(const Plane& plane, std::uint32_t start, std::size_t end,
                               std::optional<std::uint32_t> goal, double longest) const {
    Outline outline;
    const auto& first = plane.pieces[start];
    const Vector2d from = 0.5 * (plane.nodes[first.nodes[0]].at + plane.nodes[first.nodes[1]].at);
    outline.points.push_back({from, first.edges[1 - end][0], first.edges[1 - end][1], 0});
    std::uint32_t piece = start;
    while (true) {
      const Plane::Node& node = plane.nodes[plane.pieces[piece].nodes[end]];
      const double way = outline.points.back().way + (node.at - outline.points.back().at).norm();
      const auto& edge = plane.pieces[piece].edges[end];
      outline.points.push_back({node.at, edge[0], edge[1], way});
      if (way > longest || outline.points.size() > plane.pieces.size() + 2) break;
      bool joins = false;
      const auto next = beyond(plane, piece, end, joins);
      if (!next || *next == start) break;
      if (joins) outline.joins.push_back(way);
      end = plane.pieces[*next].nodes[0] == plane.pieces[piece].nodes[end] ? 1 : 0;
      piece = *next;
      if (goal && piece == *goal) {
        outline.joined = way;
        break;
      }
    }
    return outline;
  }

  /// The way of the two that a piece offers which is lower (`sign` -1) or higher (1) a little further on.
  [[nodiscard]] Outline followTowards(const Plane& plane, std::uint32_t start, double sign,
                                      std::optional<std::uint32_t> goal, double longest) const {
    const auto heightAhead = [&](std::size_t end) {
      const Outline ahead = follow(plane, start, end, goal, kAhead);
      return ahead.points.back().at.y();
    };
    const std::size_t end = sign * heightAhead(0) > sign * heightAhead(1) ? 0 : 1;
    return follow(plane, start, end, goal, longest);
  }

  /// Points at steps along an outline.
  static void resample(Outline& outline) {
    std::vector<OutlinePoint> even;
    for (std::size_t i = 0; i + 1 < outline.points.size(); ++i) {
      const OutlinePoint &from = outline.points[i], &to = outline.points[i + 1];
      if (from.way > kOutline) break;
      even.push_back(from);
      const int cuts = static_cast<int>(std::min(64.0, std::floor((to.way - from.way) / kStep)));
      for (int k = 1; k <= cuts; ++k) {
        const double share = k / (cuts + 1.0);
        even.push_back({from.at + share * (to.at - from.at), from.a, from.b, from.way + share * (to.way - from.way)});
      }
    }
    if (outline.points.back().way <= kOutline + kStep) even.push_back(outline.points.back());
    outline.points = std::move(even);
  }

  /// Where the mouth should be in a section: a bow through the corners and between the lips.
  [[nodiscard]] std::pair<Vector2d, double> expected(double way) const {
    const Vector2d left = inSection(hints_.corner_left);
    const Vector2d middle = 0.5 * (inSection(hints_.upper) + inSection(hints_.lower));
    const double inside = std::clamp(way, 0.0, 1.0), bow = 4 * inside * (1 - inside);
    const double half = 0.5 * (inSection(hints_.upper) - inSection(hints_.lower)).norm();
    return {way * left + bow * (middle - 0.5 * left), half * (0.3 + 0.7 * bow)};
  }

  [[nodiscard]] Section section(double way) const {
    Section section;
    section.way = way;
    const Plane plane = cut(way + kOffMiddle);
    const auto [middle, half] = expected(way);
    const auto above = frontAt(plane, middle + Vector2d(0, half + kBeyondRed));
    const auto below = frontAt(plane, middle - Vector2d(0, half + kBeyondRed));
    if (!above || !below || *above == *below) return section;
    section.upper = followTowards(plane, *above, -1, below, 6 * kOutline);
    section.lower = followTowards(plane, *below, 1, above, 6 * kOutline);
    // A way that leads to the other start only one way round is one way all the same.
    if (section.upper.joined.has_value() != section.lower.joined.has_value()) {
      const double joined = section.upper.joined.value_or(section.lower.joined.value_or(0));
      section.upper.joined = section.lower.joined = joined;
    }
    const double end = section.upper.joined.value_or(0);
    resample(section.upper);
    resample(section.lower);
    if (end > 0) findCrease(section, middle.y());
    return section;
  }

  /// The place of an outline that lies deepest between what is a little above and a little below it.
  static void findCrease(Section& section, double middle) {
    double most = -std::numeric_limits<double>::infinity();
    const std::vector<OutlinePoint>& points = section.upper.points;
    const double end = section.upper.joined.value_or(0.5);
    const auto at = [&](double way) {
      const auto next = std::upper_bound(points.begin(), points.end(), way,
                                         [](double w, const OutlinePoint& point) { return w < point.way; });
      return next == points.end() ? points.back().at : next->at;
    };
    for (const OutlinePoint& point : points) {
      if (point.way < kAhead || point.way > end - kAhead) continue;
      const double hollow = 0.5 * (at(point.way - kAhead).x() + at(point.way + kAhead).x()) - point.at.x() -
                            kCreaseAside * std::abs(point.at.y() - middle);
      if (hollow <= most) continue;
      most = hollow;
      section.crease = point.at;
      section.has_crease = true;
    }
  }

  /// Of all pairs of places on both outlines the best that has a pocket behind it.
  [[nodiscard]] std::optional<Rims> bestRims(const Section& section, double pocket, const Rims* beside) const {
    std::optional<Rims> best;
    double least = std::numeric_limits<double>::infinity();
    std::optional<Vector2d> known = knownAt(section.way);
    for (const OutlinePoint& u : section.upper.points) {
      for (const OutlinePoint& l : section.lower.points) {
        const double gap = (u.at - l.at).norm();
        double cost = gap - kBehind * 0.5 * (u.at.x() + l.at.x());
        if (cost >= least || gap > kWidest) continue;
        if (section.upper.joined) {
          const double behind = *section.upper.joined - u.way - l.way - gap;
          if (behind < std::max(pocket, kLeastDeep * gap) && !isAtJoin(section, u, l, gap)) continue;
        }
        if (beside != nullptr) cost += kAside * ((u.at - beside->upper).norm() + (l.at - beside->lower).norm());
        if (known) cost += kOffLine * (0.5 * (u.at + l.at) - *known).norm();
        if (cost >= least) continue;
        least = cost;
        best = Rims{u.at, l.at, u.way, l.way};
      }
    }
    return best;
  }

  /// Whether two lips in one place, each with edges of its own, meet there.
  [[nodiscard]] static bool isAtJoin(const Section& section, const OutlinePoint& u, const OutlinePoint& l, double gap) {
    if (gap > kStep) return false;
    const auto isNear = [](const std::vector<double>& joins, double way) {
      return std::any_of(joins.begin(), joins.end(), [way](double join) { return std::abs(join - way) < 1e-9; });
    };
    return isNear(section.upper.joins, u.way) && isNear(section.lower.joins, l.way);
  }

  [[nodiscard]] std::optional<Vector2d> knownAt(double way) const {
    Vector2d sum = Vector2d::Zero();
    double weights = 0;
    for (const Vector3d& place : hints_.on_line) {
      const double off = std::abs((place - origin_).dot(across_) / width_ - way) / kBesideLine;
      if (off >= 1) continue;
      sum += (1 - off) * inSection(place);
      weights += 1 - off;
    }
    if (weights <= 0) return std::nullopt;
    return Vector2d(sum / weights);
  }

  [[nodiscard]] std::vector<Section> cutAll() const {
    std::vector<Section> sections;
    const int columns = static_cast<int>(std::lround((1 + 2 * kBeyondCorner) / kColumn));
    for (int i = 0; i <= columns; ++i) sections.push_back(section(-kBeyondCorner + i * kColumn));
    return sections;
  }

  /// The section nearest to the middle that shows two lips.
  std::optional<std::size_t> middleSection(std::vector<Section>& sections) const {
    std::vector<std::size_t> order(sections.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return std::abs(sections[a].way - 0.5) < std::abs(sections[b].way - 0.5);
    });
    for (const std::size_t i : order) {
      if (std::abs(sections[i].way - 0.5) > 0.25) break;
      const auto rims = bestRims(sections[i], kPocket, nullptr);
      if (!rims) continue;
      sections[i].rims = *rims;
      sections[i].is_parted = true;
      return i;
    }
    return std::nullopt;
  }

  /// From the middle to both sides; a section or two without lips are leapt over.
  void grow(std::vector<Section>& sections, std::size_t middle) const {
    for (const int step : {-1, 1}) {
      std::size_t last = middle;
      const auto count = static_cast<std::ptrdiff_t>(sections.size());
      for (auto i = static_cast<std::ptrdiff_t>(middle) + step; i >= 0 && i < count; i += step) {
        Section& here = sections[static_cast<std::size_t>(i)];
        const auto rims = bestRims(here, kLeastPocket, &sections[last].rims);
        if (!rims || !follows(*rims, sections[last].rims, std::abs(here.way - sections[last].way))) {
          if (std::abs(here.way - sections[last].way) > 2.5 * kColumn) break;
          continue;
        }
        here.rims = *rims;
        here.is_parted = true;
        for (std::size_t skipped = last; skipped != static_cast<std::size_t>(i);
             skipped = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(skipped) + step)) {
          if (sections[skipped].is_parted) continue;
          sections[skipped].rims = here.rims;
          sections[skipped].is_parted = true;
        }
        last = static_cast<std::size_t>(i);
      }
    }
  }

  /// Rims do not leap from section to section.
  static bool follows(const Rims& rims, const Rims& beside, double apart) {
    const double most = 0.04 + 3 * apart;
    return (rims.upper - beside.upper).norm() < most && (rims.lower - beside.lower).norm() < most;
  }

  /// A rim that leaps out of the row between its neighbours is put back.
  static void smooth(std::vector<Section>& sections, std::size_t first, std::size_t last) {
    constexpr double kLeaps = 0.02;
    const std::vector<Section> before = sections;
    for (std::size_t i = first + 1; i < last; ++i) {
      const std::size_t reach = std::min({i - first, last - i, std::size_t{3}});
      for (Vector2d Rims::*rim : {&Rims::upper, &Rims::lower}) {
        Vector2d middle;
        for (Eigen::Index axis = 0; axis < 2; ++axis) {
          // The median of what is left when the row's own slope is taken out.
          const double slope =
              ((before[i + reach].rims.*rim)[axis] - (before[i - reach].rims.*rim)[axis]) / (2.0 * asReal(reach));
          std::vector<double> values;
          for (std::size_t k = i - reach; k <= i + reach; ++k)
            values.push_back((before[k].rims.*rim)[axis] - slope * (asReal(k) - asReal(i)));
          std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(reach), values.end());
          middle[axis] = values[reach];
        }
        if ((middle - before[i].rims.*rim).norm() > kLeaps) sections[i].rims.*rim = middle;
      }
    }
  }

  [[nodiscard]] LipLine lineOf(const std::vector<Section>& sections, std::size_t first, std::size_t last) const {
    LipLine line;
    for (std::size_t i = first; i <= last; ++i) {
      const Section& section = sections[i];
      line.upper.push_back(inSpace(section.way, section.rims.upper));
      line.lower.push_back(inSpace(section.way, section.rims.lower));
      const Rims& rims = section.rims;
      const std::optional<double> joined = section.upper.joined;
      // What lies behind a rim, up to the other lip's, is inside.
      const auto end = [&](double other_rim) { return joined ? *joined - other_rim - kRimDepth : kOutline; };
      take(section.upper, 0, rims.upper_way - 1e-9, line.upper_skin);
      take(section.lower, 0, rims.lower_way - 1e-9, line.lower_skin);
      take(section.upper, rims.upper_way + kRimDepth, end(rims.lower_way), line.inside);
      take(section.lower, rims.lower_way + kRimDepth, end(rims.upper_way), line.inside);
    }
    for (std::size_t i = 0; i < sections.size(); ++i) {
      // Beside the corners an outline is skin from one start to the other; its middle is on neither side.
      const Section& section = sections[i];
      if ((i >= first && i <= last) || !section.upper.joined) continue;
      take(section.upper, 0, kClearSide * *section.upper.joined, line.upper_skin);
      take(section.lower, 0, kClearSide * *section.upper.joined, line.lower_skin);
    }
    for (auto* skin : {&line.upper_skin, &line.lower_skin, &line.inside}) {
      std::sort(skin->begin(), skin->end());
      skin->erase(std::unique(skin->begin(), skin->end()), skin->end());
    }
    // What both lay claim to is on neither.
    std::vector<std::uint32_t> both;
    std::set_intersection(line.upper_skin.begin(), line.upper_skin.end(), line.lower_skin.begin(),
                          line.lower_skin.end(), std::back_inserter(both));
    const auto leave = [](std::vector<std::uint32_t>& skin, const std::vector<std::uint32_t>& others) {
      std::erase_if(skin, [&](std::uint32_t v) { return std::binary_search(others.begin(), others.end(), v); });
    };
    leave(line.inside, line.upper_skin);
    leave(line.inside, line.lower_skin);
    leave(line.upper_skin, both);
    leave(line.lower_skin, both);
    return line;
  }

  /// The vertices that an outline passes from one way to another.
  static void take(const Outline& outline, double from, double to, std::vector<std::uint32_t>& vertices) {
    for (const OutlinePoint& point : outline.points) {
      if (point.way >= from && point.way <= to) vertices.insert(vertices.end(), {point.a, point.b});
    }
  }

  /// Where the slit ends between a section with two lips and a way with one.
  [[nodiscard]] Vector3d cornerBeyond(const Section& last, double beyond) const {
    Section parted = last;
    double open = last.way, shut = beyond;
    while (std::abs(shut - open) > kCornerEnd) {
      Section between = section(0.5 * (open + shut));
      const auto rims = bestRims(between, kLeastPocket, &parted.rims);
      if (rims && follows(*rims, parted.rims, std::abs(between.way - parted.way))) {
        between.rims = *rims;
        parted = std::move(between);
        open = parted.way;
      } else {
        shut = between.way;
      }
    }
    return inSpace(parted.way, 0.5 * (parted.rims.upper + parted.rims.lower));
  }

  [[nodiscard]] std::optional<LipLine> welded(const std::vector<Section>& sections) const {
    LipLine line;
    line.is_parted = false;
    for (const Section& section : sections) {
      if (section.way < 0 || section.way > 1 || !section.has_crease) continue;
      line.upper.push_back(inSpace(section.way, section.crease));
    }
    if (line.upper.size() < 3) return std::nullopt;
    line.lower = line.upper;
    line.corner_right = hints_.corner_right;
    line.corner_left = hints_.corner_left;
    return line;
  }

  const VertexPositions& vertices_;
  const MouthHints& hints_;
  Vector3d origin_, across_, up_, forward_;
  double width_ = 0;
  std::vector<Triangle> region_;
  std::vector<std::array<std::uint32_t, 3>> places_;  ///< of each triangle: the first vertex in each corner's place
  std::vector<std::array<double, 3>> ways_;           ///< and how far across the mouth it is
  std::unordered_map<std::uint32_t, std::uint32_t> place_;
  std::unordered_map<std::uint32_t, double> way_;
};

}  // namespace

LipLine::Pair LipLine::at(const Eigen::Vector3d& place) const {
  const Vector3d along = (corner_left - corner_right).normalized();
  const auto wayOf = [&](std::size_t i) { return (upper[i] - place).dot(along); };
  std::size_t next = 0;
  while (next < upper.size() && wayOf(next) < 0) ++next;
  if (next == 0) return {upper.front(), lower.front()};
  if (next == upper.size()) return {upper.back(), lower.back()};
  const double before = wayOf(next - 1), after = wayOf(next), share = -before / (after - before);
  return {upper[next - 1] + share * (upper[next] - upper[next - 1]),
          lower[next - 1] + share * (lower[next] - lower[next - 1])};
}

std::optional<LipLine> traceLipLine(const VertexPositions& vertices, std::span<const Triangle> triangles,
                                    const MouthHints& hints) {
  Tracer tracer(vertices, triangles, hints);
  if (!tracer.isMouth()) return std::nullopt;
  return tracer.trace();
}

}  // namespace mouthpiece
