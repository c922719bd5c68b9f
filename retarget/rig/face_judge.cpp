#include "retarget/rig/face_judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <set>

#include "base/errors.h"
#include "base/parallel_for.h"
#include "retarget/rig/judged_head.h"
#include "retarget/rig/lopsidedness.h"

namespace mouthpiece {
namespace {

constexpr double kTouchMm = 0.3;  ///< lips nearer than this touch
constexpr double kSeenMm = 0.5;   ///< nobody sees through slits that are no taller,
constexpr double kSeen = 0.01;    ///< nor than so much of the mouth's width: a small one is looked at from nearer
constexpr double kNearMm = 1;     ///< and can be told to lie in each other

constexpr std::array<FaceLimit, 14> kLimits{{
    {"closures", 95, "%", true},
    {"lips in each other", 0.5, "mm", false},
    {"lips in the teeth", 0.5, "mm", false},
    {"lips in the tongue", 0.5, "mm", false},
    {"edge length", 3, "times", false},
    {"stretch", 5, "mm", false},
    {"triangles turned over", 4, "mm2", false},
    {"skin off its markers", 5, "mm", false},
    {"vertex jump", 2, "times", false},
    {"lopsided motion", 3, "mm", false},
    {"bound", 95, "%", true},
    {"motion", 50, "%", true},
    {"lip motion", 50, "%", true},
    {"warp fold-overs in use", 0, "", false},
}};

/// Rows of the poses that show most of something.
struct WorstRows {
  std::size_t ratio, growth, off_markers, jump, turned, overlap, teeth, tongue, open;
};

double tallestSlit(const LipContact& contact) { return *std::max_element(contact.slits.begin(), contact.slits.end()); }

bool touches(const JudgedHead& head, const LipContact& contact) {
  const double slit = tallestSlit(contact);
  return head.mm() * contact.gap <= kTouchMm && head.mm() * slit <= kSeenMm && slit <= kSeen * head.mouthWidth();
}

/// What is seen in poses of a head, summed up.
class Summary {
 public:
  Summary(const JudgedHead& head, std::span<const PoseSeen> seen, std::span<const JudgedPoses::Row> rows)
      : head_(head), seen_(seen), rows_(rows) {}

  [[nodiscard]] FaceJudgement judge() const {
    FaceJudgement found;
    found.poses = rows_.size();
    if (rows_.empty()) return found;
    const WorstRows worst = worstRows();
    measure(worst, found);
    measureColumns(found);
    tellOfLips(worst, found);
    tellOfSkin(worst, found);
    return found;
  }

 private:
  [[nodiscard]] double gapOf(std::size_t row) const { return head_.mm() * seen_[row].contact.gap; }
  [[nodiscard]] double slitOf(std::size_t row) const { return head_.mm() * tallestSlit(seen_[row].contact); }
  /// Of lips that are apart it cannot be told what is in front and what behind.
  [[nodiscard]] double overlapOf(std::size_t row) const {
    return seen_[row].is_measured && gapOf(row) <= kNearMm ? seen_[row].contact.overlap
                                                           : head_.atRest().seeming_overlap;
  }
  [[nodiscard]] WorstRows worstRows() const;
  void measure(const WorstRows& worst, FaceJudgement& found) const;
  void measureColumns(FaceJudgement& found) const;
  void tellOfLips(const WorstRows& worst, FaceJudgement& found) const;
  void tellOfSkin(const WorstRows& worst, FaceJudgement& found) const;
  void tell(FaceJudgement& found, std::string_view limit, const std::string& what, std::vector<std::uint32_t> triangles,
            std::optional<std::size_t> row = {}) const {
    found.faults.push_back(
        {limit, row ? fmt::format("{} in {}", what, rows_[*row].where) : what, std::move(triangles), row});
  }

