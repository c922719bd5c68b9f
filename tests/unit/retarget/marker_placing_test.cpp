// All markers from a few anchors.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "retarget/placing/anchors.h"
#include "retarget/placing/face_page.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// The places that nobody clicked, 3.69 and 2.80 mm off when this was last set; ICT's own annotation and another one
/// differ by 2 to 4 mm. The lips should come within 2 mm.
constexpr double kMeanWithinMm = 3.69 * 1.03;
constexpr double kLipsWithinMm = 2.80 * 1.03;
/// Positions are floats, and where the skin folds the closest point jumps.
constexpr double kSameWithinMm = 0.1;
constexpr double kFoldWithinMm = 2;
constexpr double kContactWithinMm = 0.3;
constexpr double kEvenWithinMm = 0.5;  ///< the ICT head itself is symmetric to some tenths

fs::path shared(const char* name) { return fs::path(MOUTHPIECE_SOURCE_DIR) / ".." / "shared" / "faces" / name; }

/// The ten places of `retarget pick` at these vertices.
Anchors tenAnchors(const std::map<std::string, std::uint32_t>& vertices) {
  Anchors anchors;
  for (const AnchorToPick& anchor : suggestedAnchors())
    anchors.markers[std::string(anchor.name)] = vertices.at(std::string(anchor.name));
  return anchors;
}

struct IctHead {
  FaceMesh mesh = readFaceMesh(shared("ict_head.obj"));
  std::map<std::string, std::uint32_t> landmarks;
  std::map<std::string, std::uint32_t> vertices;

  IctHead() {
    const auto read = [](const fs::path& path, const char* key) {
      return nlohmann::json::parse(readFile(path)).at(key).get<std::map<std::string, std::uint32_t>>();
    };
    landmarks = read(shared("ict_head.landmarks.json"), "vertices");
    vertices = read(fs::path(MOUTHPIECE_SOURCE_DIR) / "sample_data/anchors/ict_head.anchors.json", "markers");
    for (const auto& [name, vertex] : landmarks) vertices[name] = vertex;
  }
  [[nodiscard]] Eigen::Vector3d at(std::uint32_t vertex) const {
    return mesh.vertices.row(vertex).transpose().cast<double>();
  }
};

class PlacingOnIct : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(shared("ict_head.obj"))) GTEST_SKIP() << "../shared/faces/ict_head.obj is not here";
    if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  }
};

TEST_F(PlacingOnIct, TenAnchorsBringEveryMarkerNearItsPlace) {
  const IctHead ict;
  const test::MadeUpActor actor = test::madeUpActor();
  const Anchors ten = tenAnchors(ict.vertices);
  const HeadTopology topology(ict.mesh, openingsOf(ict.mesh, ten, "ten"));
  const PlacedAnchors report = placeMarkers(ict.mesh, topology, ten, "ten", actor.names, actor.neutral_mm);
  const Anchors& placed = report.anchors;
  EXPECT_EQ(report.given, 10U);
  EXPECT_EQ(report.given - 2 + report.placed, actor.names.size());  // inner eye corners are no markers
  double sum = 0, count = 0, lips = 0, lip_count = 0;
  for (const auto& [name, vertex] : ict.landmarks) {
    if (ten.markers.contains(name)) continue;  // given, not placed
    const double off = (*placeOf(placed, name, ict.mesh, "ten") - ict.at(vertex)).norm();
    sum += off;
    count += 1;
    if (!name.starts_with("LIP_")) continue;
    lips += off;
    lip_count += 1;
  }
  RecordProperty("mean_mm", std::to_string(sum / count));
  RecordProperty("lips_mm", std::to_string(lips / lip_count));
  EXPECT_LE(sum / count, kMeanWithinMm);
  EXPECT_LE(lips / lip_count, kLipsWithinMm);
  for (const std::string& name : actor.names) {
    if (!name.ends_with("_R")) continue;
    const Eigen::Vector3d right = *placeOf(placed, name, ict.mesh, "ten");
    const Eigen::Vector3d left = *placeOf(placed, name.substr(0, name.size() - 1) + "L", ict.mesh, "ten");
    EXPECT_LT((right - left.cwiseProduct(Eigen::Vector3d(-1, 1, 1))).norm(), kEvenWithinMm) << name;
  }
}

