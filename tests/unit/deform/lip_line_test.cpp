// The line between the lips, on mouths of every make whose slit is known.
#include "deform/topology/lip_line.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <random>

#include "base/errors.h"
#include "deform/topology/head_topology.h"
#include "deform/topology/lip_cut.h"
#include "tests/unit/deform/kept_numbers.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

constexpr double kHalfMm = 25;  ///< of the slit
constexpr double kRimWithinMm = 1.5;
constexpr double kCornerWithinMm = 4;  ///< a pocket of a millimetre is no mouth any more
constexpr double kJitterMm = 2;

enum class Make { kBag, kHole, kWalls, kWelded };

/// A face of one piece of skin around a mouth, millimetres: its outline from above the mouth to below it, lofted
/// across. `open`: between the lips in the middle; `smile`: how much higher the corners are than the middle.
struct MouthSheet {
  Make make = Make::kBag;
  double open = 0, smile = 0, step = 2;
  double deep = 14;  ///< of the bag
  double fold = 0;   ///< how deep a fold of skin lies at the lower lip's edge (below 0: at the upper one's)

  [[nodiscard]] double lineAt(double x) const { return smile * std::min(1.0, x * x / (kHalfMm * kHalfMm)); }
  [[nodiscard]] double openAt(double x) const {
    const double across = x / kHalfMm;
    return make == Make::kWelded ? 0 : open * std::sqrt(std::max(0.0, 1 - across * across));
  }

  [[nodiscard]] FaceMesh mesh() const {
    std::vector<std::vector<Vector3d>> columns;
    for (double x = -60; x <= 60; x += step) columns.push_back(outline(x));
    FaceMesh face;
    const auto rows = columns[0].size();
    const std::size_t half = rows / 2;
    face.vertices.resize(signedIndex(columns.size() * rows), 3);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      for (std::size_t r = 0; r < rows; ++r)
        face.vertices.row(signedIndex(c * rows + r)) = columns[c][r].transpose().cast<float>();
    }
    for (std::size_t c = 0; c + 1 < columns.size(); ++c) {
      for (std::size_t r = 0; r + 1 < rows; ++r) {
        // Walls and holes have nothing between the two halves of an outline.
        const double x = -60 + asReal(c) * step;
        const bool is_slit = std::abs(x + 0.5 * step) < kHalfMm;
        if (r + 1 == half && make != Make::kBag && make != Make::kWelded && is_slit) continue;
        const auto a = static_cast<std::uint32_t>(c * rows + r), b = static_cast<std::uint32_t>(a + rows);
        for (const Triangle& t : {Triangle{a, a + 1, b}, Triangle{b, a + 1, b + 1}}) {
          Triangle whole{};
          for (std::size_t k = 0; k < 3; ++k)
            whole[k] = firstInPlace(columns[t[k] / rows], t[k] % rows) + static_cast<std::uint32_t>(t[k] / rows * rows);
          if (whole[0] != whole[1] && whole[1] != whole[2] && whole[2] != whole[0]) face.triangles.push_back(whole);
        }
      }
    }
    face.parts = {{.name = "skin", .triangle_count = face.triangles.size()}};
    return face;
  }

  /// Beside the slit, where nothing lies between the halves of an outline, points in one place are one.
  static std::uint32_t firstInPlace(const std::vector<Vector3d>& column, std::size_t row) {
    std::size_t first = row;
    if (std::abs(column[row].x()) >= kHalfMm) {
      while (first > 0 && (column[first - 1] - column[row]).norm() < 1e-9) --first;
    }
    return static_cast<std::uint32_t>(first);
  }

  /// From above down: skin, the round of the upper lip, the mouth's inside, the lower lip, skin.
  [[nodiscard]] std::vector<Vector3d> outline(double x) const {
    const double across = std::abs(x) / kHalfMm, inside = std::sqrt(std::max(0.0, 1 - across * across));
    const double middle = lineAt(x), front = 20 - 0.006 * x * x;
    std::vector<Vector3d> half;
    for (double y = 40; y > 9; y -= step) half.emplace_back(x, middle + y, front);
    constexpr int kRound = 8;
    const double lip = make == Make::kWelded ? 3 * std::max(inside, 0.2) : 4 * std::max(inside, 0.02);
    for (int i = 0; i <= kRound; ++i) {  // a quarter of a circle down and inwards
      const double turn = 0.5 * 3.14159265 * i / kRound;
      half.emplace_back(x, middle + 0.5 * openAt(x) + 8 * (1 - std::sin(turn)), front - lip * (1 - std::cos(turn)));
    }
    const double depth = make == Make::kWelded ? 0 : deep * inside;
    for (int i = 1; i <= 5; ++i) {  // the bag's or the wall's back
      const double up = make == Make::kWalls ? 4.0 * i : make == Make::kHole ? 0 : 0.6 * i;
      const double back = make == Make::kWalls ? lip + 1 : lip + depth * i / 5;
      if (make == Make::kWelded || make == Make::kHole) break;
      half.emplace_back(x, middle + 0.5 * openAt(x) + up * inside, front - (inside > 0 ? back : lip));
    }
    std::vector<Vector3d> whole = half;
    const std::ptrdiff_t shared = make == Make::kWelded ? 1 : 0;
    for (auto p = half.rbegin() + shared; p != half.rend(); ++p) whole.emplace_back(x, 2 * middle - p->y(), p->z());
    for (Vector3d& p : whole) {
      const double off = (p.y() - middle + std::copysign(8, fold)) / 2;
      p.z() -= std::abs(fold) * std::max(inside, 0.2) * std::exp(-0.5 * off * off);
    }
    return whole;
  }

  [[nodiscard]] MouthHints hints(std::mt19937& random) const {
    std::uniform_real_distribution<double> off(-kJitterMm, kJitterMm);
    const auto near = [&](double x, double y, double z) -> Vector3d { return {x + off(random), y + off(random), z}; };
    return {near(-kHalfMm - 1.5, smile, 16), near(kHalfMm + 1.5, smile, 16), near(0, 8 + 0.5 * open, 20),
            near(0, -8 - 0.5 * open, 20)};
  }
};

