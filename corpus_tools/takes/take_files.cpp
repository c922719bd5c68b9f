#include "corpus_tools/takes/take_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "base/statistics.h"
#include "base/text_encoding.h"
#include "hearing/times/times_file.h"
#include "motion/formats/motion_file.h"
#include "phonetics/labels/label_files.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// Endings in order of preference where a take has several.
constexpr std::array<std::string_view, 3> kMotionEndings = {".c3d", ".trc", ".csv"};
constexpr std::array<std::string_view, 2> kAudioEndings = {".wav", ".flac"};
constexpr std::array<std::string_view, 4> kLabelEndings = {".textgrid", ".lab", ".phn", ".ctm"};

/// Labels may run past the end of the motion or the sound by this much; the last frames are held then. GRID's sound
/// ends 22 ms before its motion; a cut-off file is off by far more.
constexpr Seconds kLengthTolerance = 0.1;
/// Fewer face markers than this share, and the file is of another layout.
constexpr double kLeastMarkerShare = 0.75;
constexpr std::uint64_t kMaxTextBytes = 1 << 20;

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

using FilesByEnding = std::map<std::string, fs::path>;

template <std::size_t count>
fs::path pick(const FilesByEnding& files, const std::array<std::string_view, count>& endings) {
  for (const std::string_view ending : endings) {
    if (const auto found = files.find(std::string(ending)); found != files.end()) return found->second;
  }
  return {};
}

std::map<std::string, FilesByEnding> filesByName(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError(folder.string(), "", "no such folder; expected one with takes");
  fs::directory_iterator entries(folder, error);
  if (error) throw InputError(folder.string(), "", fmt::format("cannot be read: {}", error.message()));
  std::map<std::string, FilesByEnding> names;
  for (const fs::directory_entry& entry : entries) {
    if (!entry.is_regular_file(error) || entry.path().filename().string().starts_with(".")) continue;
    names[entry.path().stem().string()][lowerCase(entry.path().extension().string())] = entry.path();
  }
  return names;
}

/// What is missing in words, "" for nothing.
std::string missingParts(const TakeFiles& take) {
  std::vector<std::string> missing;
  if (take.motion.empty()) missing.push_back(fmt::format("no motion (expected {}.c3d, .trc or .csv)", take.name));
  if (take.audio.empty()) missing.push_back(fmt::format("no sound (expected {}.wav or .flac)", take.name));
  if (take.labels.empty() && !take.text) {
    missing.push_back(
        fmt::format("neither labels (expected {0}.TextGrid, .lab, .phn or .ctm) nor text to find them by "
                    "(expected {0}.txt)",
                    take.name));
  }
  return fmt::format("{}", fmt::join(missing, ", "));
}

