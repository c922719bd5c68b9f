#include "corpus_tools/building/corpus_builder.h"

#include <fmt/format.h>

#include <map>
#include <mutex>
#include <optional>

#include "base/errors.h"
#include "base/files.h"
#include "base/parallel_for.h"
#include "corpus_tools/building/build_state.h"
#include "corpus_tools/building/settings_fit.h"
#include "corpus_tools/takes/pose_fit.h"
#include "corpus_tools/takes/take_poses.h"
#include "motion/formats/motion_file.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// Frames of a take that tell the shape of the head: see estimateHeadReference().
constexpr std::size_t kShapeFrames = 25;
/// Takes that tell it, spread over all: the mean shape of more is the same.
constexpr std::size_t kMostShapeTakes = 300;

/// Counts finished steps; the callback is called under a lock.
class StepCounter {
 public:
  StepCounter(std::size_t total, const BuildProgress& progress) : total_(total), progress_(progress) {}
  void advance() {
    if (!progress_) return;
    const std::scoped_lock lock(mutex_);
    progress_(++done_, total_);
  }

 private:
  std::size_t total_;
  const BuildProgress& progress_;
  std::size_t done_ = 0;
  std::mutex mutex_;
};

std::size_t threadCount(const BuildOptions& options) { return options.jobs > 0 ? options.jobs : defaultThreadCount(); }

/// Does `work` for every take in parallel; an InputError leaves that one out (or, when strict, stops). `keep` puts what
/// came out away; when that cannot be, it is no fault of the take: the InputError stops all.
template <typename Output, typename Work, typename Keep>
std::vector<Output> forEachTake(std::vector<TakeFiles>& takes, const BuildOptions& options, StepCounter& steps,
                                std::vector<LeftOutTake>& left_out, const Work& work, const Keep& keep) {
  std::vector<std::optional<Output>> outputs(takes.size());
  std::vector<std::string> reasons(takes.size());
  parallelFor(takes.size(), threadCount(options), [&](std::size_t i) {
    try {
      outputs[i] = work(takes[i]);
    } catch (const InputError& error) {
      if (options.strict) throw;
      reasons[i] = error.what();
    }
    if (outputs[i]) keep(*outputs[i]);
    steps.advance();
  });
  std::vector<Output> usable;
  std::vector<TakeFiles> usable_takes;
  for (std::size_t i = 0; i < takes.size(); ++i) {
    if (!outputs[i]) left_out.push_back({takes[i].name, reasons[i]});
    if (!outputs[i]) continue;
    usable.push_back(std::move(*outputs[i]));
    usable_takes.push_back(std::move(takes[i]));
  }
  takes = std::move(usable_takes);
  return usable;
}

constexpr auto kAsItIs = [](auto&) {};

void expectSome(const fs::path& folder, const std::vector<TakeFiles>& takes, const std::vector<LeftOutTake>& left_out) {
  if (!takes.empty()) return;
  throw InputError(folder.string(), "",
                   fmt::format("none of its {} takes can be used; the first: {}: {}", left_out.size(), left_out[0].name,
                               left_out[0].reason));
}

/// A few frames of a take, far apart: enough for the shape of its head, and small enough to keep those of all takes.
RawTake shapeFrames(const TakeFiles& files, const BuildOptions& options) {
  MotionClip motion = readMotion(files.motion);
  renameMarkers(motion, options.marker_names);
  FaceAndJig markers = splitMarkers(motion, options.layout, files.motion.string());
  TakeReport ignored;
  RawTake take = withoutOutliers({files.name, "", {}, std::move(markers.face), std::move(markers.jig), {}, false, {}},
                                 options.cleaning, ignored);
  const std::size_t step = std::max<std::size_t>(1, take.face.frameCount() / kShapeFrames);
  std::vector<Eigen::Index> frames;
  for (std::size_t frame = 0; frame < take.face.frameCount(); frame += step) {
    frames.push_back(signedIndex(frame));
  }
  for (MotionClip* clip : {&take.face, &take.jig}) {
    clip->positions_mm = PositionMatrix(clip->positions_mm(frames, Eigen::all));
    clip->frame_rate_hz /= asReal(step);
  }
  return take;
}