class Mouths : public ::testing::TestWithParam<std::tuple<Make, double, double, unsigned>> {};
INSTANTIATE_TEST_SUITE_P(Makes, Mouths,
                         ::testing::Combine(::testing::Values(Make::kBag, Make::kHole, Make::kWalls),
                                            ::testing::Values(0.0, 6.0), ::testing::Values(2.0, 5.0),
                                            ::testing::Range(1U, 5U)));

TEST_P(Mouths, RimsRunFromCornerToCorner) {
  const auto& [make, open, step, seed] = GetParam();
  std::mt19937 random(seed);
  const MouthSheet mouth{make, open, std::uniform_real_distribution<double>(-4, 4)(random), step};
  const FaceMesh mesh = mouth.mesh();
  const auto line = traceLipLine(mesh.vertices, mesh.triangles, mouth.hints(random));
  ASSERT_TRUE(line);
  EXPECT_TRUE(line->is_parted);
  ASSERT_EQ(line->upper.size(), line->lower.size());
  for (std::size_t i = 0; i < line->upper.size(); ++i) {
    const double x = line->upper[i].x();
    if (std::abs(x) > 0.85 * kHalfMm) continue;
    EXPECT_NEAR(line->upper[i].y(), mouth.lineAt(x) + 0.5 * mouth.openAt(x), kRimWithinMm) << x;
    EXPECT_NEAR(line->lower[i].y(), mouth.lineAt(x) - 0.5 * mouth.openAt(x), kRimWithinMm) << x;
  }
  EXPECT_NEAR(line->corner_right.x(), -kHalfMm, kCornerWithinMm + step);
  EXPECT_NEAR(line->corner_left.x(), kHalfMm, kCornerWithinMm + step);
  // Where the slit ends long triangles reach over it: a vertex in a hundred may be theirs.
  const auto strays = [&](const std::vector<std::uint32_t>& skin, double side) {
    return std::count_if(skin.begin(), skin.end(), [&](std::uint32_t v) {
      if (std::abs(double{mesh.vertices(v, 0)}) > 0.85 * kHalfMm - mouth.step)
        return false;  // beside the corners it is on no side
      return side * (double{mesh.vertices(v, 1)} - mouth.lineAt(double{mesh.vertices(v, 0)})) < -0.5;
    });
  };
  EXPECT_LE(strays(line->upper_skin, 1), signedIndex(line->upper_skin.size() / 100));
  EXPECT_LE(strays(line->lower_skin, -1), signedIndex(line->lower_skin.size() / 100));
  EXPECT_GT(line->upper_skin.size(), 20U);
  EXPECT_GT(line->lower_skin.size(), 20U);
}

