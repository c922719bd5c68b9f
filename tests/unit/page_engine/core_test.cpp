// The portable core by itself: a packed line's labels to motion to mesh, the same whichever compiler and library made
// it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

#include "page_engine/page_engine.h"

namespace mouthpiece {
namespace {

constexpr const char* kKeptFrame = MOUTHPIECE_SOURCE_DIR "/tests/unit/page_engine/kept_frame";

std::string bytesOf(const char* path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

float farthestApart(const std::vector<float>& a, const std::vector<float>& b) {
  float farthest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) farthest = std::max(farthest, std::abs(a[i] - b[i]));
  return farthest;
}

/// Markers and vertices of the middle frame in millimetres, as g++ 12 with libstdc++ made them.
/// `MOUTHPIECE_KEEP=1 build/test_bin/unit_page_engine --gtest_filter='PortableCore*'` keeps them anew: only for a
/// change that is meant, and said in its commit.
TEST(PortableCore, MakesTheSameMotionWithEveryCompiler) {
  PageEngine engine(bytesOf(MOUTHPIECE_SOURCE_DIR "/tests/fuzz/findings/line_package/line"));
  engine.render("[]");
  const RowMajorMatrixF& markers = engine.markers();
  ASSERT_GT(markers.rows(), 0);
  ASSERT_TRUE(markers.allFinite() && engine.weights().allFinite());
  const std::size_t middle = engine.frameCount() / 2;
  const std::vector<float> first = engine.vertices(0), vertices = engine.vertices(middle);
  ASSERT_EQ(first.size(), vertices.size());
  EXPECT_GT(farthestApart(first, vertices), 5) << "mm: a mouth that moves";
  constexpr float kMillimetres = 1000;
  std::vector<float> made;
  for (Eigen::Index column = 0; column < markers.cols(); ++column)
    made.push_back(kMillimetres * markers(static_cast<Eigen::Index>(middle), column));
  made.insert(made.end(), vertices.begin(), vertices.end());
  ASSERT_TRUE(std::all_of(made.begin(), made.end(), [](float number) { return std::isfinite(number); }));
  if (std::getenv("MOUTHPIECE_KEEP") != nullptr)
    std::ofstream(kKeptFrame, std::ios::binary)
        .write(reinterpret_cast<const char*>(made.data()), static_cast<std::streamsize>(made.size() * sizeof(float)));

  const std::string bytes = bytesOf(kKeptFrame);
  ASSERT_EQ(bytes.size(), made.size() * sizeof(float));
  std::vector<float> kept(made.size());
  std::memcpy(kept.data(), bytes.data(), bytes.size());
  EXPECT_LT(farthestApart(made, kept), 1e-4F);
}

}  // namespace
}  // namespace mouthpiece
