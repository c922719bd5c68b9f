#include "heads/head_changes.h"

#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_ratio_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <queue>

#include "deform/mesh/triangle_tree.h"

namespace mouthpiece::test {
namespace pmp = CGAL::Polygon_mesh_processing;
using Eigen::Vector3d;

constexpr double kJitterMm = 2;
constexpr double kClickDepthMm = 6;  ///< a click that lands further before or behind its place is on another part

void setScale(ClickedHead& head) {
  head.mm_per_unit = kMouthMm / (clickOf(head, "LIP_CORNER_L") - clickOf(head, "LIP_CORNER_R")).norm();
}

/// Moves vertices and clicks alike.
static void bend(ClickedHead& head, const std::function<Vector3d(const Vector3d&)>& moved) {
  for (Eigen::Index v = 0; v < head.mesh.vertices.rows(); ++v)
    head.mesh.vertices.row(v) = moved(pointAt(head.mesh.vertices, v)).transpose().cast<float>();
  for (auto& [name, place] : head.clicks.markers) place = moved(std::get<Vector3d>(place));
}

void shape(ClickedHead& head, Chance& chance) {
  const double mm = 1 / head.mm_per_unit;
  const Vector3d middle = 0.5 * (clickOf(head, "LIP_CORNER_R") + clickOf(head, "LIP_CORNER_L"));
  const Vector3d size(chance.number(0.88, 1.15), chance.number(0.88, 1.15), chance.number(0.85, 1.2));
  struct Lump {
    Vector3d at, move;
    double reach;
  };
  std::vector<Lump> lumps;
  for (int i = 0; i < 12; ++i)
    lumps.push_back({middle + mm * Vector3d(chance.number(-60, 60), chance.number(-50, 90), chance.number(-40, 20)),
                     chance.vector(3.5 * mm), chance.number(18, 45) * mm});
  const double thicker = chance.number(-0.3, 0.5), upper_corner = chance.number(-3.5, 3.5) * mm,
               askew = chance.number(-1.5, 1.5) * mm;
  const double half = 0.5 * kMouthMm * mm, lip = 9 * mm;
  const Vector3d upper = clickOf(head, "LIP_UP_MID"), lower = clickOf(head, "LIP_LO_MID");
  const double line = 0.55 * upper.y() + 0.45 * lower.y();
  bend(head, [&](const Vector3d& p) -> Vector3d {
    Vector3d q = p;
    const double across = (p.x() - middle.x()) / half, height = (p.y() - line) / lip,
                 depth = (p.z() - upper.z()) / (4 * lip);
    const double near = std::exp(-0.5 * (across * across + height * height + depth * depth));
    q.y() += thicker * (p.y() - line) * near;
    q.y() += (upper_corner * std::min(across * across, 2.0) + askew * across) *
             std::exp(-0.5 * (height * height / 4 + depth * depth)) * std::exp(-0.5 * across * across / 2);
    for (const Lump& lump : lumps)
      q += lump.move * std::exp(-0.5 * (p - lump.at).squaredNorm() / (lump.reach * lump.reach));
    return middle + size.cwiseProduct(q - middle);
  });
  head.changes += fmt::format("size {:.2f} {:.2f} {:.2f}, lips {:+.0f} %, corners {:+.1f} mm", size.x(), size.y(),
                              size.z(), 100 * thicker, upper_corner / mm);
}

namespace {

/// How much a place belongs to what lies around `at`: 1 there, less from `reach` on.
double nearness(const Vector3d& p, const Vector3d& at, double reach) {
  return std::exp(-0.5 * (p - at).squaredNorm() / (reach * reach));
}

/// `p` drawn away from `at` by `scale` in each direction, less the further it is.
Vector3d stretched(const Vector3d& p, const Vector3d& at, double reach, const Vector3d& scale) {
  return p + nearness(p, at, reach) * (scale - Vector3d::Ones()).cwiseProduct(p - at);
}

/// From 0 far below `from` to 1 far above it.
double above(double value, double from, double width) { return 1 / (1 + std::exp(-(value - from) / width)); }

struct Style {
  const char* name;
  std::function<Vector3d(const Vector3d&)> moved;
};

/// `amount`: up to 1. All are maps of space that fold nothing over.
Style styleOf(const ClickedHead& head, int number, double amount) {
  const Vector3d mouth = 0.5 * (clickOf(head, "LIP_UP_MID") + clickOf(head, "LIP_LO_MID"));
  const Vector3d nose = clickOf(head, "NOSE_TIP"), chin = clickOf(head, "CHIN_LOW");
  const double wide = (clickOf(head, "LIP_CORNER_L") - clickOf(head, "LIP_CORNER_R")).norm(), a = amount;
  std::array<Vector3d, 2> eyes;  // as they are: the clicks are moved, too
  for (std::size_t i = 0; i < eyes.size(); ++i) {
    const std::string side = i == 0 ? "_R" : "_L";
    eyes[i] = 0.5 * (clickOf(head, "CANTHUS_OUT" + side) + clickOf(head, "EYE_IN" + side));
  }
  const auto curved = [=](double way) {
    return [=](const Vector3d& p) -> Vector3d {
      const double across = std::min(std::abs(p.x() - mouth.x()) / (0.5 * wide), 1.5);
      return p + Vector3d(0, way * wide * nearness(p, mouth, 0.9 * wide) * (across * across - 0.4), 0);
    };
  };
  switch (number) {
    case 0:
      return {"small mouth, flat nose, large eyes", [=](const Vector3d& p) {
                Vector3d q = stretched(p, mouth, 1.1 * wide, {1 - 0.5 * a, 1 - 0.2 * a, 1});
                q.z() -= 0.35 * a * wide * nearness(p, nose, 0.45 * wide);
                for (const Vector3d& eye : eyes) q = stretched(q, eye, 0.6 * wide, {1 + 0.35 * a, 1 + 0.6 * a, 1});
                return q;
              }};
    case 1:
      return {"wide mouth", [=](const Vector3d& p) {
                return stretched(p, mouth, 1.2 * wide, {1 + 0.6 * a, 1 - 0.2 * a, 1});
              }};
    case 2:
      return {"thick lips", [=](const Vector3d& p) {
                return stretched(p, mouth, 0.55 * wide, {1 + 0.1 * a, 1 + 0.9 * a, 1 + 0.35 * a});
              }};
    case 3:
      return {"muzzle", [=](const Vector3d& p) -> Vector3d {
                return p + Vector3d(0, 0, 0.7 * a * wide * nearness(p, mouth, 0.8 * wide));
              }};
    case 4:
      return {"long chin", [=](const Vector3d& p) -> Vector3d {
                return p - Vector3d(0, 0.5 * a * std::clamp(nose.y() - p.y(), 0.0, 1.6 * wide), 0);
              }};
    case 5:
      return {"broad as a toad", [=](const Vector3d& p) {
                const Vector3d q = mouth + Vector3d(1 + 0.4 * a, 1 - 0.25 * a, 1).cwiseProduct(p - mouth);
                return stretched(q, mouth, 1.7 * wide, {1 + 0.3 * a, 1, 1});
              }};
    case 6:
      return {"baby", [=](const Vector3d& p) -> Vector3d {
                return nose + (1 - 0.3 * a + 0.5 * a * above(p.y(), nose.y(), 0.5 * wide)) * (p - nose);
              }};
    case 7:
      return {"crooked mouth", [=](const Vector3d& p) -> Vector3d {
                const double turn = 0.28 * a * nearness(p, mouth, wide);
                return mouth + Eigen::AngleAxisd(turn, Vector3d::UnitZ()) * (p - mouth);
              }};
    case 8:
      return {"underbite", [=](const Vector3d& p) -> Vector3d {
                const double share =
                    above(-p.y(), -mouth.y(), 0.25 * wide) * nearness(p, 0.5 * (mouth + chin), 0.9 * wide);
                return p + Vector3d(0, 0, 0.25 * a * wide * share);
              }};
    case 9:
      return {"flat face", [=](const Vector3d& p) -> Vector3d {
                const double depth = 1.2 * wide, behind = mouth.z() - depth, in = (p.z() - behind) / depth;
                return {p.x(), p.y(), in > 0 ? behind + depth * ((1 - a) * in + a * std::tanh(0.7 * in)) : p.z()};
              }};
    case 10:
      return {"smile", curved(0.22 * a)};
    default:
      return {"frown", curved(-0.22 * a)};
  }
}

}  // namespace

void stylise(ClickedHead& head, int style, double amount) {
  const Style own = styleOf(head, style, amount);
  bend(head, own.moved);
  setScale(head);
  head.changes += fmt::format("{} {:.0f} %", own.name, 100 * amount);
}

void openMouth(ClickedHead& head, double open_mm) {
  const FaceMesh& mesh = head.mesh;
  const double unit = 1 / head.mm_per_unit;
  std::vector<std::vector<std::pair<std::uint32_t, double>>> beside(mesh.vertexCount());
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      const double length = (pointAt(mesh.vertices, a) - pointAt(mesh.vertices, b)).norm();
      beside[a].emplace_back(b, length);
      beside[b].emplace_back(a, length);
    }
  }
  const auto waysFrom = [&](const Vector3d& place) {
    Eigen::Index start = 0;
    (mesh.vertices.rowwise() - place.transpose().cast<float>()).rowwise().squaredNorm().minCoeff(&start);
    std::vector<double> ways(mesh.vertexCount(), std::numeric_limits<double>::infinity());
    using Entry = std::pair<double, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    ways[unsignedIndex(start)] = 0;
    queue.emplace(0.0, static_cast<std::uint32_t>(start));
    while (!queue.empty()) {
      const auto [way, v] = queue.top();
      queue.pop();
      if (way > ways[v]) continue;
      for (const auto& [to, length] : beside[v]) {
        if (way + length >= ways[to]) continue;
        ways[to] = way + length;
        queue.emplace(ways[to], to);
      }
    }
    return ways;
  };
  const Vector3d upper = clickOf(head, "LIP_UP_MID"), lower = clickOf(head, "LIP_LO_MID");
  const Vector3d middle = 0.5 * (clickOf(head, "LIP_CORNER_R") + clickOf(head, "LIP_CORNER_L"));
  const std::vector<double> from_upper = waysFrom(upper), from_lower = waysFrom(lower);
  const auto down = [&](const Vector3d& p, double share) -> Vector3d {
    const double across = (p.x() - middle.x()) / (0.5 * kMouthMm * unit), under = (lower.y() - p.y()) / (30 * unit),
                 behind = (lower.z() - p.z()) / (60 * unit);
    const double bow = std::max(0.0, 1 - across * across);
    return Vector3d(0, -open_mm * unit * share * bow * std::exp(-std::max(0.0, under) - std::max(0.0, behind)), 0);
  };
  for (std::uint32_t v = 0; v < from_upper.size(); ++v) {
    if (!std::isfinite(from_upper[v]) || !std::isfinite(from_lower[v])) continue;
    const double nearer = from_upper[v] / std::max(from_upper[v] + from_lower[v], 1e-12);
    const double share = std::clamp(2 * (nearer - 0.5) + 0.5, 0.0, 1.0);
    const Vector3d move = down(pointAt(mesh.vertices, v), share * share * (3 - 2 * share));
    head.mesh.vertices.row(v) += move.transpose().cast<float>();
  }
  for (const char* name : {"LIP_LO_MID", "CHIN_LOW"}) {
    auto& place = std::get<Vector3d>(head.clicks.markers.at(name));
    place += down(place, 1);
  }
  head.changes += fmt::format(", open by {:.1f} mm", open_mm);
}