class WeldedMouths : public ::testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, WeldedMouths, ::testing::Range(1U, 7U));

TEST_P(WeldedMouths, AreToldAndCutOpen) {
  std::mt19937 random(GetParam());
  const MouthSheet mouth{Make::kWelded, 0, std::uniform_real_distribution<double>(-3, 3)(random), 2};
  const FaceMesh mesh = mouth.mesh();
  const MouthHints hints = mouth.hints(random);
  const auto line = traceLipLine(mesh.vertices, mesh.triangles, hints);
  ASSERT_TRUE(line);
  EXPECT_FALSE(line->is_parted);
  for (const Vector3d& p : line->upper) {
    if (std::abs(p.x()) < 0.7 * kHalfMm) {
      EXPECT_NEAR(p.y(), mouth.lineAt(p.x()), 2) << p.x();
    }
  }
  const FaceMesh cut = cutLips(mesh, *line).mesh;
  EXPECT_GT(cut.vertexCount(), mesh.vertexCount());
  EXPECT_EQ(cut.parts.back().kind, PartKind::kMouthInside);
  // It is low at the corners, where skin that opens less than the lips would lie before it.
  std::size_t beside = 0;
  for (Eigen::Index v = mesh.vertices.rows(); v < cut.vertices.rows(); ++v) {
    const double x = static_cast<double>(cut.vertices(v, 0)), y = static_cast<double>(cut.vertices(v, 1));
    if (std::abs(x) < 0.88 * kHalfMm) continue;
    ++beside;
    EXPECT_LT(std::abs(y - mouth.lineAt(x)), 0.28 * kHalfMm) << x;
  }
  EXPECT_GT(beside, 10U);
  const auto again =
      traceLipLine(cut.vertices, trianglesOf(cut, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside}), hints);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->is_parted);
  EXPECT_THROW((void)cutLips(cut, *again), InputError) << "lips that are apart";
}

/// Open, its walls would be a sheet of skin between the lips.
TEST_P(WeldedMouths, AGrooveBetweenTheLipsIsNoMouth) {
  std::mt19937 random(GetParam());
  const MouthSheet mouth{Make::kBag, 0, std::uniform_real_distribution<double>(-3, 3)(random), 2, 4};
  const FaceMesh mesh = mouth.mesh();
  const MouthHints hints = mouth.hints(random);
  const auto line = traceLipLine(mesh.vertices, mesh.triangles, hints);
  ASSERT_TRUE(line);
  EXPECT_FALSE(line->is_parted);
  const FaceMesh cut = cutLips(mesh, *line).mesh;
  const auto again =
      traceLipLine(cut.vertices, trianglesOf(cut, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside}), hints);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->is_parted);
}

/// A fold of skin where a lip ends may be a little deeper than the crease between the lips: the mouth is where the
/// clicks have it between them.
TEST_P(WeldedMouths, FoldsBesideTheLipsAreNoMouth) {
  std::mt19937 random(GetParam());
  for (const double fold : {-3.6, 3.6}) {
    const MouthSheet mouth{Make::kWelded, 0, std::uniform_real_distribution<double>(-3, 3)(random), 1, 14, fold};
    const FaceMesh mesh = mouth.mesh();
    const auto line = traceLipLine(mesh.vertices, mesh.triangles, mouth.hints(random));
    ASSERT_TRUE(line);
    EXPECT_FALSE(line->is_parted);
    for (const Vector3d& p : line->upper) {
      if (std::abs(p.x()) < 0.7 * kHalfMm) {
        EXPECT_NEAR(p.y(), mouth.lineAt(p.x()), 2) << p.x() << " fold " << fold;
      }
    }
  }
}

/// Whatever the unit, wherever the head is and a little turned, and in a mirror: the line goes with it.
class MovedMouths : public ::testing::TestWithParam<std::tuple<Make, unsigned>> {};
INSTANTIATE_TEST_SUITE_P(Makes, MovedMouths,
                         ::testing::Combine(::testing::Values(Make::kBag, Make::kHole, Make::kWalls, Make::kWelded),
                                            ::testing::Range(1U, 5U)));

