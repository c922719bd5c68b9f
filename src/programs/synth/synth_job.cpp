#include "programs/synth/synth_job.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "audio/audio_clip.h"
#include "base/errors.h"
#include "base/files.h"
#include "exports/format_bytes.h"
#include "exports/gltf/glb.h"
#include "exports/format_bytes.h"
#include "exports/shapes/principal_shapes.h"
#include "exports/format_bytes.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_csv.h"
#include "motion/resample.h"
#include "phonetics/labels/lab_file.h"
#include "phonetics/text/lexicon.h"
#include "phonetics/text/lexicon_choice.h"
#include "phonetics/labels/textgrid.h"
#include "programs/shared_files.h"
#include "singing/song_source.h"
#include "retarget/rig/face_rig.h"
#include "synthesis/curve_ablation.h"
#include "synthesis/curve_model.h"
#include "units/selection/unit_database.h"
#include "vocal/curve_file.h"
#include "hearing/alignment/forced_alignment.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kMakeCorpus =
    "make the sample corpus with `make data` in the checkout, or name one with --corpus";
constexpr std::string_view kMakeFace = "make the sample face with `make data` in the checkout, or name one with --face";
constexpr std::string_view kMakePage = "make it with `make build` in the checkout";
/// Every vertex of every frame is held in memory until the shapes are found.
constexpr double kMaxFaceAnimationBytes = 6e9;
/// About three hours of speech: what a line has loaded of a larger corpus is given back before its face takes memory.
/// Of a smaller one it stays for the next line of a batch.
constexpr std::size_t kMostPhonesKept = 70'000;

bool isAny(const std::vector<OutputFile>& outputs, std::initializer_list<OutputKind> kinds) {
  return std::any_of(outputs.begin(), outputs.end(), [&](const OutputFile& output) {
    return std::find(kinds.begin(), kinds.end(), output.kind) != kinds.end();
  });
}

bool needsFace(const std::vector<OutputFile>& outputs) {
  return isAny(outputs, {OutputKind::kFace, OutputKind::kPage});
}

/// Adds the wall time of `work` to `milliseconds`.
template <typename Work>
auto timed(double& milliseconds, Work&& work) {
  struct Stopwatch {
    double& total;
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
    ~Stopwatch() {
      total += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    }
  } stopwatch{milliseconds};
  return std::forward<Work>(work)();
}

void expectFrameRate(double frame_rate_hz) {
  if (!(frame_rate_hz >= 24.0 && frame_rate_hz <= 240.0)) {
    throw InputError("--fps", "", fmt::format("found {}; expected 24 to 240", frame_rate_hz));
  }
}

void expectOverlap(double overlap_ms) {
  if (!(overlap_ms >= 0.0 && overlap_ms <= 1000.0)) {
    throw InputError("--overlap-ms", "", fmt::format("found {}; expected 0 to 1000", overlap_ms));
  }
}

void expectNoBackoff(const UtteranceAnimation& animation, const std::string& corpus) {
  const auto found = std::find_if(animation.units.begin(), animation.units.end(),
                                  [](const PlacedUnit& unit) { return unit.is_backoff; });
  if (found == animation.units.end()) return;
  const auto& phones = animation.labels.phones;
  throw InputError(corpus, "",
                   fmt::format("lacks the phone pair {} {} (at {:.2f} s); expected it because of --backoff none",
                               phoneName(phones[found->phones.first.value].phone),
                               phoneName(phones[found->phones.last.value].phone), found->span.start));
}

std::vector<Seconds> timesOf(const MotionClip& motion) {
  return frameTimes(0, motion.frameCount(), motion.frame_rate_hz);
}

PhonePairs phonePairsOf(const Corpus& corpus) {
  PhonePairs pairs;
  for (const CorpusTake& take : corpus.takes) pairs.add(take.labels);
  return pairs;
}

}  // namespace

