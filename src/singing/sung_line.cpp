#include "singing/sung_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/errors.h"
#include "hearing/tags/hear_tags.h"

namespace mouthpiece {
namespace {

constexpr std::array<SungVoice, 1> kVoices{
    {{"festival:kal_diphone", "Festival's singing mode, American man", singWithFestival}}};

}  // namespace

std::span<const SungVoice> sungVoices() { return kVoices; }

SungLine singSong(const Song& song, const SingingOptions& options) {
  checkSong(song, "song");
  const auto voice = std::find_if(kVoices.begin(), kVoices.end(), [&](const SungVoice& known) {
    return options.voice.empty() || known.name == options.voice;
  });
  if (voice == kVoices.end()) {
    throw InputError("voice", "",
                     fmt::format("found '{}'; expected one that sings: {}", printable(options.voice), kVoices[0].name));
  }
  return voice->sing(song, options);
}

SungLine hearSong(SpokenLine line) {
  SungLine heard;
  heard.tags = hearTags(line.audio, &line.labels);
  heard.warnings = soundWarnings(line.audio, &line.labels, heard.tags);
  heard.line = std::move(line);
  return heard;
}

}  // namespace mouthpiece
