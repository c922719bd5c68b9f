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

#include "base/counted.h"
#include "base/errors.h"
#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "deform/topology/lip_slit.h"
#include "exports/gltf/glb.h"
#include "exports/scenes/scene_files.h"
#include "exports/shape_sets/shape_set.h"
#include "motion/arkit_shapes.h"
#include "mouthpiece/corpus.h"
#include "programs/outputs.h"
#include "programs/retarget/commands.h"
#include "retarget/rig/face_judge.h"
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
      .add_option(
          "-o,--out", options.out,
          ".glb (a head that came as GLB keeps all it has), .fbx, .usda, .usdz, or a folder for one OBJ a shape")
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
  double share_mirrored = 0;          ///< of the vertices of skin that a shape moves
  std::vector<FaceJudgement> judged;  ///< one a shape
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

SetFacts factsOf(const ShapeSet& set, const FaceRig& rig, const FaceFile& face) {
  SetFacts facts;
  measureSides(set, rig.mesh(), facts);
  std::vector<VertexPositions> poses;
  std::vector<JudgedPoses::Row> rows;
  for (std::size_t k = 0; k < set.names.size(); ++k) {
    poses.push_back(set.posed(rig.mesh(), k));
    rows.push_back({set.names[k], set.closes[k], false});
  }
  facts.judged = judgeShapes(rig, face, poses, rows);
  for (std::size_t k = 0; k < set.names.size(); ++k) {
    if (!set.closes[k]) continue;
    const auto& open = facts.judged[k].left_open;
    facts.closing_gap_mm =
        std::max(facts.closing_gap_mm, 1000 * rig.mesh().metres_per_unit * *std::max_element(open.begin(), open.end()));
  }
  return facts;
}

/// The largest of all shapes.
double worstOf(const SetFacts& facts, double FaceJudgement::*what) {
  double worst = 0;
  for (const FaceJudgement& judged : facts.judged) worst = std::max(worst, judged.*what);
  return worst;
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
  const FaceMesh& mesh = face.rig().mesh();
  const PrincipalShapes shapes = shapesWithoutMotion(set, mesh);
  const std::string ending = given.out.extension().string();
  if (ending == ".glb") {
    const fs::path mesh_path = face.meshPath();
    std::optional<std::string> glb;
    if (isGlb(mesh_path))
      glb = glbWithShapes(readFile(mesh_path), mesh_path.string(), shapes, face.file.upright_from_mesh,
                          face.file.mesh_object, nullptr, set.names);
    writeFileAtomically(given.out, glb ? *glb : glbBytes(mesh, shapes, face.rig().name(), set.names));
  } else if (ending == ".fbx") {
    writeFileAtomically(given.out,
                        fbxBytes(mesh, shapes, face.rig().name(), sceneTexturesOf(face.meshPath()), set.names));
  } else if (ending == ".usdz") {
    writeFileAtomically(given.out,
                        usdzBytes(mesh, shapes, face.rig().name(), sceneTexturesOf(face.meshPath()), set.names));
  } else if (ending == ".usda") {
    writeFileAtomically(given.out, usdaText(mesh, shapes, face.rig().name(), set.names));
  } else {
    FaceMesh posed = mesh;
    writeObj(given.out / "neutral.obj", posed);
    for (std::size_t k = 0; k < set.names.size(); ++k) {
      posed.vertices = mesh.vertices + set.moves[k];
      writeObj(given.out / (set.names[k] + ".obj"), posed);
    }
  }
}

constexpr int kMostRounds = 30;

bool isOfSkin(const FaceFault& fault) {
  return fault.limit == "stretch" || fault.limit == "edge length" || fault.limit == "triangles turned over";
}

/// Skin that a shape tears is relaxed, step by step further around; what then is wrong goes less far, both sides of a
/// pair alike. Returns whether anything is left to try.
bool mend(const ShapeSet& set, const SetFacts& facts, std::map<std::string, ShapeManner>& manners) {
  constexpr std::array kRelaxedWithin{0.06, 0.12, 0.2, 0.3, 0.45, 0.65, 0.9};  // of the mouth's width
  constexpr double kWeaker = 0.85, kWeakest = 0.3;
  std::map<std::string, std::string> weaker;  // and why
  bool changed = false;
  for (std::size_t k = 0; k < set.names.size(); ++k) {
    const FaceJudgement& judged = facts.judged[k];
    ShapeManner& manner = manners[set.names[k]];
    const bool tears = std::any_of(judged.faults.begin(), judged.faults.end(), isOfSkin);
    if (tears && manner.relaxed.size() < kRelaxedWithin.size()) {
      manner.relaxed.emplace_back(judged.torn, kRelaxedWithin[manner.relaxed.size()]);
      changed = true;
    } else if (!judged.faults.empty()) {
      // mouthClose takes back what jawOpen does, so it is as weak as that.
      const std::string name = set.names[k] == "mouthClose" ? "jawOpen" : set.names[k];
      weaker.emplace(name, judged.faults[0].what);
      weaker.emplace(otherSideOf(name), judged.faults[0].what);
    }
  }
  for (const auto& [name, why] : weaker) {
    ShapeManner& manner = manners[name];
    changed |= manner.strength > kWeakest;
    manner.strength = std::max(kWeakest, manner.strength * kWeaker);
    if (manner.why.empty()) manner.why = why;
  }
  return changed;
}

