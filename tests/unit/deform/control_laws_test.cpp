// Laws of the control mesh: its triangles, how its points follow, where its lips meet, on markers that are a little
// off.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "deform/surface/control_surface.h"
#include "deform/surface/virtual_points.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::sampleFace;

class ControlLaws : public ::testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};
  double number(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }

  /// The sample's markers, each some tenths of a millimetre off.
  MarkerPositions clicked(double off_mm) {
    MarkerPositions rest = sampleFace().rest;
    for (double& axis : rest.reshaped()) axis += number(-off_mm, off_mm);
    return rest;
  }
  ControlMesh control(double off_mm = 0.7) { return buildControlMesh(sampleFace().names, clicked(off_mm)); }
  MarkerPositions pose(const ControlMesh& control, double off_mm) {
    MarkerPositions pose = control.markerRest();
    for (double& axis : pose.reshaped()) axis += number(-off_mm, off_mm);
    return pose;
  }
};
INSTANTIATE_TEST_SUITE_P(Seeds, ControlLaws, ::testing::Range(1U, 16U));

int pointOf(const ControlMesh& control, const std::string& name) {
  for (std::size_t i = 0; i < control.points.size(); ++i) {
    if (control.points[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

double turnOf(const ControlMesh& control, int a, int b, int c) {
  const Eigen::RowVector2d ab = control.domain.row(b) - control.domain.row(a),
                           ac = control.domain.row(c) - control.domain.row(a);
  return ab.x() * ac.y() - ab.y() * ac.x();
}

/// Twice the area within a closed line of points, positive when it turns left.
double areaWithin(const ControlMesh& control, const std::vector<int>& line) {
  double area = 0;
  for (std::size_t i = 1; i + 1 < line.size(); ++i) area += turnOf(control, line[0], line[i], line[i + 1]);
  return area;
}

using Edge = std::pair<int, int>;

/// The sides that have one triangle only, as closed lines; the triangles lie on their left.
std::vector<std::vector<int>> borders(const ControlMesh& control) {
  std::set<Edge> edges;
  for (const auto& t : control.triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.emplace(t[k], t[(k + 1) % 3]);
  }
  std::map<int, int> next;
  for (const Edge& edge : edges) {
    if (edges.contains({edge.second, edge.first})) continue;
    EXPECT_TRUE(next.emplace(edge).second) << "two borders touch at a point";
  }
  std::vector<std::vector<int>> lines;
  while (!next.empty()) {
    std::vector<int> line;
    for (auto at = next.begin(); at != next.end(); at = next.find(line.back())) {
      if (line.empty()) line.push_back(at->first);
      line.push_back(at->second);
      next.erase(at);
    }
    EXPECT_EQ(line.front(), line.back());
    line.pop_back();
    lines.push_back(line);
  }
  return lines;
}

/// An outer border, around a mouth and two eyes; what lies between is covered once and by triangles alone.
TEST_P(ControlLaws, TrianglesCoverTheFaceOnceButForMouthAndEyes) {
  const ControlMesh mesh = control();
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    EXPECT_GT(turnOf(mesh, a, b, c), 0);
    area += turnOf(mesh, a, b, c);
  }
  const auto lines = borders(mesh);
  ASSERT_EQ(lines.size(), 4U);
  double within = 0;
  std::size_t holes = 0;
  for (const auto& line : lines) {
    within += areaWithin(mesh, line);
    if (areaWithin(mesh, line) > 0) {
      for (const int point : line) EXPECT_TRUE(mesh.points[unsignedIndex(point)].fixed) << "the ring is the outline";
      continue;
    }
    ++holes;
    const std::string& name = mesh.points[unsignedIndex(line[0])].name;
    const std::string kind = name.substr(0, 4);
    EXPECT_TRUE(kind == "RIM_" || kind == "LID_" || kind == "CANT" || kind == "EYE_") << name;
  }
  EXPECT_EQ(holes, 3U);
  EXPECT_NEAR(area, within, 1e-9 * area) << "no two triangles lie on each other";
}

/// Where no line of lips or lids is in the way no point lies within the circle through a neighbour's corners.
TEST_P(ControlLaws, TrianglesAreAsRoundAsTheLinesThatAreKeptAllow) {
  const ControlMesh mesh = control();
  const auto isOnLine = [&](int point) {
    const std::string& name = mesh.points[unsignedIndex(point)].name;
    return name.starts_with("LIP_") || name.starts_with("RIM_") || name.starts_with("LID_") ||
           name.starts_with("CANTHUS") || name.starts_with("EYE_");
  };
  std::map<Edge, int> facing;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) facing[{t[k], t[(k + 1) % 3]}] = t[(k + 2) % 3];
  }
  std::size_t looked_at = 0;
  for (const auto& [edge, corner] : facing) {
    const auto other = facing.find({edge.second, edge.first});
    if (other == facing.end() || (isOnLine(edge.first) && isOnLine(edge.second))) continue;
    ++looked_at;
    // Of a point within the circle the determinant of the four, lifted onto a paraboloid, is positive.
    Eigen::Matrix3d lifted;
    const Eigen::RowVector2d from = mesh.domain.row(other->second);
    int row = 0;
    for (const int point : {edge.first, edge.second, corner}) {
      const Eigen::RowVector2d p = mesh.domain.row(point) - from;
      lifted.row(row++) << p, p.squaredNorm();
    }
    EXPECT_LE(lifted.determinant(), 1e-6 * std::pow(mesh.mouth_width, 4))
        << mesh.points[unsignedIndex(edge.first)].name << " to " << mesh.points[unsignedIndex(edge.second)].name;
  }
  EXPECT_GT(looked_at, 100U);
}

/// Whatever the click: lips lie around the slit and lids above each other; what lay so keeps its place, and only those
/// points are ever moved.
TEST_P(ControlLaws, ShutEyesAndStrayLipsAreSpreadInThePlaneAlone) {
  MarkerPositions rest = clicked(0.3);
  const auto row = [&](const char* name) {
    return rest.row(std::find(sampleFace().names.begin(), sampleFace().names.end(), name) - sampleFace().names.begin());
  };
  // An eye shut, its lids crossed by up to a millimetre; a corner of the mouth too high.
  const double shut = 0.5 * (row("LID_UP_R").y() + row("LID_LO_R").y()), crossed = number(0, 0.5);
  row("LID_UP_R").y() = shut - crossed;
  row("LID_LO_R").y() = shut + crossed;
  row("LIP_CORNER_L").y() += number(0, 3);
  const ControlMesh mesh = buildControlMesh(sampleFace().names, rest);
  EXPECT_EQ(mesh.markerRest(), rest) << "where markers are is not changed";
  const auto height = [&](const std::string& name) { return mesh.domain(pointOf(mesh, name), 1); };
  for (const std::string part : {"_OUT_R", "_R", "_IN_R", "_OUT_L", "_L", "_IN_L"})
    EXPECT_GT(height("LID_UP" + part), height("LID_LO" + part)) << part;
  for (const std::string part : {"OUT_R", "IN_R", "MID", "IN_L", "OUT_L"}) {
    EXPECT_GT(height("LIP_UP_" + part), height("RIM_UP_" + part)) << part;
    EXPECT_GT(height("RIM_UP_" + part), height("RIM_LO_" + part)) << part;
    EXPECT_GT(height("RIM_LO_" + part), height("LIP_LO_" + part)) << part;
  }
  for (const auto& [a, b, c] : mesh.triangles) EXPECT_GT(turnOf(mesh, a, b, c), 0);
  // The other eye is as if nothing had been.
  MarkerPositions opened = rest;
  std::swap(rest, opened);
  row("LID_UP_R").y() = shut + 4;
  row("LID_LO_R").y() = shut - 4;
  const ControlMesh open = buildControlMesh(sampleFace().names, rest);
  for (const char* name : {"LID_UP_L", "LID_LO_L", "LID_UP_OUT_L", "NOSE_TIP", "CHIN_MID"})
    EXPECT_EQ(mesh.domain.row(pointOf(mesh, name)), open.domain.row(pointOf(open, name))) << name;
}

TEST_P(ControlLaws, PointsFollowTheirDriversByTheirWeights) {
  const ControlMesh mesh = control();
  const MarkerPositions now = controlPoints(mesh, pose(mesh, 5));
  std::size_t following = 0;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const ControlPoint& point = mesh.points[i];
    const Eigen::RowVector3d move = now.row(signedIndex(i)) - mesh.rest.row(signedIndex(i));
    if (point.fixed) {
      EXPECT_EQ(move.norm(), 0) << point.name;
    }
    if (point.rule != PointRule::kFollow) continue;
    Eigen::RowVector3d expected = Eigen::RowVector3d::Zero();
    for (const PointDriver& driver : point.drivers)
      expected += driver.weight * (now.row(driver.point) - mesh.rest.row(driver.point));
    EXPECT_LT((move - expected).norm(), 1e-12) << point.name;
    following += point.drivers.empty() ? 0U : 1U;
  }
  EXPECT_GE(following, 12U) << "corners of the mouth, and lids";
}

