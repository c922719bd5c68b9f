// Not a benchmark: how the lips of streams follow the capture of takes that the corpus does not have
// (docs/theory/units/live.md#words-heard-while-they-are-said). The corpus' speaker is not said to speak, so what hears
// knows nothing of him. For comparison labels, and words and phones as they are heard in the whole sound, told a stream
// that knows all of them.
//   stream_captured CORPUS LOOK_AHEAD_S TAKES ROWS        ROWS: of l(abels), w(ords), p(hones), s(tream of sound),
//                                                        n (the same without words)
#include <fmt/format.h>
#include <sys/resource.h>

#include <array>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "base/index.h"
#include "corpus_tools/building/corpus_builder.h"
#include "corpus_tools/takes/lip_measures.h"
#include "hearing/recognition/recogniser.h"
#include "mouthpiece/speaker.h"
#include "speaker/shared_files.h"
#include "streamed_labels.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

/// A look-ahead in which all of a line is known.
constexpr Seconds kWhole = 5;

/// What `stream` gives once everything was pushed, every second frame of it: the capture's rate.
MotionClip pulledFrom(LiveStream& stream, const std::vector<std::string>& markers) {
  std::vector<double> rows;
  for (stream.finish(); const Frame* frame = stream.next();) {
    if (frame->index % 2 == 0) rows.insert(rows.end(), frame->markers_mm.begin(), frame->markers_mm.end());
  }
  const Eigen::Index columns = 3 * std::ssize(markers);
  return {stream.frameRateHz() / 2, markers,
          Eigen::Map<PositionMatrix>(rows.data(), std::ssize(rows) / columns, columns)};
}

MotionClip followed(const Speaker& speaker, const SpeechLabels& labels, const std::vector<std::string>& markers) {
  LiveStream stream = speaker.live({.look_ahead = kWhole, .source = LiveOptions::Source::kLabels});
  pushLabels(stream, labels);
  return pulledFrom(stream, markers);
}

MotionClip heardOn(const Speaker& speaker, const AudioClip& audio, Seconds look_ahead,
                   const std::vector<std::string>& markers) {
  LiveStream stream = speaker.live({.look_ahead = look_ahead, .sample_rate_hz = 16000, .arkit = false});
  stream.push(audio.samples);
  return pulledFrom(stream, markers);
}

double processorTime() {
  double time = 0;
  rusage used{};
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    getrusage(who, &used);
    time += static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
            1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
  }
  return time;
}

void run(const std::string& corpus_file, Seconds look_ahead, const std::string& folder, std::string_view rows) {
  SpeakerOptions options;
  options.corpus = corpus_file;
  options.with_face = false;
  options.manner.frame_rate_hz = 50;
  const Speaker speaker(options);
  options.hear = SpeakerOptions::Hear::kPhones;
  const Speaker by_phones(options);
  const Corpus corpus = readCorpus(corpus_file);
  const std::vector<std::string> markers = corpus.layout.markerNames();
  RecogniserOptions hears;
  hears.word_network = sharedWordNetwork();
  const auto words = makeRecogniser(hears);
  hears.as = HearAs::kPhones;
  const auto phones = makeRecogniser(hears);
  const std::vector<CorpusTake> takes = readTakesInto(corpus, folder, {}).takes;
  for (const char row : rows) {
    LipMeasures lips;
    Seconds sound = 0;
    const double began = processorTime();
    for (const CorpusTake& take : takes) {
      const AudioClip audio = resampleAudio(take.audio, 16000);
      const MotionClip made = row == 'l'   ? followed(speaker, take.labels, markers)
                              : row == 'w' ? followed(speaker, words->hear(take.audio, take.name).labels, markers)
                              : row == 'p' ? followed(speaker, phones->hear(take.audio, take.name).labels, markers)
                                           : heardOn(row == 's' ? speaker : by_phones, audio, look_ahead, markers);
      lips += measureLips(take.motion, made, take.labels, corpus.layout);
      sound += audio.duration();
    }
    fmt::print(
        "{} r {:.3f} width {:.3f} closures {} of {} false {:.1f} % ({} of {}) lips {:.2f} mm; {:.3f} s a second\n", row,
        lips.openingCorrelation(), lips.widthCorrelation(), lips.closures_kept, lips.closures,
        100 * lips.falseClosureShare(), lips.false_closures, lips.open_phones, lips.lipRms(),
        (processorTime() - began) / sound);
  }
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) {
  if (argc != 5) {
    fmt::print(stderr, "usage: stream_captured CORPUS LOOK_AHEAD_S TAKES ROWS\n");
    return EXIT_FAILURE;
  }
  try {
    mouthpiece::run(argv[1], std::stod(argv[2]), argv[3], argv[4]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
