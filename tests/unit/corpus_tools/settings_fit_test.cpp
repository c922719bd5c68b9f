#include "corpus_tools/building/settings_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "corpus_tools/building/prediction_parts.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

TEST(NetworkFit, LearnsWhatSegmentsSay) {
  const Corpus corpus = speakingCorpus();
  std::vector<NetworkTake> takes;
  std::vector<std::size_t> use;
  for (const CorpusTake& take : corpus.takes) {
    NetworkTake& own = takes.emplace_back();
    own.segments = contextSegments(take.labels);
    const auto frames = static_cast<Eigen::Index>(take.labels.duration() * 30);
    own.seen = Eigen::VectorXf::Ones(frames);
    own.values.resize(frames, 1);
    for (Eigen::Index row = 0; row < frames; ++row) {
      own.times.push_back(static_cast<double>(row) / 30);
      double open = 0;
      for (const LabelledPhone& phone : take.labels.phones) {
        if (phone.span.contains(own.times.back()) && isVowel(phone.phone)) open = 5;
      }
      own.values(row, 0) = static_cast<float>(open);
    }
    own.values.array() -= own.values.mean();
    if (takes.size() > 1) use.push_back(takes.size() - 1);
  }
  const ContextNetwork network = fitContextNetwork(takes, use, 1, 1, {.epochs = 120});
  const Eigen::MatrixXd error = takes[0].values.cast<double>() - centredPrediction(network, takes[0]);
  EXPECT_LT(error.norm(), 0.6 * takes[0].values.norm()) << "a take that it has not seen";
  const ContextNetwork again = fitContextNetwork(takes, use, 1, 1, {.epochs = 120});
  EXPECT_EQ(again.input, network.input);
  EXPECT_NE(fitContextNetwork(takes, use, 1, 2, {.epochs = 2}).input, network.input) << "another seed";
}

/// Speaking takes whose speaker does the same thing a little differently each time, with noise of the tracker on top.
Corpus variedCorpus(double noise_mm) {
  Corpus corpus = speakingCorpus();
  std::vector<CorpusTake> takes;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 1);
  for (int copy = 0; copy < 3; ++copy) {
    for (CorpusTake take : corpus.takes) {
      take.name += std::to_string(copy);
      for (Eigen::Index i = 0; i < take.motion.positions_mm.size(); ++i)
        take.motion.positions_mm.data()[i] += noise_mm * noise(random);
      takes.push_back(std::move(take));
    }
  }
  corpus.takes = std::move(takes);
  return corpus;
}

TEST(SettingsFit, SaysWhatItLearntAndDoesNotDependOnThreads) {
  Corpus corpus = variedCorpus(0.05), threaded = corpus;
  fitMotion(corpus);
  fitMotion(threaded, {.jobs = 3});
  ASSERT_NE(corpus.trajectory_model, nullptr);
  EXPECT_EQ(corpus.motion_settings, threaded.motion_settings);
  EXPECT_NE(corpus.build_log.at("motion_settings").find("learnt on"), std::string::npos);
  for (const MotionSetting& setting : kMotionSettings) {
    EXPECT_GE(corpus.motion_settings.*setting.value, setting.least) << setting.name;
    EXPECT_LE(corpus.motion_settings.*setting.value, setting.largest) << setting.name;
  }
}

/// Contacts and costs are searched as well, and what takes taught before is forgotten first: `corpus evaluate` fits a
/// corpus anew without the takes that judge it.
TEST(SettingsFit, SearchesContactsAndCostsFromTheUsualOnes) {
  Corpus corpus = variedCorpus(0.05), taught = corpus;
  taught.lattice_weights["duration"] = 7;
  taught.motion_settings.lips_fall_ms = 110;
  taught.build_log["lattice_weights"] = "learnt on takes that judge";
  fitMotion(corpus);
  fitMotion(taught);
  EXPECT_EQ(taught.lattice_weights, corpus.lattice_weights);
  EXPECT_EQ(taught.motion_settings, corpus.motion_settings);
  for (const char* key : {"contact_settings", "lattice_weights"}) {
    EXPECT_NE(corpus.build_log.at(key).find("settings tried on"), std::string::npos) << key;
    EXPECT_EQ(taught.build_log.at(key), corpus.build_log.at(key));
  }
}

TEST(SettingsFit, TooLittleKeepsTheUsual) {
  Corpus corpus = speakingCorpus();
  corpus.takes.resize(3);
  fitMotion(corpus);
  EXPECT_EQ(corpus.trajectory_model, nullptr);
  EXPECT_EQ(corpus.motion_settings, MotionSettings());
  EXPECT_FALSE(corpus.build_log.contains("motion_settings"));
}

}  // namespace
}  // namespace mouthpiece
