// What a reader collected becomes a FaceMesh: triangles in the order of the parts, kinds told by names and shape.
#include <Eigen/Geometry>
#include <algorithm>
#include <boost/pending/disjoint_sets.hpp>
#include <cmath>
#include <map>
#include <string>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

/// Words in names of materials and groups, tried in this order. Whose words they are: docs/formats/parts.md.
struct KindWord {
  std::string_view word;
  PartKind kind;
};
constexpr std::array kKindWords{
    KindWord{"lash", PartKind::kSkin},  // they move with the lids
    KindWord{"moustache", PartKind::kSkin},     KindWord{"mustache", PartKind::kSkin},
    KindWord{"whisker", PartKind::kSkin},       KindWord{"schnurrbart", PartKind::kSkin},
    KindWord{"brow", PartKind::kSkin},          KindWord{"eyelid", PartKind::kSkin},
    KindWord{"eyeglass", PartKind::kOther},     KindWord{"eyewear", PartKind::kOther},
    KindWord{"eyeline", PartKind::kSkin},       KindWord{"eyesock", PartKind::kEye},
    KindWord{"tongue", PartKind::kTongue},      KindWord{"teeth", PartKind::kUpperTeeth},
    KindWord{"tooth", PartKind::kUpperTeeth},   KindWord{"gum", PartKind::kUpperTeeth},
    KindWord{"denture", PartKind::kUpperTeeth}, KindWord{"saliva", PartKind::kUpperTeeth},
    KindWord{"lips", PartKind::kLips},          KindWord{"lip_", PartKind::kLips},
    KindWord{"mouth", PartKind::kMouthInside},  KindWord{"oral", PartKind::kMouthInside},
    KindWord{"socks", PartKind::kOther},        KindWord{"stocking", PartKind::kOther},
    KindWord{"sock", PartKind::kMouthInside},   KindWord{"eye", PartKind::kEye},
    KindWord{"sclera", PartKind::kEye},         KindWord{"iris", PartKind::kEye},
    KindWord{"pupil", PartKind::kEye},          KindWord{"cornea", PartKind::kEye},
    KindWord{"lacrimal", PartKind::kEye},       KindWord{"tearline", PartKind::kEye},
    KindWord{"hair", PartKind::kHair},          KindWord{"beard", PartKind::kSkin},
    KindWord{"headwear", PartKind::kOther},     KindWord{"outfit", PartKind::kOther},
    KindWord{"footwear", PartKind::kOther},     KindWord{"shoe", PartKind::kOther},
    KindWord{"cloth", PartKind::kOther},        KindWord{"shirt", PartKind::kOther},
    KindWord{"suit", PartKind::kOther},         KindWord{"pants", PartKind::kOther},
    KindWord{"glasses", PartKind::kOther},      KindWord{"toenail", PartKind::kOther},
    KindWord{"fingernail", PartKind::kOther},   KindWord{"std_nails", PartKind::kOther},
    KindWord{"face", PartKind::kSkin},          KindWord{"skin", PartKind::kSkin},
    KindWord{"head", PartKind::kSkin},          KindWord{"body", PartKind::kSkin},
};

/// What gums that come with the tongue are called once they are told apart, in the order of GumPiece; files may come
/// back with such names.
const std::array<std::pair<std::string, PartKind>, 3> kGumParts{
    {{".upper_gum", PartKind::kUpperTeeth}, {".lower_gum", PartKind::kLowerTeeth}, {".tongue", PartKind::kTongue}}};

/// Words of hair that is rooted in the skin (MeshPart::stands_off).
constexpr std::array<std::string_view, 8> kRootedHair{"lash",      "brow",     "beard",   "eyeline",
                                                      "moustache", "mustache", "whisker", "schnurrbart"};

constexpr float kMoved = 0.1F;    ///< of the furthest move of a mouth's shape: what counts as moved
constexpr double kWholly = 0.95;  ///< of a part's corners: what hangs on one kind of bone

bool contains(std::string_view text, std::string_view word) { return text.find(word) != std::string_view::npos; }

