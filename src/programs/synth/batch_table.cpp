#include "programs/synth/batch_input.h"

#include <algorithm>
#include <map>

#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kSeparators = ",;\t|";

/// Cells of one row after another, whatever is wrong with them.
class Rows {
 public:
  Rows(std::string_view text, char separator) : text_(text), separator_(separator) {}

  /// False at the end. A fault of the row that it gives is left in fault().
  bool next(DelimitedTable::Row& row) {
    if (at_ >= text_.size()) return false;
    row = {line_, {}};
    fault_.clear();
    bool more = true;
    while (more) {
      row.cells.push_back(at_ < text_.size() && text_[at_] == '"' ? quotedCell() : plainCell());
      more = at_ < text_.size() && text_[at_] == separator_;
      if (more) ++at_;
    }
    if (at_ < text_.size() && text_[at_] == '\r') ++at_;
    if (at_ < text_.size() && text_[at_] == '\n') ++at_;
    ++line_;
    return true;
  }
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  std::string plainCell() {
    std::size_t end = at_;
    while (end < text_.size() && text_[end] != separator_ && text_[end] != '\r' && text_[end] != '\n') ++end;
    std::string cell(text_.substr(at_, end - at_));
    at_ = end;
    return cell;
  }

  std::string quotedCell() {
    const std::size_t opening = at_, opening_line = line_;
    std::string cell;
    for (++at_; at_ < text_.size(); ++at_) {
      if (text_[at_] == '"') {
        ++at_;
        if (at_ >= text_.size() || text_[at_] != '"') {
          const std::string rest = plainCell();
          const bool is_closed = rest.find_first_not_of(" \t") == std::string::npos;
          if (!is_closed && line_ > opening_line) break;  // it was the next quoted cell's opening
          if (!is_closed)
            fault_ = "found text after a closing quote; expected the next cell (a quote inside a text is written \"\")";
          return cell;
        }
      }
      if (text_[at_] == '\n') ++line_;
      cell += text_[at_];
    }
    // What follows the quote's own line are rows again.
    fault_ = "found a quote that never closes; expected \" before the file ends";
    at_ = opening;
    line_ = opening_line;
    return plainCell();
  }

  std::string_view text_;
  char separator_;
  std::size_t at_ = 0, line_ = 1;
  std::string fault_;
};

bool isEmpty(const DelimitedTable::Row& row) {
  return std::all_of(row.cells.begin(), row.cells.end(),
                     [](const std::string& cell) { return cell.find_first_not_of(" \t") == std::string::npos; });
}

/// The one that most of the first rows hold equally often; of several the one with more cells.
char separatorOf(std::string_view text) {
  constexpr std::size_t kRowsLookedAt = 50;
  char best = ',';
  std::pair<std::size_t, std::size_t> most{0, 0};  // rows that agree, cells
  for (const char separator : kSeparators) {
    Rows rows(text, separator);
    DelimitedTable::Row row;
    std::map<std::size_t, std::size_t> rows_of_size;
    for (std::size_t i = 0; i < kRowsLookedAt && rows.next(row);) {
      if (isEmpty(row)) continue;
      ++rows_of_size[row.cells.size()];
      ++i;
    }
    rows_of_size.erase(1);
    for (const auto& [cells, count] : rows_of_size) {
      const std::pair<std::size_t, std::size_t> agreeing{count, cells};
      if (agreeing > most) {
        most = agreeing;
        best = separator;
      }
    }
  }
  return best;
}

}  // namespace

DelimitedTable parseDelimited(std::string_view bytes, std::string_view file) {
  expectText(bytes, file, "a table of lines, as CSV");
  DelimitedTable table;
  std::string text = decodeText(bytes, file);
  if (bytes.starts_with("\xFE\xFF") || bytes.starts_with("\xFF\xFE")) {
    table.encoding = "UTF-16";
  } else if (text.size() > bytes.size()) {  // a sign of one byte became one of several
    table.encoding = "Windows-1252";
  }
  // Old Macintosh line ends, where there are no others.
  if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');

  std::string_view rest = text;
  std::size_t skipped = 0;
  if (lowerCase(text.substr(0, 4)) == "sep=" && text.size() > 4 &&
      kSeparators.find(text[4]) != std::string_view::npos) {
    table.separator = text[4];
    const std::size_t end = rest.find('\n');
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
    skipped = 1;
  } else {
    table.separator = separatorOf(rest);
  }
  Rows rows(rest, table.separator);
  DelimitedTable::Row row;
  while (rows.next(row)) {
    row.line += skipped;
    if (!rows.fault().empty()) {
      table.faults.push_back({row.line, rows.fault()});
    } else if (!isEmpty(row)) {
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

}  // namespace mouthpiece
