#include <fmt/format.h>
#include <sndfile.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "audio/audio_clip.h"
#include "base/byte_reader.h"
#include "base/child_process.h"
#include "base/errors.h"
#include "base/file_parts.h"
#include "base/files.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

constexpr int kLowestRate = 1000;
constexpr int kHighestRate = 768000;
constexpr int kMostChannels = 64;
constexpr std::size_t kMostWavSamples = 0x7FFFFF00;  // of two bytes: a WAV counts its bytes in 32 bits

/// A sound's bytes, of which a few are held at a time.
struct SoundBytes {
  std::uint64_t size = 0;
  ReadBytes read;
  std::uint64_t position = 0;
  int error = 0;  ///< errno of bytes that were there and could not be read

  /// Fewer where there are no more.
  [[nodiscard]] std::string at(std::uint64_t first, std::size_t count) const {
    std::string taken(count, '\0');
    taken.resize(read(first, taken));
    return taken;
  }
};

/// What a program that writes into a pipe claims, since it cannot go back to the header: 0xFFFFFFFF (ffmpeg),
/// 0x80000000 (arecord) or 0x7FFFF000 (sox). The sound then reaches to the file's end.
constexpr std::uint64_t kUnknownLength = 0x7FFFF000;

/// libsndfile reads what is there of a WAV cut short and says nothing; we want to know.
void checkWavLength(const SoundBytes& sound, std::string_view name) {
  std::optional<std::uint64_t> long_length;  // an RF64 has it before, of 64 bits
  for (std::uint64_t chunk = 12; sound.size - chunk >= 8;) {
    const std::string head = sound.at(chunk, 8);
    ByteReader reader(head, name);
    const std::string_view kind = reader.readBytes(4);
    std::uint64_t length = reader.readU32();
    const std::uint64_t remaining = sound.size - chunk - 8;
    if (kind == "ds64" && remaining >= 16) {
      const std::string sizes = sound.at(chunk + 16, 8);
      long_length = ByteReader(sizes, name).readU64();
    }
    if (kind == "data") {
      const bool is_long = long_length && length == 0xFFFFFFFF;
      if (is_long) length = *long_length;
      if (length <= remaining || (!is_long && length >= kUnknownLength)) return;
      throw InputError(name, fmt::format("byte {}", chunk),
                       fmt::format("claims {} bytes of sound, found {}; expected a whole file", length, remaining));
    }
    chunk += 8 + std::min(remaining, length + length % 2);
  }
  throw InputError(name, "", fmt::format("is a WAV of {} bytes without sound; expected a chunk 'data'", sound.size));
}

/// With its tag before it, or a frame's first eleven bits; layer III.
bool isMp3(std::string_view bytes) {
  if (bytes.starts_with("ID3")) return true;
  return bytes.size() >= 4 && static_cast<unsigned char>(bytes[0]) == 0xFF &&
         (static_cast<unsigned char>(bytes[1]) & 0xE6U) == 0xE2U;
}

/// The same of Sun's AU, whose length may be left out.
void checkAuLength(const SoundBytes& sound, std::string_view name) {
  const std::string head = sound.at(0, 12);
  ByteReader reader(head, name, ByteOrder::kBig);
  reader.skip(4);
  const std::uint64_t start = reader.readU32(), length = reader.readU32();
  const std::uint64_t remaining = sound.size - std::min(sound.size, start);
  if (length == 0xFFFFFFFF || length <= remaining) return;
  throw InputError(name, "byte 8",
                   fmt::format("claims {} bytes of sound, found {}; expected a whole file", length, remaining));
}

