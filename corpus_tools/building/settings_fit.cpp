#include "corpus_tools/building/settings_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "base/errors.h"
#include "base/parallel_for.h"
#include "corpus_tools/building/settings_search.h"
#include "motion/resample.h"
#include "synthesis/curve_model.h"
#include "synthesis/synthesis.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostJudges = 16, kMostMaterial = 240;
constexpr std::size_t kMostSearched = 32;  ///< judges of contacts and costs, which are cheaper to make
constexpr std::array<double, 4> kDetailWithinMs{35, 50, 80, 120};
constexpr double kHalfBelieved = 20;  ///< takes of a corpus whose findings count half

/// What a line's movement is a sum of: its weights are what is learnt.
enum Part : Eigen::Index { kStill, kGain, kFirst, kOther, kSlow, kCaptured, kParts };
using Mixture = Eigen::Matrix<double, kParts, 1>;
using Gram = Eigen::Matrix<double, kParts, kParts>;

/// Sums over frames and lip coordinates of the products of parts, as they are and of their third differences.
struct Products {
  Gram values = Gram::Zero(), jerks = Gram::Zero();

  void add(const std::array<PositionMatrix, kParts>& parts) {
    const Eigen::Index frames = parts[0].rows();
    if (frames < 4) return;
    std::array<PositionMatrix, kParts> centred, jerk;
    for (std::size_t i = 0; i < kParts; ++i) {
      centred[i] = parts[i].rowwise() - parts[i].colwise().mean();
      jerk[i] = parts[i].bottomRows(frames - 3) - 3 * parts[i].middleRows(2, frames - 3) +
                3 * parts[i].middleRows(1, frames - 3) - parts[i].topRows(frames - 3);
    }
    for (std::size_t i = 0; i < kParts; ++i) {
      for (std::size_t j = 0; j < kParts; ++j) {
        values(signedIndex(i), signedIndex(j)) += centred[i].cwiseProduct(centred[j]).sum();
        jerks(signedIndex(i), signedIndex(j)) += jerk[i].cwiseProduct(jerk[j]).sum();
      }
    }
  }
};

/// How a mixture compares with the capture.
struct Reached {
  double error = 0;     ///< over the capture's own spread
  double variance = 0;  ///< ratios
  double jerk = 0;

  /// The error, and what the ratios lack to the band.
  [[nodiscard]] double score() const {
    constexpr double kBand = 0.12, kOutside = 20;
    const auto beyond = [](double ratio) { return std::max(0.0, std::abs(ratio - 1) - kBand); };
    return error + kOutside * (beyond(variance) * beyond(variance) + beyond(jerk) * beyond(jerk));
  }
};

Reached reached(const Products& products, Mixture mixture) {
  mixture(kCaptured) = 0;
  Mixture error = mixture;
  error(kCaptured) = -1;
  const double captured = std::max(1e-12, products.values(kCaptured, kCaptured));
  const double sharp = std::max(1e-12, products.jerks(kCaptured, kCaptured));
  return {std::sqrt(std::max(0.0, error.dot(products.values * error)) / captured),
          mixture.dot(products.values * mixture) / captured,
          std::sqrt(std::max(0.0, mixture.dot(products.jerks * mixture)) / sharp)};
}

struct Learnt {
  MotionSettings settings;
  double gain = 1;

  [[nodiscard]] Mixture mixture() const {
    Mixture mixture;
    mixture << 1, gain - 1, settings.first_detail, settings.other_detail, settings.slow_captured, 0;
    return mixture;
  }
};

/// Each weight up or down by a step that halves, while that lowers the score.
Learnt searched(const Products& products, Learnt start) {
  constexpr double kFirstStep = 0.32, kLastStep = 0.01, kLargestGain = 1.3;
  Learnt best = start;
  double least = reached(products, best.mixture()).score();
  const auto tryStep = [&](double Learnt::*gain, double MotionSettings::*setting, double step, double low,
                           double high) {
    Learnt next = best;
    double& value = gain != nullptr ? next.*gain : next.settings.*setting;
    value = std::clamp(value + step, low, high);
    const double score = reached(products, next.mixture()).score();
    if (!(score < least)) return false;
    best = next;
    least = score;
    return true;
  };
  for (double step = kFirstStep; step >= kLastStep;) {
    bool gained = false;
    for (const double sign : {1.0, -1.0}) {
      gained |= tryStep(&Learnt::gain, nullptr, sign * 0.5 * step, 1, kLargestGain);
      for (const MotionSetting& setting : kMotionSettings) {
        const bool is_share = setting.value == &MotionSettings::first_detail ||
                              setting.value == &MotionSettings::other_detail ||
                              setting.value == &MotionSettings::slow_captured;
        if (is_share) gained |= tryStep(nullptr, setting.value, sign * step, setting.least, setting.largest);
      }
    }
    if (!gained) step /= 2;
  }
  return best;
}

