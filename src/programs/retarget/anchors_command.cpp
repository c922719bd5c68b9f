// retarget anchors: the ten anchors of a head without a click.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <optional>

#include "base/counted.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_scene.h"
#include "deform/mesh/mesh_files.h"
#include "deform/mesh/mesh_limits.h"
#include "exports/arkit.h"
#include "face_finder/seen_anchors.h"
#include "programs/outputs.h"
#include "programs/retarget/commands.h"
#include "retarget/placing/bone_anchors.h"
#include "retarget/placing/face_page.h"
#include "retarget/placing/shape_anchors.h"
#include "retarget/placing/whole_head.h"
#include "speaker/shared_files.h"
#include "tracking/face_tracker.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

struct AnchorsArguments {
  fs::path mesh, out, show;
  std::string object, by = "any";
  bool quiet = false, json = false;
};

/// Of the shapes that stand for `arkit_name` the sum: halves count as the whole.
VertexPositions shapeFor(const FaceShapes& shapes, std::string_view arkit_name) {
  VertexPositions sum;
  for (std::size_t s = 0; s < shapes.names.size(); ++s) {
    const int shape = arkitIndex(shapes.names[s]);
    if (shape < 0 || kArkitNames[unsignedIndex(shape)] != arkit_name) continue;
    if (sum.rows() == 0) sum = VertexPositions::Zero(shapes.moves[s].rows(), 3);
    sum += shapes.moves[s];
  }
  return sum;
}

/// Its letters and digits, small, behind the last full stop: "mtha" of "Face.MTH_A". What is not ASCII stays.
std::string bareName(std::string_view name) {
  name.remove_prefix(std::min(name.size(), name.rfind('.') + 1));
  std::string bare = lowerCase(name);
  std::erase_if(bare, [](unsigned char letter) { return letter < 0x80 && std::isalnum(letter) == 0; });
  return bare;
}

/// The shape that opens the mouth: ARKit's, else the most open vowel of a set of visemes.
VertexPositions jawShape(const FaceShapes& shapes) {
  constexpr std::array<std::string_view, 10> kOpen{"visemeaa", "fclmtha",   "mtha", "aa",  "a",
                                                   "vopen",    "mouthopen", "ah",   "vaa", "vrcvaa"};
  constexpr std::size_t kTelling = 4;  // letters: what a longer name may end with, "M_F00_000_00_Fcl_MTH_A"
  VertexPositions jaw = shapeFor(shapes, "JawOpen");
  for (const std::string_view wanted : kOpen) {
    for (std::size_t s = 0; s < shapes.names.size() && jaw.rows() == 0; ++s) {
      const std::string name = bareName(shapes.names[s]);
      if (name == wanted || (wanted.size() >= kTelling && name.ends_with(wanted))) jaw = shapes.moves[s];
    }
  }
  return jaw;
}

/// By the shapes; none where the head has none that open the jaw, or they part no lips and `source` allows another way.
std::map<std::string, std::uint32_t> anchorsByShapes(const FaceMesh& mesh, const TellingShapes& shapes,
                                                     const fs::path& file, AnchorSource source) {
  if (shapes.jaw_open.rows() == 0) {
    if (source == AnchorSource::kAny) return {};
    throw InputError(file.string(), "",
                     source == AnchorSource::kShapes
                         ? "has no shape that opens the jaw (jawOpen, viseme_aa, A ...); click the ten anchors on the "
                           "page that `retarget pick` writes"
                         : "has neither nodes named as anchors nor bones of the face or the jaw; click the ten anchors "
                           "on the page that `retarget pick` writes");
  }
  try {
    return anchorsFromShapes(mesh, shapes, file.string());
  } catch (const InputError&) {
    if (source != AnchorSource::kAny) throw;
    return {};
  }
}

std::optional<SeenFace> seenOn(const FaceMesh& mesh, const std::vector<std::uint32_t>& head) {
  const fs::path models =
      findSharedFile("face_tracker/face_landmarks.tflite", "make it with `make build` in the checkout").parent_path();
  FaceTracker tracker(models);
  return seenFace(mesh, tracker, head);
}

/// What was seen of what was not found otherwise, and how sure that is.
void addSeen(const SeenFace& seen, FoundAnchors& found) {
  double widest = 0;
  for (const auto& [name, anchor] : seen.anchors) {
    const bool is_new = found.anchors.markers.emplace(name, anchor.place).second;
    if (is_new) widest = std::max(widest, anchor.spread / seen.eye_corners);
  }
  found.how += fmt::format(
      "{}as the head looks (a face in {} of {} pictures, presence {:.2f} at least; {:.1f} % of the eyes' "
      "distance apart)",
      found.how.empty() ? "" : ", the others ", seen.seen, seen.pictures, seen.presence, 100 * widest);
}