std::string trimmed(const std::string& text) {
  const char* blanks = " \t\r\n\f\v";
  const std::size_t first = text.find_first_not_of(blanks);
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string wordsOf(const SpeechLabels& labels) {
  std::vector<std::string> words;
  for (const LabelledWord& word : labels.words) words.push_back(word.text);
  return fmt::format("{}", fmt::join(words, " "));
}

bool isEverSeen(const MotionClip& clip, std::size_t marker) {
  return clip.positions_mm.col(signedIndex(3 * marker)).array().isFinite().any();
}

/// "Anna:LIP_UP_MID" -> "LIP_UP_MID".
std::string withoutSubject(const std::string& name) {
  const std::size_t colon = name.rfind(':');
  return trimmed(colon == std::string::npos ? name : name.substr(colon + 1));
}

std::vector<std::string> firstFew(const std::vector<std::string>& names, std::size_t count = 4) {
  std::vector<std::string> few(names.begin(), names.begin() + signedIndex(std::min(count, names.size())));
  for (std::string& name : few) name = printable(name, 30);
  if (names.size() > count) few.push_back("...");
  return few;
}

void expectEnoughMarkers(const MotionClip& face, const MotionClip& clip, const MarkerLayout& layout,
                         const std::string& file) {
  std::vector<std::string> missing;
  for (std::size_t marker = 0; marker < face.markerCount(); ++marker) {
    if (!isEverSeen(face, marker)) missing.push_back(face.marker_names[marker]);
  }
  const std::size_t seen = face.markerCount() - missing.size();
  if (asReal(seen) >= kLeastMarkerShare * asReal(face.markerCount())) return;
  if (seen == 0) {
    throw InputError(file, "",
                     fmt::format("has no known marker: found {} ({}); expected the {} of layout {} ({})",
                                 clip.markerCount(), fmt::join(firstFew(clip.marker_names), ", "), face.markerCount(),
                                 layout.name, fmt::join(firstFew(face.marker_names), ", ")));
  }
  throw InputError(
      file, "",
      fmt::format("shows {} of the {} markers of layout {}; expected at least three quarters (missing: {})", seen,
                  face.markerCount(), layout.name, fmt::join(firstFew(missing), ", ")));
}

/// Two people in one capture would become one face of both. `clip` has its markers without their subjects.
void expectOneSubject(const MotionClip& clip, const MotionClip& captured, const MarkerLayout& layout,
                      const std::string& file) {
  const std::vector<std::string> face = layout.markerNames();
  std::map<std::string, std::string> whole_names;
  for (std::size_t i = 0; i < clip.markerCount(); ++i) {
    const auto [known, is_new] = whole_names.try_emplace(clip.marker_names[i], captured.marker_names[i]);
    const auto isIt = [&](const std::string& name) { return name == known->first; };
    if (is_new || !(std::any_of(face.begin(), face.end(), isIt) ||
                    std::any_of(layout.jig_names.begin(), layout.jig_names.end(), isIt)))
      continue;
    throw InputError(file, "",
                     fmt::format("has two markers {} ('{}' and '{}'); expected one person, exported alone",
                                 printable(known->first, 40), printable(known->second, 40),
                                 printable(captured.marker_names[i], 40)));
  }
}

/// Cameras' programs write 0 0 0 for a marker that was lost; none lies there to the last decimal.
void hideLost(MotionClip& clip) {
  for (Eigen::Index frame = 0; frame < clip.positions_mm.rows(); ++frame) {
    for (Eigen::Index column = 0; column < clip.positions_mm.cols(); column += 3) {
      auto place = clip.positions_mm.block<1, 3>(frame, column);
      if ((place.array() == 0).all()) place.setConstant(std::nan(""));
    }
  }
}

/// Of the frames that show most of the face.
void expectFaceSize(const MotionClip& face, const std::string& file) {
  std::vector<double> sizes;
  for (std::size_t frame = 0; frame < face.frameCount(); ++frame) {
    Eigen::AlignedBox3d box;
    std::size_t seen = 0;
    for (std::size_t marker = 0; marker < face.markerCount(); ++marker) {
      if (!face.isSeen(FrameIndex(frame), MarkerIndex(marker))) continue;
      box.extend(face.position(FrameIndex(frame), MarkerIndex(marker)));
      ++seen;
    }
    if (asReal(seen) >= kLeastMarkerShare * asReal(face.markerCount())) sizes.push_back(box.sizes().maxCoeff());
  }
  const double size = median(sizes, kLeastFaceMm);
  if (size >= kLeastFaceMm && size <= kLargestFaceMm) return;
  throw InputError(file, "",
                   fmt::format("shows a face of {:.3g} mm; expected {} to {}: its unit may be another one than it says",
                               size, kLeastFaceMm, kLargestFaceMm));
}

void expectSameLength(const RawTake& take, const TakeFiles& files) {
  const Seconds end = take.labels.duration();
  const auto check = [&](const fs::path& path, Seconds duration) {
    if (duration + kLengthTolerance >= end) return;
    throw InputError(
        path.string(), "",
        fmt::format("ends at {:.2f} s; expected to reach the end of its labels at {:.2f} s", duration, end));
  };
  check(files.motion, take.face.duration());
  check(files.audio, take.audio.duration());
}

std::string readText(const fs::path& path) {
  std::string text = trimmed(decodeText(readFile(path, kMaxTextBytes), path.string()));
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  if (text.empty()) throw InputError(path.string(), "", "is empty; expected what is said in the take");
  return text;
}

SpeechLabels labelsOf(const TakeFiles& files, const AudioClip& audio, const std::optional<std::string>& text,
                      const Lexicon& lexicon, const Language& language) {
  SpeechLabels labels = readLabels(files.labels, {audio.sample_rate_hz, &language});
  const bool speaks = std::any_of(labels.phones.begin(), labels.phones.end(),
                                  [](const LabelledPhone& phone) { return phone.phone != Phone::kSil; });
  if (!speaks) throw InputError(files.labels.string(), "", "holds silence only; expected phones");
  if (labels.words.empty() && text) labels = withWords(labels, *text, lexicon).value_or(labels);
  return labels;
}

}  // namespace

