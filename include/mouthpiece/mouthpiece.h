/* Mouthpiece from C, and from what calls C. Handles are opaque; no function throws, prints or exits. Functions that can
 * fail return MOUTHPIECE_OK, or another code and one line of text (file, place, found, expected) in `error`, which
 * holds `error_size` bytes with the final 0 and may be null. Strings are UTF-8; what a handle gives stays until the
 * handle is freed. A speaker and a stream belong to one thread at a time; a performance may be read by many. */
#ifndef MOUTHPIECE_MOUTHPIECE_H
#define MOUTHPIECE_MOUTHPIECE_H

#include <stddef.h>
#include <stdint.h>

#include "mouthpiece/version.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mouthpiece_speaker mouthpiece_speaker;
typedef struct mouthpiece_performance mouthpiece_performance;
typedef struct mouthpiece_stream mouthpiece_stream;

enum mouthpiece_result {
  MOUTHPIECE_OK = 0,
  MOUTHPIECE_BAD_INPUT = 1, /* of a file, an argument, a text */
  MOUTHPIECE_NO_MEMORY = 2,
  MOUTHPIECE_INTERNAL = 3 /* a fault of Mouthpiece: please report it */
};

/* Set by mouthpiece_options_init(); null and 0 stand for the defaults of the program `synth`, but for with_face. */
typedef struct mouthpiece_options {
  size_t size; /* of this struct, as the caller knows it */
  const char* corpus;
  const char* face;
  int with_face; /* 0: sound, labels and markers alone */
  const char* voice;
  const char* lexicon;
  double frame_rate_hz;
} mouthpiece_options;

/* One frame of a stream; the pointers stay until the next call. */
typedef struct mouthpiece_frame {
  size_t index;
  double time_s;
  const double* markers_mm; /* x y z of each marker */
  size_t marker_count;
  const float* vertices; /* x y z of each vertex, the mesh's unit; null without a face */
  size_t vertex_count;
  float arkit[52]; /* weights, 0 to 1, in the order of mouthpiece_arkit_name() */
} mouthpiece_frame;

/* The version of the library at hand, as "0.2.0". */
MOUTHPIECE_API const char* mouthpiece_version(void);

MOUTHPIECE_API void mouthpiece_options_init(mouthpiece_options* options);
/* `options` may be null. */
MOUTHPIECE_API int mouthpiece_speaker_new(const mouthpiece_options* options, mouthpiece_speaker** speaker, char* error,
                                          size_t error_size);
MOUTHPIECE_API void mouthpiece_speaker_free(mouthpiece_speaker* speaker);

MOUTHPIECE_API int mouthpiece_speak(mouthpiece_speaker* speaker, const char* text, mouthpiece_performance** performance,
                                    char* error, size_t error_size);
/* A recording (WAV, FLAC, Ogg, MP3; what ffmpeg reads where it is installed) of what `transcript` says. */
MOUTHPIECE_API int mouthpiece_perform_recording(mouthpiece_speaker* speaker, const char* audio_file,
                                                const char* transcript, mouthpiece_performance** performance,
                                                char* error, size_t error_size);
/* A recording that nobody wrote down: what it says is recognised. `hint`: words that are likely in it; null for none.
 */
MOUTHPIECE_API int mouthpiece_perform_heard(mouthpiece_speaker* speaker, const char* audio_file, const char* hint,
                                            mouthpiece_performance** performance, char* error, size_t error_size);
/* The same with words and times that another program told of it: Whisper's JSON, SRT ... (docs/formats/times.md). */
MOUTHPIECE_API int mouthpiece_perform_timed(mouthpiece_speaker* speaker, const char* audio_file, const char* times_file,
                                            mouthpiece_performance** performance, char* error, size_t error_size);
/* A song file: song.json, MusicXML, MIDI ... (docs/formats/song.md). */
MOUTHPIECE_API int mouthpiece_sing(mouthpiece_speaker* speaker, const char* song_file,
                                   mouthpiece_performance** performance, char* error, size_t error_size);