PositionMatrix lipsOf(const MotionClip& motion, const std::vector<Eigen::Index>& columns) {
  PositionMatrix lips(motion.positions_mm.rows(), std::ssize(columns));
  for (std::size_t i = 0; i < columns.size(); ++i) lips.col(signedIndex(i)) = motion.positions_mm.col(columns[i]);
  return lips;
}

CorpusTake loadedTake(const Corpus& corpus, std::size_t take) {
  CorpusTake loaded = corpus.takes[take];
  loaded.motion = motionOf(corpus, TakeIndex(take));
  return loaded;
}

/// Takes left out, and a corpus of others with a model that has not seen them.
class Trial {
 public:
  Trial(const Corpus& corpus, const TrajectoryFit& fit) {
    rest_.name = corpus.name;
    rest_.layout = corpus.layout;
    rest_.neutral_pose_mm = corpus.neutral_pose_mm;
    rest_.lattice_weights = corpus.lattice_weights;
    auto model = std::make_shared<TrajectoryModel>(*fit.judging);
    model->gain = 2;  // so that its part is what one more of it adds
    rest_.trajectory_model = model;
    const std::set<std::size_t> judges(fit.judges.begin(), fit.judges.end());
    const std::size_t material = corpus.takes.size() - judges.size();
    const std::size_t every = material / kMostMaterial + 1;
    for (std::size_t i = 0, n = 0; i < corpus.takes.size(); ++i) {
      if (!judges.contains(i) && n++ % every == 0) rest_.takes.push_back(loadedTake(corpus, i));
    }
    const std::size_t count = std::min(kMostSearched, fit.judges.size());
    for (std::size_t i = 0; i < count; ++i)
      judges_.push_back(loadedTake(corpus, fit.judges[i * fit.judges.size() / count]));
    for (CorpusTake& take : judges_) {
      constexpr double kLowestHz = 24, kHighestHz = 60;  // sharper than that nothing is judged
      const double rate = std::clamp(take.motion.frame_rate_hz, kLowestHz, kHighestHz);
      if (rate != take.motion.frame_rate_hz) take.motion = resampleClip(take.motion, rate);
    }
    database_.emplace(rest_);
    curves_.emplace(*database_);
  }

  /// From here on lines are made as a corpus with that mixture makes them.
  void use(const Learnt& learnt) {
    auto model = std::make_shared<TrajectoryModel>(*rest_.trajectory_model);
    model->gain = learnt.gain;
    rest_.trajectory_model = model;
    rest_.motion_settings = learnt.settings;
  }
  [[nodiscard]] std::size_t judgeCount() const { return judges_.size(); }
  [[nodiscard]] std::size_t mixtureJudgeCount() const { return std::min(kMostJudges, judges_.size()); }
  [[nodiscard]] const UnitDatabase& database() const { return *database_; }
  /// measure(take) of the judges first, first + 2, ...; nullopt where it throws InputError: a take whose phones the
  /// others lack, a layout without both lips and corners.
  template <typename Measure>
  [[nodiscard]] TakeMeasures measureEveryOther(std::size_t first, std::size_t jobs, const Measure& measure) const {
    TakeMeasures measures((judges_.size() - first + 1) / 2);
    parallelFor(measures.size(), jobs, [&](std::size_t i) {
      const std::size_t take = first + 2 * i;
      try {
        measures[i] = measureLips(judges_[take].motion, measure(take), judges_[take].labels, rest_.layout);
      } catch (const InputError&) {
        measures[i] = std::nullopt;
      }
    });
    return measures;
  }
  [[nodiscard]] SynthesisRequest requestFor(std::size_t take) const {
    const CorpusTake& judge = judges_[take];
    SynthesisRequest request{judge.text, "", judge.labels, {}, {}};
    request.options.frame_rate_hz = judge.motion.frame_rate_hz;
    request.options.selection.method = SelectionMethod::kViterbi;
    request.options.curves.model = &*curves_;
    return request;
  }

  /// For each of kDetailWithinMs.
  [[nodiscard]] std::vector<Products> products(std::size_t jobs) const {
    std::vector<std::array<Products, kDetailWithinMs.size()>> of_takes(mixtureJudgeCount());
    parallelFor(of_takes.size(), jobs, [&](std::size_t i) {
      const std::size_t judge = i * judges_.size() / of_takes.size();
      addTake(judge, of_takes[i]);
    });
    std::vector<Products> sums(kDetailWithinMs.size());
    for (const auto& own : of_takes) {
      for (std::size_t i = 0; i < sums.size(); ++i) {
        sums[i].values += own[i].values;
        sums[i].jerks += own[i].jerks;
      }
    }
    return sums;
  }

