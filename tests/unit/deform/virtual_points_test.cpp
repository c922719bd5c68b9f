// Where the control mesh has points that are no markers: rims, corners of mouth and eyes, lids, and the ring around
// all.
#include "deform/surface/virtual_points.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>

#include "base/errors.h"
#include "deform/surface/control_surface.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::sampleFace;
using Places = std::map<std::string, Eigen::Vector3d>;

constexpr double kExactMm = 1e-9;
const std::string kEnds[] = {"OUT_R", "IN_R", "MID", "IN_L", "OUT_L"};

ControlMesh meshOf(const Places& known = {}) { return buildControlMesh(sampleFace().names, sampleFace().rest, known); }

Eigen::Vector3d placeOf(const ControlMesh& mesh, const std::string& name) {
  return mesh.rest.row(findPoint(mesh, name)).transpose();
}
Eigen::Vector2d inPlane(const ControlMesh& mesh, const std::string& name) {
  return mesh.domain.row(findPoint(mesh, name)).transpose();
}

/// The names and weights of what a point follows.
std::map<std::string, double> driversOf(const ControlMesh& mesh, const std::string& name) {
  std::map<std::string, double> drivers;
  for (const PointDriver& driver : mesh.points[unsignedIndex(findPoint(mesh, name))].drivers)
    drivers[mesh.points[unsignedIndex(driver.point)].name] += driver.weight;
  return drivers;
}

/// The radius of the cylinder that is unrolled, and x and z of its axis: half way between the outermost markers, but
/// well behind them all.
std::pair<double, Eigen::Vector2d> axisOf(const ControlMesh& mesh) {
  const MarkerPositions rest = mesh.markerRest();
  Eigen::Index right = 0, left = 0;
  const double radius = 0.5 * (rest.col(0).maxCoeff(&left) - rest.col(0).minCoeff(&right));
  const Eigen::RowVector3d middle = 0.5 * (rest.row(right) + rest.row(left));
  return {radius, {middle.x(), std::min(middle.z(), rest.col(2).minCoeff() + 0.2 * radius)}};
}

TEST(VirtualPoints, RimsNobodyPlacedMeetNearerToTheUpperLine) {
  const ControlMesh mesh = meshOf();
  for (const std::string& end : kEnds) {
    const Eigen::Vector3d up = placeOf(mesh, "LIP_UP_" + end), low = placeOf(mesh, "LIP_LO_" + end);
    EXPECT_LT((placeOf(mesh, "RIM_UP_" + end) - (0.58 * up + 0.42 * low)).norm(), kExactMm) << end;
    EXPECT_LT((placeOf(mesh, "RIM_LO_" + end) - (0.58 * up + 0.42 * low)).norm(), kExactMm) << end;
  }
}

TEST(VirtualPoints, KnownPlacesAreTakenUnlessTheyAreNone) {
  const ControlMesh guessed = meshOf();
  for (const VirtualPointPlace& point : virtualPointPlaces()) {
    if (findPoint(guessed, point.name) < 0 || point.name.starts_with("RIM_CORNER")) continue;
    const Eigen::Vector3d there = placeOf(guessed, point.name) + Eigen::Vector3d(0.1, 0.2, -0.3);
    EXPECT_EQ(placeOf(meshOf({{point.name, there}}), point.name), there) << point.name;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(placeOf(meshOf({{point.name, {there.x(), nan, there.z()}}}), point.name), placeOf(guessed, point.name))
        << point.name;
  }
}

/// The corner proper is a pit: what stands for it lies on the line from the lips' corner to the middle between the rims
/// beside it, at its height there, but not beyond a fifth of the way from either end.
TEST(VirtualPoints, CornersOfTheMouthLieOnTheRimBesideThem) {
  for (const std::string side : {"R", "L"}) {
    const Eigen::Vector3d outer = placeOf(meshOf(), "LIP_CORNER_" + side);
    const double inward = side == "R" ? 1 : -1;
    const Eigen::Vector3d beside = outer + Eigen::Vector3d(inward * 4, 0.2, 1);
    const Places near{{"RIM_UP_NEAR_" + side, beside + Eigen::Vector3d(0, 1, 0.5)},
                      {"RIM_LO_NEAR_" + side, beside - Eigen::Vector3d(0, 1, 0.5)}};
    for (const auto& [given, taken] : {std::pair(0.05, 0.2), {0.3, 0.3}, {0.65, 0.65}, {1.2, 0.8}}) {
      Places known = near;
      // A pit: besides the line, which does not count.
      known["RIM_CORNER_" + side] =
          outer + given * (beside - outer) + 2 * (beside - outer).cross(Eigen::Vector3d::UnitY()).normalized();
      EXPECT_LT((placeOf(meshOf(known), "RIM_CORNER_" + side) - outer - taken * (beside - outer)).norm(), kExactMm)
          << side << given;
    }
    const auto drivers = driversOf(meshOf(), "RIM_CORNER_" + side);
    EXPECT_EQ(drivers, (std::map<std::string, double>{{"LIP_CORNER_" + side, 1}}));
  }
  // Nobody placed it: 6 % of the mouth inwards, and the rim's next points are what is beside it.
  const ControlMesh mesh = meshOf();
  const Eigen::Vector3d across = placeOf(mesh, "LIP_CORNER_L") - placeOf(mesh, "LIP_CORNER_R");
  for (const std::string side : {"R", "L"}) {
    const Eigen::Vector3d outer = placeOf(mesh, "LIP_CORNER_" + side),
                          past =
                              0.5 * (placeOf(mesh, "RIM_UP_OUT_" + side) + placeOf(mesh, "RIM_LO_OUT_" + side)) - outer;
    const double way = 0.06 * (side == "R" ? 1 : -1) * across.dot(past) / past.squaredNorm();
    EXPECT_LT((placeOf(mesh, "RIM_CORNER_" + side) - outer - std::clamp(way, 0.2, 0.8) * past).norm(), kExactMm);
  }
}

