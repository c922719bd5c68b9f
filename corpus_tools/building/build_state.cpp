#include "corpus_tools/building/build_state.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "base/errors.h"
#include "base/files.h"
#include "base/json_fields.h"
#include "corpus_tools/takes/pose_fit.h"
#include "synthesis/curve_model.h"
#include "units/file/packed_rows.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// Changes when the cleaning or labelling of takes does, so that no part of an older program is taken up.
constexpr const char* kPartsVersion = "3";

constexpr const char* kJigKey = "head_reference_jig_mm";
constexpr const char* kStableKey = "head_reference_stable_mm";

std::string shapeToJson(const MarkerPositions& shape) {
  nlohmann::json rows = nlohmann::json::array();
  for (Eigen::Index i = 0; i < shape.rows(); ++i) rows.push_back({shape(i, 0), shape(i, 1), shape(i, 2)});
  return rows.dump();
}

/// Throws InputError for what is no list of `rows` points; null: a marker never seen.
MarkerPositions shapeFromJson(const std::string& text, std::size_t rows) {
  MarkerPositions shape(signedIndex(rows), 3);
  Eigen::Index row = 0;
  for (const JsonField& point : parseJson(text, "build log", "points").list(rows, rows)) {
    Eigen::Index axis = 0;
    for (const JsonField& value : point.list(3, 3))
      shape(row, axis++) = value.isNumber() ? value.number() : std::nan("");
    ++row;
  }
  return shape;
}

constexpr const char* kSettingsKey = "build_settings";

constexpr const char* kHolderFile = "process";
constexpr std::uint64_t kLongestNumber = 20;

/// Says in the folder whose it is, for the message to the next that comes. Who has locked it a moment ago has not said
/// so yet, and who leaves it no longer: it is looked at for a while.
std::unique_ptr<FileLock> locked(const fs::path& folder) {
  constexpr int kLooks = 50;
  constexpr std::chrono::milliseconds kBetweenLooks(20);
  const fs::path holder = folder / kHolderFile;
  std::error_code error;
  for (int look = 0; look < kLooks; ++look) {
    std::unique_ptr<FileLock> lock(new FileLock(FileLock::ofFolder(folder)));
    if (lock->isOurs()) {
      writeFileAtomically(holder, std::to_string(::getpid()));
      return lock;
    }
    if (fs::exists(holder, error)) break;
    std::this_thread::sleep_for(kBetweenLooks);
  }
  const std::string process = fs::exists(holder, error) ? readFile(holder, kLongestNumber) : "unknown";
  throw InputError(folder.string(), "",
                   fmt::format("is in use: the same corpus is being built by process {}", printable(process)));
}

}  // namespace

std::string takeKey(const TakeFiles& files, const std::string& settings) {
  std::string hashes = kPartsVersion + settings + "\n" + files.name;
  for (const fs::path& path : {files.motion, files.audio, files.labels, files.text.value_or(fs::path())}) {
    hashes.append("\n").append(path.extension().string()).append(" ");
    if (!path.empty()) hashes += sha256Hex(readFile(path));
  }
  return sha256Hex(hashes);
}

BuildParts::BuildParts(fs::path folder, const MarkerLayout& layout, std::string frame)
    : folder_(std::move(folder)), lock_(locked(folder_)), layout_(layout), frame_(std::move(frame)) {}

BuildParts::~BuildParts() {
  std::error_code error;
  fs::remove(folder_ / kHolderFile, error);
  fs::remove(folder_, error);  // refused while it holds parts for the next run
}

fs::path BuildParts::pathOf(const std::string& key) const { return folder_ / (sha256Hex(frame_ + key) + ".corpus"); }

std::optional<CleanedTake> BuildParts::find(const std::string& key) const {
  std::error_code error;
  if (!fs::exists(pathOf(key), error)) return std::nullopt;
  try {
    Corpus part = readCorpus(pathOf(key), CorpusAudio::kLoad);
    const std::vector<TakeReport> reports = reportsFromJson(part.build_log[kTakeReportsKey]);
    if (part.takes.size() != 1 || reports.size() != 1 || reports[0].key != key) return std::nullopt;
    return CleanedTake{std::move(part.takes[0]), reports[0]};
  } catch (const InputError&) {
    return std::nullopt;
  }
}

void BuildParts::store(const CleanedTake& take) const {
  Corpus part;
  part.layout = layout_;
  part.neutral_pose_mm = MarkerPositions::Zero(signedIndex(layout_.markers.size()), 3);
  part.takes.push_back(take.take);
  part.build_log[kTakeReportsKey] = reportsToJson({take.report});
  writeCorpus(pathOf(take.report.key), part);
}

