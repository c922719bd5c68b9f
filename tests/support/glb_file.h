#pragma once

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace mouthpiece::test {

/// Just enough of a GLB reader and writer to check ours by another route: the chunks, accessors as plain numbers with
/// sparse ones filled in.
class GlbFile {
 public:
  explicit GlbFile(const std::string& glb) {
    if (glb.substr(0, 4) != "glTF" || word(glb, 4) != 2 || word(glb, 8) != glb.size())
      throw std::runtime_error("header");
    const std::size_t json_bytes = word(glb, 12);
    if (glb.substr(16, 4) != "JSON" || json_bytes % 4 != 0) throw std::runtime_error("JSON chunk");
    root = nlohmann::json::parse(glb.substr(20, json_bytes));
    const std::size_t bin = 20 + json_bytes;
    if (bin == glb.size()) return;  // accessors without data need no chunk
    if (glb.substr(bin + 4, 4) != std::string("BIN\0", 4) || bin + 8 + word(glb, bin) != glb.size()) {
      throw std::runtime_error("BIN chunk");
    }
    binary = glb.substr(bin + 8);
  }

  nlohmann::json root;
  std::string binary;

  /// The file again, of what root and binary now are.
  [[nodiscard]] std::string toBytes() const {
    std::string json = root.dump(), padded = binary;
    json.append((4 - json.size() % 4) % 4, ' ');
    padded.append((4 - padded.size() % 4) % 4, '\0');
    std::string glb = "glTF";
    const auto append = [&](std::size_t word) {
      for (unsigned shift = 0; shift < 32; shift += 8) glb.push_back(static_cast<char>(word >> shift));
    };
    append(2);
    append(28 + json.size() + padded.size());
    append(json.size());
    glb += "JSON" + json;
    append(padded.size());
    return glb + std::string("BIN\0", 4) + padded;
  }

  [[nodiscard]] std::vector<double> accessor(std::size_t index) const {
    const auto& accessor = root["accessors"].at(index);
    const std::size_t width = widthOf(accessor["type"]);
    const std::size_t count = accessor["count"].get<std::size_t>() * width;
    std::vector<double> values(count, 0.0);
    if (accessor.contains("bufferView")) values = numbers(accessor["bufferView"], accessor["componentType"], count);
    if (accessor.contains("sparse")) {
      const auto& sparse = accessor["sparse"];
      const std::size_t kept = sparse["count"];
      const auto places = numbers(sparse["indices"]["bufferView"], sparse["indices"]["componentType"], kept);
      const auto replaced = numbers(sparse["values"]["bufferView"], accessor["componentType"], kept * width);
      for (std::size_t i = 0; i < kept; ++i) {
        for (std::size_t axis = 0; axis < width; ++axis) {
          values.at(static_cast<std::size_t>(places[i]) * width + axis) = replaced[i * width + axis];
        }
      }
    }
    return values;
  }

 private:
  static std::uint32_t word(const std::string& bytes, std::size_t offset) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + offset, 4);
    return value;
  }

  static std::size_t widthOf(const std::string& type) {
    return type == "SCALAR" ? 1U : static_cast<std::size_t>(type.back() - '0');
  }

  template <typename T>
  [[nodiscard]] std::vector<double> read(std::size_t offset, std::size_t count) const {
    std::vector<T> values(count);
    if (offset + count * sizeof(T) > binary.size()) throw std::runtime_error("view beyond the buffer");
    std::memcpy(values.data(), binary.data() + offset, count * sizeof(T));
    return {values.begin(), values.end()};
  }

  [[nodiscard]] std::vector<double> numbers(std::size_t view_index, int component, std::size_t count) const {
    const auto& view = root["bufferViews"].at(view_index);
    const std::size_t offset = view.value("byteOffset", std::size_t{0});
    if (offset % 4 != 0) throw std::runtime_error("view not aligned");
    switch (component) {
      case 5123:
        return read<std::uint16_t>(offset, count);
      case 5125:
        return read<std::uint32_t>(offset, count);
      case 5126:
        return read<float>(offset, count);
      default:
        throw std::runtime_error("component type");
    }
  }
};

}  // namespace mouthpiece::test
