#include "motion/formats/c3d_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMaxBlocks = 255;
constexpr std::size_t kMaxDimensions = 7;

/// VAX F: the two 16-bit halves swapped, exponent bias 129 for a significand in [1, 2), no infinities.
double numberFromVax(std::uint32_t little_endian_word) {
  const std::uint32_t word = std::rotl(little_endian_word, 16);
  const std::uint32_t biased = word >> 23U & 0xFFU;
  if (biased == 0) return 0.0;
  const double magnitude = std::ldexp(1.0 + (word & 0x7FFFFFU) * 0x1p-23, std::int32_t(biased) - 129);
  return (word & 0x80000000U) != 0 ? -magnitude : magnitude;
}

std::string upperCase(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return result;
}

/// One entry of the parameter section: a group, or a parameter that names its group by number.
struct Entry {
  std::string name;
  int group_id = 0;  ///< negative: the entry is a group
  std::string_view body;
};

/// Cuts the section into entries; they may come in any order, groups after their parameters too.
std::vector<Entry> readEntries(ByteReader& reader, std::size_t section_end) {
  std::vector<Entry> entries;
  while (reader.position() + 2 <= section_end) {
    // A negative length marks a locked entry.
    const auto name_length = unsignedIndex(std::abs(reader.readI8()));
    const int group_id = reader.readI8();
    if (name_length == 0 || group_id == 0) break;
    Entry entry{upperCase(reader.readBytes(name_length)), group_id, {}};
    const std::size_t offset_place = reader.position();
    const std::size_t offset = reader.readU16();
    // The last entry may give no offset to a next one.
    const std::size_t next = offset == 0 ? section_end : offset_place + offset;
    if (next < reader.position() || next > section_end) {
      reader.fail(
          fmt::format("found an entry \"{}\" that runs to byte {}; expected it to end inside the parameter "
                      "section, at byte {} at most",
                      printable(entry.name), next, section_end));
    }
    entry.body = reader.readBytes(next - reader.position());
    entries.push_back(std::move(entry));
    if (offset == 0) break;
  }
  return entries;
}

C3dParameter parseParameter(const Entry& entry, const std::string& file) {
  ByteReader reader(entry.body, fmt::format("{}: parameter {}", file, printable(entry.name)));
  C3dParameter parameter;
  const int type = reader.readI8();
  if (type != -1 && type != 1 && type != 2 && type != 4) {
    reader.fail(fmt::format("found type {}; expected -1, 1, 2 or 4", type));
  }
  parameter.type = static_cast<C3dParameterType>(type);
  const std::size_t dimension_count = reader.readU8();
  if (dimension_count > kMaxDimensions) {
    reader.fail(fmt::format("found {} dimensions; expected at most {}", dimension_count, kMaxDimensions));
  }
  // At most 255^7 * 4, far inside 64 bits.
  std::uint64_t byte_count = unsignedIndex(std::abs(type));
  for (std::size_t i = 0; i < dimension_count; ++i) {
    parameter.dimensions.push_back(reader.readU8());
    byte_count *= parameter.dimensions.back();
  }
  if (byte_count > reader.remaining()) {
    reader.fail(fmt::format("found {} bytes of values; expected {}", reader.remaining(), byte_count));
  }
  parameter.data = reader.readBytes(byte_count);
  return parameter;
}

std::size_t sectionEnd(const ByteReader& reader, std::size_t start, std::size_t block_count) {
  // Some writers leave the block count zero; the entries then end themselves, within what a count could say.
  return std::min(reader.size(), start + (block_count == 0 ? kMaxBlocks : block_count) * kBlockBytes);
}

}  // namespace

double readC3dFloat(ByteReader& reader, C3dProcessor processor) {
  return processor == C3dProcessor::kDec ? numberFromVax(reader.readU32()) : double{reader.readF32()};
}

std::string c3dText(std::string_view row) {
  std::string text(row.substr(0, row.find('\0')));
  text.erase(text.find_last_not_of(" \t") + 1);
  return text;
}

ByteOrder C3dParameters::byteOrder() const {
  return processor_ == C3dProcessor::kMips ? ByteOrder::kBig : ByteOrder::kLittle;
}

