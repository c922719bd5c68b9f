#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/unfinished.h"
#include "corpus_tools/building/corpus_builder.h"
#include "corpus_tools/takes/head_tracking.h"
#include "corpus_tools/takes/take_files.h"
#include "corpus_tools/takes/take_report.h"
#include "motion/cleaning/rigid.h"
#include "motion/marker_layout.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// A take, cleaned and labelled.
struct CleanedTake {
  CorpusTake take;
  TakeReport report;
};

/// SHA-256 over the bytes of all files of a take and over `settings`.
std::string takeKey(const TakeFiles& files, const std::string& settings);

/// Takes that a build has done, kept in a folder until the corpus is whole: what a run that is killed leaves, the next
/// one takes up. Each is a corpus file of one take, written atomically, checksums and all. Thread-safe.
class BuildParts {
 public:
  /// `frame` names the coordinates that the takes are in: parts of another frame are not found. Throws InputError when
  /// another process is building with this folder, and names it.
  BuildParts(std::filesystem::path folder, const MarkerLayout& layout, std::string frame);
  BuildParts(const BuildParts&) = delete;
  BuildParts& operator=(const BuildParts&) = delete;
  ~BuildParts();

  /// nullopt when it was not done, or is damaged.
  [[nodiscard]] std::optional<CleanedTake> find(const std::string& key) const;
  void store(const CleanedTake& take) const;
  /// A take that was found or stored before. Throws InputError when it has gone or is damaged.
  [[nodiscard]] CorpusTake load(const std::string& key) const;
  /// The folder with all parts, once they are in a corpus.
  void remove() const;

 private:
  [[nodiscard]] std::filesystem::path pathOf(const std::string& key) const;

  std::filesystem::path folder_;
  std::unique_ptr<FileLock> lock_;
  const MarkerLayout& layout_;
  std::string frame_;
};

/// The head reference in the build log, so that takes from outside can be brought into the corpus' frame.
void logHeadReference(Corpus& corpus, const HeadReference& reference);
/// As logged; a corpus from elsewhere has at least its neutral pose.
HeadReference headReferenceOf(const Corpus& corpus);
/// The numbers of a reference as text: the same for the same reference.
std::string textOf(const HeadReference& reference);

/// "NAME: reason" a line.
std::string leftOutToText(const std::vector<LeftOutTake>& left_out);

/// The motion and sound of takes that a build has done: in its parts on disk, or in the corpus that it goes on from.
/// A corpus has hundreds of times the takes that are worked on at once, so of all of them only a little motion is kept
/// in memory. Reading is thread-safe.
class FinishedTakes final : public TakeSource {
 public:
  /// `most_held_bytes` of motion stay in memory; the rest is read from `parts` when asked for.
  explicit FinishedTakes(const BuildParts& parts, std::size_t most_held_bytes = kMostHeldBytes)
      : parts_(parts), most_held_bytes_(most_held_bytes) {}

  /// Takes the motion out of the take of that key, which is in the parts. Thread-safe.
  void takeOver(const std::string& key, MotionClip& motion);
  /// The next take is the one of `key`, or take `take` of `earlier`.
  void addPart(const std::string& key);
  void addEarlier(std::shared_ptr<const TakeSource> earlier, TakeIndex take);

  /// From now on take `take` is moved by `move`, and after that all takes by `face_from_head`.
  void move(std::size_t take, const RigidMotion& move) { places_[take].move = move; }
  void turnAll(const RigidMotion& face_from_head) { face_from_head_ = face_from_head; }

  [[nodiscard]] MotionClip load(TakeIndex take) const override;
  [[nodiscard]] AudioClip loadAudio(TakeIndex take) const override;

 private:
  struct Place {
    std::string key;
    std::shared_ptr<const TakeSource> earlier;
    TakeIndex earlier_take;
    std::optional<RigidMotion> move;
  };
  struct Held {
    MotionClip without_positions;
    Eigen::MatrixXf positions_mm;
  };
  /// The takes of a short session, which are then not read again and again.
  static constexpr std::size_t kMostHeldBytes = 8 << 20;

  const BuildParts& parts_;
  std::size_t most_held_bytes_;
  std::vector<Place> places_;
  std::mutex mutex_;
  std::map<std::string, Held> held_;  ///< by key
  std::size_t held_bytes_ = 0;
  std::optional<RigidMotion> face_from_head_;
};

/// For Corpus::viseme_poses; empty where there is too little to learn from: `synth` says so when it needs them.
std::string visemePosesOf(const Corpus& corpus);

/// Motion as the database keeps it, so that a take is the same whether it was just done or read back.
void roundToFile(MotionClip& motion);

/// What a take's cleaning and labels depend on besides its files and the head reference.
std::string settingsOf(const BuildOptions& options);

/// What EarlierBuild::find() asks for. `takes`: the reports of all takes of the corpus, in its order.
void logForNextBuild(Corpus& corpus, const std::vector<TakeReport>& takes, const std::string& settings);

/// A corpus that takes are added to: its takes by key.
struct EarlierBuild {
  Corpus corpus;
  std::map<std::string, TakeReport> reports;
  std::map<std::string, std::size_t> takes;

  /// nullopt when there is none at `output`, or it was made with other settings, or is damaged, or shares no take.
  static std::optional<EarlierBuild> find(const std::filesystem::path& output, const std::string& settings,
                                          const std::vector<std::string>& keys);
};

}  // namespace mouthpiece
