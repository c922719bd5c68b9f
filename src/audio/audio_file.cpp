#include <fmt/format.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <string>

#include "audio/audio_clip.h"
#include "base/errors.h"
#include "base/files.h"

namespace mouthpiece {
namespace {

constexpr int kLowestRate = 1000;
constexpr int kHighestRate = 768000;
constexpr int kMostChannels = 64;

std::uint32_t littleEndian32(std::string_view bytes, std::size_t offset) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = (value << 8U) | static_cast<unsigned char>(bytes[offset + i]);
  return value;
}

/// libsndfile reads what is there of a WAV cut short and says nothing; we want to know.
void checkWavLength(std::string_view bytes, std::string_view name) {
  std::uint64_t chunk = 12;
  while (chunk + 8 <= bytes.size()) {
    const std::uint64_t size = littleEndian32(bytes, chunk + 4);
    const std::uint64_t available = bytes.size() - chunk - 8;
    if (bytes.substr(chunk, 4) == "data") {
      if (size <= available) return;
      throw InputError(name, fmt::format("byte {}", chunk),
                       fmt::format("claims {} bytes of sound, found {}; expected a whole file", size, available));
    }
    chunk += 8 + size + size % 2;
  }
  throw InputError(name, "", fmt::format("is a WAV of {} bytes without sound; expected a chunk 'data'", bytes.size()));
}

void checkKind(std::string_view bytes, std::string_view name) {
  const bool is_wav = bytes.size() >= 12 && bytes.starts_with("RIFF") && bytes.substr(8, 4) == "WAVE";
  const bool is_aiff = bytes.size() >= 12 && bytes.starts_with("FORM") && bytes.substr(8, 3) == "AIF";
  if (is_wav) return checkWavLength(bytes, name);
  if (is_aiff || bytes.starts_with("fLaC") || bytes.starts_with("OggS")) return;
  throw InputError(
      name, "",
      fmt::format("starts with '{}'; expected a WAV, AIFF, FLAC or Ogg Vorbis file", printable(bytes.substr(0, 12))));
}

/// libsndfile's view of bytes in memory.
struct MemoryFile {
  std::string_view bytes;
  sf_count_t at = 0;

  static MemoryFile& of(void* user) { return *static_cast<MemoryFile*>(user); }
  static sf_count_t length(void* user) { return static_cast<sf_count_t>(of(user).bytes.size()); }
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
    std::memcpy(to, file.bytes.data() + file.at, static_cast<std::size_t>(taken));
    file.at += taken;
    return taken;
  }
  static sf_count_t write(const void*, sf_count_t, void*) { return 0; }
  static sf_count_t tell(void* user) { return of(user).at; }
};

using SoundFile = std::unique_ptr<SNDFILE, decltype(&sf_close)>;

void checkInfo(const SF_INFO& info, std::string_view name, Seconds max_duration) {
  if (info.samplerate < kLowestRate || info.samplerate > kHighestRate) {
    throw InputError(
        name, "",
        fmt::format("has a sample rate of {} Hz; expected {} to {}", info.samplerate, kLowestRate, kHighestRate));
  }
  if (info.channels < 1 || info.channels > kMostChannels) {
    throw InputError(name, "", fmt::format("has {} channels; expected 1 to {}", info.channels, kMostChannels));
  }
  if (info.frames <= 0) throw InputError(name, "", "has no samples; expected sound");
  if (static_cast<double>(info.frames) > max_duration * info.samplerate) {
    throw InputError(name, "",
                     fmt::format("claims {:.0f} s of sound; expected at most {:.0f} s",
                                 static_cast<double>(info.frames) / info.samplerate, max_duration));
  }
}

