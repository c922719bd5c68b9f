// Lips that meet by their surfaces as they are.
#include "deform/mouth/lip_meeting.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/smooth_step.h"
#include "deform/mouth/lip_levelling.h"
#include "deform/surface/virtual_points.h"
#include "sample_face.h"
#include "tests/unit/deform/kept_numbers.h"

namespace mouthpiece {
namespace {

using samples::sampleControl;

/// The sample face, whose lips touch, with lips that turn in behind their rims.
class ThickLips : public ::testing::Test {
 protected:
  ThickLips() {
    FaceMesh& mesh = face_.mesh;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
    for (const Triangle& t : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) ++uses[std::minmax(t[k], t[(k + 1) % 3])];
    }
    const std::vector<Triangle> skin = trianglesOf(mesh, {PartKind::kSkin});
    std::vector<Triangle> backs;
    VertexPositions& vertices = mesh.vertices;
    const auto behind = [&](std::uint32_t v) {
      const auto found = back_of_.find(v);
      if (found != back_of_.end()) return found->second;
      const auto at = static_cast<std::uint32_t>(vertices.rows());
      vertices.conservativeResize(vertices.rows() + 1, 3);
      vertices.row(at) =
          vertices.row(v) + Eigen::RowVector3f(0, face_.is_above_slit[v] ? kThickMm : -kThickMm, -kDeepMm);
      return back_of_[v] = at;
    };
    for (const Triangle& t : skin) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        if (uses[std::minmax(a, b)] != 1 || !isInMouth(a) || !isInMouth(b)) continue;
        backs.push_back({b, a, behind(a)});
        backs.push_back({b, behind(a), behind(b)});
      }
    }
    MeshPart part = mesh.parts.front();
    part.name = "backs of the lips";
    part.kind = PartKind::kMouthInside;
    part.first_triangle = mesh.triangles.size();
    part.triangle_count = backs.size();
    mesh.triangles.insert(mesh.triangles.end(), backs.begin(), backs.end());
    mesh.parts.push_back(part);
    binding_ = bindFace(mesh, sampleControl());
  }
  static constexpr float kThickMm = 4, kDeepMm = 3;

  [[nodiscard]] bool isInMouth(std::uint32_t v) const {
    const auto at = [&](const char* name) { return sampleControl().rest.row(findPoint(sampleControl(), name)); };
    const Eigen::RowVector3d p = face_.mesh.vertices.row(v).cast<double>();
    return p.x() > at("LIP_CORNER_R").x() && p.x() < at("LIP_CORNER_L").x() &&
           std::abs(p.y() - at("LIP_CORNER_R").y()) < 5;
  }
  /// One lip with its back, `thick` from the slit on, goes `mm` up.
  [[nodiscard]] VertexPositions lifted(bool upper, float mm, float thick = 14) const {
    VertexPositions moved = face_.mesh.vertices;
    const auto slit = asFloat(sampleControl().rest(lipPairs(sampleControl()).front().upper_rim, 1));
    for (std::uint32_t v = 0; v < face_.skin_vertices; ++v) {
      if (face_.is_above_slit[v] != upper || std::abs(moved(v, 1) - slit) >= thick) continue;
      moved(v, 1) += mm;
      if (const auto back = back_of_.find(v); back != back_of_.end()) moved(back->second, 1) += mm;
    }
    return moved;
  }
  [[nodiscard]] VertexPositions met(VertexPositions pose, float shut, double near, float apart = 0) const {
    LipMeeting::Wanted wanted{};
    wanted.may_shut.fill(shut);
    wanted.apart.fill(apart);
    meeting().meet(wanted, near, pose.data());
    return pose;
  }
  [[nodiscard]] const LipMeeting& meeting() const {
    if (!meeting_) meeting_.emplace(face_.mesh, face_.mesh.vertices, sampleControl(), binding_);
    return *meeting_;
  }
  /// Least and most distance between the rims, upwards, over the middle of the mouth.
  [[nodiscard]] std::pair<float, float> gaps(const VertexPositions& pose) const {
    float least = 1e9F, most = -1e9F;
    for (std::uint32_t v = 0; v + 1 < face_.skin_vertices; ++v) {
      const Eigen::RowVector3f p = face_.mesh.vertices.row(v);
      if (p != face_.mesh.vertices.row(v + 1) || std::abs(p.x()) > 10) continue;
      const float gap = face_.is_above_slit[v] ? pose(v, 1) - pose(v + 1, 1) : pose(v + 1, 1) - pose(v, 1);
      least = std::min(least, gap);
      most = std::max(most, gap);
    }
    return {least, most};
  }

  samples::SampleFace face_ = samples::makeSampleFace(3.1);
  std::map<std::uint32_t, std::uint32_t> back_of_;
  FaceBinding binding_;
  mutable std::optional<LipMeeting> meeting_;
};

