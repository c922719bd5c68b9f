#include "deform/mesh/glb_document.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <set>
#include <utility>

#include "base/errors.h"
#include "base/json_text.h"
#include "deform/mesh/glb_chunks.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

/// Counts what names each accessor; a number inside of an extension may be one.
void countUses(const json& value, bool in_extension, std::map<std::size_t, int>& uses) {
  if (in_extension && value.is_number_unsigned()) ++uses[value.get<std::size_t>()];
  if (!value.is_structured()) return;
  for (const auto& [key, entry] : value.items()) {
    const bool names_one =
        value.is_object() && (key == "indices" || key == "input" || key == "output" || key == "inverseBindMatrices");
    if (names_one && entry.is_number_unsigned()) ++uses[entry.get<std::size_t>()];
    if (value.is_object() && key == "attributes" && entry.is_object()) {
      for (const json& attribute : entry) countUses(attribute, true, uses);
    } else if (value.is_object() && key == "targets" && entry.is_array()) {
      countUses(entry, true, uses);
    } else if (key != "extras") {
      countUses(entry, in_extension || (value.is_object() && key == "extensions"), uses);
    }
  }
}

/// Every place where a view is named, extensions' too: they all call it so.
template <typename Take>
void eachView(json& value, const Take& take) {
  if (!value.is_structured()) return;
  for (auto& [key, entry] : value.items()) {
    if (value.is_object() && key == "bufferView" && entry.is_number_unsigned())
      take(entry);
    else if (key != "extras")
      eachView(entry, take);
  }
}

}  // namespace

GlbDocument::GlbDocument(std::string_view glb, std::string_view file) {
  const GlbChunks chunks = glbChunks(glb, file);
  root_ = json::parse(chunks.json);
  binary_ = chunks.binary;
  const json buffers = root_.value("buffers", json::array());
  if (buffers.empty() || buffers[0].contains("uri"))
    throw InputError(std::string(file), "", "keeps its data outside of the file");
  for (const char* list : {"meshes", "skins", "animations", "extensions"})
    countUses(root_.value(list, json()), false, uses_);
}

std::string GlbDocument::bytes() {
  dropUnseenViews();
  dropUnseenBytes();
  root_["buffers"][0]["byteLength"] = binary_.size();
  return glbOf(jsonText(root_), std::move(binary_));
}

std::size_t GlbDocument::addAccessor(json accessor, const std::string& bytes, int target) {
  accessor["bufferView"] = putView(bytes, target, 0);
  root_["accessors"].push_back(std::move(accessor));
  return root_["accessors"].size() - 1;
}

std::size_t GlbDocument::putView(const std::string& bytes, int target, std::size_t stride) {
  binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
  json view{{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
  if (target > 0) view["target"] = target;
  if (stride > 0) view["byteStride"] = stride;
  binary_ += bytes;
  root_["bufferViews"].push_back(std::move(view));
  return root_["bufferViews"].size() - 1;
}

std::size_t GlbDocument::putAccessor(std::size_t old, json accessor, const std::string& bytes, int target,
                                     std::size_t stride) {
  accessor.erase("sparse");
  accessor.erase("byteOffset");
  accessor["bufferView"] = putView(bytes, target, stride);
  return keep(old, std::move(accessor));
}

std::size_t GlbDocument::putSparse(std::size_t old, json accessor, const std::vector<std::uint32_t>& places,
                                   const std::string& values) {
  for (const char* key : {"sparse", "byteOffset", "bufferView"}) accessor.erase(key);
  if (!places.empty()) {
    const json indices{{"bufferView", putView(bytesOf(places), 0, 0)},
                       {"componentType", TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT}};
    accessor["sparse"] = {
        {"count", places.size()}, {"indices", indices}, {"values", {{"bufferView", putView(values, 0, 0)}}}};
  }
  return keep(old, std::move(accessor));
}

std::size_t GlbDocument::keep(std::size_t old, json accessor) {
  json& accessors = root_["accessors"];
  if (uses_[old] <= claimed_[old]) {
    accessors.at(old) = std::move(accessor);
    return old;
  }
  accessors.push_back(std::move(accessor));
  return accessors.size() - 1;
}

/// Takes out views that nothing names.
void GlbDocument::dropUnseenViews() {
  std::set<std::size_t> seen;
  eachView(root_, [&](json& number) { seen.insert(number.get<std::size_t>()); });
  json kept = json::array();
  std::map<std::size_t, std::size_t> renamed;
  for (const std::size_t view : seen) {
    renamed[view] = kept.size();
    kept.push_back(root_["bufferViews"].at(view));
  }
  eachView(root_, [&](json& number) { number = renamed.at(number.get<std::size_t>()); });
  root_["bufferViews"] = std::move(kept);
}

/// Takes out of the chunk what no view shows, unless views overlap.
void GlbDocument::dropUnseenBytes() {
  std::vector<json*> views;
  for (json& view : root_["bufferViews"]) {
    if (view.value("buffer", std::size_t{0}) == 0) views.push_back(&view);
    if (view.contains("extensions")) return;
  }
  const auto offsetOf = [](const json* view) { return view->value("byteOffset", std::size_t{0}); };
  std::sort(views.begin(), views.end(), [&](const json* a, const json* b) { return offsetOf(a) < offsetOf(b); });
  std::size_t end = 0;
  for (const json* view : views) {
    if (offsetOf(view) < end) return;
    end = offsetOf(view) + view->at("byteLength").get<std::size_t>();
    if (end > binary_.size()) return;
  }
  std::string kept;
  for (json* view : views) {
    kept.resize((kept.size() + 3) / 4 * 4, '\0');
    const std::size_t from = offsetOf(view);
    (*view)["byteOffset"] = kept.size();
    kept.append(binary_, from, view->at("byteLength").get<std::size_t>());
  }
  binary_ = std::move(kept);
}

}  // namespace mouthpiece
