#include "corpus_tools/building/earlier_build.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/files.h"

namespace mouthpiece {
namespace {

constexpr const char* kSettingsKey = "build_settings";

}  // namespace

std::string settingsOf(const BuildOptions& options) {
  std::string lexicon;
  for (const auto& [word, ways] : options.lexicon.words()) {
    lexicon += word;
    for (const Pronunciation& way : ways) {
      for (std::size_t i = 0; i < way.phones.size(); ++i) {
        lexicon += fmt::format(" {}{}", phoneName(way.phones[i]), way.stress[i]);
      }
      lexicon += ',';
    }
  }
  for (const auto& [from, to] : options.marker_names) lexicon += fmt::format("\n{}={}", from, to);
  const CleaningOptions& c = options.cleaning;
  return sha256Hex(fmt::format("{} {} {}{}{}{}{}{} {} {} {} {} {} {} {} {}", layoutToJson(options.layout), lexicon,
                               c.repair_swaps, c.hide_spikes, c.use_jig, c.remove_head, c.fill_gaps, c.smooth,
                               c.swaps.least_gain_mm, c.spikes.acceleration_mm_s2, c.head.jig_pose_smoothing,
                               c.head.skin_pose_smoothing, c.gaps.longest, c.gaps.memory, c.smoothed_from_hz,
                               options.align_takes));
}

void logForNextBuild(Corpus& corpus, const std::vector<TakeReport>& takes, const std::string& settings) {
  corpus.build_log[kTakeReportsKey] = reportsToJson(takes);
  corpus.build_log[kSettingsKey] = settings;
}

std::optional<EarlierBuild> EarlierBuild::find(const std::filesystem::path& output, const std::string& settings,
                                               const std::vector<std::string>& keys) {
  std::error_code error;
  if (output.empty() || !std::filesystem::exists(output, error)) return std::nullopt;
  try {
    EarlierBuild earlier{readCorpus(output, CorpusAudio::kSkip, CorpusMotion::kOnDemand), {}, {}};
    if (earlier.corpus.build_log[kSettingsKey] != settings) return std::nullopt;
    const std::vector<TakeReport> reports = reportsFromJson(earlier.corpus.build_log[kTakeReportsKey]);
    if (reports.size() != earlier.corpus.takes.size()) return std::nullopt;
    for (std::size_t i = 0; i < reports.size(); ++i) {
      if (reports[i].key.empty() || reports[i].name != earlier.corpus.takes[i].name) return std::nullopt;
      if (std::find(keys.begin(), keys.end(), reports[i].key) == keys.end()) continue;
      earlier.reports[reports[i].key] = reports[i];
      earlier.takes[reports[i].key] = i;
    }
    if (earlier.takes.empty()) return std::nullopt;
    for (const auto& [key, take] : earlier.takes) {  // damage is found now, not when all else is done
      (void)earlier.corpus.motion_source->load(TakeIndex(take));
      (void)earlier.corpus.motion_source->loadAudio(TakeIndex(take));
    }
    return earlier;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace mouthpiece
