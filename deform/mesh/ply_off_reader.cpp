// PLY (text and binary) and OFF (text): vertices, with colours where a PLY has them, and polygons; everything else is
// passed over. No number is believed before it is checked.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/text_numbers.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

enum class Encoding { kText, kLittle, kBig };
enum class Number { kNoNumber, kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };

/// The number type of a PLY, by either of its names; kNoNumber: no such type.
Number numberFromName(std::string_view name) {
  constexpr std::array<std::array<std::string_view, 2>, 8> kNames{{{"char", "int8"},
                                                                   {"uchar", "uint8"},
                                                                   {"short", "int16"},
                                                                   {"ushort", "uint16"},
                                                                   {"int", "int32"},
                                                                   {"uint", "uint32"},
                                                                   {"float", "float32"},
                                                                   {"double", "float64"}}};
  const auto found =
      std::find_if(kNames.begin(), kNames.end(), [&](const auto& both) { return both[0] == name || both[1] == name; });
  return found == kNames.end() ? Number::kNoNumber : static_cast<Number>(found - kNames.begin() + 1);
}
std::size_t bytesOf(Number type) {
  constexpr std::array<std::size_t, 9> kBytes{0, 1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}
bool isReal(Number type) { return type == Number::kF32 || type == Number::kF64; }

/// The numbers of a file's body, one after the other.
class Body {
 public:
  Body(std::string_view bytes, Encoding encoding, std::string_view file)
      : text_(bytes),
        binary_(bytes, file, encoding == Encoding::kBig ? ByteOrder::kBig : ByteOrder::kLittle),
        is_text_(encoding == Encoding::kText),
        file_(file) {}

  /// `what` and `index` are for messages. Throws InputError at the end of the bytes.
  double next(Number type, std::string_view what, std::size_t index) {
    if (is_text_) return textNumber(what, index);
    switch (type) {
      case Number::kI8:
        return binary_.readI8();
      case Number::kU8:
        return binary_.readU8();
      case Number::kI16:
        return binary_.readI16();
      case Number::kU16:
        return binary_.readU16();
      case Number::kI32:
        return binary_.readI32();
      case Number::kU32:
        return binary_.readU32();
      case Number::kF32:
        return double{binary_.readF32()};
      default:
        return binary_.readF64();
    }
  }
  /// What is left of a text.
  [[nodiscard]] std::string_view rest() const { return text_; }
  /// Leaves what else stands in a text's line.
  void skipLine() { text_.remove_prefix(std::min(text_.find('\n'), text_.size())); }

 private:
  double textNumber(std::string_view what, std::size_t index) {
    constexpr std::string_view kBlanks = " \t\r\n\v\f";
    text_.remove_prefix(std::min(text_.find_first_not_of(kBlanks), text_.size()));
    const std::string_view word = text_.substr(0, text_.find_first_of(kBlanks));
    text_.remove_prefix(word.size());
    const auto number = parseNumber(word);
    if (word.empty()) throw InputError(file_, "", fmt::format("ends or breaks off at {} {}", what, index));
    if (!number)
      throw InputError(file_, "",
                       fmt::format("{} {}: found '{}'; expected a number", what, index, printable(word, 40)));
    return *number;
  }

  std::string_view text_;
  ByteReader binary_;
  bool is_text_;
  std::string_view file_;
};

/// What a vertex' number is.
enum class Role { kX, kY, kZ, kRed, kGreen, kBlue, kNothing };
struct Property {
  Number type = Number::kF32;
  Role role = Role::kNothing;
  Number count_type = Number::kNoNumber;  ///< of a list: how many there are
  bool is_corners = false;                ///< the faces' own; other lists are passed over
};

/// What a file promises of its body.
struct Layout {
  Encoding encoding = Encoding::kText;
  double vertices = -1, faces = -1;  ///< as read; -1: not told
  std::vector<Property> of_vertex, of_face;
  bool has_colored_faces = false;  ///< numbers may follow the corners in a face's line
};

/// Throws InputError for counts that `body` bytes cannot hold.
void checkCounts(const Layout& layout, std::size_t body, std::string_view file) {
  double bytes_per_vertex = 0;
  for (const Property& property : layout.of_vertex) {
    const Number first = property.count_type == Number::kNoNumber ? property.type : property.count_type;
    bytes_per_vertex += layout.encoding == Encoding::kText ? 2 : asReal(bytesOf(first));
  }
  // A face takes four bytes at the least.
  const bool are_whole = std::floor(layout.vertices) == layout.vertices && std::floor(layout.faces) == layout.faces;
  const bool fits = are_whole && layout.vertices >= 1 && layout.vertices <= asReal(kMaxMeshVertices) &&
                    layout.faces >= 0 && layout.vertices * bytes_per_vertex + layout.faces * 4 <= asReal(body) + 1;
  if (!fits) {
    throw InputError(file, "",
                     fmt::format("found {} vertices and {} faces in {} bytes; expected counts that the file can hold",
                                 layout.vertices, layout.faces, body));
  }
  if (layout.faces < 1) throw InputError(file, "", "found no faces; expected a surface of triangles or polygons");
}

/// Passes over what is not needed: a number, or a list.
void skip(const Property& property, std::string_view what, std::size_t index, Body& body) {
  if (property.count_type == Number::kNoNumber) return static_cast<void>(body.next(property.type, what, index));
  const double count = body.next(property.count_type, what, index);
  for (double i = 0; i < count; ++i) body.next(property.type, what, index);
}

FaceMesh meshOf(const Layout& layout, std::string_view bytes, std::string_view file) {
  checkCounts(layout, bytes.size(), file);
  const auto fail = [&](const std::string& what) { throw InputError(file, "", what); };
  MeshSoup soup;
  soup.parts.emplace_back();
  Body body(bytes, layout.encoding, file);
  const std::size_t vertices = unsignedIndex(wholePart(layout.vertices)),
                    faces = unsignedIndex(wholePart(layout.faces));
  const bool is_colored = std::any_of(layout.of_vertex.begin(), layout.of_vertex.end(),
                                      [](const Property& p) { return p.role == Role::kRed; });
  const auto linear = [](double byte) { return asFloat(linearFromSrgb(byte / 255)); };
  for (std::size_t v = 0; v < vertices; ++v) {
    std::array<double, 6> found{};
    for (const Property& property : layout.of_vertex) {
      if (property.role == Role::kNothing) {
        skip(property, "vertex", v, body);
        continue;
      }
      const double value = body.next(property.type, "vertex", v);
      // Colours that are reals run from 0 to 1.
      const bool is_share = isReal(property.type) && property.role >= Role::kRed;
      found[static_cast<std::size_t>(property.role)] = is_share ? 255 * value : value;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!(std::abs(found[axis]) <= kMaxCoordinate))
        fail(fmt::format("vertex {}: found a coordinate that is no number between -1e7 and 1e7", v));
      soup.positions.push_back(asFloat(found[axis]));
    }
    if (!is_colored) continue;
    const bool is_color = std::all_of(found.begin() + 3, found.end(), [](double c) { return c >= 0 && c <= 255; });
    soup.vertex_colors.push_back(is_color ? std::array{linear(found[3]), linear(found[4]), linear(found[5])}
                                          : std::array{1.0F, 1.0F, 1.0F});
  }
  std::vector<std::uint32_t> corners;
  for (std::size_t f = 0; f < faces; ++f) {
    for (const Property& property : layout.of_face) {
      if (!property.is_corners) {
        skip(property, "face", f, body);
        continue;
      }
      const double count = body.next(property.count_type, "face", f);
      if (!(count >= 3 && count <= asReal(kMaxPolygonCorners)))
        fail(fmt::format("face {}: found {} corners; expected 3 to {}", f, count, kMaxPolygonCorners));
      corners.clear();
      while (asReal(corners.size()) < count) {
        const double corner = body.next(property.type, "face", f);
        if (!(corner >= 0 && corner < asReal(vertices)))
          fail(fmt::format("face {}: found vertex index {}; expected 0 to {}", f, corner, vertices - 1));
        corners.push_back(static_cast<std::uint32_t>(corner));
      }
      if (soup.triangles.size() + corners.size() > kMaxMeshTriangles) fail("found too many triangles");
      appendPolygon(soup, corners, 0);
    }
    if (layout.has_colored_faces) body.skipLine();
  }
  dropBacks(soup);
  return finishMesh(std::move(soup), file);
}

