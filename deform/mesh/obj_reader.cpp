// Wavefront OBJ: v (with colours), vt, f, g, o, usemtl; everything else is passed over. One pass over the bytes; only
// lines that go on in the next are copied (ObjLines).
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>
#include <string>

#include "base/errors.h"
#include "deform/mesh/mesh_reader.h"
#include "deform/mesh/obj_lines.h"

namespace mouthpiece {
namespace {

/// One line's words, and where it stands, for the messages.
class Line {
 public:
  Line(std::string_view text, std::string_view file, std::size_t number) : rest_(text), file_(file), number_(number) {}

  std::string_view nextWord() { return takeObjWord(rest_); }

  /// Everything left, without blanks around it: names may hold blanks.
  std::string_view remainder() {
    while (!rest_.empty() && isObjBlank(rest_.front())) rest_.remove_prefix(1);
    while (!rest_.empty() && isObjBlank(rest_.back())) rest_.remove_suffix(1);
    return rest_;
  }

  float number(std::string_view word, std::string_view what) const {
    const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    const bool whole = end == digits.data() + digits.size() && !digits.empty();
    if (error == std::errc::result_out_of_range || !whole || !(std::abs(value) <= kMaxCoordinate)) {
      fail(fmt::format("found '{}' as {}; expected a number between -1e7 and 1e7", printable(word, 40), what));
    }
    return asFloat(value);
  }

  [[noreturn]] void fail(std::string_view what) const { throw InputError(file_, std::to_string(number_), what); }

 private:
  std::string_view rest_;
  std::string_view file_;
  std::size_t number_;
};

class ObjParser {
 public:
  ObjParser(std::string_view bytes, std::string_view file) : bytes_(bytes), file_(file) {
    // A vertex line takes 30 bytes or more in practice; the guess is bounded by the file's own size.
    soup_.positions.reserve(bytes.size() / 20);
    soup_.triangles.reserve(bytes.size() / 40);
    soup_.part_of_triangle.reserve(bytes.size() / 40);
  }

  FaceMesh parse() {
    ObjLines lines(bytes_);
    while (lines.next()) parseLine(Line(lines.text(), file_, lines.number()));
    refuseACutFile(lines.count());
    if (colored_vertices_ != 0 && colored_vertices_ != soup_.vertexCount()) soup_.vertex_colors.clear();
    dropBacks(soup_);
    return finishMesh(std::move(soup_), file_);
  }

 private:
  /// OBJ has no end mark, and an exporter may leave the last line's end away or some vertices without a face; not both,
  /// nor most vertices.
  void refuseACutFile(std::size_t last_line) const {
    if (soup_.triangles.empty()) return;  // refused with other words
    std::vector<bool> is_used(soup_.vertexCount(), false);
    for (const Triangle& triangle : soup_.triangles) {
      for (const std::uint32_t vertex : triangle) is_used[vertex] = true;
    }
    const auto loose = unsignedIndex(std::count(is_used.begin(), is_used.end(), false));
    const bool is_open = bytes_.back() != '\n';
    if (2 * loose <= is_used.size() && !(is_open && loose > 0)) return;
    throw InputError(
        file_, std::to_string(last_line),
        fmt::format("ends here, but {} of {} vertices have no face; expected a whole file", loose, is_used.size()));
  }

  void parseLine(Line line) {
    const std::string_view keyword = line.nextWord();
    if (keyword == "v") return parseVertex(line);
    if (keyword == "f") return parseFace(line);
    if (keyword == "vt") return parseTextureCoordinate(line);
    if (keyword == "usemtl" || keyword == "g" || keyword == "o") {
      std::string& name = keyword == "usemtl" ? material_ : keyword == "g" ? group_ : object_;
      name = printable(line.remainder(), 120);
      part_is_stale_ = true;
    }
  }

  void parseVertex(Line& line) {
    if (soup_.vertexCount() == kMaxMeshVertices)
      line.fail(fmt::format("found more than {} vertices", kMaxMeshVertices));
    for (const char* axis : {"x", "y", "z"}) soup_.positions.push_back(line.number(line.nextWord(), axis));
    // x y z [w] or x y z r g b
    std::array<std::string_view, 3> rest{line.nextWord(), line.nextWord(), line.nextWord()};
    if (rest[2].empty()) return;
    if (colored_vertices_ + 1 != soup_.vertexCount()) return;
    std::array<float, 3> color{};
    for (std::size_t k = 0; k < 3; ++k) {
      const float srgb = line.number(rest[k], "a colour");
      if (srgb < 0.0F || srgb > 1.0F) line.fail("found a colour outside 0 to 1");
      color[k] = asFloat(linearFromSrgb(srgb));
    }
    soup_.vertex_colors.push_back(color);
    ++colored_vertices_;
  }

