#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mouthpiece/line.h"
#include "mouthpiece/speaker.h"

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

/// Whether a file of this name, or with any ending behind it, would be a device on Windows: CON, lpt1.wav.
bool isDeviceName(std::string_view name);

/// One line to make.
struct BatchLine {
  std::string id;  ///< letters, digits, '.', '_' and '-'; no two of a list differ in case alone
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
/// dialogue), audio, transcript, phones, times, song, song offset, speaker (character), language (locale); others are
/// kept. Without text, audio and song, each column whose name is a language's tag is a text in it. A first row that
/// names neither makes the columns id, text. `languages`: of a table with a column a language, only these; empty: all.
/// Paths are relative to the list. Rows that cannot be used are faults; throws InputError for a file without any usable
/// column or row.
BatchList readBatchList(const std::filesystem::path& path, const std::vector<std::string>& languages = {});

std::vector<BatchLine> linesOfShard(const std::vector<BatchLine>& lines, const Shard& shard);

/// Who speaks how: a table with a first row of speaker and any of voice, corpus, face, language, rate, lexicon; paths
/// are relative to it. A speaker of the list that it does not name speaks as the options say.
std::map<std::string, SpeakerOptions> readCast(const std::filesystem::path& path, const SpeakerOptions& usual);

/// Corpora and faces, each opened once for all threads.
class SharedCast {
 public:
  SharedCorpus corpus(const std::filesystem::path& file);
  SharedFace face(const std::filesystem::path& file);

 private:
  std::mutex mutex_;
  std::map<std::filesystem::path, SharedCorpus> corpora_;
  std::map<std::filesystem::path, SharedFace> faces_;
};

/// What decides how a line comes out besides its words, as JSON: files by their SHA-256.
std::string settingsJson(const SpeakerOptions& options, SharedCast& cast);

/// SHA-256 of a file; "" for no file. Throws InputError for one of over `most` bytes, and for a pipe or a device.
std::string fileHash(const std::filesystem::path& file, std::uint64_t most = std::uint64_t{1} << 31);

/// Where a line's files go, relative to the folder: names with {id}, {language} and {speaker} for what differs, those
/// of `patterns` and {id}.FORMAT for each of `formats`; all usual files where there is neither. Throws InputError for a
/// name without {id}, with another place, outside of the folder, or with an ending that is no format's.
std::vector<std::string> filePatterns(std::span<const std::string> formats, std::vector<std::string> patterns);
/// A line's own, in the patterns' order.
std::vector<std::string> filesOfLine(const BatchLine& line, std::span<const std::string> patterns);

}  // namespace mouthpiece
