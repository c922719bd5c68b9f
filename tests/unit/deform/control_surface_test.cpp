#include "deform/surface/control_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <string>
#include <utility>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/virtual_points.h"
#include "support/error_of.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::openMouth;
using samples::randomPose;
using samples::sampleControl;
using samples::sampleFace;

int indexOf(const ControlMesh& mesh, const std::string& name) {
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (mesh.points[i].name == name) return static_cast<int>(i);
  }
  ADD_FAILURE() << name;
  return 0;
}

/// Upper rim points with the lower ones they meet.
std::vector<std::pair<int, int>> rimPairs(const ControlMesh& mesh) {
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (mesh.points[i].rule == PointRule::kInnerLip && mesh.points[i].side == LipSide::kUpper) {
      pairs.emplace_back(static_cast<int>(i), mesh.points[i].opposite);
    }
  }
  return pairs;
}

double gapAlong(const MarkerPositions& points, std::pair<int, int> pair, const Eigen::RowVector3d& up) {
  return (points.row(pair.first) - points.row(pair.second)).dot(up);
}

TEST(ControlSurface, UsesEveryMarkerAndJoinsNoLips) {
  const ControlMesh& mesh = sampleControl();
  std::set<int> used;
  for (const auto& triangle : mesh.triangles) {
    bool upper = false, lower = false;
    for (const int point : triangle) {
      used.insert(point);
      upper |= mesh.points[static_cast<std::size_t>(point)].side == LipSide::kUpper;
      lower |= mesh.points[static_cast<std::size_t>(point)].side == LipSide::kLower;
    }
    EXPECT_FALSE(upper && lower);
  }
  for (int i = 0; i < static_cast<int>(mesh.marker_count); ++i)
    EXPECT_TRUE(used.contains(i)) << mesh.points[static_cast<std::size_t>(i)].name;
  EXPECT_EQ(rimPairs(mesh).size(), 5U);
}

TEST(ControlSurface, MouthAndEyesAreHoles) {
  const ControlMesh& mesh = sampleControl();
  for (const auto& [upper, lower] :
       {std::pair("RIM_UP_MID", "RIM_LO_MID"), {"LID_UP_R", "LID_LO_R"}, {"LID_UP_L", "LID_LO_L"}}) {
    const int a = indexOf(mesh, upper), b = indexOf(mesh, lower);
    for (const auto& triangle : mesh.triangles) {
      EXPECT_FALSE(std::count(triangle.begin(), triangle.end(), a) > 0 &&
                   std::count(triangle.begin(), triangle.end(), b) > 0)
          << upper;
    }
  }
}

