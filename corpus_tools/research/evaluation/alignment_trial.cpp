#include "corpus_tools/research/evaluation/hearing_trials.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/errors.h"
#include "base/parallel_for.h"
#include "base/statistics.h"
#include "corpus_tools/research/evaluation/noises.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/network/network_phones.h"

namespace mouthpiece {
namespace {

constexpr std::array<double, 3> kLevelsDb{20, 10, 5};
constexpr Seconds kReverberation = 0.4;
constexpr Seconds kLongSilence = 0.150;

using Words = std::vector<TranscriptWord>;

/// Said as the labels have them.
Words wordsAsLabelled(const SpeechLabels& labels) {
  Words words;
  for (const LabelledWord& word : labels.words) {
    Pronunciation way;
    for (std::size_t i = word.phones.first.value; i <= word.phones.last.value; ++i) {
      if (labels.phones[i].phone != Phone::kSil) way.phones.push_back(labels.phones[i].phone);
    }
    way.stress.assign(way.phones.size(), -1);
    if (!way.phones.empty()) words.push_back({word.text, {way}});
  }
  return words;
}

/// Starts of the phones that are no silence, and of each word but the last how much silence follows it.
struct Places {
  std::vector<Seconds> starts, silences;
};

Places placesOf(const SpeechLabels& labels) {
  Places places;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone != Phone::kSil) places.starts.push_back(phone.span.start);
  }
  for (std::size_t word = 0; word + 1 < labels.words.size(); ++word) {
    const Seconds end = labels.phones[labels.words[word].phones.last.value].span.end;
    places.silences.push_back(labels.phones[labels.words[word + 1].phones.first.value].span.start - end);
  }
  return places;
}

void compare(const Places& clean, const Places& noisy, NoiseRow& row) {
  ++row.takes;
  if (noisy.starts.size() != clean.starts.size() || noisy.silences.size() != clean.silences.size()) {
    ++row.unaligned;
    return;
  }
  for (std::size_t i = 0; i < clean.starts.size(); ++i)
    row.start_errors_ms.push_back(1000 * std::abs(noisy.starts[i] - clean.starts[i]));
  row.words += clean.silences.size();
  for (std::size_t i = 0; i < clean.silences.size(); ++i)
    row.silences += noisy.silences[i] > kLongSilence && clean.silences[i] <= kLongSilence ? 1U : 0U;
}

/// Texts that are not said in take `index`.
Words cut(Words words) {
  words.resize(words.size() - std::max<std::size_t>(1, words.size() / 3));
  return words;
}

/// One word in five, at least one, is another word of the takes.
Words changed(Words words, const std::vector<Words>& all, std::size_t index) {
  const std::size_t count = std::max<std::size_t>(1, words.size() / 5);
  for (std::size_t k = 0; k < count; ++k) {
    TranscriptWord& word = words[(index + k * words.size() / count) % words.size()];
    for (std::size_t away = 1; away < all.size(); ++away) {
      const Words& others = all[(index + 7 * away) % all.size()];
      if (others.empty()) continue;
      const TranscriptWord& other = others[(index + away) % others.size()];
      if (other.ways.front().phones == word.ways.front().phones) continue;
      word = other;
      break;
    }
  }
  return words;
}

/// What one take adds to the table; rows as tryAlignment() returns them.
class TakeTrial {
 public:
  TakeTrial(ForcedAligner& aligner, WordNetwork* network, const std::vector<Words>& words,
            const std::vector<AudioClip>& voices)
      : aligner_(aligner), network_(network), words_(words), voices_(voices) {}

  AlignmentTrial run(std::size_t index, const AudioClip& sound) {
    AlignmentTrial trial;
    const Words& own = words_[index];
    const std::optional<ForcedAlignment> clean = align(sound, own);
    const Places places = clean ? placesOf(clean->labels) : Places();
    const auto compareUnder = [&](const std::string& under, const AudioClip& noisy) {
      const std::optional<ForcedAlignment> found = clean ? align(noisy, own) : std::nullopt;
      compare(places, found ? placesOf(found->labels) : Places(), trial.noise.emplace_back(NoiseRow{.under = under}));
    };
    doubt(trial, "", sound, index);
    for (const Noise noise : kNoises) {
      for (const double level : kLevelsDb) {
        const AudioClip noisy = inNoise(sound, noise, level, voices_, index + 1);
        const std::string under = fmt::format("{}, {:.0f} dB", noiseName(noise), level);
        compareUnder(under, noisy);
        if (noise != Noise::kMusic) doubt(trial, under, noisy, index);
      }
    }
    compareUnder(fmt::format("a room, {:.1f} s", kReverberation), inRoom(sound, kReverberation, index + 1));
    return trial;
  }

 private:
  std::optional<ForcedAlignment> align(const AudioClip& sound, const Words& words) {
    std::string fault;
    const HeardPhones heard =
        network_ != nullptr ? phonesBesideText(*network_, samplesToHear(sound), english(), fault) : HeardPhones();
    if (!fault.empty()) throw InputError("trial", "", fault);
    try {
      return aligner_.align(SamplesToHear(sound), sound.duration(), words, "trial", SpeechKind::kSpoken,
                            BorderTimes::kFine, heard);
    } catch (const InputError&) {  // the sound cannot hold them
      return std::nullopt;
    }
  }

