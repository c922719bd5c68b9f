// retarget shapes: a fitted head with the shapes that other programs ask for.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/errors.h"
#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/lip_slit.h"
#include "exports/gltf/glb.h"
#include "exports/scenes/scene_files.h"
#include "exports/shape_sets/shape_set.h"
#include "motion/arkit_shapes.h"
#include "mouthpiece/corpus.h"
#include "programs/retarget/commands.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

struct ShapesArguments {
  fs::path face, out, corpus;
  std::string set = "arkit";
  bool json = false, quiet = false;
};

void addOptions(CLI::App& command, ShapesArguments& options) {
  command.add_option("face", options.face, "The head, made by `retarget fit`")->required();
  command.add_option("--set", options.set, "arkit: 52 shapes; oculus: 14 visemes; vrm: aa ih ou ee oh and blinks")
      ->check(CLI::IsMember({"arkit", "oculus", "vrm"}))
      ->capture_default_str();
  command
      .add_option("--out", options.out,
                  ".glb (a head that came as GLB keeps all it has), .fbx, .usda, or a folder for one OBJ a shape")
      ->required();
  command.add_option("--corpus", options.corpus, "Corpus whose captured poses are used (default: the sample corpus)");
  addJsonFlag(command, options.json);
}

ShapeVocabulary vocabularyOf(const std::string& set) {
  if (set == "oculus") return ShapeVocabulary::kOculus;
  return set == "vrm" ? ShapeVocabulary::kVrm : ShapeVocabulary::kArkit;
}

/// The vertices that lie where each one's mirror image would, to a millimetre: several where lips touch.
std::vector<std::vector<Eigen::Index>> mirroredVertices(const FaceMesh& mesh, const std::vector<std::uint32_t>& skin) {
  const double cell = 1e-3 / mesh.metres_per_unit;
  const auto keyOf = [&](const Eigen::RowVector3f& place) {
    return std::array<long, 3>{std::lround(static_cast<double>(place.x()) / cell),
                               std::lround(static_cast<double>(place.y()) / cell),
                               std::lround(static_cast<double>(place.z()) / cell)};
  };
  std::map<std::array<long, 3>, std::vector<Eigen::Index>> at;
  for (const std::uint32_t v : skin) at[keyOf(mesh.vertices.row(v))].push_back(v);
  std::vector<std::vector<Eigen::Index>> mirrored;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    Eigen::RowVector3f place = mesh.vertices.row(v);
    place.x() = -place.x();
    const auto found = at.find(keyOf(place));
    mirrored.push_back(found == at.end() ? std::vector<Eigen::Index>() : found->second);
  }
  return mirrored;
}

/// What is known of the set: how well it closes, how alike its sides are, and what the judge of faces says of it.
struct SetFacts {
  double closing_gap_mm = 0;  ///< the largest between lips that a shape says meet
  double side_rms_mm = 0, side_worst_mm = 0;
  double share_mirrored = 0;  ///< of the vertices of skin that a shape moves
  FaceJudgement judgement;
};

/// The shape that does the same on the other side: "jawRight" for "jawLeft"; the name itself on the midline.
std::string otherSideOf(std::string name) {
  if (name.ends_with("Left")) return name.replace(name.size() - 4, 4, "Right");
  if (name.ends_with("Right")) return name.replace(name.size() - 5, 5, "Left");
  return name;
}

void measureSides(const ShapeSet& set, const FaceMesh& mesh, SetFacts& facts) {
  const std::vector<std::uint32_t> skin = skinVertices(mesh, false);
  const std::vector<std::vector<Eigen::Index>> mirrored = mirroredVertices(mesh, skin);
  const double mm = 1000 * mesh.metres_per_unit;
  double squares = 0, count = 0, moved = 0;
  for (std::size_t k = 0; k < set.names.size(); ++k) {
    if (set.names[k].ends_with("Right")) continue;  // its pair is looked at from the left
    const auto pair = std::find(set.names.begin(), set.names.end(), otherSideOf(set.names[k]));
    if (pair == set.names.end()) continue;
    const VertexPositions& theirs = set.moves[unsignedIndex(pair - set.names.begin())];
    for (const std::uint32_t v : skin) {
      const Eigen::RowVector3f move = set.moves[k].row(v);
      if (move.isZero(0)) continue;
      moved += 1;
      if (mirrored[v].empty()) continue;
      double off = std::numeric_limits<double>::max();
      for (const Eigen::Index other_vertex : mirrored[v]) {
        const Eigen::RowVector3f image = theirs.row(other_vertex).cwiseProduct(Eigen::RowVector3f(-1, 1, 1));
        off = std::min(off, mm * static_cast<double>((move - image).norm()));
      }
      squares += off * off;
      count += 1;
      facts.side_worst_mm = std::max(facts.side_worst_mm, off);
    }
  }
  facts.side_rms_mm = count > 0 ? std::sqrt(squares / count) : 0;
  facts.share_mirrored = moved > 0 ? count / moved : 0;
}