/// Materials that say nothing of their own colour look like what they are; gums are no teeth to look at.
std::array<float, 4> colorOf(PartKind kind, std::string_view name) {
  const bool is_of_teeth = kind == PartKind::kUpperTeeth || kind == PartKind::kLowerTeeth;
  if (is_of_teeth && contains(lowerCase(name), "gum")) return {0.25F, 0.06F, 0.06F, 1.0F};
  switch (kind) {
    case PartKind::kLips:
      return {0.55F, 0.22F, 0.19F, 1.0F};
    case PartKind::kUpperTeeth:
    case PartKind::kLowerTeeth:
      return {0.85F, 0.81F, 0.72F, 1.0F};
    case PartKind::kTongue:
      return {0.55F, 0.19F, 0.18F, 1.0F};
    case PartKind::kMouthInside:
      return {0.12F, 0.03F, 0.03F, 1.0F};
    case PartKind::kEye:
      return {0.85F, 0.85F, 0.85F, 1.0F};
    case PartKind::kHair:
      return {0.08F, 0.05F, 0.03F, 1.0F};
    case PartKind::kOther:
      return {0.4F, 0.4F, 0.4F, 1.0F};
    case PartKind::kSkin:
      break;
  }
  return {0.60F, 0.36F, 0.26F, 1.0F};
}

/// Sets of vertices that triangles join; vertices at the same place count as one (seams split them).
class Islands {
 public:
  Islands(const FaceMesh& mesh, std::span<const Triangle> triangles) : sets_(mesh.vertexCount()) {
    std::map<std::array<float, 3>, std::uint32_t> first_at;
    for (const Triangle& triangle : triangles) {
      for (const std::uint32_t vertex : triangle) {
        const auto point = mesh.vertices.row(vertex);
        sets_.union_set(first_at.try_emplace({point[0], point[1], point[2]}, vertex).first->second, vertex);
        sets_.union_set(triangle[0], vertex);
      }
    }
  }
  std::size_t islandOf(std::uint32_t vertex) { return sets_.find_set(vertex); }

 private:
  boost::disjoint_sets_with_storage<> sets_;
};

/// An island of teeth: its middle, and how many triangles it weighs.
struct ToothIsland {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double count = 0;
  double jaw_move = 0;  ///< the mean of VertexEvidence::jaw_moves
};

/// Two rows of a few heights, by two-means; nullopt when one is empty.
struct Rows {
  std::vector<bool> is_upper;
  double within = 0;   ///< squared distances from the rows' own means
  double between = 0;  ///< squared distance of the two means
};
std::optional<Rows> rowsOf(const std::vector<double>& heights, const std::vector<ToothIsland>& islands) {
  auto [low, high] =
      std::pair{*std::min_element(heights.begin(), heights.end()), *std::max_element(heights.begin(), heights.end())};
  constexpr int kIterations = 20;
  for (int i = 0; i < kIterations; ++i) {
    std::array<double, 2> sums{}, counts{};
    for (std::size_t k = 0; k < heights.size(); ++k) {
      const std::size_t side = std::abs(heights[k] - high) < std::abs(heights[k] - low) ? 1 : 0;
      sums[side] += heights[k] * islands[k].count;
      counts[side] += islands[k].count;
    }
    if (counts[0] == 0 || counts[1] == 0) return std::nullopt;
    low = sums[0] / counts[0];
    high = sums[1] / counts[1];
  }
  Rows rows;
  rows.between = (high - low) * (high - low);
  for (std::size_t k = 0; k < heights.size(); ++k) {
    const double away_high = std::abs(heights[k] - high), away_low = std::abs(heights[k] - low);
    rows.is_upper.push_back(away_high < away_low);
    rows.within += islands[k].count * std::pow(std::min(away_high, away_low), 2);
  }
  return rows;
}

/// The rows by the plane in which they bite: it may fall or rise to the back, where a lower molar can stand higher than
/// an upper incisor, but not to a side, so both sides come out alike. Of some tilts the one that parts the rows best.
std::optional<Rows> rowsOf(const std::vector<ToothIsland>& islands) {
  constexpr std::array kTilts{0.0, -0.1, 0.1, -0.2, 0.2, -0.3, 0.3, -0.45, 0.45, -0.6, 0.6};
  std::optional<Rows> best;
  for (const double tilt : kTilts) {
    std::vector<double> heights;
    for (const ToothIsland& island : islands) heights.push_back(island.middle.y() - tilt * island.middle.z());
    auto rows = rowsOf(heights, islands);
    if (rows && (!best || rows->between * best->within > 1.2 * best->between * rows->within)) best = std::move(rows);
  }
  return best;
}

