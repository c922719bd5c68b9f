#include "retarget/rig/face_fields.h"

#include "base/errors.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr int kMaxDepth = 16;

/// The JSON library's own tree builder, stopped before hostile nesting overflows the stack.
class BoundedTreeBuilder : public nlohmann::detail::json_sax_dom_parser<json> {
  using Base = nlohmann::detail::json_sax_dom_parser<json>;

 public:
  explicit BoundedTreeBuilder(json& tree) : Base(tree, false) {}
  bool start_object(std::size_t length) { return ++depth_ <= kMaxDepth && Base::start_object(length); }
  bool start_array(std::size_t length) { return ++depth_ <= kMaxDepth && Base::start_array(length); }
  bool end_object() { return --depth_ >= 0 && Base::end_object(); }
  bool end_array() { return --depth_ >= 0 && Base::end_array(); }

 private:
  int depth_ = 0;
};

}  // namespace

json parseFaceTree(std::string_view bytes, const std::string& file) {
  json tree;
  BoundedTreeBuilder builder(tree);
  bool is_parsed = false;
  try {
    is_parsed = json::sax_parse(bytes.begin(), bytes.end(), &builder, nlohmann::detail::input_format_t::cbor);
  } catch (const json::exception&) {
    is_parsed = false;
  }
  if (!is_parsed || builder.is_errored() || !tree.is_object()) {
    throw InputError(file, "", "is damaged or no face file; expected what `retarget fit` writes");
  }
  return tree;
}

FaceFields::FaceFields(const json& map, std::string file, std::string place)
    : map_(map), file_(std::move(file)), place_(std::move(place)) {
  if (!map_.is_object()) fail("", "found no map");
}

const json& FaceFields::array(const char* key, std::size_t max_size) const {
  const json& value = at(key);
  if (!value.is_array() || value.size() > max_size)
    fail(key, fmt::format("expected a list of at most {} entries", max_size));
  return value;
}

std::string FaceFields::text(const char* key) const {
  const json& value = at(key);
  if (!value.is_string() || value.get_ref<const std::string&>().size() > kMaxFaceText) fail(key, "expected a text");
  return value.get<std::string>();
}

double FaceFields::number(const char* key, double least, double most) const {
  const json& value = at(key);
  if (!value.is_number()) fail(key, "expected a number");
  const double number = value.get<double>();
  if (!(number >= least && number <= most)) fail(key, fmt::format("found {}; expected {} to {}", number, least, most));
  return number;
}

std::int64_t FaceFields::whole(const char* key, std::int64_t least, std::int64_t most) const {
  const json& value = at(key);
  if (!value.is_number_integer()) fail(key, "expected a whole number");
  // A value beyond int64 would wrap; as a double it is merely out of range.
  const double wide = value.get<double>();
  if (!(wide >= static_cast<double>(least) && wide <= static_cast<double>(most))) {
    fail(key, fmt::format("found {}; expected {} to {}", wide, least, most));
  }
  return value.get<std::int64_t>();
}

bool FaceFields::flag(const char* key) const {
  const json& value = at(key);
  if (!value.is_boolean()) fail(key, "expected true or false");
  return value.get<bool>();
}

void FaceFields::fail(const char* key, std::string_view what) const { throw InputError(file_, pathOf(key), what); }

const json& FaceFields::at(const char* key) const {
  const auto entry = map_.find(key);
  if (entry == map_.end()) fail(key, "is missing");
  return *entry;
}

std::string FaceFields::pathOf(std::string_view key) const {
  return place_.empty() ? std::string(key) : key.empty() ? place_ : fmt::format("{}.{}", place_, key);
}

}  // namespace mouthpiece
