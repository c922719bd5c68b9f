// What several subcommands tell of a face, and ask of a corpus.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <span>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_scene.h"
#include "deform/mesh/mesh_files.h"
#include "programs/retarget/commands.h"
#include "retarget/placing/face_page.h"
#include "speaker/shared_files.h"
#include "synthesis/lips.h"
#include "units/file/corpus.h"

namespace mouthpiece {

FitRequest fitRequestFor(const std::string& face_name, const Corpus& corpus) {
  FitRequest request;
  request.name = face_name;
  request.corpus = corpus.name;
  request.marker_names = corpus.layout.markerNames();
  request.surface = surfacePlanOf(corpus.layout);
  request.actor_neutral_mm = corpus.neutral_pose_mm;
  request.actor_closed_lips_mm = closedLipsMm(corpus);
  request.actor_unseen = unseenRounding(corpus);
  return request;
}

FaceReport reportOn(const FaceFile& face, const FaceRig& rig, const Corpus* corpus) {
  FaceReport report;
  report.check = checkFace(face, rig.mesh());
  const auto judge = [&](const Corpus& by) {
    report.poses = judgedPoses(by);
    report.actor = {by.neutral_pose_mm, closedLipsMm(by), unseenRounding(by)};
    report.judgement = judgeFace(rig, face, report.poses, report.actor);
    if (report.judgement.poses == 0)
      report.not_judged = fmt::format("the corpus '{}' holds no take to move the face by", by.name);
  };
  if (corpus != nullptr) {
    judge(*corpus);
    return report;
  }
  try {
    judge(readCorpus(findSharedFile("sample.corpus", "make it with `make`, or name one with --corpus")));
  } catch (const InputError& error) {
    report.not_judged = error.what();
  }
  return report;
}

std::vector<std::string> FaceReport::faults() const { return faultsOf(check, judgement); }

Anchors placedOn(const FaceFile& face, FaceMesh& mesh, const Anchors& given) {
  constexpr double kStill = 1e-5;  // of the mouth's width
  turnMesh(face.upright_from_mesh.transpose(), mesh);
  Anchors placed = given;
  for (std::size_t i = 0; i < face.control.points.size(); ++i) {
    const ControlPoint& point = face.control.points[i];
    if (point.rule != PointRule::kMarker && point.rule != PointRule::kInnerLip) continue;
    const Eigen::Vector3d place =
        face.upright_from_mesh.transpose() * face.control.rest.row(signedIndex(i)).transpose();
    const auto before = placeOf(given, point.name, mesh, face.name);
    if (!before || (*before - place).norm() > kStill * face.control.mouth_width) placed.markers[point.name] = place;
  }
  return placed;
}

PageDressing dressingOf(std::string_view mesh_bytes, const std::filesystem::path& mesh) {
  if (!isGlb(mesh)) return {};
  return {glbPictures(mesh_bytes, mesh.string())};
}

PageDressing dressingOf(std::string_view mesh_bytes, const std::filesystem::path& mesh, const FaceMesh& head,
                        const NamedAnchors& anchors) {
  PageDressing dressing = dressingOf(mesh_bytes, mesh);
  if (anchors.anchors.markers.contains("RIM_UP_MID")) return dressing;
  try {
    const TracedLips traced = tracedLips(head, anchors);
    const LipLine& line = traced.line;
    const auto inMesh = [&](const Eigen::Vector3d& place) -> Eigen::Vector3d {
      return traced.upright_from_mesh.transpose() * place;
    };
    for (const auto* rim : {&line.upper, &line.lower}) {
      for (const Eigen::Vector3d& place : *rim) dressing.lip_line.push_back(inMesh(place));
    }
    const auto lipAt = [&](const char* name) -> Eigen::Vector3d {
      return traced.upright_from_mesh * placeOf(anchors.anchors, name, head, anchors.file).value();
    };
    const LipLine::Pair middle = line.at(0.5 * (lipAt("LIP_UP_MID") + lipAt("LIP_LO_MID")));
    dressing.traced = {{"RIM_CORNER_R", inMesh(line.corner_right)},
                       {"RIM_CORNER_L", inMesh(line.corner_left)},
                       {"RIM_UP_MID", inMesh(middle.upper)},
                       {"RIM_LO_MID", inMesh(middle.lower)}};
  } catch (const InputError&) {
    // Too few anchors yet, or anchors of no mouth: the page shows what there is.
  }
  return dressing;
}

namespace {

/// Parts of their own for the triangles of the first of `faults`, red, and of the others, orange, over `shown`'s parts.
void colourFaults(std::span<const FaceFault> faults, FaceMesh& shown) {
  constexpr std::array kNames{"fault", "other faults"};
  constexpr std::array<std::array<float, 4>, 2> kColours{{{0.8F, 0.02F, 0.02F, 1}, {0.9F, 0.4F, 0.02F, 1}}};
  std::vector<std::size_t> shade(shown.triangles.size(), kNames.size());
  // Small places lie over large ones, such as the whole mouth, and the first over what is as small.
  std::vector<std::size_t> order(faults.size());
  std::iota(order.rbegin(), order.rend(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return faults[a].triangles.size() > faults[b].triangles.size();
  });
  for (const std::size_t i : order) {
    for (const std::uint32_t t : faults[i].triangles) shade[t] = i == 0 ? 0 : 1;
  }
  std::vector<Triangle> triangles;
  std::vector<MeshPart> parts;
  const auto take = [&](MeshPart part, std::size_t from, std::size_t to, std::size_t shaded) {
    part.first_triangle = triangles.size();
    for (std::size_t t = from; t < to; ++t) {
      if (shade[t] == shaded) triangles.push_back(shown.triangles[t]);
    }
    part.triangle_count = triangles.size() - part.first_triangle;
    parts.push_back(std::move(part));
  };
  for (const MeshPart& part : shown.parts)
    take(part, part.first_triangle, part.first_triangle + part.triangle_count, kNames.size());
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    MeshPart marked;
    marked.name = kNames[k];
    marked.base_color = kColours[k];
    take(std::move(marked), 0, shown.triangles.size(), k);
    if (parts.back().triangle_count == 0) parts.pop_back();
  }
  shown.triangles = std::move(triangles);
  shown.parts = std::move(parts);
}

}  // namespace

