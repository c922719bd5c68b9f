#include "base/counted.h"
#include "programs/synth/batch_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>
#include <optional>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "phonetics/language/language.h"
#include "phonetics/text/speakable_text.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxListBytes = std::uint64_t{1} << 28;
constexpr std::size_t kMaxIdLength = 100;

enum class Use { kId, kText, kAudio, kTranscript, kPhones, kTimes, kSong, kSongOffset, kSpeaker, kLanguage };

/// What the columns are called, in lower case, blanks and underlines left out; the first name is the usual one.
constexpr std::array<std::pair<Use, std::string_view>, 10> kColumnNames{{{Use::kId, "id key lineid stringid"},
                                                                         {Use::kText, "text line dialogue dialog"},
                                                                         {Use::kAudio, "audio wav sound recording"},
                                                                         {Use::kTranscript, "transcript"},
                                                                         {Use::kPhones, "phones labels"},
                                                                         {Use::kTimes, "times"},
                                                                         {Use::kSong, "song"},
                                                                         {Use::kSongOffset, "songoffset"},
                                                                         {Use::kSpeaker, "speaker character actor"},
                                                                         {Use::kLanguage, "language lang locale"}}};

std::string plainColumnName(std::string_view name) {
  std::string plain = lowerCase(trimmed(name));
  std::erase_if(plain, [](char c) { return c == ' ' || c == '_' || c == '-'; });
  return plain;
}

std::optional<Use> useOf(std::string_view name) {
  const std::string plain = plainColumnName(name);
  for (const auto& [use, names] : kColumnNames) {
    if (isWordOf(names, plain)) return use;
  }
  return std::nullopt;
}

/// The tag in `de`, `pt-BR`, `pt_BR`, `text_de` or `text:de`; "" for what names no language.
std::string languageTagOf(std::string_view column) {
  std::string name(trimmed(column));
  for (const std::string_view before : {"text_", "text-", "text:", "text "}) {
    if (lowerCase(name).starts_with(before)) name.erase(0, before.size());
  }
  if (name.find('.') != std::string::npos) return "";
  std::replace(name.begin(), name.end(), '_', '-');
  const std::size_t part = std::min(name.find('-'), name.size());
  if (part < 2 || part > 3 || name.size() > 11) return "";
  try {
    languageOf(name);
  } catch (const InputError&) {
    return "";
  }
  return name;
}

bool isIdCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
}

bool isUsableId(const std::string& id) {
  return !id.empty() && id.size() <= kMaxIdLength && id.front() != '.' && id.front() != '-' && id.back() != '.' &&
         std::all_of(id.begin(), id.end(), isIdCharacter) && !isDeviceName(id);
}

[[noreturn]] void refuseAlike(const DelimitedTable::Row& first, std::size_t a, std::size_t b, const std::string& file) {
  throw InputError(file, std::to_string(first.line),
                   fmt::format("found the columns '{}' and '{}', which mean the same; expected one of them",
                               printable(first.cells[a]), printable(first.cells[b])));
}

/// Where things stand in a row.
struct Columns {
  std::map<Use, std::size_t> of;
  std::vector<std::pair<std::size_t, std::string>> languages;  ///< columns of texts, and their tags
  std::vector<std::size_t> others;
  std::size_t count = 0;
  bool has_header = true;

  [[nodiscard]] bool has(Use use) const { return of.contains(use); }
  [[nodiscard]] std::string cell(const DelimitedTable::Row& row, Use use) const {
    const auto found = of.find(use);
    return found == of.end() ? std::string() : std::string(trimmed(row.cells[found->second]));
  }
};

/// Of several columns that may be meant the one with the usual name. Throws InputError where none has it, or two.
std::map<Use, std::size_t> usesOf(const DelimitedTable::Row& first, const std::string& file) {
  std::map<Use, std::size_t> uses;
  for (const auto& [use, names] : kColumnNames) {
    std::vector<std::size_t> candidates;
    for (std::size_t i = 0; i < first.cells.size(); ++i) {
      if (useOf(first.cells[i]) == use) candidates.push_back(i);
    }
    std::vector<std::size_t> usual;
    std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(usual),
                 [&, usual_name = names.substr(0, names.find(' '))](std::size_t i) {
                   return plainColumnName(first.cells[i]) == usual_name;
                 });
    const std::vector<std::size_t>& meant = usual.empty() ? candidates : usual;
    if (meant.size() > 1) refuseAlike(first, meant[0], meant[1], file);
    if (!meant.empty()) uses[use] = meant.front();
  }
  return uses;
}

