#include "retarget/rig/face_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>

#include "base/files.h"
#include "base/index.h"
#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/virtual_points.h"
#include "retarget/rig/face_rig.h"
#include "support/run_program.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

constexpr double kTouch_mm = 0.3;  // of the issue: lips that touch in the capture touch on the head

/// The default face; how far its lips are apart, and in each other, in a pose.
class LipContactTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
    if (file_.marker_names.empty()) file_ = test::fittedDefaultFace(mesh_);
  }

  /// Markers of the lower lip and chin lowered.
  [[nodiscard]] static MarkerPositions lowered(double mm) {
    MarkerPositions pose = file_.marker_targets;
    for (std::size_t i = 0; i < file_.marker_names.size(); ++i) {
      const std::string& name = file_.marker_names[i];
      // Towards the corners lips are thinner and part less far.
      const double share = name.starts_with("LIP_LO_OUT")                           ? 0.4
                           : name.starts_with("LIP_LO") || name.starts_with("CHIN") ? 1
                                                                                    : 0;
      pose(static_cast<Eigen::Index>(i), 1) -= share * mm;
    }
    return pose;
  }

  [[nodiscard]] static VertexPositions deformed(const FaceDeformer& deformer, const MarkerPositions& pose,
                                                double slack_mm) {
    std::vector<LipGap> lips;
    const std::vector<LipPair> pairs = lipPairs(file_.control);
    const auto height = [](const MarkerPositions& markers, const LipPair& pair) {
      return (markers.row(pair.upper_marker) - markers.row(pair.lower_marker)).norm();
    };
    // Lips of half the height stretch by half as much.
    for (const LipPair& pair : pairs) {
      lips.push_back({.opened = partedShare(height(pose, pair) / height(file_.marker_targets, pair) - 1,
                                            slack_mm / height(file_.marker_targets, pairs[2]))});
    }
    VertexPositions out;
    deformer.deform({pose, lips}, {}, out);
    return out;
  }

  /// The lower lip moved up as a whole, by what hangs on its patches.
  [[nodiscard]] static VertexPositions withLowerLipAt(double mm) {
    VertexPositions moved = mesh_.vertices;
    for (std::size_t v = 0; v < file_.binding.patch.size(); ++v) {
      const int patch = file_.binding.patch[v];
      if (patch >= 0 && file_.control.sideOf(static_cast<std::size_t>(patch)) == LipSide::kLower)
        moved(static_cast<Eigen::Index>(v), 1) += static_cast<float>(mm);
    }
    return moved;
  }

  static inline FaceMesh mesh_;  // fitted once
  static inline FaceFile file_;
};

TEST_F(LipContactTest, GapsWiderThanIsAskedForChangeNothingElse) {
  constexpr double kWidest = 2;
  const LipContactMeter meter(mesh_, file_.control);
  for (const double shift : {-6.0, 0.0, 1.0}) {
    const VertexPositions moved = withLowerLipAt(shift);
    const LipContact whole = meter.measure(moved), near = meter.measure(moved, kWidest);
    for (std::size_t c = 0; c < LipContact::kColumns; ++c)
      EXPECT_EQ(near.gaps[c], std::min(whole.gaps[c], kWidest)) << shift << " mm, column " << c;
    EXPECT_EQ(whole.gap > kWidest, shift < 0);
    EXPECT_EQ(whole.overlap > 0.5, shift > 0);
    EXPECT_EQ(near.overlaps, whole.overlaps);
    EXPECT_EQ(near.seeming_overlap, whole.seeming_overlap);
    EXPECT_EQ(near.in_teeth, whole.in_teeth);
    EXPECT_EQ(*std::max_element(near.slits.begin(), near.slits.end()), 0) << "not asked for";
  }
}

TEST_F(LipContactTest, TheMeterSeesAGapAndAnOverlapThatWereMade) {
  const LipContactMeter meter(mesh_, file_.control);
  const LipContact at_rest = meter.measure(mesh_.vertices);
  EXPECT_NEAR(at_rest.gap, 0, 0.05);
  EXPECT_LT(at_rest.overlap, 0.2);
  EXPECT_EQ(at_rest.in_teeth, 0);
  for (const double shift : {-2.0, 1.0}) {
    const LipContact contact = meter.measure(withLowerLipAt(shift));
    if (shift < 0) {
      EXPECT_NEAR(contact.gap, -shift, 0.5);
    } else {
      EXPECT_NEAR(contact.overlap, shift, 0.5);
    }
  }
}