void writeFacePage(const std::filesystem::path& path, const FaceFile& face, const FaceRig& rig,
                   const FaceReport& report, const Anchors& given, const PageDressing& dressing) {
  FaceMesh shown = rig.mesh();
  std::vector<FaceFault> faults;
  for (const FaceFault& fault : report.judgement.faults) {
    if (!fault.triangles.empty()) faults.push_back(fault);
  }
  if (faults.empty()) {
    const Anchors placed = placedOn(face, shown, given);
    writeFileAtomically(path, facePage(shown, face.name, placed, {}, dressing));
    return;
  }
  if (const auto pose = faults[0].pose) {
    const FaceMotion motion = rig.retarget(report.poses.motion, &report.actor, report.poses.lips);
    rig.deform(motion.pose(FrameIndex{*pose}), report.poses.tongue[*pose], shown.vertices);
  }
  // Those of the mouth lie in the same triangles and share a marker.
  std::map<std::uint32_t, std::string> told;
  for (const FaceFault& fault : faults) {
    std::string& text = told[shown.triangles[fault.triangles[0]][0]];
    text += (text.empty() ? "" : "; ") + fault.what;
  }
  Anchors at;
  for (const auto& [vertex, text] : told) at.markers[text] = pointAt(shown.vertices, vertex);
  colourFaults(faults, shown);
  const std::string more = faults.size() > 1 ? fmt::format(" and {} more", faults.size() - 1) : "";
  writeFileAtomically(path, facePage(shown, face.name + ": " + faults[0].what + more, at, {}, dressing));
}