static bool isSkinPart(const MeshPart& part) { return isSkin(part.kind) || part.kind == PartKind::kMouthInside; }

void changeSkin(ClickedHead& head, const std::function<void(SkinSurface&)>& change) {
  const FaceMesh& mesh = head.mesh;
  std::vector<SkinSurface::Point> points;
  std::vector<std::vector<std::size_t>> faces;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Vector3d p = pointAt(mesh.vertices, v);
    points.emplace_back(p.x(), p.y(), p.z());
  }
  std::vector<Triangle> others;
  std::vector<MeshPart> other_parts;
  for (const MeshPart& part : mesh.parts) {
    const auto own = trianglesOf(mesh, part);
    if (isSkinPart(part)) {
      for (const Triangle& t : own) faces.push_back({t[0], t[1], t[2]});
    } else {
      other_parts.push_back(part);
      others.insert(others.end(), own.begin(), own.end());
    }
  }
  pmp::orient_polygon_soup(points, faces);
  SkinSurface surface;
  pmp::polygon_soup_to_polygon_mesh(points, faces, surface);
  change(surface);
  surface.collect_garbage();
  FaceMesh made;
  made.metres_per_unit = mesh.metres_per_unit;
  const auto skin_vertices = static_cast<Eigen::Index>(surface.number_of_vertices());
  made.vertices.resize(skin_vertices + mesh.vertices.rows(), 3);
  for (const auto v : surface.vertices()) {
    const auto& p = surface.point(v);
    made.vertices.row(static_cast<Eigen::Index>(v.idx())) << static_cast<float>(p.x()), static_cast<float>(p.y()),
        static_cast<float>(p.z());
  }
  for (const auto f : surface.faces()) {
    Triangle t{};
    std::size_t k = 0;
    for (const auto v : surface.vertices_around_face(surface.halfedge(f))) t[k++ % 3] = v.idx();
    made.triangles.push_back(t);
  }
  made.parts.push_back({.name = "skin", .kind = PartKind::kSkin, .triangle_count = made.triangles.size()});
  made.vertices.bottomRows(mesh.vertices.rows()) = mesh.vertices;
  for (Triangle t : others) {
    for (std::uint32_t& v : t) v += static_cast<std::uint32_t>(skin_vertices);
    made.triangles.push_back(t);
  }
  std::size_t first = made.parts[0].triangle_count;
  for (MeshPart part : other_parts) {
    part.first_triangle = first;
    first += part.triangle_count;
    made.parts.push_back(part);
  }
  // Vertices that no triangle uses any more go.
  std::vector<std::int64_t> number(made.vertexCount(), -1);
  std::vector<Eigen::Index> kept;
  for (Triangle& t : made.triangles) {
    for (std::uint32_t& v : t) {
      if (number[v] < 0) {
        number[v] = static_cast<std::int64_t>(kept.size());
        kept.push_back(v);
      }
      v = static_cast<std::uint32_t>(number[v]);
    }
  }
  made.vertices = VertexPositions(made.vertices(kept, Eigen::all));
  head.mesh = std::move(made);
}

