#include "corpus_tools/building/corpus_facts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/errors.h"
#include "base/json_text.h"
#include "corpus_tools/takes/head_tracking.h"
#include "corpus_tools/takes/take_files.h"
#include "corpus_tools/takes/take_report.h"
#include "synthesis/curve_model.h"

namespace mouthpiece {
namespace {

/// Faster than lips or a jaw move (about 0.5 m/s in the sample and grid_s1 corpora): a swapped or slipped marker.
constexpr double kFastestMarkerMmS = 2000;
constexpr double kMissingShare = 0.05;
constexpr Seconds kLengthTolerance = 0.1;

struct Facts {
  std::size_t words = 0, syllables = 0, phones = 0, samples = 0, missing = 0;
  Seconds duration = 0, speech = 0;
  std::set<std::string> different_words;
  std::set<Phone> different_phones;
  std::set<std::pair<Phone, Phone>> diphones;
  std::set<double> frame_rates;
};

std::size_t missingIn(const MotionClip& motion) {
  std::size_t missing = 0;
  for (Eigen::Index column = 0; column < motion.positions_mm.cols(); column += 3) {
    missing += unsignedIndex((!motion.positions_mm.col(column).array().isFinite()).count());
  }
  return missing;
}

Facts factsOf(const Corpus& corpus) {
  Facts facts;
  for (const CorpusTake& take : corpus.takes) {
    facts.words += take.labels.words.size();
    facts.syllables += take.labels.syllables.size();
    facts.phones += take.labels.phones.size();
    facts.duration += take.motion.duration();
    facts.frame_rates.insert(take.motion.frame_rate_hz);
    facts.samples += take.motion.frameCount() * take.motion.markerCount();
    facts.missing += missingIn(take.motion);
    for (const LabelledWord& word : take.labels.words) facts.different_words.insert(word.text);
    for (std::size_t i = 0; i < take.labels.phones.size(); ++i) {
      const LabelledPhone& phone = take.labels.phones[i];
      facts.different_phones.insert(phone.phone);
      if (phone.phone != Phone::kSil) facts.speech += phone.span.duration();
      if (i > 0) facts.diphones.insert({take.labels.phones[i - 1].phone, phone.phone});
    }
  }
  return facts;
}

double share(std::size_t part, std::size_t whole) { return whole == 0 ? 0.0 : asReal(part) / asReal(whole); }

std::string logged(const Corpus& corpus, const std::string& key) {
  const auto entry = corpus.build_log.find(key);
  return entry == corpus.build_log.end() ? "" : entry->second;
}

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

void checkLengths(const CorpusTake& take, std::vector<std::string>& problems) {
  const Seconds end = take.labels.duration();
  const auto check = [&](std::string_view what, Seconds duration) {
    if (duration + kLengthTolerance >= end) return;
    problems.push_back(fmt::format("{}: {} ends at {:.2f} s, the labels at {:.2f} s", take.name, what, duration, end));
  };
  check("motion", take.motion.duration());
  if (!isAdapted(take)) check("sound", take.audio.duration());
}

/// "LIP_UP_MID", "LIP_UP_MID and 3 more".
std::string named(const std::vector<std::string>& markers) {
  return markers.size() == 1 ? markers[0] : fmt::format("{} and {} more", markers[0], markers.size() - 1);
}

void checkMarkers(const CorpusTake& take, std::vector<std::string>& remarks) {
  const MotionClip& motion = take.motion;
  std::vector<std::string> missing, fast;
  for (std::size_t marker = 0; marker < motion.markerCount(); ++marker) {
    std::size_t unseen = 0;
    double fastest = 0;
    for (std::size_t frame = 0; frame < motion.frameCount(); ++frame) {
      const Eigen::Vector3d here = motion.position(FrameIndex(frame), MarkerIndex(marker));
      if (!here.allFinite()) ++unseen;
      if (frame == 0) continue;
      const double step = (here - motion.position(FrameIndex(frame - 1), MarkerIndex(marker))).norm();
      if (std::isfinite(step)) fastest = std::max(fastest, step * motion.frame_rate_hz);
    }
    if (share(unseen, motion.frameCount()) > kMissingShare) missing.push_back(motion.marker_names[marker]);
    if (fastest > kFastestMarkerMmS) fast.push_back(motion.marker_names[marker]);
  }
  if (!missing.empty()) {
    remarks.push_back(
        fmt::format("{}: {} missing in over {:.0f} % of the frames", take.name, named(missing), 100 * kMissingShare));
  }
  if (!fast.empty()) {
    remarks.push_back(
        fmt::format("{}: {} faster than {:.0f} mm/s; no face is", take.name, named(fast), kFastestMarkerMmS));
  }
}

void checkNeutral(const Corpus& corpus, std::vector<std::string>& problems) {
  const Eigen::RowVector3d size =
      corpus.neutral_pose_mm.colwise().maxCoeff() - corpus.neutral_pose_mm.colwise().minCoeff();
  if (!(size.maxCoeff() >= kLeastFaceMm && size.maxCoeff() <= kLargestFaceMm)) {
    problems.push_back(
        fmt::format("neutral pose: {:.0f} x {:.0f} x {:.0f} mm is not the size of a face", size[0], size[1], size[2]));
  }
}

}  // namespace

std::string corpusFactsText(const Corpus& corpus) {
  const Facts facts = factsOf(corpus);
  std::string text;
  const auto line = [&text](std::string_view name, const std::string& value) {
    text += fmt::format("{:<16}{}\n", name, value);
  };
  line("corpus", corpus.name);
  line("format", std::to_string(kCorpusFormatVersion));
  line("takes", fmt::format("{} ({:.1f} s, {:.1f} s of speech)", corpus.takes.size(), facts.duration, facts.speech));
  line("words", fmt::format("{} ({} different)", facts.words, facts.different_words.size()));
  line("syllables", std::to_string(facts.syllables));
  line("phones", fmt::format("{} ({} different, {} different pairs)", facts.phones, facts.different_phones.size(),
                             facts.diphones.size()));
  line("markers", fmt::format("{} of layout {}", corpus.layout.markers.size(), corpus.layout.name));
  line("frame rate", fmt::format("{} Hz", fmt::join(facts.frame_rates, ", ")));
  line("missing", fmt::format("{:.3f} % of the marker samples", 100 * share(facts.missing, facts.samples)));
  if (const std::optional<VisemePoses> poses = storedPoses(corpus)) {
    line("viseme poses", fmt::format("explain {:.0f} % of the motion, {:.0f} % of lips and chin",
                                     100 * poses->explainedShare(), 100 * poses->lipExplainedShare()));
  }
  const std::vector<std::string> left_out = linesOf(logged(corpus, "takes_left_out"));
  line("left out", std::to_string(left_out.size()));
  for (const std::string& reason : left_out) text += "  " + reason + "\n";
  return text;
}

std::string corpusFactsJson(const Corpus& corpus) {
  const Facts facts = factsOf(corpus);
  nlohmann::json json = {{"corpus", corpus.name},
                         {"format_version", kCorpusFormatVersion},
                         {"takes", corpus.takes.size()},
                         {"duration_s", facts.duration},
                         {"speech_s", facts.speech},
                         {"words", facts.words},
                         {"different_words", facts.different_words.size()},
                         {"syllables", facts.syllables},
                         {"phones", facts.phones},
                         {"different_phones", facts.different_phones.size()},
                         {"different_phone_pairs", facts.diphones.size()},
                         {"layout", corpus.layout.name},
                         {"markers", corpus.layout.markers.size()},
                         {"frame_rates_hz", facts.frame_rates},
                         {"missing_share", share(facts.missing, facts.samples)},
                         {"left_out", linesOf(logged(corpus, "takes_left_out"))},
                         {"build_log", corpus.build_log}};
  if (const std::optional<VisemePoses> poses = storedPoses(corpus))
    json["viseme_poses"] = {{"explained", poses->explainedShare()}, {"lips_explained", poses->lipExplainedShare()}};
  const nlohmann::json reports = looseJson(logged(corpus, kTakeReportsKey));
  json["build_log"].erase("takes_left_out");
  if (!reports.is_discarded()) json["build_log"][kTakeReportsKey] = reports;
  return jsonText(json, 2) + "\n";
}

CorpusCheck checkCorpus(const Corpus& corpus) {
  CorpusCheck check;
  try {
    storedPoses(corpus);
  } catch (const InputError& error) {
    check.problems.emplace_back(error.what());
  }
  if (corpus.takes.empty()) check.problems.push_back("no takes");
  checkNeutral(corpus, check.problems);
  for (const CorpusTake& take : corpus.takes) {
    checkLengths(take, check.problems);
    checkMarkers(take, check.remarks);
  }
  return check;
}

}  // namespace mouthpiece