  const JudgedHead& head_;
  std::span<const PoseSeen> seen_;
  std::span<const JudgedPoses::Row> rows_;
};

WorstRows Summary::worstRows() const {
  const auto by = [&](const auto& valueOf) {
    std::size_t worst = 0;
    for (std::size_t row = 1; row < rows_.size(); ++row) {
      if (valueOf(row) > valueOf(worst)) worst = row;
    }
    return worst;
  };
  return {.ratio = by([&](std::size_t row) { return seen_[row].ratio.value; }),
          .growth = by([&](std::size_t row) { return seen_[row].growth.value; }),
          .off_markers = by([&](std::size_t row) { return seen_[row].off_markers.value; }),
          .jump = by([&](std::size_t row) { return seen_[row].jump.value; }),
          .turned = by([&](std::size_t row) { return seen_[row].turned_mm2; }),
          .overlap = by([&](std::size_t row) { return overlapOf(row); }),
          .teeth = by([&](std::size_t row) { return seen_[row].contact.in_teeth; }),
          .tongue = by([&](std::size_t row) { return seen_[row].contact.in_tongue; }),
          .open = by([&](std::size_t row) { return rows_[row].closed ? std::max(gapOf(row), slitOf(row)) : -1; })};
}

void Summary::measure(const WorstRows& worst, FaceJudgement& found) const {
  double markers = 0, skin = 0, lip_markers = 0, lip_skin = 0;
  std::set<std::uint32_t> torn;
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    const PoseSeen& here = seen_[row];
    found.steps += rows_[row].follows ? 1U : 0U;
    markers += here.marker_squares;
    skin += here.skin_squares;
    lip_markers += here.lip_marker_squares;
    lip_skin += here.lip_skin_squares;
    found.closures += rows_[row].closed ? 1U : 0U;
    found.touching += rows_[row].closed && touches(head_, seen_[row].contact) ? 1U : 0U;
    torn.insert(here.torn.begin(), here.torn.end());
  }
  for (const std::uint32_t v : torn) found.torn.push_back(head_.givenOf(v));
  const LipContact& rest = head_.atRest();
  found.edge_ratio = seen_[worst.ratio].ratio.value;
  found.edge_growth_mm = seen_[worst.growth].growth.value;
  found.off_markers_mm = seen_[worst.off_markers].off_markers.value;
  found.jump_ratio = seen_[worst.jump].jump.value;
  found.turned_over_mm2 = seen_[worst.turned].turned_mm2;
  found.lips_overlap_mm = head_.mm() * std::max(0.0, overlapOf(worst.overlap) - rest.seeming_overlap);
  found.in_teeth_mm = head_.mm() * std::max(0.0, seen_[worst.teeth].contact.in_teeth - rest.in_teeth);
  found.in_tongue_mm = head_.mm() * std::max(0.0, seen_[worst.tongue].contact.in_tongue - rest.in_tongue);
  found.motion_share = markers > 0 ? std::sqrt(skin / markers) : 1;
  found.lip_motion_share = lip_markers > 0 ? std::sqrt(lip_skin / lip_markers) : 1;
}

void Summary::measureColumns(FaceJudgement& found) const {
  for (std::size_t c = 0; c < found.left_open.size(); ++c) {
    std::vector<double> gaps;
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      if (rows_[row].closed) gaps.push_back(std::max({0.0, seen_[row].contact.gaps[c], seen_[row].contact.slits[c]}));
    }
    if (gaps.empty()) continue;
    const auto most = gaps.begin() + signedIndex(gaps.size() * 4 / 5);
    std::nth_element(gaps.begin(), most, gaps.end());
    found.left_open[c] = *most;
  }
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    if (!seen_[row].is_measured || gapOf(row) > kNearMm) continue;
    for (std::size_t c = 0; c < kLipColumns; ++c)
      found.overlaps[c] = std::max(found.overlaps[c], seen_[row].contact.overlaps[c] - head_.atRest().seeming_overlap);
  }
}

