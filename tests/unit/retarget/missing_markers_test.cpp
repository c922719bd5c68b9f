#include "retarget/rig/face_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "base/errors.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// The points of a face that was fitted with `layout`, as far as they matter here.
ControlMesh meshOf(const MarkerLayout& layout) {
  ControlMesh mesh;
  for (const LayoutMarker& marker : layout.markers)
    mesh.points.push_back({.name = marker.name, .side = marker.lip, .drivers = {}});
  mesh.marker_count = mesh.points.size();
  return mesh;
}

MarkerPositions rowsOf(const MarkerPositions& all, const MarkerLayout& layout, const std::vector<std::string>& names) {
  MarkerPositions rows(static_cast<Eigen::Index>(names.size()), 3);
  for (std::size_t i = 0; i < names.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) = all.row(static_cast<Eigen::Index>(layout.indexOf(names[i]).value));
  return rows;
}

class MissingMarkers : public testing::Test {
 protected:
  void SetUp() override {
    const fs::path file = fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "sample.corpus";
    if (!fs::exists(file)) GTEST_SKIP() << "no sample corpus: run `make data`";
    corpus_ = readCorpus(file);
    for (const LayoutMarker& marker : corpus_.layout.markers) {
      if (!lacking_.contains(marker.name)) kept_.push_back(marker.name);
    }
  }

  /// Ten of both lips, chin, cheeks and brows.
  const std::set<std::string> lacking_ = {"LIP_UP_IN_R", "LIP_LO_IN_R", "LIP_LO_OUT_L", "CHIN_UP",   "CHIN_LOW",
                                          "JAW_FRONT_R", "BROW_MID_L",  "NOSTRIL_R",    "JAW_MID_L", "NOSE_BRIDGE"};
  Corpus corpus_;
  std::vector<std::string> kept_;
};

TEST_F(MissingMarkers, GoAlongWithTheirNeighbours) {
  const MotionClip& whole = corpus_.takes[0].motion;
  const ControlMesh mesh = meshOf(corpus_.layout);
  const CompletedMarkers completed =
      completedMarkers(selectMarkers(whole, kept_), rowsOf(corpus_.neutral_pose_mm, corpus_.layout, kept_), mesh,
                       corpus_.neutral_pose_mm);
  ASSERT_EQ(completed.positions_mm.cols(), whole.positions_mm.cols());
  EXPECT_LT((completed.neutral_mm - corpus_.neutral_pose_mm).rowwise().norm().maxCoeff(), 1e-6) << "the same actor";
  double off = 0, moved = 0;
  for (std::size_t i = 0; i < corpus_.layout.markers.size(); ++i) {
    const auto column = 3 * static_cast<Eigen::Index>(i);
    const auto found = completed.positions_mm.middleCols<3>(column), real = whole.positions_mm.middleCols<3>(column);
    if (!lacking_.contains(corpus_.layout.markers[i].name)) {
      EXPECT_EQ((found - real).norm(), 0) << corpus_.layout.markers[i].name;
      continue;
    }
    off += (found - real).squaredNorm();
    moved += (real.rowwise() - corpus_.neutral_pose_mm.row(static_cast<Eigen::Index>(i))).squaredNorm();
  }
  EXPECT_LT(std::sqrt(off / moved), 0.5) << "of the way that they move";
}

TEST_F(MissingMarkers, OfALipDoNotFollowTheOther) {
  const ControlMesh mesh = meshOf(corpus_.layout);
  MotionClip motion = selectMarkers(corpus_.takes[0].motion, kept_);
  const MarkerPositions neutral = rowsOf(corpus_.neutral_pose_mm, corpus_.layout, kept_);
  const auto of = [&](const char* name) { return 3 * static_cast<Eigen::Index>(corpus_.layout.indexOf(name).value); };
  const CompletedMarkers before = completedMarkers(motion, neutral, mesh, corpus_.neutral_pose_mm);
  for (const char* lower : {"LIP_LO_MID", "LIP_LO_OUT_R", "LIP_LO_IN_L"})
    motion.positions_mm.middleCols<3>(3 * static_cast<Eigen::Index>(motion.findMarker(lower)->value)).array() -= 5;
  const CompletedMarkers after = completedMarkers(motion, neutral, mesh, corpus_.neutral_pose_mm);
  const auto change = [&](const char* name) {
    return (after.positions_mm.middleCols<3>(of(name)) - before.positions_mm.middleCols<3>(of(name))).norm();
  };
  EXPECT_EQ(change("LIP_UP_IN_R"), 0);
  EXPECT_GT(change("LIP_LO_IN_R"), 1);
}

TEST_F(MissingMarkers, LipsAreNeeded) {
  const ControlMesh mesh = meshOf(corpus_.layout);
  std::vector<std::string> names = kept_;
  std::erase(names, "LIP_UP_MID");
  EXPECT_THROW(completedMarkers(selectMarkers(corpus_.takes[0].motion, names),
                                rowsOf(corpus_.neutral_pose_mm, corpus_.layout, names), mesh, corpus_.neutral_pose_mm),
               InputError);
  names = {"LIP_UP_MID", "LIP_LO_MID", "LIP_CORNER_R", "LIP_CORNER_L", "CHIN_MID"};
  EXPECT_THROW(completedMarkers(selectMarkers(corpus_.takes[0].motion, names),
                                rowsOf(corpus_.neutral_pose_mm, corpus_.layout, names), mesh, corpus_.neutral_pose_mm),
               InputError);
}

}  // namespace
}  // namespace mouthpiece