struct SynthJob::Data {
  SynthOptions options;
  std::filesystem::path corpus_path;
  Corpus corpus;
  std::unique_ptr<UnitDatabase> units;
  std::unique_ptr<CurveModel> curve_model;
  std::optional<FaceRig> face;
  std::optional<Lexicon> lexicon;
  std::optional<Lexicon> line_lexicon;     ///< the same for the line at hand: pronunciations that the corpus can speak
  std::unique_ptr<Voice> voice;            ///< made when the first typed line comes
  std::unique_ptr<Pronouncer> pronouncer;  ///< these two when the first recording without labels comes
  std::unique_ptr<ForcedAligner> aligner;
  std::string page_template;
  double load_ms = 0;

  void readCurveOptions();
  SpokenLine speakOrRead(const LineSource& source);
  /// The line, and for a song, a line drawn as one, or Ma from the sound, what is heard in it.
  SungSource soundOf(const LineSource& source);
  [[nodiscard]] SynthesisOptions optionsFor(const LineSource& source) const;
  void giveBackTakes();
  SpokenLine alignRecording(const LineSource& source);
  /// The face's animation as few shapes. `motion`: FaceRig::retarget()'s.
  PrincipalShapes deformFace(const UtteranceAnimation& animation, const FaceMotion& motion, StageTimings& timing) const;
  [[nodiscard]] std::string ablationOf(const SynthesisRequest& request, const UtteranceAnimation& animation) const;
  void writeOutputs(UtteranceAnimation& animation, const FaceMotion& motion, const std::string& glb,
                    const std::string& ablation, const std::vector<OutputFile>& outputs) const;
};

