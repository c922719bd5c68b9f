#include "exports/film/film_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/parallel_for.h"
#include "base/text_encoding.h"
#include "base/zip.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr Seconds kLongestWriting = 24 * 3600;
constexpr const char* kSound = "sound.wav";
constexpr std::size_t kMostPngs = 60'000, kMostZipBytes = std::size_t{3} << 30U;

/// What ffmpeg is told to make, and of what.
struct Encoding {
  std::string file;  ///< in the private folder
  bool has_sound = false;
  Words options;
};

Encoding encodingFor(const std::string& ending) {
  if (ending == ".mp4")
    return {"film.mp4",
            true,
            {"-c:v",
             "libx264",
             "-preset",
             "veryfast",
             "-crf",
             "18",
             "-vf",
             "scale=out_color_matrix=bt709:out_range=tv",
             "-pix_fmt",
             "yuv420p",
             "-colorspace",
             "bt709",
             "-color_primaries",
             "bt709",
             "-color_trc",
             "bt709",
             "-c:a",
             "aac",
             "-b:a",
             "160k",
             "-movflags",
             "+faststart"}};
  if (ending == ".webm")
    return {"film.webm",
            true,
            {"-c:v", "libvpx-vp9", "-deadline", "realtime", "-cpu-used", "8", "-row-mt", "1", "-crf", "28", "-b:v", "0",
             "-pix_fmt", "yuv420p", "-c:a", "libopus", "-b:a", "96k"}};
  if (ending == ".gif")
    return {"film.gif",
            false,
            {"-filter_complex",
             "fps=min(25\\,source_fps),scale=iw/"
             "2:-1:flags=area,split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=bayer"}};
  return {"%06d.png", false, {"-c:v", "png", "-pred", "up"}};
}

/// The sound for as long as the pictures last, so that no player waits for either.
AudioClip soundFor(const Film& film) {
  AudioClip sound = film.sound;
  if (sound.sample_rate_hz <= 0) sound.sample_rate_hz = 16'000;
  const double seconds = asReal(film.frame_count) / film.frame_rate_hz;
  sound.samples.resize(unsignedIndex(std::lround(seconds * sound.sample_rate_hz)), 0.0F);
  return sound;
}

/// Draws all frames in order, some at a time on all threads, and hands them on as they are.
void feedFrames(const Film& film, const ChildInput& take, const std::function<void(std::size_t)>& tell) {
  const std::size_t batch = 2 * defaultThreadCount();
  std::vector<Picture> pictures(batch);
  for (std::size_t first = 0; first < film.frame_count; first += batch) {
    const std::size_t count = std::min(batch, film.frame_count - first);
    parallelFor(count, [&](std::size_t i) { film.paint(first + i, pictures[i]); });
    for (std::size_t i = 0; i < count; ++i) {
      const auto& rgb = pictures[i].rgb;
      if (!take({reinterpret_cast<const char*>(rgb.data()), rgb.size()})) return;
    }
    if (tell) tell(first + count);
  }
}

void packPictures(const fs::path& folder, const Film& film, const fs::path& path) {
  ZipWriter zip;
  for (std::size_t frame = 1; frame <= film.frame_count; ++frame) {
    const std::string name = fmt::format("{:06}.png", frame), bytes = readFile(folder / name);
    if (zip.size() + bytes.size() > kMostZipBytes)
      throw InputError(path.string(), "", "would be over 3 GiB; expected a shorter line");
    zip.add(name, bytes);
  }
  zip.add(kSound, readFile(folder / kSound));
  writeFileAtomically(path, std::move(zip).finish());
}

}  // namespace

void writeFilm(const fs::path& path, const Film& film, const std::function<void(std::size_t)>& tell) {
  const auto ffmpeg = findProgram("ffmpeg");
  if (!ffmpeg) throw InputError("ffmpeg", "", "is not installed. Get it with: sudo apt-get install ffmpeg");
  if (film.frame_count == 0) throw InputError(path.string(), "", "has no pictures; expected at least one frame");
  const std::string ending = lowerCase(path.extension().string());
  if (ending == ".zip" && film.frame_count > kMostPngs)
    throw InputError(path.string(), "",
                     fmt::format("would hold {} pictures; expected at most {}", film.frame_count, kMostPngs));
  const Encoding encoding = encodingFor(ending);
  const PrivateFolder folder;
  // Not as files for the user are written: those of a set wait for each other.
  std::ofstream(folder.path() / kSound, std::ios::binary) << wavBytes(soundFor(film));
  Words words{"-v",         "error",
              "-f",         "rawvideo",
              "-pix_fmt",   "rgb24",
              "-s",         fmt::format("{}x{}", film.width, film.height),
              "-framerate", fmt::format("{}", film.frame_rate_hz),
              "-i",         "pipe:0"};
  if (encoding.has_sound) words.insert(words.end(), {"-i", kSound, "-map", "0:v", "-map", "1:a"});
  words.insert(words.end(), encoding.options.begin(), encoding.options.end());
  words.push_back(encoding.file);
  const ChildResult result = runChild(*ffmpeg, words, folder.path(), kLongestWriting,
                                      [&](const ChildInput& take) { feedFrames(film, take, tell); });
  if (result.output.find("No space left") != std::string::npos)
    throw InputError(folder.path().parent_path().string(), "",
                     fmt::format("has no space left for {}, which is made there first", path.filename().string()));
  if (result.timed_out || result.exit_code != 0)
    throw InputError(path.string(), "", fmt::format("could not be made by ffmpeg: {}", printable(result.output, 300)));
  if (ending == ".zip") return packPictures(folder.path(), film, path);
  writeFileAtomically(path, [&](const fs::path& made) {
    fs::copy_file(folder.path() / encoding.file, made, fs::copy_options::overwrite_existing);
  });
}

}  // namespace mouthpiece
