#include "programs/synth/batch_input.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "base/json_text.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

nlohmann::ordered_json toJson(const StyleParameter& style) {
  if (style.constant) return *style.constant;
  if (style.automatic) return "auto";
  return fileHash(style.file);
}

}  // namespace

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
                                     {"voice", options.voice.empty() ? options.usual_voice : options.voice},
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
