#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "deform/surface/binding.h"
#include "deform/surface/virtual_points.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_judge.h"
#include "support/run_program.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

/// The default face, in poses of which one thing alone is wrong by a little more than its limit, and in their
/// neighbours, where it is a little less. Limits are written out: a test that asked the judge would go along with any.
class FaceLimitsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
    if (file_.marker_names.empty()) file_ = test::fittedDefaultFace(mesh_);
  }

  static std::vector<FaceJudgement> judged(const std::vector<VertexPositions>& poses) {
    return judgeShapes(FaceRig::of(file_, mesh_, "default.face"), file_, poses,
                       std::vector<JudgedPoses::Row>(poses.size(), {"the made pose", true}));
  }

  /// The one fault of `found`, whose limit has the name and which tells the pose.
  static FaceFault onlyFault(const FaceJudgement& found, std::string_view limit) {
    EXPECT_EQ(found.faults.size(), 1U) << limit;
    if (found.faults.empty()) return {};
    EXPECT_EQ(found.faults[0].limit, limit) << found.faults[0].what;
    EXPECT_NE(found.faults[0].what.find("in the made pose"), std::string::npos) << found.faults[0].what;
    EXPECT_EQ(found.faults[0].pose, 0U);
    return found.faults[0];
  }

  /// `part` comes out of the mouth, step by step: what `measured` tells passes half a millimetre, and from there on the
  /// limit is broken, at the mouth.
  static void comesOut(PartKind part, const Vector3d& from, double to, double FaceJudgement::*measured,
                       std::string_view limit) {
    constexpr double kLimitMm = 0.5, kStepMm = 0.05, kNearMm = 0.15;
    std::set<std::uint32_t> own;
    for (const Triangle& t : trianglesOf(mesh_, {part})) own.insert(t.begin(), t.end());
    ASSERT_FALSE(own.empty());
    std::vector<VertexPositions> poses;
    for (double out = from.z(); out < to; out += kStepMm) {
      poses.push_back(mesh_.vertices);
      for (const std::uint32_t v : own) poses.back().row(v) += Vector3d(0, from.y(), out).transpose().cast<float>();
    }
    const std::vector<FaceJudgement> found = judged(poses);
    const auto beyond =
        std::find_if(found.begin(), found.end(), [&](const FaceJudgement& f) { return f.*measured > kLimitMm; });
    ASSERT_NE(beyond, found.end());
    ASSERT_NE(beyond, found.begin());
    const FaceJudgement& within = *(beyond - 1);
    EXPECT_GT(within.*measured, kLimitMm - kNearMm);
    EXPECT_LT((*beyond).*measured, kLimitMm + kNearMm);
    for (const FaceFault& fault : within.faults) ADD_FAILURE() << fault.what;
    EXPECT_FALSE(onlyFault(*beyond, limit).triangles.empty());
  }

  /// Skin that hangs on the surface, further than a mouth's width from the mouth.
  static bool isCheek(std::uint32_t v) {
    const Vector3d mouth = file_.control.rest.row(findPoint(file_.control, "RIM_UP_MID")).transpose();
    return file_.binding.patch[v] >= 0 && file_.binding.skin_weight[v] > 0 &&
           (pointAt(mesh_.vertices, v) - mouth).norm() > file_.control.mouth_width;
  }

  static inline FaceMesh mesh_;  // fitted once
  static inline FaceFile file_;
};

TEST_F(FaceLimitsTest, ALipInTheTeeth) {
  comesOut(PartKind::kUpperTeeth, {0, 0, 6}, 8, &FaceJudgement::in_teeth_mm, "lips in the teeth");
}

TEST_F(FaceLimitsTest, ALipInTheTongue) {
  comesOut(PartKind::kTongue, {0, 6, 15}, 20, &FaceJudgement::in_tongue_mm, "lips in the tongue");
}

