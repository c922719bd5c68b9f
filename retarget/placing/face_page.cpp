#include "retarget/placing/face_page.h"

#include <nlohmann/json.hpp>

#include "base/errors.h"

namespace mouthpiece {

extern const std::string_view kFacePageTemplate;

namespace {

using nlohmann::json;

constexpr std::string_view kPlaceholder = "\"@DATA@\"";

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(4 * (bytes.size() / 3 + 1));
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? kDigits[group >> (18U - 6U * static_cast<unsigned>(k)) & 63U] : '=';
  }
  return text;
}

std::string_view bytesOf(const void* data, std::size_t size) { return {static_cast<const char*>(data), size}; }

/// Names come from files: nothing in them may end the script element.
std::string scriptSafe(const json& data) {
  std::string safe;
  for (const char letter : data.dump(-1, ' ', true, json::error_handler_t::replace)) {
    if (letter == '<')
      safe += "\\u003c";
    else
      safe += letter;
  }
  return safe;
}

}  // namespace

const std::vector<AnchorToPick>& suggestedAnchors() {
  static const std::vector<AnchorToPick> anchors{
      {"LIP_CORNER_R", "corner of the mouth, the head's own right (left in a front view)"},
      {"LIP_CORNER_L", "corner of the mouth, the head's own left"},
      {"LIP_UP_MID", "middle of the upper lip's red edge, under the nose"},
      {"LIP_LO_MID", "middle of the lower lip's red edge, above the chin"},
      {"NOSE_TIP", "tip of the nose"},
      {"CHIN_LOW", "lowest point of the chin, in the middle"},
      {"CANTHUS_OUT_R", "outer corner of the right eye (left in a front view)"},
      {"CANTHUS_OUT_L", "outer corner of the left eye"},
      {"EYE_IN_R", "inner corner of the right eye"},
      {"EYE_IN_L", "inner corner of the left eye"}};
  return anchors;
}

std::string facePage(const FaceMesh& mesh, std::string_view name, const std::map<std::string, Eigen::Vector3d>& places,
                     const std::vector<AnchorToPick>& to_pick) {
  json data{{"name", name}, {"parts", json::array()}, {"places", json::object()}, {"to_pick", json::array()}};
  for (const MeshPart& part : mesh.parts) {
    data["parts"].push_back({{"name", part.name},
                             {"first", part.first_triangle},
                             {"count", part.triangle_count},
                             {"color", {part.base_color[0], part.base_color[1], part.base_color[2]}}});
  }
  for (const auto& [marker, place] : places) data["places"][marker] = {place.x(), place.y(), place.z()};
  for (const AnchorToPick& anchor : to_pick)
    data["to_pick"].push_back({{"name", anchor.name}, {"place", anchor.place}});
  data["positions"] =
      base64(bytesOf(mesh.vertices.data(), static_cast<std::size_t>(mesh.vertices.size()) * sizeof(float)));
  data["triangles"] = base64(bytesOf(mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle)));
  const std::size_t at = kFacePageTemplate.find(kPlaceholder);
  MOUTHPIECE_EXPECT(at != std::string_view::npos);
  std::string page(kFacePageTemplate.substr(0, at));
  page += scriptSafe(data);
  page += kFacePageTemplate.substr(at + kPlaceholder.size());
  return page;
}

}  // namespace mouthpiece
