// Lists of lines as random spreadsheets save them: what was in the cells comes back, whatever stands around it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "mouthpiece/errors.h"
#include "programs/synth/batch_input.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

using Cells = std::vector<std::vector<std::string>>;

/// A way to save a table.
struct Dialect {
  char separator = ',';
  std::string line_end = "\n";
  bool is_named = false;       ///< by a first line, "sep=;"
  bool ends_with_line = true;  ///< after the last row
  double quotes = 0.5;         ///< share of the cells in quotes that need none
  int empty_rows = 0;
};

class Spreadsheets : public testing::TestWithParam<unsigned> {
 protected:
  std::size_t upTo(std::size_t most) { return random_() % (most + 1); }

  Dialect dialect() {
    return {",;\t|"[upTo(3)], upTo(1) == 0 ? "\n" : "\r\n", upTo(1) == 0, upTo(1) == 0, 0.3, static_cast<int>(upTo(2))};
  }

  /// Neither empty nor blank, so that its row is not.
  std::string word() {
    constexpr std::array<const char*, 9> kPieces{"a", "Zoe", "7", "\xC3\xA9", "\xE6\x97\xA5", "-", "\xF0\x9F\x98\x80",
                                                 "'", "x y"};
    std::string text;
    for (std::size_t i = upTo(3) + 1; i > 0; --i) text += kPieces[upTo(kPieces.size() - 1)];
    return text;
  }
  /// With what a cell must be quoted for.
  std::string text() {
    constexpr std::array<const char*, 6> kTroubles{",", ";", "\"", "\n", "\t", "|"};
    std::string text = word();
    for (std::size_t i = upTo(3); i > 0; --i) text += kTroubles[upTo(kTroubles.size() - 1)] + word();
    return text;
  }
  Cells table() {
    const std::size_t columns = 2 + upTo(3);
    Cells cells(1 + upTo(6), std::vector<std::string>(columns));
    for (auto& row : cells) {
      for (std::string& cell : row) cell = upTo(5) == 0 ? "" : text();
      row[upTo(columns - 1)] = text();
    }
    return cells;
  }

  std::string cellAs(const Dialect& as, const std::string& cell) {
    const bool needs_quotes = cell.find_first_of(std::string("\"\n\r") + as.separator) != std::string::npos;
    const bool has_quotes = needs_quotes || std::uniform_real_distribution<double>()(random_) < as.quotes;
    if (!has_quotes) return cell;
    std::string quoted = "\"";
    for (const char c : cell) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
  }

