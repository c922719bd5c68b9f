#include "voices/spoken_line_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// The voices reckon in 32-bit floats: what is beyond a microsecond is noise, and ugly in a TextGrid.
void roundTimes(std::vector<PhoneSegment>& phones) {
  const auto rounded = [](Seconds time) { return std::round(time * 1e6) / 1e6; };
  for (PhoneSegment& phone : phones) phone.span = {rounded(phone.span.start), rounded(phone.span.end)};
}

}  // namespace

void SpokenLineBuilder::add(AudioClip audio, std::vector<PhoneSegment> phones, const std::vector<std::string>& words) {
  const bool is_said =
      std::any_of(phones.begin(), phones.end(), [](const PhoneSegment& p) { return p.phone != Phone::kSil; });
  if (!is_said || audio.samples.empty()) return;
  MOUTHPIECE_EXPECT(audio.sample_rate_hz > 0);
  roundTimes(phones);
  const auto label_samples = static_cast<std::size_t>(std::ceil(phones.back().span.end * audio.sample_rate_hz - 1e-3));
  audio.samples.resize(std::max(audio.samples.size(), label_samples), 0.0F);
  SpeechLabels labels = buildSpeechLabels(std::move(phones), words, audio.duration(), language_);
  if (line_.audio.samples.empty()) {
    line_.audio = std::move(audio);
    line_.labels = std::move(labels);
    return;
  }
  MOUTHPIECE_EXPECT(audio.sample_rate_hz == line_.audio.sample_rate_hz);
  appendSpeechLabels(line_.labels, labels);
  line_.audio.samples.insert(line_.audio.samples.end(), audio.samples.begin(), audio.samples.end());
}

SpokenLine SpokenLineBuilder::build(std::string text, std::string voice) {
  if (line_.labels.phones.empty()) {
    throw InputError("text", "",
                     fmt::format("has nothing to say in it: found '{}'; expected words", printable(text, 40)));
  }
  // The clocks of sound and labels end together to the last sample.
  line_.labels.phones.back().span.end = std::max(line_.labels.phones.back().span.end, line_.audio.duration());
  expectConsistent(line_.labels);
  line_.text = std::move(text);
  line_.voice = std::move(voice);
  return std::move(line_);
}

}  // namespace mouthpiece
