#include "base/json_fields.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/index.h"
#include "base/json_text.h"
#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr int kMaxDepth = 32;

/// The JSON library's own tree builder, stopped before hostile nesting overflows the stack; it keeps where it stopped.
class BoundedTreeBuilder : public nlohmann::detail::json_sax_dom_parser<json> {
  using Base = nlohmann::detail::json_sax_dom_parser<json>;

 public:
  /// `text` to count lines in; empty for CBOR.
  BoundedTreeBuilder(json& tree, std::string_view text) : Base(tree, false), text_(text) {}
  bool start_object(std::size_t length) { return deeper() && Base::start_object(length); }
  bool start_array(std::size_t length) { return deeper() && Base::start_array(length); }
  bool end_object() { return --depth_ >= 0 && Base::end_object(); }
  bool end_array() { return --depth_ >= 0 && Base::end_array(); }
  bool parse_error(std::size_t byte, const std::string& /*token*/, const json::exception& error) {
    constexpr int kNumberOverflow = 406;
    place = placeOf(byte);
    if (error.id == kNumberOverflow) fault = "holds a number out of range";
    return false;
  }

  std::string place, fault = "is no valid JSON";

 private:
  /// Line and column, as an editor counts them.
  [[nodiscard]] std::string placeOf(std::size_t byte) const {
    if (text_.empty()) return fmt::format("byte {}", byte);
    const std::string_view before = text_.substr(0, std::max<std::size_t>(byte, 1) - 1);
    const std::size_t line_start = before.rfind('\n') + 1;  // 0 when there is none
    return fmt::format("{}:{}", 1 + std::count(before.begin(), before.end(), '\n'), 1 + before.size() - line_start);
  }

  bool deeper() {
    if (++depth_ <= kMaxDepth) return true;
    fault = fmt::format("is nested deeper than {} levels", kMaxDepth);
    return false;
  }

  std::string_view text_;
  int depth_ = 0;
};

/// A JSON value as a message shows it.
std::string describe(const json& value) {
  if (value.is_array()) return fmt::format("a list of {}", value.size());
  if (value.is_object()) return fmt::format("an object of {}", value.size());
  if (value.is_binary()) return fmt::format("{} bytes", value.get_binary().size());
  return printable(value.dump(-1, ' ', false, json::error_handler_t::replace), 60);
}

/// The path of the node `wanted` below `node`, appended to `path`; false when it is not there.
bool findPath(const json& node, const json* wanted, std::string& path) {
  if (&node == wanted) return true;
  if (!node.is_structured()) return false;
  std::size_t place = 0;
  for (const auto& entry : node.items()) {
    const std::size_t length = path.size();
    path += node.is_array() ? fmt::format("[{}]", place++)
                            : fmt::format("{}{}", path.empty() ? "" : ".", printable(entry.key(), 60));
    if (findPath(entry.value(), wanted, path)) return true;
    path.resize(length);
  }
  return false;
}

std::string inRange(std::string_view what, auto least, auto most) {
  return fmt::format("{} from {} to {}", what, least, most);
}

}  // namespace

struct JsonField::Document {
  json root;
  std::string file;
  std::span<const std::uint8_t> blobs;  ///< of a CBOR sequence, in the caller's bytes
};

JsonField::JsonField(std::shared_ptr<const Document> document, const json& node, std::string missing_key)
    : document_(std::move(document)), node_(&node), missing_key_(std::move(missing_key)) {}

JsonField JsonField::operator[](std::string_view key) const {
  if (!isObject()) refuse("an object");
  const auto found = node_->find(key);
  if (found == node_->end()) return {document_, *node_, std::string(key)};
  return {document_, *found};
}

bool JsonField::isNull() const { return exists() && node_->is_null(); }
bool JsonField::isNumber() const { return exists() && node_->is_number(); }
bool JsonField::isWhole() const { return exists() && node_->is_number_integer(); }
bool JsonField::isText() const { return exists() && node_->is_string(); }
bool JsonField::isList() const { return exists() && node_->is_array(); }
bool JsonField::isObject() const { return exists() && node_->is_object(); }
std::size_t JsonField::size() const { return isList() || isObject() ? node_->size() : 0; }

double JsonField::number(double least, double most) const {
  const double value = isNumber() ? node_->get<double>() : std::nan("");
  if (value >= least && value <= most) return value;
  const bool is_limited = least > std::numeric_limits<double>::lowest() || most < std::numeric_limits<double>::max();
  refuse(is_limited ? inRange("a number", least, most) : "a number");
}

std::int64_t JsonField::whole(std::int64_t least, std::int64_t most) const {
  // What is beyond int64 would wrap; as a real number it is merely out of range.
  const double wide = isWhole() ? node_->get<double>() : std::nan("");
  if (!(wide >= asReal(least) && wide <= asReal(most))) refuse(inRange("a whole number", least, most));
  return node_->get<std::int64_t>();
}

bool JsonField::flag() const {
  if (!exists() || !node_->is_boolean()) refuse("true or false");
  return node_->get<bool>();
}

std::string JsonField::text(std::size_t most) const {
  if (!isText() || node_->get_ref<const std::string&>().size() > most)
    refuse(fmt::format("a text of at most {} bytes", most));
  return node_->get<std::string>();
}

