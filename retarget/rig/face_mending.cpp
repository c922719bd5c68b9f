// How a face that is judged unfit is mended (face_judge.h); docs/theory/deform/mending.md tells why.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include "base/index.h"
#include "deform/mouth/lip_levelling.h"
#include "deform/surface/virtual_points.h"
#include "deform/topology/head_topology.h"
#include "deform/topology/welding.h"
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
/// Of the limits of edges: skin that is torn further is not relaxed further. The widths of kRelaxedWithin took a third
/// off what a mouth tore that opened ten times as far as in speech.
constexpr double kMostTorn = 2;
constexpr std::size_t kTornAlone = 3;  ///< so many faces whose lips meet as they should are relaxed further
constexpr std::size_t kRounds = 8;     ///< the last ones where nothing but lips is left to mend
/// Of the limit of lips in each other: what is looked at, and what is left of it. What is deeper comes of other faults.
constexpr double kOverlapFrom = 5.0 / 6, kOverlapTo = 4, kOverlapLeft = 0.5;

/// Vertices that are judged in all, over all judgements: what mends a face mends it with less, and a head that nothing
/// mends is refused after it.
constexpr double kMostJudged = 2.5e6, kLeastJudgements = 16;

constexpr std::array<std::string_view, 5> kOfSkin{"edge length", "stretch", "triangles turned over",
                                                  "skin off its markers", "vertex jump"};

bool isOfLips(const FaceFault& fault) { return fault.limit == "closures" || fault.limit == "lips in each other"; }

/// Closures that stay open are seen, too, where they are few enough to be no fault.
bool meetWrongly(const FaceJudgement& found) {
  return found.touching < found.closures || std::any_of(found.faults.begin(), found.faults.end(), isOfLips);
}

/// Lips get into each other or the teeth, the worst of all in an F or V.
bool isTuckedTooFar(const FaceJudgement& found, const JudgedPoses& poses) {
  return std::any_of(found.faults.begin(), found.faults.end(), [&](const FaceFault& fault) {
    const bool gets_in = fault.limit == "lips in each other" || fault.limit == "lips in the teeth";
    return gets_in && fault.pose && poses.lips[*fault.pose].tuck > 0;
  });
}

bool onlyOfLips(const FaceJudgement& found) { return std::all_of(found.faults.begin(), found.faults.end(), isOfLips); }

/// Nothing else is wrong.
bool isTuckedTooFarAlone(const FaceJudgement& found, const JudgedPoses& poses) {
  return isTuckedTooFar(found, poses) && found.faults.size() == 1;
}

bool meetAlike(const FaceJudgement& one, const FaceJudgement& other) {
  return one.touching == other.touching && std::abs(one.lips_overlap_mm - other.lips_overlap_mm) < kSameOverlapMm;
}

/// Lips are in each other where few of them touch: what presses them brings no more of them to meet.
bool crossOpen(const FaceJudgement& found) {
  return found.lips_overlap_mm > limitNamed("lips in each other") && 2 * found.touching < found.closures;
}

bool isWhole(const FaceJudgement& found) { return found.faults.empty() && found.touching == found.closures; }

bool canBeMended(const FaceJudgement& found) { return !isWhole(found) && (!found.torn.empty() || meetWrongly(found)); }

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

/// How a face is mended. Rims that stay their own close best; where they themselves are torn they are relaxed, too.
struct Way {
  bool holds_rims;
  std::optional<LipLevelling::Options> levels = {};
  bool holds_apart = false;
  bool meets = false;
  bool is_coarse = false;
  std::size_t pressed_rounds = kRounds;  ///< lips that still do not meet rightly then are left to the next way
};

/// Lips that do not soon meet rightly are brought to it by their surfaces, coarse ones levelled.
constexpr std::array kMeetingWays{Way{.holds_rims = true, .pressed_rounds = 2}, Way{true, {}, false, true},
                                  Way{false, {}, false, true}, Way{true, LipLevelling::Options{}, false, true}};
/// Where that does not mend, either, they are pressed on, levelled without surfaces that meet, and where that brings
/// them into each other levelled harder and held apart. Last, skin is relaxed as coarse.
constexpr std::array kOtherWays{Way{true}, Way{false}, Way{true, LipLevelling::Options{}},
                                Way{true, kLevelledHarder, true}, Way{true, {}, false, false, true}};

