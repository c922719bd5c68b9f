/* Pulls the frames of a line at 60 Hz, as a program in C or one that calls C would: pull_frames "the time is now" */
#include <mouthpiece/mouthpiece.h>
#include <stdio.h>

int main(int argc, char** argv) {
  char error[512];
  mouthpiece_options options;
  mouthpiece_speaker* speaker = NULL;
  mouthpiece_performance* line = NULL;
  mouthpiece_stream* stream = NULL;
  mouthpiece_frame frame;
  int has_frame = 0, result;
  size_t pulled = 0;

  mouthpiece_options_init(&options);
  options.frame_rate_hz = 60;
  result = mouthpiece_speaker_new(&options, &speaker, error, sizeof error);
  if (result == MOUTHPIECE_OK)
    result = mouthpiece_speak(speaker, argc > 1 ? argv[1] : "the time is now", &line, error, sizeof error);
  if (result == MOUTHPIECE_OK) result = mouthpiece_stream_new(line, &stream, error, sizeof error);
  while (result == MOUTHPIECE_OK) {
    result = mouthpiece_stream_next(stream, &frame, &has_frame, error, sizeof error);
    if (result != MOUTHPIECE_OK || !has_frame) break;
    ++pulled;
    if (frame.index % 30 == 0)
      printf("%5.2f s  %zu markers, %zu vertices, %s %.2f\n", frame.time_s, frame.marker_count, frame.vertex_count,
             mouthpiece_arkit_name(17), frame.arkit[17]);
  }
  if (result == MOUTHPIECE_OK)
    printf("%zu of %zu frames at %.0f Hz, Mouthpiece %s\n", pulled, mouthpiece_frame_count(line),
           mouthpiece_frame_rate(line), mouthpiece_version());
  else
    fprintf(stderr, "%s\n", error);
  mouthpiece_stream_free(stream);
  mouthpiece_performance_free(line);
  mouthpiece_speaker_free(speaker);
  return result;
}