SynthJob::SynthJob(const SynthOptions& options, const std::vector<OutputFile>& outputs)
    : data_(std::make_unique<Data>()) {
  expectFrameRate(options.synthesis.frame_rate_hz);
  expectOverlap(options.synthesis.overlap_ms);
  if (options.rate && options.voice != "corpus") {
    throw InputError("--rate", "", fmt::format("found voice {}; expected --voice corpus", printable(options.voice)));
  }
  data_->options = options;
  timed(data_->load_ms, [&] {
    data_->corpus_path = options.corpus.empty() ? findSharedFile("sample.corpus", kMakeCorpus) : options.corpus;
    data_->corpus = readCorpus(data_->corpus_path, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
    data_->units = std::make_unique<UnitDatabase>(data_->corpus);
    data_->curve_model = std::make_unique<CurveModel>(*data_->units);
    data_->readCurveOptions();
    if (needsFace(outputs))
      data_->face = FaceRig::load(options.face.empty() ? findSharedFile("default.face", kMakeFace) : options.face);
    if (isAny(outputs, {OutputKind::kPage})) data_->page_template = readFile(findSharedFile("viewer.html", kMakePage));
    if (!options.lexicon.empty()) data_->lexicon = Lexicon::read(options.lexicon);
  });
}

SynthJob::~SynthJob() = default;

void SynthJob::Data::readCurveOptions() {
  CurveOptions& curves = options.synthesis.curves;
  const auto wish = [](const std::string& text, std::string_view option, double largest, bool may_be_auto) {
    StyleWish wished;
    if (text.empty()) return wished;
    const StyleChoice choice = parseStyleChoice(text, option, largest, may_be_auto);
    wished.automatic = choice.automatic;
    if (choice.constant) wished.given = StyleSignal(*choice.constant);
    if (!choice.file.empty()) wished.given = readStyleSignal(choice.file, largest);
    return wished;
  };
  curves.ma = wish(options.ma, "--ma", 1, true);
  curves.ps = wish(options.ps, "--ps", 1, true);
  curves.ja = wish(options.ja, "--ja", kLargestArticulation, false);
  curves.li = wish(options.li, "--li", kLargestArticulation, false);
  if (!options.edits.empty()) curves.edits = readCurveEdits(options.edits);
  curves.fill_gaps = options.backoff == BackoffKind::kVocal;
  curves.model = curve_model.get();
}

SpokenLine SynthJob::Data::alignRecording(const LineSource& source) {
  if (!pronouncer) pronouncer = std::make_unique<Pronouncer>(lexicon ? &*lexicon : nullptr);
  if (!aligner) aligner = std::make_unique<ForcedAligner>();
  SpokenLine line;
  line.audio = readAudio(source.audio);
  line.text = source.text;
  ForcedAlignment alignment = aligner->align(line.audio, pronouncer->wordsOf(source.text), source.audio.string(),
                                             source.is_sung ? SpeechKind::kSung : SpeechKind::kSpoken);
  line.notice = doubtsAbout(alignment);
  line.labels = std::move(alignment.labels);
  line.voice = "recorded:" + source.audio.filename().string();
  return line;
}

SpokenLine SynthJob::Data::speakOrRead(const LineSource& source) {
  if (source.audio.empty()) {
    if (lexicon) line_lexicon = lexiconForLine(*lexicon, source.text, phonePairsOf(corpus));
    if (!voice) {
      voice = makeVoice(options.voice, VoiceOptions{line_lexicon ? &*line_lexicon : nullptr, units.get(),
                                                    options.synthesis.selection, options.rate});
    }
    return voice->speak(source.text);
  }
  if (source.phones.empty()) return alignRecording(source);
  SpokenLine line;
  line.audio = readAudio(source.audio);
  line.labels = readLabels(source.phones);
  line.text = source.text;
  for (const LabelledWord& word : line.labels.words) {
    if (source.text.empty()) line.text += (line.text.empty() ? "" : " ") + word.text;
  }
  line.voice = "recorded:" + source.audio.filename().string();
  return line;
}

SungSource SynthJob::Data::soundOf(const LineSource& source) {
  if (!source.song.empty()) return singSong(source.song, lexicon ? &*lexicon : nullptr);
  SpokenLine line = speakOrRead(source);
  const CurveOptions& curves = options.synthesis.curves;
  if (!source.is_sung && !curves.ma.automatic && curves.alone != CurveStyle::kSing)
    return SungSource{std::move(line), {}, {}};
  SungSource heard = hearSong(std::move(line));
  if (source.audio.empty()) heard.warnings.clear();  // a voice of ours is not silent, clipped or off its text
  return heard;
}

/// Songs are made of curves, with consonants of the capture under them, unless a style was asked for.
SynthesisOptions SynthJob::Data::optionsFor(const LineSource& source) const {
  SynthesisOptions wanted = options.synthesis;
  if (source.is_sung && !wanted.curves.alone) {
    wanted.curves.alone = CurveStyle::kSing;
    wanted.curves.layered = options.backoff == BackoffKind::kVocal;
  }
  return wanted;
}

void SynthJob::Data::giveBackTakes() {
  if (units->index().phoneCount() <= kMostPhonesKept) return;
  units->forgetTakes();
#if defined(__GLIBC__)
  malloc_trim(0);  // small blocks are not returned to the system otherwise
#endif
}

PrincipalShapes SynthJob::Data::deformFace(const UtteranceAnimation& animation, const FaceMotion& motion,
                                           StageTimings& timing) const {
  return timed(timing.deform, [&] {
    const FaceMesh& mesh = face->mesh();
    const double bytes =
        static_cast<double>(motion.frameCount()) * static_cast<double>(mesh.vertices.size()) * sizeof(float);
    if (bytes > kMaxFaceAnimationBytes) {
      throw InputError(fmt::format(
          "the line lasts {:.0f} s: its face would take {:.0f} GB of memory; expected at most {:.0f} (split the line, "
          "or ask with -o for sound and motion alone)",
          animation.motion.duration(), bytes / 1e9, kMaxFaceAnimationBytes / 1e9));
    }
    std::vector<double> larynx;
    if (const AnimationCurve* curve = findCurve(animation.curves, "larynx"))
      larynx = sampleCurve(*curve, timesOf(animation.motion));
    const FaceAnimation moving = face->deformMoving(motion, animation.tongue, animation.motion.frame_rate_hz, larynx);
    return principalShapes(moving, mesh.vertices, mesh.metres_per_unit);
  });
}

std::string SynthJob::Data::ablationOf(const SynthesisRequest& request, const UtteranceAnimation& animation) const {
  const VocalStyle style = styleFor(request.options.curves, request.labels, request.tags);
  return ablationPage(
      animation.text, request.labels,
      ablateCurves(request.labels, request.tags, style, curve_model->poses(), timesOf(animation.motion)),
      animation.motion.frame_rate_hz);
}

void SynthJob::Data::writeOutputs(UtteranceAnimation& animation, const FaceMotion& motion, const std::string& glb,
                                  const std::string& ablation, const std::vector<OutputFile>& outputs) const {
  const auto write = [&](const OutputFile& output) {
    switch (output.kind) {
      case OutputKind::kSound:
        return writeWav(output.path, animation.audio);
      case OutputKind::kMotionC3d:
        return writeC3d(output.path, animation.motion);
      case OutputKind::kMotionCsv:
        return writeMotionCsv(output.path, animation.motion);
      case OutputKind::kFace:
        return writeFileAtomically(output.path, glb);
      case OutputKind::kCurves:
        return writeFileAtomically(output.path, curvesToJson(animation.curves));
      case OutputKind::kCurveKeysCsv:
        return writeFileAtomically(output.path, curveKeysToCsv(animation.curves));
      case OutputKind::kCurveFramesCsv:
        return writeFileAtomically(output.path, curveFramesToCsv(animation.curves, animation.motion.frame_rate_hz,
                                                                 animation.motion.frameCount()));
      case OutputKind::kPhones:
        return writeTextGrid(output.path, animation.labels);
      case OutputKind::kPage:
        return writeViewHtml(output.path, page_template,
                             {animation, glb, face->mesh(), face->name(), face->markerNames(), motion.markers()});
      case OutputKind::kAblation:
        return writeFileAtomically(output.path, ablation);
      case OutputKind::kReport:
        return writeReport(output.path, animation);
    }
  };
  // The report comes last, so that it can tell how long the others took.
  for (const bool report : {false, true}) {
    for (const OutputFile& output : outputs) {
      if ((output.kind == OutputKind::kReport) == report) timed(animation.timing_ms.write, [&] { write(output); });
    }
  }
}

SynthOutcome SynthJob::run(const LineSource& source, const std::vector<OutputFile>& outputs) {
  double speech_ms = 0;
  SungSource sound = timed(speech_ms, [&] { return data_->soundOf(source); });
  SpokenLine& line = sound.line;
  SynthOutcome outcome;
  if (!line.notice.empty()) outcome.notices.push_back(line.notice);
  outcome.notices.insert(outcome.notices.end(), sound.warnings.begin(), sound.warnings.end());

  const SynthesisRequest request{line.text,
                                 line.voice,
                                 std::move(line.labels),
                                 std::move(line.audio),
                                 data_->optionsFor(source),
                                 std::move(line.units),
                                 std::move(sound.tags)};
  UtteranceAnimation animation = synthesise(request, *data_->units);
  animation.corpus = data_->corpus.name;
  animation.warnings = outcome.notices;
  animation.timing_ms.speech = speech_ms;
  animation.timing_ms.load = std::exchange(data_->load_ms, 0.0);
  if (data_->options.backoff == BackoffKind::kNone && animation.style.empty())
    expectNoBackoff(animation, data_->corpus_path.string());

  FaceMotion face_motion;
  std::string glb;
  if (needsFace(outputs)) {
    data_->giveBackTakes();
    const ActorPose actor{data_->corpus.neutral_pose_mm, closedLipsMm(data_->corpus)};
    face_motion = timed(animation.timing_ms.retarget,
                        [&] { return data_->face->retarget(animation.motion, &actor, animation.lips); });
    const PrincipalShapes shapes = data_->deformFace(animation, face_motion, animation.timing_ms);
    glb = timed(animation.timing_ms.write, [&] { return glbBytes(data_->face->mesh(), shapes, data_->face->name()); });
  }
  std::string ablation;
  if (isAny(outputs, {OutputKind::kAblation})) ablation = data_->ablationOf(request, animation);
  data_->writeOutputs(animation, face_motion, glb, ablation, outputs);

  const StageTimings& timing = animation.timing_ms;
  outcome.duration = animation.motion.duration();
  outcome.unit_count = animation.units.size();
  outcome.backoff_count = static_cast<std::size_t>(std::count_if(
      animation.units.begin(), animation.units.end(), [](const PlacedUnit& unit) { return unit.is_backoff; }));
  outcome.real_time_factor =
      1e-3 * (timing.load + timing.selection + timing.motion + timing.retarget + timing.deform + timing.write) /
      std::max(outcome.duration, 1e-9);
  outcome.report_json = reportJson(animation);
  return outcome;
}

}  // namespace mouthpiece
