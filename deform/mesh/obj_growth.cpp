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

std::string textOf(const ObjFace& face) {
  std::string text = "f";
  for (const ObjCorner& corner : face) text += fmt::format(" {}{}", corner.vertex + 1, corner.rest);
  return text + '\n';
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

  std::string made() && {
    expectSameVertices();
    out_.reserve(obj_.size() + obj_.size() / 8);
    ObjCounts counts{};
    for (ObjLines lines(obj_); lines.next();) {
      std::string_view line = lines.text();
      const std::string_view keyword = takeObjWord(line);
      if (keyword == "v") {
        addVertex(lines.bytes(), counts[0], line);
        if (++counts[0] == given_.vertexCount()) addNewVertices();
      } else if (keyword == "f") {
        addFace(lines, counts, line);
      } else {
        counts[1] += keyword == "vt" ? 1U : 0U;
        counts[2] += keyword == "vn" ? 1U : 0U;
        for (std::size_t i = 0; i < kStates.size(); ++i) {
          if (keyword == kStates[i]) states_[i] = lines.text();
        }
        out_ += lines.bytes();
      }
    }
    closeLine();
    out_ += late_;
    addParts();
    return std::move(out_);
  }

 private:
  static constexpr std::array<std::string_view, 4> kStates{"o", "g", "usemtl", "s"};
  using States = std::array<std::string, kStates.size()>;  ///< the last line of each

  /// The file's own vertex that a new one looks like.
  [[nodiscard]] std::uint32_t rootOf(std::uint32_t vertex) const {
    while (vertex >= given_.vertexCount()) vertex = grown_.parents[vertex - given_.vertexCount()];
    return vertex;
  }

  void expectSameVertices() const {
    std::size_t count = 0;
    for (ObjLines lines(obj_); lines.next();) {
      std::string_view line = lines.text();
      count += takeObjWord(line) == "v" ? 1U : 0U;
    }
    if (count != given_.vertexCount())
      throw InputError(file_, "", fmt::format("has {} vertices; expected {}", count, given_.vertexCount()));
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

  void addFace(const ObjLines& lines, const ObjCounts& counts, std::string_view line) {
    ObjFace face;
    bool is_relative = false, is_touched = false;
    for (std::string_view word = takeObjWord(line); !word.empty(); word = takeObjWord(line)) {
      const std::optional<ObjCorner> corner = cornerOf(word, counts);
      if (!corner) throw InputError(file_, std::to_string(lines.number()), "has a face of vertices that are not there");
      is_relative = is_relative || word.starts_with('-');
      is_touched = is_touched || is_replaced_[corner->vertex];
      looks_.try_emplace(corner->vertex, corner->rest.substr(0, corner->rest.find('/', 1)));
      face.push_back(*corner);
    }
    const bool has_all_vertices = counts[0] == given_.vertexCount();
    const std::vector<ObjFace> faces = is_touched ? cutFaces(face) : std::vector<ObjFace>(1, face);
    const bool is_as_it_was = faces.size() == 1 && faces[0] == face;
    if (!is_as_it_was) cut_states_ = states_;
    // A number that is counted back from the latest vertex would be another one's behind the new ones.
    if (is_as_it_was && !(is_relative && has_all_vertices)) {
      out_ += lines.bytes();
      return;
    }
    std::string text;
    for (const ObjFace& made : faces) text += textOf(made);
    closeLine();
    if (has_all_vertices) {
      out_ += text;
    } else {  // no face comes before its vertices
      addStates(states_, late_);
      late_ += text;
    }
  }

  static void addStates(const States& states, std::string& to) {
    for (const std::string& state : states) {
      if (!state.empty()) to += state + '\n';
    }
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

  /// Parts that the given mesh has not, in the object that was cut, with the texture coordinates that their vertices go
  /// with.
  void addParts() {
    for (std::size_t p = given_.parts.size(); p < grown_.mesh.parts.size(); ++p) {
      const MeshPart& part = grown_.mesh.parts[p];
      if (!cut_states_[0].empty() && cut_states_[0] != states_[0]) out_ += cut_states_[0] + '\n';
      out_ += fmt::format("g {0}\nusemtl {0}\n", part.name);
      for (const Triangle& triangle : trianglesOf(grown_.mesh, part)) {
        ObjFace face;
        for (const std::uint32_t vertex : triangle) {
          const auto look = looks_.find(rootOf(vertex));
          face.push_back({vertex, look == looks_.end() ? "" : look->second});
        }
        const bool has_looks =
            std::all_of(face.begin(), face.end(), [](const ObjCorner& corner) { return corner.rest.size() > 1; });
        for (ObjCorner& corner : face) corner.rest = has_looks ? corner.rest : "";
        out_ += textOf(face);
      }
    }
  }

  std::string_view obj_, file_;
  const FaceMesh& given_;
  const GrownMesh& grown_;
  std::vector<bool> is_replaced_;                             ///< vertices that are another's corner somewhere
  std::vector<std::pair<Triangle, std::size_t>> by_corners_;  ///< the given triangles, corners rising; their numbers
  std::map<std::uint32_t, std::string> tails_;                ///< of vertices that new ones look like
  std::map<std::uint32_t, std::string> looks_;                ///< "/7", the first texture coordinate of each vertex
  States states_, cut_states_;
  std::string out_, late_;
};

}  // namespace

std::string grownObj(std::string_view obj, std::string_view file, const FaceMesh& given, const GrownMesh& grown) {
  return GrownObj(obj, file, given, grown).made();
}

}  // namespace mouthpiece
