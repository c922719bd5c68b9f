#include <fmt/format.h>
#include <sndfile.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>

#include "audio/audio_clip.h"
#include "base/byte_reader.h"
#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr int kLowestRate = 1000;
constexpr int kHighestRate = 768000;
constexpr int kMostChannels = 64;
constexpr std::size_t kMostWavSamples = 0x7FFFFF00;  // of two bytes: a WAV counts its bytes in 32 bits

/// libsndfile reads what is there of a WAV cut short and says nothing; we want to know.
void checkWavLength(std::string_view bytes, std::string_view name) {
  ByteReader reader(bytes, name);
  reader.readBytes(12);
  while (reader.remaining() >= 8) {
    const std::size_t chunk = bytes.size() - reader.remaining();
    const std::string_view kind = reader.readBytes(4);
    const std::uint32_t size = reader.readU32();
    if (kind == "data") {
      if (size <= reader.remaining()) return;
      throw InputError(
          name, fmt::format("byte {}", chunk),
          fmt::format("claims {} bytes of sound, found {}; expected a whole file", size, reader.remaining()));
    }
    reader.readBytes(std::min(reader.remaining(), std::size_t{size} + size % 2));
  }
  throw InputError(name, "", fmt::format("is a WAV of {} bytes without sound; expected a chunk 'data'", bytes.size()));
}

/// With its tag before it, or a frame's first eleven bits; layer III.
bool isMp3(std::string_view bytes) {
  if (bytes.starts_with("ID3")) return true;
  return bytes.size() >= 4 && static_cast<unsigned char>(bytes[0]) == 0xFF &&
         (static_cast<unsigned char>(bytes[1]) & 0xE6U) == 0xE2U;
}

void checkKind(std::string_view bytes, std::string_view name) {
  const bool is_wav = bytes.size() >= 12 && bytes.starts_with("RIFF") && bytes.substr(8, 4) == "WAVE";
  const bool is_aiff = bytes.size() >= 12 && bytes.starts_with("FORM") && bytes.substr(8, 3) == "AIF";
  if (is_wav) return checkWavLength(bytes, name);
  if (is_aiff || bytes.starts_with("fLaC") || bytes.starts_with("OggS") || isMp3(bytes)) return;
  throw InputError(name, "",
                   fmt::format("starts with '{}'; expected a WAV, AIFF, FLAC, Ogg (Vorbis, Opus), MP3, M4A or AAC file",
                               printable(bytes.substr(0, 12))));
}

/// libsndfile opens more codecs than we want to be answerable for: these are let in.
bool isKnownCodec(int format) {
  constexpr std::array kCodecs = {SF_FORMAT_PCM_S8, SF_FORMAT_PCM_U8,        SF_FORMAT_PCM_16, SF_FORMAT_PCM_24,
                                  SF_FORMAT_PCM_32, SF_FORMAT_FLOAT,         SF_FORMAT_DOUBLE, SF_FORMAT_VORBIS,
                                  SF_FORMAT_OPUS,   SF_FORMAT_MPEG_LAYER_III};
  return std::find(kCodecs.begin(), kCodecs.end(), format & SF_FORMAT_SUBMASK) != kCodecs.end();
}

std::string codecName(int format) {
  SF_FORMAT_INFO info{};
  info.format = format & SF_FORMAT_SUBMASK;
  const bool is_told = sf_command(nullptr, SFC_GET_FORMAT_INFO, &info, sizeof(info)) == 0 && info.name != nullptr;
  return is_told ? info.name : fmt::format("{:#x}", info.format);
}

/// Kinds that libsndfile does not read, by how they begin: MPEG-4, Matroska and WebM, a bare stream of AAC.
std::string_view foreignKind(std::string_view bytes) {
  if (bytes.size() >= 12 && bytes.substr(4, 4) == "ftyp") return "MPEG-4 (M4A, MP4)";
  if (bytes.starts_with("\x1A\x45\xDF\xA3")) return "Matroska or WebM";
  const bool is_aac = bytes.size() >= 2 && static_cast<unsigned char>(bytes[0]) == 0xFF &&
                      (static_cast<unsigned char>(bytes[1]) & 0xF6U) == 0xF0U;
  return is_aac ? "AAC" : "";
}