/// The columns that `first` names; without a text, a sound or an id among them it is a row of id, text itself.
Columns columnsOf(const DelimitedTable::Row& first, const std::string& file) {
  Columns columns;
  columns.count = first.cells.size();
  columns.of = usesOf(first, file);
  std::vector<bool> is_used(first.cells.size(), false);
  for (const auto& [use, column] : columns.of) is_used[column] = true;
  const bool has_words = columns.has(Use::kText) || columns.has(Use::kAudio) || columns.has(Use::kSong);
  for (std::size_t i = 0; i < first.cells.size(); ++i) {
    if (is_used[i]) continue;
    const std::string tag = has_words || !columns.has(Use::kId) ? "" : languageTagOf(first.cells[i]);
    if (tag.empty()) {
      columns.others.push_back(i);
    } else {
      for (const auto& [column, other] : columns.languages) {
        if (lowerCase(other) == lowerCase(tag)) refuseAlike(first, column, i, file);
      }
      columns.languages.emplace_back(i, tag);
    }
  }
  if (!columns.has(Use::kId) && !has_words) {
    if (first.cells.size() != 2)
      throw InputError(
          file, std::to_string(first.line),
          fmt::format("found {} without names; expected a first row that names them, with id and text, audio "
                      "or song, among them",
                      counted(first.cells.size(), "column")));
    return {{{Use::kId, 0}, {Use::kText, 1}}, {}, {}, 2, false};
  }
  if (!has_words && columns.languages.empty())
    throw InputError(file, std::to_string(first.line),
                     "found no column of text; expected one named text, audio or song, or one a language (de, pt-BR)");
  return columns;
}

/// Rows become lines, or faults.
class ListReader {
 public:
  ListReader(const std::filesystem::path& path, const std::vector<std::string>& languages)
      : path_(path), wanted_languages_(languages) {}

  BatchList read() && {
    DelimitedTable table = parseDelimited(readFile(path_, kMaxListBytes), path_.string());
    list_.faults = std::move(table.faults);
    if (table.encoding == "Windows-1252")
      list_.notices.emplace_back("is no UTF-8; it was read as Windows-1252: look at the first accented letters");
    if (table.rows.empty()) refuseEmpty();
    columns_ = columnsOf(table.rows.front(), path_.string());
    for (const std::size_t column : columns_.others) {
      list_.other_columns.push_back(std::string(trimmed(table.rows.front().cells[column])));
      if (isWordOf("voice corpus face rate lexicon", plainColumnName(list_.other_columns.back())))
        list_.notices.push_back(fmt::format("keeps its column '{}' and does not obey it: --cast tells who speaks how",
                                            printable(list_.other_columns.back())));
    }
    keepWantedLanguages();
    for (std::size_t i = columns_.has_header ? 1 : 0; i < table.rows.size(); ++i) readRow(table.rows[i]);
    if (empty_cells_ > 0)
      list_.notices.push_back(
          fmt::format("has {} in its columns of languages, left out", counted(empty_cells_, "empty cell")));
    if (list_.lines.empty() && list_.faults.empty()) refuseEmpty();
    std::stable_sort(list_.faults.begin(), list_.faults.end(),
                     [](const RowFault& a, const RowFault& b) { return a.row < b.row; });
    return std::move(list_);
  }

 private:
  [[noreturn]] void refuseEmpty() const {
    throw InputError(path_.string(), "", "holds no lines; expected rows of id,text");
  }

  void keepWantedLanguages() {
    if (wanted_languages_.empty()) return;
    std::string known;
    for (const auto& [column, tag] : columns_.languages) known += (known.empty() ? "" : " ") + tag;
    for (const std::string& wanted : wanted_languages_) {
      if (std::none_of(columns_.languages.begin(), columns_.languages.end(),
                       [&](const auto& column) { return lowerCase(column.second) == lowerCase(wanted); }))
        throw InputError(path_.string(), "",
                         fmt::format("has no column of the language {}; expected one of {}", printable(wanted),
                                     known.empty() ? "a table with a column a language" : known));
    }
    std::erase_if(columns_.languages, [&](const auto& column) {
      return std::none_of(wanted_languages_.begin(), wanted_languages_.end(),
                          [&](const std::string& wanted) { return lowerCase(wanted) == lowerCase(column.second); });
    });
  }

