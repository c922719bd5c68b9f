#pragma once

#include <string>

namespace mouthpiece::samples {

/// The LinePackage of a made-up line: an egg with a mouth that three takes of a made-up speaker move.
const std::string& packedLine();

}  // namespace mouthpiece::samples