void measureClosings(const ShapeSet& set, const FaceRig& rig, const FaceFile& face, SetFacts& facts) {
  const LipContactMeter meter(rig.mesh(), face.control);
  const auto jaw = std::find(set.names.begin(), set.names.end(), "jawOpen");
  for (std::size_t k = 0; k < set.names.size(); ++k) {
    if (!set.closes[k]) continue;
    VertexPositions pose = rig.mesh().vertices + set.moves[k];
    if (set.names[k] == "mouthClose") pose += set.moves[unsignedIndex(jaw - set.names.begin())];
    facts.closing_gap_mm = std::max(facts.closing_gap_mm, 1000 * rig.mesh().metres_per_unit * meter.measure(pose).gap);
  }
}

SetFacts factsOf(const ShapeSet& set, const FaceRig& rig, const FaceFile& face, const ActorPose& actor) {
  SetFacts facts;
  measureSides(set, rig.mesh(), facts);
  measureClosings(set, rig, face, facts);
  JudgedPoses poses{set.poses, set.lips, set.tongue, {}};
  for (std::size_t k = 0; k < set.names.size(); ++k) poses.rows.push_back({set.names[k], set.closes[k], false});
  facts.judgement = judgeFace(rig, face, poses, actor);
  return facts;
}

/// Shapes of the set that a head which came as GLB has already, "mouthSmile_L" for "mouthSmileLeft" too: they stay its
/// own. Throws InputError when it has all.
std::vector<std::string> keptShapes(const ShapesArguments& given, const ShapeSet& set, const SharedFace::Data& face) {
  std::vector<std::string> kept;
  const fs::path mesh_path = face.meshPath();
  if (given.out.extension() != ".glb" || !isGlb(mesh_path)) return kept;
  const std::vector<std::string> own = parseFaceShapes(readFile(mesh_path), mesh_path, face.file.mesh_object).names;
  std::copy_if(set.names.begin(), set.names.end(), std::back_inserter(kept), [&](const std::string& name) {
    return std::any_of(own.begin(), own.end(), [&](const std::string& theirs) {
      return theirs == name || (arkitIndex(theirs) >= 0 && arkitIndex(theirs) == arkitIndex(name));
    });
  });
  if (kept.size() == set.names.size())
    throw InputError(mesh_path.string(), "", fmt::format("has all shapes of {} already; found none to add", given.set));
  return kept;
}

void writeSet(const ShapesArguments& given, const ShapeSet& set, const SharedFace::Data& face) {
  const FaceMesh& mesh = face.rig.mesh();
  const PrincipalShapes shapes = shapesWithoutMotion(set, mesh);
  const std::string ending = given.out.extension().string();
  if (ending == ".glb") {
    const fs::path mesh_path = face.meshPath();
    std::optional<std::string> glb;
    if (isGlb(mesh_path))
      glb = glbWithShapes(readFile(mesh_path), mesh_path.string(), shapes, face.file.upright_from_mesh,
                          face.file.mesh_object, nullptr, set.names);
    writeFileAtomically(given.out, glb ? *glb : glbBytes(mesh, shapes, face.rig.name(), set.names));
  } else if (ending == ".fbx") {
    writeFileAtomically(given.out, fbxBytes(mesh, shapes, face.rig.name(), set.names));
  } else if (ending == ".usda") {
    writeFileAtomically(given.out, usdaText(mesh, shapes, face.rig.name(), set.names));
  } else {
    FaceMesh posed = mesh;
    writeObj(given.out / "neutral.obj", posed);
    for (std::size_t k = 0; k < set.names.size(); ++k) {
      posed.vertices = mesh.vertices + set.moves[k];
      writeObj(given.out / (set.names[k] + ".obj"), posed);
    }
  }
}

