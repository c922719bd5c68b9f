#include "tracking/video_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <exception>
#include <memory>
#include <string>
#include <thread>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSide = 8192;
constexpr Seconds kLongestReading = 24 * 3600;

/// A named pipe that ffmpeg writes into and we read from. Opening does not wait for the other end.
class Pipe {
 public:
  explicit Pipe(const fs::path& path) {
    if (::mkfifo(path.c_str(), 0600) != 0) throw InputError(path.string(), "", "takes no pipe");
    number_ = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (number_ < 0) throw InputError(path.string(), "", "takes no pipe");
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() { ::close(number_); }

  /// All of `count` bytes; false when the writer was done before. `is_over`: no writer will come any more.
  bool read(std::uint8_t* bytes, std::size_t count, const std::atomic<bool>& is_over) {
    while (count > 0) {
      const bool was_over = is_over;
      const ssize_t taken = ::read(number_, bytes, count);
      if (taken > 0) {
        bytes += taken;
        count -= unsignedIndex(taken);
      } else if (taken < 0 && errno != EAGAIN && errno != EINTR) {
        return false;
      } else {
        if (was_over) return false;
        pollfd waiting{number_, POLLIN, 0};
        ::poll(&waiting, 1, 20);
        if ((waiting.revents & POLLHUP) != 0 && (waiting.revents & POLLIN) == 0)
          std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    }
    return true;
  }

 private:
  int number_ = -1;
};

/// The next image of a row of binary PPMs.
class PpmReader {
 public:
  PpmReader(Pipe& pipe, const std::atomic<bool>& is_over, const std::string& name)
      : pipe_(pipe), is_over_(is_over), name_(name) {}

  bool next(VideoImage& image) {
    std::array<std::uint8_t, 2> magic{};
    if (!pipe_.read(magic.data(), 2, is_over_)) return false;
    if (magic[0] != 'P' || magic[1] != '6') refuse();
    image.width = number();
    image.height = number();
    if (number() != 255 || image.width == 0 || image.height == 0) refuse();
    image.rgb.resize(3 * image.width * image.height);
    return pipe_.read(image.rgb.data(), image.rgb.size(), is_over_);
  }

 private:
  [[noreturn]] void refuse() const { throw InputError(name_, "", "gave no images through ffmpeg"); }

  /// Blanks, digits, one blank.
  std::size_t number() {
    std::size_t value = 0;
    bool has_digit = false;
    while (true) {
      std::uint8_t byte = 0;
      if (!pipe_.read(&byte, 1, is_over_)) refuse();
      if (byte >= '0' && byte <= '9') {
        value = 10 * value + byte - '0';
        has_digit = true;
        if (value > kMaxSide) refuse();
      } else if (has_digit) {
        return value;
      }
    }
  }

  Pipe& pipe_;
  const std::atomic<bool>& is_over_;
  const std::string& name_;
};

/// The times in what ffmpeg's framecrc writes: a time base, and lines of stream, dts, pts, duration, bytes, checksum.
std::vector<Seconds> stampsIn(const fs::path& file) {
  const std::string text = readFile(file);
  std::vector<Seconds> times;
  std::vector<std::string_view> fields;
  std::string_view line;
  double tick = 0;
  for (LineReader lines(text); lines.next(line);) {
    if (line.starts_with("#tb 0: ")) {
      splitFields(line.substr(7), '/', fields);
      const auto above = parseNumber(fields.front()), below = parseNumber(fields.back());
      if (above && below && *below > 0) tick = *above / *below;
    } else if (!line.starts_with('#')) {
      splitFields(line, ',', fields);
      const auto stamp = fields.size() > 2 ? parseNumber(fields[2]) : std::nullopt;
      if (stamp) times.push_back(*stamp * tick);
    }
  }
  return times;
}

std::vector<std::string> ffmpegArguments(const fs::path& video, const fs::path& folder, const VideoReading& options,
                                         bool with_sound) {
  // Browsers' recorders give two images one time now and then: the first stays.
  const std::string rising = "select='isnan(prev_selected_pts)+gt(pts,prev_selected_pts)',";
  const std::string scale =
      fmt::format("scale=w='iw*sar*min(1,{0}/max(iw*sar,ih))':h='ih*min(1,{0}/max(iw*sar,ih))':flags=area,setsar=1",
                  options.longest_side);
  const std::vector<std::string> stamps{"-fps_mode", "passthrough", "-enc_time_base", "1:1000000"};
  std::vector<std::string> arguments{"-nostdin",
                                     "-v",
                                     "error",
                                     "-y",
                                     "-threads",
                                     "1",
                                     "-protocol_whitelist",
                                     "file",
                                     "-i",
                                     "file:" + fs::absolute(video).string()};
  const auto add = [&](const std::vector<std::string>& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
  };
  add({"-map", "0:v:0", "-vf", rising + scale});
  add(stamps);
  add({"-c:v", "ppm", "-f", "image2pipe", (folder / "images").string(), "-map", "0:v:0", "-vf",
       rising + "scale=16:16"});
  add(stamps);
  add({"-f", "framecrc", (folder / "stamps").string()});
  if (with_sound)
    add({"-map", "0:a:0", "-ac", "1", "-ar", fmt::format("{}", options.sound_rate_hz), "-af",
         "aresample=async=1:first_pts=0", (folder / "sound.wav").string()});
  return arguments;
}

/// ffmpeg's own words, the last line of them.
std::string lastLine(std::string_view output) {
  while (output.ends_with('\n')) output.remove_suffix(1);
  const auto line = output.rfind('\n');
  return printable(line == std::string_view::npos ? output : output.substr(line + 1), 160);
}

/// The sound's first `lead` seconds cut off, so that it begins with the first image.
AudioClip soundFrom(const fs::path& file, Seconds lead, int rate_hz) {
  std::error_code error;
  if (!fs::exists(file, error) || fs::file_size(file, error) <= 44 + 78) return {rate_hz, {}};
  AudioClip sound = readAudio(file, {.most = kLongestReading});
  const auto samples = static_cast<std::ptrdiff_t>(std::lround(lead * sound.sample_rate_hz));
  if (samples > 0) {
    sound.samples.erase(sound.samples.begin(),
                        sound.samples.begin() + std::min(samples, signedIndex(sound.samples.size())));
  } else {
    sound.samples.insert(sound.samples.begin(), unsignedIndex(-samples), 0.0F);
  }
  return sound;
}

struct Images {
  std::size_t count = 0;
  ChildResult ffmpeg;
};

/// Lets ffmpeg write images, stamps and sound into the folder, and shows the images on the way.
Images readImages(const fs::path& ffmpeg, const std::vector<std::string>& arguments, const fs::path& folder,
                  const std::string& name, const std::function<void(const VideoImage&)>& see) {
  auto pipe = std::make_unique<Pipe>(folder / "images");
  std::atomic<bool> is_over = false;
  Images read;
  std::exception_ptr failure;
  std::thread child([&] {
    try {
      read.ffmpeg = runChild(ffmpeg, arguments, folder, kLongestReading);
    } catch (...) {
      failure = std::current_exception();
    }
    is_over = true;
  });
  std::exception_ptr own_failure;
  try {
    PpmReader images(*pipe, is_over, name);
    for (VideoImage image; images.next(image); ++read.count) see(image);
  } catch (...) {
    own_failure = std::current_exception();
  }
  pipe.reset();  // ffmpeg ends when nobody reads
  child.join();
  fs::remove(folder / "images");
  if (own_failure) std::rethrow_exception(own_failure);
  if (failure) std::rethrow_exception(failure);
  return read;
}

/// What ffmpeg says where an MP4 or a Matroska file ends before its contents do. Of other containers it says nothing.
bool breaksOff(std::string_view said) {
  return said.find("partial file") != std::string_view::npos ||
         said.find("File ended prematurely") != std::string_view::npos;
}

}  // namespace

VideoSound readVideo(const fs::path& path, const VideoReading& options,
                     const std::function<void(const VideoImage&)>& see) {
  const std::string name = path.string();
  if (!fs::is_regular_file(path)) throw InputError(name, "", "is no file; expected a video");
  const auto ffmpeg = findProgram("ffmpeg");
  if (!ffmpeg)
    throw InputError("ffmpeg", "",
                     "is not here, and videos are read with it; get it with: sudo apt-get install ffmpeg");
  const PrivateFolder folder;
  Images images = readImages(*ffmpeg, ffmpegArguments(path, folder.path(), options, true), folder.path(), name, see);
  // A video without sound is what ffmpeg refuses to begin with.
  if (images.count == 0 && images.ffmpeg.output.find("matches no streams") != std::string::npos)
    images = readImages(*ffmpeg, ffmpegArguments(path, folder.path(), options, false), folder.path(), name, see);
  if (images.count == 0)
    throw InputError(name, "",
                     images.ffmpeg.output.find("matches no streams") != std::string::npos
                         ? "has no pictures; expected a video"
                         : fmt::format("shows no picture: {}", lastLine(images.ffmpeg.output)));
  if (breaksOff(images.ffmpeg.output))
    throw InputError(name, "", fmt::format("breaks off behind {} images; expected a whole file", images.count));
  VideoSound read;
  read.times = stampsIn(folder.path() / "stamps");
  if (read.times.size() < images.count)
    throw InputError(name, "", fmt::format("has {} images and times for {}", images.count, read.times.size()));
  read.times.resize(images.count);
  if (std::adjacent_find(read.times.begin(), read.times.end(), std::greater_equal<>()) != read.times.end())
    throw InputError(name, "", "has images whose times do not rise");
  read.sound = soundFrom(folder.path() / "sound.wav", read.times.front(), options.sound_rate_hz);
  return read;
}

}  // namespace mouthpiece