  void doubt(AlignmentTrial& trial, const std::string& under, const AudioClip& sound, std::size_t index) {
    const Words& own = words_[index];
    const auto add = [&](const std::string& text, const Words& words) {
      const std::optional<ForcedAlignment> found = align(sound, words);
      const bool doubted = !found || !doubtsAbout(*found).empty();
      trial.doubt.push_back({text, under, 1, doubted ? 1U : 0U});
    };
    add("right", own);
    add("another's", words_[(index + words_.size() / 2) % words_.size()]);
    add("cut", cut(own));
    add("one word in five changed", changed(own, words_, index));
  }

  ForcedAligner& aligner_;
  WordNetwork* network_;
  const std::vector<Words>& words_;
  const std::vector<AudioClip>& voices_;
};

void addTo(AlignmentTrial& sum, const AlignmentTrial& take) {
  if (sum.noise.empty()) {
    sum = take;
    return;
  }
  for (std::size_t i = 0; i < sum.noise.size(); ++i) {
    NoiseRow& row = sum.noise[i];
    const NoiseRow& more = take.noise[i];
    row.start_errors_ms.insert(row.start_errors_ms.end(), more.start_errors_ms.begin(), more.start_errors_ms.end());
    row.words += more.words;
    row.silences += more.silences;
    row.takes += more.takes;
    row.unaligned += more.unaligned;
  }
  for (std::size_t i = 0; i < sum.doubt.size(); ++i) {
    sum.doubt[i].lines += take.doubt[i].lines;
    sum.doubt[i].doubted += take.doubt[i].doubted;
  }
}

double shareOf(std::size_t part, std::size_t whole) { return whole > 0 ? asReal(part) / asReal(whole) : std::nan(""); }

}  // namespace

AlignmentTrial tryAlignment(const Corpus& corpus, const AlignmentTrialOptions& options) {
  constexpr int kVoiceRateHz = 16000;
  const Corpus some = evenlySpacedTakes(corpus, options.most_takes);
  std::vector<Words> words;
  std::vector<AudioClip> sounds, voices;
  for (const CorpusTake& take : some.takes) {
    Words own = wordsAsLabelled(take.labels);
    if (own.size() < 2 || take.audio.samples.empty()) continue;
    words.push_back(std::move(own));
    sounds.push_back(take.audio);
    voices.push_back(resampleAudio(take.audio, kVoiceRateHz));
  }
  if (sounds.size() < 2) throw InputError(corpus.name, "", "has fewer than two takes with sound and words");
  std::vector<AlignmentTrial> trials(sounds.size());
  const std::size_t jobs = std::min(sounds.size(), options.jobs > 0 ? options.jobs : defaultThreadCount());
  std::mutex told;
  std::size_t done = 0;
  parallelFor(jobs, jobs, [&](std::size_t job) {
    ForcedAligner aligner;
    TakeTrial trial(aligner, options.network, words, voices);
    for (std::size_t i = job; i < sounds.size(); i += jobs) {
      trials[i] = trial.run(i, sounds[i]);
      const std::scoped_lock lock(told);
      if (options.progress) options.progress(++done, sounds.size());
    }
  });
  AlignmentTrial sum;
  for (const AlignmentTrial& trial : trials) addTo(sum, trial);
  return sum;
}

std::string alignmentTable(const AlignmentTrial& trial) {
  std::string table = fmt::format("{:20} {:>7} {:>9} {:>12} {:>10} {:>10}\n", "under the speech", "phones", "median ms",
                                  "90 % within", "silences", "unaligned");
  for (const NoiseRow& row : trial.noise) {
    table += fmt::format("{:20} {:>7} {:>9.1f} {:>12.1f} {:>9.1f}% {:>10}\n", row.under, row.start_errors_ms.size(),
                         median(row.start_errors_ms), quantile(row.start_errors_ms, 0.9),
                         100 * shareOf(row.silences, row.words), row.unaligned);
  }
  table +=
      "phones' starts against those found in the sound alone; silences: words that over 150 ms of silence follow, "
      "where the sound alone has none\n\n";
  table += fmt::format("{:26} {:>14} {:>8} {:>9}\n", "text", "under it", "lines", "doubted");
  for (const DoubtRow& row : trial.doubt)
    table += fmt::format("{:26} {:>14} {:>8} {:>8.1f}%\n", row.text, row.under, row.lines,
                         100 * shareOf(row.doubted, row.lines));
  return table;
}

std::string alignmentJson(const AlignmentTrial& trial) {
  nlohmann::ordered_json noise = nlohmann::ordered_json::array(), doubt = nlohmann::ordered_json::array();
  for (const NoiseRow& row : trial.noise) {
    noise.push_back({{"under", row.under},
                     {"phones", row.start_errors_ms.size()},
                     {"median_ms", median(row.start_errors_ms)},
                     {"within_90_percent_ms", quantile(row.start_errors_ms, 0.9)},
                     {"words", row.words},
                     {"silences", row.silences},
                     {"takes", row.takes},
                     {"unaligned", row.unaligned}});
  }
  for (const DoubtRow& row : trial.doubt)
    doubt.push_back({{"text", row.text}, {"under", row.under}, {"lines", row.lines}, {"doubted", row.doubted}});
  return nlohmann::ordered_json{{"noise", noise}, {"doubt", doubt}}.dump(1) + "\n";
}

}  // namespace mouthpiece