/// Mends a face of `mesh`, the head's or that with its split vertices welded by `welding`.
class Mending {
 public:
  /// `mended_otherwise` is asked once, as soon as all that is wrong with lips whose surfaces meet is that they are
  /// tucked too far: whether another binding has mended it. `work` counts vertices that are left to be judged. All must
  /// outlive this.
  Mending(const FaceFile& given, const std::shared_ptr<const FaceMesh>& mesh, const Welding& welding,
          const FaceJudge& judge, const JudgedPoses& poses, FaceJudgement judged,
          std::function<bool()> mended_otherwise, double& work)
      : mesh_(mesh),
        welding_(welding),
        judge_(judge),
        poses_(poses),
        mended_otherwise_(std::move(mended_otherwise)),
        work_(work),
        topology_(*mesh, openingsOf(given.control)),
        rims_(rimsOf(*mesh, given.control)),
        mouth_width_(given.control.mouth_width),
        overlap_(limitNamed("lips in each other") / (1000 * mesh->metres_per_unit)),
        given_(given),
        first_(judged),
        kept_(given),
        judged_(std::move(judged)),
        meets_wrongly_(meetWrongly(first_)) {}

  void mend() {
    if (mendBy(kMeetingWays)) return;
    mendBy(kOtherWays);
  }

  [[nodiscard]] const FaceFile& kept() const { return kept_; }
  [[nodiscard]] const FaceJudgement& judged() const { return judged_; }

 private:
  /// A face on the way.
  struct Tried {
    FaceBinding binding;
    std::set<std::uint32_t> torn;  ///< what was relaxed
    FaceJudgement found;
  };

  [[nodiscard]] FaceRig rigOf(const FaceBinding& binding) const {
    FaceFile tried = given_;
    tried.binding = binding;
    return FaceRig::of(std::move(tried), mesh_, given_.name, &topology_);
  }

  [[nodiscard]] FaceJudgement judge(const FaceRig& rig) {
    work_ -= asReal(mesh_->vertexCount());
    return judge_.judge(rig);
  }

  void addTorn(const FaceJudgement& found, std::set<std::uint32_t>& torn) const {
    for (const std::uint32_t v : found.torn) torn.insert(welding_.isNothing() ? v : welding_.welded_of[v]);
  }

  void keepIfBetter(const FaceBinding& binding, const FaceJudgement& found) {
    if (!mendsMore(found, judged_)) return;
    kept_.binding = binding;
    judged_ = found;
  }

  /// Tries `ways`, then relaxes further what they leave torn; whether there is nothing left to do.
  bool mendBy(std::span<const Way> ways);
  void tryWay(const Way& way);
  /// Whether another round of `way` may mend more than `last`, which the one before it left of `before`.
  [[nodiscard]] bool isWorthAnother(const Way& way, std::size_t round, const FaceJudgement& before,
                                    const FaceJudgement& last) const;
  /// What has brought lips to meet stays as it is, and the skin that it tears is relaxed.
  void relaxTornAlone();

  const std::shared_ptr<const FaceMesh>& mesh_;
  const Welding& welding_;
  const FaceJudge& judge_;
  const JudgedPoses& poses_;
  std::function<bool()> mended_otherwise_;
  double& work_;
  bool is_mended_otherwise_ = false;
  HeadTopology topology_;
  std::vector<bool> rims_;
  double mouth_width_, overlap_;
  FaceFile given_;
  FaceJudgement first_;
  FaceFile kept_;
  FaceJudgement judged_;                                      ///< of kept_
  std::vector<std::pair<FaceBinding, FaceJudgement>> known_;  ///< ways often come to what another came to
  std::vector<Tried> torn_alone_;
  bool meets_wrongly_;  ///< or what relaxing and pressing bring about
};

bool Mending::mendBy(std::span<const Way> ways) {
  for (const Way& way : ways) {
    // Few open closures of a face that is well, given or mended, are not worth what may bring faults: surfaces that
    // meet, at once or not.
    if (judged_.faults.empty() && !way.meets) continue;
    if ((way.levels || way.meets) && !meets_wrongly_) continue;
    tryWay(way);
    if (isWhole(judged_) || is_mended_otherwise_ || work_ <= 0) return true;
  }
  if (!judged_.faults.empty()) relaxTornAlone();
  return judged_.faults.empty();
}

