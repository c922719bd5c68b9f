#include "exports/scenes/fbx_nodes.h"

#include <bit>
#include <cstring>

#include "base/errors.h"

namespace mouthpiece {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are");

constexpr std::uint32_t kVersion = 7400;
constexpr std::size_t kNullRecord = 13;  ///< zeros that end the records inside of one

template <typename Number>
void append(std::string& bytes, Number value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

template <typename Number>
void appendArray(std::string& bytes, char kind, const std::vector<Number>& values) {
  bytes.push_back(kind);
  append(bytes, static_cast<std::uint32_t>(values.size()));
  append(bytes, std::uint32_t{0});  // not compressed
  append(bytes, static_cast<std::uint32_t>(values.size() * sizeof(Number)));
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Number));
}

}  // namespace

FbxNode& FbxNode::add(std::string_view text) {
  properties_.push_back('S');
  append(properties_, static_cast<std::uint32_t>(text.size()));
  properties_ += text;
  ++property_count_;
  return *this;
}

FbxNode& FbxNode::addBytes(std::string_view bytes) {
  properties_.push_back('R');
  append(properties_, static_cast<std::uint32_t>(bytes.size()));
  properties_ += bytes;
  ++property_count_;
  return *this;
}

FbxNode& FbxNode::add(std::int32_t value) {
  properties_.push_back('I');
  append(properties_, value);
  ++property_count_;
  return *this;
}

FbxNode& FbxNode::add(std::int64_t value) {
  properties_.push_back('L');
  append(properties_, value);
  ++property_count_;
  return *this;
}

FbxNode& FbxNode::add(double value) {
  properties_.push_back('D');
  append(properties_, value);
  ++property_count_;
  return *this;
}

FbxNode& FbxNode::add(const std::vector<std::int32_t>& values) {
  appendArray(properties_, 'i', values);
  ++property_count_;
  return *this;
}

FbxNode& FbxNode::add(const std::vector<std::int64_t>& values) {
  appendArray(properties_, 'l', values);
  ++property_count_;
  return *this;
}

FbxNode& FbxNode::add(const std::vector<float>& values) {
  appendArray(properties_, 'f', values);
  ++property_count_;
  return *this;
}

FbxNode& FbxNode::add(const std::vector<double>& values) {
  appendArray(properties_, 'd', values);
  ++property_count_;
  return *this;
}

FbxNode& FbxNode::child(std::string name) { return children_.emplace_back(std::move(name)); }

FbxNode& FbxNode::property(std::string_view name, std::string_view type, std::string_view label,
                           std::string_view flags) {
  return child("P").add(name).add(type).add(label).add(flags);
}

void FbxNode::appendTo(std::string& file) const {
  const std::size_t start = file.size();
  append(file, std::uint32_t{0});  // where the record ends, once it is known
  append(file, property_count_);
  append(file, static_cast<std::uint32_t>(properties_.size()));
  file.push_back(static_cast<char>(name_.size()));
  file += name_;
  file += properties_;
  for (const FbxNode& inside : children_) inside.appendTo(file);
  if (!children_.empty() || property_count_ == 0 || name_ == "AnimationLayer") file.append(kNullRecord, '\0');
  MOUTHPIECE_EXPECT(file.size() < 0xFFFFFFFFU);
  const auto end = static_cast<std::uint32_t>(file.size());
  std::memcpy(file.data() + start, &end, sizeof(end));
}

std::string fbxName(std::string_view name, std::string_view kind) {
  std::string both(name);
  both += std::string_view("\0\x01", 2);
  both += kind;
  return both;
}

std::string fbxFile(const std::vector<FbxNode>& records) {
  std::string file("Kaydara FBX Binary  \0\x1A\0", 23);
  append(file, kVersion);
  for (const FbxNode& record : records) record.appendTo(file);
  file.append(kNullRecord, '\0');
  // The footer that belongs to the FileId and the CreationTime that the writer gives.
  file += "\xFA\xBC\xAB\x09\xD0\xC8\xD4\x66\xB1\x76\xFB\x83\x1C\xF7\x26\x7E";
  file.append(4, '\0');
  file.append(16 - file.size() % 16, '\0');
  append(file, kVersion);
  file.append(120, '\0');
  file += "\xF8\x5A\x8C\x6A\xDE\xF5\xD9\x7E\xEC\xE9\x0C\xE3\x75\x8F\x29\x0B";
  return file;
}

}  // namespace mouthpiece