TEST(ControlSurface, RestGivesTheRestPoints) {
  const ControlMesh& mesh = sampleControl();
  const MarkerPositions points = controlPoints(mesh, sampleFace().rest);
  EXPECT_LT((points - mesh.rest).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ControlSurface, MarkersKeepTheirPlacesInEveryPose) {
  std::mt19937 random(7);
  for (int i = 0; i < 20; ++i) {
    const MarkerPositions pose = randomPose(sampleFace(), random);
    const MarkerPositions points = controlPoints(sampleControl(), pose);
    EXPECT_EQ((points.topRows(pose.rows()) - pose).cwiseAbs().maxCoeff(), 0.0);
  }
}

TEST(ControlSurface, LipsMeetAndNeverPass) {
  const ControlMesh& mesh = sampleControl();
  const auto gap = [&](const MarkerPositions& pose, const MarkerPositions& points, std::pair<int, int> pair) {
    const auto outer = [&](int rim) { return pose.row(mesh.points[static_cast<std::size_t>(rim)].drivers[0].point); };
    return gapAlong(points, pair, (outer(pair.first) - outer(pair.second)).normalized());
  };
  for (const double pressed_mm : {0.0, 1.0, 4.0, 6.0}) {
    const MarkerPositions pose = openMouth(sampleFace(), -pressed_mm);
    const MarkerPositions points = controlPoints(mesh, pose);
    for (const auto& pair : rimPairs(mesh)) EXPECT_NEAR(gap(pose, points, pair), 0, 1e-9) << pressed_mm;
  }
  std::mt19937 random(11);
  for (int i = 0; i < 200; ++i) {
    const MarkerPositions pose = randomPose(sampleFace(), random);
    const MarkerPositions points = controlPoints(mesh, pose);
    for (const auto& pair : rimPairs(mesh)) EXPECT_GE(gap(pose, points, pair), -1e-9);
  }
}

TEST(ControlSurface, OpeningGrowsSmoothlyWithTheMarkers) {
  const ControlMesh& mesh = sampleControl();
  const auto middle = rimPairs(mesh)[2];
  const double step_mm = 0.05;
  double before = 0, speed_before = 0;
  for (double opening = -3; opening < 12; opening += step_mm) {
    const double gap = gapAlong(controlPoints(mesh, openMouth(sampleFace(), opening)), middle, {0, 1, 0});
    const double speed = (gap - before) / step_mm;
    if (opening > -2.9) {
      EXPECT_GE(speed, -0.05) << opening;
      EXPECT_LT(std::abs(speed - speed_before), 0.12) << "a jerk at " << opening;
    }
    before = gap;
    speed_before = speed;
  }
  EXPECT_GT(before, 9.0) << "an open mouth must open";
}

/// Lips that touch stretch before they part: then they open without a jerk and catch up.
TEST(ControlSurface, LipsAreKeptApartAsFarAsTheyAreSaidTo) {
  const ControlMesh& mesh = sampleControl();
  const auto middle = rimPairs(mesh)[2];
  constexpr double kLeastMm = 2, kAlong_mm = 0.1;
  const auto gapAt = [&](double opening, double least_mm) {
    const MarkerPositions pose = openMouth(sampleFace(), opening);
    const std::vector<LipGap> lips(lipPairs(mesh).size(), {.least = least_mm});
    return gapAlong(controlPoints(mesh, {pose, lips}), middle, {0, 1, 0});
  };
  EXPECT_NEAR(gapAt(-3, kLeastMm), kLeastMm, kAlong_mm);
  EXPECT_NEAR(gapAt(10, kLeastMm), gapAt(10, 0), 0.6) << "lips that are open anyway stay as they are";
  double before = gapAt(-3, kLeastMm);
  constexpr double kStepMm = 0.05;
  for (double opening = -3 + kStepMm; opening < 10; opening += kStepMm) {
    const double gap = gapAt(opening, kLeastMm);
    EXPECT_GE(gap, kLeastMm - kAlong_mm) << opening;
    EXPECT_LT(std::abs(gap - before), 1.2 * kStepMm) << "a jump at " << opening;
    before = gap;
  }
}

TEST(ControlSurface, LipsStickAsFarAsTheyAreSaidTo) {
  const ControlMesh& mesh = sampleControl();
  const auto middle = rimPairs(mesh)[2];
  constexpr double kSlackMm = 3, kStepMm = 0.05;
  constexpr double kAlong_mm = 0.1;  // the lips' own direction is a little off the vertical
  const auto gapAt = [&](double opening) {
    const MarkerPositions pose = openMouth(sampleFace(), opening);
    std::vector<LipGap> lips;
    for (const LipPair& pair : lipPairs(mesh)) {
      const double height = (mesh.rest.row(pair.upper_marker) - mesh.rest.row(pair.lower_marker)).norm();
      const double apart = (pose.row(pair.upper_marker) - pose.row(pair.lower_marker)).norm();
      lips.push_back({.opened = partedShare((apart - height) / height, kSlackMm / height)});
    }
    return gapAlong(controlPoints(mesh, {pose, lips}), middle, {0, 1, 0});
  };
  double before = 0, speed_before = 0;
  for (double opening = -3; opening < 12; opening += kStepMm) {
    const double gap = gapAt(opening);
    const double speed = (gap - before) / kStepMm;
    if (opening < kSlackMm - 0.5) {
      EXPECT_NEAR(gap, 0, kAlong_mm) << opening;
    } else if (opening > -2.9) {
      EXPECT_GE(speed, -0.05) << opening;
      EXPECT_LT(std::abs(speed - speed_before), 0.15) << "a jerk at " << opening;
    }
    before = gap;
    speed_before = speed;
  }
  EXPECT_NEAR(before, gapAlong(controlPoints(mesh, openMouth(sampleFace(), 12)), middle, {0, 1, 0}), 0.6);
}

TEST(ControlSurface, RefusesWhatIsNoFace) {
  const auto& face = sampleFace();
  EXPECT_THROW(buildControlMesh({face.names.begin(), face.names.begin() + 30}, face.rest.topRows(30)), InputError);
  MarkerPositions bad = face.rest;
  bad(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(buildControlMesh(face.names, bad), InputError);
  bad = face.rest;
  bad.col(1) *= -1;
  EXPECT_THROW(buildControlMesh(face.names, bad), InputError);
  bad = face.rest;
  bad.col(2) *= -1;
  EXPECT_THROW(buildControlMesh(face.names, bad), InputError);
  bad = face.rest;
  bad.row(5) = bad.row(4);
  EXPECT_THROW(buildControlMesh(face.names, bad), InputError);
  EXPECT_THROW(buildControlMesh(face.names, MarkerPositions::Zero(face.rest.rows(), 3)), InputError);
}

TEST(ControlSurface, StandsWhereEyesAreShutAndClicksAreOff) {
  const auto& face = sampleFace();
  const auto builtWith = [&](auto&& change, const std::map<std::string, Eigen::Vector3d>& lids = {}) {
    MarkerPositions rest = face.rest;
    std::map<std::string, Eigen::Vector3d> known = face.known;
    for (const auto& [name, place] : lids) known[name] = place;
    change([&](const std::string& name) -> auto{
      const auto row = std::find(face.names.begin(), face.names.end(), name) - face.names.begin();
      return rest.row(row);
    });
    ControlMesh mesh;
    EXPECT_NO_THROW(mesh = buildControlMesh(face.names, rest, known));
    if (mesh.points.empty()) return mesh;
    EXPECT_NO_THROW(checkControlMesh(mesh, "x.face"));
    EXPECT_EQ(MarkerPositions(mesh.rest.topRows(rest.rows())), rest) << "only the plane's places may move";
    return mesh;
  };
  const ControlMesh as_clicked = builtWith([](auto&&) {});
  EXPECT_EQ(as_clicked.triangles, buildControlMesh(face.names, face.rest, face.known).triangles);
  const Eigen::Vector3d lid = as_clicked.rest.row(indexOf(as_clicked, "LID_LO_R")).transpose();
  builtWith([](auto&& at) { at("LID_UP_R") = at("LID_LO_R") - Eigen::RowVector3d(0, 1, 0); },
            {{"LID_LO_IN_R", lid + Eigen::Vector3d(3, 4, 0)}, {"LID_UP_IN_R", lid + Eigen::Vector3d(3, 6, 0)}});
  for (const double x : {-2.0, -4.0, -6.0}) {
    builtWith([x](auto&& at) { at("LIP_CORNER_L") += Eigen::RowVector3d(x, 8, 0); });
    builtWith([x](auto&& at) { at("LIP_CORNER_R") += Eigen::RowVector3d(-x, -8, 0); });
  }
  builtWith([](auto&& at) { at("LIP_LO_OUT_R") = at("LIP_UP_OUT_R") + Eigen::RowVector3d(1, -0.5, 0); });
  std::mt19937 random(20261123);
  std::uniform_real_distribution<double> off(-4, 4);
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE(round);
    builtWith([&](auto&& at) {
      for (const char* name : {"LIP_CORNER_R", "LIP_CORNER_L", "LIP_UP_OUT_R", "LIP_LO_OUT_L", "LID_UP_L", "LID_LO_R"})
        at(name) += Eigen::RowVector3d(off(random), off(random), 0);
    });
  }
}

TEST(ControlSurface, StandsOnMarkersAlone) {
  const ControlMesh mesh = buildControlMesh(sampleFace().names, sampleFace().rest);
  EXPECT_GT(mesh.triangles.size(), 150U);
  EXPECT_NO_THROW(checkControlMesh(mesh, "x.face"));
}

/// Each is told with what was found.
TEST(ControlSurface, ChecksWhatComesFromFiles) {
  const auto after = [](auto&& damage) {
    ControlMesh mesh = sampleControl();
    damage(mesh);
    return errorOf([&] { checkControlMesh(mesh, "x.face"); });
  };
  ASSERT_EQ(after([](ControlMesh&) {}), "no error");
  const std::size_t markers = sampleControl().marker_count, points = sampleControl().points.size();
  const std::string in = "x.face:control surface: found ", of = " of " + std::to_string(points),
                    first = sampleControl().points[markers].name;
  const auto rim = [](ControlMesh& m) -> ControlPoint& { return m.points[unsignedIndex(indexOf(m, "RIM_UP_MID"))]; };
  EXPECT_EQ(after([](ControlMesh& m) { m.triangles[0][1] = 100000; }), in + "a triangle with point 100000" + of);
  EXPECT_EQ(after([&](ControlMesh& m) { m.triangles[0][1] = static_cast<int>(points); }),
            in + "a triangle with point " + std::to_string(points) + of);
  EXPECT_EQ(after([](ControlMesh& m) { m.triangles[0][1] = -1; }), in + "a triangle with point -1" + of);
  const std::string flat = in + "a triangle that is turned over or flat";
  EXPECT_EQ(after([](ControlMesh& m) { std::swap(m.triangles[0][0], m.triangles[0][1]); }), flat);
  EXPECT_EQ(after([](ControlMesh& m) { m.triangles[0][1] = m.triangles[0][0]; }), flat);
  EXPECT_EQ(after([](ControlMesh& m) { m.triangles.push_back(m.triangles[0]); }),
            in + "an edge with two triangles on one side");
  EXPECT_EQ(after([](ControlMesh& m) { m.triangles.clear(); }), in + "no triangles");
  EXPECT_EQ(after([](ControlMesh& m) {
              m.triangles[0] = {indexOf(m, "LIP_UP_MID"), indexOf(m, "LIP_LO_MID"), indexOf(m, "LIP_CORNER_L")};
            }),
            in + "a triangle that joins the lips: LIP_UP_MID, LIP_LO_MID, LIP_CORNER_L");
  const auto driver = [&](ControlMesh& m) -> PointDriver& { return m.points[markers].drivers.at(0); };
  EXPECT_EQ(after([&](ControlMesh& m) { driver(m).point = 5000; }), in + "point " + first + " driven by a later point");
  EXPECT_EQ(after([&](ControlMesh& m) { driver(m).point = static_cast<int>(markers); }),
            in + "point " + first + " driven by a later point")
      << "itself";
  EXPECT_EQ(after([&](ControlMesh& m) { driver(m).point = -1; }), in + "point " + first + " driven by a later point");
  EXPECT_EQ(after([&](ControlMesh& m) { driver(m).weight = std::numeric_limits<double>::quiet_NaN(); }),
            in + "point " + first + " with a weight that is not finite");
  EXPECT_EQ(after([&](ControlMesh& m) { rim(m).drivers[1].point = static_cast<int>(markers); }),
            in + "point RIM_UP_MID driven by a virtual point; expected lip markers");
  EXPECT_EQ(after([&](ControlMesh& m) { rim(m).drivers[1].point = static_cast<int>(markers) - 1; }), "no error");
  EXPECT_EQ(after([&](ControlMesh& m) { rim(m).opposite = 3; }),
            in + "point RIM_UP_MID facing a point that is not on a lip's rim");
  for (const int nobody : {-2, static_cast<int>(points)})
    EXPECT_EQ(after([&](ControlMesh& m) { rim(m).opposite = nobody; }), in + "point RIM_UP_MID facing no point");
  EXPECT_EQ(after([](ControlMesh& m) { m.rest(2, 2) = std::numeric_limits<double>::infinity(); }),
            in + "a coordinate that is not finite");
  EXPECT_EQ(after([](ControlMesh& m) { m.domain.conservativeResize(5, 2); }),
            in + "tables of different lengths; expected one row a control point");
  EXPECT_EQ(after([](ControlMesh& m) { m.rest_slopes = MarkerPositions::Zero(5, 3); }),
            in + "5 rest slopes; expected none or two a point");
  EXPECT_EQ(after([](ControlMesh& m) { m.mouth_width = 0; }), in + "no mouth width; expected one above zero");
  for (const double times : {1e6, 1.00001, 0.99999}) {
    EXPECT_EQ(after([&](ControlMesh& m) { m.mouth_width *= times; }).substr(0, in.size() + 14), in + "a mouth width ")
        << times;
  }
  EXPECT_EQ(after([](ControlMesh& m) { m.points[unsignedIndex(findPoint(m, "LIP_CORNER_R"))].name = "X"; }),
            in + "no corners of the mouth; expected LIP_CORNER_R and LIP_CORNER_L");
  for (const std::size_t count : {std::size_t{0}, points + 1})
    EXPECT_EQ(after([&](ControlMesh& m) { m.marker_count = count; }), in + "a marker count outside the points");
  EXPECT_EQ(after([&](ControlMesh& m) { m.marker_count = markers - 1; }),
            in + "point " + sampleControl().points[markers - 1].name + " out of order; expected markers first");
  EXPECT_EQ(after([&](ControlMesh& m) { rim(m).drivers.pop_back(); }),
            in + "point RIM_UP_MID without its three lip markers");
}

/// A side of a triangle that another has already, whichever of its three it is.
TEST(ControlSurface, RefusesATriangleOverAnother) {
  const ControlMesh& good = sampleControl();
  std::set<std::pair<int, int>> edges;
  for (const auto& t : good.triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.emplace(t[k], t[(k + 1) % 3]);
  }
  const auto turnOf = [&](int a, int b, int c) {
    const Eigen::RowVector2d ab = good.domain.row(b) - good.domain.row(a), ac = good.domain.row(c) - good.domain.row(a);
    return ab.x() * ac.y() - ab.y() * ac.x();
  };
  std::size_t tried = 0;
  for (std::size_t t = 0; t < good.triangles.size(); ++t) {
    const int a = good.triangles[t][t % 3], b = good.triangles[t][(t % 3 + 1) % 3];
    for (int x = 0; x < static_cast<int>(good.points.size()); ++x) {
      const auto sideOf = [&](int point) { return good.points[static_cast<std::size_t>(point)].side; };
      const bool joins = std::set{sideOf(a), sideOf(b), sideOf(x)}.size() > 1;
      if (x == a || x == b || joins || edges.contains({b, x}) || edges.contains({x, a}) || turnOf(a, b, x) < 1)
        continue;
      for (const std::array<int, 3>& over : {std::array{a, b, x}, {b, x, a}, {x, a, b}}) {
        ControlMesh mesh = good;
        mesh.triangles.push_back(over);
        EXPECT_THROW(checkControlMesh(mesh, "x.face"), InputError);
      }
      ++tried;
      break;
    }
  }
  EXPECT_GT(tried, 20U);
}

TEST(ControlSurface, KeepsTheLayoutsTriangles) {
  const auto& face = sampleFace();
  const ControlMesh plain = buildControlMesh(face.names, face.rest, face.known);
  const auto has = [](const ControlMesh& mesh, const std::array<std::string, 3>& names) {
    return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const std::array<int, 3>& triangle) {
      return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
        return std::any_of(triangle.begin(), triangle.end(),
                           [&](int corner) { return mesh.points[static_cast<std::size_t>(corner)].name == name; });
      });
    });
  };
  // Two triangles side by side on the skin: the other diagonal.
  std::array<std::string, 3> other;
  SurfacePlan plan;
  for (std::size_t a = 0; a < plain.triangles.size() && plan.triangles.empty(); ++a) {
    for (std::size_t b = a + 1; b < plain.triangles.size() && plan.triangles.empty(); ++b) {
      std::vector<int> shared, apart;
      for (const int corner : plain.triangles[a]) {
        const auto& t = plain.triangles[b];
        (std::find(t.begin(), t.end(), corner) != t.end() ? shared : apart).push_back(corner);
      }
      for (const int corner : plain.triangles[b]) {
        const auto& t = plain.triangles[a];
        if (std::find(t.begin(), t.end(), corner) == t.end()) apart.push_back(corner);
      }
      const auto is_cheek = [&](int p) { return plain.points[static_cast<std::size_t>(p)].name.starts_with("CHEEK_"); };
      if (shared.size() != 2 || !std::any_of(shared.begin(), shared.end(), is_cheek)) continue;
      const auto place = [&](int p) -> Eigen::Vector2d { return plain.domain.row(p).transpose(); };
      const auto side = [&](int p) {
        const Eigen::Vector2d along = place(apart[1]) - place(apart[0]), to = place(p) - place(apart[0]);
        return along.x() * to.y() - along.y() * to.x();
      };
      if (side(shared[0]) * side(shared[1]) > -1) continue;  // the other diagonal lies outside, or hardly inside
      const auto name = [&](int p) { return plain.points[static_cast<std::size_t>(p)].name; };
      other = {name(apart[0]), name(apart[1]), name(shared[0])};
      plan.triangles.push_back(other);
    }
  }
  ASSERT_FALSE(plan.triangles.empty());
  SCOPED_TRACE(other[0] + " " + other[1] + " " + other[2]);
  EXPECT_FALSE(has(plain, other));
  EXPECT_TRUE(has(buildControlMesh(face.names, face.rest, face.known, nullptr, plan), other));
  plan.triangles = {{"LIP_UP_MID", "LIP_LO_MID", "CHIN_MID"}};
  EXPECT_THROW(buildControlMesh(face.names, face.rest, face.known, nullptr, plan), InputError) << "joins the lips";
  plan.triangles = {{"LIP_UP_MID", "NO_SUCH", "CHIN_MID"}};
  EXPECT_THROW(buildControlMesh(face.names, face.rest, face.known, nullptr, plan), InputError);
}

}  // namespace
}  // namespace mouthpiece