/// A tooth that stands out of a lip's front is seen, though both face forward.
TEST_F(LipContactTest, TheMeterSeesAToothThatStandsOutOfALip) {
  constexpr float kHalf = 1, kBehind = 6, kOut = 2;
  // MediaPipe's, in the middle of the lips' red.
  for (const auto& [lip, jaw] : {std::pair(11U, PartKind::kUpperTeeth), std::pair(16U, PartKind::kLowerTeeth)}) {
    const auto first = static_cast<std::uint32_t>(mesh_.vertexCount());
    FaceMesh with_tooth = mesh_;
    with_tooth.vertices.conservativeResize(mesh_.vertices.rows() + 3, 3);
    const Eigen::RowVector3f place = mesh_.vertices.row(lip) - Eigen::RowVector3f(0, 0, kBehind);
    with_tooth.vertices.row(first) = place + Eigen::RowVector3f(-kHalf, 0, 0);
    with_tooth.vertices.row(first + 1) = place + Eigen::RowVector3f(kHalf, 0, 0);
    with_tooth.vertices.row(first + 2) = place + Eigen::RowVector3f(0, kHalf, 0);
    MeshPart part = mesh_.parts.front();
    part.kind = jaw;
    part.first_triangle = with_tooth.triangles.size();
    part.triangle_count = 1;
    with_tooth.parts.push_back(part);
    with_tooth.triangles.push_back({first, first + 1, first + 2});
    const LipContactMeter meter(with_tooth, file_.control);
    EXPECT_EQ(meter.measure(with_tooth.vertices).in_teeth, 0);
    VertexPositions moved = with_tooth.vertices;
    moved.bottomRows(3).col(2).array() += kBehind + kOut;
    const double out = meter.measure(moved).in_teeth;
    EXPECT_GT(out, 0.5 * double{kOut}) << lip;
    EXPECT_LT(out, 1.5 * double{kOut}) << lip;
    moved.bottomRows(3).col(1).array() += jaw == PartKind::kUpperTeeth ? -20 : 20;
    EXPECT_EQ(meter.measure(moved).in_teeth, 0) << "between the lips or before the other one";
  }
}

/// On coarse heads triangles reach across the seam of the lips.
TEST_F(LipContactTest, ATriangleAcrossTheSeamIsOfTheLipThatIsNearer) {
  // MediaPipe's landmarks of both rims, beside the middle of the mouth.
  constexpr std::uint32_t kUpper[] = {81, 82}, kLower = 178;
  FaceMesh webbed = mesh_;
  MeshPart part = mesh_.parts.front();
  part.kind = PartKind::kSkin;
  part.first_triangle = webbed.triangles.size();
  part.triangle_count = 1;
  webbed.parts.push_back(part);
  webbed.triangles.push_back({kUpper[0], kUpper[1], kLower});
  VertexPositions opened = mesh_.vertices;
  constexpr float kApart = 3;
  for (std::size_t v = 0; v < file_.binding.patch.size(); ++v) {
    const int patch = file_.binding.patch[v];
    if (patch >= 0 && file_.control.sideOf(static_cast<std::size_t>(patch)) == LipSide::kLower)
      opened(static_cast<Eigen::Index>(v), 1) -= kApart;
  }
  // Beyond the place where they hang together, which is nearer to a corner than to the middle, lips are one.
  const auto across = [&](const char* name) { return file_.control.rest(findPoint(file_.control, name), 0); };
  const double right = across("LIP_CORNER_R"), width = across("LIP_CORNER_L") - right;
  const double way = (double{mesh_.vertices(kLower, 0)} - right) / width;
  const auto isBetween = [&](std::size_t column) {
    const double middle = 0.25 + 0.05 * (static_cast<double>(column) + 0.5);
    return way < 0.5 ? middle > way : middle < way;
  };
  const auto leastGap = [&](const FaceMesh& mesh) {
    const LipContact contact = LipContactMeter(mesh, file_.control).measure(opened);
    double least = contact.gap;
    for (std::size_t c = 0; c < LipContact::kColumns; ++c) {
      if (isBetween(c)) least = std::min(least, contact.gaps[c]);
    }
    return least;
  };
  EXPECT_GT(leastGap(mesh_), 0.5 * double{kApart});
  EXPECT_LT(leastGap(webbed), 0.5 * double{kApart}) << "the upper lip's triangle hangs down to the lower rim";
  EXPECT_GT(leastGap(webbed), 0.1) << "where they hang together they do not touch";
}