int runShapes(const ShapesArguments& given) {
  const std::string ending = given.out.extension().string();
  if (!ending.empty() && ending != ".glb" && ending != ".fbx" && ending != ".usda" && ending != ".usdz")
    throw InputError(given.out.string(), "", "found an unknown ending; expected .glb .fbx .usda .usdz or a folder");
  const SharedFace face(given.face);
  if (isSameFile(given.out, face.data().meshPath()))
    throw InputError(given.out.string(), "--out", "is the head that the face was fitted to; expected another name");
  const SharedCorpus corpus(given.corpus);
  const SharedFace::Data& own = face.data();
  const SharedCorpus::Data& by = corpus.data();
  const std::vector<std::string> markers = by.corpus.layout.markerNames();
  const ShapeMaker maker(own.rig(), own.file, by.actor, markers, by.curve_model.poses());
  std::map<std::string, ShapeManner> manners;
  ShapeSet set = maker.make(vocabularyOf(given.set));
  const std::vector<std::string> kept = keptShapes(given, set, own);
  SetFacts facts = factsOf(set, own.rig(), own.file);
  for (int round = 0; round < kMostRounds && mend(set, facts, manners); ++round) {
    set = maker.make(vocabularyOf(given.set), manners);
    facts = factsOf(set, own.rig(), own.file);
  }
  ShapeSet added;
  for (std::size_t k = 0; k < set.names.size(); ++k) {
    if (std::find(kept.begin(), kept.end(), set.names[k]) != kept.end()) continue;
    added.names.push_back(set.names[k]);
    added.moves.push_back(set.moves[k]);
  }
  writeSet(given, added, own);
  std::vector<std::string> faults;
  for (const FaceJudgement& judged : facts.judged) {
    for (const FaceFault& fault : judged.faults) faults.push_back(fault.what);
  }
  std::map<std::string, double> strengths;
  std::map<std::string, std::string> weakened_by;
  for (const auto& [name, manner] : manners) {
    if (manner.strength >= 1) continue;
    strengths[name] = manner.strength;
    weakened_by[name] = manner.why;
  }
  const double overlap = worstOf(facts, &FaceJudgement::lips_overlap_mm);
  const double turned = worstOf(facts, &FaceJudgement::turned_over_mm2);
  if (given.json) {
    printJson(nlohmann::json{{"shapes", set.names},
                             {"kept", kept},
                             {"closing_gap_mm", facts.closing_gap_mm},
                             {"side_rms_mm", facts.side_rms_mm},
                             {"side_worst_mm", facts.side_worst_mm},
                             {"share_mirrored", facts.share_mirrored},
                             {"lips_overlap_mm", overlap},
                             {"turned_over_mm2", turned},
                             {"edge_ratio", worstOf(facts, &FaceJudgement::edge_ratio)},
                             {"edge_growth_mm", worstOf(facts, &FaceJudgement::edge_growth_mm)},
                             {"strengths", strengths},
                             {"weakened_by", weakened_by},
                             {"faults", faults}});
  } else if (!given.quiet) {
    printText(
        fmt::format("{} on '{}' -> {}\n", counted(set.names.size(), "shape"), own.rig().name(), given.out.string()));
    if (!kept.empty()) printText(fmt::format("  the head's own     {}: kept as they are\n", fmt::join(kept, ", ")));
    printText(fmt::format("  lips that meet     {:.2f} mm apart at most\n", facts.closing_gap_mm));
    printText(fmt::format("  left and right     {:.2f} mm apart (RMS), {:.2f} at most, over {:.0f} % of what moves\n",
                          facts.side_rms_mm, facts.side_worst_mm, 100 * facts.share_mirrored));
    printText(fmt::format("  lips               {:.2f} mm inside each other at most; {:.2f} mm2 folded over\n", overlap,
                          turned));
    for (const auto& [name, strength] : strengths)
      printText(fmt::format("  weaker             {} goes {:.0f} % as far: else {}\n", name, 100 * strength,
                            weakened_by[name]));
    for (const std::string& fault : faults) printText("  to look at         " + fault + "\n");
  }
  return kExitDone;
}

}  // namespace

Command shapesCommand() {
  return makeCommand("shapes", "Give a fitted head ARKit's, Oculus' or VRM's shapes",
                     "retarget shapes head.face --set arkit --out head_arkit.glb", addOptions, runShapes);
}

}  // namespace mouthpiece
