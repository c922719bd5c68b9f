// PLY and OFF through OpenMesh's readers. They trust the file, so they are given an importer that checks every number,
// a stream that throws at the end of the bytes, and no file whose header promises more than it can hold.
#include <fmt/format.h>

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <cmath>
#include <mutex>
#include <sstream>

#include "base/errors.h"
#include "deform/mesh_reader.h"

// The readers register themselves in objects that a static library would leave out.
#include <OpenMesh/Core/IO/IOInstances.hh>

namespace mouthpiece {
namespace {

using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::Vec2f;
using OpenMesh::Vec3f;
using OpenMesh::Vec3uc;
using OpenMesh::Vec4f;
using OpenMesh::Vec4uc;
using OpenMesh::VertexHandle;

/// sRGB byte to linear.
float linearFromByte(unsigned char value) {
  const float s = static_cast<float>(value) / 255.0F;
  return s <= 0.04045F ? s / 12.92F : std::pow((s + 0.055F) / 1.055F, 2.4F);
}

/// Takes what a reader finds, and refuses what is no mesh.
class CheckingImporter final : public OpenMesh::IO::BaseImporter {
 public:
  CheckingImporter(std::string_view file, std::size_t vertex_limit) : file_(file), vertex_limit_(vertex_limit) {
    soup_.parts.push_back(MeshPart{});
  }
  MeshSoup takeSoup() {
    if (!has_color_) soup_.vertex_colors.clear();
    return std::move(soup_);
  }