/// Reads a PLY's header line by line.
class PlyHeader {
 public:
  explicit PlyHeader(std::string_view file) : file_(file) {}

  /// Leaves the body in `bytes`.
  Layout read(std::string_view& bytes) {
    if (!bytes.starts_with("ply")) fail("found no 'ply'; expected a PLY file");
    std::string_view line;
    for (line_ = 1;; ++line_) {
      const std::size_t end = bytes.find('\n');
      if (end == std::string_view::npos || line_ > 1000 || end > 1000) fail("found no end_header; expected a PLY file");
      line = trimmed(bytes.substr(0, end));
      bytes.remove_prefix(end + 1);
      if (line_ == 1 && line != "ply") fail("found no 'ply'; expected a PLY file");
      if (line == "end_header") break;
      if (line_ > 1) readLine(line);
    }
    if (!has_list_) fail("found no list of corners at the faces");
    if (axes_ != 3) fail("found vertices without x, y and z");
    return layout_;
  }

 private:
  void readLine(std::string_view line) {
    words_.clear();
    std::vector<std::string_view> fields;
    splitFields(line, ' ', fields);
    std::copy_if(fields.begin(), fields.end(), std::back_inserter(words_), [](auto word) { return !word.empty(); });
    const std::string_view keyword = word(0);
    if (keyword == "comment" || keyword == "obj_info" || keyword.empty()) return;
    if (keyword == "format") return readFormat();
    if (!has_format_) fail("found no format first");
    if (keyword == "element") return readElement();
    if (keyword == "property") return readProperty();
    fail(fmt::format("found '{}'; expected format, comment, element, property or end_header", printable(keyword, 40)));
  }