  void readRow(const DelimitedTable::Row& row) {
    const auto fault = [&](std::string what) { list_.faults.push_back({row.line, std::move(what)}); };
    if (row.cells.size() != columns_.count) {
      return fault(fmt::format("found {}; expected {}{}", counted(row.cells.size(), "cell"), columns_.count,
                               row.cells.size() > columns_.count ? " (put a text with commas in quotes)" : ""));
    }
    BatchLine line;
    line.row = row.line;
    line.id = columns_.has(Use::kId) ? columns_.cell(row, Use::kId) : fmt::format("{:05}", row.line);
    line.speaker = columns_.cell(row, Use::kSpeaker);
    if (!isUsableId(line.id))
      return fault(
          fmt::format("found the id '{}'; expected at most {} letters, digits, '_', '-' or '.', not starting "
                      "with '.' or '-', nor ending with '.', and no name of a device as CON",
                      printable(line.id), kMaxIdLength));
    const auto [first, is_new] = row_of_id_.try_emplace(lowerCase(line.id), row.line);
    if (!is_new)
      return fault(
          fmt::format("found the id '{}' a second time; expected each once, in whatever case (it is in row {} too)",
                      line.id, first->second));
    for (const std::size_t column : columns_.others) line.others.push_back(row.cells[column]);
    if (columns_.languages.empty()) return readLine(row, std::move(line), fault);
    for (const auto& [column, tag] : columns_.languages) {
      BatchLine one = line;
      one.language = tag;
      one.key = tag + "/" + line.id;
      one.line.text = trimmed(row.cells[column]);
      if (one.line.text.empty()) {
        ++empty_cells_;
      } else {
        keep(std::move(one), fault);
      }
    }
  }

  template <typename Fault>
  void readLine(const DelimitedTable::Row& row, BatchLine line, const Fault& fault) {
    line.key = line.id;
    line.language = columns_.cell(row, Use::kLanguage);
    try {
      if (!line.language.empty()) languageOf(line.language);
    } catch (const InputError& error) {
      return fault(error.what());
    }
    const std::string audio = columns_.cell(row, Use::kAudio);
    line.line.text = columns_.cell(row, Use::kText);
    if (!columns_.cell(row, Use::kSong).empty()) return readSong(row, std::move(line), fault);
    if (!columns_.cell(row, Use::kSongOffset).empty()) return fault("tells where a song begins; expected a song, too");
    if (audio.empty()) {
      if (line.line.text.empty()) return fault("found nothing to say; expected a text");
    } else {
      const std::filesystem::path beside = path_.parent_path();
      line.line.audio = beside / audio;
      if (const std::string said = columns_.cell(row, Use::kTranscript); !said.empty()) line.line.text = said;
      if (const std::string phones = columns_.cell(row, Use::kPhones); !phones.empty())
        line.line.phones = beside / phones;
      if (const std::string times = columns_.cell(row, Use::kTimes); !times.empty()) line.line.times = beside / times;
    }
    keep(std::move(line), fault);
  }

  /// A song, with its sound or to be sung.
  template <typename Fault>
  void readSong(const DelimitedTable::Row& row, BatchLine line, const Fault& fault) {
    for (const Use use : {Use::kText, Use::kTranscript, Use::kPhones, Use::kTimes}) {
      if (!columns_.cell(row, use).empty())
        return fault("found words beside a song; expected the song alone, or with its audio");
    }
    const std::filesystem::path beside = path_.parent_path();
    const std::string audio = columns_.cell(row, Use::kAudio), offset = columns_.cell(row, Use::kSongOffset);
    line.line = Line::singing(beside / columns_.cell(row, Use::kSong),
                              audio.empty() ? std::filesystem::path() : beside / audio);
    if (!offset.empty()) {
      line.line.song_offset = parseNumber(offset);
      if (audio.empty() || !line.line.song_offset)
        return fault(fmt::format("found the song offset '{}'; expected seconds, beside a song and its audio",
                                 printable(offset)));
    }
    keep(std::move(line), fault);
  }

