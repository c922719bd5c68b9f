#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mouthpiece/line.h"
#include "programs/synth/batch_table.h"

namespace mouthpiece {

/// One line to make.
struct BatchLine {
  std::string id;  ///< letters, digits, '.', '_' and '-'
  std::string
      language;         ///< the tag of its column in a table with a column a language; else of its language cell; or ""
  std::string speaker;  ///< of its cell; "" without such a column
  std::size_t row = 0;  ///< line of the file
  Line line;
  std::vector<std::string> others;  ///< the cells of BatchList::other_columns

  /// What tells it from the list's other lines: "id", or "language/id" in a table with a column a language.
  std::string key;
};

struct BatchList {
  std::vector<BatchLine> lines;
  std::vector<std::string> other_columns;  ///< names of columns that are no business of ours
  std::vector<RowFault> faults;            ///< rows that are left out, in the order of the file
  std::vector<std::string> notices;        ///< how the file was understood, where that may surprise
};

/// Shard `index` of `count`, both from 1: the lines whose number modulo `count` is theirs.
struct Shard {
  std::size_t index = 1;
  std::size_t count = 1;
};

/// "2/5". Throws InputError.
Shard parseShard(const std::string& text);

/// Reads a list of lines (docs/guides/batch.md). The first row names the columns, in any order: id, text (line,
/// dialogue), audio, transcript, phones, times, speaker (character), language (locale); others are kept. Without text
/// and audio, each column whose name is a language's tag is a text in it. A first row that names neither makes the
/// columns id, text. `languages`: of a table with a column a language, only these; empty: all. Paths are relative to
/// the list. Rows that cannot be used are faults; throws InputError for a file without any usable column or row.
BatchList readBatchList(const std::filesystem::path& path, const std::vector<std::string>& languages = {});

std::vector<BatchLine> linesOfShard(const std::vector<BatchLine>& lines, const Shard& shard);

}  // namespace mouthpiece
