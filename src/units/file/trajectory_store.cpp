#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <span>

#include "base/errors.h"
#include "units/file/corpus_tables.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostComponents = 64;
constexpr std::size_t kMostTargets = 1'000'000;
constexpr float kLargest = 1e6F;                                  ///< mm and weights: nothing on a face comes near
constexpr double kShortestTimeConstant = 1e-3, kLongestTime = 1;  ///< s
constexpr std::string_view kTarget = "target ";
constexpr std::size_t kFirstLatticeWeights = 13;               ///< of the terms that versions 2 and 3 began with
constexpr std::string_view kCutWeights = "sound cut weights";  ///< only where they were learnt
constexpr std::string_view kSettings = "motion settings";      ///< since version 4
constexpr std::string_view kShares = "network shares", kNetwork = "network ";
constexpr std::string_view kSilence = "silence timing";          ///< since version 6
constexpr std::string_view kExpectedSounds = "expected sounds";  ///< since version 5, where the corpus has sound
constexpr std::size_t kMostHidden = 1024, kMostNetworks = 64;

using Numbers = std::vector<float>;

void expectNumbers(const CheckedQuery& row, int column, std::size_t expected) {
  const std::size_t found = row.blob(column).size();
  if (found != expected * sizeof(float))
    row.fail(fmt::format("found {} bytes; expected {}", found, expected * sizeof(float)));
}

/// `count` of the blob's numbers, from `first` on. `nan_allowed`: what was not seen.
Numbers numbersAt(const CheckedQuery& row, int column, std::size_t first, std::size_t count, bool nan_allowed) {
  Numbers numbers(count);
  if (count > 0) std::memcpy(numbers.data(), row.blob(column).data() + first * sizeof(float), count * sizeof(float));
  for (const float number : numbers) {
    if (!(std::abs(number) <= kLargest) && !(nan_allowed && std::isnan(number)))
      row.fail(fmt::format("found {}; expected a number up to {}", number, kLargest));
  }
  return numbers;
}

Numbers numbersOf(const CheckedQuery& row, int column, std::size_t expected) {
  expectNumbers(row, column, expected);
  return numbersAt(row, column, 0, expected, false);
}

/// Row by row.
Eigen::MatrixXd matrixOf(const Numbers& numbers, Eigen::Index rows) {
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Index columns = signedIndex(numbers.size()) / rows;
  return Eigen::Map<const RowMajor>(numbers.data(), rows, columns).cast<double>();
}

/// The rows of `trajectory_model`, in the order in which writeTrajectoryModel() puts them.
class ModelReader {
 public:
  ModelReader(SqliteDatabase& database, Corpus& corpus)
      : row_(database, "trajectory_model"), corpus_(corpus), columns_(3 * corpus.layout.markers.size()) {}

  void read() {
    if (!row_.next()) return;
    auto model = std::make_shared<TrajectoryModel>();
    expectName("level");
    const std::size_t bytes = row_.blob(2).size();
    components_ = bytes / sizeof(float);
    if (components_ == 0 || components_ > std::min(kMostComponents, columns_))
      row_.fail(fmt::format("found {} bytes; expected 4 to {}", bytes, 4 * std::min(kMostComponents, columns_)));
    model->level = matrixOf(numbersOf(row_, 2, components_), 1);
    model->analysis = matrixOf(next("analysis", columns_ * components_), signedIndex(columns_));
    model->shapes = matrixOf(next("shapes", components_ * columns_), signedIndex(components_));
    readDynamics(*model);
    const Numbers gain = next("gain", 1);
    if (!(gain[0] > 0)) row_.fail(fmt::format("found {}; expected more than 0", gain[0]));
    model->gain = gain[0];
    model->closing = matrixOf(next("closing", columns_), 1);
    model->closed_opening_mm = next("closed opening", 1)[0];
    readLatticeWeights(corpus_.lattice_weights.values());
    model->silence.pauses_settle = false;  // of a file that does not say
    readTargets(*model);
    corpus_.trajectory_model = std::move(model);
  }