TEST_F(ThickLips, ComeTogetherWhereTheyAreShut) {
  for (const bool upper : {true, false}) {
    const VertexPositions open = lifted(upper, upper ? 1.0F : -1.0F);
    ASSERT_NEAR(gaps(open).first, 1, 1e-3);
    const auto [least, most] = gaps(met(open, 1, 0));
    EXPECT_LT(most, 0.15F);
    EXPECT_GT(least, -0.3F);
    EXPECT_EQ(met(open, 0, 1), open) << "lips that may stay open are left alone";
    EXPECT_NEAR(gaps(met(open, 1, 0, 0.6F)).second, 0.6F, 0.2F) << "as far apart as their rims";
    EXPECT_EQ(met(open, 1, 0, 1.2F), open);
  }
}

TEST_F(ThickLips, PartWhereTheyCrossThoughNothingSaysThatTheyAreShut) {
  const VertexPositions crossed = lifted(true, -1.2F);
  ASSERT_NEAR(gaps(crossed).first, -1.2, 1e-3);
  const auto [least, most] = gaps(met(crossed, 0, 1));
  EXPECT_GT(least, -0.35F);
  EXPECT_LT(most, 0.1F);
  EXPECT_EQ(met(crossed, 0, 0), crossed);
}

TEST_F(ThickLips, MoveNothingFarFromTheMouth) {
  const VertexPositions open = lifted(false, -1.0F), now = met(open, 1, 1);
  const std::vector<Eigen::Vector3d> line = openingsOf(sampleControl()).lip_line;
  std::size_t moved = 0;
  for (std::uint32_t v = 0; v < face_.mesh.vertexCount(); ++v) {
    EXPECT_EQ(now(v, 0), open(v, 0));
    EXPECT_EQ(now(v, 2), open(v, 2));
    if (now(v, 1) == open(v, 1)) continue;
    ++moved;
    EXPECT_LT(distanceToLine(pointAt(face_.mesh.vertices, v), line), 0.161 * sampleControl().mouth_width);
  }
  EXPECT_GT(moved, 20U);
}

/// What lies behind the lips goes with the jaw by which of them it is nearer to along the mesh.
TEST_F(ThickLips, GoWithTheJawByTheNearerLip) {
  const HeadTopology topology(face_.mesh, openingsOf(sampleControl()));
  std::size_t between = 0;
  for (const auto& [rim, back] : back_of_) {
    const double share = topology.lowerShare(back);
    EXPECT_NEAR(double{binding_.jaw_weight[back]}, smoothStep((share - 0.35) / 0.3), 1e-5) << share;
    if (std::abs(face_.mesh.vertices(rim, 0)) < 10) {
      EXPECT_EQ(binding_.jaw_weight[back], face_.is_above_slit[rim] ? 0 : 1);
    }
    between += binding_.jaw_weight[back] > 0 && binding_.jaw_weight[back] < 1 ? 1U : 0U;
  }
  EXPECT_GT(between, 0U) << "beside the corners";
}

TEST_F(ThickLips, NeedCornersOfAMouth) {
  ControlMesh control = sampleControl();
  control.points[unsignedIndex(findPoint(control, "LIP_CORNER_L"))].name = "ELSEWHERE";
  EXPECT_THROW(LipMeeting(face_.mesh, face_.mesh.vertices, control, binding_), InputError);
}

/// What rises behind the lower lip into the upper one is crossed by it; not the wall of a mouth, as upright, which a
/// section sees by chance.
TEST_F(ThickLips, DoNotPartForAWall) {
  constexpr float kRisesMm = 5;
  const auto rising = [&](float deep) {
    VertexPositions pose = lifted(true, 1);
    for (const auto& [rim, back] : back_of_) {
      if (!face_.is_above_slit[rim]) pose.row(back) = pose.row(rim) + Eigen::RowVector3f(0, kRisesMm, -deep);
    }
    return pose;
  };
  EXPECT_GT((met(rising(2), 0, 1) - rising(2)).cwiseAbs().maxCoeff(), 0.5F);
  for (float deep = 0.02F; deep < 0.3F; deep += 0.02F) EXPECT_EQ(met(rising(deep), 0, 1), rising(deep)) << deep;
}