TEST(VirtualPoints, EyesHaveAnInnerCornerAndArcs) {
  const ControlMesh mesh = meshOf();
  for (const std::string side : {"R", "L"}) {
    const Eigen::Vector3d middle = 0.5 * (placeOf(mesh, "LID_UP_" + side) + placeOf(mesh, "LID_LO_" + side));
    const Eigen::Vector3d outer = placeOf(mesh, "CANTHUS_OUT_" + side);
    EXPECT_LT((placeOf(mesh, "EYE_IN_" + side) - middle - 0.9 * (middle - outer)).norm(), kExactMm);
    EXPECT_EQ(driversOf(mesh, "EYE_IN_" + side),
              (std::map<std::string, double>{{"NOSE_ROOT", 0.5}, {"CANTHUS_OUT_" + side, 0.5}}));
    for (const std::string lid : {"LID_UP_", "LID_LO_"}) {
      for (const auto& [part, corner] : {std::pair("OUT_", "CANTHUS_OUT_"), {"IN_", "EYE_IN_"}}) {
        const std::string name = lid + part + side;
        const Eigen::Vector3d from = placeOf(mesh, lid + side), to = placeOf(mesh, corner + side);
        // Further from the corner than a straight line would have it: lids are round.
        EXPECT_LT((placeOf(mesh, name) - 0.625 * from - 0.375 * to).norm(), kExactMm) << name;
        const auto drivers = driversOf(mesh, name);
        EXPECT_NEAR(drivers.at(lid + side), 0.7, 1e-12) << name;
        EXPECT_NEAR(drivers.at(corner + side), 0.3, 1e-12) << name;
      }
    }
  }
}

/// docs/theory/deform/bezier_deformation.md: the plane is the side of a cylinder through the outermost markers, and the
/// slit of the mouth in it is straight and open by 0.8 % of its length.
TEST(VirtualPoints, ThePlaneIsACylinderUnrolled) {
  const ControlMesh mesh = meshOf();
  const auto [radius, axis] = axisOf(mesh);
  for (const char* name : {"NOSE_TIP", "CHIN_LOW", "JAW_BACK_R", "TEMPLE_L", "FOREHEAD_TOP", "CHEEK_MID_L"}) {
    const Eigen::Vector3d p = placeOf(mesh, name);
    EXPECT_NEAR(inPlane(mesh, name).x(), radius * std::atan2(p.x() - axis.x(), p.z() - axis.y()), kExactMm) << name;
    EXPECT_NEAR(inPlane(mesh, name).y(), p.y(), kExactMm) << name;
  }
  const Eigen::Vector2d from = inPlane(mesh, "RIM_CORNER_R"), along = inPlane(mesh, "RIM_CORNER_L") - from;
  const Eigen::Vector2d up = Eigen::Vector2d(-along.y(), along.x()).normalized();
  for (const std::string& end : kEnds) {
    const Eigen::Vector2d upper = inPlane(mesh, "RIM_UP_" + end), lower = inPlane(mesh, "RIM_LO_" + end);
    EXPECT_NEAR((upper - from).dot(up), 0.004 * along.norm(), kExactMm) << end;
    EXPECT_NEAR((lower - from).dot(up), -0.004 * along.norm(), kExactMm) << end;
    EXPECT_NEAR((upper - lower).dot(along), 0, kExactMm) << end;
  }
}

