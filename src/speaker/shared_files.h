#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

namespace mouthpiece {

class WordNetwork;

/// A file of share/mouthpiece: in the folder that MOUTHPIECE_SHARE names, else beside the library or program that this
/// code is part of (`../share/mouthpiece/NAME` or a little above), so in the build folder as after an install, from any
/// working directory. Throws InputError that ends in `how_to_make` when there is no such file.
std::filesystem::path findSharedFile(std::string_view name, std::string_view how_to_make);
/// The corpus that an option names: none is the sample corpus, as is "sample", and "clock" its 55 sentences of the
/// paper's grammar, where no files have these names. Throws the same.
std::filesystem::path corpusFile(const std::filesystem::path& named);
/// The network that hears words, the same for all who hold it at a time; not there where nobody has brought it.
std::shared_ptr<WordNetwork> sharedWordNetwork();
/// The WebAssembly that `make wasm` builds for pages (src/page_engine). Throws InputError where nobody has.
std::filesystem::path pageEngineFile();

}  // namespace mouthpiece
