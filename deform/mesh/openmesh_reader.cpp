// PLY and OFF through OpenMesh's readers. They trust the file, so they are given an importer that checks every number,
// a stream that throws at the end of the bytes, and no file whose header promises more than it can hold.
#include <fmt/format.h>

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <cmath>
#include <mutex>
#include <sstream>

#include "base/errors.h"
#include "deform/mesh/mesh_reader.h"

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
        fail(fmt::format("face {}: found vertex index {}; expected 0 to {}", faces_, vertex.idx(),
                         soup_.vertexCount() - 1));
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
  void set_color(VertexHandle vertex, const Vec4uc& color) override {
    set_color(vertex, Vec3uc(color[0], color[1], color[2]));
  }
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

/// What a file promises, and the same file with a header that OpenMesh can be trusted with.
struct CheckedFile {
  Counts counts;
  std::string bytes;
};

/// The counts that a header promises, refused when the body is too short for them.
Counts checkedCounts(double vertices, double faces, std::size_t body, std::size_t bytes_per_vertex,
                     std::string_view file) {
  // A face takes four bytes at the least.
  const bool fits = vertices >= 1 && vertices <= static_cast<double>(kMaxMeshVertices) && faces >= 0 &&
                    vertices * static_cast<double>(bytes_per_vertex) + faces * 4 <= static_cast<double>(body);
  if (!fits) {
    throw InputError(
        file, "",
        fmt::format("found {:.0f} vertices and {:.0f} faces in {} bytes; expected counts that the file can hold",
                    vertices, faces, body));
  }
  if (faces < 1) throw InputError(file, "", "found no faces; expected a surface of triangles or polygons");
  return {static_cast<std::size_t>(vertices), static_cast<std::size_t>(faces)};
}

/// Bytes of a PLY number type; 0: no such type.
std::size_t plyTypeSize(std::string_view type) {
  for (const auto& [names, size] : {std::pair<std::string_view, std::size_t>{" char uchar int8 uint8 ", 1},
                                    {" short ushort int16 uint16 ", 2},
                                    {" int uint int32 uint32 float float32 ", 4},
                                    {" double float64 ", 8}}) {
    if (names.find(fmt::format(" {} ", type)) != std::string_view::npos) return size;
  }
  return 0;
}

/// OpenMesh believes what a header says, in whatever order it says it. This one is read line by line, and written anew
/// with just the vertices and the faces.
class PlyHeader {
 public:
  explicit PlyHeader(std::string_view file) : file_(file) {}

  CheckedFile check(std::string_view bytes) {
    place_ = "1";
    if (!bytes.starts_with("ply")) fail("found no 'ply'; expected a PLY file");
    std::size_t begin = 0;
    for (std::size_t number = 1;; ++number) {
      const std::size_t end = bytes.find('\n', begin);
      if (end == std::string_view::npos || number > kMaxHeaderLines || end - begin > kMaxHeaderLine) {
        throw InputError(file_, std::to_string(number), "found no end_header; expected a PLY file");
      }
      std::string_view line = bytes.substr(begin, end - begin);
      if (line.ends_with('\r')) line.remove_suffix(1);
      begin = end + 1;
      place_ = std::to_string(number);
      if (number == 1 && line != "ply") fail("found no 'ply'; expected a PLY file");
      if (line == "end_header") break;
      if (number > 1) readLine(line);
    }
    if (!has_list_) fail("found no list of corners at the faces");
    if (axes_ != 3) fail("found vertices without x, y and z");
    const std::size_t per_vertex = encoding_ == "ascii" ? 2 * vertex_properties_ : vertex_bytes_;
    CheckedFile result{checkedCounts(vertices_, faces_, bytes.size() - begin, per_vertex, file_),
                       "ply\n" + header_ + "end_header\n"};
    result.bytes += bytes.substr(begin);
    return result;
  }

 private:
  static constexpr std::size_t kMaxHeaderLines = 1000;
  static constexpr std::size_t kMaxHeaderLine = 1000;

  void readLine(std::string_view line) {
    std::istringstream words{std::string(line)};
    std::string keyword;
    words >> keyword;
    if (keyword == "comment" || keyword == "obj_info" || keyword.empty()) return;
    if (keyword == "format") return readFormat(words);
    if (encoding_.empty()) fail("found no format first");
    if (keyword == "element") return readElement(words);
    if (keyword == "property") return readProperty(words);
    fail(fmt::format("found '{}'; expected format, comment, element, property or end_header", printable(keyword, 40)));
  }

  void readFormat(std::istringstream& words) {
    std::string version;
    words >> encoding_ >> version;
    const bool is_known =
        encoding_ == "ascii" || encoding_ == "binary_little_endian" || encoding_ == "binary_big_endian";
    if (!is_known || version != "1.0" || !header_.empty())
      fail("expected 'format ascii 1.0' or 'format binary_little_endian 1.0', once");
    header_ += fmt::format("format {} 1.0\n", encoding_);
  }

