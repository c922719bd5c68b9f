#include "corpus_tools/corpus_builder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/errors.h"
#include "base/parallel_for.h"
#include "corpus_tools/neutral_pose.h"
#include "corpus_tools/pose_fit.h"
#include "corpus_tools/take_alignment.h"
#include "corpus_tools/trajectory_fit.h"
#include "motion/gaps.h"
#include "motion/smoothing.h"

namespace mouthpiece {
namespace {

using Json = nlohmann::json;

constexpr const char* kJigKey = "head_reference_jig_mm";
constexpr const char* kStableKey = "head_reference_stable_mm";

std::size_t missingSamples(const MotionClip& clip) {
  std::size_t missing = 0;
  for (Eigen::Index column = 0; column < clip.positions_mm.cols(); column += 3) {
    missing += static_cast<std::size_t>((!clip.positions_mm.col(column).array().isFinite()).count());
  }
  return missing;
}

struct CleanedFace {
  MotionClip motion;
  TakeReport report;
};

CleanedFace cleanFace(const RawTake& raw, const HeadReference& reference, const MarkerLayout& layout,
                      const CleaningOptions& options) {
  const HeadTrack track = trackHead(raw, reference, layout, options.head);
  CleanedFace cleaned{withoutHeadMotion(raw.face, track), {}};
  const std::size_t missing_before = missingSamples(cleaned.motion);
  cleaned.motion = fillShortGaps(cleaned.motion, options.gaps).clip;
  if (raw.face.frame_rate_hz >= options.smoothed_from_hz) cleaned.motion = smoothMotion(cleaned.motion).clip;
  cleaned.report = {raw.name,
                    raw.face.frameCount(),
                    track.jig_frames,
                    track.skin_frames,
                    track.bridged_frames,
                    track.scale,
                    track.residual_rms_mm,
                    /*filled_samples=*/0,
                    0,
                    0};
  cleaned.report.missing_samples = missingSamples(cleaned.motion);
  cleaned.report.filled_samples = missing_before - cleaned.report.missing_samples;
  return cleaned;
}

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

/// Does `work` for every input in parallel; an InputError leaves that one out (or, when strict, stops).
template <typename Output, typename Input, typename Work>
std::vector<Output> forEachTake(const std::vector<Input>& inputs, const BuildOptions& options, StepCounter& steps,
                                std::vector<LeftOutTake>& left_out, const Work& work) {
  std::vector<std::optional<Output>> outputs(inputs.size());
  std::vector<std::string> reasons(inputs.size());
  parallelFor(inputs.size(), threadCount(options), [&](std::size_t i) {
    try {
      outputs[i] = work(inputs[i]);
    } catch (const InputError& error) {
      if (options.strict) throw;
      reasons[i] = error.what();
    }
    steps.advance();
  });
  std::vector<Output> usable;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (outputs[i]) usable.push_back(std::move(*outputs[i]));
    if (!outputs[i]) left_out.push_back({inputs[i].name, reasons[i]});
  }
  return usable;
}

struct RawTakes {
  std::vector<RawTake> takes;
  std::vector<LeftOutTake> left_out;
};

RawTakes readTakes(const std::filesystem::path& folder, const BuildOptions& options, const FoundTakes& found,
                   StepCounter& steps) {
  RawTakes raw{{}, found.left_out};
  if (options.strict && !raw.left_out.empty()) {
    throw InputError(folder.string(), "", fmt::format("take {}: {}", raw.left_out[0].name, raw.left_out[0].reason));
  }
  raw.takes = forEachTake<RawTake>(found.takes, options, steps, raw.left_out, [&](const TakeFiles& files) {
    return readTake(files, options.layout, options.lexicon);
  });
  if (raw.takes.empty()) {
    throw InputError(folder.string(), "",
                     fmt::format("none of its {} takes can be used; the first: {}: {}", raw.left_out.size(),
                                 raw.left_out[0].name, raw.left_out[0].reason));
  }
  return raw;
}

struct CleanedTake {
  CorpusTake take;
  TakeReport report;
};

CleanedTake cleanTake(const RawTake& raw, const HeadReference& reference, const BuildOptions& options) {
  CleanedFace face = cleanFace(raw, reference, options.layout, options.cleaning);
  return {{raw.name, raw.text, raw.labels, std::move(face.motion), raw.audio}, face.report};
}

std::string shapeToJson(const MarkerPositions& shape) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < shape.rows(); ++i) rows.push_back({shape(i, 0), shape(i, 1), shape(i, 2)});
  return rows.dump();
}

/// nullopt for what is no list of `rows` points.
std::optional<MarkerPositions> shapeFromJson(const std::string& text, std::size_t rows) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_array() || json.size() != rows) return std::nullopt;
  MarkerPositions shape(static_cast<Eigen::Index>(rows), 3);
  for (std::size_t i = 0; i < rows; ++i) {
    if (!json[i].is_array() || json[i].size() != 3) return std::nullopt;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Json& value = json[i][axis];  // null: a marker never seen
      const double number = value.is_number() ? value.get<double>() : std::nan("");
      shape(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(axis)) = number;
    }
  }
  return shape;
}

/// As buildCorpus() noted it; a corpus from elsewhere has at least its neutral pose.
HeadReference headReferenceOf(const Corpus& corpus) {
  HeadReference reference{MarkerPositions(0, 3), pickMarkers(corpus.neutral_pose_mm, stableMarkers(corpus.layout))};
  const auto noted = [&](const char* key, std::size_t rows, MarkerPositions& shape) {
    const auto entry = corpus.build_log.find(key);
    if (entry == corpus.build_log.end()) return;
    if (const auto read = shapeFromJson(entry->second, rows)) shape = *read;
  };
  noted(kJigKey, corpus.layout.jig_names.size(), reference.jig_mm);
  noted(kStableKey, stableMarkers(corpus.layout).size(), reference.stable_mm);
  return reference;
}

