#include "programs/synth/batch_input.h"

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "base/file_parts.h"
#include "base/files.h"
#include "base/json_text.h"
#include "expression/expression.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// A corpus and a head were opened before: their readers have had their say.
constexpr std::uint64_t kOfAnySize = std::numeric_limits<std::uint64_t>::max();

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

std::string fileHash(const fs::path& file, std::uint64_t most) {
  if (file.empty()) return "";
  // Of the pieces' hashes: no file is held in memory.
  constexpr std::uint64_t kPiece = std::uint64_t{1} << 24;
  const FileReader reader(file, most);
  std::string hashes;
  for (std::uint64_t at = 0; at < reader.size(); at += kPiece) hashes += sha256Hex(reader.bytes(at, kPiece));
  return hashes.size() == 64 ? hashes : sha256Hex(hashes);
}

std::string settingsJson(const SpeakerOptions& options, SharedCast& cast) {
  const Manner& manner = options.manner;
  nlohmann::ordered_json settings = {{"mouthpiece", MOUTHPIECE_VERSION},
                                     {"corpus", fileHash(cast.corpus(options.corpus).data().path, kOfAnySize)},
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
                                     {"strength", toJson(manner.strength)},
                                     {"jaw", toJson(manner.jaw)},
                                     {"lips", toJson(manner.lips)},
                                     {"hold", toJson(manner.hold)},
                                     {"lead", toJson(manner.lead_ms)},
                                     {"smooth", toJson(manner.smooth_ms)},
                                     {"upper face", static_cast<int>(manner.upper_face)},
                                     {"gaze", manner.gaze},
                                     {"head motion", manner.head_motion},
                                     {"mood", manner.mood.empty() ? MoodPose{} : moodOf(manner.mood)},
                                     {"seed", manner.seed},
                                     {"edits", fileHash(manner.edits)},
                                     {"timing", options.timing},
                                     {"page engine", options.page_engine}};
  if (options.with_face) {
    const SharedFace face = cast.face(options.face);
    settings["face"] = fileHash(face.data().path, kOfAnySize);
    settings["mesh"] = fileHash(face.data().meshPath(), kOfAnySize);
  }
  return jsonText(settings);
}

}  // namespace mouthpiece
