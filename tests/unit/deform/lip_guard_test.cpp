// Lips that are pushed into each other or drawn a little apart by hand, and what the guard makes of it.
#include "deform/mouth/lip_guard.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mouth/lip_levelling.h"
#include "deform/surface/binding.h"
#include "tests/unit/deform/kept_numbers.h"
#include "tests/unit/deform/rolled_lips.h"

namespace mouthpiece {
namespace {

using samples::lips;
using samples::sampleControl;
using samples::sampleFace;
using samples::withTeeth;
using Guards = samples::Guards;

TEST_F(Guards, LeaveLipsThatRestAlone) {
  ASSERT_GE(rims().size(), 9U);
  EXPECT_LT((guarded(rest()) - rest()).cwiseAbs().maxCoeff(), 1e-4F);
  EXPECT_LT((guarded(rest(), 0, allPairs({.opened = 0})) - rest()).cwiseAbs().maxCoeff(), 0.002F * width());
}

/// Lips that are in each other are pushed out of each other, by half each, and nothing else is.
TEST_F(Guards, PartLipsByHalfEach) {
  for (const float into : {0.2F, 0.5F, 1.0F}) {
    for (const bool upper : {true, false}) {
      const VertexPositions pressed = lifted(upper, upper ? -into : into), now = guarded(pressed);
      EXPECT_GT(narrowestGap(now), -0.15F * into - 0.05F) << into;
      EXPECT_LT(widestGap(now), 0.15F * into) << "no further than that";
      for (const auto& [lower_rim, upper_rim] : rims()) {
        const float up = now(upper_rim, 1) - pressed(upper_rim, 1), down = pressed(lower_rim, 1) - now(lower_rim, 1);
        EXPECT_NEAR(up, down, 0.25F * into) << into;
        EXPECT_GT(up, 0.2F * into);
      }
      for (Eigen::Index v = 0; v < rest().rows(); ++v) {
        if (std::abs(heightOverSlit(v)) > 0.16F * width() + into) {
          EXPECT_EQ(now.row(v), pressed.row(v)) << v;
        }
      }
    }
  }
}

/// The further apart the mouth's points are the less is done, and beyond 0.08 of its width nothing.
TEST_F(Guards, FadeOutAsTheMouthOpens) {
  const VertexPositions pressed = lifted(true, -0.6F);
  float before = -1e9F;
  for (const double apart : {0.079, 0.07, 0.06, 0.05}) {
    const float left = narrowestGap(guarded(pressed, apart * double{width()}));
    EXPECT_GT(left, before) << apart;
    before = left;
  }
  EXPECT_NEAR(narrowestGap(guarded(pressed, 0.039 * double{width()})), narrowestGap(guarded(pressed)), 1e-5F);
  EXPECT_LT(narrowestGap(guarded(pressed, 0.079 * double{width()})), -0.5F);
  EXPECT_EQ(guarded(pressed, 0.081 * double{width()}), pressed);
}

/// Lips that are a little apart where they shall touch are drawn together, by half each.
TEST_F(Guards, DrawTogetherWhatShallTouch) {
  for (const float apart : {0.25F, 0.8F}) {
    const VertexPositions open = lifted(false, -apart);
    const VertexPositions now = guarded(open, 0, allPairs({.opened = 0}));
    EXPECT_LT(widestGap(now), 0.25F * apart + 0.05F) << apart;
    EXPECT_GT(narrowestGap(now), -0.05F) << "not into each other";
    for (const auto& [lower, upper] : rims()) {
      const float down = open(upper, 1) - now(upper, 1), up = now(lower, 1) - open(lower, 1);
      EXPECT_NEAR(down, up, 0.2F * apart + 0.02F);
    }
    // From the rims on it fades: at half of 0.12 widths half of it, beyond nothing.
    for (Eigen::Index v = 0; v < signedIndex(sampleFace().skin_vertices); ++v) {
      const float far = std::abs(heightOverSlit(v)) / width(), way = (now.row(v) - open.row(v)).norm();
      if (std::abs(rest()(v, 0)) > 8) continue;
      if (far > 0.125F) {
        EXPECT_EQ(way, 0) << v;
      } else if (far > 0.06F) {
        EXPECT_LT(way, 0.3F * apart) << v;
      } else if (far < 0.045F) {
        EXPECT_GT(way, 0.2F * apart) << v;
      }
    }
  }
}

TEST_F(Guards, DrawNothingThatIsOpenKeptApartTuckedOrFar) {
  const VertexPositions open = lifted(false, -0.6F);
  const double wide{width()};
  EXPECT_EQ(guarded(open, 0, allPairs({.opened = 1})), open);
  EXPECT_EQ(guarded(open, 0, allPairs({.opened = 0, .least = 0.0101 * wide})), open);
  EXPECT_EQ(guarded(open, 0, allPairs({.opened = 0, .least = 0, .tuck = 1})), open);
  EXPECT_EQ(guarded(open), open) << "nobody says that they touch";
  const auto left = [&](const LipGap& gap) { return widestGap(guarded(open, 0, allPairs(gap))); };
  EXPECT_GT(left({.opened = 0.8}), left({.opened = 0.4}) + 0.01F);
  EXPECT_GT(left({.opened = 0, .least = 0.007 * wide}), left({.opened = 0, .least = 0.004 * wide}) + 0.01F);
  EXPECT_GT(left({.opened = 0, .least = 0, .tuck = 0.8}), left({.opened = 0, .least = 0, .tuck = 0.5}) + 0.01F);
  // Up to 0.02 widths apart the whole way, from 0.042 on not at all.
  const VertexPositions far = lifted(false, -0.0425F * width()), between = lifted(false, -0.037F * width());
  EXPECT_EQ(guarded(far, 0, allPairs({.opened = 0})), far);
  const float rest_of_way = widestGap(guarded(between, 0, allPairs({.opened = 0}))) / (0.037F * width());
  EXPECT_GT(rest_of_way, 0.2F);
  EXPECT_LT(rest_of_way, 0.98F);
}

/// Only the pairs that touch: the right half of the mouth may be open while the left is shut.
TEST_F(Guards, DrawColumnByColumn) {
  const VertexPositions open = lifted(false, -0.6F);
  std::vector<LipGap> gaps;
  for (const LipPair& pair : lipPairs(sampleControl()))
    gaps.push_back({.opened = sampleControl().rest(pair.upper_rim, 0) > 1 ? 0.0 : 1.0});
  const VertexPositions now = guarded(open, 0, gaps);
  for (const auto& [lower, upper] : rims()) {
    const float gap = now(upper, 1) - now(lower, 1);
    if (rest()(lower, 0) < -2.5F) {
      EXPECT_NEAR(gap, 0.6F, 1e-4F) << rest()(lower, 0);
    }
    if (rest()(lower, 0) > 7) {
      EXPECT_LT(gap, 0.25F) << rest()(lower, 0);
    }
  }
}

/// Slivers along coarse rims face anywhere: the other lip, before one that faces back and down, is not in this lip.
TEST_F(Guards, ArePushedByNothingThatFacesAway) {
  FaceMesh mesh = lips().mesh;
  const auto first_tip = static_cast<Eigen::Index>(mesh.vertices.rows());
  mesh.vertices.conservativeResize(first_tip + signedIndex(lips().rims.size()) - 1, 3);
  for (std::size_t i = 0; i + 1 < lips().rims.size(); ++i) {
    const Eigen::Index one = lips().rims[i].first, other = lips().rims[i + 1].first, tip = first_tip + signedIndex(i);
    const auto [right, left] = rest()(one, 0) < rest()(other, 0) ? std::pair(one, other) : std::pair(other, one);
    mesh.vertices.row(tip) = 0.5F * (rest().row(one) + rest().row(other)) + Eigen::RowVector3f(0, -0.18F, 0.09F);
    mesh.triangles.push_back(
        {static_cast<std::uint32_t>(right), static_cast<std::uint32_t>(left), static_cast<std::uint32_t>(tip)});
    ++mesh.parts.back().triangle_count;
  }
  const LipGuard guard(mesh, mesh.vertices, sampleControl(), bindFace(mesh, sampleControl()));
  for (const float apart : {0.5F, 1.0F, 1.5F}) {
    VertexPositions moved = mesh.vertices;
    for (Eigen::Index v = 0; v < moved.rows(); ++v) {
      const bool is_lower = v >= first_tip || lips().side[unsignedIndex(v)] == -1;
      if (is_lower && std::abs(moved(v, 1) - slit()) < 12) moved(v, 1) -= apart;
    }
    VertexPositions now = moved;
    guard.separate(pointsApart(double{apart}), {}, {}, now.data());
    EXPECT_LT((now - moved).cwiseAbs().maxCoeff(), 0.05F) << apart;
  }
}

/// A lip that is pushed into the teeth behind it comes out before them, wherever the jaw has taken them.
TEST_F(Guards, KeepLipsOutOfTeeth) {
  for (const bool upper : {true, false}) {
    const float front = -5.2F;
    const FaceMesh mesh =
        upper ? withTeeth(PartKind::kUpperTeeth, -1, 8, front) : withTeeth(PartKind::kLowerTeeth, -8, 1, front);
    const LipGuard guard(mesh, mesh.vertices, sampleControl(), bindFace(mesh, sampleControl()));
    VertexPositions still = mesh.vertices;
    guard.separate(sampleControl().rest, {}, {}, still.data());
    EXPECT_LT((still - mesh.vertices).cwiseAbs().maxCoeff(), 1e-4F) << "before them they stay";
    const AddedMotion jaw{Eigen::Matrix3d::Zero(), {0, -6, 0}};
    const Eigen::RowVector3f gone = upper ? Eigen::RowVector3f(0, 0, -2.4F) : Eigen::RowVector3f(0, -6, -2.4F);
    VertexPositions pushed = mesh.vertices;
    for (std::size_t v = 0; v < lips().side.size(); ++v) {
      if (lips().side[v] == (upper ? 1 : -1) && std::abs(heightOverSlit(signedIndex(v))) < 12)
        pushed.row(signedIndex(v)) += gone;
    }
    VertexPositions now = pushed;
    guard.separate(pointsApart(upper ? 0 : 6), {}, jaw, now.data());
    const float face = mesh.vertices(lips().rims[lips().rims.size() / 2].first, 2) + front;
    std::size_t out = 0;
    for (Eigen::Index v = signedIndex(sampleFace().mesh.vertexCount()); v < signedIndex(lips().side.size()); ++v) {
      const float x = mesh.vertices(v, 0);
      if (lips().side[unsignedIndex(v)] != (upper ? 1 : -1) || std::abs(x) > 9) continue;
      const float before = pushed(v, 2) - (face - 0.02F * x * x), after = now(v, 2) - (face - 0.02F * x * x);
      if (before < -0.3F) {
        EXPECT_GT(after, -0.25F) << x;
        ++out;
      } else if (before > 0.1F) {
        EXPECT_LT((now.row(v) - pushed.row(v)).norm(), 0.05F) << x;
      }
      EXPECT_NEAR(now(v, 1), pushed(v, 1), 0.4F) << "straight out";
    }
    EXPECT_GT(out, 5U) << (upper ? "upper" : "lower");
  }
}

/// What is relaxed goes where others take it after the guard has looked: into the teeth, if it did not look again.
TEST_F(Guards, KeepRelaxedLipsOutOfTeethToo) {
  const float front = -5.2F;
  const FaceMesh mesh = withTeeth(PartKind::kUpperTeeth, -1, 8, front);
  FaceBinding binding = bindFace(mesh, sampleControl());
  FaceBinding::Relaxed& relaxed = binding.relaxed;
  for (auto v = static_cast<std::uint32_t>(sampleFace().mesh.vertexCount()); v < lips().side.size(); ++v) {
    const float x = mesh.vertices(v, 0);
    if (lips().side[v] != 1 || std::abs(x) > 9) continue;
    for (const auto& [lower, upper] : lips().rims) {
      if (mesh.vertices(upper, 0) != x) continue;
      relaxed.vertices.push_back(v);
      relaxed.from.push_back(static_cast<std::uint32_t>(upper));
      relaxed.weights.push_back(1);
      relaxed.ends.push_back(static_cast<std::uint32_t>(relaxed.from.size()));
      break;
    }
  }
  MarkerPositions markers = sampleControl().markerRest();
  for (const LipPair& pair : lipPairs(sampleControl())) markers(pair.upper_marker, 2) -= 2.4;
  VertexPositions now;
  FaceDeformer(mesh, sampleControl(), binding).deform(FacePose(markers), {}, now);
  const float face = mesh.vertices(lips().rims[lips().rims.size() / 2].first, 2) + front;
  std::size_t out = 0;
  for (std::size_t i = 0; i < relaxed.vertices.size(); ++i) {
    const std::uint32_t v = relaxed.vertices[i], rim = relaxed.from[i];
    const float x = mesh.vertices(v, 0), teeth = face - 0.02F * x * x;
    const float carried = mesh.vertices(v, 2) + now(rim, 2) - mesh.vertices(rim, 2);
    if (carried > teeth - 0.3F) continue;
    EXPECT_GT(now(v, 2), teeth - 0.25F) << x;
    ++out;
  }
  EXPECT_GT(out, 3U);
}

/// Levelled ways fade as the rims part, whatever watches are near, and set in nowhere all at once.
TEST_F(Guards, LevelledWaysFadeWithoutAJump) {
  FaceBinding binding = bindFace(lips().mesh, sampleControl());
  const auto vertex = static_cast<std::uint32_t>(rims()[rims().size() / 2].first);
  constexpr float kWay = 2;
  binding.levelled = {{vertex}, {kWay}};
  const LipGuard levels(lips().mesh, rest(), sampleControl(), binding);
  const std::vector<LipGap> open = allPairs({.opened = 1});
  const auto wayAt = [&](float apart) {
    VertexPositions moved = lifted(false, -apart);
    const float before = moved(vertex, 1);
    levels.separate(pointsApart(double{apart}), open, {}, moved.data());
    return moved(vertex, 1) - before;
  };
  constexpr float kFrom = 2.5F, kStep = 0.1F;  // nearer, the guard holds the lips apart
  float before = wayAt(kFrom);
  EXPECT_GT(before, 0.7F * kWay);
  for (float apart = kFrom + kStep; apart < 14; apart += kStep) {
    const float now = wayAt(apart);
    EXPECT_LT(before - now, kStep) << "faster than the lips part, " << apart << " mm apart";
    EXPECT_LE(now, before + 1e-4F) << apart;
    before = now;
  }
  EXPECT_NEAR(before, 0, 1e-4F);
}

/// Lips that are pressed let each other come as much further in; lips that are held apart keep that distance.
TEST_F(Guards, PressedLipsGoThatMuchIntoEachOther) {
  FaceBinding binding = bindFace(lips().mesh, sampleControl());
  const auto gapAfter = [&](float pressed, float into) {
    binding.pressed.assign(kLipColumns, pressed);
    const LipGuard guard(lips().mesh, rest(), sampleControl(), binding);
    VertexPositions moved = lifted(true, -into);
    guard.separate(pointsApart(0), {}, {}, moved.data());
    return narrowestGap(moved);
  };
  for (const float into : {0.6F, 1.0F}) {
    EXPECT_NEAR(gapAfter(0.4F, into), gapAfter(0, into) - 0.4F, 0.15F) << into;
    EXPECT_LT(gapAfter(0.4F, into), gapAfter(0.2F, into));
  }
  EXPECT_LT(std::abs(gapAfter(-0.3F, 0)), 0.1F) << "what rests closed stays so";
}

/// Surfaces that are further apart than their rims are brought as near as these, and no slower or faster than rims part
/// the lips do: what says that lips are shut may be gone within half a millimetre.
TEST_F(Guards, LipsThatMeetPartAsTheirRimsDo) {
  FaceBinding binding = bindFace(lips().mesh, sampleControl());
  binding.meets = true;
  const LipGuard meets(lips().mesh, rest(), sampleControl(), binding);
  constexpr float kTooFar = 3, kStep = 0.05F, kTimes = 3;
  const auto gapAt = [&](float apart) {
    VertexPositions moved = lifted(false, -apart - kTooFar);
    meets.meet(pointsApart(double{apart}), allPairs({.opened = 0, .least = double{apart}}), moved.data());
    return widestGap(moved);
  };
  float before = gapAt(0);
  EXPECT_LT(before, 0.4F * kTooFar) << "softly, for what is closed to the last leaves single vertices standing out";
  for (float apart = kStep; apart < 5; apart += kStep) {
    const float now = gapAt(apart);
    EXPECT_LT(now - before, kTimes * kStep) << apart;
    EXPECT_GT(now, before - kStep) << apart;
    before = now;
  }
  EXPECT_GT(before, kTooFar);
}

/// What levels the lips looks at the lips alone, not at what lies far behind their rims, and goes with the head.
TEST_F(Guards, LevellingLooksAtTheRimsWhereverTheHeadStands) {
  const auto waysFor = [](const Eigen::RowVector3f& shift, bool behind) {
    FaceMesh mesh = lips().mesh;
    mesh.vertices.rowwise() += shift;
    samples::SampleFace face = sampleFace();
    face.rest.rowwise() += shift.cast<double>();
    for (auto& [name, place] : face.known) place += shift.transpose().cast<double>();
    const ControlMesh control = buildControlMesh(face.names, face.rest, face.known);
    FaceBinding binding = bindFace(mesh, control);
    VertexPositions pose = mesh.vertices;
    const std::size_t row = lips().rims.size();
    for (std::size_t i = 0; i < row; ++i) {
      // Upper lips' third row, or every other of their rims.
      const auto last = signedIndex(lips().side.size() - row + i);
      if (behind) pose(last, 1) -= 5;
      if (!behind && i % 2 == 0) pose(lips().rims[i].second, 1) += 0.8F;
    }
    LipLevelling(mesh, control, binding).level(std::vector{pose}, binding);
    Eigen::VectorXf ways = Eigen::VectorXf::Zero(mesh.vertices.rows());
    for (std::size_t i = 0; i < binding.levelled.vertices.size(); ++i)
      ways[binding.levelled.vertices[i]] = binding.levelled.ways[i];
    return ways;
  };
  EXPECT_LT(waysFor({0, 0, 0}, true).cwiseAbs().maxCoeff(), 0.4F);
  const Eigen::VectorXf here = waysFor({0, 0, 0}, false), there = waysFor({20, 120, -40}, false);
  EXPECT_LT((here - there).cwiseAbs().maxCoeff(), 0.02F);
}

/// Lips pushed into each other, into the teeth, or apart by a little, all of it slanted and uneven.
TEST_F(Guards, DoAsWasKept) {
  test::KeptNumbers kept("guarded lips");
  for (const bool pressed : {false, true}) {
    for (const PartKind row : {PartKind::kUpperTeeth, PartKind::kLowerTeeth}) {
      const bool upper = row == PartKind::kUpperTeeth;
      const FaceMesh mesh = withTeeth(row, upper ? -1.5F : -8, upper ? 8 : 0.7F, -4.6F);
      FaceBinding binding = bindFace(mesh, sampleControl());
      for (std::size_t c = 0; pressed && c < kLipColumns; ++c) binding.pressed.push_back(0.01F * asFloat(asReal(c)));
      const LipGuard guard(mesh, mesh.vertices, sampleControl(), binding);
      const AddedMotion jaw{0.02 * Eigen::Matrix3d::Identity(), {0.2, -1, 0.1}};
      for (const float mm : {-2.2F, -0.7F, 0.5F, 1.6F}) {
        VertexPositions pose = mesh.vertices;
        for (std::size_t v = 0; v < lips().side.size(); ++v) {
          const auto i = signedIndex(v);
          if (lips().side[v] != 1 || std::abs(heightOverSlit(i)) > 12) continue;
          pose(i, 1) += mm * (1 + 0.02F * pose(i, 0));
          pose(i, 2) -= 1.1F + 0.03F * pose(i, 0);
        }
        VertexPositions now = pose;
        const double apart = std::max(0.0F, mm);
        const std::vector<LipGap> gaps = allPairs({.opened = 0.3, .least = 0.1, .tuck = upper ? 0 : 0.4});
        guard.separate(pointsApart(apart), gaps, jaw, now.data());
        guard.leaveTeeth(jaw, now.data());
        guard.meet(pointsApart(apart), gaps, now.data());
        kept.add(now - pose);
      }
    }
  }
}

}  // namespace
}  // namespace mouthpiece