int runShapes(const ShapesArguments& given) {
  const std::string ending = given.out.extension().string();
  if (!ending.empty() && ending != ".glb" && ending != ".fbx" && ending != ".usda")
    throw InputError(given.out.string(), "", "found an unknown ending; expected .glb .fbx .usda or a folder");
  const SharedFace face(given.face);
  const SharedCorpus corpus(given.corpus);
  const SharedFace::Data& own = face.data();
  const SharedCorpus::Data& by = corpus.data();
  // As far as on the head that the shapes were learnt from, or as far as this one bears.
  constexpr int kMostRounds = 24;
  constexpr double kWeaker = 0.85, kWeakest = 0.3;
  std::map<std::string, double> strengths;
  const auto made = [&] {
    return makeShapeSet(own.rig, by.actor, by.corpus.layout.markerNames(), by.curve_model.poses(),
                        vocabularyOf(given.set), strengths);
  };
  ShapeSet set = made();
  const std::vector<std::string> kept = keptShapes(given, set, own);
  SetFacts facts = factsOf(set, own.rig, own.file, by.actor);
  for (int round = 0; round < kMostRounds; ++round) {
    bool changed = false;
    for (const FaceFault& fault : facts.judgement.faults) {
      if (!fault.pose) continue;
      // mouthClose takes back what jawOpen does, so it is as weak as that. Skin that stretches while lips are shut over
      // an open jaw is told alone: a jaw that opens is worth more.
      const bool is_close = set.names[*fault.pose] == "mouthClose";
      if (is_close && (fault.limit == "stretch" || fault.limit == "edge length")) continue;
      const std::string& name = is_close ? "jawOpen" : set.names[*fault.pose];
      double& strength = strengths.try_emplace(name, 1.0).first->second;
      changed |= strength > kWeakest;
      strength = std::max(kWeakest, strength * kWeaker);
      strengths[otherSideOf(name)] = strength;  // both sides alike
    }
    if (!changed) break;
    set = made();
    facts = factsOf(set, own.rig, own.file, by.actor);
  }
  ShapeSet added;
  for (std::size_t k = 0; k < set.names.size(); ++k) {
    if (std::find(kept.begin(), kept.end(), set.names[k]) != kept.end()) continue;
    added.names.push_back(set.names[k]);
    added.moves.push_back(set.moves[k]);
  }
  writeSet(given, added, own);
  if (given.json) {
    nlohmann::json faults = nlohmann::json::array();
    for (const FaceFault& fault : facts.judgement.faults) faults.push_back(fault.what);
    printJson(nlohmann::json{{"shapes", set.names},
                             {"kept", kept},
                             {"closing_gap_mm", facts.closing_gap_mm},
                             {"side_rms_mm", facts.side_rms_mm},
                             {"side_worst_mm", facts.side_worst_mm},
                             {"share_mirrored", facts.share_mirrored},
                             {"lips_overlap_mm", facts.judgement.lips_overlap_mm},
                             {"turned_over_mm2", facts.judgement.turned_over_mm2},
                             {"edge_ratio", facts.judgement.edge_ratio},
                             {"strengths", strengths},
                             {"faults", faults}});
  } else if (!given.quiet) {
    printText(fmt::format("{} shapes on '{}' -> {}\n", set.names.size(), own.rig.name(), given.out.string()));
    if (!kept.empty()) printText(fmt::format("  the head's own     {}: kept as they are\n", fmt::join(kept, ", ")));
    printText(fmt::format("  lips that meet     {:.2f} mm apart at most\n", facts.closing_gap_mm));
    printText(fmt::format("  left and right     {:.2f} mm apart (RMS), {:.2f} at most, over {:.0f} % of what moves\n",
                          facts.side_rms_mm, facts.side_worst_mm, 100 * facts.share_mirrored));
    printText(fmt::format("  lips               {:.2f} mm inside each other at most; {:.2f} mm2 folded over\n",
                          facts.judgement.lips_overlap_mm, facts.judgement.turned_over_mm2));
    for (const auto& [name, strength] : strengths)
      printText(fmt::format("  weaker             {} goes {:.0f} % as far, for the mesh bears no more\n", name,
                            100 * strength));
    for (const FaceFault& fault : facts.judgement.faults) printText("  to look at         " + fault.what + "\n");
  }
  return kExitDone;
}

}  // namespace

Command shapesCommand() {
  return makeCommand("shapes", "Give a fitted head ARKit's, Oculus' or VRM's shapes",
                     "retarget shapes head.face --set arkit --out head_arkit.glb", addOptions, runShapes);
}

}  // namespace mouthpiece
