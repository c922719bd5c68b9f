#include "hearing/alignment/acoustic_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <random>

#include "base/errors.h"
#include "base/files.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr Eigen::Index kSenoneDensities = 20;
constexpr int kSenones = 9;  // three codebooks of three

/// Means and variances beside the model made of them.
struct MadeModel {
  TiedModel model;
  std::vector<std::vector<Eigen::MatrixXd>> means, variances;  ///< by codebook and stream: densities x features
};

MadeModel makeModel(std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> share(0.01, 1);
  MadeModel made;
  made.model.stream_sizes = {3, 2};
  made.model.senone_count = kSenones;
  for (int c = 0; c < 3; ++c) {
    TiedModel::Codebook codebook{"P" + std::to_string(c), {c, c + 3, c + 6}, {}, {}};
    auto &means = made.means.emplace_back(), &variances = made.variances.emplace_back();
    for (const Eigen::Index size : made.model.stream_sizes) {
      means.push_back(Eigen::MatrixXd::NullaryExpr(kSenoneDensities, size, [&] { return 3 * normal(random); }));
      variances.push_back(Eigen::MatrixXd::NullaryExpr(kSenoneDensities, size, [&] { return 4 * share(random); }));
      Eigen::MatrixXf rows(kSenoneDensities, 2 * size + 1);
      rows.leftCols(size) = (-0.5 * variances.back().cwiseInverse()).cast<float>();
      rows.middleCols(size, size) = means.back().cwiseQuotient(variances.back()).cast<float>();
      const Eigen::MatrixXd constants = means.back().cwiseAbs2().cwiseQuotient(variances.back()) +
                                        (2 * std::numbers::pi * variances.back()).array().log().matrix();
      rows.rightCols(1) = (-0.5 * constants.rowwise().sum()).cast<float>();
      codebook.gaussians.push_back(rows);
      codebook.weights.push_back(
          Eigen::MatrixXf::NullaryExpr(3, kSenoneDensities, [&] { return float(share(random)); }));
    }
    made.model.codebooks.push_back(codebook);
  }
  return made;
}

/// log N(x; mean, variance), written out.
double logDensity(const Eigen::RowVectorXd& x, const Eigen::RowVectorXd& mean, const Eigen::RowVectorXd& variance) {
  double sum = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i)
    sum -= 0.5 * ((x[i] - mean[i]) * (x[i] - mean[i]) / variance[i] + std::log(2 * std::numbers::pi * variance[i]));
  return sum;
}

/// Of each senone, without any shortcut.
std::vector<double> plainScores(const MadeModel& made, const Eigen::VectorXf& frame) {
  std::vector<double> logs(kSenones, 0.0);
  for (std::size_t stream = 0, row = 0; stream < 2; ++stream) {
    const Eigen::Index size = made.model.stream_sizes[stream];
    const Eigen::RowVectorXd x = frame.segment(static_cast<Eigen::Index>(row), size).cast<double>().transpose();
    row += static_cast<std::size_t>(size);
    std::vector<std::vector<std::pair<double, Eigen::Index>>> sorted(3);
    double best = -1e300;
    for (std::size_t c = 0; c < 3; ++c) {
      for (Eigen::Index d = 0; d < kSenoneDensities; ++d)
        sorted[c].emplace_back(logDensity(x, made.means[c][stream].row(d), made.variances[c][stream].row(d)), d);
      std::sort(sorted[c].rbegin(), sorted[c].rend());
      best = std::max(best, sorted[c][0].first);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      for (int s = 0; s < 3; ++s) {
        double sum = 0;
        for (std::size_t k = 0; k < SenoneScorer::kKept; ++k) {
          const auto [log_density, d] = sorted[c][k];
          sum +=
              made.model.codebooks[c].weights[stream](s, d) * std::exp(std::max(log_density - best, -96 * kScoreUnit));
        }
        logs[c + 3 * static_cast<std::size_t>(s)] += std::log(sum);
      }
    }
  }
  const double best = *std::max_element(logs.begin(), logs.end());
  for (double& log : logs) log = (best - log) / kScoreUnit;
  return logs;
}

TEST(SenoneScorer, AgreesWithThePlainSum) {
  std::mt19937 random(7);
  const MadeModel made = makeModel(random);
  SenoneScorer scorer(std::make_shared<TiedModel>(made.model));
  std::normal_distribution<float> normal;
  const Eigen::MatrixXf features = Eigen::MatrixXf::NullaryExpr(5, 70, [&] { return 3 * normal(random); });
  const auto scores = scorer.score(features, {{true, true, true}, true, 1});
  int largest = 0;
  for (Eigen::Index frame = 0; frame < features.cols(); ++frame) {
    const std::vector<double> plain = plainScores(made, features.col(frame));
    for (int s = 0; s < kSenones; ++s) {
      EXPECT_NEAR(scores(s, frame), plain[static_cast<std::size_t>(s)], 0.51) << "units, senone " << s;
      largest = std::max<int>(largest, scores(s, frame));
    }
  }
  EXPECT_GT(largest, 50) << "the sounds differ";
}

