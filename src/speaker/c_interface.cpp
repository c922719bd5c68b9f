// The C interface: handles around the C++ front door, exceptions turned into codes and text.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <new>

#include "base/errors.h"
#include "exports/arkit.h"
#include "mouthpiece/mouthpiece.h"
#include "mouthpiece/speaker.h"
#include "speaker/speaker_data.h"

struct mouthpiece_speaker {
  mouthpiece::Speaker speaker;
};
struct mouthpiece_performance {
  mouthpiece::Performance performance;
};
struct mouthpiece_stream {
  mouthpiece::FrameStream stream;
};
struct mouthpiece_live {
  mouthpiece::LiveStream stream;
  mouthpiece::Sound said;
};

namespace {

using namespace mouthpiece;

/// Known without its motion, which may be made when it is asked for.
const std::vector<std::string>& markersOf(const mouthpiece_performance& performance) {
  return performance.performance.data().animation.motion.marker_names;
}

int fail(int code, const char* text, char* error, std::size_t error_size) {
  if (error != nullptr && error_size > 0) {
    const std::size_t length = std::min(std::strlen(text), error_size - 1);
    std::memcpy(error, text, length);
    error[length] = '\0';
  }
  return code;
}

/// Runs `work`, and tells of what it throws.
template <typename Work>
int guarded(char* error, std::size_t error_size, Work&& work) {
  try {
    fail(MOUTHPIECE_OK, "", error, error_size);
    work();
    return MOUTHPIECE_OK;
  } catch (const InputError& problem) {
    return fail(MOUTHPIECE_BAD_INPUT, problem.what(), error, error_size);
  } catch (const std::filesystem::filesystem_error& problem) {
    return fail(MOUTHPIECE_BAD_INPUT, problem.what(), error, error_size);
  } catch (const std::bad_alloc&) {
    return fail(MOUTHPIECE_NO_MEMORY, "out of memory: the input is too large for this machine", error, error_size);
  } catch (const std::exception& problem) {
    return fail(MOUTHPIECE_INTERNAL, problem.what(), error, error_size);
  } catch (...) {
    return fail(MOUTHPIECE_INTERNAL, "an unknown exception", error, error_size);
  }
}

template <typename Pointer>
void expectGiven(Pointer pointer, const char* name) {
  if (pointer == nullptr) throw InputError(std::string("found a null ") + name + "; expected one");
}

/// A caller that was built with an earlier header has a smaller struct: what it lacks has its default.
/// As much of `given`, if any, as both sides know; the rest as `init` sets it. Throws InputError where nothing set it.
template <typename Options>
Options knownOf(const Options* given, void (*init)(Options*), const char* name) {
  Options known;
  init(&known);
  if (given == nullptr) return known;
  if (given->size < sizeof(size_t) || given->size > 4096)
    throw InputError(fmt::format("found {0} of an odd size; expected them set by {0}_init()", name));
  std::memcpy(&known, given, std::min(given->size, sizeof known));
  return known;
}

LiveOptions liveOptionsFrom(const mouthpiece_live_options* given) {
  const auto known = knownOf(given, mouthpiece_live_options_init, "mouthpiece_live_options");
  if (known.source < MOUTHPIECE_LIVE_SOUND || known.source > MOUTHPIECE_LIVE_TEXT)
    throw InputError(fmt::format("found source {}; expected one of mouthpiece_live_source", known.source));
  return {.look_ahead = known.look_ahead_s,
          .sample_rate_hz = known.sample_rate_hz,
          .source = static_cast<LiveOptions::Source>(known.source),
          .own_voice = known.own_voice != 0,
          .arkit = known.arkit != 0};
}

SpeakerOptions optionsFrom(const mouthpiece_options* given) {
  const auto known = knownOf(given, mouthpiece_options_init, "mouthpiece_options");
  SpeakerOptions options;
  if (known.corpus != nullptr) options.corpus = known.corpus;
  if (known.face != nullptr) options.face = known.face;
  options.with_face = known.with_face != 0;
  if (known.voice != nullptr) options.voice = known.voice;
  if (known.lexicon != nullptr) options.lexicon = known.lexicon;
  if (known.frame_rate_hz != 0) options.manner.frame_rate_hz = known.frame_rate_hz;
  return options;
}

int perform(mouthpiece_speaker* speaker, mouthpiece_performance** performance, char* error, size_t error_size,
            const std::function<Line()>& line) {
  return guarded(error, error_size, [&] {
    expectGiven(performance, "performance");
    *performance = nullptr;
    expectGiven(speaker, "speaker");
    *performance = new mouthpiece_performance{speaker->speaker.perform(line())};
  });
}

void tellFrame(const Frame& from, mouthpiece_frame& frame) {
  frame = {from.index,
           from.time,
           from.markers_mm.data(),
           from.markers_mm.size() / 3,
           from.vertices.empty() ? nullptr : from.vertices.data(),
           from.vertices.size() / 3,
           {}};
  std::copy(from.arkit.begin(), from.arkit.end(), frame.arkit);
}

/// More than any stream takes at once; a larger count is a mistake of the caller's.
void expectCount(size_t count) {
  constexpr size_t kMost = 48'000 * 3600;
  if (count > kMost) throw InputError(fmt::format("found {} samples; expected at most {} at once", count, kMost));
}

template <typename Sample>
int pushLive(mouthpiece_live* live, const Sample* samples, size_t count, uint64_t at, char* error, size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(live, "live stream");
    if (count > 0) expectGiven(samples, "sound");
    expectCount(count);
    const std::span<const Sample> chunk(samples, count);
    at == MOUTHPIECE_FOLLOWS ? live->stream.push(chunk) : live->stream.push(chunk, at);
  });
}

}  // namespace

