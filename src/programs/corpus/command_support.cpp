#include "programs/corpus/command_support.h"

#include <fmt/format.h>

#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_file.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxLayoutBytes = 16 << 20;

bool isLayoutOfOurs(const std::filesystem::path& file) {
  return file.empty() || file == "face66" || file == "mediapipe66";
}

}  // namespace

void addCorpusArgument(CLI::App& command, std::filesystem::path& corpus) {
  command.add_option("corpus", corpus, "X.corpus")->required();
}

void addLayoutOption(CLI::App& command, std::filesystem::path& layout) {
  command.add_option("--layout", layout,
                     "Marker layout (JSON); default: face66, FaceMesh's landmarks included (mediapipe66)");
}

void addLexiconOption(CLI::App& command, std::filesystem::path& lexicon) {
  command.add_option("--lexicon", lexicon, "Pronunciations of words (WORD PHONES..., one a line)");
}

void addLanguageOption(CLI::App& command, std::string& language) {
  command
      .add_option("--language", language,
                  "Of what is said, as BCP 47: de, es, fr, it, pt, pt-BR, pl, nl, ja, or any other of eSpeak NG's")
      ->capture_default_str();
}

void addJobsOption(CLI::App& command, std::size_t& jobs) {
  command.add_option("--jobs", jobs, "Takes at once; default: one per core")->check(CLI::Range(1, 1024));
}

void addCleaningOptions(CLI::App& command, CleaningOptions& cleaning) {
  command.add_flag_callback(
      "--no-swaps", [&cleaning] { cleaning.repair_swaps = false; }, "Leave exchanged markers");
  command.add_flag_callback(
      "--no-spikes", [&cleaning] { cleaning.hide_spikes = false; }, "Leave spikes");
  command.add_flag_callback(
      "--no-jig", [&cleaning] { cleaning.use_jig = false; }, "Find the head by the face alone");
  command.add_flag_callback(
      "--no-head", [&cleaning] { cleaning.remove_head = false; }, "Leave the head's motion in");
  command.add_flag_callback(
      "--no-gaps", [&cleaning] { cleaning.fill_gaps = false; }, "Leave gaps");
  command.add_flag_callback(
      "--no-smoothing", [&cleaning] { cleaning.smooth = false; }, "Leave the noise");
}

void addMarkerMapOption(CLI::App& command, std::vector<std::string>& renamed) {
  command.add_option("--map", renamed, "OLD=NEW: a marker of the files goes by another name in the layout; repeatable");
}

MarkerNameMap markerMapFrom(const std::vector<std::string>& renamed, const std::filesystem::path& layout) {
  MarkerNameMap names;
  for (const std::string& pair : renamed) {
    const std::size_t equals = pair.find('=');
    const bool is_pair = equals != std::string::npos && equals > 0 && equals + 1 < pair.size();
    if (!is_pair || !names.emplace(pair.substr(0, equals), pair.substr(equals + 1)).second) {
      throw InputError("--map", "", fmt::format("found '{}'; expected OLD=NEW, each OLD once", printable(pair)));
    }
  }
  if (isLayoutOfOurs(layout)) return names;
  for (const auto& [label, name] : markerLabels(readFile(layout, kMaxLayoutBytes), layout.string(), layoutFrom(layout)))
    names.emplace(label, name);
  return names;
}

MarkerLayout layoutFrom(const std::filesystem::path& file) {
  return isLayoutOfOurs(file) ? defaultLayout() : parseLayout(readFile(file, kMaxLayoutBytes), file.string());
}

Lexicon lexiconFrom(const std::filesystem::path& file, const Language& language) {
  return file.empty() ? Lexicon() : Lexicon::read(file, language);
}

bool isC3dFileName(const std::filesystem::path& path) {
  return path.extension() == ".c3d" || path.extension() == ".C3D";
}

void writeMotionWithEvents(const std::filesystem::path& path, const MotionClip& clip,
                           const std::filesystem::path& source) {
  if (!isC3dFileName(path)) return writeMotion(path, clip);
  writeC3d(path, clip, isC3dFileName(source) ? readC3dEvents(source) : std::vector<MotionEvent>());
}

std::string tellDrift(const SoundPlace& place) {
  const double drift = place.drift.value_or(0);
  if (drift == 0) return "";
  return fmt::format(", its clock {:.0f} millionths {} by {:.1f} ms a minute", 1e6 * std::abs(drift),
                     drift < 0 ? "fast: shortened" : "slow: stretched", 60e3 * std::abs(drift));
}

void noteLeftOut(const std::vector<LeftOutTake>& left_out, bool quiet) {
  for (const LeftOutTake& take : left_out) printNotice(fmt::format("left out {}: {}", take.name, take.reason), quiet);
}

}  // namespace mouthpiece