/* The same with its sound, as somebody or a vocal synthesizer sings it. `song_offset_s`: where in the sound the song's
 * clock stands at 0; null: it is found by the melody. */
MOUTHPIECE_API int mouthpiece_sing_recording(mouthpiece_speaker* speaker, const char* song_file, const char* audio_file,
                                             const double* song_offset_s, mouthpiece_performance** performance,
                                             char* error, size_t error_size);
MOUTHPIECE_API void mouthpiece_performance_free(mouthpiece_performance* performance);

MOUTHPIECE_API size_t mouthpiece_frame_count(const mouthpiece_performance* performance);
MOUTHPIECE_API double mouthpiece_frame_rate(const mouthpiece_performance* performance);
/* Mono, in [-1, 1]. */
MOUTHPIECE_API const float* mouthpiece_sound(const mouthpiece_performance* performance, size_t* sample_count,
                                             int* sample_rate_hz);
MOUTHPIECE_API size_t mouthpiece_marker_count(const mouthpiece_performance* performance);
/* Null beyond the last. */
MOUTHPIECE_API const char* mouthpiece_marker_name(const mouthpiece_performance* performance, size_t marker);
MOUTHPIECE_API size_t mouthpiece_warning_count(const mouthpiece_performance* performance);
MOUTHPIECE_API const char* mouthpiece_warning(const mouthpiece_performance* performance, size_t warning);
/* What is no doubt, but worth telling. Null beyond the last. */
MOUTHPIECE_API size_t mouthpiece_notice_count(const mouthpiece_performance* performance);
MOUTHPIECE_API const char* mouthpiece_notice(const mouthpiece_performance* performance, size_t notice);
/* Apple's name of an ARKit shape, 0 to 51; null beyond. */
MOUTHPIECE_API const char* mouthpiece_arkit_name(size_t shape);
/* Writes a file whose kind follows from its ending: .glb, .wav, .c3d, arkit.csv, report.json ... */
MOUTHPIECE_API int mouthpiece_save(const mouthpiece_performance* performance, const char* file, char* error,
                                   size_t error_size);

/* The frames one by one. The stream keeps the performance alive. */
MOUTHPIECE_API int mouthpiece_stream_new(const mouthpiece_performance* performance, mouthpiece_stream** stream,
                                         char* error, size_t error_size);
/* Sets *has_frame to 0 after the last. */
MOUTHPIECE_API int mouthpiece_stream_next(mouthpiece_stream* stream, mouthpiece_frame* frame, int* has_frame,
                                          char* error, size_t error_size);
MOUTHPIECE_API void mouthpiece_stream_free(mouthpiece_stream* stream);

/* Frames of a line while it is being said (mouthpiece/live.h): push sound, or labels, as they come, and pull frames.
 * One thread may push while another pulls; a live stream may outlive its speaker. */
typedef struct mouthpiece_live mouthpiece_live;

/* What came, and what did not: LiveCounts. */
typedef struct mouthpiece_live_counts {
  size_t frames, frames_at_rest, chunks, dropped, late, doubled, restarts, unusable_samples;
  double missing_s;
} mouthpiece_live_counts;

/* What is pushed: it is made ready at once, not when the first of it comes. */
enum mouthpiece_live_source {
  MOUTHPIECE_LIVE_SOUND = 0,
  MOUTHPIECE_LIVE_LABELS = 1, /* phones or words with their times */
  MOUTHPIECE_LIVE_TEXT = 2
};

/* Set by mouthpiece_live_options_init() to LiveOptions' defaults. */
typedef struct mouthpiece_live_options {
  size_t size;         /* of this struct, as the caller knows it */
  double look_ahead_s; /* 0.05 to 5 */
  int sample_rate_hz;  /* of the sound that is pushed: 16000 to 48000 */
  int source;          /* mouthpiece_live_source */
  int own_voice;       /* not 0: who speaks is the person whose takes the corpus holds */
  int arkit;           /* 0: frames' weights stay 0, which saves their time */
} mouthpiece_live_options;