/// From crossing to wide open in small steps: no vertex makes a large one.
TEST_F(ThickLips, GoSteadily) {
  constexpr float kStepMm = 0.05F;
  VertexPositions before = met(lifted(true, -1.5F), 1, 1);
  for (float at = -1.5F + kStepMm; at < 4; at += kStepMm) {
    const VertexPositions now = met(lifted(true, at), 1, 1);
    EXPECT_LT((now - before).cwiseAbs().maxCoeff(), 6 * kStepMm) << at;
    before = now;
  }
}

/// Lips whose surfaces are much further apart than their rims let go of that over a way that is longer still.
TEST_F(ThickLips, GoBackNoSoonerThanTheirRimsPart) {
  constexpr float kFurtherMm = 2, kStepMm = 0.2F;
  const auto seen = [&](float apart) { return gaps(met(lifted(true, kFurtherMm + apart), 1, 1, apart)).second; };
  float before = seen(0);
  EXPECT_LT(before, 0.4F);
  for (float apart = kStepMm; apart < 10; apart += kStepMm) {
    const float now = seen(apart);
    EXPECT_LT(now - before, 1.7F * kStepMm) << apart;
    before = now;
  }
  EXPECT_NEAR(before, kFurtherMm + 10, 0.5F) << "wide open they are let go";
}

/// Levelling looks behind the rims, too, depth by depth.
TEST_F(ThickLips, AreLevelledByWhatLiesOverEachOther) {
  /// How much higher than the rims each lip's back lies, and how far the upper one's is led up from the lower one's.
  const auto ledApart = [&](float upper_back, float lower_back) {
    VertexPositions closed = face_.mesh.vertices;
    for (const auto& [rim, back] : back_of_)
      closed.row(back) =
          closed.row(rim) + Eigen::RowVector3f(0, face_.is_above_slit[rim] ? upper_back : lower_back, -2);
    FaceBinding binding = binding_;
    LipLevelling(face_.mesh, sampleControl(), binding).level(std::vector{closed}, binding);
    double up = 0, down = 0, uppers = 0, lowers = 0;
    for (const auto& [rim, back] : back_of_) {
      if (std::abs(face_.mesh.vertices(rim, 0)) > 10) continue;
      const auto& [vertices, ways] = binding.levelled;
      const auto at = std::lower_bound(vertices.begin(), vertices.end(), back);
      const double way = at != vertices.end() && *at == back ? double{ways[unsignedIndex(at - vertices.begin())]} : 0;
      (face_.is_above_slit[rim] ? up : down) += way;
      (face_.is_above_slit[rim] ? uppers : lowers) += 1;
    }
    return up / uppers - down / lowers;
  };
  EXPECT_GT(ledApart(-0.5F, 0.5F), 0.5) << "a millimetre in each other behind rims that touch";
  EXPECT_LT(ledApart(2, 1), 0.2) << "a lower lip that rises behind the upper one is not in it";
}

/// Lips that are bent and trembling, apart here and crossed there, wanted shut in some columns.
TEST_F(ThickLips, MeetAsWasKept) {
  test::KeptNumbers kept("lips that meet");
  std::mt19937 random(4);
  for (const double middle : {-1.5, 0.4, 2.5}) {
    VertexPositions pose = face_.mesh.vertices;
    const auto slit = sampleControl().rest(lipPairs(sampleControl()).front().upper_rim, 1);
    for (std::uint32_t v = 0; v < face_.skin_vertices; ++v) {
      const double x = double{pose(v, 0)} / 22, y = double{pose(v, 1)} - slit;
      if (!face_.is_above_slit[v] || std::abs(x) > 1 || y > 14) continue;
      const double up =
          (middle + 0.6 * x + 0.5 * std::sin(9 * x)) * (1 - x * x) + test::numberBetween(-0.1, 0.1, random);
      pose(v, 1) += asFloat(up);
      pose(v, 2) += asFloat(0.4 * x);
      if (const auto back = back_of_.find(v); back != back_of_.end()) pose(back->second, 1) += asFloat(0.8 * up);
    }
    LipMeeting::Wanted wanted{};
    for (std::size_t c = 0; c < kLipColumns; ++c) {
      wanted.may_shut[c] = asFloat(0.5 + 0.5 * std::sin(asReal(c)));
      wanted.apart[c] = asFloat(0.02 * asReal(c % 7));
    }
    for (const double near : {0.0, 0.6, 1.0}) {
      VertexPositions now = pose;
      meeting().meet(wanted, near, now.data());
      kept.add(now - pose);
    }
  }
}

}  // namespace
}  // namespace mouthpiece
