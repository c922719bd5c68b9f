#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mouthpiece {

/// The lines of a Wavefront OBJ. One with a backslash at its end and what it goes on in count as one.
class ObjLines {
 public:
  /// `obj` outlives this; its byte order mark is passed over.
  explicit ObjLines(std::string_view obj);

  /// False behind the last one.
  bool next();

  [[nodiscard]] std::string_view text() const { return text_; }    ///< without its end; until next()
  [[nodiscard]] std::string_view bytes() const { return bytes_; }  ///< as it stands in the file, with its end
  [[nodiscard]] std::size_t number() const { return number_; }     ///< of where it begins, from 1
  [[nodiscard]] std::size_t count() const { return next_ - 1; }    ///< of the file's lines so far

 private:
  std::string_view obj_, text_, bytes_;
  std::string joined_;
  std::size_t end_ = 0, number_ = 0, next_ = 1;
};

/// Between words.
constexpr bool isObjBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
/// The first word of `line`, which is taken off.
std::string_view takeObjWord(std::string_view& line);

}  // namespace mouthpiece