 private:
  void expectName(std::string_view name) const {
    if (row_.text(1) != name) row_.fail(fmt::format("found {}; expected {}", printable(row_.text(1)), name));
  }
  void nextNamed(std::string_view name) {
    if (!row_.next()) row_.fail(fmt::format("is missing; expected {}", name));
    expectName(name);
  }
  Numbers next(std::string_view name, std::size_t count) {
    nextNamed(name);
    return numbersOf(row_, 2, count);
  }
  [[nodiscard]] Numbers weights(std::size_t count) const {
    const Numbers numbers = numbersOf(row_, 2, count);
    for (const float number : numbers) {
      if (number < 0) row_.fail(fmt::format("found {}; expected no weight below 0", number));
    }
    return numbers;
  }
  /// A file from before the last of them came ends early, but not before the first `least`.
  [[nodiscard]] Numbers weights(std::size_t least, std::size_t most) const {
    return weights(std::clamp(row_.blob(2).size() / sizeof(float), least, most));
  }
  void readLatticeWeights(std::span<double> values) {
    nextNamed("lattice weights");
    const Numbers numbers = weights(kFirstLatticeWeights, values.size());
    std::copy(numbers.begin(), numbers.end(), values.begin());
  }
  void readDynamics(TrajectoryModel& model) {
    const Numbers time_constants = next("time constants", components_);
    const Numbers leads = next("leads", components_);
    for (std::size_t i = 0; i < components_; ++i) {
      const ComponentDynamics dynamics{time_constants[i], leads[i]};
      if (!(dynamics.time_constant >= kShortestTimeConstant && dynamics.time_constant <= kLongestTime &&
            std::abs(dynamics.lead) <= kLongestTime))
        row_.fail(
            fmt::format("component {} moves in {} s with a lead of {} s", i, dynamics.time_constant, dynamics.lead));
      model.dynamics.push_back(dynamics);
    }
  }
  void readTargets(TrajectoryModel& model) {
    while (row_.next()) {
      const std::string_view name = row_.text(1);
      if (name == kCutWeights && model.targets.empty()) {
        const Numbers cuts = weights(kSoundCutTerms.size());
        for (std::size_t i = 0; i < cuts.size(); ++i) corpus_.sound_cut_weights.*kSoundCutTerms[i].weight = cuts[i];
        continue;
      }
      if (name == kSettings && model.targets.empty()) {
        readSettings();
        continue;
      }
      if (name == kShares && model.targets.empty()) {
        readNetworks(model);
        continue;
      }
      if (name == kSilence && model.targets.empty()) {
        readSilence(model.silence);
        continue;
      }
      if (name == kExpectedSounds && model.targets.empty()) {
        readSound(model.sound);
        continue;
      }
      if (!name.starts_with(kTarget) || model.targets.size() >= kMostTargets)
        row_.fail(fmt::format("found {}; expected at most {} targets", printable(name), kMostTargets));
      const auto [place, is_new] = model.targets.try_emplace(std::string(name.substr(kTarget.size())),
                                                             matrixOf(numbersOf(row_, 2, components_), 1).transpose());
      if (!is_new) row_.fail(fmt::format("found {} twice", printable(name)));
    }
  }