/* A chunk's place where it just follows the one before. */
#define MOUTHPIECE_FOLLOWS UINT64_MAX

/* `look_ahead_s`: 0.05 to 5; `sample_rate_hz` of the sound that is pushed: 16000 to 48000. */
MOUTHPIECE_API int mouthpiece_live_new(const mouthpiece_speaker* speaker, double look_ahead_s, int sample_rate_hz,
                                       mouthpiece_live** live, char* error, size_t error_size);
MOUTHPIECE_API void mouthpiece_live_options_init(mouthpiece_live_options* options);
/* `options` may be null. */
MOUTHPIECE_API int mouthpiece_live_open(const mouthpiece_speaker* speaker, const mouthpiece_live_options* options,
                                        mouthpiece_live** live, char* error, size_t error_size);
MOUTHPIECE_API void mouthpiece_live_free(mouthpiece_live* live);
/* `at`: the chunk's first sample, counted from the stream's start, or MOUTHPIECE_FOLLOWS. */
MOUTHPIECE_API int mouthpiece_live_push_float(mouthpiece_live* live, const float* samples, size_t count, uint64_t at,
                                              char* error, size_t error_size);
MOUTHPIECE_API int mouthpiece_live_push_int16(mouthpiece_live* live, const int16_t* samples, size_t count, uint64_t at,
                                              char* error, size_t error_size);
/* ARPAbet, IPA or "sil"; times in seconds from the stream's start. */
MOUTHPIECE_API int mouthpiece_live_push_phone(mouthpiece_live* live, const char* phone, double start_s, double end_s,
                                              char* error, size_t error_size);
MOUTHPIECE_API int mouthpiece_live_push_word(mouthpiece_live* live, const char* word, double start_s, double end_s,
                                             char* error, size_t error_size);
/* `count` samples of sound beside words, from the stream's start on, in [-1, 1] at the stream's rate: they tell when
   each phone of a word that is pushed later is said. */
MOUTHPIECE_API int mouthpiece_live_push_sound_of_words(mouthpiece_live* live, const float* samples, size_t count,
                                                       char* error, size_t error_size);
MOUTHPIECE_API int mouthpiece_live_silence(mouthpiece_live* live, double until_s, char* error, size_t error_size);
/* Lets the speaker's voice say a text. Its sound stays until the next call; the pointers may be null. */
MOUTHPIECE_API int mouthpiece_live_say(mouthpiece_live* live, const char* text, const float** samples,
                                       size_t* sample_count, int* sample_rate_hz, char* error, size_t error_size);
/* A piece of a text's sound, which begins `begin_s` after the stream's start; it stays until the function returns. */
typedef void (*mouthpiece_take_sound)(void* context, double begin_s, const float* samples, size_t sample_count,
                                      int sample_rate_hz);
/* The same, with its sound in pieces as the voice makes them, `take` called with `context` for each: the frames of what
   it belongs to can be had before. `take` may ask for them, but pushes and says nothing. */
MOUTHPIECE_API int mouthpiece_live_say_in_pieces(mouthpiece_live* live, const char* text, mouthpiece_take_sound take,
                                                 void* context, char* error, size_t error_size);
MOUTHPIECE_API int mouthpiece_live_finish(mouthpiece_live* live, char* error, size_t error_size);
/* Sets *has_frame to 0 where the next frame is not known. With `now` not 0 there always is one: the mouth comes to rest
 * where nothing is known. */
MOUTHPIECE_API int mouthpiece_live_next(mouthpiece_live* live, int now, mouthpiece_frame* frame, int* has_frame,
                                        char* error, size_t error_size);
MOUTHPIECE_API int mouthpiece_live_is_finished(const mouthpiece_live* live);
MOUTHPIECE_API void mouthpiece_live_counts_of(const mouthpiece_live* live, mouthpiece_live_counts* counts);
/* Hearings of words that failed or took too long: phones are heard in their stead. */
MOUTHPIECE_API size_t mouthpiece_live_words_missed(const mouthpiece_live* live);

#ifdef __cplusplus
}
#endif
#endif
