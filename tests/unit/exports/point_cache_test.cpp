#include "exports/format_bytes.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

FaceAnimation twoFrames() {
  FaceAnimation animation;
  animation.frame_rate_hz = 50;
  animation.positions.resize(2, 6);
  animation.positions << 1, 2, 3, 4, 5, 6, -1, -2, -3, -4, -5, -6.5F;
  return animation;
}

std::uint32_t bigEndianAt(const std::string& bytes, std::size_t offset) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < 4; ++i) word = word << 8U | static_cast<unsigned char>(bytes[offset + i]);
  return word;
}

template <typename T>
T littleEndianAt(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

std::string written(void (*write)(const fs::path&, const FrameMaker&), const FrameMaker& frames) {
  const fs::path path = fs::path(::testing::TempDir()) / fmt::format("mouthpiece_cache_{}", ::getpid());
  write(path, frames);
  std::string bytes = readFile(path);
  fs::remove(path);
  return bytes;
}

TEST(Pc2, IsLaidOutAsTheFormatSays) {
  const std::string bytes = written(writePc2, framesOf(twoFrames()));
  ASSERT_EQ(bytes.size(), 32U + 2 * 2 * 12);
  EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
  EXPECT_EQ(littleEndianAt<std::int32_t>(bytes, 12), 1);  // version
  EXPECT_EQ(littleEndianAt<std::int32_t>(bytes, 16), 2);  // points
  EXPECT_EQ(littleEndianAt<float>(bytes, 20), 0.0F);      // first frame
  EXPECT_EQ(littleEndianAt<float>(bytes, 24), 1.0F);      // frames a sample
  EXPECT_EQ(littleEndianAt<std::int32_t>(bytes, 28), 2);  // samples
  EXPECT_EQ(littleEndianAt<float>(bytes, 32), 1.0F);
  EXPECT_EQ(littleEndianAt<float>(bytes, bytes.size() - 4), -6.5F);
}

/// Frames are made once each and in turn, so that a cache of any length takes no more memory than some of them.
TEST(PointCaches, AreWrittenAsTheirFramesAreMade) {
  constexpr Eigen::Index kFrames = 200;
  Eigen::Index made = 0;
  const FrameMaker frames{50, kFrames, 3, {}, [&](Eigen::Index frame, std::span<float> out) {
                            EXPECT_EQ(frame, made++);
                            for (std::size_t i = 0; i < 3; ++i) out[i] = asFloat(10 * asReal(frame) + asReal(i));
                          }};
  const std::string pc2 = written(writePc2, frames);
  ASSERT_EQ(pc2.size(), 32U + kFrames * 12);
  EXPECT_EQ(made, kFrames);
  made = 0;
  const std::string mdd = written(writeMdd, frames);
  ASSERT_EQ(mdd.size(), 8U + kFrames * 16);
  for (std::size_t frame = 0; frame < kFrames; ++frame) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto value = asFloat(10 * asReal(frame) + asReal(i));
      EXPECT_EQ(littleEndianAt<float>(pc2, 32 + 12 * frame + 4 * i), value);
      EXPECT_EQ(std::bit_cast<float>(bigEndianAt(mdd, 8 + 4 * kFrames + 12 * frame + 4 * i)), value);
    }
  }
}

TEST(FrameMakers, HoldWhatIsShortAndMakeAnewWhatIsLong) {
  int made = 0;
  const FrameMaker frames{50, 130, 3, {}, [&](Eigen::Index frame, std::span<float> out) {
                            ++made;
                            std::fill(out.begin(), out.end(), asFloat(asReal(frame)));
                          }};
  const FrameMaker held = heldIfShort(frames, 130 * 3 * sizeof(float));
  EXPECT_EQ(made, 130);
  const FrameMaker long_ones = heldIfShort(frames, 130 * 3 * sizeof(float) - 1);
  EXPECT_EQ(made, 130);
  EXPECT_EQ(held.all().positions, long_ones.all().positions);
  EXPECT_EQ(made, 260);
}

TEST(Mdd, IsLaidOutAsTheFormatSays) {
  const std::string bytes = written(writeMdd, framesOf(twoFrames()));
  ASSERT_EQ(bytes.size(), 8U + 2 * 4 + 2 * 2 * 12);
  EXPECT_EQ(bigEndianAt(bytes, 0), 2U);  // frames
  EXPECT_EQ(bigEndianAt(bytes, 4), 2U);  // points
  EXPECT_EQ(std::bit_cast<float>(bigEndianAt(bytes, 12)), 0.02F);
  EXPECT_EQ(std::bit_cast<float>(bigEndianAt(bytes, 16)), 1.0F);
  EXPECT_EQ(std::bit_cast<float>(bigEndianAt(bytes, bytes.size() - 4)), -6.5F);
}

TEST(ObjSequence, HasOneFileAFrame) {
  const auto head = samples::makeTalkingHead({.frames = 3, .rings = 4, .segments = 6});
  std::vector<std::string> files;
  objFrames(head.mesh, framesOf(head.animation), [&](std::size_t frame, const std::string& bytes) {
    EXPECT_EQ(frame, files.size());
    files.push_back(bytes);
  });
  ASSERT_EQ(files.size(), 3U);

  std::istringstream stream(files[2]);
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t normals = 0;
  const VertexPositions expected_normals = vertexNormals(
      Eigen::Map<const VertexPositions>(head.animation.positions.row(2).data(), head.mesh.vertices.rows(), 3),
      head.mesh.triangles);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with("v ")) {
      std::istringstream numbers(line.substr(2));
      Eigen::RowVector3f position;
      numbers >> position.x() >> position.y() >> position.z();
      const auto column = static_cast<Eigen::Index>(3 * vertices);
      EXPECT_TRUE((position == head.animation.positions.block<1, 3>(2, column))) << line;
      ++vertices;
    }
    if (line.starts_with("vn ")) {
      std::istringstream numbers(line.substr(3));
      Eigen::RowVector3f normal;
      numbers >> normal.x() >> normal.y() >> normal.z();
      EXPECT_LT((normal - expected_normals.row(static_cast<Eigen::Index>(normals))).norm(), 2e-4F) << line;
      ++normals;
    }
    triangles += line.starts_with("f ") ? 1U : 0U;
  }
  EXPECT_EQ(vertices, static_cast<std::size_t>(head.mesh.vertices.rows()));
  EXPECT_EQ(normals, vertices);
  EXPECT_EQ(triangles, head.mesh.triangles.size());
}

}  // namespace
}  // namespace mouthpiece
