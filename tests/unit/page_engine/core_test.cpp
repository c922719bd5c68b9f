// The portable core by itself: a packed line's labels to motion to mesh, the same whichever compiler and library made
// it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "page_engine/page_engine.h"

namespace mouthpiece {
namespace {

std::string packedSeed() {
  std::ifstream file(MOUTHPIECE_SOURCE_DIR "/tests/fuzz/findings/line_package/line", std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(PortableCore, MakesTheSameMotionWithEveryCompiler) {
  PageEngine engine(packedSeed());
  engine.render("[]");
  const RowMajorMatrixF& markers = engine.markers();
  ASSERT_GT(markers.rows(), 0);
  ASSERT_TRUE(markers.allFinite() && engine.weights().allFinite());
  const std::vector<float> first = engine.vertices(0);
  const std::vector<float> middle = engine.vertices(engine.frameCount() / 2);
  ASSERT_EQ(first.size(), middle.size());
  float farthest = 0;
  for (std::size_t i = 0; i < first.size(); ++i) farthest = std::max(farthest, std::abs(first[i] - middle[i]));
  // What g++ 12 with libstdc++ makes of it, to two micrometres: metres, and the mesh's millimetres.
  const auto reach = markers.colwise().maxCoeff() - markers.colwise().minCoeff();
  EXPECT_NEAR(reach.maxCoeff(), 0.0128787, 2e-6);
  EXPECT_NEAR(reach.mean(), 0.0006819, 2e-6);
  EXPECT_NEAR(farthest, 10.3528, 2e-3);
}

}  // namespace
}  // namespace mouthpiece