/// Where the first frame of an MP3 tells how many bytes there are (Xing's header), they are looked for: libmpg123 would
/// print that some are missing. A hundredth it takes for rounding.
void checkMp3Length(const SoundBytes& sound, std::string_view name) {
  std::uint64_t start = 0;
  if (const std::string tag = sound.at(0, 10); tag.starts_with("ID3") && tag.size() == 10) {
    for (std::size_t i = 6; i < 10; ++i) start = start << 7U | (static_cast<unsigned char>(tag[i]) & 0x7FU);
    start += 10;
  }
  const std::string frame = sound.at(start, 64);
  if (frame.size() < 64 || !isMp3(frame)) return;
  const bool is_mpeg1 = (static_cast<unsigned char>(frame[1]) & 0x18U) == 0x18U;
  const bool is_mono = (static_cast<unsigned char>(frame[3]) & 0xC0U) == 0xC0U;
  ByteReader reader(frame, name, ByteOrder::kBig);
  reader.skip(4 + (is_mpeg1 ? (is_mono ? 17U : 32U) : (is_mono ? 9U : 17U)));
  const std::string_view kind = reader.readBytes(4);
  if (kind != "Xing" && kind != "Info") return;
  constexpr std::uint32_t kHasFrames = 1, kHasBytes = 2;
  const std::uint32_t holds = reader.readU32();
  if ((holds & kHasFrames) != 0) reader.skip(4);
  if ((holds & kHasBytes) == 0) return;
  const std::uint64_t length = reader.readU32(), found = sound.size - start;
  if (found >= length - length / 100) return;
  throw InputError(name, fmt::format("byte {}", start),
                   fmt::format("claims {} bytes of sound, found {}; expected a whole file", length, found));
}

void checkKind(const SoundBytes& sound, std::string_view name) {
  const std::string bytes = sound.at(0, 12);
  const bool is_wav =
      bytes.size() >= 12 && (bytes.starts_with("RIFF") || bytes.starts_with("RF64")) && bytes.substr(8, 4) == "WAVE";
  const bool is_aiff = bytes.size() >= 12 && bytes.starts_with("FORM") && bytes.substr(8, 3) == "AIF";
  if (is_wav) return checkWavLength(sound, name);
  if (bytes.size() >= 12 && bytes.starts_with(".snd")) return checkAuLength(sound, name);
  if (isMp3(bytes)) return checkMp3Length(sound, name);
  if (is_aiff || bytes.starts_with("fLaC") || bytes.starts_with("OggS")) return;
  constexpr std::size_t kLongestSign = 32;
  const std::string begin = sound.at(0, kLongestSign);
  const std::string_view kind = kindOfNoText(begin);
  const std::string found = bytes.empty()  ? "is empty"
                            : kind.empty() ? fmt::format("starts with '{}'", printable(bytes))
                                           : fmt::format("is {}", kind);
  throw InputError(name, "", found + "; expected a WAV, AIFF, AU, FLAC, Ogg (Vorbis, Opus), MP3, M4A or AAC file");
}

/// libsndfile opens more codecs than we want to be answerable for: these are let in.
bool isKnownCodec(int format) {
  constexpr std::array kCodecs = {SF_FORMAT_PCM_S8, SF_FORMAT_PCM_U8,        SF_FORMAT_PCM_16,   SF_FORMAT_PCM_24,
                                  SF_FORMAT_PCM_32, SF_FORMAT_FLOAT,         SF_FORMAT_DOUBLE,   SF_FORMAT_ULAW,
                                  SF_FORMAT_ALAW,   SF_FORMAT_IMA_ADPCM,     SF_FORMAT_MS_ADPCM, SF_FORMAT_VORBIS,
                                  SF_FORMAT_OPUS,   SF_FORMAT_MPEG_LAYER_III};
  return std::find(kCodecs.begin(), kCodecs.end(), format & SF_FORMAT_SUBMASK) != kCodecs.end();
}

std::string codecName(int format) {
  SF_FORMAT_INFO info{};
  info.format = format & SF_FORMAT_SUBMASK;
  const bool is_told = sf_command(nullptr, SFC_GET_FORMAT_INFO, &info, sizeof(info)) == 0 && info.name != nullptr;
  return is_told ? info.name : fmt::format("{:#x}", info.format);
}

