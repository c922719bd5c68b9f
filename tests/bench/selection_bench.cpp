// Finding units: the suffix array beside a naive search, greedy beside viterbi, and the whole synthesis of a line.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <random>

#include "motion/marker_layout.h"
#include "phonetics/labels/labels_builder.h"
#include "support/phone_index.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {
namespace {

using Takes = std::vector<std::vector<Phone>>;

/// Sentences of 30 phones from a vocabulary of 200 words, so that long runs repeat as they do in speech.
Takes spokenTakes(std::size_t count) {
  std::mt19937_64 random(1);
  std::vector<std::vector<Phone>> words(200);
  for (auto& word : words) {
    const std::size_t length = 1 + random() % 5;
    for (std::size_t i = 0; i < length; ++i) word.push_back(static_cast<Phone>(1 + random() % (kPhoneCount - 1)));
  }
  Takes takes(count);
  for (auto& take : takes) {
    take.push_back(Phone::kSil);
    while (take.size() < 30) {
      const auto& word = words[random() % words.size()];
      take.insert(take.end(), word.begin(), word.end());
    }
    take.push_back(Phone::kSil);
  }
  return takes;
}

LongestMatch longestByLooking(const Takes& takes, std::span<const Phone> phones) {
  LongestMatch match;
  for (std::size_t take = 0; take < takes.size(); ++take) {
    for (std::size_t at = 0; at < takes[take].size(); ++at) {
      std::size_t length = 0;
      while (length < phones.size() && at + length < takes[take].size() && takes[take][at + length] == phones[length])
        ++length;
      if (length < 2 || length < match.length) continue;
      if (length > match.length) match = {length, {}};
      match.places.push_back({TakeIndex(take), PhoneIndex(at)});
    }
  }
  return match;
}

double secondsOf(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Longest matches at every phone of ten new sentences.
void longestMatch(benchmark::State& state) {
  const Takes takes = spokenTakes(static_cast<std::size_t>(state.range(0)));
  const PhoneSpanIndex index = samples::phoneIndexOf(takes);
  Takes lines = spokenTakes(static_cast<std::size_t>(state.range(0)) + 10);
  lines.erase(lines.begin(), lines.end() - 10);
  const auto searchAll = [&](const auto& search) {
    for (const auto& line : lines) {
      for (std::size_t i = 0; i + 1 < line.size(); ++i) benchmark::DoNotOptimize(search(std::span(line).subspan(i)));
    }
  };
  double naive_s = 0;
  double index_s = 0;
  for (auto _ : state) {
    const double own =
        secondsOf([&] { searchAll([&](std::span<const Phone> phones) { return index.longestMatch(phones); }); });
    index_s += own;
    state.SetIterationTime(own);
    naive_s +=
        secondsOf([&] { searchAll([&](std::span<const Phone> phones) { return longestByLooking(takes, phones); }); });
  }
  state.counters["times_naive"] = naive_s / index_s;
}
BENCHMARK(longestMatch)->Arg(55)->Arg(300)->Arg(5000)->UseManualTime()->Unit(benchmark::kMicrosecond);

void buildIndex(benchmark::State& state) {
  const Takes takes = spokenTakes(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(samples::phoneIndexOf(takes).phoneCount());
}
BENCHMARK(buildIndex)->Arg(55)->Arg(300)->Arg(5000)->Unit(benchmark::kMillisecond);

/// 66 markers at 120 Hz whose motion is smooth and differs from take to take.
Corpus movingCorpus(const Takes& takes) {
  std::mt19937_64 random(2);
  Corpus corpus;
  corpus.name = "bench";
  corpus.layout = defaultLayout();
  const auto columns = static_cast<Eigen::Index>(3 * corpus.layout.markers.size());
  corpus.neutral_pose_mm = MarkerPositions::Zero(columns / 3, 3);
  for (const auto& phones : takes) {
    CorpusTake& take = corpus.takes.emplace_back();
    take.name = "take" + std::to_string(corpus.takes.size());
    std::vector<PhoneSegment> segments;
    double time = 0;
    for (const Phone phone : phones) {
      const double duration = 0.06 + 0.0001 * static_cast<double>(random() % 800);
      segments.push_back({.phone = phone, .span = {time, time + duration}, .word = 0});
      time += duration;
    }
    take.labels = buildSpeechLabels(std::move(segments), std::vector<std::string>{"word"}, time);
    take.motion = {120, corpus.layout.markerNames(), {}};
    take.motion.positions_mm.resize(static_cast<Eigen::Index>(time * 120) + 2, columns);
    const double phase = static_cast<double>(random() % 100);
    for (Eigen::Index row = 0; row < take.motion.positions_mm.rows(); ++row) {
      for (Eigen::Index column = 0; column < columns; ++column) {
        take.motion.positions_mm(row, column) =
            5 * std::sin(phase + 0.15 * static_cast<double>(row) + 0.05 * static_cast<double>(column));
      }
    }
  }
  return corpus;
}

void synthesiseLine(benchmark::State& state, SelectionMethod method) {
  const Takes takes = spokenTakes(66);
  const Corpus corpus = movingCorpus(Takes(takes.begin(), takes.begin() + 55));
  const Corpus lines = movingCorpus(Takes(takes.begin() + 55, takes.end()));
  const UnitDatabase database(corpus);
  SynthesisRequest request;
  request.options.selection.method = method;
  StageTimings sum;
  double spoken_s = 0;
  std::size_t line = 0;
  for (auto _ : state) {
    request.labels = lines.takes[line++ % lines.takes.size()].labels;
    const UtteranceAnimation animation = synthesise(request, database);
    sum.selection += animation.timing_ms.selection;
    sum.motion += animation.timing_ms.motion;
    spoken_s += animation.motion.duration();
  }
  const auto count = static_cast<double>(state.iterations());
  state.counters["selection_ms"] = sum.selection / count;
  state.counters["motion_ms"] = sum.motion / count;
  state.counters["real_time_factor"] = (sum.selection + sum.motion) / 1000 / spoken_s;
}
BENCHMARK_CAPTURE(synthesiseLine, greedy, SelectionMethod::kGreedy)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(synthesiseLine, viterbi, SelectionMethod::kViterbi)->Unit(benchmark::kMillisecond);

/// Shapes of any take, and its motion at 25 Hz: as a corpus file gives them, when they are asked for.
class RandomShapes : public TakeSource {
 public:
  explicit RandomShapes(const Corpus& corpus) : names_(corpus.layout.markerNames()) {
    for (const CorpusTake& take : corpus.takes) {
      phones_.push_back(static_cast<Eigen::Index>(take.labels.phones.size()));
      durations_.push_back(take.labels.duration());
    }
  }
  [[nodiscard]] MotionClip load(TakeIndex take) const override {
    MotionClip clip{25, names_, {}};
    const double phase = static_cast<double>(take.value % 100);
    clip.positions_mm = Eigen::MatrixXd::NullaryExpr(
        static_cast<Eigen::Index>(durations_[take.value] * 25) + 2, static_cast<Eigen::Index>(3 * names_.size()),
        [&](Eigen::Index row, Eigen::Index column) {
          return 5 * std::sin(phase + 0.7 * static_cast<double>(row) + 0.05 * static_cast<double>(column));
        });
    return clip;
  }
  [[nodiscard]] AudioClip loadAudio(TakeIndex /*take*/) const override { return {}; }
  [[nodiscard]] PhoneShapes loadShapes(TakeIndex take) const override {
    std::mt19937 random(static_cast<unsigned>(take.value));
    std::normal_distribution<float> mm(0, 2);
    const auto rows = phones_[take.value];
    const Eigen::Index columns = PhoneShapes::kPoints * PhoneShapes::kMostComponents;
    PhoneShapes shapes;
    shapes.predicted = PhoneShapes::Matrix::NullaryExpr(rows, columns, [&] { return mm(random); });
    shapes.captured =
        shapes.predicted + 0.5F * PhoneShapes::Matrix::NullaryExpr(rows, columns, [&] { return mm(random); });
    shapes.tightest_mm.assign(static_cast<std::size_t>(rows), 1);
    return shapes;
  }

 private:
  std::vector<std::string> names_;
  std::vector<Eigen::Index> phones_;
  std::vector<double> durations_;
};

/// `count` takes of 3 s without motion; 12,000 are ten hours.
Corpus shapedCorpus(std::size_t count) {
  std::mt19937_64 random(3);
  Corpus corpus;
  corpus.name = "bench";
  corpus.layout = defaultLayout();
  corpus.neutral_pose_mm = MarkerPositions::Zero(static_cast<Eigen::Index>(corpus.layout.markers.size()), 3);
  for (const auto& phones : spokenTakes(count)) {
    std::vector<PhoneSegment> segments;
    double time = 0;
    for (const Phone phone : phones) {
      const double duration = 0.06 + 0.0001 * static_cast<double>(random() % 800);
      segments.push_back({.phone = phone, .span = {time, time + duration}, .word = 0});
      time += duration;
    }
    CorpusTake& take = corpus.takes.emplace_back();
    take.labels = buildSpeechLabels(std::move(segments), std::vector<std::string>{"word"}, time);
  }
  auto model = std::make_shared<TrajectoryModel>();
  const Eigen::Index components = PhoneShapes::kMostComponents;
  const Eigen::Index columns = corpus.neutral_pose_mm.size();
  model->analysis = Eigen::MatrixXd::Zero(columns, components);
  model->shapes = Eigen::MatrixXd::Zero(components, columns);
  model->level = Eigen::RowVectorXd::Zero(components);
  model->dynamics.assign(static_cast<std::size_t>(components), {});
  corpus.trajectory_model = std::move(model);
  corpus.take_source = std::make_shared<RandomShapes>(corpus);
  return corpus;
}

/// What this process holds, MiB.
double residentMiB() {
  std::ifstream statm("/proc/self/statm");
  double all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// A line of 13 s (four takes that the corpus does not hold), against the size of the corpus. The first line loads
/// shapes or motion and is not counted.
void selectLine(benchmark::State& state, SelectionMethod method) {
  const auto count = static_cast<std::size_t>(state.range(0));
  Corpus corpus = shapedCorpus(count + 4);
  SpeechLabels line = corpus.takes.back().labels;
  for (std::size_t more = count; more < count + 3; ++more) appendSpeechLabels(line, corpus.takes[more].labels);
  corpus.takes.resize(count);
  const UnitDatabase database(corpus);
  SelectionOptions options;
  options.method = method;
  benchmark::DoNotOptimize(selectUnits(line, database, options));
  for (auto _ : state) benchmark::DoNotOptimize(selectUnits(line, database, options));
  state.counters["line_s"] = line.duration();
  state.counters["corpus_h"] = static_cast<double>(count) * 3 / 3600;
  state.counters["resident_MiB"] = residentMiB();
}
BENCHMARK_CAPTURE(selectLine, greedy, SelectionMethod::kGreedy)
    ->Arg(300)
    ->Arg(3000)
    ->Arg(12000)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(selectLine, viterbi, SelectionMethod::kViterbi)
    ->Arg(300)
    ->Arg(3000)
    ->Arg(12000)
    ->Unit(benchmark::kMillisecond);

/// A corpus file of 55 sentences read from disk as `synth` does it, motion when it is asked for, beside all at once.
void readCorpusFile(benchmark::State& state) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("bench." + std::to_string(::getpid()) + ".corpus");
  writeCorpus(path, movingCorpus(spokenTakes(55)));
  double all_s = 0;
  double own_s = 0;
  for (auto _ : state) {
    const double own =
        secondsOf([&] { benchmark::DoNotOptimize(readCorpus(path, CorpusAudio::kSkip, CorpusMotion::kOnDemand)); });
    own_s += own;
    state.SetIterationTime(own);
    all_s += secondsOf([&] { benchmark::DoNotOptimize(readCorpus(path)); });
  }
  state.counters["times_reading_all"] = all_s / own_s;
  std::filesystem::remove(path);
}
BENCHMARK(readCorpusFile)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mouthpiece