/// Which of the teeth's triangles are the upper ones: by the shape that opens the jaw where there is one, else by
/// where the islands lie. One island, or islands of one height only: nullopt.
std::optional<std::vector<bool>> upperTriangles(const FaceMesh& mesh, std::span<const Triangle> triangles,
                                                const VertexEvidence& evidence) {
  Islands islands(mesh, triangles);
  std::map<std::size_t, ToothIsland> sums;
  for (const Triangle& triangle : triangles) {
    ToothIsland& sum = sums[islands.islandOf(triangle[0])];
    sum.middle += centroid(mesh, triangle).cast<double>();
    sum.count += 1;
    if (!evidence.jaw_moves.empty()) sum.jaw_move += static_cast<double>(evidence.jaw_moves[triangle[0]]);
  }
  if (sums.size() < 2) return std::nullopt;
  std::vector<ToothIsland> list;
  double furthest = 0;
  for (auto& [island, sum] : sums) {
    sum.middle /= sum.count;
    sum.jaw_move /= sum.count;
    furthest = std::max(furthest, sum.jaw_move);
    list.push_back(sum);
  }
  std::vector<bool> of_island;
  constexpr double kRides = 0.5;  // of the furthest: an island that the jaw carries
  for (const ToothIsland& island : list) of_island.push_back(island.jaw_move < kRides * furthest);
  const bool jaw_tells = furthest > 0 && std::find(of_island.begin(), of_island.end(), true) != of_island.end();
  if (!jaw_tells) {
    const auto rows = rowsOf(list);
    if (!rows) return std::nullopt;
    of_island = rows->is_upper;
  }
  std::map<std::size_t, bool> is_island_upper;
  std::size_t next = 0;
  for (const auto& [island, sum] : sums) is_island_upper[island] = of_island[next++];
  std::vector<bool> is_upper;
  is_upper.reserve(triangles.size());
  for (const Triangle& triangle : triangles) is_upper.push_back(is_island_upper[islands.islandOf(triangle[0])]);
  return is_upper;
}

/// Rewrites `part` of `mesh` as up to kinds.size() parts with the names and kinds given; `choice` says which a triangle
/// joins.
std::vector<MeshPart> splitPart(FaceMesh& mesh, const MeshPart& part, const std::vector<std::size_t>& choice,
                                std::span<const std::pair<std::string, PartKind>> kinds) {
  const std::vector<Triangle> old(trianglesOf(mesh, part).begin(), trianglesOf(mesh, part).end());
  std::vector<MeshPart> parts;
  std::size_t at = part.first_triangle;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    MeshPart piece = part;
    piece.name = part.name + kinds[k].first;
    piece.kind = kinds[k].second;
    piece.first_triangle = at;
    for (std::size_t i = 0; i < old.size(); ++i) {
      if (choice[i] == k) mesh.triangles[at++] = old[i];
    }
    piece.triangle_count = at - piece.first_triangle;
    if (piece.triangle_count > 0) parts.push_back(piece);
  }
  return parts;
}

/// Gums and tongue in one piece: which of kUpperTeeth, kLowerTeeth and kTongue each triangle is.
std::vector<std::size_t> gumPieces(const FaceMesh& mesh, const MeshPart& gums, const std::vector<MeshPart>& teeth) {
  std::array<std::vector<Triangle>, 2> rows;
  for (const MeshPart& part : teeth) {
    const std::span<const Triangle> own = trianglesOf(mesh, part);
    std::vector<Triangle>& row = rows[part.kind == PartKind::kUpperTeeth ? 0 : 1];
    row.insert(row.end(), own.begin(), own.end());
  }
  std::vector<std::size_t> choice;
  for (const GumPiece piece : splitGums(mesh, trianglesOf(mesh, gums), rows[0], rows[1]))
    choice.push_back(static_cast<std::size_t>(piece));
  return choice;
}

