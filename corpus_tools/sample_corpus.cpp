#include "corpus_tools/sample_corpus.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <sstream>

#include "base/errors.h"
#include "base/files.h"
#include "base/parallel_for.h"
#include "corpus_tools/actor_model.h"
#include "corpus_tools/actor_performance.h"
#include "corpus_tools/sample_capture.h"
#include "corpus_tools/sample_sentences.h"
#include "motion/c3d_file.h"
#include "phonetics/textgrid.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr double kSampleRateHz = 120;  ///< EDGE section 4
constexpr std::uint64_t kMaxSentenceFileBytes = 1 << 20;
constexpr std::size_t kMostSentences = 10000;

struct PerformedTake {
  Seconds duration = 0;
  std::size_t gaps = 0, hidden_samples = 0, samples = 0;
  std::string voice, notice;
};

/// Takes of one seed differ, and a take stays the same when others are added.
std::uint64_t seedOfTake(std::uint64_t seed, std::size_t take) { return seed * 1'000'003U + take; }

PerformedTake performTake(const fs::path& folder, const std::string& name, const std::string& sentence,
                          std::uint64_t seed, const SampleOptions& options) {
  const SpokenLine line = makeVoice(options.voice)->speak(sentence);
  const Seconds duration = std::max(line.audio.duration(), line.labels.duration());
  ActorOptions acting;
  acting.frame_rate_hz = kSampleRateHz;
  acting.frame_count = static_cast<std::size_t>(std::ceil(duration * kSampleRateHz)) + 1;
  acting.variation = kActorVariation;
  acting.seed = seed;
  acting.expression = true;
  const MotionClip performance = performSpeech(sampleActor(), line.labels, acting);
  const SampleCapture capture = captureSample(performance, {}, seed);

  writeC3d(folder / (name + ".c3d"), capture.motion);
  writeWav(folder / (name + ".wav"), line.audio);
  writeTextGrid(folder / (name + ".TextGrid"), line.labels);
  writeFileAtomically(folder / (name + ".txt"), sentence + "\n");
  if (options.truth_folder) writeC3d(*options.truth_folder / (name + ".c3d"), performance);

  PerformedTake take{duration, capture.gaps, 0, 0, line.voice, line.notice};
  take.samples = static_cast<std::size_t>(capture.motion.positions_mm.size());
  take.hidden_samples = static_cast<std::size_t>(capture.motion.positions_mm.array().isNaN().count());
  return take;
}

}  // namespace

std::vector<std::string> readSentences(const fs::path& path) {
  std::vector<std::string> sentences;
  std::istringstream stream(readFile(path, kMaxSentenceFileBytes));
  for (std::string line; std::getline(stream, line);) {
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    if (!line.empty() && !line.starts_with('#')) sentences.push_back(line);
  }
  if (sentences.empty() || sentences.size() > kMostSentences) {
    throw InputError(path.string(), "",
                     fmt::format("found {} sentences; expected 1 to {}", sentences.size(), kMostSentences));
  }
  return sentences;
}

SampleSummary writeSampleCorpus(const fs::path& folder, const SampleOptions& options, const SampleProgress& progress) {
  const std::vector<std::string> sentences = options.sentences.empty() ? sampleSentences() : options.sentences;
  const std::size_t jobs = options.jobs == 0 ? defaultThreadCount() : options.jobs;
  std::vector<PerformedTake> takes(sentences.size());
  std::mutex progress_mutex;
  std::size_t done = 0;
  parallelFor(sentences.size(), jobs, [&](std::size_t i) {
    takes[i] =
        performTake(folder, fmt::format("time_{:02}", i + 1), sentences[i], seedOfTake(options.seed, i), options);
    const std::scoped_lock lock(progress_mutex);
    ++done;
    if (progress) progress(done, sentences.size());
  });

  SampleSummary summary;
  summary.takes = takes.size();
  std::size_t hidden = 0, samples = 0;
  for (const PerformedTake& take : takes) {
    summary.speech_s += take.duration;
    summary.gaps += take.gaps;
    hidden += take.hidden_samples;
    samples += take.samples;
    summary.voice = take.voice;
    if (!take.notice.empty()) summary.notice = take.notice;
  }
  summary.missing_share = samples > 0 ? static_cast<double>(hidden) / static_cast<double>(samples) : 0.0;
  return summary;
}

}  // namespace mouthpiece
