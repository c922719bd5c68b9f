// Markers may lie on each other, where eyes are shut or a click is a little off; their lines in the plane must not
// cross.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "deform/surface/control_steps.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

/// Skin of the lips, and what lids leave open, is at least this wide in the plane, as a share of the slit's or eye's
/// length.
constexpr double kLeastWidth = 0.02;
/// Of the height at which a line through a corner would cross the slit's end.
constexpr double kClear = 0.9;

/// Places of the plane by the line between two points: x along it, 0 and 1 at its ends; y beside it, to the left.
class Axis {
 public:
  Axis(ControlMesh& mesh, const std::string& from, const std::string& to)
      : mesh_(mesh), from_(domainOf(from)), along_(domainOf(to) - from_) {}

  [[nodiscard]] Eigen::Vector2d at(const std::string& name) const {
    const Eigen::Vector2d way = domainOf(name) - from_;
    return Eigen::Vector2d(way.dot(along_), way.dot(beside())) / along_.squaredNorm();
  }
  /// What is there already keeps its place to the last bit.
  void put(const std::string& name, const Eigen::Vector2d& place) {
    if (place != at(name))
      mesh_.domain.row(findPoint(mesh_, name)) = (from_ + place.x() * along_ + place.y() * beside()).transpose();
  }

 private:
  [[nodiscard]] Eigen::Vector2d domainOf(const std::string& name) const {
    return mesh_.domain.row(findPoint(mesh_, name)).transpose();
  }
  [[nodiscard]] Eigen::Vector2d beside() const { return {-along_.y(), along_.x()}; }

  ControlMesh& mesh_;
  Eigen::Vector2d from_, along_;
};

void keepLipsAroundSlit(ControlMesh& mesh) {
  Axis slit(mesh, "RIM_CORNER_R", "RIM_CORNER_L");
  for (const char* end : {"OUT_R", "IN_R", "MID", "IN_L", "OUT_L"}) {
    for (const double sign : {1.0, -1.0}) {
      const std::string name = std::string(sign > 0 ? "LIP_UP_" : "LIP_LO_") + end;
      const Eigen::Vector2d place = slit.at(name);
      slit.put(name, {place.x(), sign * std::max(sign * place.y(), kLeastWidth)});
    }
  }
  for (const std::string end : {"_R", "_L"}) {
    // Both corners are looked at as if they were the left one.
    const auto mirrored = [&](const Eigen::Vector2d& p) {
      return Eigen::Vector2d(end == "_R" ? 1 - p.x() : p.x(), p.y());
    };
    const Eigen::Vector2d upper = mirrored(slit.at("LIP_UP_OUT" + end)), lower = mirrored(slit.at("LIP_LO_OUT" + end));
    const Eigen::Vector2d given = mirrored(slit.at("LIP_CORNER" + end));
    const double beside = std::max(upper.x(), lower.x());
    const double x = std::max({given.x(), 1 + kLeastWidth, beside + kLeastWidth});
    // A slit that ends before the lips do goes on between them, or triangles beyond its end would join them.
    const double slit_end = beside > 1 ? 0.5 * (beside + x) : 1;
    if (beside > 1) slit.put("RIM_CORNER" + end, mirrored({slit_end, 0}));
    // Its lines to both lips have the slit's end between them.
    const auto farthest = [&](const Eigen::Vector2d& lip) {
      const double past = (x - slit_end) / (x - lip.x());
      return past < 1 ? kClear * std::abs(lip.y()) * past / (1 - past) : std::numeric_limits<double>::infinity();
    };
    const Eigen::Vector2d corner(x, std::clamp(given.y(), -farthest(upper), farthest(lower)));
    if (corner != given) slit.put("LIP_CORNER" + end, mirrored(corner));
  }
}

using Line = std::array<Eigen::Vector2d, 5>;

double heightAt(const Line& line, double x) {
  const auto* after = std::find_if(line.begin() + 1, line.end() - 1, [x](const auto& p) { return p.x() >= x; });
  const Eigen::Vector2d &a = *(after - 1), &b = *after;
  return a.y() + (b.y() - a.y()) * (x - a.x()) / (b.x() - a.x());
}

/// Whether both go on from 0 to 1, and meet at their ends alone.
bool runsAbove(const Line& upper, const Line& lower) {
  const auto goesBack = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() >= b.x(); };
  const auto isAbove = [](const Line& line, const Line& other, double sign) {
    return std::all_of(line.begin() + 1, line.end() - 1,
                       [&](const auto& p) { return sign * (p.y() - heightAt(other, p.x())) > 0; });
  };
  for (const Line* line : {&upper, &lower}) {
    if (std::adjacent_find(line->begin(), line->end(), goesBack) != line->end()) return false;
  }
  return isAbove(upper, lower, 1) && isAbove(lower, upper, -1);
}

void keepEyeOpen(ControlMesh& mesh, bool is_right) {
  const std::string side = is_right ? "_R" : "_L", outer = "CANTHUS_OUT" + side, inner = "EYE_IN" + side;
  if (findPoint(mesh, inner) < 0) return;
  Axis eye(mesh, is_right ? outer : inner, is_right ? inner : outer);
  std::array<std::string, 3> parts{"_OUT", "", "_IN"};
  if (!is_right) std::reverse(parts.begin(), parts.end());
  Line upper, lower;
  upper.front() = lower.front() = {0, 0};
  upper.back() = lower.back() = {1, 0};
  for (std::size_t k = 0; k < parts.size(); ++k) {
    upper[k + 1] = eye.at("LID_UP" + parts[k] + side);
    lower[k + 1] = eye.at("LID_LO" + parts[k] + side);
  }
  if (runsAbove(upper, lower)) return;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const Eigen::Vector2d middle = 0.5 * (upper[k + 1] + lower[k + 1]), half = 0.5 * (upper[k + 1] - lower[k + 1]);
    const double quarter = 0.25 * asReal(k + 1), way = std::clamp(middle.x(), quarter - 0.1, quarter + 0.1);
    const double open = std::max(half.y(), kLeastWidth);
    eye.put("LID_UP" + parts[k] + side, {way, middle.y() + open});
    eye.put("LID_LO" + parts[k] + side, {way, middle.y() - open});
  }
}

}  // namespace

void untangle(ControlMesh& mesh) {
  keepLipsAroundSlit(mesh);
  keepEyeOpen(mesh, true);
  keepEyeOpen(mesh, false);
}

}  // namespace mouthpiece
