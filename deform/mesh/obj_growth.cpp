#include "deform/mesh/obj_growth.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <vector>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/obj_lines.h"

namespace mouthpiece {
namespace {

/// A corner of a face, all numbers counted from the file's start.
struct ObjCorner {
  std::uint32_t vertex = 0;  ///< from 0
  std::string rest;          ///< from the first slash on: "/7/3"
  bool operator==(const ObjCorner&) const = default;
};
using ObjFace = std::vector<ObjCorner>;

/// How many there are so far of what a corner names: vertices, texture coordinates, normals.
using ObjCounts = std::array<std::size_t, 3>;

/// A number of OBJ from 1, or back from the latest.
std::optional<std::size_t> numberOf(std::string_view word, std::size_t count) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc() || end != word.data() + word.size() || number == 0) return std::nullopt;
  if (number < 0) number += static_cast<std::int64_t>(count) + 1;
  return number > 0 ? std::optional(static_cast<std::size_t>(number)) : std::nullopt;
}

std::optional<ObjCorner> cornerOf(std::string_view word, const ObjCounts& counts) {
  ObjCorner corner;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const std::size_t slash = std::min(word.find('/'), word.size());
    const std::optional<std::size_t> number = numberOf(word.substr(0, slash), counts[k]);
    if (k == 0 && (!number || *number > counts[0])) return std::nullopt;
    if (k == 0) {
      corner.vertex = static_cast<std::uint32_t>(*number - 1);
    } else {
      corner.rest += '/' + (number ? std::to_string(*number) : std::string());
    }
    if (slash == word.size()) break;
    word.remove_prefix(slash + 1);
  }
  return corner;
}

class GrownObj {
 public:
  GrownObj(std::string_view obj, std::string_view file, const FaceMesh& given, const GrownMesh& grown)
      : obj_(obj), file_(file), given_(given), grown_(grown), is_replaced_(given.vertexCount(), false) {
    for (std::size_t t = 0; t < given.triangles.size(); ++t) {
      Triangle corners = given.triangles[t];
      for (std::size_t k = 0; k < 3; ++k) {
        if (corners[k] != grown.mesh.triangles[t][k]) is_replaced_[corners[k]] = true;
      }
      std::sort(corners.begin(), corners.end());
      by_corners_.emplace_back(corners, t);
    }
    std::sort(by_corners_.begin(), by_corners_.end());
    for (const std::uint32_t parent : grown.parents) tails_[rootOf(parent)];
  }

  GrownObjText made() && {
    findCut();
    out_.reserve(obj_.size() + obj_.size() / 8);
    ObjCounts counts{};
    std::size_t faces = 0;
    for (ObjLines lines(obj_); lines.next();) {
      std::string_view line = lines.text();
      const std::string_view keyword = takeObjWord(line);
      if (keyword == "v") {
        addVertex(lines.bytes(), counts[0], line);
        if (++counts[0] == vertices_before_) addNewVertices();
      } else if (keyword == "f" || keyword == "l" || keyword == "p") {
        addElement(keyword, lines, counts, line);
        if (keyword == "f" && ++faces == faces_before_parts_) addParts();
      } else {
        counts[1] += keyword == "vt" ? 1U : 0U;
        counts[2] += keyword == "vn" ? 1U : 0U;
        if (keyword == "g") group_ = lines.text();
        if (keyword == "usemtl") material_ = lines.text();
        out_ += lines.bytes();
      }
    }
    return {std::move(out_), vertices_before_};
  }

 private:
  /// The file's own vertex that a new one looks like.
  [[nodiscard]] std::uint32_t rootOf(std::uint32_t vertex) const {
    while (vertex >= given_.vertexCount()) vertex = grown_.parents[vertex - given_.vertexCount()];
    return vertex;
  }

