#include "hearing/tags/pitch_contour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace mouthpiece {
namespace {

std::vector<double> steps(const std::vector<double>& hz, std::size_t each) {
  std::vector<double> pitch;
  for (const double level : hz) pitch.insert(pitch.end(), each, level);
  return pitch;
}

/// The cost that eq. (1) leaves, taken apart at every x, O(N^3): the other route to the same number.
double costByTheMatrix(const std::vector<double>& pitch) {
  const std::size_t n = pitch.size();
  const auto [low, high] = std::minmax_element(pitch.begin(), pitch.end());
  std::vector<std::vector<double>> cost(n, std::vector<double>(n, 0));
  for (std::size_t length = 1; length < n; ++length) {
    for (std::size_t a = 0; a + length < n; ++a) {
      const std::size_t b = a + length;
      const double count = static_cast<double>(length + 1);
      double sum = 0, moment = 0, squares = 0;
      const double middle = 0.5 * static_cast<double>(a + b);
      for (std::size_t t = a; t <= b; ++t) {
        const double x = static_cast<double>(t) - middle;
        sum += pitch[t];
        moment += pitch[t] * x;
        squares += x * x;
      }
      double error = 0;
      for (std::size_t t = a; t <= b; ++t) {
        error += std::abs(pitch[t] - sum / count - moment / squares * (static_cast<double>(t) - middle));
      }
      cost[a][b] = error + 0.5 * (*low + *high);
      for (std::size_t x = a + 1; x < b; ++x) cost[a][b] = std::min(cost[a][b], cost[a][x] + cost[x][b]);
    }
  }
  return cost[0][n - 1];
}

double costOf(const std::vector<PitchPiece>& pieces, const std::vector<double>& pitch) {
  const auto [low, high] = std::minmax_element(pitch.begin(), pitch.end());
  double cost = 0;
  for (const PitchPiece& piece : pieces) {
    const double count = static_cast<double>(piece.last - piece.first + 1);
    const double middle = 0.5 * static_cast<double>(piece.first + piece.last);
    double sum = 0;
    for (std::size_t t = piece.first; t <= piece.last; ++t) sum += pitch[t];
    cost += 0.5 * (*low + *high);
    for (std::size_t t = piece.first; t <= piece.last; ++t) {
      cost += std::abs(pitch[t] - sum / count - piece.slope_hz_s / 100 * (static_cast<double>(t) - middle));
    }
  }
  return cost;
}

TEST(NoteFit, OneSteadyToneIsOneNote) {
  const auto pieces = fitPitchPieces(std::vector<double>(100, 220.0));
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_TRUE(isNote(pieces[0]));
  EXPECT_NEAR(pieces[0].median_hz, 220, 1e-9);
}

TEST(NoteFit, MelismaHasANoteATone) {
  const auto pieces = fitPitchPieces(steps({200, 250, 300, 225}, 60));
  std::vector<double> notes;
  for (const PitchPiece& piece : pieces) {
    if (isNote(piece) && piece.last - piece.first > 20) notes.push_back(piece.median_hz);
  }
  EXPECT_EQ(notes, (std::vector<double>{200, 250, 300, 225}));
}

TEST(NoteFit, GlideIsNoNote) {
  std::vector<double> pitch;
  for (int i = 0; i < 80; ++i) pitch.push_back(200 + 0.6 * i);  // 60 Hz a second
  const auto pieces = fitPitchPieces(pitch);
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_NEAR(pieces[0].slope_hz_s, 60, 1e-6);
  EXPECT_FALSE(isNote(pieces[0]));
  for (double& hz : pitch) hz = 200 + (hz - 200) * 45 / 60;
  EXPECT_TRUE(isNote(fitPitchPieces(pitch).at(0)));
}

TEST(NoteFit, PiecesMeetAndCover) {
  const auto pitch = steps({180, 240, 200}, 50);
  const auto pieces = fitPitchPieces(pitch);
  ASSERT_FALSE(pieces.empty());
  EXPECT_EQ(pieces.front().first, 0U);
  EXPECT_EQ(pieces.back().last, pitch.size() - 1);
  for (std::size_t i = 1; i < pieces.size(); ++i) EXPECT_EQ(pieces[i].first, pieces[i - 1].last);
}

TEST(NoteFit, CostsNoMoreThanEquationOneByItsMatrix) {
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U}) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 8);
    std::vector<double> pitch = steps({200, 260, 220}, 20);
    for (double& hz : pitch) hz += noise(random);
    EXPECT_NEAR(costOf(fitPitchPieces(pitch), pitch), costByTheMatrix(pitch), 1e-6) << "seed " << seed;
  }
}

TEST(NoteFit, StandsTooFewSamples) {
  EXPECT_TRUE(fitPitchPieces({}).empty());
  EXPECT_TRUE(fitPitchPieces(std::vector<double>{200.0}).empty());
}

}  // namespace
}  // namespace mouthpiece