int runAnchors(const AnchorsArguments& given) {
  const fs::path out = given.out.empty() ? fs::path(given.mesh.stem().string() + ".anchors.json") : given.out;
  // Clicked ones may go by this name.
  if (given.out.empty() && fs::exists(out))
    throw InputError(out.string(), "", "is there already; -o names the file to write, this one or another");
  const std::string bytes = readFile(given.mesh, kMaxMeshBytes);
  const std::shared_ptr<const FaceMesh> mesh = sharedFaceMesh(bytes, given.mesh, given.object);
  const AnchorSource source = given.by == "shapes"  ? AnchorSource::kShapes
                              : given.by == "bones" ? AnchorSource::kBones
                              : given.by == "looks" ? AnchorSource::kLooks
                                                    : AnchorSource::kAny;
  const FoundAnchors found = findAnchors(*mesh, bytes, given.mesh, given.object, source);
  const NamedAnchors named{found.anchors, given.mesh.string()};
  refuseSeveralHeads(*mesh, bytes, given.mesh, given.object, named);
  const std::string file = anchorsBytes(found.anchors);
  writeFileAtomically(out, file);
  if (!given.show.empty())
    writeFileAtomically(given.show, facePage(*mesh, given.mesh.stem().string(), found.anchors, {},
                                             dressingOf(bytes, given.mesh, *mesh, named)));
  printNotice("not found:" + found.missing, given.quiet || found.missing.empty());
  if (given.json) {
    printText(file);
  } else if (!given.quiet) {
    printText(fmt::format("{} {} -> {}\n", counted(found.anchors.markers.size(), "anchor"), found.how, out.string()));
  }
  return kExitDone;
}

void addOptions(CLI::App& command, AnchorsArguments& options) {
  command.add_option("MESH", options.mesh, "OBJ, PLY, OFF, GLB or VRM, in any unit and turned any way")->required();
  command.add_option("-o,--out", options.out, "The anchors file (default: MESH's name with .anchors.json)");
  command.add_option("--object", options.object,
                     "Of a GLB's scene what hangs on the node, or shows the mesh, of this name (default: all)");
  command
      .add_option("--by", options.by,
                  "bones: nodes named as anchors, bones of the face, what the jaw's bone parts; shapes: what the "
                  "head's own shape of an open mouth parts; looks: where a face tracker sees a face in pictures of the "
                  "head; any: each by the first of these that tells it")
      ->check(CLI::IsMember({"any", "bones", "shapes", "looks"}))
      ->capture_default_str();
  command.add_option("--show", options.show, "Also write a page that shows them on the head (.html)");
  checkOutputs(command, {{"--out"}, {"--show", OutputKind::kPage}});
  addJsonFlag(command, options.json);
}

}  // namespace

FoundAnchors findAnchors(const FaceMesh& mesh, std::string_view bytes, const fs::path& file, const std::string& object,
                         AnchorSource source) {
  FoundAnchors found;
  /// Takes what is new, and tells what it was found by.
  const auto add = [&found](const auto& anchors, std::string_view how) {
    const std::size_t before = found.anchors.markers.size();
    for (const auto& [name, place] : anchors) found.anchors.markers.emplace(name, place);
    if (found.anchors.markers.size() == before) return;
    found.how += found.how.empty() ? std::string(how) : fmt::format(", {}", how);
  };
  const auto isComplete = [&] { return found.anchors.markers.size() >= suggestedAnchors().size(); };
  const auto asks = [source](AnchorSource way) { return source == AnchorSource::kAny || source == way; };
  const BoneAnchors bones =
      isGlb(file) ? anchorsFromBones(mesh, glbBones(bytes, file.string(), object)) : BoneAnchors{};
  if (asks(AnchorSource::kBones)) add(bones.named, "by nodes named so");
  if (asks(AnchorSource::kShapes) && !isComplete()) {
    const FaceShapes shapes = parseFaceShapes(bytes, file, object);
    const TellingShapes telling{jawShape(shapes), shapeFor(shapes, "EyeBlinkRight"), shapeFor(shapes, "EyeBlinkLeft")};
    add(anchorsByShapes(mesh, telling, file, source), "by the head's own shapes");
  }
  if (asks(AnchorSource::kBones) && !isComplete()) {
    add(bones.face_bones, "by bones of the face");
    const bool needs_jaw = source == AnchorSource::kBones && found.anchors.markers.empty();
    if (!isComplete()) {
      add(anchorsByShapes(mesh, {bones.jaw_open, {}, {}}, file, needs_jaw ? source : AnchorSource::kAny),
          "by what the jaw's bone parts");
    }
  }
  if (asks(AnchorSource::kLooks) && !isComplete()) {
    const std::optional<SeenFace> seen = seenOn(mesh, bones.head);
    if (!seen && found.anchors.markers.empty()) {
      if (const std::string why = whyNoWholeHead(mesh); !why.empty()) throw InputError(file.string(), "", why);
      throw InputError(file.string(), "",
                       "shows no face that the tracker knows, from any side, and has no shape that opens its mouth; "
                       "click the ten anchors on the page that `retarget pick` writes");
    }
    if (seen) addSeen(*seen, found);
  }
  for (const AnchorToPick& wanted : suggestedAnchors()) {
    if (!found.anchors.markers.contains(std::string(wanted.name))) found.missing += " " + std::string(wanted.name);
  }
  return found;
}

