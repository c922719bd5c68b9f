#include "hearing/alignment/samples_to_hear.h"

#include <algorithm>

#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/phone_ear.h"

namespace mouthpiece {
namespace {

std::unique_ptr<UnnamedFile> fileOf(const AudioClip& audio) {
  if (audio.sample_rate_hz != SamplesToHear::kRateHz) return fileOf(resampleAudio(audio, SamplesToHear::kRateHz));
  constexpr std::size_t kAtOnce = 65536;
  auto file = std::make_unique<UnnamedFile>();
  AudioClip some{audio.sample_rate_hz, {}};
  for (std::size_t first = 0; first < audio.samples.size(); first += kAtOnce) {
    const auto begin = audio.samples.begin() + signedIndex(first);
    some.samples.assign(begin, begin + signedIndex(std::min(kAtOnce, audio.samples.size() - first)));
    const std::vector<std::int16_t> heard = samplesToHear(some);
    file->append(std::as_bytes(std::span(heard)));
  }
  return file;
}

}  // namespace

SamplesToHear::SamplesToHear(const AudioClip& audio) {
  if (audio.duration() > kInMemoryUntil) {
    try {
      file_ = fileOf(audio);
      const std::span<const std::byte> bytes = file_->bytes();
      all_ = {reinterpret_cast<const std::int16_t*>(bytes.data()), bytes.size() / sizeof(std::int16_t)};
      return;
    } catch (const InputError&) {  // a folder that is full or closed to us: they stay in memory
      file_.reset();
    }
  }
  samples_ = samplesToHear(audio);
  all_ = samples_;
}

}  // namespace mouthpiece