CorpusTake BuildParts::load(const std::string& key) const {
  Corpus part = readCorpus(pathOf(key), CorpusAudio::kLoad);
  if (part.takes.size() != 1) throw InputError(pathOf(key).string(), "takes", "is no part of this build");
  return std::move(part.takes[0]);
}

void BuildParts::remove() const {
  std::error_code error;  // a folder that stays costs room, nothing else
  fs::remove_all(folder_, error);
}

void roundToFile(MotionClip& motion) {
  const auto in_file = [](double mm) {
    return static_cast<double>(asFloat(std::round(mm / kPackedStepMm) * kPackedStepMm));
  };
  motion.positions_mm = motion.positions_mm.unaryExpr(in_file).eval();
}

void FinishedTakes::takeOver(const std::string& key, MotionClip& motion) {
  const std::size_t bytes = sizeof(float) * unsignedIndex(motion.positions_mm.size());
  const std::scoped_lock lock(mutex_);
  PositionMatrix positions_mm;
  positions_mm.swap(motion.positions_mm);
  if (held_bytes_ + bytes > most_held_bytes_) return;
  held_bytes_ += bytes;
  held_[key] = {motion, positions_mm.cast<float>()};
}

void FinishedTakes::addPart(const std::string& key) { places_.push_back({key, nullptr, {}, {}}); }

void FinishedTakes::addEarlier(std::shared_ptr<const TakeSource> earlier, TakeIndex take) {
  places_.push_back({"", std::move(earlier), take, {}});
}

MotionClip FinishedTakes::load(TakeIndex take) const {
  const Place& place = places_.at(take.value);
  MotionClip motion;
  if (place.earlier != nullptr) {
    motion = place.earlier->load(place.earlier_take);
  } else if (const auto held = held_.find(place.key); held != held_.end()) {
    motion = held->second.without_positions;
    motion.positions_mm = held->second.positions_mm.cast<double>();
  } else {
    motion = parts_.load(place.key).motion;
  }
  if (place.move) transform(motion, *place.move);
  if (face_from_head_) transform(motion, *face_from_head_);
  roundToFile(motion);
  return motion;
}

AudioClip FinishedTakes::loadAudio(TakeIndex take) const {
  const Place& place = places_.at(take.value);
  if (place.earlier != nullptr) return place.earlier->loadAudio(place.earlier_take);
  return parts_.load(place.key).audio;
}

std::string visemePosesOf(const Corpus& corpus) {
  try {
    return posesToJson(learnPoses(corpus));
  } catch (const InputError&) {
    return "";
  }
}

void logHeadReference(Corpus& corpus, const HeadReference& reference) {
  corpus.build_log[kJigKey] = shapeToJson(reference.jig_mm);
  corpus.build_log[kStableKey] = shapeToJson(reference.stable_mm);
}

HeadReference headReferenceOf(const Corpus& corpus) {
  HeadReference reference{MarkerPositions(0, 3), pickMarkers(corpus.neutral_pose_mm, stableMarkers(corpus.layout))};
  const auto logged = [&](const char* key, std::size_t rows, MarkerPositions& shape) {
    const auto entry = corpus.build_log.find(key);
    if (entry == corpus.build_log.end()) return;
    try {
      shape = shapeFromJson(entry->second, rows);
    } catch (const InputError&) {  // not ours: as if there were none
    }
  };
  logged(kJigKey, corpus.layout.jig_names.size(), reference.jig_mm);
  logged(kStableKey, stableMarkers(corpus.layout).size(), reference.stable_mm);
  return reference;
}

std::string textOf(const HeadReference& reference) {
  return shapeToJson(reference.jig_mm) + shapeToJson(reference.stable_mm);
}

std::string leftOutToText(const std::vector<LeftOutTake>& left_out) {
  std::vector<std::string> lines;
  for (const LeftOutTake& take : left_out) lines.push_back(fmt::format("{}: {}", take.name, take.reason));
  return fmt::format("{}", fmt::join(lines, "\n"));
}

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
  if (options.language != &english()) lexicon += fmt::format("\nlanguage {}", options.language->tag);
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
      (void)earlier.corpus.take_source->load(TakeIndex(take));
      (void)earlier.corpus.take_source->loadAudio(TakeIndex(take));
    }
    return earlier;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace mouthpiece