void Summary::tellOfLips(const WorstRows& worst, FaceJudgement& found) const {
  if (100 * asReal(found.touching) < limitNamed("closures") * asReal(found.closures))
    tell(found, "closures",
         fmt::format("{} of {} captured closures touch within {} mm; the widest leaves {:.2f} mm", found.touching,
                     found.closures, kTouchMm, std::max(gapOf(worst.open), slitOf(worst.open))),
         head_.mouth(), worst.open);
  if (found.lips_overlap_mm > limitNamed("lips in each other"))
    tell(found, "lips in each other",
         fmt::format("the lips get {:.2f} mm into each other, {:.2f} mm more than the head's own",
                     head_.mm() * seen_[worst.overlap].contact.overlap, found.lips_overlap_mm),
         head_.mouth(), worst.overlap);
  if (found.in_teeth_mm > limitNamed("lips in the teeth"))
    tell(found, "lips in the teeth", fmt::format("a lip gets {:.2f} mm into the teeth", found.in_teeth_mm),
         head_.mouth(), worst.teeth);
  if (found.in_tongue_mm > limitNamed("lips in the tongue"))
    tell(found, "lips in the tongue", fmt::format("a lip gets {:.2f} mm into the tongue", found.in_tongue_mm),
         head_.mouth(), worst.tongue);
}

void Summary::tellOfSkin(const WorstRows& worst, FaceJudgement& found) const {
  const PoseSeen &longest = seen_[worst.ratio], &most_grown = seen_[worst.growth], &turned = seen_[worst.turned],
                 &jumped = seen_[worst.jump], &off = seen_[worst.off_markers];
  if (found.edge_ratio > limitNamed("edge length"))
    tell(found, "edge length",
         head_.edgeText(longest.ratio.item, fmt::format("{:.1f} times as long", found.edge_ratio)),
         head_.trianglesAt(longest.stretched), worst.ratio);
  if (found.edge_growth_mm > limitNamed("stretch"))
    tell(found, "stretch",
         head_.edgeText(most_grown.growth.item, fmt::format("{:.1f} mm longer", most_grown.growth_mm)),
         head_.trianglesAt(most_grown.stretched), worst.growth);
  if (found.turned_over_mm2 > limitNamed("triangles turned over"))
    tell(found, "triangles turned over",
         fmt::format("{} triangles, {:.1f} square millimetres at rest, turn over, first at {}", turned.turned.size(),
                     found.turned_over_mm2, head_.placeOf(head_.mesh().triangles[turned.turned[0]][0])),
         turned.turned, worst.turned);
  if (found.off_markers_mm > limitNamed("skin off its markers"))
    tell(found, "skin off its markers",
         fmt::format("{} goes {:.1f} mm beyond what the markers around it do",
                     head_.placeOf(static_cast<std::uint32_t>(off.off_markers.item)), found.off_markers_mm),
         head_.trianglesAt(off.off), worst.off_markers);
  if (found.jump_ratio > limitNamed("vertex jump"))
    tell(found, "vertex jump",
         fmt::format("{} jumps by {:.1f} mm in a frame, {:.1f} times as far as {}",
                     head_.placeOf(static_cast<std::uint32_t>(jumped.jump.item)), jumped.jump_mm,
                     (jumped.jumps_past_all ? kOfAnyMarker : 1) * found.jump_ratio,
                     jumped.jumps_past_all ? "any marker" : "its markers"),
         head_.trianglesAt(jumped.jumped), worst.jump);
  if (100 * found.motion_share < limitNamed("motion"))
    tell(found, "motion", fmt::format("the skin moves {:.0f} % of what the markers on it do", 100 * found.motion_share),
         {});
  if (100 * found.lip_motion_share < limitNamed("lip motion"))
    tell(found, "lip motion",
         fmt::format("the lips move {:.0f} % of what the markers on them do", 100 * found.lip_motion_share),
         head_.mouth());
}