TEST_F(LipContactTest, TheMeterLooksThroughASlitBesideATouch) {
  const LipContactMeter meter(mesh_, file_.control);
  const auto tallest = [](const LipContact& contact) {
    return *std::max_element(contact.slits.begin(), contact.slits.end());
  };
  EXPECT_LT(tallest(meter.measure(mesh_.vertices)), 0.1);
  // Both lips part within a millimetre of the middle, or of a place beside a corner: the columns there touch beside it.
  constexpr float kPartedHalf = 1.2F, kEach = 0.6F;
  const auto across = [&](const char* name) { return file_.control.rest(findPoint(file_.control, name), 0); };
  const double right = across("LIP_CORNER_R"), width = across("LIP_CORNER_L") - right;
  for (const double share : {0.5, 0.23, 0.77}) {
    const auto place = static_cast<float>(right + share * width);
    VertexPositions moved = mesh_.vertices;
    for (std::size_t v = 0; v < file_.binding.patch.size(); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      const int patch = file_.binding.patch[v];
      if (patch < 0 || std::abs(moved(row, 0) - place) > kPartedHalf) continue;
      const LipSide side = file_.control.sideOf(static_cast<std::size_t>(patch));
      if (side == LipSide::kUpper) moved(row, 1) += kEach;
      if (side == LipSide::kLower) moved(row, 1) -= kEach;
    }
    const LipContact contact = meter.measure(moved);
    EXPECT_LT(contact.gap, kTouch_mm) << share;
    EXPECT_GT(tallest(contact), 0.5) << share;
    EXPECT_LT(tallest(contact), 2 * double{kEach} + 0.1) << share;
  }
}

/// A strip of the upper lip hangs from one place of its rim in front of the lower lip, beside that place under its rim
/// alone: over it one looks into the mouth.
TEST_F(LipContactTest, TheMeterLooksOverAStripThatHangsLower) {
  constexpr std::uint32_t kRim = 81;  // MediaPipe's, on the upper lip's rim
  constexpr float kOpen = 3, kAside = 4, kLong = 8, kLow = 3, kHigh = 1;
  const auto first = static_cast<std::uint32_t>(mesh_.vertexCount());
  FaceMesh with_strip = mesh_;
  with_strip.vertices.conservativeResize(mesh_.vertices.rows() + 4, 3);
  const Eigen::RowVector3f rim = mesh_.vertices.row(kRim);
  for (std::uint32_t v = first; v < first + 4; ++v) with_strip.vertices.row(v) = rim + Eigen::RowVector3f(0, 1, 0);
  MeshPart part = mesh_.parts.front();
  part.kind = PartKind::kSkin;
  part.first_triangle = with_strip.triangles.size();
  part.triangle_count = 3;
  with_strip.parts.push_back(part);
  with_strip.triangles.push_back({kRim, first, first + 1});
  with_strip.triangles.push_back({first, first + 1, first + 2});
  with_strip.triangles.push_back({first + 1, first + 2, first + 3});
  VertexPositions moved = with_strip.vertices;
  for (std::size_t v = 0; v < file_.binding.patch.size(); ++v) {
    const int patch = file_.binding.patch[v];
    if (patch >= 0 && file_.control.sideOf(static_cast<std::size_t>(patch)) == LipSide::kLower)
      moved(static_cast<Eigen::Index>(v), 1) -= kOpen;
  }
  const float towards = rim.x() < 0 ? 1.0F : -1.0F;
  for (std::uint32_t i = 0; i < 4; ++i)
    moved.row(first + i) =
        rim + Eigen::RowVector3f(towards * (i < 2 ? kAside : kLong), -kOpen - (i % 2 == 0 ? kHigh : kLow), 1);
  const auto across = [&](const char* name) { return file_.control.rest(findPoint(file_.control, name), 0); };
  const double right = across("LIP_CORNER_R"), width = across("LIP_CORNER_L") - right;
  const double way = (double{rim.x() + towards * 0.5F * (kAside + kLong)} - right) / width;
  const auto column = static_cast<std::size_t>((way - 0.25) / 0.5 * double{LipContact::kColumns});
  ASSERT_LT(column, LipContact::kColumns);
  EXPECT_GT(LipContactMeter(with_strip, file_.control).measure(moved).slits[column], 0.5 * double{kOpen});
}

