#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/byte_reader.h"
#include "base/index.h"

namespace mouthpiece {

/// A C3D file is made of such blocks.
inline constexpr std::size_t kBlockBytes = 512;

/// The processor byte of the parameter section.
enum class C3dProcessor : std::uint8_t { kIntel = 84, kDec = 85, kMips = 86 };

/// A 32-bit float as that processor stores it; DEC's is the VAX F format.
double readC3dFloat(ByteReader& reader, C3dProcessor processor);

/// A row of text, blanks and zero bytes cut off at the end.
std::string c3dText(std::string_view row);

/// Events further away than this, in seconds, are damage.
inline constexpr double kMaxEventTime = 1e7;

enum class C3dParameterType : std::int8_t { kText = -1, kByte = 1, kInteger = 2, kFloat = 4 };

struct C3dParameter {
  C3dParameterType type = C3dParameterType::kByte;
  std::vector<std::size_t> dimensions;  ///< empty: one value
  std::string_view data;                ///< as many bytes as type and dimensions ask for, in the file's byte order
};

/// All parameters of a C3D file, found by "GROUP", "NAME" (upper case). A view into the file's bytes.
class C3dParameters {
 public:
  /// `first_block` is the header's pointer, 1-based. Throws InputError for a section that does not parse.
  static C3dParameters read(std::string_view bytes, std::string_view file, std::size_t first_block);

  [[nodiscard]] C3dProcessor processor() const { return processor_; }
  [[nodiscard]] ByteOrder byteOrder() const;
  [[nodiscard]] const C3dParameter* find(const std::string& group, const std::string& name) const;
  /// Numbers of any type, integers taken as unsigned. Empty when there is no such parameter or it is text.
  [[nodiscard]] std::vector<double> numbers(const std::string& group, const std::string& name) const;
  [[nodiscard]] std::optional<double> number(const std::string& group, const std::string& name) const;
  /// A count that writers have stored as integer, as two 16-bit halves (low first) or as float; 0 when missing.
  [[nodiscard]] double wideCount(const std::string& group, const std::string& name) const;
  /// The same of NAME, NAME2, NAME3, ... one behind the other: a parameter holds 255 rows.
  [[nodiscard]] std::vector<double> allNumbers(const std::string& group, const std::string& name) const;
  /// Rows of the text parameters NAME, NAME2, ... Empty when they are missing or no text. `enough` ends the search.
  [[nodiscard]] std::vector<std::string> allTexts(const std::string& group, const std::string& name,
                                                  std::size_t enough) const;

 private:
  [[nodiscard]] std::vector<std::string> texts(const std::string& group, const std::string& name) const;

  std::string file_;
  C3dProcessor processor_ = C3dProcessor::kIntel;
  std::map<std::pair<std::string, std::string>, C3dParameter> parameters_;
};

}  // namespace mouthpiece
