#include "deform/mesh/obj_lines.h"

#include <algorithm>

namespace mouthpiece {
namespace {

constexpr std::string_view kMark = "\xEF\xBB\xBF";

/// A backslash at its end says that the next line belongs to it; a comment may end in one ("C:\\work\\").
bool goesOn(std::string_view line) {
  while (!line.empty() && isObjBlank(line.front())) line.remove_prefix(1);
  if (line.starts_with('#')) return false;
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line.ends_with('\\');
}

}  // namespace

ObjLines::ObjLines(std::string_view obj) : obj_(obj), end_(obj.starts_with(kMark) ? kMark.size() : 0) {}

bool ObjLines::next() {
  if (end_ >= obj_.size()) return false;
  const std::size_t begin = end_;
  number_ = next_;
  bool is_closed = true;
  const auto take = [&] {
    const std::size_t first = end_, end = std::min(obj_.find('\n', first), obj_.size());
    is_closed = end < obj_.size();
    end_ = std::min(end + 1, obj_.size());
    ++next_;
    return obj_.substr(first, end - first);
  };
  text_ = take();
  if (goesOn(text_)) {
    joined_.clear();
    while (goesOn(text_) && is_closed) {
      joined_ += text_.substr(0, text_.rfind('\\'));
      joined_ += ' ';
      text_ = take();
    }
    joined_ += text_;
    text_ = joined_;
  }
  bytes_ = obj_.substr(begin, end_ - begin);
  return true;
}

std::string_view takeObjWord(std::string_view& line) {
  while (!line.empty() && isObjBlank(line.front())) line.remove_prefix(1);
  std::size_t length = 0;
  while (length < line.size() && !isObjBlank(line[length])) ++length;
  const std::string_view word = line.substr(0, length);
  line.remove_prefix(length);
  return word;
}

}  // namespace mouthpiece