void remesh(ClickedHead& head, double edge_mm) {
  changeSkin(head, [&](SkinSurface& surface) {
    pmp::isotropic_remeshing(surface.faces(), edge_mm / head.mm_per_unit, surface,
                             CGAL::parameters::number_of_iterations(2).protect_constraints(false));
  });
  head.changes += fmt::format(", remeshed to {:.1f} mm", edge_mm);
}

void decimate(ClickedHead& head, double share) {
  changeSkin(head, [&](SkinSurface& surface) {
    CGAL::Surface_mesh_simplification::edge_collapse(
        surface, CGAL::Surface_mesh_simplification::Count_ratio_stop_predicate<SkinSurface>(share));
  });
  head.changes += fmt::format(", decimated to {}", head.mesh.triangles.size());
}

void subdivide(ClickedHead& head) {
  FaceMesh& mesh = head.mesh;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  std::vector<Eigen::RowVector3f> added;
  const auto old = static_cast<std::uint32_t>(mesh.vertexCount());
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), old + static_cast<std::uint32_t>(added.size()));
    if (is_new) added.push_back(0.5F * (mesh.vertices.row(a) + mesh.vertices.row(b)));
    return at->second;
  };
  std::vector<Triangle> triangles;
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const Triangle& t : {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}})
      triangles.push_back(t);
  }
  mesh.vertices.conservativeResize(old + signedIndex(added.size()), Eigen::NoChange);
  for (std::size_t i = 0; i < added.size(); ++i) mesh.vertices.row(old + signedIndex(i)) = added[i];
  mesh.triangles = std::move(triangles);
  mesh.texture_coordinates.clear();
  mesh.vertex_colors.clear();
  for (MeshPart& part : mesh.parts) {
    part.first_triangle *= 4;
    part.triangle_count *= 4;
  }
  head.changes += ", subdivided";
}