const char* mouthpiece_version(void) { return version(); }

void mouthpiece_options_init(mouthpiece_options* options) {
  if (options != nullptr) *options = {sizeof(mouthpiece_options), nullptr, nullptr, 1, nullptr, nullptr, 0};
}

int mouthpiece_speaker_new(const mouthpiece_options* options, mouthpiece_speaker** speaker, char* error,
                           size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(speaker, "speaker");
    *speaker = nullptr;
    *speaker = new mouthpiece_speaker{Speaker(optionsFrom(options))};
  });
}

void mouthpiece_speaker_free(mouthpiece_speaker* speaker) { delete speaker; }

int mouthpiece_speak(mouthpiece_speaker* speaker, const char* text, mouthpiece_performance** performance, char* error,
                     size_t error_size) {
  return perform(speaker, performance, error, error_size, [text] {
    expectGiven(text, "text");
    return Line::typed(text);
  });
}

int mouthpiece_perform_recording(mouthpiece_speaker* speaker, const char* audio_file, const char* transcript,
                                 mouthpiece_performance** performance, char* error, size_t error_size) {
  return perform(speaker, performance, error, error_size, [audio_file, transcript] {
    expectGiven(audio_file, "audio_file");
    expectGiven(transcript, "transcript");
    return Line::recorded(audio_file, transcript);
  });
}

int mouthpiece_perform_heard(mouthpiece_speaker* speaker, const char* audio_file, const char* hint,
                             mouthpiece_performance** performance, char* error, size_t error_size) {
  return perform(speaker, performance, error, error_size, [audio_file, hint] {
    expectGiven(audio_file, "audio_file");
    return Line::heard(audio_file, hint == nullptr ? "" : hint);
  });
}

int mouthpiece_perform_timed(mouthpiece_speaker* speaker, const char* audio_file, const char* times_file,
                             mouthpiece_performance** performance, char* error, size_t error_size) {
  return perform(speaker, performance, error, error_size, [audio_file, times_file] {
    expectGiven(audio_file, "audio_file");
    expectGiven(times_file, "times_file");
    return Line::timed(audio_file, times_file);
  });
}

int mouthpiece_sing(mouthpiece_speaker* speaker, const char* song_file, mouthpiece_performance** performance,
                    char* error, size_t error_size) {
  return perform(speaker, performance, error, error_size, [song_file] {
    expectGiven(song_file, "song_file");
    return Line::singing(song_file);
  });
}

