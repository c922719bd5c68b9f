#pragma once

#include <cstddef>
#include <vector>

namespace mouthpiece {

/// Which of a sound's frames to hear so that a song lasts as long as the same words spoken: about `wanted` frames,
/// taken from where the spectrum changes, few from held vowels and pauses. Rising, with the first and the last frame;
/// all of them where there are no more than `wanted`. `cepstra`: a row of cepstral coefficients a frame, energy first.
std::vector<std::size_t> thinFrames(const std::vector<std::vector<float>>& cepstra, std::size_t wanted);

}  // namespace mouthpiece