  void readSettings() {
    const Numbers numbers = weights(kLeastMotionSettings, kMotionSettings.size());
    for (std::size_t i = 0; i < numbers.size(); ++i)
      corpus_.motion_settings.*kMotionSettings[i].value =
          std::clamp(double{numbers[i]}, kMotionSettings[i].least, kMotionSettings[i].largest);
  }
  /// The shares are at hand; a row with all numbers of each network follows for each.
  void readNetworks(TrajectoryModel& model) {
    const auto features = contextFeatureNames().size();
    const std::size_t components = components_, most = row_.blob(2).size() / sizeof(float);
    if (most <= components || most - components > kMostNetworks)
      row_.fail(fmt::format("found {} bytes; expected {} and 4 a network", 4 * most, 4 * components));
    const Numbers numbers = weights(most);
    model.network_share = Eigen::Map<const Eigen::RowVectorXf>(numbers.data(), signedIndex(components)).cast<double>();
    if (!(model.network_share.array() <= 1).all()) row_.fail("found a share over 1; expected 0 to 1");
    for (std::size_t i = components; i < most; ++i) {
      const auto hidden = static_cast<std::size_t>(numbers[i]);
      if (hidden < 1 || hidden > kMostHidden) row_.fail(fmt::format("found {} hidden units", numbers[i]));
      const std::size_t inputs = features * unsignedIndex(kContextWindows) * hidden;
      const Numbers own = next(fmt::format("{}{}", kNetwork, i - components), inputs + hidden + hidden * components);
      ContextNetwork& network = model.networks.emplace_back();
      network.input = Eigen::Map<const ContextNetwork::Matrix>(own.data(), signedIndex(features),
                                                               kContextWindows * signedIndex(hidden));
      network.bias = Eigen::Map<const Eigen::RowVectorXf>(own.data() + inputs, signedIndex(hidden));
      network.output = Eigen::Map<const ContextNetwork::Matrix>(own.data() + inputs + hidden, signedIndex(hidden),
                                                                signedIndex(components));
    }
  }
  void readSilence(SilenceTiming& silence) {
    const Numbers numbers = weights(4);
    silence = {numbers[0], numbers[1], numbers[2], numbers[3], true};
    if (!(numbers[0] <= kLongestTime && numbers[1] <= 1 && numbers[2] <= numbers[3] && numbers[3] <= kLongestTime))
      row_.fail("found breaths out of order; expected a length, a share up to 1, the least and the most");
  }
  /// What the phones sound like is at hand; three rows follow.
  void readSound(SoundModel& sound) {
    const auto measures = unsignedIndex(kSoundMeasures);
    sound.expected = matrixOf(numbersOf(row_, 2, kPhoneCount * measures), kPhoneCount);
    sound.spread = matrixOf(next("spread of sounds", measures), 1);
    if (!(sound.spread.minCoeff() > 0)) row_.fail("found no spread; expected more than 0");
    sound.widest_spread = matrixOf(next("widest spread of sounds", measures), 1);
    if (!(sound.widest_spread.minCoeff() > 0)) row_.fail("found no spread; expected more than 0");
    sound.weights = matrixOf(next("weights of sounds", unsignedIndex(kSoundFeatures) * components_), kSoundFeatures);
  }

  CheckedQuery row_;
  Corpus& corpus_;
  std::size_t columns_;
  std::size_t components_ = 0;
};

template <typename Values>
Numbers floatsOf(const Values& values) {
  Numbers numbers;
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    for (Eigen::Index column = 0; column < values.cols(); ++column) numbers.push_back(asFloat(values(row, column)));
  }
  return numbers;
}

std::string_view bytesOf(const Numbers& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float)};
}

/// Captured, predicted, tightest: one after the other.
Numbers packed(const PhoneShapes& shapes) {
  Numbers numbers(shapes.captured.data(), shapes.captured.data() + shapes.captured.size());
  numbers.insert(numbers.end(), shapes.predicted.data(), shapes.predicted.data() + shapes.predicted.size());
  numbers.insert(numbers.end(), shapes.tightest_mm.begin(), shapes.tightest_mm.end());
  return numbers;
}

}  // namespace

void readTrajectoryModel(SqliteDatabase& database, Corpus& corpus) { ModelReader(database, corpus).read(); }

PhoneShapes readShapes(const CheckedQuery& row, std::size_t phones, Eigen::Index components, std::size_t first,
                       std::size_t count) {
  const auto width = unsignedIndex(PhoneShapes::kPoints * components);
  expectNumbers(row, 1, phones * (2 * width + 1));
  PhoneShapes shapes;
  const auto matrixAt = [&](std::size_t number) {
    const Numbers numbers = numbersAt(row, 1, number, count * width, true);
    return Eigen::Map<const PhoneShapes::Matrix>(numbers.data(), signedIndex(count), signedIndex(width)).eval();
  };
  shapes.captured = matrixAt(first * width);
  shapes.predicted = matrixAt((phones + first) * width);
  shapes.tightest_mm = numbersAt(row, 1, 2 * phones * width + first, count, true);
  return shapes;
}

void readAllShapes(SqliteDatabase& database, const Corpus& corpus) {
  CheckedQuery row(database, "phone_shapes");
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    if (!row.next()) row.fail("is missing");
    if (row.integer(0) != signedIndex(take)) row.fail(fmt::format("found id {}; expected {}", row.integer(0), take));
    const std::size_t phones = corpus.takes[take].labels.phones.size();
    readShapes(row, phones, shapeComponents(*corpus.trajectory_model), 0, phones);
  }
  if (row.next()) row.fail("no such take");
}

