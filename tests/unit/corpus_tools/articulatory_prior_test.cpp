#include "corpus_tools/building/prediction_parts.h"

#include <gtest/gtest.h>

namespace mouthpiece {
namespace {

TEST(ArticulatoryPrior, DrawsSoundsThatAreMadeAlikeTogether) {
  const ArticulatoryPrior prior({"phone P", "phone B", "phone IY", "left Ah MBP", "viseme Ah"});
  const Eigen::MatrixXd covariance = prior.precision().inverse();
  EXPECT_NEAR(covariance.diagonal().minCoeff(), 1, 1e-9);
  EXPECT_GT(covariance(0, 1), 0.4) << "P and B differ in voice alone";
  EXPECT_LT(covariance(0, 2), 0.2) << "P and IY are hardly alike";
  EXPECT_NEAR(covariance(0, 4), 0, 1e-12) << "features of two kinds";
}

/// A phone that nobody said is placed by those made like it, and by nothing where there are none.
TEST(ArticulatoryPrior, PlacesWhatNobodySaidByWhatIsLikeIt) {
  const ArticulatoryPrior prior({"phone P", "phone IY", "right Ee MBP"});
  const Eigen::Vector3d targets(-2.0, 1.0, 0.5);
  const auto unsaid = prior.unsaid(targets);
  ASSERT_TRUE(unsaid.contains("phone B"));
  const double b = unsaid.at("phone B")(0);
  EXPECT_LT(b, -0.8);
  EXPECT_GT(b, -2.0) << "held back";
  EXPECT_FALSE(unsaid.contains("phone P")) << "somebody said it";
  ASSERT_TRUE(unsaid.contains("right Ih MBP"));
  EXPECT_GT(unsaid.at("right Ih MBP")(0), 0.1);
  EXPECT_FALSE(unsaid.contains("left Ee MBP")) << "nothing of its kind was said";
}

}  // namespace
}  // namespace mouthpiece
