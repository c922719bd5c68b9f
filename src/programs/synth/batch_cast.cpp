#include "programs/synth/batch_input.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "base/json_text.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// A setting of `options` by its column's name, as `line` of `file` has it. False for a name that is none.
bool setBy(SpeakerOptions& options, std::string_view name, const std::string& value, const fs::path& file,
           std::size_t line) {
  const fs::path beside = file.parent_path();
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

nlohmann::ordered_json toJson(const StyleParameter& style) {
  if (style.constant) return *style.constant;
  if (style.automatic) return "auto";
  return fileHash(style.file);
}

}  // namespace

std::map<std::string, SpeakerOptions> readCast(const fs::path& path, const SpeakerOptions& usual) {
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
                       fmt::format("found {} cells; expected {}", row.cells.size(), header.cells.size()));
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

SharedCorpus SharedCast::corpus(const fs::path& file) {
  const std::scoped_lock lock(mutex_);
  const auto found = corpora_.find(file);
  return found != corpora_.end() ? found->second : corpora_.emplace(file, SharedCorpus(file)).first->second;
}

SharedFace SharedCast::face(const fs::path& file) {
  const std::scoped_lock lock(mutex_);
  const auto found = faces_.find(file);
  return found != faces_.end() ? found->second : faces_.emplace(file, SharedFace(file)).first->second;
}

std::string fileHash(const fs::path& file) {
  if (file.empty()) return "";
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file.string(), "", "cannot be read");
  // Of the pieces' hashes: no file is held in memory.
  constexpr std::size_t kPiece = std::size_t{1} << 24;
  std::string piece(kPiece, '\0'), hashes;
  while (stream.read(piece.data(), static_cast<std::streamsize>(piece.size())) || stream.gcount() > 0)
    hashes += sha256Hex(std::string_view(piece).substr(0, static_cast<std::size_t>(stream.gcount())));
  return hashes.size() == 64 ? hashes : sha256Hex(hashes);
}

std::string settingsJson(const SpeakerOptions& options, SharedCast& cast) {
  const Manner& manner = options.manner;
  nlohmann::ordered_json settings = {{"mouthpiece", MOUTHPIECE_VERSION},
                                     {"corpus", fileHash(cast.corpus(options.corpus).data().path)},
                                     {"voice", options.voice},
                                     {"rate", options.rate.value_or(0)},
                                     {"language", options.language},
                                     {"hear", static_cast<int>(options.hear)},
                                     {"lexicon", fileHash(options.lexicon)},
                                     {"fps", manner.frame_rate_hz},
                                     {"method", static_cast<int>(manner.method)},
                                     {"units", static_cast<int>(manner.units)},
                                     {"blend", static_cast<int>(manner.blend)},
                                     {"overlap_ms", manner.overlap_ms},
                                     {"backoff", static_cast<int>(manner.backoff)},
                                     {"style", static_cast<int>(manner.style)},
                                     {"ma", toJson(manner.ma)},
                                     {"ps", toJson(manner.ps)},
                                     {"ja", toJson(manner.ja)},
                                     {"li", toJson(manner.li)},
                                     {"edits", fileHash(manner.edits)}};
  if (options.with_face) {
    const SharedFace face = cast.face(options.face);
    settings["face"] = fileHash(face.data().path);
    settings["mesh"] = fileHash(face.data().meshPath());
  }
  return jsonText(settings);
}

}  // namespace mouthpiece
