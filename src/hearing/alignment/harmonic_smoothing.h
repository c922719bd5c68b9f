#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace mouthpiece {

/// Takes the harmonics out of the decoder's cepstra, where those of a high voice pass for formants: the spectrum of
/// each voiced frame is averaged over one pitch to both sides before it goes through the mel bands. Other frames stay.
/// samples: at 16 kHz; cepstra: a row every 10 ms, as PocketSphinx' front end makes them of these samples.
void takeHarmonicsOut(std::span<const std::int16_t> samples, std::vector<std::vector<float>>& cepstra);

/// The front end's own cepstra of the frame that begins at sample `start`: what takeHarmonicsOut() goes by.
std::vector<float> frontEndCepstra(std::span<const std::int16_t> samples, std::size_t start, std::size_t count);

}  // namespace mouthpiece
