// retarget check: judges a fitted face, also by a corpus' captured closures played on it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "base/files.h"
#include "base/index.h"
#include "base/statistics.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_files.h"
#include "deform/mesh/mesh_limits.h"
#include "deform/surface/bezier_surface.h"
#include "deform/topology/welding.h"
#include "motion/resample.h"
#include "programs/retarget/commands.h"
#include "retarget/placing/face_page.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_rig.h"
#include "synthesis/lips.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

constexpr double kTouchMm = 0.3;  ///< lips nearer than this touch

struct CheckArguments {
  std::filesystem::path face, corpus, show;
  bool quiet = false, json = false;
};

/// What the captured closures (B P M in which the outer lips come near) of a corpus become on a face.
struct ClosureCheck {
  std::size_t closures = 0;
  std::size_t touching = 0;         ///< whose lips are kTouchMm apart at most, all over the middle half of the mouth
  std::size_t others = 0;           ///< phones looked at that are no closure: every eighth but B P M and silence
  std::size_t others_touching = 0;  ///< whose lips touch at their widest
  double gap_median_mm = 0;
  double gap_p95_mm = 0;
  double overlap_mm = 0;   ///< deepest place of one lip inside the other, over all closures
  double in_teeth_mm = 0;  ///< of a lip inside teeth or gums
  double overlap_at_rest_mm = 0;
  double in_teeth_at_rest_mm = 0;
  std::size_t poses = 0;                ///< drawn at random from the capture
  double patch_edge_angle_max_deg = 0;  ///< between neighbouring patches in these
};

/// The largest angle between neighbouring patches over frames drawn from the whole corpus.
void checkEdges(const FaceRig& rig, const ControlMesh& control_mesh, const Corpus& corpus, const ActorPose& actor,
                ClosureCheck& check) {
  constexpr std::size_t kPoses = 1000;
  const BezierSurface surface(control_mesh);
  std::vector<const CorpusTake*> takes;
  for (const CorpusTake& take : corpus.takes) {
    if (take.motion.frameCount() > 0 && take.motion.positions_mm.allFinite()) takes.push_back(&take);
  }
  std::mt19937 random(66);
  for (; !takes.empty() && check.poses < kPoses; ++check.poses) {
    MotionClip frame = takes[random() % takes.size()]->motion;
    frame.positions_mm = frame.positions_mm.row(signedIndex(random() % frame.frameCount())).eval();
    const FaceMotion on_face = rig.retarget(frame, &actor);
    const auto pose = surface.pose(controlPoints(control_mesh, on_face.pose(FrameIndex{0})));
    check.patch_edge_angle_max_deg = std::max(check.patch_edge_angle_max_deg, surface.maxNormalAngleAcrossEdges(pose));
  }
}

ClosureCheck checkClosures(const FaceRig& rig, const ControlMesh& control_mesh, const Corpus& corpus, bool quiet) {
  const double mm = 1000 * rig.mesh().metres_per_unit;
  const Welding welding = weldSplitTriangles(rig.mesh());
  const LipContactMeter meter(welding.isNothing() ? rig.mesh() : welding.mesh, control_mesh);
  ClosureCheck check;
  const auto contactIn = [&](const VertexPositions& pose) {
    return meter.measure(welding.isNothing() ? pose : welding.weldedFromGiven(pose));
  };
  const LipContact at_rest = contactIn(rig.mesh().vertices);
  check.overlap_at_rest_mm = mm * at_rest.overlap;
  check.in_teeth_at_rest_mm = mm * at_rest.in_teeth;
  const ActorPose actor{corpus.neutral_pose_mm, closedLipsMm(corpus), unseenRounding(corpus)};
  ProgressBar progress("retarget check", corpus.takes.size(), quiet);
  std::vector<double> gaps;
  VertexPositions vertices;
  std::size_t others = 0;
  for (const CorpusTake& take : corpus.takes) {
    progress.advance();
    const auto [closed, open] = lipFrames(take, corpus.layout, others);
    if (closed.empty() && open.empty()) continue;
    const std::vector<Seconds> times = frameTimes(0, take.motion.frameCount(), take.motion.frame_rate_hz);
    const FaceMotion on_face = rig.retarget(take.motion, &actor, lipsFromPhones(take.labels, times));
    const auto contactAt = [&](std::size_t frame) {
      rig.deform(on_face.pose(FrameIndex{frame}), TonguePose{}, vertices);
      return contactIn(vertices);
    };
    for (const std::size_t frame : closed) {
      const LipContact contact = contactAt(frame);
      gaps.push_back(mm * contact.gap);
      check.touching += mm * contact.gap <= kTouchMm ? 1U : 0U;
      check.overlap_mm = std::max(check.overlap_mm, mm * contact.overlap);
      check.in_teeth_mm = std::max(check.in_teeth_mm, mm * contact.in_teeth);
    }
    for (const std::size_t frame : open) check.others_touching += mm * contactAt(frame).gap <= kTouchMm ? 1U : 0U;
    check.others += open.size();
  }
  checkEdges(rig, control_mesh, corpus, actor, check);
  check.closures = gaps.size();
  check.gap_median_mm = quantile(gaps, 0.5, 0);
  check.gap_p95_mm = quantile(gaps, 0.95, 0);
  return check;
}

