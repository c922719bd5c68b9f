// How a face that is judged unfit is mended (face_judge.h); docs/theory/deform/bezier_deformation.md tells why.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "base/index.h"
#include "deform/mesh/head_topology.h"
#include "deform/mesh/welding.h"
#include "deform/mouth/lip_levelling.h"
#include "deform/surface/virtual_points.h"
#include "retarget/rig/face_judge.h"

namespace mouthpiece {
namespace {

// Lengths as shares of the mouth's width.
constexpr double kRims = 0.06;         ///< so near to the line between the lips vertices are rims
constexpr double kMostPressed = 0.03;  ///< lips are pressed together by no more in all
constexpr double kMostHeldApart = 0.015;
constexpr std::array kRelaxedWithin{0.03, 0.06, 0.12, 0.2};  ///< of torn skin, one after the other
constexpr double kCoarseEdge = 0.06;  ///< edges of coarse skin count as so long at most, so that some are within that
constexpr LipLevelling::Options kLevelledHarder{.softness = 0.01, .into = 0.001};
constexpr double kSameOverlapMm = 0.02;         ///< a round that changes lips in each other by less has changed nothing
constexpr std::array kTuckedLess{0.75F, 0.5F};  ///< FaceBinding::tuck, one after the other
constexpr std::size_t kTornAlone = 3;           ///< so many faces whose lips meet as they should are relaxed further
constexpr std::size_t kRounds = 8;              ///< the last ones where nothing but lips is left to mend
/// Of the limit of lips in each other: what is looked at, and what is left of it. What is deeper comes of other faults.
constexpr double kOverlapFrom = 5.0 / 6, kOverlapTo = 4, kOverlapLeft = 0.5;

constexpr std::array<std::string_view, 5> kOfSkin{"edge length", "stretch", "triangles turned over",
                                                  "skin off its markers", "vertex jump"};

bool isOfLips(const FaceFault& fault) { return fault.limit == "closures" || fault.limit == "lips in each other"; }

/// Closures that stay open are seen, too, where they are few enough to be no fault.
bool meetWrongly(const FaceJudgement& found) {
  return found.touching < found.closures || std::any_of(found.faults.begin(), found.faults.end(), isOfLips);
}

/// Lips get into each other, the worst of all in an F or V.
bool isTuckedTooFar(const FaceJudgement& found, const JudgedPoses& poses) {
  return std::any_of(found.faults.begin(), found.faults.end(), [&](const FaceFault& fault) {
    return fault.limit == "lips in each other" && fault.pose && poses.lips[*fault.pose].tuck > 0;
  });
}

bool isWhole(const FaceJudgement& found) { return found.faults.empty() && found.touching == found.closures; }

bool canBeMended(const FaceJudgement& found) { return !isWhole(found) && (!found.torn.empty() || meetWrongly(found)); }

/// The lips meet as they should and the face moves: all that is wrong is skin that tears.
bool isTornAlone(const FaceJudgement& found) {
  return !found.faults.empty() && !found.torn.empty() &&
         std::all_of(found.faults.begin(), found.faults.end(), [](const FaceFault& fault) {
           return std::find(kOfSkin.begin(), kOfSkin.end(), fault.limit) != kOfSkin.end();
         });
}

/// A face on the way.
struct Tried {
  FaceBinding binding;
  std::set<std::uint32_t> torn;  ///< what was relaxed
  FaceJudgement found;
};

/// Adds to `pressed` what closures leave open in each column, fading out towards the mouth's corners; takes away where
/// the lips get into each other, as far as `overlap`, the limit, tells. `overlap` and lengths in the mesh's unit.
void press(const FaceJudgement& judged, double mouth_width, double overlap, std::vector<float>& pressed) {
  pressed.resize(kLipColumns, 0.0F);
  const double last = asReal(judged.left_open.size() - 1);
  std::array<double, kLipColumns> further;
  for (std::size_t c = 0; c < kLipColumns; ++c) {
    const double across = (asReal(c) + 0.5) / asReal(kLipColumns), deep = judged.overlaps[c];
    const auto at = unsignedIndex(wholePart(std::clamp((across - 0.25) / 0.5 * (last + 1), 0.0, last)));
    const double fade = std::min(1.0, 4 * std::min(across, 1 - across));
    const bool is_deep = deep > kOverlapFrom * overlap && deep < kOverlapTo * overlap;
    further[c] = is_deep ? kOverlapLeft * overlap - deep : fade * judged.left_open[at];
  }
  for (std::size_t c = 0; c < kLipColumns; ++c) {
    // Vertices of coarse lips lie in several columns.
    const double around = 0.25 * (further[c > 0 ? c - 1 : c] + further[std::min(c + 1, kLipColumns - 1)]);
    pressed[c] = asFloat(std::clamp(double{pressed[c]} + 0.5 * further[c] + around, -kMostHeldApart * mouth_width,
                                    kMostPressed * mouth_width));
  }
}

std::vector<bool> rimsOf(const FaceMesh& mesh, const ControlMesh& control) {
  const std::vector<Eigen::Vector3d> lip_line = openingsOf(control).lip_line;
  std::vector<bool> rims;
  for (std::size_t v = 0; v < mesh.vertexCount(); ++v)
    rims.push_back(distanceToLine(pointAt(mesh.vertices, v), lip_line) < kRims * control.mouth_width);
  return rims;
}

/// mendFace() on `mesh`, the head's or that with its split vertices welded by `welding`; `face`: of that mesh.
FaceJudgement mendWhole(FaceFile& face, const std::shared_ptr<const FaceMesh>& shared_mesh, const Welding& welding,
                        const FaceJudge& judge, FaceJudgement judged) {
  const FaceMesh& mesh = *shared_mesh;
  const HeadTopology topology(mesh, openingsOf(face.control));
  const double mouth_width = face.control.mouth_width;
  const double overlap = limitNamed("lips in each other") / (1000 * mesh.metres_per_unit);
  const FaceFile given = face;
  const FaceJudgement first = judged;
  // Rims that stay their own close best; where they themselves are torn they are relaxed, too. Those that do not soon
  // meet rightly are brought to it by their surfaces, coarse ones levelled; where that does not, either, they are
  // pressed on, levelled without surfaces that meet, and where that brings them into each other levelled harder and
  // held apart. Last, skin is relaxed as coarse.
  struct Way {
    bool holds_rims;
    std::optional<LipLevelling::Options> levels = {};
    bool holds_apart = false;
    bool meets = false;
    bool is_coarse = false;
    std::size_t pressed_rounds = kRounds;  ///< lips that still do not meet rightly then are left to the next way
  };
  const std::vector<bool> rims = rimsOf(mesh, face.control);
  const auto addTorn = [&](const FaceJudgement& found, std::set<std::uint32_t>& torn) {
    for (const std::uint32_t v : found.torn) torn.insert(welding.isNothing() ? v : welding.welded_of[v]);
  };
  const auto keepIfBetter = [&](const FaceFile& tried, const FaceJudgement& found) {
    if (!mendsMore(found, judged)) return;
    face = tried;
    judged = found;
  };
  std::vector<std::pair<FaceBinding, FaceJudgement>> known;  // ways often come to what another came to
  std::vector<Tried> torn_alone;
  bool meets_wrongly = meetWrongly(first);  // or what relaxing and pressing bring about
  for (const Way& way : {Way{.holds_rims = true, .pressed_rounds = 2},
                         {true, {}, false, true},
                         {false, {}, false, true},
                         {true, LipLevelling::Options{}, false, true},
                         {true},
                         {false},
                         {true, LipLevelling::Options{}},
                         {true, kLevelledHarder, true},
                         {true, {}, false, false, true}}) {
    // Few open closures of a face that is well are not worth what may bring faults: surfaces that meet, at once or not.
    const bool was_well = first.faults.empty();
    if (was_well && !way.meets) continue;
    if ((way.levels || way.meets) && !meets_wrongly) continue;
    const std::vector<bool> held = way.holds_rims ? rims : std::vector<bool>();
    FaceFile tried = given;
    FaceBinding binding = given.binding;
    binding.meets = way.meets;
    std::optional<LipLevelling> levelling;
    std::optional<FaceRig> moved;
    const auto take = [&] { moved = FaceRig::of(tried, shared_mesh, face.name, &topology); };
    if (way.levels) {
      levelling.emplace(mesh, face.control, binding, *way.levels);
      take();
    }
    FaceJudgement last = first;
    std::set<std::uint32_t> torn;
    for (std::size_t round = 0; round < kRounds; ++round) {
      const double within = kRelaxedWithin[std::min(round, kRelaxedWithin.size() - 1)];
      if (!way.levels || round == 0) addTorn(last, torn);  // what levelling itself stretches stays
      if (levelling) levelling->level(judge.closures(*moved), binding);
      if (levelling) last.left_open.fill(0);
      // What surfaces that meet leave open once all else is tried is pressed together.
      const bool is_left = !levelling && round >= kRelaxedWithin.size() && !last.faults.empty();
      if (way.meets ? is_left : levelling ? way.holds_apart : meetWrongly(last))
        press(last, mouth_width, overlap, binding.pressed);
      relaxAround(mesh, topology, {torn.begin(), torn.end()}, held, within * mouth_width, binding,
                  (way.is_coarse ? kCoarseEdge : std::numeric_limits<double>::infinity()) * mouth_width);
      tried.binding = binding;
      const auto same = std::find_if(known.begin(), known.end(), [&](const auto& one) { return one.first == binding; });
      if (levelling || same == known.end()) take();
      FaceJudgement found = same != known.end() ? same->second : judge.judge(*moved);
      if (same == known.end()) known.emplace_back(binding, found);
      const FaceJudgement before = std::exchange(last, std::move(found));
      meets_wrongly = meets_wrongly || meetWrongly(last);
      keepIfBetter(tried, last);
      if (isTornAlone(last)) torn_alone.push_back({binding, torn, last});
      const bool meets_better = last.touching > before.touching || last.lips_overlap_mm < before.lips_overlap_mm;
      const bool only_lips = std::all_of(last.faults.begin(), last.faults.end(), isOfLips);
      if (was_well || !canBeMended(last) || (round + 1 >= way.pressed_rounds && meetWrongly(last)) ||
          (round + 1 >= kRelaxedWithin.size() && !(only_lips && meets_better)))
        break;
      // Where relaxing changes nothing of lips that meet, what they leave open is pressed together at once.
      const bool is_same =
          last.touching == before.touching && std::abs(last.lips_overlap_mm - before.lips_overlap_mm) < kSameOverlapMm;
      if (way.meets && only_lips && is_same && round > 0) round = std::max(round, kRelaxedWithin.size() - 1);
    }
    if (isWhole(judged)) break;
  }
  if (judged.faults.empty()) return judged;
  // What has brought lips to meet stays as it is, and the skin that it tears is relaxed.
  std::stable_sort(torn_alone.begin(), torn_alone.end(), [](const Tried& one, const Tried& other) {
    return one.found.faults.size() < other.found.faults.size();
  });
  torn_alone.resize(std::min(torn_alone.size(), kTornAlone));
  for (Tried& from : torn_alone) {
    FaceFile tried = given;
    for (const double within : kRelaxedWithin) {
      addTorn(from.found, from.torn);
      tried.binding = from.binding;
      relaxAround(mesh, topology, {from.torn.begin(), from.torn.end()}, rims, within * mouth_width, tried.binding,
                  kCoarseEdge * mouth_width);
      from.found = judge.judge(FaceRig::of(tried, shared_mesh, face.name, &topology));
      keepIfBetter(tried, from.found);
      if (judged.faults.empty()) return judged;
    }
  }
  return judged;
}

}  // namespace

bool mendsMore(const FaceJudgement& tried, const FaceJudgement& kept) {
  const auto has = [](const FaceJudgement& found, std::string_view limit) {
    return std::any_of(found.faults.begin(), found.faults.end(),
                       [&](const auto& fault) { return fault.limit == limit; });
  };
  // A mouth that closes and a face that moves are worth more than any other fault.
  for (const std::string_view limit : {"closures", "motion", "lip motion"}) {
    if (has(tried, limit) && !has(kept, limit)) return false;
  }
  if (tried.faults.size() == kept.faults.size()) return tried.touching > kept.touching;
  return tried.faults.size() < kept.faults.size();
}

FaceJudgement mendFace(FaceFile& face, FaceRig& rig, const JudgedPoses& poses, const ActorPose& actor,
                       FaceJudgement judged, BindingOptions bound) {
  if (!canBeMended(judged)) return judged;
  const Welding welding = weldSplitTriangles(rig.mesh());  // sewn together once and not in each round
  const bool is_sewn = !welding.isNothing();
  const FaceFile given = face;
  const auto given_mesh = std::make_shared<const FaceMesh>(rig.mesh());
  const auto mesh = is_sewn ? std::make_shared<const FaceMesh>(welding.mesh) : given_mesh;
  const auto mend = [&](const FaceRig& from, const FaceFile& tried, FaceJudgement found) {
    const FaceJudge judge(from, tried, poses, actor);
    FaceFile mended = tried;
    if (is_sewn) mended.binding = weldedBinding(tried.binding, welding);
    const FaceBinding before = mended.binding;
    found = mendWhole(mended, mesh, welding, judge, std::move(found));
    if (mended.binding == before)
      mended.binding = tried.binding;
    else if (is_sewn)
      mended.binding = givenBinding(mended.binding, welding);
    return std::pair(std::move(mended), std::move(found));
  };
  const auto take = [&](FaceFile&& tried, FaceJudgement&& found) {
    judged = std::move(found);
    if (tried.binding == face.binding) return;
    face.binding = std::move(tried.binding);
    rig = FaceRig::of(face, given_mesh, rig.name());
  };
  auto [mended, found] = mend(rig, given, std::move(judged));
  take(std::move(mended), std::move(found));
  if (judged.faults.empty() || !canBeMended(judged)) return judged;
  for (const float tuck : kTuckedLess) {
    if (!isTuckedTooFar(judged, poses)) break;
    FaceFile less = given;
    less.binding.tuck = tuck;
    const FaceRig less_rig = FaceRig::of(less, given_mesh, rig.name());
    FaceJudgement found_less = judgeFace(less_rig, less, poses, actor);
    if (isTuckedTooFar(found_less, poses)) continue;
    auto [again, found_again] = mend(less_rig, less, std::move(found_less));
    if (!found_again.faults.empty()) continue;
    take(std::move(again), std::move(found_again));
    return judged;
  }
  // The rims and corners of coarse lips may hang on nothing, too far along the mesh from all that is bound.
  bound.longest_edge = kCoarseEdge;
  FaceFile anew = given;
  anew.binding = bindFace(*mesh, given.control, bound);
  if (is_sewn) anew.binding = givenBinding(anew.binding, welding);
  if (anew.binding == given.binding) return judged;
  const FaceRig anew_rig = FaceRig::of(anew, given_mesh, rig.name());
  auto [again, found_again] = mend(anew_rig, anew, judgeFace(anew_rig, anew, poses, actor));
  if (found_again.faults.empty()) take(std::move(again), std::move(found_again));
  return judged;
}

}  // namespace mouthpiece