TEST_F(PlacingOnIct, UnitAndOrientationDoNotMatter) {
  IctHead ict;
  const test::MadeUpActor actor = test::madeUpActor();
  const Anchors ten = tenAnchors(ict.vertices);
  FitRequest request;
  request.marker_names = actor.names;
  request.actor_neutral_mm = actor.neutral_mm;
  FaceMesh upright = ict.mesh;
  const FaceFile wanted = fitFace(upright, ten, "ten", request);
  // In metres, lying on its back with Z up.
  Eigen::Matrix3d turn;
  turn << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  FaceMesh lying = ict.mesh;
  lying.vertices = (0.001F * (lying.vertices * turn.cast<float>().transpose())).eval();
  const FaceFile found = fitFace(lying, ten, "ten", request);
  EXPECT_TRUE((found.upright_from_mesh * turn).isIdentity(1e-12));
  EXPECT_EQ(found.metres_per_unit, 1);
  EXPECT_EQ(wanted.metres_per_unit, 0.001);
  const Eigen::VectorXd off = (1000 * found.marker_targets - wanted.marker_targets).rowwise().norm();
  EXPECT_LT(off.mean(), kSameWithinMm);
  EXPECT_LT(off.maxCoeff(), kFoldWithinMm);
}

void expectLipsToMeet(IctHead ict, const Anchors& anchors) {
  const test::MadeUpActor actor = test::madeUpActor();
  FitRequest request;
  request.marker_names = actor.names;
  request.actor_neutral_mm = actor.neutral_mm;
  const FaceFile face = fitFace(ict.mesh, anchors, "all", request);
  const MarkerPositions closed = face.marker_targets + closingOffsets(face.control);
  const FaceDeformer deformer(ict.mesh, face.control, face.binding);
  VertexPositions moved;
  deformer.deform(closed, {}, moved);
  double apart_at_rest = 0;
  for (const std::string end : {"IN_R", "MID", "IN_L"}) {
    const std::uint32_t upper = ict.vertices.at("RIM_UP_" + end), lower = ict.vertices.at("RIM_LO_" + end);
    apart_at_rest = std::max(apart_at_rest, ict.at(upper).y() - ict.at(lower).y());
    const double gap = static_cast<double>(moved(upper, 1) - moved(lower, 1));
    EXPECT_LT(gap, kContactWithinMm) << end;
    EXPECT_GT(gap, -kContactWithinMm) << end;
  }
  EXPECT_GT(apart_at_rest, 0.5);
}

/// The actor's neutral mouth is closed; the ICT head's lips are most of a millimetre apart.
TEST_F(PlacingOnIct, LipsMeetWhereTheActorsDo) {
  const IctHead ict;
  Anchors anchors;
  for (const auto& [name, vertex] : ict.vertices) anchors.markers[name] = vertex;
  expectLipsToMeet(ict, anchors);
}

TEST_F(PlacingOnIct, LipsMeetThoughTheirRimsAreNotGiven) {
  const IctHead ict;
  Anchors anchors;
  for (const std::string& name : test::madeUpActor().names) anchors.markers[name] = ict.vertices.at(name);
  expectLipsToMeet(ict, anchors);
}

Eigen::Vector3d mirroredAcrossX(const Eigen::Vector3d& p) { return {-p.x(), p.y(), p.z()}; }

/// Ten clicks on ICT's head, whose middle is at x = 0; those on the right 1.5 mm higher than they should be.
Anchors crookedClicks(const IctHead& ict) {
  Anchors ten;
  for (const auto& [name, place] : tenAnchors(ict.vertices).markers) {
    const Eigen::Vector3d at = ict.at(std::get<std::uint32_t>(place));
    ten.markers[name] = name.ends_with("_R") ? Eigen::Vector3d(at + Eigen::Vector3d(0, 1.5, 0)) : at;
  }
  return ten;
}

/// How far from the mirror image of its other side, or of itself, a marker was placed, and its name.
std::pair<double, std::string> mostUneven(const FaceFile& face) {
  std::pair<double, std::string> most{0, ""};
  for (std::size_t i = 0; i < face.marker_names.size(); ++i) {
    std::string other = face.marker_names[i];
    if (other.ends_with("_R"))
      other.back() = 'L';
    else if (other.ends_with("_L"))
      other.back() = 'R';
    const auto j = std::find(face.marker_names.begin(), face.marker_names.end(), other) - face.marker_names.begin();
    const Eigen::Vector3d here = face.marker_targets.row(signedIndex(i)), there = face.marker_targets.row(j);
    most = std::max(most, {(here - mirroredAcrossX(there)).norm(), face.marker_names[i]});
  }
  return most;
}

