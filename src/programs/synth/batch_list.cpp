#include "programs/synth/batch_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>
#include <string_view>

#include "base/errors.h"
#include "base/files.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxListBytes = std::uint64_t{1} << 28;
constexpr std::size_t kMaxIdLength = 100;

struct Row {
  std::size_t line = 0;
  std::vector<std::string> fields;
};

/// RFC 4180: fields split at commas, quoted fields may hold commas, quotes ("") and line ends.
class CsvRows {
 public:
  CsvRows(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

  std::optional<Row> next() {
    if (at_ >= text_.size()) return std::nullopt;
    Row row{line_, {}};
    bool more = true;
    while (more) {
      row.fields.push_back(at_ < text_.size() && text_[at_] == '"' ? quotedField(row.line) : plainField());
      more = at_ < text_.size() && text_[at_] == ',';
      if (more) ++at_;
    }
    endRow(row.line);
    return row;
  }

 private:
  std::string plainField() {
    const std::size_t end = std::min(text_.find_first_of(",\r\n", at_), text_.size());
    std::string field(text_.substr(at_, end - at_));
    at_ = end;
    return field;
  }

  std::string quotedField(std::size_t line) {
    std::string field;
    for (++at_; at_ < text_.size(); ++at_) {
      if (text_[at_] == '"') {
        ++at_;
        if (at_ >= text_.size() || text_[at_] != '"') return field;
      }
      if (text_[at_] == '\n') ++line_;
      field += text_[at_];
    }
    throw InputError(file_, std::to_string(line), "found a quote that never closes; expected \" before the file ends");
  }

  void endRow(std::size_t line) {
    if (at_ < text_.size() && text_[at_] == '\r') ++at_;
    if (at_ >= text_.size()) return;
    if (text_[at_] != '\n') {
      throw InputError(file_, std::to_string(line),
                       "found text after a closing quote; expected a comma or the line's end");
    }
    ++at_;
    ++line_;
  }

  std::string_view text_;
  std::string file_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

bool isIdCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
}

void expectUsableId(const std::string& id, const std::string& file, std::size_t line) {
  const bool usable =
      !id.empty() && id.size() <= kMaxIdLength && id.front() != '.' && std::all_of(id.begin(), id.end(), isIdCharacter);
  if (!usable) {
    throw InputError(
        file, std::to_string(line),
        fmt::format("found the id '{}'; expected at most {} letters, digits, '_', '-' or '.', not starting with '.'",
                    printable(id), kMaxIdLength));
  }
}

/// What the columns after the id are.
enum class Columns { kText, kAudio, kAudioTranscript, kAudioPhones, kAudioTimes };

Columns columnsOf(const Row& header) {
  if (header.fields.size() == 2 && header.fields[1] == "audio") return Columns::kAudio;
  if (header.fields.size() != 3) return Columns::kText;
  if (header.fields[2] == "times") return Columns::kAudioTimes;
  return header.fields[2] == "phones" ? Columns::kAudioPhones : Columns::kAudioTranscript;
}

std::string_view expectedFields(Columns columns) {
  if (columns == Columns::kText) return "id,text; put a text with commas in quotes";
  if (columns == Columns::kAudio) return "id,audio";
  if (columns == Columns::kAudioTimes) return "id,audio,times";
  return columns == Columns::kAudioPhones ? "id,audio,phones" : "id,audio,transcript";
}

BatchLine batchLineFrom(const Row& row, Columns columns, const std::filesystem::path& list) {
  const std::size_t expected = columns == Columns::kText || columns == Columns::kAudio ? 2 : 3;
  if (row.fields.size() != expected) {
    throw InputError(
        list.string(), std::to_string(row.line),
        fmt::format("found {} fields; expected {} ({})", row.fields.size(), expected, expectedFields(columns)));
  }
  expectUsableId(row.fields[0], list.string(), row.line);
  BatchLine line{row.fields[0], {}};
  if (columns != Columns::kText) line.line.audio = list.parent_path() / row.fields[1];
  if (columns == Columns::kText) line.line.text = row.fields[1];
  if (columns == Columns::kAudioTranscript) line.line.text = row.fields[2];
  if (columns == Columns::kAudioPhones) line.line.phones = list.parent_path() / row.fields[2];
  if (columns == Columns::kAudioTimes) line.line.times = list.parent_path() / row.fields[2];
  return line;
}

}  // namespace

Shard parseShard(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto index = std::from_chars(text.data(), end, shard.index);
  if (index.ec == std::errc() && index.ptr != end && *index.ptr == '/') {
    const auto count = std::from_chars(index.ptr + 1, end, shard.count);
    if (count.ec == std::errc() && count.ptr == end && shard.index >= 1 && shard.index <= shard.count) return shard;
  }
  throw InputError("--shard", "", fmt::format("found '{}'; expected I/N with 1 <= I <= N, as 2/5", printable(text)));
}

std::vector<BatchLine> readBatchList(const std::filesystem::path& path) {
  const std::string text = readFile(path, kMaxListBytes);
  CsvRows rows(text, path.string());
  std::vector<BatchLine> lines;
  std::set<std::string> ids;
  Columns columns = Columns::kText;
  bool is_first = true;
  while (const auto row = rows.next()) {
    const bool is_header = is_first && row->fields[0] == "id";
    is_first = false;
    if (is_header) {
      columns = columnsOf(*row);
      continue;
    }
    if (row->fields.size() == 1 && row->fields[0].empty()) continue;
    lines.push_back(batchLineFrom(*row, columns, path));
    if (!ids.insert(lines.back().id).second) {
      throw InputError(path.string(), std::to_string(row->line),
                       fmt::format("found the id '{}' a second time; expected each once", lines.back().id));
    }
  }
  if (lines.empty()) throw InputError(path.string(), "", "holds no lines; expected rows of id,text");
  return lines;
}

std::vector<BatchLine> linesOfShard(const std::vector<BatchLine>& lines, const Shard& shard) {
  std::vector<BatchLine> mine;
  for (std::size_t i = shard.index - 1; i < lines.size(); i += shard.count) mine.push_back(lines[i]);
  return mine;
}

}  // namespace mouthpiece
