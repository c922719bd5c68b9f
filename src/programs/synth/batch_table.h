#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// A row that cannot be used, and what is wrong with it.
struct RowFault {
  std::size_t row = 0;  ///< line of the file, from 1
  std::string what;
};

/// Rows of cells as a spreadsheet saves them, all text UTF-8.
struct DelimitedTable {
  struct Row {
    std::size_t line = 0;  ///< of the file where it begins, from 1
    std::vector<std::string> cells;
  };
  std::vector<Row> rows;  ///< none is empty throughout
  char separator = ',';
  std::string encoding = "UTF-8";  ///< "UTF-8", "UTF-16" or "Windows-1252"
  std::vector<RowFault> faults;
};

/// RFC 4180 with `,`, `;`, tab or `|` between cells, whichever the first rows agree on, or a first line `sep=;` says;
/// UTF-8 or UTF-16 with their byte order marks, UTF-8 without, else Windows-1252. Rows with text behind a closing quote
/// are faults; so is a quote that never closes, which then ends with its line. Throws InputError for broken UTF-16.
DelimitedTable parseDelimited(std::string_view bytes, std::string_view file);

}  // namespace mouthpiece