void unweld(ClickedHead& head) {
  FaceMesh& mesh = head.mesh;
  VertexPositions apart(signedIndex(3 * mesh.triangles.size()), 3);
  std::uint32_t next = 0;
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) {
      apart.row(next) = mesh.vertices.row(v);
      v = next++;
    }
  }
  mesh.vertices = std::move(apart);
  mesh.texture_coordinates.clear();
  mesh.vertex_colors.clear();
  head.changes += ", every triangle apart";
}

void addNoise(ClickedHead& head, Chance& chance, double most_mm) {
  const VertexPositions normals = vertexNormals(head.mesh.vertices, head.mesh.triangles);
  std::map<std::array<float, 3>, float> by_place;  // vertices in one place stay there
  for (Eigen::Index v = 0; v < normals.rows(); ++v) {
    auto row = head.mesh.vertices.row(v);
    const auto at = by_place.try_emplace({row[0], row[1], row[2]},
                                         static_cast<float>(chance.number(-most_mm, most_mm) / head.mm_per_unit));
    row += at.first->second * normals.row(v);
  }
  head.changes += fmt::format(", noise {:.2f} mm", most_mm);
}

void jitter(ClickedHead& head, Chance& chance) {
  const double mm = 1 / head.mm_per_unit;
  // The tree looks along y: the head lies on its back for it.
  VertexPositions lying(head.mesh.vertices.rows(), 3);
  lying.col(0) = head.mesh.vertices.col(0);
  lying.col(1) = head.mesh.vertices.col(2);
  lying.col(2) = head.mesh.vertices.col(1);
  const TriangleTree tree(lying, trianglesOf(head.mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside}));
  for (auto& [name, place] : head.clicks.markers) {
    const Vector3d wanted = std::get<Vector3d>(place);
    for (int tries = 0; tries < 50; ++tries) {
      const double x = wanted.x() + chance.number(-kJitterMm, kJitterMm) * mm,
                   y = wanted.y() + chance.number(-kJitterMm, kJitterMm) * mm;
      double front = -1e30;
      for (const TriangleTree::Crossing& crossing : tree.crossings(x, y)) front = std::max(front, crossing.height);
      if (std::abs(front - wanted.z()) > kClickDepthMm * mm) continue;
      place = Vector3d(x, y, front);
      break;
    }
  }
}

}  // namespace mouthpiece::test