  void readElement(std::istringstream& words) {
    double count = -1;
    words >> element_ >> count;
    if (!(count >= 0 && count <= 1e12)) fail("found an element without a count");
    if (faces_ >= 0 && element_ != "vertex" && element_ != "face") return;  // what comes after the faces is not read
    const bool in_order = element_ == "vertex" ? vertices_ < 0 : element_ == "face" && vertices_ >= 0 && faces_ < 0;
    if (!in_order) fail(fmt::format("found the element '{}'; expected vertices, then faces", printable(element_, 40)));
    (element_ == "vertex" ? vertices_ : faces_) = count;
    header_ += fmt::format("element {} {:.0f}\n", element_, count);
  }

  void readProperty(std::istringstream& words) {
    std::string type;
    words >> type;
    if (element_ != "vertex" && element_ != "face") {
      if (faces_ < 0) fail("found a property of nothing");
      return;
    }
    if (type == "list") return readList(words);
    std::string name;
    words >> name;
    if (plyTypeSize(type) == 0 || name.empty()) fail(fmt::format("found a property of type '{}'", printable(type, 40)));
    if (element_ == "vertex") {
      vertex_bytes_ += plyTypeSize(type);
      ++vertex_properties_;
      if (name.size() == 1 && name[0] == "xyz"[std::min<std::size_t>(axes_, 2)] && axes_ < 3) ++axes_;
    }
    header_ += fmt::format("property {} {}\n", type, printable(name, 60));
  }

  void readList(std::istringstream& words) {
    std::string count_type;
    std::string index_type;
    std::string name;
    words >> count_type >> index_type >> name;
    const bool is_corners = element_ == "face" && !has_list_ && (name == "vertex_indices" || name == "vertex_index");
    const bool has_types = plyTypeSize(count_type) > 0 && plyTypeSize(count_type) <= 4 && plyTypeSize(index_type) > 0 &&
                           count_type.find("float") != 0 && index_type.find("float") != 0 && index_type != "double";
    if (!is_corners || !has_types)
      fail("found a list other than the faces' corners; expected 'property list uchar int vertex_indices'");
    has_list_ = true;
    header_ += fmt::format("property list {} {} vertex_indices\n", count_type, index_type);
  }

  [[noreturn]] void fail(std::string_view what) const { throw InputError(file_, place_, what); }

  std::string_view file_;
  std::string place_, encoding_, element_, header_;
  double vertices_ = -1;
  double faces_ = -1;
  std::size_t axes_ = 0, vertex_properties_ = 0, vertex_bytes_ = 0;
  bool has_list_ = false;
};

/// Text only, without its comments (OpenMesh' reader stumbles over them) and with a header of our own.
CheckedFile checkOff(std::string_view bytes, std::string_view file) {
  std::string plain;
  plain.reserve(bytes.size());
  bool in_comment = false;
  for (const char c : bytes) {
    if (c == '\0') throw InputError(file, "", "found a zero byte; expected OFF as text");
    in_comment = c == '#' || (in_comment && c != '\n');
    if (!in_comment) plain.push_back(c);
  }
  std::istringstream stream(plain);
  std::string keyword;
  stream >> keyword;
  if (keyword != "OFF") throw InputError(file, "1", "found no 'OFF'; expected a plain OFF file as text");
  double vertices = -1;
  double faces = -1;
  double edges = 0;
  if (!(stream >> vertices >> faces >> edges))
    throw InputError(file, "", "found no counts; expected vertices, faces and edges after OFF");
  stream.clear();  // the counts may be the last thing in the file, which would make tellg fail
  const auto body = static_cast<std::size_t>(stream.tellg());
  const Counts counts = checkedCounts(vertices, faces, plain.size() - body, 6, file);
  return {counts, fmt::format("OFF\n{} {} 0", counts.vertices, counts.faces) + plain.substr(body)};
}

FaceMesh parseThroughOpenMesh(CheckedFile checked, std::string_view file, const std::string& format) {
  const Counts& counts = checked.counts;
  // The readers are single objects with state of their own.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  omerr().disable();
  omout().disable();
  CheckingImporter importer(file, counts.vertices);
  // The newline keeps the last number of a text file from touching the end.
  checked.bytes += "\n";
  std::istringstream stream(std::move(checked.bytes), std::ios::in | std::ios::binary);
  stream.exceptions(std::ios::failbit | std::ios::badbit);
  OpenMesh::IO::Options options(OpenMesh::IO::Options::VertexColor);
  bool is_read = false;
  try {
    is_read = OpenMesh::IO::IOManager().read(stream, format, importer, options);
  } catch (const std::ios_base::failure&) {
    throw InputError(file, "",
                     fmt::format("ends or breaks off after {} of {} vertices and {} of {} faces", importer.n_vertices(),
                                 counts.vertices, importer.n_faces(), counts.faces));
  }
  if (!is_read || importer.n_vertices() != counts.vertices || importer.n_faces() != counts.faces) {
    throw InputError(file, "",
                     fmt::format("found {} of {} vertices and {} of {} faces; expected all of them",
                                 importer.n_vertices(), counts.vertices, importer.n_faces(), counts.faces));
  }
  return finishMesh(importer.takeSoup(), file);
}

}  // namespace

FaceMesh parsePly(std::string_view bytes, std::string_view file) {
  return parseThroughOpenMesh(PlyHeader(file).check(bytes), file, ".ply");
}

FaceMesh parseOff(std::string_view bytes, std::string_view file) {
  return parseThroughOpenMesh(checkOff(bytes, file), file, ".off");
}

}  // namespace mouthpiece