 private:
  void addTake(std::size_t judge, std::array<Products, kDetailWithinMs.size()>& products) const {
    const CorpusTake& take = judges_[judge];
    SynthesisRequest request = requestFor(judge);
    request.options.context.keep_contacts = false;
    try {
      request.units = selectUnits(take.labels, *database_, request.options.selection);
    } catch (const MissingPairError&) {
      return;
    }
    const auto frames = signedIndex(take.motion.frameCount());
    const std::vector<Eigen::Index>& columns = database_->lipColumns();
    const auto made = [&](const MotionSettings& settings, bool with_gain) -> PositionMatrix {
      request.options.context.settings = settings;
      request.options.context.restore_variance = with_gain;
      const PositionMatrix lips = lipsOf(synthesise(request, *database_).motion, columns);
      return lips.topRows(std::min(frames, lips.rows()));
    };
    constexpr MotionSettings kNothing{
        .detail_within_ms = kDetailWithinMs[0], .first_detail = 0, .other_detail = 0, .slow_captured = 0};
    std::array<PositionMatrix, kParts> parts;
    parts[kStill] = made(kNothing, false);
    parts[kGain] = made(kNothing, true) - parts[kStill];
    parts[kCaptured] = lipsOf(take.motion, columns).topRows(parts[kStill].rows());
    if (!parts[kCaptured].allFinite()) return;
    for (std::size_t i = 0; i < kDetailWithinMs.size(); ++i) {
      MotionSettings one = kNothing;
      one.detail_within_ms = kDetailWithinMs[i];
      const auto only = [&](double MotionSettings::*setting) -> PositionMatrix {
        MotionSettings settings = one;
        settings.*setting = 1;
        return made(settings, false) - parts[kStill];
      };
      parts[kFirst] = only(&MotionSettings::first_detail);
      parts[kOther] = only(&MotionSettings::other_detail);
      parts[kSlow] = only(&MotionSettings::slow_captured);
      products[i].add(parts);
    }
  }

  Corpus rest_;
  std::vector<CorpusTake> judges_;
  std::optional<UnitDatabase> database_;
  std::optional<CurveModel> curves_;  ///< learnt once for all lines
};

/// Lines with each way of keeping contacts; what is below them is made once.
class ContactTrial : public LipTrial {
 public:
  ContactTrial(const Trial& trial, std::size_t jobs) : trial_(trial), jobs_(jobs), lines_(trial.judgeCount()) {
    parallelFor(lines_.size(), jobs, [&](std::size_t take) {
      SynthesisRequest request = trial.requestFor(take);
      request.options.context.keep_contacts = false;
      try {
        request.units = selectUnits(request.labels, trial.database(), request.options.selection);
        MotionClip motion = synthesise(request, trial.database()).motion;
        lines_[take] = Line{std::move(request.labels), std::move(request.units), std::move(motion)};
      } catch (const InputError&) {
        lines_[take].reset();
      }
    });
  }

  [[nodiscard]] TakeMeasures measure(std::size_t first, const MotionSettings& settings) const {
    return trial_.measureEveryOther(first, jobs_, [&](std::size_t take) {
      if (!lines_[take]) throw InputError("found no fragments; expected a line");
      const Line& line = *lines_[take];
      MotionClip made = line.motion;
      std::vector<Seconds> times;
      for (std::size_t frame = 0; frame < made.frameCount(); ++frame) times.push_back(made.timeOf(FrameIndex(frame)));
      made.positions_mm = keepContacts(std::move(made.positions_mm), line.labels, trial_.database(), line.units, times,
                                       withinBounds(settings));
      return made;
    });
  }

  static MotionSettings withinBounds(MotionSettings settings) {
    for (const MotionSetting& setting : kMotionSettings)
      settings.*setting.value = std::clamp(settings.*setting.value, setting.least, setting.largest);
    return settings;
  }
  static std::vector<TunedField<MotionSettings>> fields() {
    std::vector<TunedField<MotionSettings>> fields;
    for (const MotionSetting& setting : std::span(kMotionSettings).subspan(kFirstContactSetting))
      fields.push_back({setting.name, [&setting](MotionSettings& of) -> double& { return of.*setting.value; }});
    return fields;
  }

 private:
  struct Line {
    SpeechLabels labels;
    std::vector<SelectedUnit> units;
    MotionClip motion;
  };
  const Trial& trial_;
  std::size_t jobs_;
  std::vector<std::optional<Line>> lines_;
};

/// Lines of the fragments that each set of costs selects.
class CostTrial : public LipTrial {
 public:
  CostTrial(const Trial& trial, std::size_t jobs) : trial_(trial), jobs_(jobs) {}

  [[nodiscard]] TakeMeasures measure(std::size_t first, const LatticeWeights& weights) const {
    return trial_.measureEveryOther(first, jobs_, [&](std::size_t take) {
      SynthesisRequest request = trial_.requestFor(take);
      request.options.selection.lattice = weights;
      return synthesise(request, trial_.database()).motion;
    });
  }