nlohmann::json factsOf(const ClosureCheck& check) {
  return {{"closures", check.closures},
          {"touching", check.touching},
          {"other_phones", check.others},
          {"other_phones_touching", check.others_touching},
          {"gap_median_mm", check.gap_median_mm},
          {"gap_p95_mm", check.gap_p95_mm},
          {"overlap_mm", check.overlap_mm},
          {"overlap_at_rest_mm", check.overlap_at_rest_mm},
          {"in_teeth_mm", check.in_teeth_mm},
          {"in_teeth_at_rest_mm", check.in_teeth_at_rest_mm},
          {"poses", check.poses},
          {"patch_edge_angle_max_deg", check.patch_edge_angle_max_deg}};
}

std::string textOf(const ClosureCheck& check) {
  return fmt::format(
      "  closures           {} of {} touch within {} mm; gap {:.2f} mm median, {:.2f} mm at 95 %\n"
      "  other phones       {} of {} touch at their widest\n"
      "  lips               {:.2f} mm inside each other at most ({:.2f} at rest), {:.2f} mm inside teeth ({:.2f})\n"
      "  patch edges        {:.3g} degrees at most in {} captured poses\n",
      check.touching, check.closures, kTouchMm, check.gap_median_mm, check.gap_p95_mm, check.others_touching,
      check.others, check.overlap_mm, check.overlap_at_rest_mm, check.in_teeth_mm, check.in_teeth_at_rest_mm,
      check.patch_edge_angle_max_deg, check.poses);
}

int runCheck(const CheckArguments& given) {
  const FaceFile face = readFaceFile(given.face);
  const FaceRig rig = FaceRig::load(given.face);
  std::optional<Corpus> corpus;
  if (!given.corpus.empty()) corpus = readCorpus(given.corpus);
  const FaceReport report = reportOn(face, rig, corpus ? &*corpus : nullptr);
  if (!given.show.empty()) {
    const std::filesystem::path mesh = given.face.parent_path() / face.mesh_file;
    // Of the other kinds of mesh no page shows more than the rig holds.
    const std::string bytes = isGlb(mesh) ? readFile(mesh, kMaxMeshBytes) : std::string();
    writeFacePage(given.show, face, rig, report, {}, dressingOf(bytes, mesh));
  }
  const int code = report.faults().empty() ? kExitDone : kExitBadInput;
  if (!corpus) {
    printFace(face, report, given.json, given.quiet);
    return code;
  }
  const ClosureCheck closures = checkClosures(rig, face.control, *corpus, given.quiet || given.json);
  if (given.json || given.quiet) noticeNotJudged(face, report);
  if (given.json) {
    nlohmann::json facts = faceFacts(face, report);
    facts["captured_closures"] = factsOf(closures);
    printJson(facts);
  } else if (!given.quiet) {
    printText(faceText(face, report) + textOf(closures));
  }
  return code;
}

void addOptions(CLI::App& command, CheckArguments& options) {
  command.add_option("FACE", options.face, "Made by `retarget fit`")->required();
  command.add_option("--corpus", options.corpus,
                     "Judge by this corpus' poses (default: the sample corpus'), and play all of its closures");
  command.add_option("--show", options.show, "Write a page that shows the faults, or the markers (.html)");
  addJsonFlag(command, options.json);
}

}  // namespace

Command checkCommand() {
  return makeCommand("check", "Judge a fitted face; exit code 1 when it has a fault", "retarget check head.face",
                     addOptions, runCheck);
}

}  // namespace mouthpiece
