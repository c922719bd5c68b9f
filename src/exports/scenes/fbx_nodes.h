#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mouthpiece {

/// A record of a binary FBX file: a name, properties, records inside. Blender's notes on the format
/// (code.blender.org, 2013) name the parts.
class FbxNode {
 public:
  explicit FbxNode(std::string name) : name_(std::move(name)) {}

  FbxNode& add(std::string_view text);        ///< S
  FbxNode& addBytes(std::string_view bytes);  ///< R
  FbxNode& add(std::int32_t value);           ///< I
  FbxNode& add(std::int64_t value);           ///< L
  FbxNode& add(double value);                 ///< D
  FbxNode& add(const std::vector<std::int32_t>& values);
  FbxNode& add(const std::vector<std::int64_t>& values);
  FbxNode& add(const std::vector<float>& values);
  FbxNode& add(const std::vector<double>& values);

  /// A record inside; the reference holds until the next child.
  FbxNode& child(std::string name);
  /// A record inside with one property.
  template <typename Value>
  FbxNode& child(std::string name, const Value& value) {
    return child(std::move(name)).add(value);
  }
  /// A record P of Properties70: name, type, label, flags; values are added to what it returns.
  FbxNode& property(std::string_view name, std::string_view type, std::string_view label, std::string_view flags);

  void appendTo(std::string& file) const;

 private:
  std::string name_;
  std::string properties_;
  std::uint32_t property_count_ = 0;
  std::vector<FbxNode> children_;
};

/// The file: header, records, footer.
std::string fbxFile(const std::vector<FbxNode>& records);

/// A name and its class as FBX keeps them in one text.
std::string fbxName(std::string_view name, std::string_view kind);

}  // namespace mouthpiece
