#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/time.h"

namespace mouthpiece {

struct SampleOptions {
  std::uint64_t seed = 1;
  std::optional<std::filesystem::path> truth_folder;  ///< also write the clean, head-still motion there
  std::vector<std::string> sentences;                 ///< what to say; empty: the 55 of sampleSentences()
  std::string voice = "festival:cmu_us_slt_arctic_hts";
  std::size_t jobs = 0;  ///< takes at once; 0: one per core. The result does not depend on it
};

struct SampleSummary {
  std::size_t takes = 0;
  Seconds speech_s = 0;      ///< length of all takes together
  std::size_t gaps = 0;      ///< stretches in which a marker was hidden
  double missing_share = 0;  ///< hidden samples over all samples
  std::string voice;         ///< the voice that really spoke
  std::string notice;        ///< a word of the voice to the user, or ""
};

/// Called from one thread at a time, with the number of takes done.
using SampleProgress = std::function<void(std::size_t done, std::size_t total)>;

/// Performs the sample corpus into `folder`: NAME.c3d, NAME.wav, NAME.txt and NAME.TextGrid for each sentence,
/// performed by the fitted actor (docs/theory/corpus_tools/actor_model.md), not captured. Files already there are
/// replaced one by one, each atomically. The same options give the same bytes. Throws InputError when a folder cannot
/// be written or the voice cannot say a sentence.
SampleSummary writeSampleCorpus(const std::filesystem::path& folder, const SampleOptions& options,
                                const SampleProgress& progress = {});

/// The sentences of a text file, one a line; blank lines and lines starting with '#' are left out. Throws InputError.
std::vector<std::string> readSentences(const std::filesystem::path& path);

/// One choice of EDGE 4's time grammar: {prolog} {exactness} {minutes} {hours} {day-info}; exactness and minutes may be
/// empty, as in the paper's own examples.
struct TimeSentence {
  std::string exactness, minutes, hours, day_info;

  [[nodiscard]] std::string text() const;  ///< "the time is now exactly one in the afternoon"
  bool operator==(const TimeSentence&) const = default;
};

/// All 2,880 sentences of the grammar, in a fixed order.
std::vector<TimeSentence> allTimeSentences();

/// `count` sentences that hold every word and as many word pairs as `count` sentences can; beyond that, as many pairs
/// of neighbouring sounds across a word boundary and word triples as possible. Greedy choice, then exchange while it
/// helps; the same for every call.
std::vector<TimeSentence> chooseTimeSentences(std::size_t count);

/// kClock: the texts of chooseTimeSentences(55), sample_data/prompts/time55.txt. kRich: these, then the sentences of
/// sample_data/prompts/rich.txt, which hold the phone pairs of running English. Both are built in.
enum class SamplePrompts { kClock, kRich };
std::vector<std::string> sampleSentences(SamplePrompts prompts = SamplePrompts::kClock);

}  // namespace mouthpiece
