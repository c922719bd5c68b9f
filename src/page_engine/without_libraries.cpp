// What the page's engine has no library for: nothing that can be packed asks for it (whyNotPacked, LinePackage).
#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/unicode.h"

namespace mouthpiece {

SpectralFrames spectralFrames(const AudioClip& /*clip*/, Seconds /*step*/) {
  throw InputError("a page cannot measure sound; expected its measures in the packed line");
}

std::string toNfc(std::string_view text) { return toNfd(text); }

std::string toNfd(std::string_view /*text*/) {
  throw InputError("a page cannot take letters apart; expected phones of ARPAbet");
}

}  // namespace mouthpiece