void appendSplitTeeth(FaceMesh& mesh, const MeshPart& part, const VertexEvidence& evidence,
                      std::vector<MeshPart>& parts) {
  const std::string name = lowerCase(part.name);
  // As a word of its own: "_lo" also begins "_lod0".
  const auto has_word = [&](std::string_view word) {
    const std::size_t at = name.find(word);
    return at != std::string::npos &&
           (at + word.size() == name.size() || name[at + word.size()] < 'a' || name[at + word.size()] > 'z');
  };
  const bool says_upper = contains(name, "upper") || has_word("_up") || contains(name, "top");
  const bool says_lower = contains(name, "lower") || has_word("_lo") || contains(name, "bottom");
  const auto upper = says_upper != says_lower ? std::nullopt : upperTriangles(mesh, trianglesOf(mesh, part), evidence);
  if (!upper) {
    parts.push_back(part);
    parts.back().kind = says_lower ? PartKind::kLowerTeeth : PartKind::kUpperTeeth;
    return;
  }
  std::vector<std::size_t> choice;
  for (const bool is_upper : *upper) choice.push_back(is_upper ? 0 : 1);
  const std::array<std::pair<std::string, PartKind>, 2> kinds{
      {{".upper", PartKind::kUpperTeeth}, {".lower", PartKind::kLowerTeeth}}};
  for (MeshPart& piece : splitPart(mesh, part, choice, kinds)) parts.push_back(std::move(piece));
}

Eigen::AlignedBox3d boxOf(const FaceMesh& mesh, std::span<const Triangle> triangles) {
  Eigen::AlignedBox3d box;
  for (const Triangle& triangle : triangles) box.extend(centroid(mesh, triangle).cast<double>());
  return box;
}

/// Heads often come with the mouth's bag under the skin's material: an island of its own around the teeth.
void appendSplitMouthBag(FaceMesh& mesh, const MeshPart& part, const Eigen::AlignedBox3d& teeth,
                         std::vector<MeshPart>& parts) {
  constexpr double kBagOverTeeth = 2.5;  // a bag is at most so much larger than the teeth in it
  Islands islands(mesh, trianglesOf(mesh, part));
  std::map<std::size_t, Eigen::AlignedBox3d> boxes;
  for (const Triangle& triangle : trianglesOf(mesh, part))
    boxes[islands.islandOf(triangle[0])].extend(centroid(mesh, triangle).cast<double>());
  std::vector<std::size_t> choice;
  bool has_bag = false;
  for (const Triangle& triangle : trianglesOf(mesh, part)) {
    const Eigen::AlignedBox3d& box = boxes[islands.islandOf(triangle[0])];
    const bool is_bag = boxes.size() > 1 && box.contains(teeth.center()) &&
                        box.diagonal().norm() < kBagOverTeeth * teeth.diagonal().norm();
    has_bag = has_bag || is_bag;
    choice.push_back(is_bag ? 1 : 0);
  }
  if (!has_bag) return parts.push_back(part);
  const std::array<std::pair<std::string, PartKind>, 2> kinds{
      {{"", PartKind::kSkin}, {".mouth", PartKind::kMouthInside}}};
  for (MeshPart& piece : splitPart(mesh, part, choice, kinds)) parts.push_back(std::move(piece));
}

/// Parts of their own for what lies in a head without telling names.
void takeInnerParts(FaceMesh& mesh) {
  const std::vector<std::vector<InnerKind>> found = innerKinds(mesh, mesh.parts);
  const std::array<std::pair<std::string, PartKind>, 5> kinds{{{"", PartKind::kSkin},
                                                               {".eye", PartKind::kEye},
                                                               {".teeth", PartKind::kUpperTeeth},
                                                               {".tongue", PartKind::kTongue},
                                                               {".gums_tongue", PartKind::kTongue}}};
  std::vector<MeshPart> parts;
  for (std::size_t p = 0; p < found.size(); ++p) {
    std::vector<std::size_t> choice;
    for (const InnerKind kind : found[p]) choice.push_back(static_cast<std::size_t>(kind));
    if (std::all_of(choice.begin(), choice.end(), [](std::size_t k) { return k == 0; })) {
      parts.push_back(mesh.parts[p]);
    } else {
      for (MeshPart& piece : splitPart(mesh, mesh.parts[p], choice, kinds)) parts.push_back(std::move(piece));
    }
  }
  if (!found.empty()) mesh.parts = std::move(parts);
}