namespace {

nlohmann::json judgementFacts(const FaceReport& report) {
  const FaceJudgement& found = report.judgement;
  if (found.poses == 0) return nullptr;
  return {{"poses", found.poses},
          {"steps", found.steps},
          {"closures", found.closures},
          {"touching", found.touching},
          {"lips_overlap_mm", found.lips_overlap_mm},
          {"in_teeth_mm", found.in_teeth_mm},
          {"in_tongue_mm", found.in_tongue_mm},
          {"edge_ratio", found.edge_ratio},
          {"edge_growth_mm", found.edge_growth_mm},
          {"turned_over_mm2", found.turned_over_mm2},
          {"off_markers_mm", found.off_markers_mm},
          {"jump_ratio", found.jump_ratio},
          {"motion_share", found.motion_share},
          {"lip_motion_share", found.lip_motion_share},
          {"lopsided_mm", found.lopsided_mm ? nlohmann::json(*found.lopsided_mm) : nlohmann::json()},
          {"warp_points", found.warp_points},
          {"warp_folds", found.warp_folds},
          {"warp_stretch_least", found.warp_stretch_least}};
}

std::string judgementText(const FaceReport& report) {
  const FaceJudgement& found = report.judgement;
  if (found.poses == 0) return fmt::format("  not judged in motion: {}\n", report.not_judged);
  return fmt::format(
      "  in motion          {} poses, {} steps: {} of {} closures touch, lips {:.2f} mm in each other, {:.2f} in "
      "teeth, "
      "{:.2f} in the tongue\n"
      "  edges              {:.1f} times as long at most, {:.1f} mm longer; {:.1f} mm2 turned over; skin {:.1f} mm off "
      "its markers\n"
      "  jumps              {:.1f} times those of the markers at most; skin moves {:.0f} % of them, lips {:.0f} %\n"
      "{}"
      "  fold-overs in use  {} of {} places\n",
      found.poses, found.steps, found.touching, found.closures, found.lips_overlap_mm, found.in_teeth_mm,
      found.in_tongue_mm, found.edge_ratio, found.edge_growth_mm, found.turned_over_mm2, found.off_markers_mm,
      found.jump_ratio, 100 * found.motion_share, 100 * found.lip_motion_share,
      found.lopsided_mm
          ? fmt::format("  sides              {:.2f} mm apart where the actor's do the same\n", *found.lopsided_mm)
          : "",
      found.warp_folds, found.warp_points);
}

}  // namespace

nlohmann::json faceFacts(const FaceFile& face, const FaceReport& report) {
  const FaceCheck& check = report.check;
  return {{"name", face.name},
          {"mesh", face.mesh_file},
          {"corpus", face.corpus},
          {"metres_per_unit", face.metres_per_unit},
          {"markers", check.markers},
          {"vertices", check.binding.vertices},
          {"bound_vertices", check.binding.bound_vertices},
          {"coverage", check.binding.coverage},
          {"lip_side_errors", check.binding.lip_side_errors},
          {"way_between_lips", check.binding.way_between_lips},
          {"largest_offset_mm", check.binding.largest_offset},
          {"landmark_rms_mm", check.landmark_rms_mm},
          {"landmark_max_mm", check.landmark_max_mm},
          {"leave_one_out_rms_mm", check.leave_one_out_rms_mm},
          {"marker_to_surface_max_mm", check.marker_to_surface_max_mm},
          {"farthest_marker", check.farthest_marker},
          {"kernel", nameOf(check.kernel)},
          {"shape_factor", check.shape_factor},
          {"sampled_points", check.sampled_points},
          {"fold_overs", check.fold_overs},
          {"fold_over_marker", check.fold_over_marker},
          {"patch_edge_angle_max_deg", check.patch_edge_angle_max_deg},
          {"in_motion", judgementFacts(report)},
          {"faults", report.faults()}};
}

std::string faceText(const FaceFile& face, const FaceReport& report) {
  const FaceCheck& check = report.check;
  std::string text = fmt::format(
      "{}: {} vertices, {} markers, actor of {}\n"
      "  landmark error     {:.2e} mm at most, left out one by one {:.2f} mm RMS ({}, shape {:.2f})\n"
      "  markers on skin    {:.2f} mm off at most ({})\n"
      "  fold-overs         {} of {} points\n"
      "  bound              {} vertices, {:.1f} % of the face, {:.1f} mm off the control surface at most\n"
      "  across the lips    {} vertices\n"
      "  patch edges        {:.3g} degrees at most\n",
      face.name, check.binding.vertices, check.markers, face.corpus, check.landmark_max_mm, check.leave_one_out_rms_mm,
      nameOf(check.kernel), check.shape_factor, check.marker_to_surface_max_mm, check.farthest_marker, check.fold_overs,
      check.sampled_points, check.binding.bound_vertices, 100 * check.binding.coverage, check.binding.largest_offset,
      check.binding.lip_side_errors, check.patch_edge_angle_max_deg);
  text += judgementText(report);
  for (const std::string& fault : report.faults()) text += "  fault: " + fault + "\n";
  return text;
}

void noticeNotJudged(const FaceFile& face, const FaceReport& report) {
  printNotice(fmt::format("{}: not judged in motion: {}", face.name, report.not_judged), report.not_judged.empty());
}

void printFace(const FaceFile& face, const FaceReport& report, bool json, bool quiet) {
  if (json || quiet) noticeNotJudged(face, report);  // the text says so itself
  if (json) {
    printJson(faceFacts(face, report));
  } else if (!quiet) {
    printText(faceText(face, report));
  }
}

}  // namespace mouthpiece
