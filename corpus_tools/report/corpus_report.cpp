#include "corpus_tools/report/corpus_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>

#include "base/byte_reader.h"
#include "base/json_text.h"
#include "base/page_data.h"
#include "base/statistics.h"
#include "corpus_tools/report/data_page.h"
#include "corpus_tools/takes/take_report.h"
#include "motion/cleaning/repairs.h"

namespace mouthpiece {

extern const std::string_view kCorpusReportPage;

namespace {

using Json = nlohmann::json;

/// Trajectories in the page: enough to see a closure by, small enough for some hours.
constexpr double kPageRateHz = 30;
/// A position in the page is a whole number of these; 32767 stands for a marker that was not seen.
constexpr double kPageStepMm = 0.01;
constexpr long kNotSeen = 32767;
constexpr std::size_t kMostMissingShown = 200;
/// Labels that no mouth can make, or that a label program's slip made.
constexpr Seconds kShortestLikelyPhone = 0.015;
constexpr Seconds kLongestLikelyPhone = 0.6;

using PairCounts = std::array<std::array<std::size_t, kPhoneCount>, kPhoneCount>;

std::size_t indexOf(Phone phone) { return static_cast<std::size_t>(phone); }

std::vector<Phone> labelPhones() {
  std::vector<Phone> phones;
  for (std::size_t i = 0; i < kPhoneCount; ++i) phones.push_back(static_cast<Phone>(i));
  return phones;
}

struct Coverage {
  PairCounts pairs{};
  std::array<std::vector<double>, kPhoneCount> durations_s;
  std::map<std::string, std::size_t> syllables, words;
};

Coverage coverageOf(const Corpus& corpus) {
  Coverage coverage;
  for (const CorpusTake& take : corpus.takes) {
    const auto& phones = take.labels.phones;
    for (std::size_t i = 0; i < phones.size(); ++i) {
      coverage.durations_s[indexOf(phones[i].phone)].push_back(phones[i].span.duration());
      if (i > 0) ++coverage.pairs[indexOf(phones[i - 1].phone)][indexOf(phones[i].phone)];
    }
    for (const LabelledSyllable& syllable : take.labels.syllables) {
      std::string text;
      for (std::size_t i = syllable.phones.first.value; i <= syllable.phones.last.value; ++i) {
        text += (text.empty() ? "" : " ") + std::string(phoneName(phones[i].phone));
      }
      ++coverage.syllables[text];
    }
    for (const LabelledWord& word : take.labels.words) ++coverage.words[word.text];
  }
  return coverage;
}

Json phonesJson(const Coverage& coverage) {
  Json list = Json::array();
  for (const Phone phone : labelPhones()) {
    const std::vector<double>& durations = coverage.durations_s[indexOf(phone)];
    list.push_back({{"phone", phoneName(phone)},
                    {"count", durations.size()},
                    {"ms_5", std::round(1e3 * quantile(durations, 0.05, 0))},
                    {"ms_50", std::round(1e3 * quantile(durations, 0.5, 0))},
                    {"ms_95", std::round(1e3 * quantile(durations, 0.95, 0))}});
  }
  return list;
}

Json pairsJson(const PairCounts& pairs) {
  Json rows = Json::array();
  for (const Phone first : labelPhones()) {
    Json row = Json::array();
    for (const Phone second : labelPhones()) row.push_back(pairs[indexOf(first)][indexOf(second)]);
    rows.push_back(row);
  }
  return rows;
}

Json countsJson(const std::map<std::string, std::size_t>& counts) {
  std::vector<std::pair<std::string, std::size_t>> sorted(counts.begin(), counts.end());
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  Json list = Json::array();
  for (const auto& [text, count] : sorted) list.push_back({text, count});
  return list;
}

/// Phone pairs that the language's words need and the corpus lacks, by how many words need them.
Json missingJson(const PairCounts& have, const std::vector<std::vector<Phone>>& language) {
  std::map<std::pair<Phone, Phone>, std::size_t> needed;
  std::size_t covered = 0, whole = 0, speakable = 0;
  for (const std::vector<Phone>& word : language) {
    bool can_speak = true;
    for (std::size_t i = 0; i <= word.size(); ++i) {
      const Phone first = i == 0 ? Phone::kSil : word[i - 1], second = i == word.size() ? Phone::kSil : word[i];
      const bool is_there = have[indexOf(first)][indexOf(second)] > 0;
      ++whole;
      covered += is_there ? 1U : 0U;
      can_speak = can_speak && is_there;
      if (!is_there) ++needed[{first, second}];
    }
    speakable += can_speak ? 1U : 0U;
  }
  std::vector<std::pair<std::size_t, std::pair<Phone, Phone>>> sorted;
  for (const auto& [pair, words] : needed) sorted.push_back({words, pair});
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  Json pairs = Json::array();
  for (std::size_t i = 0; i < std::min(sorted.size(), kMostMissingShown); ++i) {
    pairs.push_back({std::string(phoneName(sorted[i].second.first)), std::string(phoneName(sorted[i].second.second)),
                     sorted[i].first});
  }
  return {{"words", language.size()},
          {"speakable_words", speakable},
          {"pair_share", whole == 0 ? 0.0 : asReal(covered) / asReal(whole)},
          {"missing_pairs", sorted.size()},
          {"pairs", pairs}};
}

std::vector<TakeReport> reportsOf(const Corpus& corpus) {
  const auto entry = corpus.build_log.find(kTakeReportsKey);
  std::vector<TakeReport> logged;
  if (entry != corpus.build_log.end()) logged = reportsFromJson(entry->second);
  std::map<std::string, TakeReport> by_name;
  for (TakeReport& report : logged) by_name[report.name] = std::move(report);
  std::vector<TakeReport> reports;
  for (const CorpusTake& take : corpus.takes) reports.push_back(by_name[take.name]);
  return reports;
}

Json doubtfulJson(const Corpus& corpus, const std::vector<TakeReport>& reports) {
  Json list = Json::array();
  for (std::size_t i = 0; i < corpus.takes.size(); ++i) {
    for (const DoubtfulWord& word : reports[i].doubtful) {
      list.push_back({{"take", i},
                      {"at_s", word.span.start},
                      {"what", fmt::format("'{}': confidence {:.2f}", word.text, word.confidence)}});
    }
    for (const LabelledPhone& phone : corpus.takes[i].labels.phones) {
      const Seconds length = phone.span.duration();
      if (phone.phone == Phone::kSil || (length >= kShortestLikelyPhone && length <= kLongestLikelyPhone)) continue;
      list.push_back({{"take", i},
                      {"at_s", phone.span.start},
                      {"what", fmt::format("{} lasts {:.0f} ms", phoneName(phone.phone), 1e3 * length)}});
    }
  }
  return list;
}

Json takesJson(const Corpus& corpus, const std::vector<TakeReport>& reports) {
  Json list = Json::array();
  for (std::size_t i = 0; i < corpus.takes.size(); ++i) {
    const CorpusTake& take = corpus.takes[i];
    const TakeReport& report = reports[i];
    Json phones = Json::array(), words = Json::array();
    for (const LabelledPhone& phone : take.labels.phones) {
      phones.push_back({std::string(phoneName(phone.phone)), std::round(1e4 * phone.span.end) / 1e4});
    }
    for (const LabelledWord& word : take.labels.words) {
      const TimeSpan span = take.labels.spanOf(word.phones);
      words.push_back({word.text, span.start, span.end});
    }
    list.push_back({{"name", take.name},
                    {"text", take.text},
                    {"duration_s", take.motion.duration()},
                    {"start_s", take.labels.phones.empty() ? 0.0 : take.labels.phones.front().span.start},
                    {"phones", phones},
                    {"words", words},
                    {"labels_found", report.labels_found},
                    {"noise_mm", report.noise_mm},
                    {"head_residual_mm", report.head_residual_mm},
                    {"swaps", report.swaps},
                    {"spikes", report.spikes},
                    {"gaps", report.gap_samples},
                    {"filled", report.filled_samples},
                    {"missing", report.missing_samples}});
  }
  return list;
}

/// What smoothing did to the lips of all takes; null where none was smoothed.
Json lipsJson(const std::vector<TakeReport>& reports) {
  constexpr double kKept = 0.1;
  std::vector<double> changes;
  LipFidelity::Bands before{}, after{};
  double takes = 0;
  for (const TakeReport& report : reports) {
    if (report.smoothed_mm <= 0) continue;
    changes.insert(changes.end(), report.lips.closure_changes_mm.begin(), report.lips.closure_changes_mm.end());
    for (std::size_t band = 0; band < LipFidelity::kBands; ++band) {
      before[band] += report.lips.jerk_before[band] * report.lips.jerk_before[band];
      after[band] += report.lips.jerk_after[band] * report.lips.jerk_after[band];
    }
    takes += report.lips.jerk_before[0] > 0 ? 1 : 0;
  }
  if (takes == 0) return nullptr;
  for (LipFidelity::Bands* bands : {&before, &after}) {
    for (double& band : *bands) band = std::sqrt(band / takes);
  }
  const auto kept = std::count_if(changes.begin(), changes.end(), [](double mm) { return std::abs(mm) <= kKept; });
  double sum = 0;
  for (const double change : changes) sum += change;
  return {{"closures", changes.size()},
          {"kept", kept},
          {"mean_change_mm", changes.empty() ? 0.0 : sum / asReal(changes.size())},
          {"edges_hz", LipFidelity::kEdgesHz},
          {"jerk_before", before},
          {"jerk_after", after}};
}

Json markersJson(const Corpus& corpus) {
  std::vector<std::vector<double>> noise(corpus.layout.markers.size());
  std::vector<std::size_t> missing(corpus.layout.markers.size(), 0);
  std::size_t frames = 0;
  for (const CorpusTake& take : corpus.takes) {
    frames += take.motion.frameCount();
    const std::vector<double> of_take = estimateMarkerNoise(take.motion);
    for (std::size_t m = 0; m < missing.size(); ++m) {
      noise[m].push_back(of_take[m]);
      const auto column = take.motion.positions_mm.col(signedIndex(3 * m)).array();
      missing[m] += unsignedIndex((!column.isFinite()).count());
    }
  }
  Json list = Json::array();
  for (std::size_t m = 0; m < missing.size(); ++m) {
    list.push_back({{"name", corpus.layout.markers[m].name},
                    {"noise_mm", quantile(noise[m], 0.5, 0)},
                    {"missing_share", frames == 0 ? 0.0 : asReal(missing[m]) / asReal(frames)}});
  }
  return list;
}

/// Little-endian 16-bit steps from the neutral pose, frame by frame, in base64.
std::string trajectory(const CorpusTake& take, const MarkerPositions& neutral_mm, std::size_t step) {
  ByteWriter bytes;
  for (std::size_t frame = 0; frame < take.motion.frameCount(); frame += step) {
    for (Eigen::Index i = 0; i < neutral_mm.size(); ++i) {
      const double moved = (take.motion.positions_mm(signedIndex(frame), i) - neutral_mm(i / 3, i % 3)) / kPageStepMm;
      bytes.writeU16(std::isfinite(moved) ? std::lrint(std::clamp(moved, -32000.0, 32000.0)) : kNotSeen);
    }
  }
  std::string text;
  appendBase64(text, bytes.bytes());
  return text;
}

void addTrajectories(Json& report, const Corpus& corpus, std::size_t most_bytes) {
  std::size_t bytes = 0;
  report["step_mm"] = kPageStepMm;
  report["not_seen"] = kNotSeen;
  for (std::size_t i = 0; i < corpus.takes.size(); ++i) {
    const CorpusTake& take = corpus.takes[i];
    const auto step = static_cast<std::size_t>(std::max(1.0, std::round(take.motion.frame_rate_hz / kPageRateHz)));
    std::string motion = trajectory(take, corpus.neutral_pose_mm, step);
    bytes += motion.size() / 4 * 3;
    if (bytes > most_bytes) return;
    report["takes"][i]["rate_hz"] = take.motion.frame_rate_hz / asReal(step);
    report["takes"][i]["motion"] = std::move(motion);
  }
}

Json reportJson(const Corpus& corpus, const ReportOptions& options) {
  const Coverage coverage = coverageOf(corpus);
  const std::vector<TakeReport> reports = reportsOf(corpus);
  Json names = Json::array();
  for (const Phone phone : labelPhones()) names.push_back(std::string(phoneName(phone)));
  const auto left_out = corpus.build_log.find("takes_left_out");
  return {{"name", corpus.name},
          {"layout", corpus.layout.name},
          {"phone_names", names},
          {"phones", phonesJson(coverage)},
          {"pairs", pairsJson(coverage.pairs)},
          {"syllables", countsJson(coverage.syllables)},
          {"words", countsJson(coverage.words)},
          {"missing", missingJson(coverage.pairs, options.language)},
          {"markers", markersJson(corpus)},
          {"takes", takesJson(corpus, reports)},
          {"lips", lipsJson(reports)},
          {"doubtful", doubtfulJson(corpus, reports)},
          {"left_out", left_out == corpus.build_log.end() ? "" : left_out->second}};
}

}  // namespace

std::string corpusReportJson(const Corpus& corpus, const ReportOptions& options) {
  return jsonText(reportJson(corpus, options), 2) + "\n";
}

std::string corpusReportHtml(const Corpus& corpus, const ReportOptions& options) {
  Json report = reportJson(corpus, options);
  addTrajectories(report, corpus, options.most_trajectory_bytes);
  return dataPage(kCorpusReportPage, jsonText(report));
}

}  // namespace mouthpiece