/// Measured: 0.14 mm from their mirror images, 1.5 mm without evening out.
TEST_F(PlacingOnIct, AnEvenHeadGetsEvenMarkersFromCrookedClicks) {
  IctHead ict;
  const test::MadeUpActor actor = test::madeUpActor();
  FitRequest request;
  request.marker_names = actor.names;
  request.actor_neutral_mm = actor.neutral_mm;
  const FaceFile face = fitFace(ict.mesh, crookedClicks(ict), "ten", request);
  const auto [off, name] = mostUneven(face);
  EXPECT_LT(off, kEvenWithinMm) << name;
}

/// Its mouth's right half hangs up to 4 mm lower: there the clicks say more than the other side does.
TEST_F(PlacingOnIct, ACrookedMouthKeepsItsClicks) {
  IctHead ict;
  const Anchors ten = tenAnchors(ict.vertices);
  const Eigen::Vector3d right = *placeOf(ten, "LIP_CORNER_R", ict.mesh, "ten"),
                        left = *placeOf(ten, "LIP_CORNER_L", ict.mesh, "ten");
  const double width = (left - right).norm();
  for (Eigen::Index v = 0; v < ict.mesh.vertices.rows(); ++v) {
    const double away = (ict.at(static_cast<std::uint32_t>(v)) - right).norm() / width;
    ict.mesh.vertices(v, 1) -= static_cast<float>(4 * std::exp(-12 * away * away));
  }
  const Eigen::Vector3d lower = *placeOf(ten, "LIP_CORNER_R", ict.mesh, "ten");
  const test::MadeUpActor actor = test::madeUpActor();
  const HeadTopology topology(ict.mesh, openingsOf(ict.mesh, ten, "ten"));
  const Anchors placed = placeMarkers(ict.mesh, topology, ten, "ten", actor.names, actor.neutral_mm).anchors;
  EXPECT_NEAR(placeOf(placed, "LIP_CORNER_R", ict.mesh, "ten")->y(), lower.y(), 1);
}

TEST(MarkerPlacing, TurnsAreQuarterTurnsUnlessTheHeadStandsAskew) {
  Similarity tilted;
  tilted.turn = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()).toRotationMatrix();
  EXPECT_TRUE(uprightFromMesh(tilted).isIdentity(0));
  tilted.turn = Eigen::AngleAxisd(0.75, Eigen::Vector3d(1, 1, 1).normalized()).toRotationMatrix();
  EXPECT_TRUE((uprightFromMesh(tilted) * tilted.turn).isIdentity(1e-12));
}

TEST(MarkerPlacing, SaysWhichAnchorsAreWanted) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  const test::MadeUpActor actor = test::madeUpActor();
  Anchors few = test::defaultFace().anchors;
  few.markers.erase("LIP_UP_MID");
  const FaceMesh& mesh = test::defaultFace().mesh;
  try {
    (void)placeMarkers(mesh, HeadTopology(mesh, {}), few, "few.json", actor.names, actor.neutral_mm);
    FAIL() << "expected an InputError";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("missing: LIP_UP_MID"), std::string::npos) << error.what();
  }
}

TEST(FacePage, HoldsTheMeshAndNothingThatCouldRun) {
  FaceMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  mesh.triangles = {{0, 1, 2}};
  mesh.parts = {{.name = "</script><script>alert(1)", .triangle_count = 1}};
  Anchors shown;
  shown.markers["NOSE_TIP"] = Eigen::Vector3d(0, 0, 0);
  const std::string page = facePage(mesh, "</script>", shown, suggestedAnchors());
  EXPECT_EQ(page.find("alert(1)") == std::string::npos, false);
  EXPECT_EQ(page.find("<script>alert"), std::string::npos);
  EXPECT_NE(page.find("AAAAAAEAAAACAAAA"), std::string::npos);  // 0 1 2 as 32-bit numbers
  EXPECT_NE(page.find("CANTHUS_OUT_R"), std::string::npos);
  EXPECT_NE(page.find("Content-Security-Policy\" content=\"default-src 'none'"), std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