TEST_P(MovedMouths, TakeTheirLineAlong) {
  constexpr double kGoesWithinMm = 0.7;  // planes across the mouth lie elsewhere between its vertices
  const auto& [make, seed] = GetParam();
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  const MouthSheet mouth{make, make == Make::kWelded ? 0 : 3 + 3 * number(random), 4 * number(random), 2};
  const FaceMesh mesh = mouth.mesh();
  const MouthHints hints = mouth.hints(random);
  const auto line = traceLipLine(mesh.vertices, mesh.triangles, hints);
  ASSERT_TRUE(line);
  for (const bool is_mirror : {false, true}) {
    Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.2 * number(random), Vector3d(number(random), number(random), number(random)).normalized())
            .toRotationMatrix();
    if (is_mirror) turn.col(0) = -turn.col(0);
    const double scale = std::exp(4 * number(random));
    const Vector3d shift = 30 * scale * Vector3d(number(random), number(random), number(random));
    const auto moved = [&](const Vector3d& p) -> Vector3d { return scale * turn * p + shift; };
    FaceMesh other = mesh;
    for (Eigen::Index v = 0; v < other.vertices.rows(); ++v)
      other.vertices.row(v) = moved(pointAt(mesh.vertices, v)).transpose().cast<float>();
    if (is_mirror) {
      for (Triangle& t : other.triangles) std::swap(t[1], t[2]);
    }
    MouthHints its{moved(hints.corner_right), moved(hints.corner_left), moved(hints.upper), moved(hints.lower)};
    if (is_mirror) std::swap(its.corner_right, its.corner_left);
    const auto found = traceLipLine(other.vertices, other.triangles, its);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->is_parted, line->is_parted);
    for (std::size_t i = 0; i < line->upper.size(); ++i) {
      if (std::abs(line->upper[i].x()) > 0.8 * kHalfMm) continue;
      const LipLine::Pair pair = found->at(moved(0.5 * (line->upper[i] + line->lower[i])));
      EXPECT_LT((pair.upper - moved(line->upper[i])).norm() / scale, kGoesWithinMm) << line->upper[i].transpose();
      EXPECT_LT((pair.lower - moved(line->lower[i])).norm() / scale, kGoesWithinMm) << line->lower[i].transpose();
    }
    const auto alike = [](const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
      std::vector<std::uint32_t> either;
      std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(either));
      return 20 * either.size() <= a.size() + b.size() + 40;
    };
    EXPECT_TRUE(std::is_sorted(line->upper_skin.begin(), line->upper_skin.end()));
    EXPECT_TRUE(alike(line->upper_skin, found->upper_skin));
    EXPECT_TRUE(alike(line->lower_skin, found->lower_skin));
    EXPECT_TRUE(alike(line->inside, found->inside));
  }
}

/// Who knows places on the line where it is anyway changes nothing.
TEST_P(MovedMouths, KnownPlacesOfTheLineKeepIt) {
  const auto& [make, seed] = GetParam();
  std::mt19937 random(seed);
  const MouthSheet mouth{make, make == Make::kWelded ? 0.0 : 4.0, 2, 2};
  const FaceMesh mesh = mouth.mesh();
  MouthHints hints = mouth.hints(random);
  const auto line = traceLipLine(mesh.vertices, mesh.triangles, hints);
  ASSERT_TRUE(line);
  for (std::size_t i = 0; i < line->upper.size(); i += 3)
    hints.on_line.push_back(0.5 * (line->upper[i] + line->lower[i]));
  const auto known = traceLipLine(mesh.vertices, mesh.triangles, hints);
  ASSERT_TRUE(known);
  EXPECT_EQ(known->is_parted, line->is_parted);
  for (std::size_t i = 0; i < line->upper.size(); ++i) {
    if (std::abs(line->upper[i].x()) > 0.8 * kHalfMm) continue;
    const LipLine::Pair pair = known->at(line->upper[i]);
    EXPECT_LT((pair.upper - line->upper[i]).norm(), 1) << line->upper[i].transpose();
    EXPECT_LT((pair.lower - line->lower[i]).norm(), 1) << line->lower[i].transpose();
  }
}

