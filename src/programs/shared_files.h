#pragma once

#include <filesystem>
#include <string_view>

namespace mouthpiece {

/// A file of share/mouthpiece beside the running program (`../share/mouthpiece/NAME` seen from its folder), so in the
/// build folder as after `make install`, from any working directory; the folder in MOUTHPIECE_SHARE goes before it.
/// Throws InputError that ends in `how_to_make` when there is no such file.
std::filesystem::path findSharedFile(std::string_view name, std::string_view how_to_make);

}  // namespace mouthpiece