  /// Where the new vertices and parts go: into the object that is cut, or, where no face is, to the end.
  void findCut() {
    ObjCounts counts{};
    std::size_t faces = 0;
    for (ObjLines lines(obj_); lines.next();) {
      std::string_view line = lines.text();
      const std::string_view keyword = takeObjWord(line);
      counts[0] += keyword == "v" ? 1U : 0U;
      if (keyword != "f") continue;
      ++faces;
      for (std::string_view word = takeObjWord(line); !word.empty(); word = takeObjWord(line)) {
        const std::optional<ObjCorner> corner = cornerOf(word, counts);
        if (!corner || corner->vertex >= given_.vertexCount() || !is_replaced_[corner->vertex]) continue;
        if (vertices_before_ == 0) vertices_before_ = counts[0];
        faces_before_parts_ = faces;
      }
    }
    if (counts[0] != given_.vertexCount())
      throw InputError(file_, "", fmt::format("has {} vertices; expected {}", counts[0], given_.vertexCount()));
    if (vertices_before_ == 0) vertices_before_ = counts[0];
    if (faces_before_parts_ == 0) faces_before_parts_ = faces;
  }

  void closeLine() {
    if (!out_.empty() && out_.back() != '\n') out_ += '\n';
  }

  void addVertex(std::string_view bytes, std::size_t vertex, std::string_view line) {
    for (int axis = 0; axis < 3; ++axis) takeObjWord(line);
    while (!line.empty() && isObjBlank(line.back())) line.remove_suffix(1);
    if (const auto tail = tails_.find(static_cast<std::uint32_t>(vertex)); tail != tails_.end()) tail->second = line;
    const auto row = signedIndex(vertex);
    if (given_.vertices.row(row) == grown_.mesh.vertices.row(row)) {
      out_ += bytes;
    } else {
      writeVertex(row, line);
    }
  }

  /// `tail`: what stands behind its place, a weight or a colour.
  void writeVertex(Eigen::Index row, std::string_view tail) {
    const auto place = grown_.mesh.vertices.row(row);
    closeLine();
    out_ += fmt::format("v {} {} {}{}\n", place.x(), place.y(), place.z(), tail);
  }

  void addNewVertices() {
    for (std::size_t i = 0; i < grown_.parents.size(); ++i)
      writeVertex(signedIndex(given_.vertexCount() + i), tails_.at(rootOf(grown_.parents[i])));
  }

  /// Its number in the text that is written, from 1.
  [[nodiscard]] std::size_t numberInText(std::uint32_t vertex) const {
    if (vertex < vertices_before_) return vertex + 1U;
    return vertex < given_.vertexCount() ? vertex + grown_.parents.size() + 1
                                         : vertex - given_.vertexCount() + vertices_before_ + 1;
  }

  void write(std::string_view keyword, const ObjFace& face) {
    closeLine();
    out_ += keyword;
    for (const ObjCorner& corner : face) out_ += fmt::format(" {}{}", numberInText(corner.vertex), corner.rest);
    out_ += '\n';
  }

  /// A face, a line or points.
  void addElement(std::string_view keyword, const ObjLines& lines, const ObjCounts& counts, std::string_view line) {
    ObjFace face;
    bool is_relative = false, is_touched = false, is_behind = false;
    for (std::string_view word = takeObjWord(line); !word.empty(); word = takeObjWord(line)) {
      const std::optional<ObjCorner> corner = cornerOf(word, counts);
      if (!corner) throw InputError(file_, std::to_string(lines.number()), "names vertices that are not there");
      is_relative = is_relative || word.starts_with('-');
      is_touched = is_touched || is_replaced_[corner->vertex];
      is_behind = is_behind || corner->vertex >= vertices_before_;
      if (keyword == "f") looks_.try_emplace(corner->vertex, corner->rest.substr(0, corner->rest.find('/', 1)));
      face.push_back(*corner);
    }
    const std::vector<ObjFace> faces = is_touched && keyword == "f" ? cutFaces(face) : std::vector<ObjFace>(1, face);
    // A number that is counted back from the latest vertex may be another one's behind the new ones.
    const bool is_renumbered = is_behind || (is_relative && counts[0] >= vertices_before_);
    if (faces.size() == 1 && faces[0] == face && !is_renumbered) {
      out_ += lines.bytes();
      return;
    }
    for (const ObjFace& made : faces) write(keyword, made);
  }