HeadReference headReferenceOf(std::vector<TakeFiles>& takes, const BuildOptions& options, StepCounter& steps,
                              std::vector<LeftOutTake>& left_out, const fs::path& folder) {
  const std::size_t every = (takes.size() + kMostShapeTakes - 1) / kMostShapeTakes;
  const TakeFiles* const first = takes.data();
  auto shapes = forEachTake<std::optional<RawTake>>(
      takes, options, steps, left_out,
      [&](const TakeFiles& files) -> std::optional<RawTake> {
        std::optional<RawTake> take = shapeFrames(files, options);
        if (unsignedIndex(&files - first) % every != 0) take.reset();
        return take;
      },
      kAsItIs);
  expectSome(folder, takes, left_out);
  std::vector<RawTake> kept;
  for (std::optional<RawTake>& shape : shapes) {
    if (shape) kept.push_back(std::move(*shape));
  }
  if (!options.cleaning.remove_head) {
    const auto rows = signedIndex(stableMarkers(options.layout).size());
    return {MarkerPositions(0, 3), MarkerPositions::Zero(rows, 3)};
  }
  return estimateHeadReference(kept, options.layout, options.cleaning.head);
}

/// Reads, labels and cleans a take, and forgets what it was made of.
CleanedTake cleanTake(const TakeFiles& files, const HeadReference& reference, const BuildOptions& options,
                      TakeLabeller& labeller) {
  const RawTake raw = readTake(files, options.layout, options.lexicon, labeller, options.marker_names);
  CleanedFace face = cleanFace(raw, reference, options.layout, options.cleaning);
  face.report.labels_found = raw.labels_found;
  face.report.doubtful = raw.doubtful;
  roundToFile(face.motion);
  return {{raw.name, raw.text, raw.labels, std::move(face.motion), raw.audio}, face.report};
}

void writeLog(BuildResult& result, const std::string& settings, const HeadReference& reference) {
  auto& log = result.corpus.build_log;
  log["built_with"] = "corpus build";
  log["takes_used"] = std::to_string(result.takes.size());
  log["takes_left_out"] = leftOutToText(result.left_out);
  logForNextBuild(result.corpus, result.takes, settings);
  logHeadReference(result.corpus, reference);
}

MotionLoader loaderOf(const FinishedTakes& finished) {
  return [&finished](std::size_t take) { return finished.load(TakeIndex(take)); };
}

/// Brings the new takes of a capture without a jig to where the phones of all say; the others stay where they are.
bool alignTakes(BuildResult& result, FinishedTakes& finished, const std::vector<bool>& is_new,
                const HeadReference& reference, const BuildOptions& options) {
  if (!options.align_takes || reference.jig_mm.rows() > 0 || result.corpus.takes.size() < 2) return false;
  const std::vector<TakeMove> moves = takeMovesByPhones(result.corpus.takes, loaderOf(finished));
  for (std::size_t i = 0; i < moves.size(); ++i) {
    if (!is_new[i]) continue;
    if (moves[i].move) finished.move(i, *moves[i].move);
    result.takes[i].aligned_mm = moves[i].largest_mm;
  }
  return true;
}

/// Finds the neutral pose, and turns everything into the face's own axes.
void settleFrame(Corpus& corpus, FinishedTakes& finished, HeadReference& reference, const BuildOptions& options) {
  NeutralPose neutral = neutralPose(corpus.takes, options.layout, loaderOf(finished));
  const RigidMotion face_from_head = faceFromHead(neutral.pose_mm, options.layout);
  finished.turnAll(face_from_head);
  for (MarkerPositions* pose : {&neutral.pose_mm, &reference.jig_mm, &reference.stable_mm})
    transform(*pose, face_from_head);
  corpus.neutral_pose_mm = neutral.pose_mm;
  corpus.build_log["neutral_pose_frames"] = std::to_string(neutral.frames);
}

/// One build, in steps that share what they know.
class Builder {
 public:
  Builder(fs::path folder, fs::path output, const BuildOptions& options, const BuildProgress& progress)
      : folder_(std::move(folder)),
        output_(std::move(output)),
        options_(options),
        settings_(settingsOf(options)),
        found_(findTakes(folder_)),
        steps_(2 * found_.takes.size(), progress) {
    if (options.strict && !found_.left_out.empty()) {
      throw InputError(folder_.string(), "",
                       fmt::format("take {}: {}", found_.left_out[0].name, found_.left_out[0].reason));
    }
  }

  BuildResult build() {
    BuildResult result;
    result.left_out = found_.left_out;
    std::optional<EarlierBuild> earlier = findEarlierBuild();
    HeadReference reference = earlier ? mouthpiece::headReferenceOf(earlier->corpus)
                                      : headReferenceOf(found_.takes, options_, steps_, result.left_out, folder_);
    const BuildParts parts(fs::path(output_.string() + ".parts"), options_.layout,
                           sha256Hex(settings_ + textOf(reference)));
    const auto finished = std::make_shared<FinishedTakes>(parts);
    std::vector<bool> is_new;
    doTakes(result, *finished, earlier, reference, parts, is_new);
    result.corpus.layout = options_.layout;
    result.corpus.take_source = finished;
    if (earlier) {
      result.corpus.neutral_pose_mm = earlier->corpus.neutral_pose_mm;
      result.corpus.build_log = earlier->corpus.build_log;
    }
    const bool are_aligned = alignTakes(result, *finished, is_new, reference, options_);
    if (!earlier) {
      settleFrame(result.corpus, *finished, reference, options_);
      result.corpus.build_log["takes_aligned_by_phones"] = are_aligned ? "yes" : "no";
    }
    fitMotion(result.corpus, {.jobs = options_.jobs});
    result.corpus.viseme_poses = visemePosesOf(result.corpus);
    writeLog(result, settings_, reference);
    result.corpus.name = output_.stem().string();
    writeCorpus(output_, result.corpus);
    result.corpus.take_source = nullptr;  // its parts go; the database has it all
    parts.remove();
    return result;
  }

