#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mouthpiece/performance.h"
#include "mouthpiece/version.h"

namespace mouthpiece {

/// A kind of file that a performance can be saved as.
struct Format {
  std::string_view ending;      ///< of the file's name, which tells the kind: ".glb", "curves.json"
  std::string_view usual_name;  ///< in an output folder: "face.glb"
  std::string_view what;        ///< a few words for people
  bool needs_face = false;
  bool in_folder = false;  ///< is among what `synth --out` writes
  bool has_arkit = false;  ///< ARKit's weights: with a face that has such shapes, fitted to these
};

/// All of them: the table that the programs, their help and the docs come from.
MOUTHPIECE_API std::span<const Format> formats();
/// The kind that `path` asks for by its ending, the longest that fits. Throws InputError that lists the known ones.
MOUTHPIECE_API const Format& formatOf(const std::filesystem::path& path);

/// Writes `path`, whose kind follows from its ending, under a temporary name that is then renamed; makes its folder.
/// Throws InputError when it cannot be written or needs what the performance lacks.
MOUTHPIECE_API void save(const Performance& performance, const std::filesystem::path& path);
/// The same for several files; a report among them comes last, so that it tells how long the others took. Subtitles of
/// a line without words are empty beside other files; where only such are asked for, it throws.
MOUTHPIECE_API void save(const Performance& performance, std::span<const std::filesystem::path> paths);
/// Hears how many pictures of a film are drawn, of how many.
using FilmProgress = std::function<void(std::size_t done, std::size_t all)>;
/// The same, telling how a film among them comes on.
MOUTHPIECE_API void save(const Performance& performance, std::span<const std::filesystem::path> paths,
                         const FilmProgress& tell);

/// What is worth telling of files that save() writes, a sentence each: subtitles of a line without words are empty.
MOUTHPIECE_API std::vector<std::string> notesOn(const Performance& performance,
                                                std::span<const std::filesystem::path> paths);

/// Where the files of an output folder go: every format that is in one, under its usual name.
MOUTHPIECE_API std::vector<std::filesystem::path> usualFiles(const std::filesystem::path& folder);

}  // namespace mouthpiece