  /// A face as its triangles are now: with other corners, or, where they have come apart, its triangles.
  [[nodiscard]] std::vector<ObjFace> cutFaces(const ObjFace& face) const {
    std::vector<ObjFace> triangles;
    std::map<std::uint32_t, std::uint32_t> becomes;
    bool is_one = true;
    for (std::size_t i = 0; i < face.size(); ++i) {
      for (std::size_t j = i + 1; j < face.size(); ++j) {
        for (std::size_t k = j + 1; k < face.size(); ++k) {
          ObjFace own{face[i], face[j], face[k]};
          const std::optional<std::size_t> number = triangleOf(own);
          if (!number) continue;
          for (ObjCorner& corner : own) {
            const std::uint32_t was = corner.vertex;
            const Triangle& before = given_.triangles[*number];
            const auto place = std::find(before.begin(), before.end(), was) - before.begin();
            corner.vertex = grown_.mesh.triangles[*number][unsignedIndex(place)];
            is_one = is_one && becomes.try_emplace(was, corner.vertex).first->second == corner.vertex;
          }
          triangles.push_back(std::move(own));
        }
      }
    }
    if (!is_one) return triangles;
    ObjFace whole = face;
    for (ObjCorner& corner : whole) {
      if (const auto now = becomes.find(corner.vertex); now != becomes.end()) corner.vertex = now->second;
    }
    return {whole};
  }

  [[nodiscard]] std::optional<std::size_t> triangleOf(const ObjFace& face) const {
    Triangle corners{face[0].vertex, face[1].vertex, face[2].vertex};
    std::sort(corners.begin(), corners.end());
    const auto found = std::lower_bound(by_corners_.begin(), by_corners_.end(), std::pair(corners, std::size_t{0}));
    return found != by_corners_.end() && found->first == corners ? std::optional(found->second) : std::nullopt;
  }

  /// Parts that the given mesh has not, with the texture coordinates that their vertices go with.
  void addParts() {
    closeLine();
    for (std::size_t p = given_.parts.size(); p < grown_.mesh.parts.size(); ++p) {
      const MeshPart& part = grown_.mesh.parts[p];
      out_ += fmt::format("g {}\n", part.name);
      if (!material_.empty()) out_ += fmt::format("usemtl {}\n", part.name);
      for (const Triangle& triangle : trianglesOf(grown_.mesh, part)) {
        ObjFace face;
        for (const std::uint32_t vertex : triangle) {
          const auto look = looks_.find(rootOf(vertex));
          face.push_back({vertex, look == looks_.end() ? "" : look->second});
        }
        const bool has_looks =
            std::all_of(face.begin(), face.end(), [](const ObjCorner& corner) { return corner.rest.size() > 1; });
        for (ObjCorner& corner : face) corner.rest = has_looks ? corner.rest : "";
        write("f", face);
      }
    }
    out_ += group_.empty() ? "g\n" : group_ + '\n';
    if (!material_.empty()) out_ += material_ + '\n';
  }

  std::string_view obj_, file_;
  const FaceMesh& given_;
  const GrownMesh& grown_;
  std::vector<bool> is_replaced_;                             ///< vertices that are another's corner somewhere
  std::vector<std::pair<Triangle, std::size_t>> by_corners_;  ///< the given triangles, corners rising; their numbers
  std::map<std::uint32_t, std::string> tails_;                ///< of vertices that new ones look like
  std::map<std::uint32_t, std::string> looks_;                ///< "/7", the first texture coordinate of each vertex
  std::size_t vertices_before_ = 0;                           ///< of the file's, those before the new ones
  std::size_t faces_before_parts_ = 0;                        ///< of the file's
  std::string group_, material_;                              ///< the last line of each
  std::string out_;
};

}  // namespace

GrownObjText grownObj(std::string_view obj, std::string_view file, const FaceMesh& given, const GrownMesh& grown) {
  return GrownObj(obj, file, given, grown).made();
}

}  // namespace mouthpiece