/// Kinds that libsndfile does not read, or that are rare, by how they begin; a bare stream of AAC besides.
std::string_view foreignKind(std::string_view bytes) {
  constexpr std::pair<std::string_view, std::string_view> kKinds[] = {{"\x1A\x45\xDF\xA3", "Matroska or WebM"},
                                                                      {"\x30\x26\xB2\x75", "Windows Media"},
                                                                      {"caff", "Core Audio"},
                                                                      {"#!AMR", "AMR"}};
  if (bytes.size() >= 12 && bytes.substr(4, 4) == "ftyp") return "MPEG-4 (M4A, MP4)";
  for (const auto& [begin, kind] : kKinds) {
    if (bytes.starts_with(begin)) return kind;
  }
  const bool is_aac = bytes.size() >= 2 && static_cast<unsigned char>(bytes[0]) == 0xFF &&
                      (static_cast<unsigned char>(bytes[1]) & 0xF6U) == 0xF0U;
  return is_aac ? "AAC" : "";
}

/// libsndfile's view of a sound's bytes.
struct SoundView {
  static SoundBytes& of(void* user) { return *static_cast<SoundBytes*>(user); }
  static sf_count_t length(void* user) { return static_cast<sf_count_t>(of(user).size); }
  static sf_count_t seek(sf_count_t offset, int whence, void* user) {
    const sf_count_t size = length(user);
    const sf_count_t base = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? tell(user) : size;
    if (offset < -base || offset > size - base) return -1;
    of(user).position = static_cast<std::uint64_t>(base + offset);
    return tell(user);
  }
  static sf_count_t read(void* to, sf_count_t count, void* user) {
    SoundBytes& sound = of(user);
    const std::size_t taken =
        sound.read(sound.position, {static_cast<char*>(to), unsignedIndex(std::max<sf_count_t>(count, 0))});
    sound.position += taken;
    if (taken < unsignedIndex(std::max<sf_count_t>(count, 0)) && sound.position < sound.size) sound.error = errno;
    return signedIndex(taken);
  }
  static sf_count_t write(const void*, sf_count_t, void*) { return 0; }
  static sf_count_t tell(void* user) { return static_cast<sf_count_t>(of(user).position); }
};

using SoundFile = std::unique_ptr<SNDFILE, decltype(&sf_close)>;

/// `bytes` and `info` must outlive the sound. Null where libsndfile refuses.
SoundFile openSound(SoundBytes& bytes, SF_INFO& info) {
  SF_VIRTUAL_IO io{SoundView::length, SoundView::seek, SoundView::read, SoundView::write, SoundView::tell};
  bytes.position = 0;
  return {sf_open_virtual(&io, SFM_READ, &info, &bytes), &sf_close};
}