 private:
  const Trial& trial_;
  std::size_t jobs_;
};

/// How contacts are kept, and what selects fragments: where what is found on one half of the judges helps the other
/// half, too.
void learnContactsAndCosts(Corpus& corpus, Trial& trial, double believed, std::size_t jobs) {
  trial.use({corpus.motion_settings, corpus.trajectory_model->gain});
  const auto contacts = searchAndJudge<MotionSettings>(ContactTrial(trial, jobs), ContactTrial::fields(),
                                                       corpus.motion_settings, trial.judgeCount(), false, {});
  const MotionSettings found = ContactTrial::withinBounds(contacts.weights);
  for (const MotionSetting& setting : std::span(kMotionSettings).subspan(kFirstContactSetting)) {
    double& own = corpus.motion_settings.*setting.value;
    own = std::lerp(own, found.*setting.value, believed);
  }
  corpus.build_log["contact_settings"] = describeTuning(contacts);

  trial.use({corpus.motion_settings, corpus.trajectory_model->gain});
  const auto costs = searchAndJudge<LatticeWeights>(CostTrial(trial, jobs), tunedLatticeFields(),
                                                    corpus.lattice_weights, trial.judgeCount(), false, {}, 1);
  const std::span<double> weights = corpus.lattice_weights.values();
  LatticeWeights best = costs.weights;
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = std::lerp(weights[i], best.values()[i], believed);
  corpus.build_log["lattice_weights"] = describeTuning(costs);
}

std::string described(const Reached& reached) {
  return fmt::format("error {:.3f} of the capture's spread, variance {:.2f}, jerk {:.2f}", reached.error,
                     reached.variance, reached.jerk);
}

}  // namespace

void fitMotion(Corpus& corpus, const TrajectoryFitOptions& options) {
  corpus.motion_settings = {};
  corpus.lattice_weights = {};
  for (const char* key : {"motion_settings", "contact_settings", "lattice_weights", "sound_model"})
    corpus.build_log.erase(key);
  const TrajectoryFit fit = fitTrajectory(corpus, options);
  if (!fit.sound_account.empty()) corpus.build_log["sound_model"] = fit.sound_account;
  learnSettings(corpus, fit, corpus.takes.size(), options.jobs > 0 ? options.jobs : defaultThreadCount());
}

void learnSettings(Corpus& corpus, const TrajectoryFit& fit, std::size_t takes, std::size_t jobs) {
  corpus.trajectory_model = fit.model;
  if (fit.model == nullptr || fit.judges.empty()) return;
  Trial trial(corpus, fit);
  const std::vector<Products> products = trial.products(jobs);
  if (!(products.front().values(kCaptured, kCaptured) > 0)) return;

  const Learnt usual{corpus.motion_settings, fit.model->gain};
  Learnt best = usual;
  double least = std::numeric_limits<double>::infinity();
  Reached before, after;
  const double nearest = *std::min_element(kDetailWithinMs.begin(), kDetailWithinMs.end(), [&](double a, double b) {
    return std::abs(a - usual.settings.detail_within_ms) < std::abs(b - usual.settings.detail_within_ms);
  });
  for (std::size_t i = 0; i < products.size(); ++i) {
    Learnt start = usual;
    start.settings.detail_within_ms = kDetailWithinMs[i];
    const Learnt found = searched(products[i], start);
    const Reached own = reached(products[i], found.mixture());
    if (kDetailWithinMs[i] == nearest) before = reached(products[i], usual.mixture());
    if (!(own.score() < least)) continue;
    least = own.score();
    best = found;
    after = own;
  }
  const double believed = asReal(takes) / (asReal(takes) + kHalfBelieved);
  for (const MotionSetting& setting : std::span(kMotionSettings).first(kFirstContactSetting)) {
    const double usually = usual.settings.*setting.value;
    corpus.motion_settings.*setting.value = std::lerp(usually, best.settings.*setting.value, believed);
  }
  auto model = std::make_shared<TrajectoryModel>(*fit.model);
  model->gain = std::lerp(usual.gain, best.gain, believed);
  corpus.trajectory_model = model;
  learnContactsAndCosts(corpus, trial, believed, jobs);
  std::string account =
      fmt::format("learnt on {} takes left out, believed to {:.0f} %: ", trial.mixtureJudgeCount(), 100 * believed);
  for (const MotionSetting& setting : kMotionSettings)
    account += fmt::format("{} {:.3g}, ", setting.name, corpus.motion_settings.*setting.value);
  corpus.build_log["motion_settings"] = account + fmt::format("gain {:.3f}; {}; with the usual ones {}", model->gain,
                                                              described(after), described(before));
}

}  // namespace mouthpiece