  VertexHandle add_vertex(const Vec3f& point) override {
    const VertexHandle vertex = add_vertex();
    set_point(vertex, point);
    return vertex;
  }
  VertexHandle add_vertex() override {
    if (soup_.vertexCount() >= vertex_limit_) fail("found more vertices than its header says");
    soup_.positions.insert(soup_.positions.end(), 3, 0.0F);
    soup_.vertex_colors.push_back({1.0F, 1.0F, 1.0F});
    return VertexHandle(static_cast<int>(soup_.vertexCount()) - 1);
  }
  void set_point(VertexHandle vertex, const Vec3f& point) override {
    if (!isKnown(vertex)) fail("found a position without a vertex");
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::abs(point[axis]) <= kMaxCoordinate)) {
        fail(fmt::format("vertex {}: found a coordinate that is no number between -1e7 and 1e7", vertex.idx()));
      }
      soup_.positions[3 * static_cast<std::size_t>(vertex.idx()) + static_cast<std::size_t>(axis)] = point[axis];
    }
  }
  FaceHandle add_face(const VHandles& indices) override {
    if (indices.size() < 3 || indices.size() > kMaxPolygonCorners) {
      fail(fmt::format("face {}: found {} corners; expected 3 to {}", faces_, indices.size(), kMaxPolygonCorners));
    }
    corners_.clear();
    for (const VertexHandle vertex : indices) {
      if (!isKnown(vertex)) {
        fail(fmt::format("face {}: found vertex index {}; expected 0 to {}", faces_, vertex.idx(), soup_.vertexCount() - 1));
      }
      corners_.push_back(static_cast<std::uint32_t>(vertex.idx()));
    }
    if (soup_.triangles.size() + corners_.size() > kMaxMeshTriangles) fail("found too many triangles");
    appendPolygon(soup_, corners_, 0);
    return FaceHandle(static_cast<int>(faces_++));
  }
  void set_color(VertexHandle vertex, const Vec3uc& color) override {
    setColor(vertex, {linearFromByte(color[0]), linearFromByte(color[1]), linearFromByte(color[2])});
  }
  void set_color(VertexHandle vertex, const Vec4uc& color) override { set_color(vertex, Vec3uc(color[0], color[1], color[2])); }
  void set_color(VertexHandle vertex, const Vec3f& color) override { setColor(vertex, {color[0], color[1], color[2]}); }
  void set_color(VertexHandle vertex, const Vec4f& color) override { setColor(vertex, {color[0], color[1], color[2]}); }

  // What a face of ours does not keep.
  HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
  FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec2f>&) override {}
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec3f>&) override {}
  void set_face_texindex(FaceHandle, int) override {}
  void set_halfedge(VertexHandle, HalfedgeHandle) override {}
  void set_normal(VertexHandle, const Vec3f&) override {}
  void set_normal(VertexHandle, const OpenMesh::Vec3d&) override {}
  void set_texcoord(VertexHandle, const Vec2f&) override {}
  void set_status(VertexHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_next(HalfedgeHandle, HalfedgeHandle) override {}
  void set_face(HalfedgeHandle, FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void set_texcoord(HalfedgeHandle, const Vec2f&) override {}
  void set_texcoord(VertexHandle, const Vec3f&) override {}
  void set_texcoord(HalfedgeHandle, const Vec3f&) override {}
  void set_status(HalfedgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_color(OpenMesh::EdgeHandle, const Vec3uc&) override {}
  void set_color(OpenMesh::EdgeHandle, const Vec4uc&) override {}
  void set_color(OpenMesh::EdgeHandle, const Vec3f&) override {}
  void set_color(OpenMesh::EdgeHandle, const Vec4f&) override {}
  void set_status(OpenMesh::EdgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_normal(FaceHandle, const Vec3f&) override {}
  void set_normal(FaceHandle, const OpenMesh::Vec3d&) override {}
  void set_color(FaceHandle, const Vec3uc&) override {}
  void set_color(FaceHandle, const Vec4uc&) override {}
  void set_color(FaceHandle, const Vec3f&) override {}
  void set_color(FaceHandle, const Vec4f&) override {}
  void set_status(FaceHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void add_texture_information(int, std::string) override {}

  std::size_t n_vertices() const override { return soup_.vertexCount(); }
  std::size_t n_faces() const override { return faces_; }
  std::size_t n_edges() const override { return 0; }

 private:
  [[nodiscard]] bool isKnown(VertexHandle vertex) const {
    return vertex.idx() >= 0 && static_cast<std::size_t>(vertex.idx()) < soup_.vertexCount();
  }
  void setColor(VertexHandle vertex, const std::array<float, 3>& color) {
    if (!isKnown(vertex)) return;
    for (const float channel : color) {
      if (!(channel >= 0.0F && channel <= 1.0F)) return;
    }
    has_color_ = true;
    soup_.vertex_colors[static_cast<std::size_t>(vertex.idx())] = color;
  }
  [[noreturn]] void fail(std::string_view what) const { throw InputError(file_, "", what); }

  std::string file_;
  std::size_t vertex_limit_;
  MeshSoup soup_;
  std::vector<std::uint32_t> corners_;
  std::size_t faces_ = 0;
  bool has_color_ = false;
};

struct Counts {
  std::size_t vertices = 0;
  std::size_t faces = 0;
};

/// The counts that a header promises, refused when the file is too short for them.
Counts checkedCounts(double vertices, double faces, std::size_t bytes, std::size_t bytes_per_vertex, std::string_view file) {
  // A face takes four bytes at the least.
  if (!(vertices >= 1 && vertices <= static_cast<double>(kMaxMeshVertices) &&
        vertices * static_cast<double>(bytes_per_vertex) + faces * 4 <= static_cast<double>(bytes) && faces >= 0)) {
    throw InputError(file, "", fmt::format("found a header with {} vertices and {} faces in {} bytes; expected counts that "
                                           "the file can hold", vertices, faces, bytes));
  }
  if (faces < 1) throw InputError(file, "", "found no faces; expected a surface of triangles or polygons");
  return {static_cast<std::size_t>(vertices), static_cast<std::size_t>(faces)};
}

Counts plyCounts(std::string_view bytes, std::string_view file) {
  if (!bytes.starts_with("ply")) throw InputError(file, "byte 0", "found no 'ply'; expected a PLY file");
  const std::size_t end = bytes.find("end_header");
  if (end == std::string_view::npos || end > 65536) throw InputError(file, "", "found no end_header; expected a PLY file");
  std::istringstream header{std::string(bytes.substr(0, end))};
  bool is_binary = false;
  double vertices = 0;
  double faces = 0;
  std::size_t properties = 0;
  std::string element;
  for (std::string line; std::getline(header, line);) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "format") {
      std::string encoding;
      words >> encoding;
      is_binary = encoding.starts_with("binary");
    } else if (keyword == "element") {
      double count = 0;
      words >> element >> count;
      if (element == "vertex") vertices = count;
      if (element == "face") faces = count;
      if (!(count >= 0 && count <= static_cast<double>(bytes.size()))) {
        throw InputError(file, "", fmt::format("found element {} with a count that the file cannot hold", printable(element, 40)));
      }
    } else if (keyword == "property") {
      std::string type;
      words >> type;
      if (element == "vertex" && type == "list") throw InputError(file, "", "found a list at the vertices; expected numbers");
      if (element == "vertex") ++properties;
    }
  }
  if (properties < 3) throw InputError(file, "", "found vertices without x, y and z");
  return checkedCounts(vertices, faces, bytes.size() - end, is_binary ? std::max<std::size_t>(12, properties) : 2 * properties, file);
}

Counts offCounts(std::string_view bytes, std::string_view file) {
  const std::size_t keyword = bytes.substr(0, 64).find("OFF");
  if (keyword == std::string_view::npos) throw InputError(file, "byte 0", "found no 'OFF'; expected an OFF file");
  if (bytes.substr(0, 256).find("BINARY") != std::string_view::npos) {
    throw InputError(file, "", "found a binary OFF file; expected text, or PLY");
  }
  if (bytes.substr(0, keyword).find_first_of("4n") != std::string_view::npos) {
    throw InputError(file, "", "found an OFF file of another dimension; expected x, y, z");
  }
  std::istringstream stream{std::string(bytes.substr(keyword + 3, 4096))};
  std::vector<double> numbers;
  for (std::string line; numbers.size() < 2 && std::getline(stream, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    for (double value; words >> value;) numbers.push_back(value);
  }
  if (numbers.size() < 2) throw InputError(file, "", "found no counts; expected vertices, faces and edges after OFF");
  return checkedCounts(numbers[0], numbers[1], bytes.size(), 6, file);
}

FaceMesh parseThroughOpenMesh(std::string_view bytes, std::string_view file, const std::string& format, const Counts& counts) {
  // The readers are single objects with state of their own.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  omerr().disable();
  omout().disable();
  CheckingImporter importer(file, counts.vertices);
  // The newline keeps the last number of a text file from touching the end.
  std::istringstream stream(std::string(bytes) + "\n", std::ios::in | std::ios::binary);
  stream.exceptions(std::ios::failbit | std::ios::badbit);
  OpenMesh::IO::Options options(OpenMesh::IO::Options::VertexColor);
  bool is_read = false;
  try {
    is_read = OpenMesh::IO::IOManager().read(stream, format, importer, options);
  } catch (const std::ios_base::failure&) {
    throw InputError(file, "", fmt::format("ends or breaks off after {} of {} vertices and {} of {} faces", importer.n_vertices(),
                                           counts.vertices, importer.n_faces(), counts.faces));
  }
  if (!is_read || importer.n_vertices() != counts.vertices || importer.n_faces() != counts.faces) {
    throw InputError(file, "", fmt::format("found {} of {} vertices and {} of {} faces; expected all of them", importer.n_vertices(),
                                           counts.vertices, importer.n_faces(), counts.faces));
  }
  return finishMesh(importer.takeSoup(), file);
}

}  // namespace

FaceMesh parsePly(std::string_view bytes, std::string_view file) {
  return parseThroughOpenMesh(bytes, file, ".ply", plyCounts(bytes, file));
}

FaceMesh parseOff(std::string_view bytes, std::string_view file) {
  const Counts counts = offCounts(bytes, file);
  // OpenMesh' reader stumbles over comments in the header.
  std::string plain;
  plain.reserve(bytes.size());
  bool in_comment = false;
  for (const char c : bytes) {
    in_comment = c == '#' || (in_comment && c != '\n');
    if (!in_comment) plain.push_back(c);
  }
  return parseThroughOpenMesh(plain, file, ".off", counts);
}

}  // namespace mouthpiece