void Mending::tryWay(const Way& way) {
  const bool was_well = judged_.faults.empty();
  FaceBinding binding = given_.binding;
  binding.meets = way.meets;
  std::optional<LipLevelling> levelling;
  std::optional<FaceRig> moved;
  if (way.levels) {
    levelling.emplace(*mesh_, given_.control, binding, *way.levels);
    moved = rigOf(given_.binding);
  }
  FaceJudgement last = first_;
  std::set<std::uint32_t> torn;
  for (std::size_t round = 0; round < kRounds; ++round) {
    const double within = kRelaxedWithin[std::min(round, kRelaxedWithin.size() - 1)];
    if (!way.levels || round == 0) addTorn(last, torn);  // what levelling itself stretches stays
    if (levelling) levelling->level(judge_.closures(*moved), binding);
    if (levelling) last.left_open.fill(0);
    // What surfaces that meet leave open once all else is tried is pressed together.
    const bool is_left = !levelling && round >= kRelaxedWithin.size() && !last.faults.empty();
    if (way.meets ? is_left : levelling ? way.holds_apart : meetWrongly(last))
      press(last, mouth_width_, overlap_, binding.pressed);
    relaxAround(*mesh_, topology_, {torn.begin(), torn.end()}, way.holds_rims ? rims_ : std::vector<bool>(),
                within * mouth_width_, binding,
                (way.is_coarse ? kCoarseEdge : std::numeric_limits<double>::infinity()) * mouth_width_);
    const auto same = std::find_if(known_.begin(), known_.end(), [&](const auto& one) { return one.first == binding; });
    const bool is_new = same == known_.end();
    if (levelling || is_new) moved = rigOf(binding);
    if (was_well && is_new) {
      if (auto found = judge_.judgeIfMoreTouch(*moved, judged_.touching)) keepIfBetter(binding, *found);
      return;
    }
    FaceJudgement found = is_new ? judge(*moved) : same->second;
    if (is_new) known_.emplace_back(binding, found);
    const FaceJudgement before = std::exchange(last, std::move(found));
    meets_wrongly_ = meets_wrongly_ || meetWrongly(last);
    keepIfBetter(binding, last);
    if (is_new && isTornAlone(last)) torn_alone_.push_back({binding, torn, last});
    if (way.meets && mended_otherwise_ && isTuckedTooFarAlone(last, poses_)) {
      is_mended_otherwise_ = std::exchange(mended_otherwise_, nullptr)();
      if (is_mended_otherwise_) return;
    }
    if (judged_.faults.empty() || work_ <= 0 || !isWorthAnother(way, round, before, last)) return;
    // Where relaxing changes nothing of lips that meet, what they leave open is pressed together at once.
    if (way.meets && onlyOfLips(last) && meetAlike(last, before) && round > 0)
      round = std::max(round, kRelaxedWithin.size() - 1);
  }
}

bool Mending::isWorthAnother(const Way& way, std::size_t round, const FaceJudgement& before,
                             const FaceJudgement& last) const {
  if (!canBeMended(last) || (round + 1 >= way.pressed_rounds && meetWrongly(last))) return false;
  if (way.pressed_rounds < kRounds && crossOpen(last)) return false;
  const bool meets_better = last.touching > before.touching || last.lips_overlap_mm < before.lips_overlap_mm;
  return round + 1 < kRelaxedWithin.size() || (onlyOfLips(last) && meets_better);
}

void Mending::relaxTornAlone() {
  std::vector<Tried> torn_alone = std::exchange(torn_alone_, {});
  std::stable_sort(torn_alone.begin(), torn_alone.end(), [](const Tried& one, const Tried& other) {
    return one.found.faults.size() < other.found.faults.size();
  });
  torn_alone.resize(std::min(torn_alone.size(), kTornAlone));
  for (const bool keeps_needles : {false, true}) {
    for (Tried from : torn_alone) {
      for (const double within : kRelaxedWithin) {
        addTorn(from.found, from.torn);
        FaceBinding binding = from.binding;
        relaxAround(*mesh_, topology_, {from.torn.begin(), from.torn.end()}, rims_, within * mouth_width_, binding,
                    kCoarseEdge * mouth_width_, keeps_needles);
        from.found = judge(rigOf(binding));
        keepIfBetter(binding, from.found);
        if (judged_.faults.empty() || work_ <= 0) return;
        // Skin that is relaxed so far that it stands still is not whole when it is relaxed further.
        if (!isTornAlone(from.found)) break;
      }
    }
  }
}

}  // namespace

