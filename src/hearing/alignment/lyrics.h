#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace mouthpiece {

/// The words of a lyrics file that are sung: what stands in square brackets within a line ("[Chorus]", times as
/// "[00:12.50]") is left out. UTF-8, hostile; line ends stay.
std::string sungText(std::string_view lyrics);

/// sungText() of a file of at most 1 MiB. Throws InputError with its name where nothing in it is sung.
std::string readLyrics(const std::filesystem::path& path);

}  // namespace mouthpiece