 private:
  std::optional<EarlierBuild> findEarlierBuild() {
    std::vector<std::string> keys(found_.takes.size());
    parallelFor(keys.size(), threadCount(options_),
                [&](std::size_t i) { keys[i] = takeKey(found_.takes[i], settings_); });
    for (std::size_t i = 0; i < keys.size(); ++i) keys_[found_.takes[i].name] = keys[i];
    return EarlierBuild::find(output_, settings_, keys);
  }

  /// Keeps of each take what is small; its motion and sound are found through `finished`.
  void doTakes(BuildResult& result, FinishedTakes& finished, std::optional<EarlierBuild>& earlier,
               const HeadReference& reference, const BuildParts& parts, std::vector<bool>& is_new) {
    TakeLabeller labeller(options_.lexicon, options_.word_network, *options_.language);
    struct Done {
      CleanedTake cleaned;
      std::optional<std::size_t> earlier;  ///< its number there
      bool was_kept = false;
    };
    const auto make = [&](const TakeFiles& files) {
      const std::string& key = keys_.at(files.name);
      if (earlier) {
        const auto found = earlier->takes.find(key);
        if (found != earlier->takes.end()) {
          return Done{{std::move(earlier->corpus.takes[found->second]), earlier->reports.at(key)}, found->second, true};
        }
      }
      if (auto part = parts.find(key)) return Done{std::move(*part), {}, true};
      CleanedTake cleaned = cleanTake(files, reference, options_, labeller);
      cleaned.report.key = key;
      return Done{std::move(cleaned), {}, false};
    };
    const auto keep = [&](Done& take) {
      if (take.earlier) return;
      if (!take.was_kept) parts.store(take.cleaned);
      finished.takeOver(take.cleaned.report.key, take.cleaned.take.motion);
      std::vector<float>().swap(take.cleaned.take.audio.samples);  // with its room
    };
    auto done = forEachTake<Done>(found_.takes, options_, steps_, result.left_out, make, keep);
    expectSome(folder_, found_.takes, result.left_out);
    result.network_fault = labeller.networkFault();
    for (Done& take : done) {
      is_new.push_back(!take.earlier);
      if (take.earlier) {
        finished.addEarlier(earlier->corpus.take_source, TakeIndex(*take.earlier));
      } else {
        finished.addPart(take.cleaned.report.key);
      }
      result.corpus.takes.push_back(std::move(take.cleaned.take));
      result.takes.push_back(std::move(take.cleaned.report));
      result.kept_takes += take.was_kept ? 1U : 0U;
    }
  }

  fs::path folder_, output_;
  const BuildOptions& options_;
  std::string settings_;
  FoundTakes found_;
  StepCounter steps_;
  std::map<std::string, std::string> keys_;  ///< of the takes, by name
};

}  // namespace

BuildResult buildCorpusFile(const fs::path& folder, const fs::path& output, const BuildOptions& options,
                            const BuildProgress& progress) {
  MOUTHPIECE_EXPECT(!output.empty());
  return Builder(folder, output, options, progress).build();
}

CleanTakes readTakesInto(const Corpus& corpus, const fs::path& folder, const BuildOptions& options,
                         const BuildProgress& progress) {
  BuildOptions as_corpus = options;
  as_corpus.layout = corpus.layout;
  FoundTakes found = findTakes(folder);
  CleanTakes clean{{}, found.left_out};
  StepCounter steps(found.takes.size(), progress);
  const HeadReference reference = mouthpiece::headReferenceOf(corpus);
  TakeLabeller labeller(options.lexicon, {}, *options.language);
  const auto make = [&](const TakeFiles& files) { return cleanTake(files, reference, as_corpus, labeller); };
  auto cleaned = forEachTake<CleanedTake>(found.takes, as_corpus, steps, clean.left_out, make, kAsItIs);
  expectSome(folder, found.takes, clean.left_out);
  for (CleanedTake& take : cleaned) clean.takes.push_back(std::move(take.take));
  return clean;
}

}  // namespace mouthpiece