int mouthpiece_sing_recording(mouthpiece_speaker* speaker, const char* song_file, const char* audio_file,
                              const double* song_offset_s, mouthpiece_performance** performance, char* error,
                              size_t error_size) {
  return perform(speaker, performance, error, error_size, [song_file, audio_file, song_offset_s] {
    expectGiven(song_file, "song_file");
    expectGiven(audio_file, "audio_file");
    Line line = Line::singing(song_file, audio_file);
    if (song_offset_s != nullptr) line.song_offset = *song_offset_s;
    return line;
  });
}

void mouthpiece_performance_free(mouthpiece_performance* performance) { delete performance; }

size_t mouthpiece_frame_count(const mouthpiece_performance* performance) {
  return performance == nullptr ? 0 : performance->performance.frameCount();
}

double mouthpiece_frame_rate(const mouthpiece_performance* performance) {
  return performance == nullptr ? 0 : performance->performance.frameRateHz();
}

const float* mouthpiece_sound(const mouthpiece_performance* performance, size_t* sample_count, int* sample_rate_hz) {
  static const Sound kSilence;
  const Sound& sound = performance == nullptr ? kSilence : performance->performance.sound();
  if (sample_count != nullptr) *sample_count = sound.samples.size();
  if (sample_rate_hz != nullptr) *sample_rate_hz = sound.sample_rate_hz;
  return sound.samples.data();
}

size_t mouthpiece_marker_count(const mouthpiece_performance* performance) {
  return performance == nullptr ? 0 : markersOf(*performance).size();
}

const char* mouthpiece_marker_name(const mouthpiece_performance* performance, size_t marker) {
  return marker < mouthpiece_marker_count(performance) ? markersOf(*performance)[marker].c_str() : nullptr;
}

size_t mouthpiece_warning_count(const mouthpiece_performance* performance) {
  return performance == nullptr ? 0 : performance->performance.warnings().size();
}

const char* mouthpiece_warning(const mouthpiece_performance* performance, size_t warning) {
  return warning < mouthpiece_warning_count(performance) ? performance->performance.warnings()[warning].c_str()
                                                         : nullptr;
}

size_t mouthpiece_notice_count(const mouthpiece_performance* performance) {
  return performance == nullptr ? 0 : performance->performance.notices().size();
}

const char* mouthpiece_notice(const mouthpiece_performance* performance, size_t notice) {
  return notice < mouthpiece_notice_count(performance) ? performance->performance.notices()[notice].c_str() : nullptr;
}

// The names are literals, so they end in 0.
const char* mouthpiece_arkit_name(size_t shape) {
  return shape < kArkitNames.size() ? kArkitNames[shape].data() : nullptr;
}

int mouthpiece_save(const mouthpiece_performance* performance, const char* file, char* error, size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(performance, "performance");
    expectGiven(file, "file");
    save(performance->performance, file);
  });
}

int mouthpiece_stream_new(const mouthpiece_performance* performance, mouthpiece_stream** stream, char* error,
                          size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(stream, "stream");
    *stream = nullptr;
    expectGiven(performance, "performance");
    *stream = new mouthpiece_stream{FrameStream(performance->performance)};
  });
}

int mouthpiece_stream_next(mouthpiece_stream* stream, mouthpiece_frame* frame, int* has_frame, char* error,
                           size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(stream, "stream");
    expectGiven(frame, "frame");
    expectGiven(has_frame, "has_frame");
    *has_frame = 0;
    const Frame* next = stream->stream.next();
    if (next == nullptr) return;
    tellFrame(*next, *frame);
    *has_frame = 1;
  });
}

void mouthpiece_stream_free(mouthpiece_stream* stream) { delete stream; }

int mouthpiece_live_new(const mouthpiece_speaker* speaker, double look_ahead_s, int sample_rate_hz,
                        mouthpiece_live** live, char* error, size_t error_size) {
  mouthpiece_live_options options;
  mouthpiece_live_options_init(&options);
  options.look_ahead_s = look_ahead_s;
  options.sample_rate_hz = sample_rate_hz;
  return mouthpiece_live_open(speaker, &options, live, error, error_size);
}

void mouthpiece_live_options_init(mouthpiece_live_options* options) {
  const LiveOptions usual;
  if (options != nullptr)
    *options = {sizeof *options, usual.look_ahead, usual.sample_rate_hz, MOUTHPIECE_LIVE_SOUND, 0, 1};
}

