#include <boost/geometry/algorithms/convex_hull.hpp>
#include <boost/geometry/algorithms/covered_by.hpp>
#include <boost/geometry/geometries/geometries.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/strategies/strategies.hpp>

#include "deform/surface/surface_projection.h"

namespace mouthpiece {

std::vector<bool> withinOutline(const MarkerPositions& markers, const Eigen::MatrixX2d& points) {
  using Point = boost::geometry::model::d2::point_xy<double>;
  boost::geometry::model::multi_point<Point> corners;
  for (const auto& marker : markers.rowwise()) corners.push_back({marker.x(), marker.y()});
  boost::geometry::model::polygon<Point> hull;
  boost::geometry::convex_hull(corners, hull);
  std::vector<bool> is_within;
  for (const auto& point : points.rowwise())
    is_within.push_back(boost::geometry::covered_by(Point(point.x(), point.y()), hull));
  return is_within;
}

}  // namespace mouthpiece