  /// The file's text, and in `lines` where each row begins.
  std::string saved(const Cells& cells, const Dialect& as, std::vector<std::size_t>& lines) {
    std::string text = as.is_named ? std::string("sep=") + as.separator + as.line_end : "";
    const auto line = [&] { return 1 + static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')); };
    for (std::size_t r = 0; r < cells.size(); ++r) {
      lines.push_back(line());
      for (std::size_t c = 0; c < cells[r].size(); ++c) {
        if (c > 0) text += as.separator;
        text += cellAs(as, cells[r][c]);
      }
      if (r + 1 < cells.size() || as.ends_with_line) text += as.line_end;
      for (int i = 0; i < as.empty_rows && r + 1 < cells.size(); ++i) text += as.line_end;
    }
    return text;
  }

  std::mt19937 random_{GetParam()};
};

/// UTF-16 of text in the basic plane and beyond it.
std::string utf16(const std::string& text, bool is_big) {
  std::string bytes = is_big ? "\xFE\xFF" : "\xFF\xFE";
  const auto add = [&](unsigned unit) {
    const std::array<char, 2> pair{static_cast<char>(unit >> 8U), static_cast<char>(unit & 0xFFU)};
    bytes += is_big ? pair[0] : pair[1];
    bytes += is_big ? pair[1] : pair[0];
  };
  for (std::size_t i = 0; i < text.size();) {
    const auto first = static_cast<unsigned char>(text[i]);
    const std::size_t length = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
    unsigned sign = length == 1 ? first : first & (0xFFU >> (length + 1));
    for (std::size_t k = 1; k < length; ++k) sign = sign << 6U | (static_cast<unsigned char>(text[i + k]) & 0x3FU);
    i += length;
    if (sign < 0x10000) {
      add(sign);
    } else {
      add(0xD800U + ((sign - 0x10000U) >> 10U));
      add(0xDC00U + ((sign - 0x10000U) & 0x3FFU));
    }
  }
  return bytes;
}

TEST_P(Spreadsheets, EveryCellComesBackAndItsRowIsFound) {
  const Cells cells = table();
  Dialect as = dialect();
  as.is_named = true;  // what separates random texts cannot be told otherwise
  std::vector<std::size_t> lines;
  const std::string text = saved(cells, as, lines);
  for (const std::string& bytes : {text, utf16(text, true), utf16(text, false)}) {
    const DelimitedTable read = parseDelimited(bytes, "random.csv");
    EXPECT_EQ(read.separator, as.separator);
    EXPECT_TRUE(read.faults.empty()) << text;
    ASSERT_EQ(read.rows.size(), cells.size()) << text;
    for (std::size_t r = 0; r < cells.size(); ++r) {
      EXPECT_EQ(read.rows[r].cells, cells[r]) << text;
      EXPECT_EQ(read.rows[r].line, lines[r]) << text;
    }
  }
}

TEST_P(Spreadsheets, TheSeparatorIsFoundWhereTextsAreQuoted) {
  Cells cells = table();
  while (cells.size() < 12) {  // rows that tell it, more than those whose texts might mislead
    cells.emplace_back(cells.front().size());
    for (std::string& cell : cells.back()) cell = word();
  }
  const Dialect as{dialect().separator, "\n", false, true, 1.0, 0};
  std::vector<std::size_t> lines;
  const DelimitedTable read = parseDelimited(saved(cells, as, lines), "random.csv");
  EXPECT_EQ(read.separator, as.separator);
  ASSERT_EQ(read.rows.size(), cells.size());
  for (std::size_t r = 0; r < cells.size(); ++r) EXPECT_EQ(read.rows[r].cells, cells[r]);
}

TEST_P(Spreadsheets, AnyCutIsReadAndLosesNoRowBeforeIt) {
  const Cells cells = table();
  Dialect as = dialect();
  as.is_named = true;
  std::vector<std::size_t> lines;
  const std::string whole = saved(cells, as, lines);
  std::size_t size = upTo(whole.size());
  // Half a letter would make Windows-1252 of the whole.
  while (size < whole.size() && (static_cast<unsigned char>(whole[size]) & 0xC0U) == 0x80U) ++size;
  const std::string cut = whole.substr(0, size);
  const auto line = 1 + static_cast<std::size_t>(std::count(cut.begin(), cut.end(), '\n'));
  DelimitedTable read;
  ASSERT_NO_THROW(read = parseDelimited(cut, "cut.csv"));
  for (std::size_t r = 0; r + 1 < cells.size() && lines[r + 1] < line; ++r) {
    const auto found = std::find_if(read.rows.begin(), read.rows.end(),
                                    [&](const DelimitedTable::Row& row) { return row.line == lines[r]; });
    ASSERT_NE(found, read.rows.end()) << cut;
    EXPECT_EQ(found->cells, cells[r]);
  }
}

/// A list of random lines, of which some are no good, and what must become of each row.
TEST_P(Spreadsheets, OfAListGoodRowsAreKeptAndBadOnesNamed) {
  std::vector<std::string> names{"id", "text", "Speaker", "note"};
  std::shuffle(names.begin(), names.end(), random_);
  Cells cells{names};
  const auto column = [&](std::string_view name) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  struct Wanted {
    std::string id, text, speaker, note;
  };
  std::vector<Wanted> good;
  std::set<std::size_t> bad;  // rows of the table
  std::set<std::string> ids;
  for (std::size_t r = 1; r <= 8; ++r) {
    constexpr std::array<const char*, 10> kIds{"a", "b.1", "C_d", "e-e", "f", "../g", ".h", "i j", "", "a"};
    const Wanted row{kIds[upTo(kIds.size() - 1)], upTo(6) == 0 ? " " : text(), word(), word()};
    cells.emplace_back(4);
    cells.back()[column("id")] = row.id;
    cells.back()[column("text")] = row.text;
    cells.back()[column("Speaker")] = row.speaker;
    cells.back()[column("note")] = row.note;
    const bool is_id = !row.id.empty() && row.id.find_first_of("/ ") == std::string::npos && row.id[0] != '.';
    // The first row of an id has it, though there may be nothing to say in it.
    const bool is_first = is_id && ids.insert(row.id).second;
    if (is_first && row.text != " ")
      good.push_back(row);
    else
      bad.insert(r);
  }
  if (good.empty()) return;
  Dialect as = dialect();
  as.is_named = true;
  std::vector<std::size_t> lines;
  const test::ScratchFolder scratch;
  const BatchList list = readBatchList(scratch.write("list.csv", saved(cells, as, lines)));
  ASSERT_EQ(list.lines.size(), good.size());
  for (std::size_t i = 0; i < good.size(); ++i) {
    EXPECT_EQ(list.lines[i].id, good[i].id);
    EXPECT_EQ(list.lines[i].line.text, good[i].text);
    EXPECT_EQ(list.lines[i].speaker, good[i].speaker);
    EXPECT_EQ(list.lines[i].others, std::vector<std::string>{good[i].note});
  }
  std::vector<std::size_t> told, wanted;
  for (const RowFault& fault : list.faults) told.push_back(fault.row);
  for (const std::size_t row : bad) wanted.push_back(lines[row]);
  EXPECT_EQ(told, wanted);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Spreadsheets, testing::Range(1U, 61U));

}  // namespace
}  // namespace mouthpiece
