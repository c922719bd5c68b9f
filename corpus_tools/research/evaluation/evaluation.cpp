#include "corpus_tools/research/evaluation/evaluation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "base/errors.h"
#include "base/statistics.h"
#include "corpus_tools/building/corpus_adapting.h"
#include "corpus_tools/building/settings_fit.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"
#include "motion/lip_gauge.h"
#include "motion/resample.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

/// The frame rates that the synthesis offers.
constexpr double kLowestRateHz = 24, kHighestRateHz = 240;

/// NaN of nothing.
double ratioOf(std::size_t part, std::size_t whole) { return whole > 0 ? asReal(part) / asReal(whole) : std::nan(""); }

double meanOf(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? std::nan("") : sum / asReal(values.size());
}

double shareOver(const std::vector<double>& values, const std::vector<double>& limits) {
  std::size_t over = 0;
  for (std::size_t i = 0; i < values.size(); ++i) over += values[i] > limits[i] ? 1U : 0U;
  return ratioOf(over, values.size());
}

template <typename T>
void append(std::vector<T>& values, const std::vector<T>& more) {
  values.insert(values.end(), more.begin(), more.end());
}

LipCurves curvesOf(const MotionClip& motion, const MarkerLayout& layout) {
  const LipGauge gauge = LipGauge::whole(layout);
  const auto curve = [&](LipGauge::Measure measure) {
    const std::vector<double> values = gauge.overFrames(measure, motion.positions_mm);
    return std::vector<float>(values.begin(), values.end());
  };
  return {curve(&LipGauge::opening), curve(&LipGauge::width), curve(&LipGauge::protrusion), {}};
}

EvaluationRow measureMethod(const EvaluationMethod& method, const std::vector<CorpusTake>& captured,
                            const MarkerLayout& layout, const EvaluationOptions& options,
                            const std::function<void()>& take_done) {
  EvaluationRow row;
  row.method = method.name;
  for (const CorpusTake& take : captured) {
    const std::size_t joins_before = row.join_times.size();
    const MotionClip made = method.animate(take, row);
    row.takes.push_back(measureLips(take.motion, made, take.labels, layout,
                                    options.stretches ? options.stretches(take) : MeasuredStretches()));
    row.lips += row.takes.back();
    if (options.keep_curves) {
      row.curves.push_back(curvesOf(made, layout));
      row.curves.back().joins.assign(row.join_times.begin() + signedIndex(joins_before), row.join_times.end());
    }
    take_done();
  }
  return row;
}

/// As they are compared: the truth in place of the capture where it is known, at a rate that the synthesis offers.
std::vector<CorpusTake> comparableTakes(std::vector<CorpusTake> takes, const EvaluationOptions& options) {
  for (CorpusTake& take : takes) {
    const auto known = options.truth.find(take.name);
    if (known != options.truth.end()) take.motion = known->second;
  }
  return atOfferedRates(std::move(takes));
}

/// Fisher-Yates by hand: std::shuffle differs between standard libraries.
std::vector<std::size_t> shuffledIndices(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::size_t> order(count);
  for (std::size_t i = 0; i < count; ++i) order[i] = i;
  for (std::size_t i = 0; i < count; ++i) std::swap(order[i], order[i + random() % (count - i)]);
  return order;
}

Corpus adaptedInMemory(const Corpus& large, const Corpus& own) {
  Corpus adapted = adaptCorpus(large, own);
  for (std::size_t i = 0; i < adapted.takes.size(); ++i) adapted.takes[i].motion = motionOf(adapted, TakeIndex(i));
  adapted.take_source = nullptr;
  return adapted;
}

}  // namespace

SplitTakes splitTakes(const Corpus& corpus, std::size_t folds, std::size_t fold) {
  SplitTakes split{{corpus.name,
                    corpus.layout,
                    corpus.neutral_pose_mm,
                    {},
                    corpus.build_log,
                    nullptr,
                    nullptr,
                    corpus.lattice_weights,
                    corpus.sound_cut_weights,
                    {},
                    {}},
                   {}};
  for (std::size_t i = 0; i < corpus.takes.size(); ++i)
    (i % folds == fold ? split.held : split.rest.takes).push_back(corpus.takes[i]);
  fitMotion(split.rest);
  return split;
}

