#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_clip.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "units/costs/cost_terms.h"
#include "units/phones/phone_columns.h"
#include "units/prediction/motion_settings.h"
#include "units/prediction/phone_shapes.h"
#include "units/prediction/trajectory_model.h"

namespace mouthpiece {

/// One recorded sentence, cleaned: head still, short gaps filled, columns in the layout's order.
struct CorpusTake {
  std::string name;
  std::string text;
  SpeechLabels labels;
  MotionClip motion;  ///< NaN where a gap was too long to fill
  AudioClip audio;
};

/// Loads what is known of single takes of a corpus file. Thread-safe.
class TakeSource {
 public:
  virtual ~TakeSource() = default;
  /// Of a corpus with `phone_columns`: all but motion and sound, kept as long as the source lives. Throws InputError
  /// when it is damaged.
  [[nodiscard]] virtual const CorpusTake& take(TakeIndex take) const;
  [[nodiscard]] virtual std::optional<TakeIndex> takeNamed(std::string_view name) const;
  /// Throws InputError when the take's motion is damaged.
  [[nodiscard]] virtual MotionClip load(TakeIndex take) const = 0;
  /// Of each frame of load(take), whether some marker is not seen in it; nothing where that is no sooner told than by
  /// loading. Throws InputError as load() does.
  [[nodiscard]] virtual std::optional<std::vector<bool>> loadUnseen(TakeIndex /*take*/) const { return std::nullopt; }
  /// The take's sound. Throws InputError when it is damaged.
  [[nodiscard]] virtual AudioClip loadAudio(TakeIndex take) const = 0;
  /// Of a corpus with a trajectory model; empty: not kept. Throws InputError when they are damaged.
  [[nodiscard]] virtual PhoneShapes loadShapes(TakeIndex /*take*/) const { return {}; }
  /// Of `count` of its phones, from `first` on; empty where that is no sooner read than all.
  [[nodiscard]] virtual PhoneShapes loadSomeShapes(TakeIndex /*take*/, std::size_t /*first*/,
                                                   std::size_t /*count*/) const {
    return {};
  }
};

struct Corpus;
/// Of a take in memory, or from the corpus' source. Throws InputError when it is damaged.
MotionClip motionOf(const Corpus& corpus, TakeIndex take);
/// Not this speaker's own, but another's brought into this one's face by `corpus adapt`: called CORPUS/TAKE.
inline bool isAdapted(const CorpusTake& take) { return take.name.find('/') != std::string::npos; }

/// A `.corpus` database in memory.
struct Corpus {
  std::string name;  ///< file stem, for reports
  MarkerLayout layout;
  MarkerPositions neutral_pose_mm;  ///< median of the closed-mouth silences, head motion removed
  std::vector<CorpusTake> takes;
  std::map<std::string, std::string> build_log;  ///< "built_with", "takes_left_out", ...
  /// Set by readCorpus(..., CorpusMotion::kOnDemand): then every take's motion is empty but for its frame rate, and
  /// is loaded from here when a UnitDatabase needs it. Null otherwise.
  std::shared_ptr<const TakeSource> take_source;
  /// Fitted when the corpus was built; null in one of format version 1 or with too little to learn from.
  std::shared_ptr<const TrajectoryModel> trajectory_model;
  LatticeWeights lattice_weights;     ///< the usual ones, unless "lattice_weights" of the build log says how learnt
  SoundCutWeights sound_cut_weights;  ///< likewise, "sound_cut_weights"
  MotionSettings motion_settings;     ///< likewise, "motion_settings"
  /// What posesToJson() made of the takes when the corpus was built (src/vocal reads it); empty in one of format
  /// version 1 or 2 or without the markers that it needs, or when takes were taken out.
  std::string viseme_poses;
  /// Set by readCorpus(..., CorpusMotion::kTakesOnDemand) of a file that keeps them: then `takes` is empty, and
  /// takeOf() reads one when it is asked for. Null otherwise.
  std::shared_ptr<const PhoneColumns> phone_columns = nullptr;
};

/// Between LIP_UP_MID and LIP_LO_MID in the actor's B P M at the tightest, the median; 0: not known.
inline double closedLipsMm(const Corpus& corpus) {
  return corpus.trajectory_model != nullptr ? corpus.trajectory_model->closed_opening_mm : 0.0;
}

/// As many as there are, in `takes` or elsewhere.
inline std::size_t takeCount(const Corpus& corpus) {
  return corpus.phone_columns != nullptr ? corpus.phone_columns->takeCount() : corpus.takes.size();
}
/// Valid as long as the corpus. Throws InputError when it is damaged.
inline const CorpusTake& takeOf(const Corpus& corpus, TakeIndex take) {
  return corpus.phone_columns != nullptr ? corpus.take_source->take(take) : corpus.takes[take.value];
}
/// The take of that name, if there is one; looks at one after another.
std::optional<TakeIndex> takeNamed(const Corpus& corpus, std::string_view name);
/// At most `most` of them, evenly spread, for what all would tell no better.
std::vector<TakeIndex> evenlySpreadTakes(const Corpus& corpus, std::size_t most);
/// Enough to know which words the speaker says, and how.
inline constexpr std::size_t kTakesOfWords = 1000;
/// Of `takes`, which are loaded; not sorted yet.
PhoneColumns phoneColumnsOf(const Corpus& corpus);

inline constexpr int kCorpusFormatVersion = 7;

/// Whether a file of these first 72 bytes or more is a corpus, of whatever version.
bool beginsAsCorpus(std::string_view bytes);

enum class CorpusAudio { kLoad, kSkip };

/// kOnDemand: a line needs a few takes of hundreds; what they need is read and checked when they are used. With
/// kTakesOnDemand their labels, too.
enum class CorpusMotion { kLoad, kOnDemand, kTakesOnDemand };

/// Opens the database read-only and checks everything it uses (types, sizes, ranges, checksums of the
/// motion blobs). Throws InputError for what is no database, truncated, damaged or of a newer version.
Corpus readCorpus(const std::filesystem::path& path, CorpusAudio audio = CorpusAudio::kSkip,
                  CorpusMotion motion = CorpusMotion::kLoad);

/// Everything wrong with the file, one line each; empty when all is well. Every row's checksum is looked at, the
/// audio's too, so any flipped bit in motion, labels or audio is found. Never throws InputError.
std::vector<std::string> checkCorpus(const std::filesystem::path& path);

/// One transaction into a temporary file, then rename. Motion is stored as 32-bit floats, audio as 16-bit samples, both
/// packed where that is smaller; they are taken from `corpus.take_source`, one take at a time, when there is one.
/// Throws InputError when it cannot be written.
void writeCorpus(const std::filesystem::path& path, const Corpus& corpus);

}  // namespace mouthpiece