/// One vertex is drawn out of the cheek until its shortest edge, which counts as 2 mm at least, is three times as long.
TEST_F(FaceLimitsTest, AnEdgeThatIsDrawnOut) {
  constexpr double kLimit = 3, kNear = 0.05, kLeastMm = 2, kMostGrowthMm = 4.8;
  const std::vector<Triangle> skin = trianglesOf(mesh_, {PartKind::kSkin});
  const VertexPositions normals = vertexNormals(mesh_.vertices, mesh_.triangles);
  struct Drawn {
    double times = 0, growth_mm = 0;
    std::uint32_t other = 0;  ///< end of the edge that gets so many times as long
  };
  const auto drawn = [&](std::uint32_t v, double out_mm) {
    Drawn most;
    const Vector3d from = pointAt(mesh_.vertices, v), now = from + out_mm * normals.row(v).transpose().cast<double>();
    for (const Triangle& t : skin) {
      if (std::find(t.begin(), t.end(), v) == t.end()) continue;
      for (const std::uint32_t other : t) {
        if (other == v) continue;
        const Vector3d end = pointAt(mesh_.vertices, other);
        const double before = (from - end).norm(), after = (now - end).norm();
        most.growth_mm = std::max(most.growth_mm, after - before);
        const double times = std::max(after, kLeastMm) / std::max(before, kLeastMm);
        if (times > most.times) std::tie(most.times, most.other) = std::pair(times, other);
      }
    }
    return most;
  };
  const auto outFor = [&](std::uint32_t v, double times) {
    double out_mm = 0;
    while (drawn(v, out_mm).times < times) out_mm += 0.005;
    return out_mm;
  };
  std::uint32_t v = 0;
  while (v < mesh_.vertexCount() && !(isCheek(v) && drawn(v, outFor(v, kLimit + kNear)).growth_mm < kMostGrowthMm)) ++v;
  ASSERT_LT(v, mesh_.vertexCount());
  std::vector<VertexPositions> poses;
  for (const double times : {kLimit - kNear, kLimit + kNear}) {
    poses.push_back(mesh_.vertices);
    poses.back().row(v) += asFloat(outFor(v, times)) * normals.row(v);
  }
  const std::vector<FaceJudgement> found = judged(poses);
  for (const FaceFault& fault : found[0].faults) ADD_FAILURE() << fault.what;
  EXPECT_NEAR(found[0].edge_ratio, kLimit - kNear, 0.01);
  EXPECT_NEAR(found[1].edge_ratio, kLimit + kNear, 0.01);
  const FaceFault fault = onlyFault(found[1], "edge length");
  const std::uint32_t other = drawn(v, outFor(v, kLimit + kNear)).other;
  EXPECT_NE(fault.what.find(fmt::format("vertex {} beside", std::min(v, other))), std::string::npos) << fault.what;
  const auto hasVertex = [&](std::uint32_t t) {
    return std::find(mesh_.triangles[t].begin(), mesh_.triangles[t].end(), v) != mesh_.triangles[t].end();
  };
  EXPECT_TRUE(std::any_of(fault.triangles.begin(), fault.triangles.end(), hasVertex));
}

/// A corner of one triangle goes over to the other side of the opposite edge; those around it keep their sides.
TEST_F(FaceLimitsTest, ATriangleThatIsTurnedOver) {
  constexpr double kLimitMm2 = 4, kNearMm2 = 0.3, kOver = 0.25;
  struct Turned {
    std::uint32_t triangle;
    double area_mm2;
  };
  std::vector<Turned> turned;
  std::vector<VertexPositions> poses;
  for (std::uint32_t i = 0; i < mesh_.triangles.size() && poses.size() < 40; ++i) {
    const Triangle& t = mesh_.triangles[i];
    if (!std::all_of(t.begin(), t.end(), isCheek)) continue;
    const Vector3d a = pointAt(mesh_.vertices, t[0]), b = pointAt(mesh_.vertices, t[1]),
                   c = pointAt(mesh_.vertices, t[2]);
    const double area_mm2 = 0.5 * (b - a).cross(c - a).norm();
    if (std::abs(area_mm2 - kLimitMm2) > kNearMm2) continue;
    const Vector3d height = (c - a) - (c - a).dot((b - a).normalized()) * (b - a).normalized();
    turned.push_back({i, area_mm2});
    poses.push_back(mesh_.vertices);
    poses.back().row(t[2]) = (c - (1 + kOver) * height).transpose().cast<float>();
  }
  const std::vector<FaceJudgement> found = judged(poses);
  std::size_t within = 0, beyond = 0;
  for (std::size_t k = 0; k < found.size(); ++k) {
    // Beside long triangles others turn over, too.
    if (std::abs(found[k].turned_over_mm2 - turned[k].area_mm2) > 1e-3) continue;
    if (turned[k].area_mm2 < kLimitMm2) {
      ++within;
      for (const FaceFault& fault : found[k].faults) ADD_FAILURE() << fault.what;
    } else {
      ++beyond;
      const FaceFault fault = onlyFault(found[k], "triangles turned over");
      EXPECT_EQ(fault.triangles, std::vector{turned[k].triangle});
      const std::string place = fmt::format("vertex {} beside", mesh_.triangles[turned[k].triangle][0]);
      EXPECT_NE(fault.what.find(place), std::string::npos) << fault.what;
    }
  }
  EXPECT_GT(within, 2U);
  EXPECT_GT(beyond, 2U);
}