Corpus evenlySpacedTakes(const Corpus& corpus, std::size_t most) {
  if (corpus.takes.size() <= most) return corpus;
  Corpus part = corpus;
  part.takes.clear();
  part.viseme_poses.clear();
  for (std::size_t i = 0; i < most; ++i) part.takes.push_back(corpus.takes[i * corpus.takes.size() / most]);
  return part;
}

std::vector<CorpusTake> atOfferedRates(std::vector<CorpusTake> takes) {
  for (CorpusTake& take : takes) {
    const double rate = std::clamp(take.motion.frame_rate_hz, kLowestRateHz, kHighestRateHz);
    if (rate != take.motion.frame_rate_hz) take.motion = resampleClip(take.motion, rate);
  }
  return takes;
}

Evaluation evaluateCorpus(const Corpus& corpus, const std::vector<CorpusTake>& captured,
                          const EvaluationMethods& methods, const EvaluationOptions& options) {
  if (captured.empty()) throw InputError(corpus.name, "", "no take to compare with");
  if (corpus.takes.empty()) throw InputError(corpus.name, "", "has no takes; expected some to speak with");
  const std::vector<CorpusTake> comparable = comparableTakes(captured, options);
  const UnitDatabase database(corpus);
  const std::vector<EvaluationMethod> rows = methods(corpus, database);
  Evaluation evaluation{corpus.name, {}, {}};
  for (const CorpusTake& take : comparable) {
    evaluation.takes.push_back(take.name);
    if (!options.keep_curves) continue;
    evaluation.compared.push_back(
        {take.name, take.text, take.labels, take.motion.frame_rate_hz, curvesOf(take.motion, corpus.layout)});
  }
  std::size_t done = 0;
  for (const EvaluationMethod& method : rows) {
    evaluation.rows.push_back(measureMethod(method, comparable, corpus.layout, options, [&] {
      if (options.progress) options.progress(++done, rows.size() * comparable.size());
    }));
  }
  return evaluation;
}

Evaluation crossValidate(const Corpus& corpus, std::size_t folds, const EvaluationMethods& methods,
                         const EvaluationOptions& options) {
  if (folds < 2 || folds > corpus.takes.size()) {
    throw InputError("folds", "",
                     fmt::format("found {}; expected 2 to {}, the number of takes", folds, corpus.takes.size()));
  }
  Evaluation whole{corpus.name, {}, {}};
  for (std::size_t fold = 0; fold < folds; ++fold) {
    const SplitTakes split = splitTakes(corpus, folds, fold);
    EvaluationOptions of_fold = options;
    of_fold.progress = [&](std::size_t done, std::size_t total) {
      if (options.progress) options.progress(fold * total + done, folds * total);
    };
    whole += evaluateCorpus(split.rest, split.held, methods, of_fold);
  }
  return whole;
}

Evaluation learningCurve(const Corpus& corpus, const std::vector<std::size_t>& sizes, const EvaluationMethods& methods,
                         const EvaluationOptions& options) {
  constexpr std::size_t kTestEvery = 5;
  if (corpus.takes.size() < 2) throw InputError(corpus.name, "", "has one take; expected at least two");
  const SplitTakes split = splitTakes(corpus, std::min(kTestEvery, corpus.takes.size()), 0);
  const std::vector<std::size_t> order = shuffledIndices(split.rest.takes.size(), options.draw);
  Evaluation curve{corpus.name, {}, {}};
  const std::size_t steps = options.adapted_from == nullptr ? sizes.size() : 1 + 2 * sizes.size();
  std::size_t step = 0;
  const auto add = [&](const Corpus& part, const std::string& name) {
    EvaluationOptions of_size = options;
    of_size.progress = [&](std::size_t done, std::size_t total) {
      if (options.progress) options.progress(step * total + done, steps * total);
    };
    Evaluation evaluated = evaluateCorpus(part, split.held, methods, of_size);
    for (EvaluationRow& row : evaluated.rows) {
      row.method = fmt::format("{}: {}", name, row.method);
      curve.rows.push_back(std::move(row));
    }
    curve.takes = evaluated.takes;
    curve.compared = evaluated.compared;
    ++step;
  };
  Corpus part = split.rest;
  part.takes.clear();
  if (options.adapted_from != nullptr) add(adaptedInMemory(*options.adapted_from, part), options.adapted_from->name);
  for (const std::size_t size : sizes) {
    if (size == 0 || size > order.size()) {
      throw InputError("learning curve", "", fmt::format("found {} takes; expected 1 to {}", size, order.size()));
    }
    part = split.rest;
    part.takes.clear();
    for (std::size_t i = 0; i < size; ++i) part.takes.push_back(split.rest.takes[order[i]]);
    fitMotion(part);
    add(part, fmt::format("{:>4}", size));
    if (options.adapted_from != nullptr)
      add(adaptedInMemory(*options.adapted_from, part), fmt::format("{:>4} adapted", size));
  }
  return curve;
}