void checkInfo(const SF_INFO& info, std::string_view name, Seconds max_duration) {
  if (!isKnownCodec(info.format)) {
    throw InputError(
        name, "",
        fmt::format("holds sound as {}; expected PCM, floats, mu-law, A-law, ADPCM, FLAC, Vorbis, Opus or MP3",
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

/// What the second of two channels counts: -1 where it mirrors the first, as of a cable whose poles are swapped, and
/// both together would be silence. Told by up to ten seconds in which something sounds.
double secondChannelsSign(SNDFILE* sound, const SF_INFO& info) {
  constexpr double kMirrored = 0.1, kSilent = 1e-6;  // energy of the sum over the difference's; of a sample
  constexpr sf_count_t kAtOnce = 4096;
  constexpr int kSecondsHeard = 10;
  if (info.channels != 2) return 1;
  std::vector<float> block(2 * kAtOnce);
  double together = 0, apart = 0;
  for (sf_count_t heard = 0, taken = 0; heard < sf_count_t{kSecondsHeard} * info.samplerate;) {
    taken = sf_readf_float(sound, block.data(), kAtOnce);
    if (taken <= 0) break;
    double sum = 0, difference = 0;
    for (std::size_t i = 0; i < 2 * unsignedIndex(taken); i += 2) {
      sum += std::pow(double{block[i]} + block[i + 1], 2);
      difference += std::pow(double{block[i]} - block[i + 1], 2);
    }
    if (sum + difference < kSilent * asReal(taken)) continue;
    heard += taken;
    together += sum;
    apart += difference;
  }
  sf_seek(sound, 0, SEEK_SET);
  return together < kMirrored * apart ? -1 : 1;
}

/// Memory grows with what is really read, not with what the header claims.
AudioClip readMono(SNDFILE* sound, const SF_INFO& info, std::string_view name, std::uint64_t file_bytes,
                   const AudioLimits& limits) {
  constexpr std::size_t kBlockFrames = 16384;
  const bool is_long = asReal(info.frames) > limits.own_rate_until * info.samplerate;
  AudioClip clip{.sample_rate_hz = is_long ? std::min(info.samplerate, kLongSoundRateHz) : info.samplerate,
                 .samples = {}};
  LiveResampler resampler(info.samplerate, clip.sample_rate_hz);
  const std::size_t channels = unsignedIndex(info.channels);
  const double second = secondChannelsSign(sound, info);
  std::vector<float> block(kBlockFrames * channels), mono;
  // A sample a byte can be believed; growing by doubling would take an hour's sound twice.
  if (unsignedIndex(info.frames) <= file_bytes) clip.samples.reserve(resampler.outputCount(unsignedIndex(info.frames)));
  for (sf_count_t frames = 0; frames < info.frames; frames += std::ssize(mono)) {
    const sf_count_t taken = sf_readf_float(sound, block.data(), kBlockFrames);
    if (taken <= 0)
      throw InputError(name, "",
                       fmt::format("claims {} samples, found {}; expected a whole file", info.frames, frames));
    mono.resize(unsignedIndex(taken));
    for (std::size_t frame = 0; frame < mono.size(); ++frame) {
      double sum = 0;
      for (std::size_t c = 0; c < channels; ++c) sum += (c == 1 ? second : 1) * block[frame * channels + c];
      if (!std::isfinite(sum)) {
        throw InputError(name, fmt::format("sample {}", unsignedIndex(frames) + frame),
                         "is not a finite number; expected -1 to 1");
      }
      mono[frame] = asFloat(std::clamp(sum / info.channels, -1.0, 1.0));
    }
    resampler.push(mono, clip.samples);
  }
  resampler.finish(clip.samples);
  return clip;
}

AudioClip soundIn(SoundBytes bytes, std::string_view name, const AudioLimits& limits) {
  checkKind(bytes, name);
  SF_INFO info{};
  const SoundFile sound = openSound(bytes, info);
  if (!sound) {
    throw InputError(name, "", fmt::format("is no sound that can be read: {}", printable(sf_strerror(nullptr))));
  }
  checkInfo(info, name, limits.most);
  AudioClip clip = readMono(sound.get(), info, name, bytes.size, limits);
  // libsndfile takes what cannot be read for the sound's end.
  if (bytes.error != 0) throw InputError(name, "", fmt::format("cannot be read: {}", std::strerror(bytes.error)));
  return clip;
}

SoundBytes bytesOf(const FileReader& file) {
  return {file.size(), [&](std::uint64_t at, std::span<char> to) { return file.read(at, to); }};
}

/// How long a foreign file says that it lasts; nullopt where it says nothing, or ffprobe is not there.
std::optional<Seconds> toldDuration(const std::filesystem::path& folder, const std::string& file) {
  constexpr Seconds kTimeLimit = 20;
  const auto ffprobe = findProgram("ffprobe");
  if (!ffprobe) return std::nullopt;
  const ChildResult result = runChild(
      *ffprobe,
      {"-v", "error", "-protocol_whitelist", "file", "-show_entries", "format=duration", "-of", "csv=p=0", file},
      folder, kTimeLimit);
  return parseNumber(std::string_view(result.output).substr(0, result.output.find('\n')));
}

/// A foreign file as the WAV that ffmpeg makes of it.
AudioClip throughFfmpeg(const std::filesystem::path& path, std::string_view kind, const AudioLimits& limits) {
  constexpr Seconds kTimeLimit = 600;
  const std::string name = path.string();
  const auto ffmpeg = findProgram("ffmpeg");
  if (!ffmpeg) {
    throw InputError(name, "",
                     fmt::format("is {} sound, which needs ffmpeg: get it with sudo apt-get install ffmpeg, or make it "
                                 "a WAV, FLAC, Ogg or MP3 file",
                                 kind));
  }
  const PrivateFolder folder;
  writeFileAtomically(folder.path() / "foreign", readFile(path));
  if (const std::optional<Seconds> told = toldDuration(folder.path(), "foreign"); told && *told > limits.most + 1)
    throw InputError(name, "", fmt::format("claims {:.0f} s of sound; expected at most {:.0f} s", *told, limits.most));
  const ChildResult result =
      runChild(*ffmpeg,
               {"-nostdin", "-v", "error", "-protocol_whitelist", "file", "-i", "foreign", "-vn", "-af",
                "aformat=channel_layouts=mono|stereo", "-t", fmt::format("{:.0f}", limits.most + 1), "-c:a",
                "pcm_s16le", "-f", "wav", "out.wav"},
               folder.path(), kTimeLimit);
  const std::filesystem::path made = folder.path() / "out.wav";
  if (result.exit_code != 0 || !std::filesystem::exists(made)) {
    std::string why = result.output.substr(0, result.output.find('\n'));
    // "[mov,mp4 @ 0x561c404c29c0] moov atom not found": the bracket tells users nothing.
    if (why.starts_with('[')) why.erase(0, why.find("] ") == std::string::npos ? 0 : why.find("] ") + 2);
    throw InputError(name, "", fmt::format("is no {} sound that ffmpeg can read: {}", kind, printable(why, 160)));
  }
  return soundIn(bytesOf(FileReader(made)), name, limits);
}

void appendWav(const AudioClip& clip, const AppendBytes& append) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0);
  constexpr std::uint32_t kHeader = 44, kSample = 2, kPcm = 1, kChannels = 1;
  constexpr std::size_t kBlock = 65536;
  if (clip.samples.size() > kMostWavSamples)
    throw InputError(fmt::format("{} samples do not fit into a WAV", clip.samples.size()));
  const auto bytes = static_cast<std::uint32_t>(kSample * clip.samples.size());
  const auto rate = static_cast<std::uint32_t>(clip.sample_rate_hz);
  ByteWriter header;
  header.writeBytes("RIFF");
  header.writeU32(kHeader - 8 + bytes);
  header.writeBytes("WAVEfmt ");
  header.writeU32(16);
  header.writeU16(kPcm);
  header.writeU16(kChannels);
  header.writeU32(rate);
  header.writeU32(kSample * rate);
  header.writeU16(kSample);
  header.writeU16(8 * kSample);
  header.writeBytes("data");
  header.writeU32(bytes);
  append(header.bytes());
  for (std::size_t first = 0; first < clip.samples.size(); first += kBlock) {
    ByteWriter block;
    for (const float sample : std::span(clip.samples).subspan(first, std::min(kBlock, clip.samples.size() - first))) {
      MOUTHPIECE_EXPECT(std::isfinite(sample));
      // 32768 is libsndfile's scale too: reading and writing again changes nothing.
      block.writeU16(std::clamp(std::lrint(sample * 32768.0F), -32768L, 32767L));
    }
    append(block.bytes());
  }
}

}  // namespace

AudioClip parseAudio(std::string_view bytes, std::string_view name, const AudioLimits& limits) {
  const auto read = [bytes](std::uint64_t at, std::span<char> to) {
    return bytes.substr(std::min<std::uint64_t>(at, bytes.size())).copy(to.data(), to.size());
  };
  return soundIn({bytes.size(), read}, name, limits);
}

AudioClip readAudio(const std::filesystem::path& path, const AudioLimits& limits) {
  const FileReader file(path);
  const SoundBytes bytes = bytesOf(file);
  const std::string_view foreign = foreignKind(bytes.at(0, 12));
  return foreign.empty() ? soundIn(bytes, path.string(), limits) : throughFfmpeg(path, foreign, limits);
}

std::string wavBytes(const AudioClip& clip) {
  std::string bytes;
  appendWav(clip, [&](std::string_view part) { bytes += part; });
  return bytes;
}

void writeWav(const std::filesystem::path& path, const AudioClip& clip) {
  writeFileInParts(path, [&](const AppendBytes& append) { appendWav(clip, append); });
}

}  // namespace mouthpiece