  void parseTextureCoordinate(Line& line) {
    std::array<float, 2> coordinate{line.number(line.nextWord(), "u"), 0.0F};
    if (const std::string_view v = line.nextWord(); !v.empty()) coordinate[1] = line.number(v, "v");
    texture_.push_back(coordinate);
  }

  /// OBJ counts from 1, or back from the latest with negative numbers.
  static std::size_t resolveIndex(const Line& line, std::string_view word, std::size_t count, std::string_view what) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || value == 0) {
      line.fail(
          fmt::format("found '{}' as a {} index; expected a whole number other than 0", printable(word, 40), what));
    }
    const auto limit = static_cast<std::int64_t>(count);
    if (value > limit || value < -limit) {
      line.fail(fmt::format("found {} index {}; expected 1 to {}", what, value, count));
    }
    return unsignedIndex(value > 0 ? value - 1 : limit + value);
  }

  void parseFace(Line& line) {
    corners_.clear();
    for (std::string_view word = line.nextWord(); !word.empty(); word = line.nextWord()) {
      if (corners_.size() == kMaxPolygonCorners)
        line.fail("found a face with thousands of corners; expected a polygon");
      const std::size_t slash = word.find('/');
      const std::size_t vertex = resolveIndex(line, word.substr(0, slash), soup_.vertexCount(), "vertex");
      corners_.push_back(static_cast<std::uint32_t>(vertex));
      if (slash == std::string_view::npos || texture_.empty()) continue;
      const std::string_view rest = word.substr(slash + 1);
      const std::string_view texture = rest.substr(0, rest.find('/'));
      if (!texture.empty()) useTexture(vertex, resolveIndex(line, texture, texture_.size(), "texture"));
    }
    if (corners_.size() < 3)
      line.fail(fmt::format("found a face with {} corners; expected at least 3", corners_.size()));
    if (soup_.triangles.size() + corners_.size() > kMaxMeshTriangles) {
      line.fail(fmt::format("found more than {} triangles", kMaxMeshTriangles));
    }
    appendPolygon(soup_, corners_, currentPart(line));
  }

  /// A vertex keeps the first texture coordinate it is given: splitting it at a seam would change its number.
  void useTexture(std::size_t vertex, std::size_t texture) {
    if (soup_.texture_coordinates.size() <= vertex) {
      soup_.texture_coordinates.resize(soup_.vertexCount(), std::array<float, 2>{0.0F, 0.0F});
      has_texture_.resize(soup_.vertexCount(), false);
    }
    if (has_texture_[vertex]) return;
    has_texture_[vertex] = true;
    soup_.texture_coordinates[vertex] = texture_[texture];
  }

  std::uint32_t currentPart(const Line& line) {
    if (!part_is_stale_) return part_;
    part_is_stale_ = false;
    // The most telling of the three names stands for the part.
    std::string name = !material_.empty() ? material_ : !group_.empty() ? group_ : object_;
    for (const std::string* candidate : {&material_, &group_, &object_}) {
      if (!kindFromName(*candidate)) continue;
      name = *candidate;
      break;
    }
    const auto [entry, is_new] = part_by_name_.try_emplace(name, static_cast<std::uint32_t>(soup_.parts.size()));
    if (is_new) {
      if (soup_.parts.size() == kMaxMeshParts)
        line.fail(fmt::format("found more than {} materials and groups", kMaxMeshParts));
      soup_.parts.push_back(MeshPart{.name = name});
    }
    return part_ = entry->second;
  }

  std::string_view bytes_;
  std::string_view file_;
  MeshSoup soup_;
  std::vector<std::array<float, 2>> texture_;
  std::vector<bool> has_texture_;
  std::vector<std::uint32_t> corners_;
  std::size_t colored_vertices_ = 0;
  std::string material_, group_, object_;
  std::map<std::string, std::uint32_t> part_by_name_;
  std::uint32_t part_ = 0;
  bool part_is_stale_ = true;
};

}  // namespace

FaceMesh parseObj(std::string_view bytes, std::string_view file) { return ObjParser(bytes, file).parse(); }

}  // namespace mouthpiece