/// The model that PocketSphinx brings, so that all loops are run through: codebooks of 128 densities.
TEST(SenoneScorer, GivesTheSameByThisProcessorsLoops) {
  if (senoneKernels() == nullptr) GTEST_SKIP() << "no AVX2: there is one set of loops";
  const auto model = std::make_shared<TiedModel>(readTiedModel(fs::path(MOUTHPIECE_SPHINX_MODELS) / "en-us" / "en-us"));
  SenoneScorer fast(model), plain(model, true);
  std::mt19937 random(9);
  std::normal_distribution<float> normal;
  // Each frame is like the one before, as in speech, but for some that are like nothing.
  Eigen::MatrixXf features(model->featureCount(), 80);
  Eigen::VectorXf frame = Eigen::VectorXf::Zero(features.rows());
  for (Eigen::Index i = 0; i < features.cols(); ++i) {
    for (float& value : frame) value = 0.9F * value + normal(random) * (i % 20 == 19 ? 10.0F : 0.3F);
    features.col(i) = frame;
  }
  std::vector<bool> some(model->codebooks.size(), false);
  some[3] = some[17] = some[40] = true;
  for (const Weighing& weighing : {Weighing{std::vector<bool>(some.size(), true)}, Weighing{some, false, 0.15}}) {
    const SenoneScorer::Scores a = fast.score(features, weighing), b = plain.score(features, weighing);
    const Eigen::ArrayXXi apart = (a.cast<int>() - b.cast<int>()).cwiseAbs().array();
    // Eigen takes the last senones of a codebook one by one, by a logarithm that rounds in its own way.
    EXPECT_LE(apart.maxCoeff(), 1);
    EXPECT_LE((apart > 0).count(), 3);
    EXPECT_GT(a.maxCoeff(), 50);
  }
}

TEST(SenoneScorer, WeighsOnlyWhatIsWanted) {
  std::mt19937 random(8);
  const MadeModel made = makeModel(random);
  SenoneScorer scorer(std::make_shared<TiedModel>(made.model));
  std::normal_distribution<float> normal;
  const Eigen::MatrixXf features = Eigen::MatrixXf::NullaryExpr(5, 40, [&] { return 3 * normal(random); });
  const SenoneScorer::Scores all = scorer.score(features, {{true, true, true}, true, 1});
  const SenoneScorer::Scores some = scorer.score(features, {{false, true, false}, true, 1});
  const SenoneScorer::Scores own = scorer.score(features, {{false, true, false}, false, 1});
  const SenoneScorer::Scores soft = scorer.score(features, {{true, true, true}, true, 0.25});
  for (Eigen::Index frame = 0; frame < features.cols(); ++frame) {
    for (const int s : {1, 4, 7}) EXPECT_EQ(some(s, frame), all(s, frame));
    for (const int s : {0, 2, 3, 5}) EXPECT_GT(some(s, frame), 1000);
    EXPECT_EQ(std::min({own(1, frame), own(4, frame), own(7, frame)}), 0);
    for (int s = 0; s < kSenones; ++s) EXPECT_NEAR(soft(s, frame), 0.25 * all(s, frame), 0.63);
  }
}

TEST(TiedModel, DamagedFilesAreRefused) {
  const fs::path real = fs::path(MOUTHPIECE_SPHINX_MODELS) / "en-us" / "en-us";
  const fs::path folder = fs::temp_directory_path() / "mouthpiece_tied_model_test";
  fs::remove_all(folder);
  fs::create_directories(folder);
  const TiedModel whole = readTiedModel(real);
  EXPECT_EQ(whole.codebooks.size(), 42U);
  EXPECT_EQ(whole.senone_count, 5126U);
  EXPECT_EQ(whole.featureCount(), 39);
  for (const char* damaged : {"mdef", "means", "variances", "sendump"}) {
    for (const char* name : {"mdef", "means", "variances", "sendump"}) {
      fs::remove(folder / name);
      fs::create_symlink(real / name, folder / name);
    }
    const std::string bytes = readFile(real / damaged);
    for (const std::size_t size : {bytes.size() / 2, std::size_t{100}, std::size_t{0}}) {
      fs::remove(folder / damaged);
      writeFileAtomically(folder / damaged, bytes.substr(0, size));
      EXPECT_THROW(readTiedModel(folder), InputError) << damaged << " of " << size << " bytes";
    }
  }
  fs::remove_all(folder);
}

TEST(TiedModel, APhoneIsHeardBetweenItsNeighboursAtItsPlaceInTheWord) {
  using enum TiedModel::WordPlace;
  TiedModel model;
  model.states = 2;
  model.sequences = {10, 11, 12, 13, 14, 15};
  model.alone = {{0, 1}, {2, 3}};
  model.triphones = {{0, 1, 1, kInside, 0}, {0, 1, 1, kEnds, 2}, {1, 0, 1, kAlone, 4}};
  const auto senones = [&](std::size_t base, std::size_t left, std::size_t right, TiedModel::WordPlace place) {
    const std::span<const int> found = model.senonesOf(base, left, right, place);
    return std::vector<int>(found.begin(), found.end());
  };
  EXPECT_EQ(senones(0, 1, 1, kEnds), (std::vector<int>{12, 13}));
  EXPECT_EQ(senones(0, 1, 1, kBegins), (std::vector<int>{10, 11})) << "elsewhere in a word";
  EXPECT_EQ(senones(1, 0, 1, kAlone), (std::vector<int>{14, 15}));
  EXPECT_EQ(senones(1, 1, 1, kAlone), (std::vector<int>{2, 3})) << "whatever is beside it";
}

}  // namespace
}  // namespace mouthpiece