  [[nodiscard]] std::string_view word(std::size_t i) const { return i < words_.size() ? words_[i] : ""; }

  void readFormat() {
    constexpr std::array<std::string_view, 3> kEncodings{"ascii", "binary_little_endian", "binary_big_endian"};
    const auto known = std::find(kEncodings.begin(), kEncodings.end(), word(1));
    if (known == kEncodings.end() || word(2) != "1.0" || has_format_)
      fail("expected 'format ascii 1.0' or 'format binary_little_endian 1.0', once");
    layout_.encoding = static_cast<Encoding>(known - kEncodings.begin());
    has_format_ = true;
  }

  void readElement() {
    element_ = word(1);
    const double count = parseNumber(word(2)).value_or(-1);
    if (!(count >= 0 && count <= 1e12)) fail("found an element without a count");
    if (layout_.faces >= 0 && element_ != "vertex" && element_ != "face") return;  // behind the faces nothing is read
    const bool in_order =
        element_ == "vertex" ? layout_.vertices < 0 : element_ == "face" && layout_.vertices >= 0 && layout_.faces < 0;
    if (!in_order) fail(fmt::format("found the element '{}'; expected vertices, then faces", printable(element_, 40)));
    (element_ == "vertex" ? layout_.vertices : layout_.faces) = count;
  }

  void readProperty() {
    if (element_ != "vertex" && element_ != "face") {
      if (layout_.faces < 0) fail("found a property of nothing");
      return;
    }
    if (word(1) == "list") return readList();
    Property property{.type = numberFromName(word(1))};
    const std::string_view name = word(2);
    if (property.type == Number::kNoNumber || name.empty())
      fail(fmt::format("found a property of type '{}'", printable(word(1), 40)));
    if (element_ == "face") return layout_.of_face.push_back(property);
    constexpr std::array<std::string_view, 6> kRoles{"x", "y", "z", "red", "green", "blue"};
    property.role = static_cast<Role>(std::find(kRoles.begin(), kRoles.end(), name) - kRoles.begin());
    if (property.role == static_cast<Role>(axes_) && axes_ < 3) ++axes_;
    layout_.of_vertex.push_back(property);
  }

  void readList() {
    const Number count_type = numberFromName(word(2)), index_type = numberFromName(word(3));
    const bool is_corners = element_ == "face" && (word(4) == "vertex_indices" || word(4) == "vertex_index");
    const bool has_types = count_type != Number::kNoNumber && index_type != Number::kNoNumber && !isReal(count_type);
    if (!has_types || (is_corners && (has_list_ || isReal(index_type))))
      fail("found no usable list; expected 'property list uchar int vertex_indices', once");
    has_list_ = has_list_ || is_corners;
    (element_ == "face" ? layout_.of_face : layout_.of_vertex)
        .push_back({.type = index_type, .count_type = count_type, .is_corners = is_corners});
  }

  [[noreturn]] void fail(std::string_view what) const { throw InputError(file_, std::to_string(line_), what); }

  std::string_view file_;
  std::size_t line_ = 1, axes_ = 0;
  std::vector<std::string_view> words_;
  std::string element_;
  Layout layout_;
  bool has_format_ = false, has_list_ = false;
};

}  // namespace

FaceMesh parsePly(std::string_view bytes, std::string_view file) {
  const Layout layout = PlyHeader(file).read(bytes);
  return meshOf(layout, bytes, file);
}

FaceMesh parseOff(std::string_view bytes, std::string_view file) {
  std::string plain;  // without comments
  bool in_comment = false;
  for (const char c : bytes) {
    if (c == '\0') throw InputError(file, "", "found a zero byte; expected OFF as text");
    in_comment = c == '#' || (in_comment && c != '\n');
    if (!in_comment) plain.push_back(c);
  }
  const std::size_t begin = plain.find_first_not_of(" \t\r\n");
  const std::string_view text = std::string_view(plain).substr(std::min(begin, plain.size()));
  if (!text.starts_with("OFF") || text.find_first_of(" \t\r\n") != 3)
    throw InputError(file, "1", "found no 'OFF'; expected a plain OFF file as text");
  Body counts(text.substr(3), Encoding::kText, file);
  const double vertices = counts.next(Number::kU32, "the count of vertices,", 0);
  const double faces = counts.next(Number::kU32, "the count of faces,", 1);
  counts.next(Number::kU32, "the count of edges,", 2);
  const Property corner{.type = Number::kI32, .count_type = Number::kI32, .is_corners = true};
  const Layout layout{Encoding::kText, vertices, faces, {{.role = Role::kX}, {.role = Role::kY}, {.role = Role::kZ}},
                      {corner},        true};
  return meshOf(layout, counts.rest(), file);
}

}  // namespace mouthpiece