/// The head's place is nobody's business: markers that all go one way take everything along but the ring.
TEST_P(ControlLaws, WhatAllMarkersDoLipsAndLidsDo) {
  const ControlMesh mesh = control();
  const Eigen::RowVector3d shift(number(-20, 20), number(-20, 20), number(-20, 20));
  const MarkerPositions before = pose(mesh, 3), after = before.rowwise() + shift;
  const MarkerPositions was = controlPoints(mesh, before), now = controlPoints(mesh, after);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const double expected = mesh.points[i].fixed ? 0 : 1;
    EXPECT_LT((now.row(signedIndex(i)) - was.row(signedIndex(i)) - expected * shift).norm(), 1e-9)
        << mesh.points[i].name;
  }
}

/// Lips that are said to touch do so, whatever the markers say, half way between where their own markers take them.
TEST_P(ControlLaws, LipsThatTouchMeetHalfWay) {
  const ControlMesh mesh = control();
  const std::vector<LipPair> pairs = lipPairs(mesh);
  ASSERT_EQ(pairs.size(), 5U);
  const MarkerPositions markers = pose(mesh, 2);
  std::vector<LipGap> gaps(pairs.size());
  const MarkerPositions apart = controlPoints(mesh, {markers, gaps});
  const double least = number(0, 2);
  gaps.assign(pairs.size(), {.opened = 0, .least = least});
  const MarkerPositions touching = controlPoints(mesh, {markers, gaps});
  for (const LipPair& pair : pairs) {
    const Eigen::RowVector3d up = (markers.row(pair.upper_marker) - markers.row(pair.lower_marker)).normalized();
    const Eigen::RowVector3d rest_up =
        (mesh.rest.row(pair.upper_marker) - mesh.rest.row(pair.lower_marker)).normalized();
    const double lap = std::min(0.0, (mesh.rest.row(pair.upper_rim) - mesh.rest.row(pair.lower_rim)).dot(rest_up));
    const Eigen::RowVector3d gap = touching.row(pair.upper_rim) - touching.row(pair.lower_rim);
    EXPECT_NEAR(gap.dot(up), lap + least, 1e-9);
    const Eigen::RowVector3d middle = touching.row(pair.upper_rim) + touching.row(pair.lower_rim);
    EXPECT_LT((middle - apart.row(pair.upper_rim) - apart.row(pair.lower_rim)).norm(), 1e-9) << "both give way alike";
    EXPECT_EQ(touching.row(pair.upper_marker), markers.row(pair.upper_marker));
  }
}