FoundTakes findTakes(const fs::path& folder) {
  FoundTakes found;
  for (const auto& [name, files] : filesByName(folder)) {
    TakeFiles take{name, pick(files, kMotionEndings), pick(files, kAudioEndings), pick(files, kLabelEndings), {}};
    if (const auto text = files.find(".txt"); text != files.end()) take.text = text->second;
    if (take.motion.empty() && (take.audio.empty() || (take.labels.empty() && !take.text))) continue;
    if (const std::string missing = missingParts(take); !missing.empty()) {
      found.left_out.push_back({name, missing});
    } else {
      found.takes.push_back(std::move(take));
    }
  }
  if (found.takes.empty() && found.left_out.empty()) {
    throw InputError(folder.string(), "",
                     "holds no take; expected files like NAME.c3d (.trc, .csv), NAME.wav (.flac), NAME.txt and "
                     "NAME.TextGrid (.lab, .phn, .ctm)");
  }
  return found;
}

void renameMarkers(MotionClip& clip, const MarkerNameMap& names) {
  for (std::string& name : clip.marker_names) {
    auto found = names.find(name);
    if (found == names.end()) found = names.find(withoutSubject(name));
    if (found != names.end()) name = found->second;
  }
}

FaceAndJig splitMarkers(const MotionClip& clip, const MarkerLayout& layout, const std::string& file) {
  MotionClip renamed = clip;
  for (std::string& name : renamed.marker_names) name = withoutSubject(name);
  expectOneSubject(renamed, clip, layout, file);
  FaceAndJig split{selectMarkers(renamed, layout.markerNames()), selectMarkers(renamed, layout.jig_names)};
  hideLost(split.face);
  hideLost(split.jig);
  expectEnoughMarkers(split.face, clip, layout, file);
  expectFaceSize(split.face, file);
  return split;
}

RawTake readTake(const TakeFiles& files, const MarkerLayout& layout, const Lexicon& lexicon) {
  TakeLabeller labeller(lexicon);
  return readTake(files, layout, lexicon, labeller);
}

RawTake readTake(const TakeFiles& files, const MarkerLayout& layout, const Lexicon& lexicon, TakeLabeller& labeller,
                 const MarkerNameMap& names) {
  MotionClip motion = readMotion(files.motion);
  renameMarkers(motion, names);
  FaceAndJig markers = splitMarkers(motion, layout, files.motion.string());
  RawTake take{files.name, "", {}, std::move(markers.face), std::move(markers.jig), readAudio(files.audio), false, {}};
  const auto text = files.text ? std::optional(readText(*files.text)) : std::nullopt;
  if (files.labels.empty()) {
    MOUTHPIECE_EXPECT(text.has_value());
    TakeLabeller::Labels found = labeller.label(take.audio, *text, files.audio.string());
    take.labels = std::move(found.labels);
    take.doubtful = std::move(found.doubtful);
    take.labels_found = true;
  } else {
    take.labels_found = lacksPhones(files.labels);
    take.labels = take.labels_found ? makeTimedRecogniser(files.labels, &lexicon, labeller.language())
                                          ->hear(take.audio, files.audio.string())
                                          .labels
                                    : labelsOf(files, take.audio, text, lexicon, labeller.language());
  }
  take.text = text.value_or(wordsOf(take.labels));
  expectSameLength(take, files);
  return take;
}

}  // namespace mouthpiece
