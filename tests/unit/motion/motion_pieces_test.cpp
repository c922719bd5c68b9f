// Files of motion that comes some frames at a time are those of all of it.
#include "motion/motion_pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include "base/files.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_csv.h"

namespace mouthpiece {
namespace {

MotionClip madeUpClip() {
  MotionClip clip{60, {"LIP_UP_MID", "LIP_LO_MID", "CHIN"}, PositionMatrix(103, 9)};
  for (Eigen::Index i = 0; i < clip.positions_mm.size(); ++i)
    clip.positions_mm.data()[i] = 50 * std::sin(0.37 * static_cast<double>(i));
  clip.positions_mm.block<1, 3>(41, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  return clip;
}

MotionInPieces inPieces(const MotionClip& clip, Eigen::Index at_once) {
  MotionInPieces pieces = inOnePiece(clip);
  pieces.forEach = [&clip, at_once](const MotionInPieces::Take& take) {
    for (Eigen::Index first = 0; first < clip.positions_mm.rows(); first += at_once)
      take(static_cast<std::size_t>(first),
           clip.positions_mm.middleRows(first, std::min(at_once, clip.positions_mm.rows() - first)));
  };
  return pieces;
}

TEST(MotionInPieces, FilesAreTheSameHoweverTheFramesCome) {
  const MotionClip clip = madeUpClip();
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "motion_in_pieces";
  for (const Eigen::Index at_once : {1, 7, 60, 103, 500}) {
    const MotionInPieces pieces = inPieces(clip, at_once);
    writeMotionCsv(folder / "a.csv", pieces);
    EXPECT_EQ(readFile(folder / "a.csv"), writeMotionCsvText(clip)) << at_once;
    writeTrc(folder / "a.trc", pieces);
    EXPECT_EQ(readFile(folder / "a.trc"), writeTrcText(clip, "a.trc")) << at_once;
    writeC3d(folder / "a.c3d", pieces);
    EXPECT_EQ(readFile(folder / "a.c3d"), writeC3dBytes(clip)) << at_once;
  }
  std::filesystem::remove_all(folder);
}

/// What goes wrong halfway leaves neither the file nor half of it.
TEST(MotionInPieces, AFileThatFailsHalfwayIsNotThere) {
  const MotionClip clip = madeUpClip();
  MotionInPieces pieces = inPieces(clip, 10);
  pieces.forEach = [forEach = pieces.forEach](const MotionInPieces::Take& take) {
    forEach([&](std::size_t first, const PositionMatrix& rows) {
      if (first >= 50) throw std::runtime_error("no more");
      take(first, rows);
    });
  };
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "motion_halfway";
  EXPECT_THROW(writeMotionCsv(folder / "a.csv", pieces), std::runtime_error);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace mouthpiece