C3dParameters C3dParameters::read(std::string_view bytes, std::string_view file, std::size_t first_block) {
  ByteReader reader(bytes, file);
  if (first_block < 1) reader.fail("found parameter block 0; expected 1 or more");
  const std::size_t start = (first_block - 1) * kBlockBytes;
  reader.seek(start);
  reader.skip(2);
  const std::size_t block_count = reader.readU8();
  const int processor = reader.readU8();
  if (processor < 84 || processor > 86) {
    reader.fail(fmt::format("found processor type {}; expected 84 (Intel), 85 (DEC) or 86 (MIPS)", processor));
  }
  C3dParameters parameters;
  parameters.file_ = std::string(file);
  parameters.processor_ = static_cast<C3dProcessor>(processor);
  reader.setOrder(parameters.byteOrder());
  const std::vector<Entry> entries = readEntries(reader, sectionEnd(reader, start, block_count));

  std::map<int, std::string> group_names;
  for (const Entry& entry : entries) {
    if (entry.group_id < 0) group_names.emplace(-entry.group_id, entry.name);
  }
  for (const Entry& entry : entries) {
    const auto group = group_names.find(entry.group_id);
    if (entry.group_id < 0 || group == group_names.end()) continue;
    parameters.parameters_.emplace(std::pair(group->second, entry.name), parseParameter(entry, parameters.file_));
  }
  return parameters;
}

const C3dParameter* C3dParameters::find(const std::string& group, const std::string& name) const {
  const auto found = parameters_.find({group, name});
  return found == parameters_.end() ? nullptr : &found->second;
}

std::vector<double> C3dParameters::numbers(const std::string& group, const std::string& name) const {
  const C3dParameter* parameter = find(group, name);
  std::vector<double> values;
  if (parameter == nullptr || parameter->type == C3dParameterType::kText) return values;
  ByteReader reader(parameter->data, file_, byteOrder());
  while (reader.remaining() > 0) {
    switch (parameter->type) {
      case C3dParameterType::kByte:
        values.push_back(reader.readU8());
        break;
      case C3dParameterType::kInteger:
        values.push_back(reader.readU16());
        break;
      default:
        values.push_back(readC3dFloat(reader, processor_));
    }
  }
  return values;
}

std::optional<double> C3dParameters::number(const std::string& group, const std::string& name) const {
  const std::vector<double> values = numbers(group, name);
  if (values.empty()) return std::nullopt;
  return values.front();
}

double C3dParameters::wideCount(const std::string& group, const std::string& name) const {
  const std::vector<double> values = numbers(group, name);
  if (values.empty()) return 0;
  const bool is_halved = find(group, name)->type == C3dParameterType::kInteger && values.size() >= 2;
  return is_halved ? values[0] + 65536.0 * values[1] : values[0];
}

std::vector<double> C3dParameters::allNumbers(const std::string& group, const std::string& name) const {
  std::vector<double> all = numbers(group, name);
  for (int i = 2; find(group, fmt::format("{}{}", name, i)) != nullptr; ++i) {
    const std::vector<double> more = numbers(group, fmt::format("{}{}", name, i));
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

std::vector<std::string> C3dParameters::allTexts(const std::string& group, const std::string& name,
                                                 std::size_t enough) const {
  std::vector<std::string> rows = texts(group, name);
  for (int i = 2; rows.size() < enough && find(group, fmt::format("{}{}", name, i)) != nullptr; ++i) {
    const std::vector<std::string> more = texts(group, fmt::format("{}{}", name, i));
    rows.insert(rows.end(), more.begin(), more.end());
  }
  return rows;
}

std::vector<std::string> C3dParameters::texts(const std::string& group, const std::string& name) const {
  const C3dParameter* parameter = find(group, name);
  std::vector<std::string> rows;
  if (parameter == nullptr || parameter->type != C3dParameterType::kText) return rows;
  const std::size_t row_length = parameter->dimensions.empty() ? 1 : parameter->dimensions.front();
  for (std::size_t start = 0; row_length > 0 && start < parameter->data.size(); start += row_length)
    rows.push_back(c3dText(parameter->data.substr(start, row_length)));
  return rows;
}

}  // namespace mouthpiece