/// A foreign file as the WAV that ffmpeg makes of it.
std::string throughFfmpeg(std::string_view bytes, std::string_view kind, std::string_view name, Seconds max_duration) {
  constexpr Seconds kTimeLimit = 600;
  const auto ffmpeg = findProgram("ffmpeg");
  if (!ffmpeg) {
    throw InputError(name, "",
                     fmt::format("is {} sound, which needs ffmpeg: get it with sudo apt-get install ffmpeg, or make it "
                                 "a WAV, FLAC, Ogg or MP3 file",
                                 kind));
  }
  const PrivateFolder folder;
  writeFileAtomically(folder.path() / "foreign", bytes);
  const ChildResult result =
      runChild(*ffmpeg,
               {"-nostdin", "-v", "error", "-protocol_whitelist", "file", "-i", "foreign", "-vn", "-ac", "1", "-t",
                fmt::format("{:.0f}", max_duration + 1), "-c:a", "pcm_s16le", "-f", "wav", "out.wav"},
               folder.path(), kTimeLimit);
  const std::filesystem::path made = folder.path() / "out.wav";
  if (result.exit_code != 0 || !std::filesystem::exists(made)) {
    throw InputError(name, "",
                     fmt::format("is no {} sound that ffmpeg can read: {}", kind,
                                 printable(result.output.substr(0, result.output.find('\n')), 160)));
  }
  return readFile(made);
}

/// libsndfile's view of bytes in memory. What is written is appended or goes over what is there.
struct MemoryFile {
  std::string_view read_bytes;
  std::string written{};
  sf_count_t at = 0;

  static MemoryFile& of(void* user) { return *static_cast<MemoryFile*>(user); }
  static sf_count_t length(void* user) {
    return std::max(std::ssize(of(user).read_bytes), std::ssize(of(user).written));
  }
  static sf_count_t seek(sf_count_t offset, int whence, void* user) {
    MemoryFile& file = of(user);
    const sf_count_t size = length(user);
    const sf_count_t base = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? file.at : size;
    if (offset < -base || offset > size - base) return -1;
    return file.at = base + offset;
  }
  static sf_count_t read(void* to, sf_count_t count, void* user) {
    MemoryFile& file = of(user);
    const sf_count_t taken = std::clamp<sf_count_t>(count, 0, length(user) - file.at);
    std::memcpy(to, file.read_bytes.data() + file.at, unsignedIndex(taken));
    file.at += taken;
    return taken;
  }
  static sf_count_t write(const void* from, sf_count_t count, void* user) {
    MemoryFile& file = of(user);
    file.written.resize(std::max(file.written.size(), unsignedIndex(file.at + count)));
    std::memcpy(file.written.data() + file.at, from, unsignedIndex(count));
    file.at += count;
    return count;
  }
  static sf_count_t tell(void* user) { return of(user).at; }
};

using SoundFile = std::unique_ptr<SNDFILE, decltype(&sf_close)>;

/// `file` and `info` must outlive the sound. Null where libsndfile refuses.
SoundFile openInMemory(MemoryFile& file, int mode, SF_INFO& info) {
  SF_VIRTUAL_IO io{MemoryFile::length, MemoryFile::seek, MemoryFile::read, MemoryFile::write, MemoryFile::tell};
  return {sf_open_virtual(&io, mode, &info, &file), &sf_close};
}

void checkInfo(const SF_INFO& info, std::string_view name, Seconds max_duration) {
  if (!isKnownCodec(info.format)) {
    throw InputError(name, "",
                     fmt::format("holds sound as {}; expected PCM, floats, FLAC, Vorbis, Opus or MP3",
                                 printable(codecName(info.format))));
  }
  if (info.samplerate < kLowestRate || info.samplerate > kHighestRate) {
    throw InputError(
        name, "",
        fmt::format("has a sample rate of {} Hz; expected {} to {}", info.samplerate, kLowestRate, kHighestRate));
  }
  if (info.channels < 1 || info.channels > kMostChannels) {
    throw InputError(name, "", fmt::format("has {} channels; expected 1 to {}", info.channels, kMostChannels));
  }
  if (info.frames <= 0) throw InputError(name, "", "has no samples; expected sound");
  if (asReal(info.frames) > max_duration * info.samplerate) {
    throw InputError(name, "",
                     fmt::format("claims {:.0f} s of sound; expected at most {:.0f} s",
                                 asReal(info.frames) / info.samplerate, max_duration));
  }
}