std::string JsonField::name(std::size_t most) const {
  const auto isControl = [](unsigned char c) { return c < 0x20 || c == 0x7F; };
  std::string text = isText() ? node_->get<std::string>() : std::string();
  if (text.empty() || text.size() > most || std::any_of(text.begin(), text.end(), isControl))
    refuse(fmt::format("a name of 1 to {} printable bytes", most));
  return text;
}

std::size_t JsonField::choice(std::span<const std::string_view> words) const {
  const auto found =
      isText() ? std::find(words.begin(), words.end(), node_->get_ref<const std::string&>()) : words.end();
  if (found == words.end()) refuse(fmt::format("one of {}", fmt::join(words, ", ")));
  return unsignedIndex(found - words.begin());
}

std::vector<JsonField> JsonField::list(std::size_t least, std::size_t most) const {
  if (!isList() || size() < least || size() > most) {
    if (most >= kLongestList) refuse(least == 0 ? "a list" : fmt::format("a list of at least {}", least));
    refuse(fmt::format("a list of {} to {}", least, most));
  }
  std::vector<JsonField> entries;
  entries.reserve(size());
  for (const json& entry : *node_) entries.push_back({document_, entry});
  return entries;
}

std::vector<std::string> JsonField::names(std::size_t least, std::size_t most) const {
  std::vector<std::string> all;
  for (const JsonField& entry : list(least, most)) all.push_back(entry.name());
  return all;
}

Eigen::VectorXd JsonField::numbers(Eigen::Index count, double largest) const {
  if (!isList() || signedIndex(size()) != count) refuse(fmt::format("a list of {} numbers", count));
  Eigen::VectorXd values(count);
  Eigen::Index place = 0;
  for (const json& entry : *node_) {
    const double value = entry.is_number() ? entry.get<double>() : std::nan("");
    if (!(std::abs(value) <= largest)) JsonField(document_, entry).refuse(inRange("a number", -largest, largest));
    values[place++] = value;
  }
  return values;
}

std::vector<std::pair<std::string, JsonField>> JsonField::members() const {
  if (!isObject()) refuse("an object");
  std::vector<std::pair<std::string, JsonField>> entries;
  for (const auto& entry : node_->items()) entries.emplace_back(entry.key(), JsonField(document_, entry.value()));
  return entries;
}

std::span<const std::uint8_t> JsonField::bytes() const {
  if (exists() && node_->is_binary()) return node_->get_binary();
  const std::span<const std::uint8_t> blobs = document_->blobs;
  if (blobs.empty() || !isObject()) refuse("a blob of bytes");
  const std::int64_t first = (*this)["at"].whole(0, std::ssize(blobs));
  return blobs.subspan(unsignedIndex(first), unsignedIndex((*this)["bytes"].whole(0, std::ssize(blobs) - first)));
}

void JsonField::refuse(std::string_view expected) const {
  fail(exists() ? fmt::format("found {}; expected {}", describe(*node_), expected)
                : fmt::format("is missing; expected {}", expected));
}

void JsonField::fail(std::string_view what) const { throw InputError(file(), path(), what); }

const std::string& JsonField::file() const { return document_->file; }

std::string JsonField::path() const {
  std::string path;
  findPath(document_->root, node_, path);
  if (!exists()) path += (path.empty() ? "" : ".") + printable(missing_key_, 60);
  return path;
}

namespace {

constexpr std::size_t kBlobsHead = 9;  // its type and length

/// The byte string with long blobs that cborBytes() begins with; empty where there is none, or not all of it.
std::span<const std::uint8_t> leadingBlobs(std::string_view bytes) {
  if (bytes.size() < kBlobsHead || bytes.front() != kCborBlobsType) return {};
  std::uint64_t length = 0;
  for (std::size_t i = 1; i < kBlobsHead; ++i) length = length << 8 | static_cast<std::uint8_t>(bytes[i]);
  if (length > bytes.size() - kBlobsHead) return {};
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()) + kBlobsHead, static_cast<std::size_t>(length)};
}

json treeOf(std::string_view bytes, std::string_view file, std::string_view expected, bool is_cbor) {
  json tree;
  BoundedTreeBuilder builder(tree, is_cbor ? std::string_view() : bytes);
  if (is_cbor) builder.fault = "is no valid CBOR";
  bool is_read = false;
  try {
    is_read = json::sax_parse(bytes.begin(), bytes.end(), &builder,
                              is_cbor ? json::input_format_t::cbor : json::input_format_t::json);
  } catch (const json::exception&) {  // a length that no memory holds
  }
  if (!is_read || builder.is_errored())
    throw InputError(file, builder.place, fmt::format("{}; expected {}", builder.fault, expected));
  return tree;
}

}  // namespace

JsonField parseJson(std::string_view text, std::string_view file, std::string_view expected) {
  expectText(text, file, expected);
  const auto document = std::make_shared<JsonField::Document>();
  document->file = file;
  document->root = treeOf(text, file, expected, false);
  return {document, document->root};
}

JsonField parseCbor(std::string_view bytes, std::string_view file, std::string_view expected) {
  const auto document = std::make_shared<JsonField::Document>();
  document->file = file;
  document->blobs = leadingBlobs(bytes);
  if (!document->blobs.empty()) bytes.remove_prefix(kBlobsHead + document->blobs.size());
  document->root = treeOf(bytes, file, expected, true);
  return {document, document->root};
}

}  // namespace mouthpiece