/// 28 points that never move, further out below (the chin may drop) than above, and nearest beside, where ears begin.
TEST(VirtualPoints, ARingOfFixedPointsIsAroundAll) {
  const ControlMesh mesh = meshOf();
  constexpr int kRing = 28;
  const Eigen::Index inner = mesh.rest.rows() - kRing;
  const auto points = mesh.domain.topRows(inner);
  const Eigen::Vector2d centre = 0.5 * (points.colwise().maxCoeff() + points.colwise().minCoeff()).transpose();
  const auto [radius, axis] = axisOf(mesh);
  for (int k = 0; k < kRing; ++k) {
    SCOPED_TRACE(k);
    EXPECT_TRUE(mesh.points[unsignedIndex(inner + k)].fixed);
    EXPECT_TRUE(mesh.points[unsignedIndex(inner + k)].drivers.empty());
    const double angle = 2 * std::numbers::pi * (k + 0.5) / kRing;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d place = mesh.domain.row(inner + k).transpose() - centre;
    EXPECT_NEAR(place.normalized().dot(direction), 1, 1e-12);
    // The markers' outline is as far as any straight line between two of them crosses the way out.
    double outline = 0;
    Eigen::Vector3d solid = Eigen::Vector3d::Zero();
    for (Eigen::Index a = 0; a < inner; ++a) {
      for (Eigen::Index b = 0; b < a; ++b) {
        Eigen::Matrix2d lines;
        lines << direction, (points.row(a) - points.row(b)).transpose();
        if (std::abs(lines.determinant()) < 1e-9) continue;
        const Eigen::Vector2d at = lines.inverse() * (points.row(a).transpose() - centre);
        if (at.y() < 0 || at.y() > 1 || at.x() <= outline) continue;
        outline = at.x();
        solid = (mesh.rest.row(a) + at.y() * (mesh.rest.row(b) - mesh.rest.row(a))).transpose();
      }
    }
    const double height = std::abs(direction.y());
    const double margin = radius * (0.25 * (1 - height) + (direction.y() < 0 ? 0.7 : 0.4) * height);
    EXPECT_NEAR(place.norm() - outline, margin, 1e-6);
    // In space it is as far from the outline, and behind it: 20 degrees beside, up to 60 above and below.
    const Eigen::Vector3d away = mesh.rest.row(inner + k).transpose() - solid;
    EXPECT_NEAR(away.norm(), margin, 1e-6);
    EXPECT_NEAR(away.y(), margin * std::cos((20 + 40 * height) * std::numbers::pi / 180) * direction.y(), 1e-6);
    const Eigen::Vector3d outward = Eigen::Vector3d(solid.x() - axis.x(), 0, solid.z() - axis.y()).normalized();
    EXPECT_NEAR(away.dot(outward), -margin * std::sin((20 + 40 * height) * std::numbers::pi / 180), 1e-6);
  }
}

std::string refusalOf(const std::vector<std::string>& names, const MarkerPositions& rest) {
  try {
    buildControlMesh(names, rest);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(VirtualPoints, WhatIsNoFaceIsRefusedByName) {
  const auto& face = sampleFace();
  for (const std::string name : {"LIP_CORNER_L", "LIP_UP_MID", "LIP_LO_OUT_R"}) {
    std::vector<std::string> names = face.names;
    *std::find(names.begin(), names.end(), name) = "LIP";
    EXPECT_EQ(refusalOf(names, face.rest), "control surface: found no marker " + name + "; expected all lip markers");
  }
  MarkerPositions rest = face.rest;
  rest(3, 1) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusalOf(face.names, rest), "control surface: found no finite place for " + face.names[3]);
  const auto row = [&](const char* name) {
    return std::find(face.names.begin(), face.names.end(), name) - face.names.begin();
  };
  rest = face.rest;
  rest.row(row("LIP_UP_IN_R")).swap(rest.row(row("LIP_UP_IN_L")));
  rest.row(row("LIP_LO_IN_R")).swap(rest.row(row("LIP_LO_IN_L")));
  EXPECT_EQ(refusalOf(face.names, rest),
            "control surface: found lip markers out of order; expected them from right to left");
  rest = face.rest;
  rest.row(row("LIP_CORNER_L")) = 0.5 * (rest.row(row("LIP_UP_IN_L")) + rest.row(row("LIP_LO_IN_L")));
  EXPECT_EQ(
      refusalOf(face.names, rest),
      "control surface: found the slit between the lips to end before the outer lip markers on the left; expected "
      "lips that are apart from corner to corner");
  rest = face.rest;
  rest.col(0) *= -1;
  EXPECT_EQ(
      refusalOf(face.names, rest),
      "control surface: found lips upside down or left for right; expected Y up and X towards the subject's left");
  rest = face.rest;
  rest.col(2) *= -1;
  EXPECT_EQ(refusalOf(face.names, rest),
            "control surface: found lips behind the sides of the face; expected Z out of the face");
}

}  // namespace
}  // namespace mouthpiece
