#include <FLAC/stream_decoder.h>
#include <FLAC/stream_encoder.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <new>
#include <string>

#include "audio/audio_clip.h"
#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr std::uint32_t kBits = 16;
constexpr std::uint32_t kAnyRateHz = 16000;  // which FLAC wants

struct Written {
  std::string bytes;
  std::size_t at = 0;

  static Written& of(void* user) { return *static_cast<Written*>(user); }
  static FLAC__StreamEncoderWriteStatus write(const FLAC__StreamEncoder*, const FLAC__byte* from, std::size_t count,
                                              std::uint32_t, std::uint32_t, void* user) try {
    Written& file = of(user);
    file.bytes.resize(std::max(file.bytes.size(), file.at + count));
    std::copy_n(from, count, file.bytes.begin() + static_cast<std::ptrdiff_t>(file.at));
    file.at += count;
    return FLAC__STREAM_ENCODER_WRITE_STATUS_OK;
  } catch (const std::bad_alloc&) {  // which must not pass through a library in C
    return FLAC__STREAM_ENCODER_WRITE_STATUS_FATAL_ERROR;
  }
  /// libFLAC goes back to what it has written alone: the header, for the length.
  static FLAC__StreamEncoderSeekStatus seek(const FLAC__StreamEncoder*, FLAC__uint64 offset, void* user) {
    of(user).at = offset;
    return FLAC__STREAM_ENCODER_SEEK_STATUS_OK;
  }
  static FLAC__StreamEncoderTellStatus tell(const FLAC__StreamEncoder*, FLAC__uint64* offset, void* user) {
    *offset = of(user).at;
    return FLAC__STREAM_ENCODER_TELL_STATUS_OK;
  }
};

struct Read {
  std::string_view bytes;
  std::size_t count;
  std::vector<std::int16_t> samples{};

  static Read& of(void* user) { return *static_cast<Read*>(user); }
  static FLAC__StreamDecoderReadStatus read(const FLAC__StreamDecoder*, FLAC__byte* to, std::size_t* count,
                                            void* user) {
    Read& file = of(user);
    *count = std::min(*count, file.bytes.size());
    std::copy_n(file.bytes.begin(), *count, to);
    file.bytes.remove_prefix(*count);
    return *count == 0 ? FLAC__STREAM_DECODER_READ_STATUS_END_OF_STREAM : FLAC__STREAM_DECODER_READ_STATUS_CONTINUE;
  }
  static FLAC__StreamDecoderWriteStatus write(const FLAC__StreamDecoder*, const FLAC__Frame* frame,
                                              const FLAC__int32* const* channels, void* user) try {
    Read& file = of(user);
    const std::size_t block = frame->header.blocksize;
    if (frame->header.channels != 1 || frame->header.bits_per_sample != kBits ||
        block > file.count - file.samples.size())
      return FLAC__STREAM_DECODER_WRITE_STATUS_ABORT;
    std::transform(channels[0], channels[0] + block, std::back_inserter(file.samples),
                   [](FLAC__int32 sample) { return static_cast<std::int16_t>(sample); });
    return FLAC__STREAM_DECODER_WRITE_STATUS_CONTINUE;
  } catch (const std::bad_alloc&) {
    return FLAC__STREAM_DECODER_WRITE_STATUS_ABORT;
  }
  /// Samples that are missing tell.
  static void error(const FLAC__StreamDecoder*, FLAC__StreamDecoderErrorStatus, void*) {}
};

}  // namespace

std::string flacBytes(const std::vector<std::int16_t>& samples) {
  const std::unique_ptr<FLAC__StreamEncoder, decltype(&FLAC__stream_encoder_delete)> encoder(
      FLAC__stream_encoder_new(), &FLAC__stream_encoder_delete);
  if (!encoder) throw std::bad_alloc();
  const std::vector<FLAC__int32> wide(samples.begin(), samples.end());
  Written file;
  FLAC__stream_encoder_set_channels(encoder.get(), 1);
  FLAC__stream_encoder_set_bits_per_sample(encoder.get(), kBits);
  FLAC__stream_encoder_set_sample_rate(encoder.get(), kAnyRateHz);
  const bool is_written = FLAC__stream_encoder_init_stream(encoder.get(), Written::write, Written::seek, Written::tell,
                                                           nullptr, &file) == FLAC__STREAM_ENCODER_INIT_STATUS_OK &&
                          FLAC__stream_encoder_process_interleaved(encoder.get(), wide.data(),
                                                                   static_cast<std::uint32_t>(wide.size())) != 0 &&
                          FLAC__stream_encoder_finish(encoder.get()) != 0;  // puts the length into the header
  if (is_written) return std::move(file.bytes);
  const FLAC__StreamEncoderState state = FLAC__stream_encoder_get_state(encoder.get());
  // The client's error is `Written::write`'s.
  if (state == FLAC__STREAM_ENCODER_MEMORY_ALLOCATION_ERROR || state == FLAC__STREAM_ENCODER_CLIENT_ERROR)
    throw std::bad_alloc();
  throw InternalError(
      fmt::format("libFLAC could not write a sound into memory: {}", FLAC__StreamEncoderStateString[state]));
}

std::optional<std::vector<std::int16_t>> flacSamples(std::string_view bytes, std::size_t count) {
  const std::unique_ptr<FLAC__StreamDecoder, decltype(&FLAC__stream_decoder_delete)> decoder(
      FLAC__stream_decoder_new(), &FLAC__stream_decoder_delete);
  if (!decoder) throw std::bad_alloc();
  Read file{bytes, count};
  const FLAC__StreamDecoderInitStatus status = FLAC__stream_decoder_init_stream(
      decoder.get(), Read::read, nullptr, nullptr, nullptr, nullptr, Read::write, nullptr, Read::error, &file);
  if (status == FLAC__STREAM_DECODER_INIT_STATUS_MEMORY_ALLOCATION_ERROR) throw std::bad_alloc();
  const bool is_read = status == FLAC__STREAM_DECODER_INIT_STATUS_OK &&
                       FLAC__stream_decoder_process_until_end_of_stream(decoder.get()) != 0;
  if (FLAC__stream_decoder_get_state(decoder.get()) == FLAC__STREAM_DECODER_MEMORY_ALLOCATION_ERROR)
    throw std::bad_alloc();
  return is_read && file.samples.size() == count ? std::optional(std::move(file.samples)) : std::nullopt;
}

}  // namespace mouthpiece