/// What bones and shapes tell of a part, as shares of its triangles' corners.
struct PartEvidence {
  std::array<double, 6> bones{};  ///< by BoneRole
  double moved = 0;               ///< that shapes of the mouth move
  double moved_corners = 0;       ///< how many those are
  [[nodiscard]] double share(BoneRole role) const { return bones[static_cast<std::size_t>(role)]; }
};

PartEvidence evidenceOf(const FaceMesh& mesh, const MeshPart& part, const VertexEvidence& evidence, float far) {
  PartEvidence found;
  for (const Triangle& triangle : trianglesOf(mesh, part)) {
    for (const std::uint32_t v : triangle) {
      if (!evidence.bones.empty()) found.bones[static_cast<std::size_t>(evidence.bones[v])] += 1;
      if (!evidence.mouth_moves.empty() && far > 0 && evidence.mouth_moves[v] > kMoved * far) found.moved_corners += 1;
    }
  }
  const double corners = std::max(1.0, 3 * asReal(part.triangle_count));
  for (double& share : found.bones) share /= corners;
  found.moved = found.moved_corners / corners;
  return found;
}

/// Kinds that bones and shapes tell better than names do.
void judgeByEvidence(const FaceMesh& mesh, const VertexEvidence& evidence, std::vector<MeshPart>& parts) {
  float far = 0;
  for (const float move : evidence.mouth_moves) far = std::max(far, move);
  std::vector<PartEvidence> found;
  bool has_head = false;
  for (const MeshPart& part : parts) {
    found.push_back(evidenceOf(mesh, part, evidence, far));
    has_head = has_head || found.back().share(BoneRole::kHead) > 0.5;
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    PartKind& kind = parts[p].kind;
    const bool is_surface = isSkin(kind) || kind == PartKind::kMouthInside;
    if (found[p].share(BoneRole::kEye) > kWholly && is_surface && !parts[p].stands_off) kind = PartKind::kEye;
    if (found[p].share(BoneRole::kHair) > kWholly && is_surface) kind = PartKind::kHair;
    // Shoes and gloves are no face, whatever they are called; a neck in one piece with its head is.
    if (has_head && found[p].share(BoneRole::kBody) > kWholly && isSkin(kind) && found[p].moved == 0)
      kind = PartKind::kOther;
  }
  // What the head's own shapes of the mouth move most of is its skin, whatever it is called.
  const auto most = std::max_element(found.begin(), found.end(), [](const PartEvidence& a, const PartEvidence& b) {
    return a.moved_corners < b.moved_corners;
  });
  if (most == found.end() || most->moved_corners == 0) return;
  const auto moved_skin = std::find_if(parts.begin(), parts.end(), [&](const MeshPart& part) {
    return isSkin(part.kind) && !part.stands_off && found[unsignedIndex(&part - parts.data())].moved_corners > 0;
  });
  if (moved_skin == parts.end()) {
    MeshPart& skin = parts[unsignedIndex(most - found.begin())];
    skin.kind = PartKind::kSkin;
    skin.stands_off = false;
  }
}

}  // namespace

std::optional<PartKind> kindFromName(std::string_view name) {
  const std::string lower = lowerCase(name);
  for (const auto& [ending, kind] : kGumParts) {
    if (lower.ends_with(ending)) return kind;
  }
  for (const KindWord& entry : kKindWords) {
    if (contains(lower, entry.word)) return entry.kind;
  }
  return std::nullopt;
}

