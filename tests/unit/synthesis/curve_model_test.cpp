#include "synthesis/curve_model.h"

#include <gtest/gtest.h>

#include "base/errors.h"
#include "support/tiny_corpus.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {
namespace {

using samples::tinyCorpus;
using samples::tinyLabels;

SynthesisRequest spokenByCurves() {
  SynthesisRequest request;
  request.labels = tinyLabels("M-AE-N AE-T B-OY", 5);
  request.options.curves.alone = CurveStyle::kSpeech;
  return request;
}

TEST(CurveModel, MovesAlikeByPosesStoredAndLearnt) {
  Corpus corpus = tinyCorpus();
  const UtteranceAnimation learnt = synthesise(spokenByCurves(), corpus);
  EXPECT_FALSE(storedPoses(corpus).has_value());
  corpus.viseme_poses = posesToJson(learnPoses(corpus));
  ASSERT_TRUE(storedPoses(corpus).has_value());
  const UtteranceAnimation stored = synthesise(spokenByCurves(), corpus);
  constexpr double kRoundedMm = 0.01;  // a few visemes at once, each kept to 0.001 mm
  EXPECT_LT((stored.motion.positions_mm - learnt.motion.positions_mm).cwiseAbs().maxCoeff(), kRoundedMm);
}

TEST(CurveModel, TakesStoredPosesForWhatTheyAre) {
  Corpus corpus = tinyCorpus();
  VisemePoses still = learnPoses(corpus);
  still.lips.setZero();
  still.jaw_drop.fill(0);
  still.opening_direction.setZero();
  corpus.viseme_poses = posesToJson(still);
  const UtteranceAnimation made = synthesise(spokenByCurves(), corpus);
  const Eigen::Map<const Eigen::RowVectorXd> neutral(corpus.neutral_pose_mm.data(), 12);
  EXPECT_LT((made.motion.positions_mm.rowwise() - neutral).cwiseAbs().maxCoeff(), 1e-9) << "nothing was learnt again";
}

TEST(CurveModel, RefusesPosesOfOtherMarkers) {
  Corpus corpus = tinyCorpus();
  VisemePoses other = learnPoses(corpus);
  other.marker_names[3] = "NOSE_TIP";
  corpus.viseme_poses = posesToJson(other);
  EXPECT_THROW(storedPoses(corpus), InputError);
  EXPECT_THROW(synthesise(spokenByCurves(), corpus), InputError);
  corpus.viseme_poses = "{}";
  EXPECT_THROW(storedPoses(corpus), InputError);
}

TEST(CurveModel, LearnsFromASourceAsFromMemory) {
  class Source final : public TakeSource {
   public:
    explicit Source(const std::vector<CorpusTake>& takes) : takes_(takes) {}
    [[nodiscard]] MotionClip load(TakeIndex take) const override { return takes_[take.value].motion; }
    [[nodiscard]] AudioClip loadAudio(TakeIndex take) const override { return takes_[take.value].audio; }

   private:
    const std::vector<CorpusTake> takes_;
  };
  Corpus corpus = tinyCorpus();
  const std::string from_memory = posesToJson(learnPoses(corpus));
  corpus.take_source = std::make_shared<Source>(corpus.takes);
  for (CorpusTake& take : corpus.takes) take.motion.positions_mm.resize(0, take.motion.positions_mm.cols());
  EXPECT_EQ(posesToJson(learnPoses(corpus)), from_memory);
}

}  // namespace
}  // namespace mouthpiece