/// On coarse heads the mouth's corners lie further in than the markers tell: beyond them lips are one, whatever lies
/// how far from what.
TEST_F(LipContactTest, BeyondAMeshsOwnCornersLipsDoNotPart) {
  constexpr std::uint32_t kUpper = 82, kLower = 87;  // MediaPipe's, opposite each other on the rims
  constexpr float kOpen = 3;
  FaceMesh joined = mesh_;
  for (Triangle& t : joined.triangles) std::replace(t.begin(), t.end(), kLower, kUpper);
  VertexPositions opened = mesh_.vertices;
  for (std::size_t v = 0; v < file_.binding.patch.size(); ++v) {
    const int patch = file_.binding.patch[v];
    if (patch >= 0 && file_.control.sideOf(static_cast<std::size_t>(patch)) == LipSide::kLower)
      opened(static_cast<Eigen::Index>(v), 1) -= kOpen;
  }
  const auto across = [&](const char* name) { return file_.control.rest(findPoint(file_.control, name), 0); };
  const double right = across("LIP_CORNER_R"), width = across("LIP_CORNER_L") - right;
  const double way = (double{mesh_.vertices(kUpper, 0)} - right) / width;
  ASSERT_GT(std::abs(way - 0.5), 0.05);
  ASSERT_LT(std::abs(way - 0.5), 0.2);
  const LipContact apart = LipContactMeter(mesh_, file_.control).measure(opened),
                   beside = LipContactMeter(joined, file_.control).measure(opened);
  for (std::size_t c = 0; c < LipContact::kColumns; ++c) {
    const double from = 0.25 + 0.05 * static_cast<double>(c), to = from + 0.05;
    EXPECT_GT(apart.gaps[c], 1) << c;
    const bool is_beyond = way < 0.5 ? to <= way : from >= way;
    if (is_beyond) {
      EXPECT_EQ(beside.gaps[c], 0) << c;
      EXPECT_GT(beside.slits[c], 0.5) << "what one looks through is a slit still";
    } else if (way < 0.5 ? from >= way : to <= way) {
      EXPECT_GT(beside.gaps[c], 0.1) << c;
    }
  }
  VertexPositions crossed = withLowerLipAt(1);
  crossed.row(kLower) = crossed.row(kUpper);
  const LipContact two = LipContactMeter(mesh_, file_.control).measure(crossed),
                   one = LipContactMeter(joined, file_.control).measure(crossed);
  double beyond = 0, between = 0, seen = 0;
  for (std::size_t c = 0; c < kLipColumns; ++c) {
    const double from = asReal(c) / asReal(kLipColumns), to = asReal(c + 1) / asReal(kLipColumns);
    const bool is_beyond = way < 0.5 ? to <= way : from >= way;
    (is_beyond ? beyond : between) = std::max(is_beyond ? beyond : between, one.overlaps[c]);
    if (is_beyond) seen = std::max(seen, two.overlaps[c]);
  }
  EXPECT_GT(seen, 0.5);
  EXPECT_EQ(beyond, 0) << "one surface that folds";
  EXPECT_GT(between, 0.5);
}

TEST_F(LipContactTest, LipsTouchUntilTheyHaveStretchedAndNeverPass) {
  const LipContactMeter meter(mesh_, file_.control);
  const FaceDeformer deformer(mesh_, file_.control, file_.binding);
  constexpr double kSlack_mm = 3.5;
  for (const double opening : {-2.0, -1.0, 0.0, 1.0, 2.0, 3.0}) {
    const LipContact contact = meter.measure(deformed(deformer, lowered(opening), kSlack_mm));
    EXPECT_LT(contact.gap, kTouch_mm) << opening;
    EXPECT_LT(contact.overlap, kTouch_mm) << opening;
    EXPECT_LT(contact.in_teeth, kTouch_mm) << opening;
  }
  EXPECT_GT(meter.measure(deformed(deformer, lowered(9), kSlack_mm)).gap, 5);
}

TEST_F(LipContactTest, TheGuardPushesLipsOutOfEachOther) {
  const LipContactMeter meter(mesh_, file_.control);
  const FaceDeformer guarded(mesh_, file_.control, file_.binding);
  const FaceDeformer unguarded(mesh_, file_.control, file_.binding, {.guard_lips = false});
  // A lower lip that is pushed up and back.
  MarkerPositions pose = lowered(-2);
  for (std::size_t i = 0; i < file_.marker_names.size(); ++i) {
    if (file_.marker_names[i].starts_with("LIP_LO")) pose(static_cast<Eigen::Index>(i), 2) -= 1.5;
  }
  const double with = meter.measure(deformed(guarded, pose, 3)).overlap;
  const double without = meter.measure(deformed(unguarded, pose, 3)).overlap;
  EXPECT_LT(with, 0.6 * without);
}

