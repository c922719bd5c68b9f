// A head that turns: its nodes hang on one more, whose rotation is animated.
#include <cmath>
#include <numeric>

#include "base/errors.h"
#include "exports/gltf/glb_model.h"

namespace mouthpiece {

void GlbModel::addHead(std::span<const std::array<float, 4>> rotations, const std::array<double, 3>& pivot_m) {
  nlohmann::json& animation = root.at("animations").back();
  MOUTHPIECE_EXPECT(animation.value("name", "") == "speech");
  const std::size_t output = addAccessor(gltf::kFloat, GlbType::kVec4, rotations.size());
  root["accessors"][output]["bufferView"] =
      addView({reinterpret_cast<const char*>(rotations.data()), rotations.size_bytes()}, gltf::kNoTarget);
  nlohmann::json& nodes = root.at("nodes");
  nlohmann::json& shown = root.at("scenes").at(0).at("nodes");
  const std::size_t turning = nodes.size();
  nodes.push_back({{"name", "head"}, {"translation", pivot_m}, {"children", {turning + 1}}});
  nodes.push_back(
      {{"name", "head_rest"}, {"translation", {-pivot_m[0], -pivot_m[1], -pivot_m[2]}}, {"children", shown}});
  shown = {turning};
  const nlohmann::json input = animation.at("samplers").at(0).at("input");
  animation["samplers"].push_back({{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
  animation["channels"].push_back(
      {{"sampler", animation["samplers"].size() - 1}, {"target", {{"node", turning}, {"path", "rotation"}}}});
}

}  // namespace mouthpiece