int mouthpiece_live_open(const mouthpiece_speaker* speaker, const mouthpiece_live_options* options,
                         mouthpiece_live** live, char* error, size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(live, "live stream");
    *live = nullptr;
    expectGiven(speaker, "speaker");
    *live = new mouthpiece_live{speaker->speaker.live(liveOptionsFrom(options)), {}};
  });
}

void mouthpiece_live_free(mouthpiece_live* live) { delete live; }

int mouthpiece_live_push_float(mouthpiece_live* live, const float* samples, size_t count, uint64_t at, char* error,
                               size_t error_size) {
  return pushLive(live, samples, count, at, error, error_size);
}

int mouthpiece_live_push_int16(mouthpiece_live* live, const int16_t* samples, size_t count, uint64_t at, char* error,
                               size_t error_size) {
  return pushLive(live, samples, count, at, error, error_size);
}

int mouthpiece_live_push_phone(mouthpiece_live* live, const char* phone, double start_s, double end_s, char* error,
                               size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(live, "live stream");
    expectGiven(phone, "phone");
    live->stream.push(LivePhone{phone, {start_s, end_s}});
  });
}

int mouthpiece_live_push_word(mouthpiece_live* live, const char* word, double start_s, double end_s, char* error,
                              size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(live, "live stream");
    expectGiven(word, "word");
    live->stream.push(word, TimeSpan{start_s, end_s});
  });
}

int mouthpiece_live_push_sound_of_words(mouthpiece_live* live, const float* samples, size_t count, char* error,
                                        size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(live, "live stream");
    if (count > 0) expectGiven(samples, "sound");
    expectCount(count);
    live->stream.pushSoundOfWords(std::span(samples, count));
  });
}

int mouthpiece_live_silence(mouthpiece_live* live, double until_s, char* error, size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(live, "live stream");
    live->stream.silence(until_s);
  });
}

int mouthpiece_live_say(mouthpiece_live* live, const char* text, const float** samples, size_t* sample_count,
                        int* sample_rate_hz, char* error, size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(live, "live stream");
    expectGiven(text, "text");
    live->said = live->stream.say(text);
    if (samples != nullptr) *samples = live->said.samples.data();
    if (sample_count != nullptr) *sample_count = live->said.samples.size();
    if (sample_rate_hz != nullptr) *sample_rate_hz = live->said.sample_rate_hz;
  });
}

int mouthpiece_live_say_in_pieces(mouthpiece_live* live, const char* text, mouthpiece_take_sound take, void* context,
                                  char* error, size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(live, "live stream");
    expectGiven(text, "text");
    live->stream.say(text, [&](Seconds begin, const Sound& piece) {
      if (take != nullptr) take(context, begin, piece.samples.data(), piece.samples.size(), piece.sample_rate_hz);
    });
  });
}

int mouthpiece_live_finish(mouthpiece_live* live, char* error, size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(live, "live stream");
    live->stream.finish();
  });
}

int mouthpiece_live_next(mouthpiece_live* live, int now, mouthpiece_frame* frame, int* has_frame, char* error,
                         size_t error_size) {
  return guarded(error, error_size, [&] {
    expectGiven(live, "live stream");
    expectGiven(frame, "frame");
    expectGiven(has_frame, "has_frame");
    *has_frame = 0;
    const Frame* next = now != 0 ? live->stream.nextNow() : live->stream.next();
    *has_frame = next != nullptr ? 1 : 0;
    if (next != nullptr) tellFrame(*next, *frame);
  });
}

int mouthpiece_live_is_finished(const mouthpiece_live* live) {
  return live == nullptr || live->stream.isFinished() ? 1 : 0;
}

void mouthpiece_live_counts_of(const mouthpiece_live* live, mouthpiece_live_counts* counts) {
  if (counts == nullptr) return;
  const LiveCounts of = live == nullptr ? LiveCounts() : live->stream.counts();
  *counts = {of.frames,  of.frames_at_rest, of.chunks,           of.dropped, of.late,
             of.doubled, of.restarts,       of.unusable_samples, of.missing};
}

size_t mouthpiece_live_words_missed(const mouthpiece_live* live) {
  return live == nullptr ? 0 : live->stream.counts().words_missed;
}