TEST(LipLine, BetweenItsPlacesItIsStraightAndBeyondThemItEnds) {
  LipLine line;
  line.corner_right = {-3, 0, 0};
  line.corner_left = {3, 0, 0};
  line.upper = {{-2, 1, 4}, {0, 3, 6}, {2, 5, 2}};
  line.lower = {{-2, -1, 4}, {0, -2, 5}, {2, 0, 1}};
  const auto expectAt = [&](double x, const Vector3d& upper, const Vector3d& lower) {
    const LipLine::Pair pair = line.at({x, 77, -5});  // how high and deep it is asked for does not matter
    EXPECT_LT((pair.upper - upper).norm() + (pair.lower - lower).norm(), 1e-12) << x;
  };
  expectAt(-9, line.upper[0], line.lower[0]);
  expectAt(-2, line.upper[0], line.lower[0]);
  expectAt(-1.5, {-1.5, 1.5, 4.5}, {-1.5, -1.25, 4.25});
  expectAt(0, line.upper[1], line.lower[1]);
  expectAt(1, {1, 4, 4}, {1, -1, 3});
  expectAt(2, line.upper[2], line.lower[2]);
  expectAt(9, line.upper[2], line.lower[2]);
}

/// Columns of vertices that no section passes are as much inside as those beside them.
TEST(LipLine, AllThatLiesBehindTheLipsIsInside) {
  std::mt19937 random(11);
  const MouthSheet mouth{Make::kBag, 3, 1, 0.4};
  const FaceMesh mesh = mouth.mesh();
  FaceOpenings openings;
  openings.mouth = mouth.hints(random);
  const HeadTopology topology(mesh, openings);
  const std::size_t rows = mouth.outline(0).size();
  std::size_t inside = 0;
  for (std::size_t v = 0; v < mesh.vertexCount(); ++v) {
    const Vector3d p = pointAt(mesh.vertices, v);
    if (std::abs(p.x()) > 0.6 * kHalfMm) continue;
    const std::size_t row = v % rows, from_middle = row < rows / 2 ? rows / 2 - row : row - rows / 2 + 1;
    if (from_middle <= 4) {
      EXPECT_TRUE(topology.isInMouth(v)) << p.transpose();
      ++inside;
    }
    if (std::abs(p.y() - mouth.lineAt(p.x())) > 9) {
      EXPECT_FALSE(topology.isInMouth(v)) << p.transpose();
    }
  }
  EXPECT_GT(inside, 500U);
}

TEST(MouthBag, JoinsTheEdgeOfAHole) {
  std::mt19937 random(3);
  const MouthSheet mouth{Make::kHole, 4, 1, 2};
  const FaceMesh mesh = mouth.mesh();
  const MouthHints hints = mouth.hints(random);
  const auto line = traceLipLine(mesh.vertices, mesh.triangles, hints);
  ASSERT_TRUE(line && line->is_parted);
  const FaceMesh bagged = withMouthBag(mesh, *line).mesh;
  ASSERT_EQ(bagged.parts.size(), mesh.parts.size() + 1);
  EXPECT_EQ(bagged.parts.back().kind, PartKind::kMouthInside);
  EXPECT_EQ(bagged.vertices.topRows(mesh.vertices.rows()), mesh.vertices);
  // Its triangles join what lies side by side.
  for (const Triangle& t : trianglesOf(bagged, bagged.parts.back())) {
    const auto [right, left] =
        std::minmax({bagged.vertices(t[0], 0), bagged.vertices(t[1], 0), bagged.vertices(t[2], 0)});
    EXPECT_LT(left - right, 2.5 * mouth.step);
  }
  // Lips get a thickness: off their rims the bag goes back before it goes up and down.
  std::size_t rims = 0;
  for (const Triangle& t : trianglesOf(bagged, bagged.parts.back())) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t rim = std::min(t[k], t[(k + 1) % 3]), behind = std::max(t[k], t[(k + 1) % 3]);
      if (rim >= mesh.vertexCount() || behind < mesh.vertexCount()) continue;
      const Eigen::RowVector3f way = bagged.vertices.row(behind) - bagged.vertices.row(rim);
      if (std::abs(bagged.vertices(rim, 0)) > 0.5F * kHalfMm) continue;
      ++rims;
      EXPECT_GT(-way.z(), 1.5F * std::abs(way.y())) << way;
    }
  }
  EXPECT_GT(rims, 20U);
  // No edge has a triangle on one side only but those around the face.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const Triangle& t : bagged.triangles) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(++sides[std::pair(t[k], t[(k + 1) % 3])], 1);
  }
  for (const auto& [edge, count] : sides) {
    if (sides.contains({edge.second, edge.first})) continue;
    EXPECT_TRUE(std::abs(bagged.vertices(edge.first, 0)) > 55 || std::abs(bagged.vertices(edge.first, 1)) > 30)
        << bagged.vertices.row(edge.first);
  }
  const auto again = traceLipLine(bagged.vertices, bagged.triangles, hints);
  ASSERT_TRUE(again && again->is_parted);
  for (std::size_t i = 0; i < std::min(line->upper.size(), again->upper.size()); ++i) {
    const Vector3d there = again->at(line->upper[i]).upper;
    if (std::abs(there.x()) < 0.8 * kHalfMm) {
      EXPECT_LT((line->upper[i] - there).norm(), kRimWithinMm);
    }
  }
  EXPECT_EQ(withMouthBag(bagged, *again).parents.size(), 0U) << "there is no hole any more";
}