  /// Files that are not there and texts that are too long are told now, not when the line's turn comes.
  template <typename Fault>
  void keep(BatchLine line, const Fault& fault) {
    for (const std::filesystem::path& file : {line.line.audio, line.line.phones, line.line.times, line.line.song}) {
      std::error_code no_such_name;  // longer than any
      if (file.empty() || std::filesystem::is_regular_file(file, no_such_name)) continue;
      return fault(fmt::format("names '{}', which is {}", printable(file.string(), 400),
                               std::filesystem::exists(file, no_such_name) ? "no regular file" : "not there"));
    }
    const auto characters = static_cast<std::size_t>(
        std::count_if(line.line.text.begin(), line.line.text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
    const std::size_t most = line.line.audio.empty() ? kMaxSpokenCharacters : kMaxTranscriptCharacters;
    if (characters > most)
      return fault(fmt::format("found a text of {} characters; expected at most {}", characters, most));
    list_.lines.push_back(std::move(line));
  }

  std::filesystem::path path_;
  std::vector<std::string> wanted_languages_;
  Columns columns_;
  std::map<std::string, std::size_t> row_of_id_;
  std::size_t empty_cells_ = 0;
  BatchList list_;
};

/// A setting of `options` by its column's name, as `line` of `file` has it. False for a name that is none.
bool setBy(SpeakerOptions& options, std::string_view name, const std::string& value, const std::filesystem::path& file,
           std::size_t line) {
  const std::filesystem::path beside = file.parent_path();
  if (name == "voice") {
    if (!value.empty()) options.voice = value;
  } else if (name == "language") {
    if (!value.empty()) options.language = value;
  } else if (name == "corpus") {
    if (!value.empty()) options.corpus = beside / value;
  } else if (name == "face") {
    if (!value.empty()) options.face = beside / value;
  } else if (name == "lexicon") {
    if (!value.empty()) options.lexicon = beside / value;
  } else if (name == "rate") {
    if (value.empty()) return true;
    options.rate = parseNumber(value);
    if (!options.rate)
      throw InputError(file.string(), std::to_string(line),
                       fmt::format("found the rate '{}'; expected 0.4 to 2.5", printable(value)));
  } else {
    return false;
  }
  return true;
}

}  // namespace

bool isDeviceName(std::string_view name) {
  const std::string stem = lowerCase(name.substr(0, name.find('.')));
  const bool is_port =
      stem.size() == 4 && (stem.starts_with("com") || stem.starts_with("lpt")) && stem[3] >= '1' && stem[3] <= '9';
  return is_port || isWordOf("con prn aux nul", stem);
}

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

BatchList readBatchList(const std::filesystem::path& path, const std::vector<std::string>& languages) {
  return ListReader(path, languages).read();
}

std::map<std::string, SpeakerOptions> readCast(const std::filesystem::path& path, const SpeakerOptions& usual) {
  constexpr std::uint64_t kMostBytes = 1 << 24;
  const DelimitedTable table = parseDelimited(readFile(path, kMostBytes), path.string());
  if (!table.faults.empty())
    throw InputError(path.string(), std::to_string(table.faults.front().row), table.faults.front().what);
  constexpr std::string_view kExpected =
      "expected a first row of speaker and some of voice corpus face language rate lexicon";
  if (table.rows.size() < 2) throw InputError(path.string(), "", fmt::format("names nobody; {}", kExpected));
  const DelimitedTable::Row& header = table.rows.front();
  std::map<std::string, SpeakerOptions> cast;
  for (std::size_t r = 1; r < table.rows.size(); ++r) {
    const DelimitedTable::Row& row = table.rows[r];
    SpeakerOptions options = usual;
    std::string speaker;
    if (row.cells.size() != header.cells.size())
      throw InputError(path.string(), std::to_string(row.line),
                       fmt::format("found {}; expected {}", counted(row.cells.size(), "cell"), header.cells.size()));
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      const std::string name = lowerCase(trimmed(header.cells[i])), value(trimmed(row.cells[i]));
      if (name == "speaker") {
        speaker = value;
      } else if (!setBy(options, name, value, path, row.line)) {
        throw InputError(path.string(), std::to_string(header.line),
                         fmt::format("found a column '{}'; {}", printable(name), kExpected));
      }
    }
    if (speaker.empty())
      throw InputError(path.string(), std::to_string(row.line), "names no speaker; expected one a row");
    if (!cast.emplace(speaker, options).second)
      throw InputError(path.string(), std::to_string(row.line),
                       fmt::format("names the speaker '{}' a second time; expected each once", printable(speaker)));
  }
  return cast;
}

std::vector<BatchLine> linesOfShard(const std::vector<BatchLine>& lines, const Shard& shard) {
  std::vector<BatchLine> mine;
  for (std::size_t i = shard.index - 1; i < lines.size(); i += shard.count) mine.push_back(lines[i]);
  return mine;
}

}  // namespace mouthpiece
