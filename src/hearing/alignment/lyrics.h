#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace mouthpiece {

/// The words of a lyrics file that are sung: what stands in square brackets within a line ("[Chorus]", times as
/// "[00:12.50]") is left out. UTF-8, hostile; line ends stay.
std::string sungText(std::string_view lyrics);

/// sungText() of bytes in any of the usual encodings. Throws InputError, with `name` in front, where nothing is sung.
std::string parseLyrics(std::string_view bytes, std::string_view name);
/// The same of a file of at most 1 MiB.
std::string readLyrics(const std::filesystem::path& path);

}  // namespace mouthpiece
