#include "deform/topology/lip_line.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <utility>

#include "deform/topology/mouth_sections.h"

namespace mouthpiece {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Lengths as shares of the mouth's width.
constexpr double kStep = MouthSections::kStep;
constexpr double kOutline = MouthSections::kOutline;
constexpr double kAhead = MouthSections::kAhead;
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
/// Lips are one surface where fewer of the sections between the clicked corners show two.
constexpr double kLeastParted = 0.4;
/// And where they hang together no deeper behind their rims than this: speech opens a mouth by a fourth of its width,
/// and the groove's walls would span it.
constexpr double kGroove = 0.125;

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
      : hints_(hints), sections_(vertices, triangles, hints) {}

  [[nodiscard]] bool isMouth() const { return sections_.isMouth(); }

  std::optional<LipLine> trace() {
    std::vector<Section> sections = cutAll();
    const auto middle = middleSection(sections);
    if (!middle) return welded(sections);
    grow(sections, *middle);
    std::size_t first = *middle, last = *middle;
    while (first > 0 && sections[first - 1].is_parted) --first;
    while (last + 1 < sections.size() && sections[last + 1].is_parted) ++last;
    if (sections[last].way - sections[first].way < kLeastParted) return welded(sections);
    if (std::all_of(&sections[first], &sections[last] + 1, isGroove)) return welded(sections);
    smooth(sections, first, last);
    LipLine line = lineOf(sections, first, last);
    line.corner_right = cornerBeyond(sections[first], first > 0 ? sections[first - 1].way : sections[first].way);
    line.corner_left =
        cornerBeyond(sections[last], last + 1 < sections.size() ? sections[last + 1].way : sections[last].way);
    return line;
  }

 private:
  [[nodiscard]] Section section(double way) const {
    Section section;
    section.way = way;
    auto outlines = sections_.outlinesAt(way);
    if (!outlines) return section;
    section.upper = std::move(outlines->upper);
    section.lower = std::move(outlines->lower);
    if (section.upper.joined.value_or(0) > 0) findCrease(section, sections_.expected(way).first.y());
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
      const double off = std::abs(sections_.wayOf(place) - way) / kBesideLine;
      if (off >= 1) continue;
      sum += (1 - off) * sections_.inSection(place);
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

  /// Whether the lips hang together a little behind their rims, in one surface all the way.
  static bool isGroove(const Section& section) {
    if (!section.upper.joined || !section.upper.joins.empty()) return false;
    const Rims& rims = section.rims;
    const double deepest = std::min(rims.upper.x(), rims.lower.x()) - kGroove;
    return std::none_of(section.upper.points.begin(), section.upper.points.end(), [&](const OutlinePoint& point) {
      return point.way > rims.upper_way && point.way < *section.upper.joined - rims.lower_way && point.at.x() < deepest;
    });
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
      line.upper.push_back(sections_.inSpace(section.way, section.rims.upper));
      line.lower.push_back(sections_.inSpace(section.way, section.rims.lower));
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
    return sections_.inSpace(parted.way, 0.5 * (parted.rims.upper + parted.rims.lower));
  }

  [[nodiscard]] std::optional<LipLine> welded(const std::vector<Section>& sections) const {
    LipLine line;
    line.is_parted = false;
    for (const Section& section : sections) {
      if (section.way < 0 || section.way > 1 || !section.has_crease) continue;
      line.upper.push_back(sections_.inSpace(section.way, section.crease));
    }
    if (line.upper.size() < 3) return std::nullopt;
    line.lower = line.upper;
    line.corner_right = hints_.corner_right;
    line.corner_left = hints_.corner_left;
    return line;
  }

  const MouthHints& hints_;
  MouthSections sections_;
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