void writeTrajectoryModel(SqliteDatabase& database, const Corpus& corpus) {
  if (corpus.trajectory_model == nullptr) return;
  const TrajectoryModel& model = *corpus.trajectory_model;
  CheckedInsert rows(database, "trajectory_model", 4);
  std::int64_t id = 0;
  const auto add = [&](const std::string& name, const Numbers& numbers) {
    rows.integer(id++).text(name).blob(bytesOf(numbers)).insert();
  };
  Numbers time_constants, leads;
  for (const ComponentDynamics& dynamics : model.dynamics) {
    time_constants.push_back(asFloat(dynamics.time_constant));
    leads.push_back(asFloat(dynamics.lead));
  }
  // Terms that came later are written where they say something: else an older program still reads the file.
  std::span<const double> weights = corpus.lattice_weights.values();
  while (weights.size() > kFirstLatticeWeights && weights.back() == pairTerms()[weights.size() - 1].weight)
    weights = weights.first(weights.size() - 1);
  add("level", floatsOf(model.level));
  add("analysis", floatsOf(model.analysis));
  add("shapes", floatsOf(model.shapes));
  add("time constants", time_constants);
  add("leads", leads);
  add("gain", {asFloat(model.gain)});
  add("closing", floatsOf(model.closing));
  add("closed opening", {asFloat(model.closed_opening_mm)});
  add("lattice weights", {weights.begin(), weights.end()});
  if (corpus.sound_cut_weights != SoundCutWeights()) {
    Numbers cuts;
    for (const SoundCutTerm& term : kSoundCutTerms) cuts.push_back(asFloat(corpus.sound_cut_weights.*term.weight));
    add(std::string(kCutWeights), cuts);
  }
  const SilenceTiming& silence = model.silence;
  if (silence.pauses_settle) {
    add(std::string(kSilence), {asFloat(silence.breath_at_half_second), asFloat(silence.breath_share),
                                asFloat(silence.least_breath), asFloat(silence.most_breath)});
  }
  Numbers settings;
  for (const MotionSetting& setting : kMotionSettings)
    settings.push_back(asFloat(corpus.motion_settings.*setting.value));
  while (settings.size() > kLeastMotionSettings &&
         settings.back() == asFloat(MotionSettings().*kMotionSettings[settings.size() - 1].value))
    settings.pop_back();
  add(std::string(kSettings), settings);
  if (!model.networks.empty()) {
    Numbers shares = floatsOf(model.network_share);
    for (const ContextNetwork& network : model.networks) shares.push_back(asFloat(asReal(network.hiddenCount())));
    add(std::string(kShares), shares);
  }
  for (std::size_t i = 0; i < model.networks.size(); ++i) {
    const ContextNetwork& network = model.networks[i];
    Numbers numbers(network.input.data(), network.input.data() + network.input.size());
    numbers.insert(numbers.end(), network.bias.data(), network.bias.data() + network.bias.size());
    numbers.insert(numbers.end(), network.output.data(), network.output.data() + network.output.size());
    add(fmt::format("{}{}", kNetwork, i), numbers);
  }
  if (!model.sound.isEmpty()) {
    add(std::string(kExpectedSounds), floatsOf(model.sound.expected));
    add("spread of sounds", floatsOf(model.sound.spread));
    add("widest spread of sounds", floatsOf(model.sound.widest_spread));
    add("weights of sounds", floatsOf(model.sound.weights));
  }
  for (const auto& [feature, target] : model.targets) add(std::string(kTarget) + feature, floatsOf(target));

  CheckedInsert shapes(database, "phone_shapes", 3);
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    const CorpusTake& own = corpus.takes[take];
    const Numbers numbers = packed(phoneShapes(model, own.labels, motionOf(corpus, TakeIndex(take)),
                                               corpus.neutral_pose_mm, LipGauge(corpus.layout)));
    shapes.integer(take).blob(bytesOf(numbers)).insert();
  }
}

}  // namespace mouthpiece
