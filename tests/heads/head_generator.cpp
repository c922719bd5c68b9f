#include "heads/head_generator.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <span>

#include "base/files.h"
#include "heads/head_changes.h"
#include "heads/mouth_trial.h"
#include "retarget/rig/face_file.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

/// Triangles of a part joined two by two over their common edges, some of the pairs with a third.
std::vector<std::vector<std::uint32_t>> polygonsOf(std::span<const Triangle> triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> by_edge;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) by_edge[{triangles[t][k], triangles[t][(k + 1) % 3]}] = t;
  }
  std::vector<bool> used(triangles.size(), false);
  std::vector<std::vector<std::uint32_t>> polygons;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (used[t]) continue;
    used[t] = true;
    std::vector<std::uint32_t> polygon(triangles[t].begin(), triangles[t].end());
    const std::size_t most = t % 5 == 0 ? 5 : 4;
    for (std::size_t k = 0; k < polygon.size() && polygon.size() < most; ++k) {
      const std::uint32_t a = polygon[k], b = polygon[(k + 1) % polygon.size()];
      const auto other = by_edge.find({b, a});
      if (other == by_edge.end() || used[other->second]) continue;
      for (const std::uint32_t v : triangles[other->second]) {
        if (v == a || v == b || std::find(polygon.begin(), polygon.end(), v) != polygon.end()) continue;
        polygon.insert(polygon.begin() + static_cast<std::ptrdiff_t>(k) + 1, v);
        used[other->second] = true;
        break;
      }
    }
    polygons.push_back(std::move(polygon));
  }
  return polygons;
}

}  // namespace

std::string objOf(const ClickedHead& head) {
  if (!head.has_polygons) return objBytes(head.mesh);
  std::string text;
  auto out = std::back_inserter(text);
  for (Eigen::Index v = 0; v < head.mesh.vertices.rows(); ++v)
    fmt::format_to(out, "v {} {} {}\n", head.mesh.vertices(v, 0), head.mesh.vertices(v, 1), head.mesh.vertices(v, 2));
  for (const MeshPart& part : head.mesh.parts) {
    fmt::format_to(out, "usemtl {}\n", part.name);
    for (const auto& polygon : polygonsOf(trianglesOf(head.mesh, part))) {
      text += "f";
      for (const std::uint32_t v : polygon) fmt::format_to(out, " {}", v + 1);
      text += "\n";
    }
  }
  return text;
}

std::vector<ClickedHead> clickedHeads(const fs::path& sources, const fs::path& share) {
  std::vector<ClickedHead> heads;
  const fs::path faces = sources / ".." / "shared" / "faces";
  for (const char* name : {"ict_head", "makehuman_male", "ict_id11", "ict_id12", "ict_id13", "ict_id14",
                           "mh_african_female_young", "mh_asian_male_old"}) {
    fs::path path = faces / (name + std::string(".obj"));
    if (!fs::exists(path)) path = faces / "more" / path.filename();
    const fs::path clicks = sources / "tests/data/anchors" / (name + std::string(".anchors.json"));
    if (!fs::exists(path) || !fs::exists(clicks)) continue;
    ClickedHead head{name, readFaceMesh(path), parseAnchors(readFile(clicks), clicks.string()), {}};
    setScale(head);
    heads.push_back(std::move(head));
  }
  const fs::path made = share / "default.face";
  if (fs::exists(made)) {
    const FaceFile face = readFaceFile(made);
    ClickedHead head{"default", readMeshOf(face, made), {}, {}};
    for (const char* name : {"LIP_CORNER_R", "LIP_CORNER_L", "LIP_UP_MID", "LIP_LO_MID", "NOSE_TIP", "CHIN_LOW",
                             "CANTHUS_OUT_R", "CANTHUS_OUT_L", "EYE_IN_R", "EYE_IN_L"}) {
      for (std::size_t i = 0; i < face.control.points.size(); ++i) {
        if (face.control.points[i].name == name)
          head.clicks.markers[name] = Vector3d(face.control.rest.row(signedIndex(i)).transpose());
      }
    }
    setScale(head);
    heads.push_back(std::move(head));
  }
  return heads;
}

ClickedHead variedHead(const ClickedHead& head, unsigned seed) {
  Chance chance(seed);
  ClickedHead made = head;
  made.name = fmt::format("{} {}", head.name, seed);
  shape(made, chance);
  if (chance.happens(0.35)) openMouth(made, chance.number(0.5, 6));
  const double meshing = chance.number(0, 1);
  if (meshing < 0.2 && made.mesh.triangles.size() < 20000)
    subdivide(made);
  else if (meshing < 0.4)
    remesh(made, chance.number(1.5, 4));
  else if (meshing < 0.6)
    decimate(made, chance.number(0.1, 0.5));
  if (chance.happens(0.3)) addNoise(made, chance, chance.number(0.02, 0.12));
  if (chance.happens(0.15)) unweld(made);
  made.has_polygons = chance.happens(0.3);
  if (made.has_polygons) made.changes += ", polygons";
  jitter(made, chance);
  return made;
}

ClickedHead stylisedHead(const ClickedHead& head, unsigned seed) {
  Chance chance(seed);
  ClickedHead made = head;
  made.name = fmt::format("{} stylised {}", head.name, seed);
  const double amount = chance.number(0.5, 1);
  stylise(made, static_cast<int>(chance.number(0, kStyles)), amount);
  const double meshing = chance.number(0, 1);
  if (meshing < 0.2)
    remesh(made, chance.number(1.5, 4));
  else if (meshing < 0.5)
    decimate(made, chance.number(0.1, 0.5));
  if (chance.happens(0.2)) addNoise(made, chance, chance.number(0.02, 0.12));
  made.has_polygons = chance.happens(0.3);
  if (made.has_polygons) made.changes += ", polygons";
  jitter(made, chance);
  return made;
}

ClickedHead crossedHead(const ClickedHead& head, unsigned seed, const Corpus& corpus) {
  constexpr std::array kDepthsMm{0.3, 0.8, 2.0};
  constexpr double kStepMm = 0.05, kMostMm = 12;
  Chance chance(seed);
  ClickedHead shaped = head;
  shaped.name = fmt::format("{} crossed {}", head.name, seed);
  shape(shaped, chance);
  FaceMesh mesh = shaped.mesh;
  const FaceFile face = fitFace(mesh, shaped.clicks, "clicks", requestFor(shaped, corpus));
  const LipContactMeter meter(mesh, face.control);
  const double wanted_mm = kDepthsMm[seed % kDepthsMm.size()];
  ClickedHead made = shaped;
  for (double up_mm = 0, depth_mm = 0; depth_mm < wanted_mm && up_mm < kMostMm; up_mm += kStepMm) {
    made = shaped;
    openMouth(made, -up_mm);
    const VertexPositions moved = mesh.vertices + (made.mesh.vertices - shaped.mesh.vertices);
    depth_mm = shaped.mm_per_unit * meter.measure(moved, kMostMm / shaped.mm_per_unit).overlap;
    made.changes = fmt::format("{}, lips {:.2f} mm in each other", shaped.changes, depth_mm);
  }
  const double meshing = chance.number(0, 1);
  if (meshing < 0.15 && made.mesh.triangles.size() < 20000)
    subdivide(made);
  else if (meshing < 0.35)
    remesh(made, chance.number(1.5, 4));
  else if (meshing < 0.6)
    decimate(made, chance.number(0.1, 0.5));
  jitter(made, chance);
  return made;
}

}  // namespace mouthpiece::test