/// One vertex in twenty hangs on nothing, all over the face.
TEST_F(FaceLimitsTest, SkinThatHangsOnNothing) {
  constexpr double kLimit = 0.95;
  const auto unbound = [&](std::size_t count) {
    FaceFile face = file_;
    // A step that has no divisor in common with their number comes to all of them, far apart from each other.
    const std::size_t all = mesh_.vertexCount(), step = 7919;
    for (std::size_t i = 0; i < count; ++i) face.binding.patch[i * step % all] = -1;
    return face;
  };
  const auto coverage = [&](std::size_t count) {
    return inspectBinding(unbound(count).binding, mesh_, file_.control).coverage;
  };
  ASSERT_GT(coverage(0), kLimit);
  std::size_t within = 0, beyond = mesh_.vertexCount() / 10;
  ASSERT_LT(coverage(beyond), kLimit);
  while (beyond - within > 1) {
    const std::size_t middle = (within + beyond) / 2;
    (coverage(middle) < kLimit ? beyond : within) = middle;
  }
  for (const std::string& fault : faultsOf(checkFace(unbound(within), mesh_))) ADD_FAILURE() << fault;
  const std::vector<std::string> faults = faultsOf(checkFace(unbound(beyond), mesh_));
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_TRUE(faults[0].starts_with("the surface moves 95.0 % of the face; expected 95 %")) << faults[0];
}

/// The guide's table is the code's.
TEST(FaceLimits, StandInTheGuide) {
  const std::string guide = test::readAll(std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "docs/guides/fit_a_face.md");
  const std::size_t table = guide.find("| judged | limit |");
  ASSERT_NE(table, std::string::npos);
  const std::string rows = guide.substr(table, guide.find("\n\n", table) - table);
  for (const FaceLimit& limit : faceLimits()) {
    const std::string row = fmt::format("\n| {} | {} {}{}{} |", limit.name, limit.at_least ? "at least" : "at most",
                                        limit.limit, limit.unit.empty() ? "" : " ", limit.unit);
    EXPECT_NE(rows.find(row), std::string::npos) << row;
  }
  EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 1 + static_cast<std::ptrdiff_t>(faceLimits().size()));
}

/// A click far off the skin folds the warp, not the other way round.
TEST(FaultsOf, AnAnchorOffTheSkinComesFirst) {
  FaceCheck check;
  check.binding.coverage = check.binding.way_between_lips = 1;
  check.marker_to_surface_max_mm = 26;
  check.farthest_marker = "NOSE_TIP";
  check.fold_overs = 3;
  const std::vector<std::string> faults = faultsOf(check);
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_TRUE(faults.front().starts_with("NOSE_TIP lies 26.0 mm off the skin")) << faults.front();
}

/// Lips that hang together deep behind their edges go a long way round, and yet do not close.
TEST(FaultsOf, LipsThatHangTogetherAreToldWhereTheyDoNotClose) {
  FaceCheck check;
  check.binding.coverage = check.binding.way_between_lips = 1;
  FaceJudgement judged;
  judged.faults.emplace_back();
  judged.faults[0].limit = "closures";
  judged.faults[0].what = "0 of 39 touch";
  EXPECT_EQ(faultsOf(check, judged), std::vector<std::string>{"0 of 39 touch"});
  check.binding.lips_are_one = true;
  EXPECT_EQ(faultsOf(check, judged).at(0),
            "0 of 39 touch; the lips hang together behind the line between them: `retarget cut` opens the mesh there");
}

TEST(FaultsOf, SkinThatIsLeftOutIsToldByItsPart) {
  FaceCheck check;
  check.binding.way_between_lips = 1;
  check.binding.coverage = 0.7;
  check.left_out = {"Material.007", false, 90, 100, 0.02, 40};
  EXPECT_EQ(faultsOf(check).at(0),
            "the surface moves 70.0 % of the face; expected 95 %: of 100 vertices that it leaves out 90 are of "
            "'Material.007', half of them over 0.02 mouth widths off it or turned by over 40 degrees against it; if "
            "that is no skin, say what it is in the anchors file's `parts`");
  const auto remedy = [&](double distance, double angle) {
    check.left_out = {"head", true, 90, 100, distance, angle};
    const std::string told = faultsOf(check).at(0);
    return told.substr(told.rfind("; ") + 2);
  };
  EXPECT_EQ(remedy(0.02, 150), "do its normals point inward?");
  EXPECT_EQ(remedy(0.02, 80), "check the anchors there, or allow a larger angle");
  EXPECT_EQ(remedy(0.02, 40), "check the anchors, or whether the largest angle allowed is too small");
  EXPECT_EQ(remedy(0.4, 40), "check the anchors there");
}

}  // namespace
}  // namespace mouthpiece