/// Memory grows with what is really read, not with what the header claims.
std::vector<float> readMono(SNDFILE* sound, const SF_INFO& info, std::string_view name, std::size_t file_bytes) {
  constexpr std::size_t kBlockFrames = 16384;
  const std::size_t channels = unsignedIndex(info.channels);
  std::vector<float> block(kBlockFrames * channels);
  std::vector<float> mono;
  // A sample a byte can be believed; growing by doubling would take an hour's sound twice.
  if (unsignedIndex(info.frames) <= file_bytes) mono.reserve(unsignedIndex(info.frames));
  while (std::ssize(mono) < info.frames) {
    const sf_count_t taken = sf_readf_float(sound, block.data(), kBlockFrames);
    if (taken <= 0) {
      throw InputError(name, "",
                       fmt::format("claims {} samples, found {}; expected a whole file", info.frames, mono.size()));
    }
    for (std::size_t frame = 0; frame < unsignedIndex(taken); ++frame) {
      double sum = 0;
      for (std::size_t c = 0; c < channels; ++c) sum += block[frame * channels + c];
      if (!std::isfinite(sum)) {
        throw InputError(name, fmt::format("sample {}", mono.size()), "is not a finite number; expected -1 to 1");
      }
      mono.push_back(asFloat(std::clamp(sum / info.channels, -1.0, 1.0)));
    }
  }
  return mono;
}

}  // namespace

AudioClip parseAudio(std::string_view bytes, std::string_view name, Seconds max_duration) {
  checkKind(bytes, name);
  MemoryFile file{bytes};
  SF_INFO info{};
  const SoundFile sound = openInMemory(file, SFM_READ, info);
  if (!sound) {
    throw InputError(name, "", fmt::format("is no sound that can be read: {}", printable(sf_strerror(nullptr))));
  }
  checkInfo(info, name, max_duration);
  return {.sample_rate_hz = info.samplerate, .samples = readMono(sound.get(), info, name, bytes.size())};
}

AudioClip readAudio(const std::filesystem::path& path, Seconds max_duration) {
  const std::string bytes = readFile(path);
  const std::string_view foreign = foreignKind(bytes);
  if (foreign.empty()) return parseAudio(bytes, path.string(), max_duration);
  return parseAudio(throughFfmpeg(bytes, foreign, path.string(), max_duration), path.string(), max_duration);
}

std::string wavBytes(const AudioClip& clip) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0);
  if (clip.samples.size() > kMostWavSamples)
    throw InputError(fmt::format("{} samples do not fit into a WAV", clip.samples.size()));
  constexpr std::size_t kHeader = 44, kBlock = 65536;
  MemoryFile file;
  file.written.reserve(kHeader + 2 * clip.samples.size());  // growing by doubling would take an hour's sound twice
  SF_INFO info{};
  info.samplerate = clip.sample_rate_hz;
  info.channels = 1;
  info.format = SF_FORMAT_WAV | SF_FORMAT_PCM_16;
  SoundFile sound = openInMemory(file, SFM_WRITE, info);
  bool is_written = sound != nullptr;
  std::vector<std::int16_t> block;
  for (std::size_t first = 0; is_written && first < clip.samples.size(); first += kBlock) {
    block.clear();
    for (const float sample : std::span(clip.samples).subspan(first, std::min(kBlock, clip.samples.size() - first))) {
      MOUTHPIECE_EXPECT(std::isfinite(sample));
      // 32768 is libsndfile's scale too: reading and writing again changes nothing.
      block.push_back(static_cast<std::int16_t>(std::clamp(std::lrint(sample * 32768.0F), -32768L, 32767L)));
    }
    is_written = sf_write_short(sound.get(), block.data(), std::ssize(block)) == std::ssize(block);
  }
  if (!is_written) throw InternalError("libsndfile could not write a sound into memory");
  sound.reset();  // puts the lengths into the header
  return std::move(file.written);
}

void writeWav(const std::filesystem::path& path, const AudioClip& clip) { writeFileAtomically(path, wavBytes(clip)); }

}  // namespace mouthpiece