TEST_F(LipContactTest, NothingJumpsAsTheMouthOpens) {
  const FaceDeformer deformer(mesh_, file_.control, file_.binding);
  constexpr double kStep_mm = 0.02;
  VertexPositions before = deformed(deformer, lowered(-3), 3);
  for (double opening = -3 + kStep_mm; opening < 8; opening += kStep_mm) {
    const VertexPositions now = deformed(deformer, lowered(opening), 3);
    // Lips that catch up move up to three times as fast as the markers.
    ASSERT_LT((now - before).rowwise().norm().maxCoeff(), 4 * kStep_mm) << opening;
    before = now;
  }
}

/// A mouth of the fewest triangles where that of `control` is: fronts and backs of both lips reach 20 mm from the rims,
/// far beyond what a lip's vertices lie within on other heads. The lips are one at all `ways` across but the middle
/// one, shares of the way from the right corner to the left.
struct CoarseMouth {
  FaceMesh mesh;
  std::uint32_t lower_middle;  ///< the one vertex of the rims that is the lower lip's alone
};
CoarseMouth coarseMouth(const ControlMesh& control, const FaceMesh& units_of, const std::array<double, 5>& ways) {
  const auto point = [&](const char* name) -> Eigen::Vector3d {
    return control.rest.row(findPoint(control, name)).transpose();
  };
  const Eigen::Vector3d right = point("LIP_CORNER_R"), along = point("LIP_CORNER_L") - right;
  const Eigen::Vector3d middle = 0.5 * (point("RIM_UP_MID") + point("RIM_LO_MID"));
  constexpr std::size_t kMiddle = 2;
  std::vector<Eigen::Vector3d> places;
  const auto add = [&](const Eigen::Vector3d& p) {
    places.push_back(p);
    return static_cast<std::uint32_t>(places.size() - 1);
  };
  std::array<std::array<std::uint32_t, 5>, 2> front, rim, back;  // of the upper and of the lower lip
  for (std::size_t i = 0; i < ways.size(); ++i) {
    const double bulge = std::max(0.0, 1 - std::abs(2 * ways[i] - 1));
    const double share = (middle - right).dot(along) / along.squaredNorm();
    const Eigen::Vector3d p = right + ways[i] * along + bulge * (middle - right - share * along);
    for (const std::size_t lip : {0U, 1U}) {
      const double up = lip == 0 ? 1 : -1;
      front[lip][i] = add(p + Eigen::Vector3d(0, 20 * up, 2));
      rim[lip][i] = lip == 0 || i == kMiddle ? add(p) : rim[0][i];
      back[lip][i] = add(p + Eigen::Vector3d(0, 12 * up, -16));
    }
  }
  CoarseMouth mouth;
  for (const std::size_t lip : {0U, 1U}) {
    const auto addQuad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
      for (Triangle t : {Triangle{a, b, c}, Triangle{a, c, d}}) {
        if (lip == 1) std::swap(t[1], t[2]);
        mouth.mesh.triangles.push_back(t);
      }
    };
    for (std::size_t i = 0; i + 1 < ways.size(); ++i) {
      addQuad(rim[lip][i], rim[lip][i + 1], front[lip][i + 1], front[lip][i]);
      addQuad(back[lip][i], back[lip][i + 1], rim[lip][i + 1], rim[lip][i]);
    }
  }
  mouth.mesh.metres_per_unit = units_of.metres_per_unit;
  mouth.mesh.vertices.resize(signedIndex(places.size()), 3);
  for (std::size_t v = 0; v < places.size(); ++v)
    mouth.mesh.vertices.row(signedIndex(v)) = places[v].cast<float>().transpose();
  MeshPart skin;
  skin.kind = PartKind::kSkin;
  skin.triangle_count = mouth.mesh.triangles.size();
  mouth.mesh.parts.push_back(skin);
  mouth.lower_middle = rim[1][kMiddle];
  return mouth;
}

