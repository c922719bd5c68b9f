#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace mouthpiece {

/// Takes the next bytes of a file.
using AppendBytes = std::function<void(std::string_view)>;
/// writeFileAtomically() for a file whose bytes come one part after the other.
void writeFileInParts(const std::filesystem::path& path, const std::function<void(const AppendBytes&)>& write);

}  // namespace mouthpiece
