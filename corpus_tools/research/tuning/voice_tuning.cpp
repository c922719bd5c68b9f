// The tuning of the corpus voice's weights, of tuning.h.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "audio/pitch_track.h"
#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/parallel_for.h"
#include "corpus_tools/research/evaluation/evaluation.h"
#include "corpus_tools/research/tuning/tuning.h"
#include "synthesis/curve_model.h"
#include "synthesis/synthesis.h"
#include "units/selection/unit_database.h"
#include "voices/corpus_voice.h"

namespace mouthpiece {
namespace {

/// First what the sound is worth among the selection's join costs, which decides what there is to cut.
std::vector<TunedField<SoundCutWeights>> tunedVoiceFields() {
  std::vector<TunedField<SoundCutWeights>> fields;
  for (const SoundCutTerm& term : kSoundCutTerms)
    fields.push_back({term.name, [&term](SoundCutWeights& weights) -> double& { return weights.*term.weight; }});
  std::rotate(fields.begin(), fields.end() - 1, fields.end());
  return fields;
}

/// How a sound changes from 20 ms before a moment to 20 ms after it.
struct SoundChange {
  double spectral = 0, level_db = 0;
  std::optional<double> octaves;  ///< where both are voiced
};

class ChangeMeter {
 public:
  explicit ChangeMeter(const AudioClip& audio) : frames_(spectralFrames(audio)), pitch_(trackPitch(audio)) {}

  [[nodiscard]] SoundChange at(Seconds time) const {
    constexpr Seconds kAside = 0.020;
    const Eigen::Index before = frames_.rowAt(time - kAside), after = frames_.rowAt(time + kAside);
    SoundChange change;
    change.spectral = (frames_.mfcc.row(after) - frames_.mfcc.row(before)).tail<12>().norm();
    change.level_db = std::abs(frames_.level_db(after) - frames_.level_db(before));
    const double hz_before = pitch_.hzAt(time - kAside), hz_after = pitch_.hzAt(time + kAside);
    if (hz_before > 0 && hz_after > 0) change.octaves = std::abs(std::log2(hz_after / hz_before));
    return change;
  }

 private:
  SpectralFrames frames_;
  PitchTrack pitch_;
};

/// Means over the recordings' own speech: what a change at a join is told in.
class UsualChange {
 public:
  explicit UsualChange(const std::vector<CorpusTake>& takes) {
    constexpr Seconds kStep = 0.020;
    std::size_t count = 0, voiced = 0;
    for (const CorpusTake& take : takes) {
      const ChangeMeter meter(take.audio);
      for (const LabelledPhone& phone : take.labels.phones) {
        if (phone.phone == Phone::kSil) continue;
        for (Seconds time = phone.span.start; time < phone.span.end; time += kStep) {
          const SoundChange change = meter.at(time);
          usual_.spectral += change.spectral;
          usual_.level_db += change.level_db;
          ++count;
          if (change.octaves) octaves_ += *change.octaves;
          if (change.octaves) ++voiced;
        }
      }
    }
    usual_.spectral = meanOf(usual_.spectral, count);
    usual_.level_db = meanOf(usual_.level_db, count);
    octaves_ = meanOf(octaves_, voiced);
  }

  /// 1 where a join changes as recordings do.
  [[nodiscard]] double times(const SoundChange& change) const {
    double sum = change.spectral / usual_.spectral + change.level_db / usual_.level_db;
    if (!change.octaves) return sum / 2;
    return (sum + *change.octaves / octaves_) / 3;
  }

 private:
  static double meanOf(double sum, std::size_t count) {
    constexpr double kLeast = 1e-9;  // a sound without any change has no joins worth telling, either
    return count > 0 ? std::max(kLeast, sum / asReal(count)) : 1.0;
  }

  SoundChange usual_;
  double octaves_ = 0;
};

/// "Reads" what it was given.
class LabelReader : public Voice {
 public:
  explicit LabelReader(const SpeechLabels*& labels) : labels_(labels) {}
  SpokenLine speak(std::string_view text) override {
    SpokenLine line;
    line.labels = *labels_;
    line.text = text;
    return line;
  }

 private:
  const SpeechLabels*& labels_;
};

/// Takes held out and what speaks them: stays where it is, since its parts refer to each other.
class VoiceFold {
 public:
  VoiceFold(SplitTakes parts, const UsualChange& usual)
      : split_(std::move(parts)),
        database_(split_.rest),
        voice_(std::make_unique<LabelReader>(read_), database_),
        usual_(usual) {
    split_.held = atOfferedRates(std::move(split_.held));
  }

  /// nullopt for a take whose phones the others lack, whatever the weights are.
  std::vector<std::optional<VoiceScore>> measure(const SoundCutWeights& weights) {
    voice_.setCutWeights(weights);
    std::vector<std::optional<VoiceScore>> scores;
    for (const CorpusTake& take : split_.held) scores.push_back(measureTake(take));
    return scores;
  }

 private:
  std::optional<VoiceScore> measureTake(const CorpusTake& take) {
    read_ = &take.labels;
    try {
      const SpokenLine line = voice_.speak(take.text);
      return VoiceScore{roughness(line), lipError(take, line.units)};
    } catch (const InputError&) {
      return std::nullopt;
    }
  }