FaceJudgement judgePoses(const JudgedHead& head, const FaceRig& rig, const FaceMotion& motion,
                         const JudgedPoses& poses) {
  const std::size_t count = poses.rows.size();
  std::vector<PoseSeen> seen(count);
  const auto look = [&](std::size_t row) {
    VertexPositions deformed;
    rig.deform(motion.pose(FrameIndex{row}), poses.tongue[row], deformed);
    VertexPositions now = head.welded(std::move(deformed));
    if (poses.rows[row].is_way) return now;
    // How far lips are apart that need not touch is not asked for.
    std::optional<double> widest_gap;
    if (row % 4 == 0) widest_gap = 2 * kNearMm / head.mm();
    if (poses.rows[row].closed) widest_gap = std::numeric_limits<double>::infinity();
    head.lookAtPose(now, widest_gap, seen[row]);
    head.lookAtMotion(now, motion, row, seen[row]);
    head.lookAtMarkersAround(now, motion, row, seen[row]);
    return now;
  };
  parallelFor(count, [&](std::size_t row) {
    if (row > 0 && poses.rows[row].follows) return;  // looked at with the one before it
    VertexPositions before = look(row);
    while (++row < count && poses.rows[row].follows) {
      VertexPositions now = look(row);
      head.lookAtStep(before, now, motion, row, seen[row]);
      before = std::move(now);
    }
  });
  return Summary(head, seen, poses.rows).judge();
}

void tellOfSides(const JudgedHead& head, const Lopsidedness::Seen& seen, const JudgedPoses& poses,
                 FaceJudgement& found) {
  found.lopsided_mm = head.mm() * seen.off;
  if (*found.lopsided_mm <= limitNamed("lopsided motion")) return;
  found.faults.push_back({"lopsided motion",
                          fmt::format("one side of the mouth moves otherwise than the other, by {:.1f} mm, where an "
                                      "actor's sides do the same; check the anchors of both sides, in {}",
                                      *found.lopsided_mm, poses.rows[seen.row].where),
                          head.trianglesAt(seen.vertices), seen.row});
}

}  // namespace

std::span<const FaceLimit> faceLimits() { return kLimits; }

double limitNamed(std::string_view name) {
  const auto limit = std::find_if(kLimits.begin(), kLimits.end(), [&](const FaceLimit& l) { return l.name == name; });
  MOUTHPIECE_EXPECT(limit != kLimits.end());
  return limit->limit;
}

struct FaceJudge::Data {
  JudgedHead head;
  FaceMotion motion;
  const JudgedPoses& poses;
  FaceJudgement of_warp;
  std::optional<Lopsidedness> lopsidedness;  ///< of a head that is alike on both sides

  Data(const FaceRig& rig, const FaceFile& face, const JudgedPoses& of, const ActorPose& actor)
      : head(rig, face), motion(rig.retarget(of.motion, &actor, of.lips)), poses(of) {
    const std::size_t count = of.rows.size();
    MOUTHPIECE_EXPECT(count == of.motion.frameCount() && count == of.lips.size() && count == of.tongue.size());
    if (count == 0) return;
    head.lookAtWarp(of, actor, of_warp);
    lopsidedness = Lopsidedness::of(head, rig, face, of, actor);
  }
};

FaceJudge::FaceJudge(const FaceRig& rig, const FaceFile& face, const JudgedPoses& poses, const ActorPose& actor)
    : data_(std::make_unique<const Data>(rig, face, poses, actor)) {}
FaceJudge::~FaceJudge() = default;

std::optional<FaceJudgement> FaceJudge::judgeIfMoreTouch(const FaceRig& rig, std::size_t touching) const {
  const std::vector<VertexPositions> shut = closures(rig);
  std::vector<std::uint8_t> touch(shut.size());
  parallelFor(shut.size(), [&](std::size_t i) {
    PoseSeen seen;
    data_->head.lookAtContact(data_->head.welded(shut[i]), std::numeric_limits<double>::infinity(), seen);
    touch[i] = touches(data_->head, seen.contact) ? 1 : 0;
  });
  if (unsignedIndex(std::count(touch.begin(), touch.end(), 1)) <= touching) return std::nullopt;
  return judge(rig);
}

