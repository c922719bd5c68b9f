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
  // All members by name: a new one does not compile here until it is told below.
  const auto& [frame_rate_hz, method, units, blend, overlap_ms, backoff, style, ma, ps, ja, li, strength, jaw, lips,
               hold, lead_ms, smooth_ms, upper_face, gaze, head_motion, mood, seed, edits] = options.manner;
  nlohmann::ordered_json settings = {{"mouthpiece", MOUTHPIECE_VERSION},
                                     {"corpus", fileHash(cast.corpus(options.corpus).data().path, kOfAnySize)},
                                     {"voice", options.voice.empty() ? options.usual_voice : options.voice},
                                     {"rate", options.rate.value_or(0)},
                                     {"language", options.language},
                                     {"hear", static_cast<int>(options.hear)},
                                     {"lexicon", fileHash(options.lexicon)},
                                     {"fps", frame_rate_hz},
                                     {"method", static_cast<int>(method)},
                                     {"units", static_cast<int>(units)},
                                     {"blend", static_cast<int>(blend)},
                                     {"overlap_ms", overlap_ms},
                                     {"backoff", static_cast<int>(backoff)},
                                     {"style", static_cast<int>(style)},
                                     {"ma", toJson(ma)},
                                     {"ps", toJson(ps)},
                                     {"ja", toJson(ja)},
                                     {"li", toJson(li)},
                                     {"strength", toJson(strength)},
                                     {"jaw", toJson(jaw)},
                                     {"lips", toJson(lips)},
                                     {"hold", toJson(hold)},
                                     {"lead", toJson(lead_ms)},
                                     {"smooth", toJson(smooth_ms)},
                                     {"upper face", static_cast<int>(upper_face)},
                                     {"gaze", gaze},
                                     {"head motion", head_motion},
                                     {"mood", mood.empty() ? MoodPose{} : moodOf(mood)},
                                     {"seed", seed},
                                     {"edits", fileHash(edits)},
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