/// The actor's neutral mouth is closed: what is added to the markers closes a mouth that is open at rest.
TEST_P(ControlLaws, ClosingOffsetsCloseAnOpenMouth) {
  std::map<std::string, Eigen::Vector3d> known = sampleFace().known;
  const double open = number(1, 5);
  for (auto& [name, place] : known) {
    if (name.starts_with("RIM_UP_")) place.y() += 0.5 * open;
    if (name.starts_with("RIM_LO_")) place.y() -= 0.5 * open;
  }
  const ControlMesh mesh = buildControlMesh(sampleFace().names, sampleFace().rest, known);
  const MarkerPositions offsets = closingOffsets(mesh);
  const std::vector<LipPair> pairs = lipPairs(mesh);
  const auto gapOf = [&](const MarkerPositions& points, const LipPair& pair) {
    const Eigen::RowVector3d up = (points.row(pair.upper_marker) - points.row(pair.lower_marker)).normalized();
    return (points.row(pair.upper_rim) - points.row(pair.lower_rim)).dot(up);
  };
  const std::vector<LipGap> by_markers(pairs.size(), {.opened = 1});
  const MarkerPositions closed = controlPoints(mesh, {mesh.markerRest() + offsets, by_markers});
  std::set<int> moved;
  for (const LipPair& pair : pairs) {
    EXPECT_GT(gapOf(mesh.rest, pair), 0.9 * open);
    EXPECT_LT(gapOf(closed, pair), 0.05 * open);
    EXPECT_LT(offsets(pair.upper_marker, 1), 0);
    EXPECT_GT(offsets(pair.lower_marker, 1), -offsets(pair.upper_marker, 1)) << "the lower lip goes further";
    const double gone = (offsets.row(pair.lower_marker) - offsets.row(pair.upper_marker)).norm();
    EXPECT_NEAR(gone, gapOf(mesh.rest, pair), 1e-9) << "both together as far as they are apart";
    moved.insert({pair.upper_marker, pair.lower_marker});
  }
  const double largest = offsets.rowwise().norm().maxCoeff();
  for (Eigen::Index i = 0; i < offsets.rows(); ++i) {
    if (moved.contains(static_cast<int>(i))) continue;
    const auto away = [&](const LipPair& pair) { return (mesh.rest.row(i) - mesh.rest.row(pair.lower_marker)).norm(); };
    const LipPair& nearest = *std::min_element(
        pairs.begin(), pairs.end(), [&](const LipPair& one, const LipPair& other) { return away(one) < away(other); });
    const double share = offsets.row(i).norm() / largest;
    if (mesh.rest(i, 1) > mesh.rest(nearest.lower_marker, 1) || away(nearest) > 0.45 * mesh.mouth_width) {
      EXPECT_EQ(share, 0) << sampleFace().names[unsignedIndex(i)];
    } else {
      EXPECT_GT(offsets.row(i).dot(offsets.row(nearest.lower_marker)), 0) << "the skin under the lip goes along";
      EXPECT_LT(share, 1) << "but not as far";
    }
  }
  const auto goes = [&](const char* name) { return offsets.row(findPoint(mesh, name)).norm(); };
  EXPECT_GT(goes("CHIN_UP"), 0.5 * goes("LIP_LO_MID"));
  EXPECT_LT(goes("CHIN_MID"), goes("CHIN_UP"));
  const ControlMesh touching = buildControlMesh(sampleFace().names, sampleFace().rest, sampleFace().known);
  EXPECT_LT(closingOffsets(touching).cwiseAbs().maxCoeff(), 1e-9) << "nothing where the lips touch";
}

TEST_P(ControlLaws, LipsPartOnceTheirSlackIsStretched) {
  const double slack = number(0.01, 0.5), step = 0.01 * slack;
  double before = 0, speed_before = 0;
  for (int i = 0; i <= 400; ++i) {
    const double stretch = i * step, rims = partedShare(stretch, slack) * stretch, speed = (rims - before) / step;
    if (stretch <= slack) {
      EXPECT_EQ(rims, 0) << stretch;
    } else if (stretch < 2.75 * slack) {
      EXPECT_GE(speed, 0) << stretch;
      EXPECT_LT(speed, 1.9) << "rims that catch up are not twice as fast as the outer edges";
      EXPECT_LT(std::abs(speed - speed_before), 0.08) << "nor suddenly";
    } else {
      EXPECT_NEAR(rims, stretch, 1e-12);
    }
    before = rims;
    speed_before = speed;
  }
  EXPECT_EQ(partedShare(number(-1, 1), 0), 1) << "without slack lips part at once";
}

}  // namespace
}  // namespace mouthpiece