std::string reportToJson(const std::vector<TakeReport>& reports) {
  Json list = Json::array();
  for (const TakeReport& report : reports) {
    list.push_back({{"name", report.name},
                    {"frames", report.frames},
                    {"head_by_jig", report.jig_frames},
                    {"head_by_skin", report.skin_frames},
                    {"head_bridged", report.bridged_frames},
                    {"head_residual_mm", report.head_residual_mm},
                    {"scale", report.scale},
                    {"filled_samples", report.filled_samples},
                    {"missing_samples", report.missing_samples},
                    {"aligned_mm", report.aligned_mm}});
  }
  return list.dump();
}

std::string leftOutToText(const std::vector<LeftOutTake>& left_out) {
  std::vector<std::string> lines;
  for (const LeftOutTake& take : left_out) lines.push_back(fmt::format("{}: {}", take.name, take.reason));
  return fmt::format("{}", fmt::join(lines, "\n"));
}

void writeLog(BuildResult& result, const HeadReference& reference, const NeutralPose& neutral, bool aligned) {
  auto& log = result.corpus.build_log;
  log["built_with"] = "corpus build";
  log["takes_used"] = std::to_string(result.takes.size());
  log["takes_left_out"] = leftOutToText(result.left_out);
  log["take_reports"] = reportToJson(result.takes);
  log["neutral_pose_frames"] = std::to_string(neutral.frames);
  log["takes_aligned_by_phones"] = aligned ? "yes" : "no";
  log[kJigKey] = shapeToJson(reference.jig_mm);
  log[kStableKey] = shapeToJson(reference.stable_mm);
}

/// Aligns, finds the neutral pose, and turns everything into the face's own axes.
void finish(BuildResult& result, HeadReference reference, const BuildOptions& options) {
  Corpus& corpus = result.corpus;
  const bool align = options.align_takes && reference.jig_mm.rows() == 0 && corpus.takes.size() > 1;
  if (align) {
    const std::vector<double> moves = alignTakesByPhones(corpus.takes);
    for (std::size_t i = 0; i < moves.size(); ++i) result.takes[i].aligned_mm = moves[i];
  }
  NeutralPose neutral = neutralPose(corpus.takes, options.layout);
  const RigidMotion face_from_head = faceFromHead(neutral.pose_mm, options.layout);
  for (CorpusTake& take : corpus.takes) transform(take.motion, face_from_head);
  transform(neutral.pose_mm, face_from_head);
  transform(reference.jig_mm, face_from_head);
  transform(reference.stable_mm, face_from_head);
  corpus.neutral_pose_mm = neutral.pose_mm;
  corpus.trajectory_model = fitTrajectoryModel(corpus, {.jobs = options.jobs});
  writeLog(result, reference, neutral, align);
}

}  // namespace

BuildResult buildCorpus(const std::filesystem::path& folder, const BuildOptions& options,
                        const BuildProgress& progress) {
  const FoundTakes found = findTakes(folder);
  StepCounter steps(2 * found.takes.size(), progress);
  RawTakes raw = readTakes(folder, options, found, steps);
  BuildResult result{{}, {}, std::move(raw.left_out)};
  result.corpus.layout = options.layout;
  const HeadReference reference = estimateHeadReference(raw.takes, options.layout, options.cleaning.head);
  auto cleaned = forEachTake<CleanedTake>(raw.takes, options, steps, result.left_out,
                                          [&](const RawTake& take) { return cleanTake(take, reference, options); });
  if (cleaned.empty()) {
    throw InputError(folder.string(), "", fmt::format("no take can be used; the first: {}", result.left_out[0].reason));
  }
  for (CleanedTake& take : cleaned) {
    result.corpus.takes.push_back(std::move(take.take));
    result.takes.push_back(take.report);
  }
  finish(result, reference, options);
  return result;
}

CleanTakes readTakesInto(const Corpus& corpus, const std::filesystem::path& folder, const BuildOptions& options,
                         const BuildProgress& progress) {
  BuildOptions as_corpus = options;
  as_corpus.layout = corpus.layout;
  const FoundTakes found = findTakes(folder);
  StepCounter steps(2 * found.takes.size(), progress);
  RawTakes raw = readTakes(folder, as_corpus, found, steps);
  CleanTakes clean{{}, std::move(raw.left_out)};
  const HeadReference reference = headReferenceOf(corpus);
  auto cleaned = forEachTake<CleanedTake>(raw.takes, as_corpus, steps, clean.left_out,
                                          [&](const RawTake& take) { return cleanTake(take, reference, as_corpus); });
  for (CleanedTake& take : cleaned) clean.takes.push_back(std::move(take.take));
  return clean;
}

CleanClip cleanClip(const MotionClip& clip, const MarkerLayout& layout, const std::string& file,
                    const CleaningOptions& options) {
  FaceAndJig split = splitMarkers(clip, layout, file);
  const std::vector<RawTake> takes = {{file, "", {}, std::move(split.face), std::move(split.jig), {}}};
  const HeadReference reference = estimateHeadReference(takes, layout, options.head);
  CleanedFace cleaned = cleanFace(takes[0], reference, layout, options);
  const NeutralPose neutral = neutralPose({{file, "", {}, cleaned.motion, {}}}, layout);
  transform(cleaned.motion, faceFromHead(neutral.pose_mm, layout));
  return {std::move(cleaned.motion), cleaned.report};
}

}  // namespace mouthpiece