/// Memory grows with what is really read, not with what the header claims.
std::vector<float> readMono(SNDFILE* sound, const SF_INFO& info, std::string_view name) {
  constexpr std::size_t kBlockFrames = 16384;
  const auto channels = static_cast<std::size_t>(info.channels);
  std::vector<float> block(kBlockFrames * channels);
  std::vector<float> mono;
  while (mono.size() < static_cast<std::size_t>(info.frames)) {
    const sf_count_t taken = sf_readf_float(sound, block.data(), kBlockFrames);
    if (taken <= 0) {
      throw InputError(name, "",
                       fmt::format("claims {} samples, found {}; expected a whole file", info.frames, mono.size()));
    }
    for (std::size_t frame = 0; frame < static_cast<std::size_t>(taken); ++frame) {
      double sum = 0;
      for (std::size_t c = 0; c < channels; ++c) sum += block[frame * channels + c];
      if (!std::isfinite(sum)) {
        throw InputError(name, fmt::format("sample {}", mono.size()), "is not a finite number; expected -1 to 1");
      }
      mono.push_back(static_cast<float>(std::clamp(sum / static_cast<double>(channels), -1.0, 1.0)));
    }
  }
  return mono;
}

void appendLittleEndian(std::string& out, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<char>((value >> (8 * i)) & 0xFFU));
}

}  // namespace

AudioClip parseAudio(std::string_view bytes, std::string_view name, Seconds max_duration) {
  checkKind(bytes, name);
  MemoryFile file{bytes};
  SF_VIRTUAL_IO io{MemoryFile::length, MemoryFile::seek, MemoryFile::read, MemoryFile::write, MemoryFile::tell};
  SF_INFO info{};
  const SoundFile sound(sf_open_virtual(&io, SFM_READ, &info, &file), &sf_close);
  if (!sound) {
    throw InputError(name, "", fmt::format("is no sound that can be read: {}", printable(sf_strerror(nullptr))));
  }
  checkInfo(info, name, max_duration);
  return {.sample_rate_hz = info.samplerate, .samples = readMono(sound.get(), info, name)};
}

AudioClip readAudio(const std::filesystem::path& path, Seconds max_duration) {
  return parseAudio(readFile(path), path.string(), max_duration);
}

void writeWav(const std::filesystem::path& path, const AudioClip& clip) {
  constexpr std::uint32_t kHeaderAfterSize = 36;
  constexpr std::uint32_t kPcm = 1, kChannels = 1, kBytesPerSample = 2;
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0);
  if (clip.samples.size() > (std::numeric_limits<std::uint32_t>::max() - kHeaderAfterSize) / kBytesPerSample) {
    throw InputError(path.string(), "", fmt::format("{} samples do not fit into a WAV", clip.samples.size()));
  }
  const auto data_bytes = static_cast<std::uint32_t>(clip.samples.size() * kBytesPerSample);
  const auto rate = static_cast<std::uint32_t>(clip.sample_rate_hz);
  std::string out = "RIFF";
  out.reserve(data_bytes + kHeaderAfterSize + 8);
  appendLittleEndian(out, kHeaderAfterSize + data_bytes, 4);
  out += "WAVEfmt ";
  appendLittleEndian(out, 16, 4);
  appendLittleEndian(out, kPcm, 2);
  appendLittleEndian(out, kChannels, 2);
  appendLittleEndian(out, rate, 4);
  appendLittleEndian(out, rate * kBytesPerSample, 4);
  appendLittleEndian(out, kBytesPerSample, 2);
  appendLittleEndian(out, 8 * kBytesPerSample, 2);
  out += "data";
  appendLittleEndian(out, data_bytes, 4);
  for (const float sample : clip.samples) {
    MOUTHPIECE_EXPECT(std::isfinite(sample));
    // 32768 is libsndfile's scale too: reading and writing again changes nothing.
    const long value = std::clamp(std::lrint(sample * 32768.0F), -32768L, 32767L);
    appendLittleEndian(out, static_cast<std::uint32_t>(value), 2);
  }
  writeFileAtomically(path, out);
}

}  // namespace mouthpiece