FaceJudgement FaceJudge::judge(const FaceRig& rig) const {
  FaceJudgement found = judgePoses(data_->head, rig, data_->motion, data_->poses);
  const FaceJudgement& warp = data_->of_warp;
  found.warp_stretch_least = warp.warp_stretch_least;
  found.warp_points = warp.warp_points;
  found.warp_folds = warp.warp_folds;
  found.faults.insert(found.faults.end(), warp.faults.begin(), warp.faults.end());
  if (data_->lopsidedness) tellOfSides(data_->head, data_->lopsidedness->look(data_->head, rig), data_->poses, found);
  return found;
}

std::vector<VertexPositions> FaceJudge::closures(const FaceRig& rig) const {
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < data_->poses.rows.size(); ++row) {
    if (data_->poses.rows[row].closed) rows.push_back(row);
  }
  std::vector<VertexPositions> closures(rows.size());
  parallelFor(rows.size(), [&](std::size_t i) {
    rig.deform(data_->motion.pose(FrameIndex{rows[i]}), data_->poses.tongue[rows[i]], closures[i]);
  });
  return closures;
}

FaceJudgement judgeFace(const FaceRig& rig, const FaceFile& face, const JudgedPoses& poses, const ActorPose& actor) {
  return FaceJudge(rig, face, poses, actor).judge(rig);
}

std::vector<FaceJudgement> judgeShapes(const FaceRig& rig, const FaceFile& face, std::span<const VertexPositions> poses,
                                       std::span<const JudgedPoses::Row> rows) {
  MOUTHPIECE_EXPECT(poses.size() == rows.size());
  const JudgedHead head(rig, face);
  std::vector<FaceJudgement> judged(poses.size());
  parallelFor(poses.size(), [&](std::size_t k) {
    PoseSeen seen;
    head.lookAtPose(head.welded(poses[k]), std::numeric_limits<double>::infinity(), seen);
    judged[k] = Summary(head, {&seen, 1}, rows.subspan(k, 1)).judge();
  });
  return judged;
}

std::optional<FaceFault> mostTorn(const FaceRig& rig, const FaceFile& face, std::size_t count,
                                  const std::function<VertexPositions(std::size_t)>& posed) {
  const JudgedHead head(rig, face);
  struct Stretched {
    WorstSeen growth, ratio;
    double growth_mm = 0;
  };
  std::vector<Stretched> seen(count);
  parallelFor(count, [&](std::size_t k) {
    PoseSeen pose;
    head.lookAtPose(head.welded(posed(k)), {}, pose);
    seen[k] = {pose.growth, pose.ratio, pose.growth_mm};
  });
  std::optional<FaceFault> fault;
  double most = 1;
  for (std::size_t k = 0; k < count; ++k) {
    const double grown = seen[k].growth.value / limitNamed("stretch");
    const double longer = seen[k].ratio.value / limitNamed("edge length");
    if (std::max(grown, longer) <= most) continue;
    most = std::max(grown, longer);
    const bool is_growth = grown > longer;
    fault = FaceFault{is_growth ? "stretch" : "edge length",
                      is_growth
                          ? head.edgeText(seen[k].growth.item, fmt::format("{:.1f} mm longer", seen[k].growth_mm))
                          : head.edgeText(seen[k].ratio.item, fmt::format("{:.1f} times as long", seen[k].ratio.value)),
                      {},
                      k};
  }
  return fault;
}

std::vector<std::string> faultsOf(const FaceCheck& check, const FaceJudgement& judgement) {
  std::vector<std::string> faults = faultsOf(check);
  for (const FaceFault& fault : judgement.faults) {
    faults.push_back(fault.what);
    if (fault.limit == "closures" && check.binding.lips_are_one)
      faults.back() += "; the lips hang together behind the line between them: `retarget cut` opens the mesh there";
  }
  return faults;
}

}  // namespace mouthpiece