EvaluationRow& EvaluationRow::operator+=(const EvaluationRow& other) {
  lips += other.lips;
  append(takes, other.takes);
  append(curves, other.curves);
  phones += other.phones;
  units += other.units;
  pairs += other.pairs;
  backoff_pairs += other.backoff_pairs;
  append(join_times, other.join_times);
  append(join_jumps_mm, other.join_jumps_mm);
  append(join_limits_mm, other.join_limits_mm);
  append(velocity_jumps_mm_s, other.velocity_jumps_mm_s);
  append(velocity_mismatches_mm_s, other.velocity_mismatches_mm_s);
  append(velocity_limits_mm_s, other.velocity_limits_mm_s);
  append(captured_velocity_jumps_mm_s, other.captured_velocity_jumps_mm_s);
  append(added_velocity_jumps_mm_s, other.added_velocity_jumps_mm_s);
  return *this;
}

Evaluation& Evaluation::operator+=(const Evaluation& other) {
  append(takes, other.takes);
  append(compared, other.compared);
  if (rows.empty()) {
    rows = other.rows;
    return *this;
  }
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] += other.rows[i];
  return *this;
}

double EvaluationRow::unitsPerPhone() const { return ratioOf(units, phones); }

double EvaluationRow::backoffShare() const { return ratioOf(backoff_pairs, pairs); }

double EvaluationRow::phonesPerUnit() const { return ratioOf(phones, units); }

double EvaluationRow::joinJump95() const { return quantile(join_jumps_mm, 0.95); }

double EvaluationRow::usualStep() const { return meanOf(join_limits_mm); }

double EvaluationRow::joinsOverLimit() const { return shareOver(join_jumps_mm, join_limits_mm); }

double EvaluationRow::meanVelocityJump() const { return meanOf(velocity_jumps_mm_s); }

double EvaluationRow::meanVelocityMismatch() const { return meanOf(velocity_mismatches_mm_s); }

double EvaluationRow::meanCapturedVelocityJump() const { return meanOf(captured_velocity_jumps_mm_s); }

double EvaluationRow::meanAddedVelocityJump() const { return meanOf(added_velocity_jumps_mm_s); }

double EvaluationRow::velocitiesOverLimit() const { return shareOver(velocity_jumps_mm_s, velocity_limits_mm_s); }

std::vector<CorpusTake> holdOut(Corpus& corpus, double share, std::uint64_t seed) {
  if (!(share > 0 && share < 1)) {
    throw InputError("held-out share", "", fmt::format("found {}; expected a share between 0 and 1", share));
  }
  const std::size_t count = corpus.takes.size();
  if (count < 2) throw InputError(corpus.name, "", fmt::format("has {} take; expected at least two", count));
  const auto wanted = unsignedIndex(std::lround(share * asReal(count)));
  const std::size_t held = std::clamp<std::size_t>(wanted, 1, count - 1);
  const std::vector<std::size_t> order = shuffledIndices(count, seed);
  std::vector<bool> is_held(count, false);
  for (std::size_t i = 0; i < held; ++i) is_held[order[i]] = true;
  std::vector<CorpusTake> taken, kept;
  for (std::size_t i = 0; i < count; ++i) (is_held[i] ? taken : kept).push_back(std::move(corpus.takes[i]));
  corpus.takes = std::move(kept);
  corpus.viseme_poses.clear();
  if (corpus.trajectory_model != nullptr) fitMotion(corpus);
  return taken;
}

}  // namespace mouthpiece