void assignPartKinds(FaceMesh& mesh, bool keep_colors, const VertexEvidence& evidence) {
  for (MeshPart& part : mesh.parts) {
    part.kind = kindFromName(part.name).value_or(PartKind::kSkin);
    const std::string lower = lowerCase(part.name);
    part.stands_off = std::any_of(kRootedHair.begin(), kRootedHair.end(),
                                  [&](std::string_view word) { return contains(lower, word); });
  }
  judgeByEvidence(mesh, evidence, mesh.parts);
  takeInnerParts(mesh);
  std::vector<MeshPart> parts;
  std::vector<MeshPart> gums_with_tongue;
  for (const MeshPart& part : mesh.parts) {
    const std::string name = lowerCase(part.name);
    if (part.kind == PartKind::kTongue && contains(name, "gum") && !name.ends_with(".tongue")) {
      gums_with_tongue.push_back(part);
    } else if (part.kind == PartKind::kUpperTeeth) {
      appendSplitTeeth(mesh, part, evidence, parts);
    } else {
      parts.push_back(part);
    }
  }
  std::vector<MeshPart> teeth;
  for (const MeshPart& part : parts) {
    if (part.kind == PartKind::kUpperTeeth || part.kind == PartKind::kLowerTeeth) teeth.push_back(part);
  }
  for (const MeshPart& part : gums_with_tongue) {
    if (teeth.empty()) {
      parts.push_back(part);
      continue;
    }
    for (MeshPart& piece : splitPart(mesh, part, gumPieces(mesh, part, teeth), kGumParts))
      parts.push_back(std::move(piece));
  }
  const bool has_bag =
      std::any_of(parts.begin(), parts.end(), [](const MeshPart& part) { return part.kind == PartKind::kMouthInside; });
  if (!teeth.empty() && !has_bag) {
    Eigen::AlignedBox3d teeth_box;
    for (const MeshPart& part : teeth) teeth_box.extend(boxOf(mesh, trianglesOf(mesh, part)));
    std::vector<MeshPart> split;
    for (const MeshPart& part : parts) {
      if (part.kind == PartKind::kSkin)
        appendSplitMouthBag(mesh, part, teeth_box, split);
      else
        split.push_back(part);
    }
    parts = std::move(split);
  }
  std::sort(parts.begin(), parts.end(),
            [](const MeshPart& a, const MeshPart& b) { return a.first_triangle < b.first_triangle; });
  for (MeshPart& part : parts) {
    if (keep_colors) break;
    part.base_color = mesh.vertex_colors.empty() ? colorOf(part.kind, part.name) : std::array<float, 4>{1, 1, 1, 1};
    const bool wet =
        part.kind == PartKind::kEye || part.kind == PartKind::kUpperTeeth || part.kind == PartKind::kLowerTeeth;
    part.roughness = wet ? 0.25F : part.kind == PartKind::kTongue || part.kind == PartKind::kLips ? 0.4F : 0.6F;
  }
  mesh.parts = std::move(parts);
}

FaceMesh finishMesh(MeshSoup soup, std::string_view file) {
  if (soup.triangles.empty()) throw InputError(file, "", "found no faces; expected a surface of triangles or polygons");
  if (soup.parts.empty()) soup.parts.push_back(MeshPart{});
  FaceMesh mesh;
  mesh.metres_per_unit = soup.metres_per_unit;
  const std::size_t vertices = soup.vertexCount();
  mesh.vertices = Eigen::Map<const VertexPositions>(soup.positions.data(), signedIndex(vertices), 3);
  mesh.vertex_colors = std::move(soup.vertex_colors);
  mesh.texture_coordinates = std::move(soup.texture_coordinates);
  if (!mesh.texture_coordinates.empty()) mesh.texture_coordinates.resize(vertices, std::array<float, 2>{0.0F, 0.0F});

  std::vector<std::size_t> next(soup.parts.size() + 1, 0);
  for (const std::uint32_t part : soup.part_of_triangle) ++next[part + 1];
  for (std::size_t p = 0; p < soup.parts.size(); ++p) {
    soup.parts[p].triangle_count = next[p + 1];
    next[p + 1] += next[p];
    soup.parts[p].first_triangle = next[p];
  }
  mesh.triangles.resize(soup.triangles.size());
  for (std::size_t i = 0; i < soup.triangles.size(); ++i)
    mesh.triangles[next[soup.part_of_triangle[i]]++] = soup.triangles[i];
  for (MeshPart& part : soup.parts) {
    if (part.triangle_count > 0) mesh.parts.push_back(std::move(part));
  }
  assignPartKinds(mesh, soup.has_colors, soup.evidence);
  return mesh;
}

}  // namespace mouthpiece