bool isTornAlone(const FaceJudgement& found) {
  return !found.faults.empty() && !found.torn.empty() && found.edge_ratio <= kMostTorn * limitNamed("edge length") &&
         found.edge_growth_mm <= kMostTorn * limitNamed("stretch") &&
         std::all_of(found.faults.begin(), found.faults.end(), [](const FaceFault& fault) {
           return std::find(kOfSkin.begin(), kOfSkin.end(), fault.limit) != kOfSkin.end();
         });
}

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
  if (!canBeMended(judged) && !isTuckedTooFar(judged, poses)) return judged;
  const Welding welding = weldSplitTriangles(rig.mesh());  // sewn together once and not in each round
  const bool is_sewn = !welding.isNothing();
  const FaceFile given = face;
  const auto given_mesh = std::make_shared<const FaceMesh>(rig.mesh());
  const auto mesh = is_sewn ? std::make_shared<const FaceMesh>(welding.mesh) : given_mesh;
  using Mended = std::pair<FaceFile, FaceJudgement>;
  double work = std::max(kMostJudged, kLeastJudgements * asReal(rig.mesh().vertexCount()));
  const auto mend = [&](const FaceRig& from, const FaceFile& tried, FaceJudgement found,
                        std::function<bool()> mended_otherwise = nullptr) -> Mended {
    const FaceJudge judge(from, tried, poses, actor);
    FaceFile sewn = tried;
    if (is_sewn) sewn.binding = weldedBinding(tried.binding, welding);
    Mending mending(sewn, mesh, welding, judge, poses, std::move(found), std::move(mended_otherwise), work);
    mending.mend();
    FaceFile mended = mending.kept();
    if (mended.binding == sewn.binding)
      mended.binding = tried.binding;
    else if (is_sewn)
      mended.binding = givenBinding(mended.binding, welding);
    return {std::move(mended), mending.judged()};
  };
  const auto take = [&](Mended&& mended) {
    judged = std::move(mended.second);
    if (mended.first.binding == face.binding) return;
    face.binding = std::move(mended.first.binding);
    rig = FaceRig::of(face, given_mesh, rig.name());
  };
  std::optional<Mended> less_tucked;
  bool was_less_tucked = false;
  const auto mendTuckedLess = [&] {
    was_less_tucked = true;
    for (const float tuck : kTuckedLess) {
      if (work <= 0) break;
      FaceFile less = given;
      less.binding.tuck = tuck;
      const FaceRig less_rig = FaceRig::of(less, given_mesh, rig.name());
      FaceJudgement found = judgeFace(less_rig, less, poses, actor);
      if (isTuckedTooFar(found, poses)) continue;
      Mended mended = mend(less_rig, less, std::move(found));
      if (mended.second.faults.empty()) return less_tucked = std::move(mended), true;
    }
    return false;
  };
  Mended mended(given, judged);
  if (canBeMended(judged)) mended = mend(rig, given, std::move(judged), mendTuckedLess);
  if (!less_tucked) {
    take(std::move(mended));
    if (judged.faults.empty()) return judged;
    if (!was_less_tucked && isTuckedTooFar(judged, poses)) mendTuckedLess();
    if (!less_tucked && !canBeMended(judged)) return judged;
  }
  if (less_tucked) {
    take(std::move(*less_tucked));
    return judged;
  }
  if (work <= 0) return judged;
  // The rims and corners of coarse lips may hang on nothing, too far along the mesh from all that is bound.
  bound.longest_edge = kCoarseEdge;
  FaceFile anew = given;
  anew.binding = bindFace(*mesh, given.control, bound);
  if (is_sewn) anew.binding = givenBinding(anew.binding, welding);
  if (anew.binding == given.binding) return judged;
  const FaceRig anew_rig = FaceRig::of(anew, given_mesh, rig.name());
  Mended again = mend(anew_rig, anew, judgeFace(anew_rig, anew, poses, actor));
  if (again.second.faults.empty()) take(std::move(again));
  return judged;
}

}  // namespace mouthpiece
