#include "retarget/placing/face_page.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json_text.h"
#include "base/page_data.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

extern const std::string_view kFacePageTemplate;

namespace {

using nlohmann::json;

constexpr std::string_view kPlaceholder = "\"@DATA@\"";

std::string base64(const void* data, std::size_t size) {
  std::string text;
  appendBase64(text, {static_cast<const char*>(data), size});
  return text;
}

}  // namespace

const std::vector<AnchorToPick>& suggestedAnchors() {
  static const std::vector<AnchorToPick> anchors{
      {"LIP_CORNER_R", "corner of the mouth, the head's own right (left in a front view)"},
      {"LIP_CORNER_L", "corner of the mouth, the head's own left"},
      {"LIP_UP_MID", "middle of the upper lip's red edge, under the nose"},
      {"LIP_LO_MID", "middle of the lower lip's red edge, above the chin"},
      {"NOSE_TIP", "tip of the nose"},
      {"CHIN_LOW", "the chin, in the middle, where its front turns to its underside"},
      {"CANTHUS_OUT_R", "outer corner of the right eye (left in a front view)"},
      {"CANTHUS_OUT_L", "outer corner of the left eye"},
      {"EYE_IN_R", "inner corner of the right eye"},
      {"EYE_IN_L", "inner corner of the left eye"}};
  return anchors;
}

std::string facePage(const FaceMesh& mesh, std::string_view name, const Anchors& shown,
                     const std::vector<AnchorToPick>& to_pick, const PageDressing& dressing) {
  json data{{"name", name}, {"parts", json::array()}, {"places", json::object()}, {"to_pick", json::array()}};
  for (const MeshPart& part : mesh.parts) {
    data["parts"].push_back({{"name", part.name},
                             {"kind", nameOf(part.kind)},
                             {"picture", part.material},
                             {"first", part.first_triangle},
                             {"count", part.triangle_count},
                             {"color", {part.base_color[0], part.base_color[1], part.base_color[2]}}});
  }
  for (const auto& [marker, anchor] : shown.markers) {
    const Eigen::Vector3d place = placeOf(shown, marker, mesh, std::string(name)).value();
    data["places"][marker] = {place.x(), place.y(), place.z()};
  }
  const auto listOf = [](const Eigen::Vector3d& place) { return json{place.x(), place.y(), place.z()}; };
  data["traced"] = json::object();
  for (const auto& [rim, place] : dressing.traced) data["traced"][rim] = listOf(place);
  data["lip_line"] = json::array();
  for (const Eigen::Vector3d& place : dressing.lip_line) data["lip_line"].push_back(listOf(place));
  data["anchors"] = looseJson(anchorsBytes(shown));
  for (const AnchorToPick& anchor : to_pick)
    data["to_pick"].push_back({{"name", anchor.name}, {"place", anchor.place}});
  data["positions"] = base64(mesh.vertices.data(), unsignedIndex(mesh.vertices.size()) * sizeof(float));
  data["triangles"] = base64(mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
  data["pictures"] = json::object();
  data["has_unseen_pictures"] = std::any_of(dressing.pictures.begin(), dressing.pictures.end(),
                                            [](const auto& entry) { return entry.second.bytes.empty(); });
  if (!mesh.texture_coordinates.empty() && !dressing.pictures.empty()) {
    for (const auto& [material, picture] : dressing.pictures) {
      if (picture.bytes.empty()) continue;
      data["pictures"][std::to_string(material)] =
          "data:" + picture.mime + ";base64," + base64(picture.bytes.data(), picture.bytes.size());
    }
    data["texture"] = base64(mesh.texture_coordinates.data(), mesh.texture_coordinates.size() * 2 * sizeof(float));
  }
  const std::size_t at = kFacePageTemplate.find(kPlaceholder);
  MOUTHPIECE_EXPECT(at != std::string_view::npos);
  std::string page(kFacePageTemplate.substr(0, at));
  page += scriptJson(data);
  page += kFacePageTemplate.substr(at + kPlaceholder.size());
  return closedPage(page);
}

}  // namespace mouthpiece