  [[nodiscard]] double roughness(const SpokenLine& line) const {
    const ChangeMeter meter(line.audio);
    double sum = 0;
    for (const SelectedUnit& unit : line.units) {
      if (unit.sound.duration() > 0 && unit.sound.start > 0) sum += usual_.times(meter.at(unit.sound.start));
    }
    return sum / asReal(std::max<std::size_t>(1, line.labels.words.size()));
  }

  [[nodiscard]] double lipError(const CorpusTake& take, std::vector<SelectedUnit> units) const {
    for (SelectedUnit& unit : units) unit.sound = {};  // of the corpus voice's clock, not the take's
    SynthesisRequest request{take.text, "capture", take.labels, {}, {}, std::move(units)};
    request.options.frame_rate_hz = take.motion.frame_rate_hz;
    request.options.selection.method = SelectionMethod::kViterbi;
    request.options.curves.model = &curves_;
    const UtteranceAnimation made = synthesise(request, database_);
    return measureLips(take.motion, made.motion, take.labels, split_.rest.layout).lipRms();
  }

  SplitTakes split_;
  UnitDatabase database_;
  CurveModel curves_{database_};
  const SpeechLabels* read_ = nullptr;
  CorpusVoice voice_;
  const UsualChange& usual_;
};

using Scores = std::vector<std::optional<VoiceScore>>;

class VoiceTrial {
 public:
  using Score = VoiceScore;

  VoiceTrial(const Corpus& takes, const TuningOptions& options)
      : usual_(takes.takes), jobs_(options.jobs > 0 ? options.jobs : defaultThreadCount()) {
    for (std::size_t fold = 0; fold < options.folds; ++fold)
      folds_.push_back(std::make_unique<VoiceFold>(splitTakes(takes, options.folds, fold), usual_));
  }

  [[nodiscard]] Scores measure(std::size_t first, const SoundCutWeights& weights) const {
    std::vector<Scores> of_fold((folds_.size() - first + 1) / 2);
    parallelFor(of_fold.size(), jobs_, [&](std::size_t i) { of_fold[i] = folds_[first + 2 * i]->measure(weights); });
    Scores scores;
    for (const Scores& part : of_fold) scores.insert(scores.end(), part.begin(), part.end());
    return scores;
  }

  static VoiceScore scoreOf(const Scores& scores) {
    VoiceScore sum;
    std::size_t count = 0;
    for (const auto& score : scores) {
      if (!score) continue;
      sum.joins += score->joins;
      sum.lips_mm += score->lips_mm;
      ++count;
    }
    if (count == 0) throw InputError("found no take that the others can speak; expected takes with phones in common");
    return {sum.joins / asReal(count), sum.lips_mm / asReal(count)};
  }

  /// Of the mean difference, take by take.
  static double errorOfDifference(const Scores& before, const Scores& after) {
    double sum = 0, squares = 0, count = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (!before[i] || !after[i]) continue;
      const double difference = after[i]->sum() - before[i]->sum();
      sum += difference;
      squares += difference * difference;
      ++count;
    }
    if (count < 2) return INFINITY;
    return std::sqrt(std::max(0.0, squares - sum * sum / count) / (count * (count - 1)));
  }

 private:
  UsualChange usual_;
  std::vector<std::unique_ptr<VoiceFold>> folds_;
  std::size_t jobs_;
};

void expectVoice(const Corpus& corpus, const TuningOptions& options) {
  constexpr std::size_t kLeastFolds = 2;
  if (corpus.trajectory_model == nullptr)
    throw InputError(corpus.name, "", "has no trajectory model; expected one, with which the weights are kept");
  for (const CorpusTake& take : corpus.takes) {
    if (take.audio.samples.empty())
      throw InputError(corpus.name, "take " + take.name, "found no sound; expected a recording to speak with");
  }
  expectFolds(corpus.takes.size(), options, kLeastFolds);
}

}  // namespace

TunedVoice tuneCorpusVoice(const Corpus& corpus, const TuningOptions& options, const TuningProgress& progress) {
  expectVoice(corpus, options);
  const Corpus development = evenlySpacedTakes(corpus, options.most_takes);
  const VoiceTrial trial(development, options);
  return searchAndJudge<SoundCutWeights>(trial, tunedVoiceFields(), corpus.sound_cut_weights, development.takes.size(),
                                         options.always, progress);
}

std::string describeTuning(const TunedVoice& tuned) {
  return fmt::format(
      "{}: {} settings tried on {} takes, score {:.3f} -> {:.3f}; judged on {} others, joins {:.3f} -> {:.3f} and lips "
      "{:.3f} -> {:.3f} mm (standard error of the difference of the sum {:.3f}); best found: {}",
      tuned.taken ? "learnt" : "kept as they were", tuned.settings, tuned.search_takes, tuned.search_before,
      tuned.search_after, tuned.judge_takes, tuned.judge_before.joins, tuned.judge_after.joins,
      tuned.judge_before.lips_mm, tuned.judge_after.lips_mm, tuned.judge_error,
      tuned.changes.empty() ? "no change" : tuned.changes);
}

void storeTuning(Corpus& corpus, const TunedVoice& tuned) {
  corpus.sound_cut_weights = tuned.weights;
  corpus.build_log["sound_cut_weights"] = describeTuning(tuned);
}

}  // namespace mouthpiece