NamedAnchors anchorsFor(const FaceMesh& mesh, std::string_view bytes, const fs::path& file, const std::string& object,
                        const fs::path& given, bool quiet) {
  NamedAnchors named;
  if (!given.empty()) {
    named = {parseAnchors(readFile(given, kMaxAnchorBytes), given.string()), given.string()};
  } else {
    FoundAnchors found = findAnchors(mesh, bytes, file, object, AnchorSource::kAny);
    printNotice(
        fmt::format("{}: found {} {}", file.string(), counted(found.anchors.markers.size(), "anchor"), found.how),
        quiet);
    named = {std::move(found.anchors), file.string()};
  }
  refuseSeveralHeads(mesh, bytes, file, object, named);
  return named;
}

void refuseSeveralHeads(const FaceMesh& mesh, std::string_view bytes, const fs::path& file, const std::string& object,
                        const NamedAnchors& anchors) {
  if (!object.empty() || !isGlb(file)) return;
  struct Shown {
    Eigen::AlignedBox3f box;
    std::size_t anchors = 0;
  };
  std::map<int, Shown> shown;  // by node
  const std::vector<GlbRun> runs = glbRuns(bytes, file.string());
  for (const GlbRun& run : runs) {
    for (std::size_t v = 0; v < run.count; ++v)
      shown[run.node].box.extend(mesh.vertices.row(signedIndex(run.first_vertex + v)).transpose());
  }
  if (shown.size() < 2) return;
  for (const auto& [name, anchor] : anchors.anchors.markers) {
    const Eigen::RowVector3f at = placeOf(anchors.anchors, name, mesh, anchors.file)->cast<float>().transpose();
    Eigen::Index nearest = 0;
    (mesh.vertices.rowwise() - at).rowwise().squaredNorm().minCoeff(&nearest);
    const auto vertex =
        std::holds_alternative<std::uint32_t>(anchor) ? std::get<std::uint32_t>(anchor) : unsignedIndex(nearest);
    const auto on = std::find_if(runs.begin(), runs.end(), [vertex](const GlbRun& run) {
      return vertex >= run.first_vertex && vertex < run.first_vertex + run.count;
    });
    if (on != runs.end()) ++shown[on->node].anchors;
  }
  std::erase_if(shown, [](const auto& entry) { return entry.second.anchors < 2; });
  const std::vector<GlbBones::Node> nodes = glbBones(bytes, file.string()).nodes;
  const auto wayTo = [&nodes](int node) {  // from the scene's root
    std::vector<int> way;
    for (; node >= 0; node = nodes[unsignedIndex(node)].parent) way.insert(way.begin(), node);
    return way;
  };
  for (auto one = shown.begin(); one != shown.end(); ++one) {
    for (auto other = std::next(one); other != shown.end(); ++other) {
      // Eyes, hair or a beard lie within their head; heads stand side by side.
      const Eigen::AlignedBox3f &here = one->second.box, &there = other->second.box;
      if (here.contains(there.center()) || there.contains(here.center())) continue;
      const std::vector<int> way = wayTo(one->first), other_way = wayTo(other->first);
      const auto [parts, other_parts] = std::mismatch(way.begin(), way.end(), other_way.begin(), other_way.end());
      const int node = parts == way.end() ? one->first : *parts;
      const int other_node = other_parts == other_way.end() ? other->first : *other_parts;
      throw InputError(anchors.file, "markers",
                       fmt::format("lie on several heads; expected one, which --object names: '{}' '{}'",
                                   nodes[unsignedIndex(node)].name, nodes[unsignedIndex(other_node)].name));
    }
  }
}

Command anchorsCommand() {
  return makeCommand("anchors", "Find the ten anchors of a head by bones, its own shapes, or as it looks",
                     "retarget anchors head.obj -o head.anchors.json", addOptions, runAnchors);
}

}  // namespace mouthpiece