TEST(LipLine, NothingIsFoundWhereNoSkinIs) {
  const FaceMesh mesh = MouthSheet{}.mesh();
  const MouthHints elsewhere{{1000, 0, 0}, {1050, 0, 0}, {1025, 8, 5}, {1025, -8, 5}};
  EXPECT_FALSE(traceLipLine(mesh.vertices, mesh.triangles, elsewhere));
  const MouthHints in_one_place{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  EXPECT_FALSE(traceLipLine(mesh.vertices, mesh.triangles, in_one_place));
}

TEST(LipLine, RunsWhereItWasKept) {
  for (const Make make : {Make::kBag, Make::kHole, Make::kWalls}) {
    for (const double open : {0.0, 3.0}) {
      test::KeptNumbers kept("lip line " + std::to_string(static_cast<int>(make)) + (open > 0 ? " open" : " shut"));
      for (const double step : {2.0, 4.0}) {
        const MouthSheet mouth{make, open, 1.3, step};
        const FaceMesh mesh = mouth.mesh();
        const MouthHints hints{{-26.1, 2.4, 16}, {25.7, 0.3, 16}, {0.8, 8.6 + 0.5 * open, 20}, {-0.6, -7.1, 20}};
        const auto line = traceLipLine(mesh.vertices, mesh.triangles, hints);
        ASSERT_TRUE(line);
        kept.add(line->upper).add(line->lower).add(line->corner_right).add(line->corner_left);
        kept.add(asReal(line->upper_skin.size())).add(asReal(line->lower_skin.size()));
        kept.add(asReal(line->inside.size()));
        for (double x = -30; x <= 30; x += 3.7) kept.add(line->at({x, 2, 15}).upper).add(line->at({x, 2, 15}).lower);
      }
    }
  }
}

TEST(MouthBag, IsTheOneThatWasKept) {
  test::KeptNumbers kept("mouth bag");
  for (const double open : {1.0, 5.0}) {
    const MouthSheet mouth{Make::kHole, open, -0.8, 2};
    const FaceMesh mesh = mouth.mesh();
    const MouthHints hints{
        {-26.1, 0.4, 16}, {25.7, -1.3, 16}, {0.8, 8.6 + 0.5 * open, 20}, {-0.6, -7.1 - 0.5 * open, 20}};
    const auto line = traceLipLine(mesh.vertices, mesh.triangles, hints);
    ASSERT_TRUE(line);
    const GrownMesh grown = withMouthBag(mesh, *line);
    ASSERT_FALSE(grown.parents.empty());
    kept.add(grown.mesh.vertices).add(grown.parents);
    for (const Triangle& t : trianglesOf(grown.mesh, grown.mesh.parts.back())) kept.add(t[0]).add(t[1]).add(t[2]);
  }
}

TEST(LipCut, GoesWhereItWasKept) {
  test::KeptNumbers kept("lip cut");
  for (const double smile : {-2.0, 1.1}) {
    const MouthSheet mouth{Make::kWelded, 0, smile, 2};
    const FaceMesh mesh = mouth.mesh();
    const MouthHints hints{{-26.1, 0.4 + smile, 16}, {25.7, smile - 1.3, 16}, {0.8, 8.6, 20}, {-0.6, -7.1, 20}};
    const auto line = traceLipLine(mesh.vertices, mesh.triangles, hints);
    ASSERT_TRUE(line);
    const GrownMesh grown = cutLips(mesh, *line);
    kept.add(grown.mesh.vertices).add(grown.parents);
    for (const Triangle& t : grown.mesh.triangles) kept.add(t[0]).add(t[1]).add(t[2]);
  }
}

}  // namespace
}  // namespace mouthpiece
