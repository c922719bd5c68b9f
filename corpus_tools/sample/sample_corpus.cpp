#include "corpus_tools/sample/sample_corpus.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "audio/audio_clip.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/parallel_for.h"
#include "base/text_numbers.h"
#include "corpus_tools/sample/actor_performance.h"
#include "corpus_tools/sample/sample_random.h"
#include "motion/formats/c3d_file.h"
#include "phonetics/labels/textgrid.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

constexpr double kCaptureRateHz = 120;
constexpr std::size_t kMostSentences = 100000, kLongestSentence = 2000;

// Room to breathe before the sentence and to come to rest after it, as in a recorded take.
constexpr std::uint64_t kSilenceStream = 60;
constexpr Seconds kShortestLead = 0.60, kLongestLead = 0.70;
constexpr Seconds kShortestTail = 0.40, kLongestTail = 0.50;
/// Takes last a multiple of this: whole frames at 120 Hz, whole samples at 16, 32 and 48 kHz.
constexpr Seconds kTakeStep = 0.025;

/// The seed of one take: of the corpus and the words, not of its place in the list.
std::uint64_t takeSeed(std::uint64_t seed, std::string_view sentence) {
  std::uint64_t hash = 0xCBF29CE484222325u ^ seed;  // FNV-1a
  for (const char byte : sentence) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001B3u;
  return hash;
}

void shiftLabels(SpeechLabels& labels, Seconds by) {
  for (LabelledPhone& phone : labels.phones) {
    phone.span.start += by;
    phone.span.end += by;
  }
}

/// `line` with silence of a recorded take's length at both ends.
void fitSilences(SpokenLine& line, std::uint64_t seed) {
  SampleRandom random(seed, kSilenceStream);
  std::vector<LabelledPhone>& phones = line.labels.phones;
  const double rate = line.audio.sample_rate_hz;
  const Seconds speech_start = phones.front().span.end, speech_end = phones.back().span.start;
  // A whole number of samples, so that sound and labels stay together.
  const Seconds lead = random.uniform(kShortestLead, kLongestLead), tail = random.uniform(kShortestTail, kLongestTail);
  const auto shift = signedIndex(std::lround((lead - speech_start) * rate));
  const Seconds shift_s = asReal(shift) / rate;
  const Seconds duration = std::ceil((speech_end + shift_s + tail) / kTakeStep) * kTakeStep;

  AudioClip audio{line.audio.sample_rate_hz,
                  std::vector<float>(static_cast<std::size_t>(std::lround(duration * rate)))};
  for (std::size_t i = 0; i < audio.samples.size(); ++i) {
    const std::ptrdiff_t from = signedIndex(i) - shift;
    if (from >= 0 && from < signedIndex(line.audio.samples.size())) {
      audio.samples[i] = line.audio.samples[unsignedIndex(from)];
    }
  }
  line.audio = std::move(audio);
  shiftLabels(line.labels, shift_s);
  phones.front().span.start = 0;
  phones.back().span.end = duration;
}

struct TakeResult {
  SampleGaps hidden;
  std::size_t samples = 0;
  Seconds duration = 0;
  std::string voice, notice;
};

TakeResult writeTake(const std::filesystem::path& folder, const SampleOptions& options, const std::string& name,
                     const std::string& sentence, Voice& voice) {
  const std::uint64_t seed = takeSeed(options.seed, sentence);
  SpokenLine line = voice.speak(sentence);
  fitSilences(line, seed);

  ActorOptions acting{.frame_rate_hz = kCaptureRateHz, .variation = kActorVariation, .seed = seed, .expression = true};
  acting.frame_count = static_cast<std::size_t>(std::lround(line.labels.duration() * kCaptureRateHz));
  const MotionClip face = performSpeech(sampleActor(), line.labels, acting);
  const SampleCapture capture = captureSample(face, line.labels, {.seed = seed});

  writeC3d(folder / (name + ".c3d"), capture.motion);
  writeWav(folder / (name + ".wav"), line.audio);
  writeTextGrid(folder / (name + ".TextGrid"), line.labels);
  writeFileAtomically(folder / (name + ".txt"), sentence + "\n");
  if (options.truth_folder) writeC3d(*options.truth_folder / (name + ".c3d"), face);
  return {capture.hidden, capture.motion.frameCount() * capture.motion.markerCount(), line.labels.duration(),
          line.voice, line.notice};
}

}  // namespace

SampleSummary writeSampleCorpus(const std::filesystem::path& folder, const SampleOptions& options,
                                const SampleProgress& progress) {
  const std::vector<std::string> sentences = options.sentences.empty() ? sampleSentences() : options.sentences;
  const std::size_t jobs =
      std::clamp<std::size_t>(options.jobs == 0 ? defaultThreadCount() : options.jobs, 1, sentences.size());
  const std::size_t digits = std::max<std::size_t>(2, std::to_string(sentences.size()).size());

  std::vector<TakeResult> results(sentences.size());
  std::mutex progress_lock;
  std::size_t done = 0;
  // A voice serves one thread: each job has one and takes every jobs-th sentence.
  parallelFor(jobs, jobs, [&](std::size_t job) {
    const std::unique_ptr<Voice> voice = makeVoice(options.voice);
    for (std::size_t i = job; i < sentences.size(); i += jobs) {
      const std::string name = fmt::format("take_{:0{}}", i + 1, digits);
      results[i] = writeTake(folder, options, name, sentences[i], *voice);
      const std::lock_guard lock(progress_lock);
      if (progress) progress(++done, sentences.size());
    }
  });

  SampleSummary summary;
  std::size_t samples = 0, hidden = 0;
  for (const TakeResult& result : results) {
    summary.speech_s += result.duration;
    summary.gaps += result.hidden.gaps;
    hidden += result.hidden.hidden_samples;
    samples += result.samples;
  }
  summary.takes = results.size();
  summary.missing_share = asReal(hidden) / asReal(samples);
  summary.voice = results.front().voice;
  summary.notice = results.front().notice;
  return summary;
}

std::vector<std::string> readSentences(const std::filesystem::path& path) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 26;
  const std::string text = readFile(path, kMostBytes);
  std::vector<std::string> sentences;
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    line = trimmed(line);
    if (line.empty() || line.starts_with('#')) continue;
    if (line.size() > kLongestSentence || sentences.size() == kMostSentences) {
      throw InputError(path.string(), std::to_string(lines.lineNumber()),
                       fmt::format("found {} bytes in sentence {}; expected at most {} bytes and {} sentences",
                                   line.size(), sentences.size() + 1, kLongestSentence, kMostSentences));
    }
    sentences.emplace_back(line);
  }
  if (sentences.empty()) throw InputError(path.string(), "", "found no sentence; expected one a line");
  return sentences;
}

}  // namespace mouthpiece