TEST_F(LipContactTest, LargeTrianglesAreOfALipHoweverFarTheyReach) {
  const CoarseMouth mouth = coarseMouth(file_.control, mesh_, {-0.5, 0, 0.5, 1, 1.5});
  const LipContactMeter meter(mouth.mesh, file_.control);
  for (const float open : {0.0F, 1.0F, 3.0F}) {
    VertexPositions moved = mouth.mesh.vertices;
    moved(mouth.lower_middle, 1) -= open;
    const LipContact contact = meter.measure(moved);
    EXPECT_NEAR(contact.gap, double{open}, 0.1 + 0.1 * double{open});
    EXPECT_NEAR(contact.gaps.front(), 0.5 * double{open}, 0.1 + 0.1 * double{open}) << "half way to the corner";
  }
}

TEST_F(LipContactTest, LipsNeedNotTouchInASliverBesideAMeshsOwnCorner) {
  constexpr float kOpen = 3;
  const auto opened = [&](double corner) {
    const CoarseMouth mouth = coarseMouth(file_.control, mesh_, {-0.5, 0, 0.5, corner, 1.5});
    VertexPositions moved = mouth.mesh.vertices;
    moved(mouth.lower_middle, 1) -= kOpen;
    return LipContactMeter(mouth.mesh, file_.control).measure(moved);
  };
  const LipContact sliver = opened(0.703), most = opened(0.745);  // the last column is from 0.7 to 0.75
  EXPECT_EQ(sliver.gaps.back(), 0);
  EXPECT_GT(sliver.gaps[LipContact::kColumns - 2], 0.01);
  EXPECT_GT(most.gaps.back(), 0.01) << "most of the column parts";
}

/// The actor's lips touch though the outer markers are further apart than at rest, as they are in captured B P M.
TEST_F(LipContactTest, ClosedInTheCaptureIsClosedOnTheHead) {
  test::ScratchFolder folder;
  constexpr double kStretch_mm = 2.5;
  const test::MadeUpActor actor = test::madeUpActor();
  const auto rowNamed = [&](const std::string& name) {
    return static_cast<Eigen::Index>(std::find(actor.names.begin(), actor.names.end(), name) - actor.names.begin());
  };
  const double neutral =
      (actor.neutral_mm.row(rowNamed("LIP_UP_MID")) - actor.neutral_mm.row(rowNamed("LIP_LO_MID"))).norm();
  FaceFile file = file_;
  file.actor_closed_lips_mm = neutral + kStretch_mm;
  writeFileAtomically(folder.path() / "default.obj", objBytes(test::defaultFace().mesh));
  writeFaceFile(folder.path() / "default.face", file);
  const FaceRig rig = FaceRig::load(folder.path() / "default.face");
  MarkerPositions pose = actor.neutral_mm;
  for (std::size_t i = 0; i < actor.names.size(); ++i) {
    if (actor.names[i].starts_with("LIP_LO") || actor.names[i].starts_with("CHIN"))
      pose(static_cast<Eigen::Index>(i), 1) -= actor.names[i].find("OUT") == std::string::npos ? kStretch_mm : 1;
  }
  MotionClip clip{60, actor.names, PositionMatrix(1, pose.size())};
  clip.positions_mm.row(0) = Eigen::Map<const Eigen::RowVectorXd>(pose.data(), pose.size());
  const LipContactMeter meter(rig.mesh(), file_.control);
  const auto gapOf = [&](const ActorPose* who, std::span<const LipPose> lips = {}) {
    VertexPositions out;
    rig.deform(rig.retarget(clip, who, lips).pose(FrameIndex{0}), {}, out);
    return meter.measure(out).gap;
  };
  EXPECT_LT(gapOf(nullptr), kTouch_mm);
  const ActorPose parts_at_once{actor.neutral_mm, neutral};
  EXPECT_GT(gapOf(&parts_at_once), 1);
  EXPECT_LT(gapOf(nullptr, std::array{LipPose{1, 0}}), kTouch_mm);
  EXPECT_GT(gapOf(nullptr, std::array{LipPose{0, 0}}), 1) << "in a phone that is said through parted lips";
  clip.positions_mm.row(0) = Eigen::Map<const Eigen::RowVectorXd>(actor.neutral_mm.data(), actor.neutral_mm.size());
  EXPECT_LT(gapOf(nullptr, std::array{LipPose{0, 0}}), kTouch_mm);
  EXPECT_GT(gapOf(nullptr, std::array{LipPose{0, 1}}), 1) << "in TH, though the outer edges are as in a closed mouth";
}

}  // namespace
}  // namespace mouthpiece
