#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "page_engine/line_package.h"
#include "page_engine/package_options.h"
#include "page_engine/packed_mesh.h"
#include "retarget/rig/stored_mesh.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostPhones = 1'000'000;
constexpr std::int64_t kMostTakes = 1'000'000;
constexpr double kLargest = kLargestPacked;
constexpr Seconds kLongestTake = 1e6;            ///< eleven days
constexpr Eigen::Index kMostFrames = 1'000'000;  ///< of the line: four hours and a half at 60 Hz

/// rows x columns floats.
RowMajorMatrixF matrixFrom(const JsonField& field, Eigen::Index rows, Eigen::Index columns) {
  RowMajorMatrixF matrix = floatsFrom(field, columns);
  if (matrix.rows() != rows) field.fail(fmt::format("found {} rows; expected {}", matrix.rows(), rows));
  return matrix;
}

MarkerPositions markersFrom(const JsonField& field, std::size_t markers) {
  const std::vector<double> values = field.blob<double>();
  if (values.size() != 3 * markers)
    field.fail(fmt::format("found {} numbers; expected {}", values.size(), 3 * markers));
  for (const double value : values) {
    if (!(std::abs(value) <= kLargest)) field.fail("found a number that is not usable");
  }
  return Eigen::Map<const MarkerPositions>(values.data(), signedIndex(markers), 3);
}

PhoneRange rangeFrom(const JsonField& first, const JsonField& last, std::size_t phones) {
  const auto most = static_cast<std::int64_t>(phones) - 1;
  const std::int64_t begin = first.whole(0, most);
  return {PhoneIndex(unsignedIndex(begin)), PhoneIndex(unsignedIndex(last.whole(begin, most)))};
}

/// An index below `count`, or none where it is -1.
std::optional<std::size_t> indexFrom(const JsonField& field, std::int32_t index, std::size_t count) {
  if (index == -1) return std::nullopt;
  if (index < 0 || unsignedIndex(index) >= count)
    field.fail(fmt::format("found {}; expected -1 or an index below {}", index, count));
  return unsignedIndex(index);
}

SpeechLabels labelsFrom(const JsonField& field) {
  const auto phones = field["phones"].blob<std::uint8_t>();
  const auto times = field["times_s"].blob<double>();
  const auto words_of = field["word"].blob<std::int32_t>(), syllables_of = field["syllable"].blob<std::int32_t>();
  const auto syllables = field["syllables"].blob<std::int32_t>();
  const std::size_t count = phones.size();
  if (count == 0 || count > kMostPhones) field["phones"].fail(fmt::format("found {} phones", count));
  if (times.size() != 2 * count || words_of.size() != count || syllables_of.size() != count ||
      syllables.size() % 3 != 0)
    field.fail("found labels of other lengths than their phones; expected one entry a phone");
  const std::vector<JsonField> ipa = field["ipa"].list(count, count);
  SpeechLabels labels;
  for (const JsonField& word : field["words"].list(0, kMostPhones)) {
    const std::vector<JsonField> parts = word.list(3, 3);
    labels.words.push_back({parts[0].text(), rangeFrom(parts[1], parts[2], count)});
  }
  for (std::size_t i = 0; i < syllables.size(); i += 3) {
    const auto first = indexFrom(field["syllables"], syllables[i], count);
    const auto last = indexFrom(field["syllables"], syllables[i + 1], count);
    if (!first || !last || *last < *first) field["syllables"].fail("found a syllable without phones");
    labels.syllables.push_back({{PhoneIndex(*first), PhoneIndex(*last)}, syllables[i + 2]});
  }
  for (std::size_t i = 0; i < count; ++i) {
    const TimeSpan span{times[2 * i], times[2 * i + 1]};
    if (phones[i] >= kPhoneCount) field["phones"].fail(fmt::format("found phone {}", phones[i]));
    labels.phones.push_back({static_cast<Phone>(phones[i]), span,
                             indexFrom(field["word"], words_of[i], labels.words.size()),
                             indexFrom(field["syllable"], syllables_of[i], labels.syllables.size()), ipa[i].text()});
  }
  if (const std::string_view fault = faultOf(labels); !fault.empty()) field.fail(fault);
  if (labels.duration() > kLongestTake) field["times_s"].fail(fmt::format("found {} s", labels.duration()));
  return labels;
}

Eigen::Index sizeFrom(const JsonField& field, Eigen::Index least, Eigen::Index most) {
  return static_cast<Eigen::Index>(field.whole(least, most));
}

TrajectoryModel modelFrom(const JsonField& field, Eigen::Index columns) {
  TrajectoryModel model;
  const Eigen::Index components = sizeFrom(field["components"], 1, columns);
  const auto matrix = [&](std::string_view name, Eigen::Index rows, Eigen::Index width) {
    return Eigen::MatrixXd(matrixFrom(field[name], rows, width).cast<double>());
  };
  model.analysis = matrix("analysis", columns, components);
  model.shapes = matrix("shapes", components, columns);
  const std::vector<double> dynamics = field["dynamics"].blob<double>();
  if (dynamics.size() != 2 * unsignedIndex(components)) field["dynamics"].fail("expected two numbers a component");
  for (std::size_t i = 0; i < dynamics.size(); i += 2) {
    if (!(dynamics[i] > 0 && dynamics[i] <= 1 && std::abs(dynamics[i + 1]) <= 1))
      field["dynamics"].fail("found no time");
    model.dynamics.push_back({dynamics[i], dynamics[i + 1]});
  }
  model.level = matrix("level", 1, components);
  for (const auto& [feature, target] : field["targets"].members())
    model.targets[feature] = matrixFrom(target, components, 1).cast<double>();
  for (const JsonField& given : field["networks"].list(0, 64)) {
    const Eigen::Index hidden = sizeFrom(given["hidden"], 1, 1024);
    const auto features = signedIndex(contextFeatureNames().size());
    ContextNetwork& network = model.networks.emplace_back();
    network.input = matrixFrom(given["input"], features, kContextWindows * hidden);
    network.bias = matrixFrom(given["bias"], 1, hidden);
    network.output = matrixFrom(given["output"], hidden, components);
  }
  if (!model.networks.empty()) model.network_share = matrix("network_share", 1, components);
  model.gain = field["gain"].number(0, kLargest);
  if (!field["closing"].bytes().empty()) model.closing = matrix("closing", 1, columns);
  const Eigen::VectorXd silence = field["silence"].numbers(4, 10);
  model.silence = {silence(0), silence(1), silence(2), silence(3), field["pauses_settle"].flag()};
  model.closed_opening_mm = field["closed_opening_mm"].number(-kLargest, kLargest);
  if (const JsonField sound = field["sound"]; sound.exists()) {
    model.sound.expected = matrixFrom(sound["expected"], kPhoneCount, kSoundMeasures).cast<double>();
    model.sound.spread = matrixFrom(sound["spread"], 1, kSoundMeasures).cast<double>();
    model.sound.widest_spread = matrixFrom(sound["widest_spread"], 1, kSoundMeasures).cast<double>();
    model.sound.weights = matrixFrom(sound["weights"], kSoundFeatures, components).cast<double>();
    if (!(model.sound.spread.minCoeff() > 0 && model.sound.widest_spread.minCoeff() > 0))
      sound["spread"].fail("found no spread; expected more than 0");
  }
  return model;
}

/// What a package holds of its takes.
class PackedTakes : public TakeSource {
 public:
  struct Packed {
    std::string name;
    std::optional<MotionClip> motion;
    PhoneShapes shapes;
  };
  explicit PackedTakes(std::vector<Packed> takes) : takes_(std::move(takes)) {}

  [[nodiscard]] MotionClip load(TakeIndex take) const override {
    const Packed& own = takes_[take.value];
    if (!own.motion) throw InputError(fmt::format("the page does not hold the take {}", printable(own.name)));
    return *own.motion;
  }
  [[nodiscard]] AudioClip loadAudio(TakeIndex /*take*/) const override { return {}; }
  [[nodiscard]] PhoneShapes loadShapes(TakeIndex take) const override { return takes_[take.value].shapes; }

 private:
  std::vector<Packed> takes_;
};

/// Phones that the package does not hold are all 0: nobody asks for them.
PhoneShapes shapesFrom(const JsonField& field, std::size_t phones, Eigen::Index components) {
  const Eigen::Index width = PhoneShapes::kPoints * components;
  PhoneShapes shapes{PhoneShapes::Matrix::Zero(signedIndex(phones), width),
                     PhoneShapes::Matrix::Zero(signedIndex(phones), width), std::vector<float>(phones, 0.0F)};
  const auto held = field["phones"].blob<std::uint32_t>();
  const auto count = signedIndex(held.size());
  const RowMajorMatrixF captured = floatsFrom(field["captured"], width, true);
  const RowMajorMatrixF predicted = floatsFrom(field["predicted"], width);
  const RowMajorMatrixF tightest = floatsFrom(field["tightest_mm"], 1, true);
  if (captured.rows() != count || predicted.rows() != count || tightest.rows() != count)
    field.fail("found shapes of other lengths than their phones; expected one a phone");
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::uint32_t phone = held[unsignedIndex(i)];
    if (phone >= phones) field["phones"].fail(fmt::format("found phone {} of {}", phone, phones));
    shapes.captured.row(phone) = captured.row(i);
    shapes.predicted.row(phone) = predicted.row(i);
    shapes.tightest_mm[phone] = tightest(i);
  }
  return shapes;
}

Corpus corpusFrom(const JsonField& field, const std::string& file) {
  Corpus corpus;
  corpus.name = field["name"].text();
  corpus.layout = parseLayout(field["layout"].text(std::size_t{1} << 24), file);
  const std::vector<std::string> names = corpus.layout.markerNames();
  const auto columns = signedIndex(3 * names.size());
  corpus.neutral_pose_mm = markersFrom(field["neutral_mm"], names.size());
  const std::vector<JsonField> settings = field["settings"].list(kLeastMotionSettings, kMotionSettings.size());
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const MotionSetting& setting = kMotionSettings[i];
    corpus.motion_settings.*setting.value = settings[i].number(setting.least, setting.largest);
  }
  if (const JsonField model = field["model"]; model.exists())
    corpus.trajectory_model = std::make_shared<TrajectoryModel>(modelFrom(model, columns));
  if (const JsonField poses = field["poses"]; poses.exists()) corpus.viseme_poses = poses.text(std::size_t{1} << 26);
  std::vector<PackedTakes::Packed> packed;
  for (const JsonField& entry : field["takes"].list(0, kMostTakes)) {
    CorpusTake& take = corpus.takes.emplace_back();
    PackedTakes::Packed& own = packed.emplace_back();
    own.name = take.name = entry["name"].text();
    take.labels = labelsFrom(entry["labels"]);
    if (corpus.trajectory_model != nullptr)
      own.shapes = shapesFrom(entry["shapes"], take.labels.phones.size(), shapeComponents(*corpus.trajectory_model));
    if (!entry["motion_mm"].exists()) continue;
    take.motion.frame_rate_hz = entry["frame_rate_hz"].number(1, 1e5);
    own.motion =
        MotionClip{take.motion.frame_rate_hz, names, floatsFrom(entry["motion_mm"], columns, true).cast<double>()};
    if (own.motion->frameCount() == 0) entry["motion_mm"].fail("found no frame");
  }
  corpus.take_source = std::make_shared<PackedTakes>(std::move(packed));
  return corpus;
}

SynthesisPlan planFrom(const JsonField& field, const SpeechLabels& labels, const Corpus& corpus) {
  SynthesisPlan plan;
  for (const JsonField& entry : field.list(0, kMostPhones)) {
    Segment segment{rangeFrom(entry["first"], entry["last"], labels.phones.size()), std::nullopt};
    const std::size_t begins = plan.segments.empty() ? 0 : plan.segments.back().phones.last.value;
    if (segment.phones.first.value != begins || segment.phones.last.value == begins)
      entry.fail("found segments that do not follow each other; expected neighbours that share a phone");
    if (entry["take"].exists()) {
      const TakeIndex take(unsignedIndex(entry["take"].whole(0, std::ssize(corpus.takes) - 1)));
      const std::size_t more = segment.phones.last.value - segment.phones.first.value;
      const std::int64_t most = std::ssize(corpus.takes[take.value].labels.phones) - 1 - signedIndex(more);
      const PhoneIndex phone(unsignedIndex(entry["phone"].whole(0, most)));
      segment.unit = SelectedUnit{segment.phones, {take, phone}, 0, 0, entry["stands_in"].flag(), {}};
    }
    plan.segments.push_back(segment);
  }
  const bool is_whole = plan.segments.empty() ? labels.phones.size() < 2
                                              : plan.segments.back().phones.last.value + 1 == labels.phones.size();
  if (!is_whole) field.fail("found segments that do not cover the line");
  return plan;
}

/// `rows`: the mesh's vertices.
ShapeSample sampleFrom(const JsonField& field, std::size_t rows) {
  ShapeSample sample;
  sample.vertices = field["vertices"].blob<std::uint32_t>();
  for (const std::uint32_t vertex : sample.vertices) {
    if (vertex >= rows) field["vertices"].fail(fmt::format("found vertex {}", vertex));
  }
  const Eigen::Index count = sizeFrom(field["count"], 0, 100'000);
  if (count > 0) sample.shapes = matrixFrom(field["shapes"], count, 3 * signedIndex(sample.vertices.size()));
  return sample;
}

/// How long the line's sound lasts; 0 where it has none.
Seconds soundLasts(const JsonField& field) {
  const std::int64_t count = field["count"].whole(0, 1'000'000'000);
  if (count == 0) return 0;
  return asReal(count) / asReal(field["rate_hz"].whole(1, 1'000'000));
}

SoundMeasures measuresFrom(const JsonField& field) {
  const std::vector<double> values = field.blob<double>();
  const auto rows = signedIndex(values.size()) / kSoundMeasures;
  if (values.empty() || signedIndex(values.size()) % kSoundMeasures != 0)
    field.fail(fmt::format("found {} numbers; expected rows of {}", values.size(), kSoundMeasures));
  for (const double value : values) {
    if (!(std::abs(value) <= kLargest)) field.fail("found a number that is not usable");
  }
  return {Eigen::Map<const PositionMatrix>(values.data(), rows, kSoundMeasures)};
}

}  // namespace

LinePackage parseLinePackage(std::string_view bytes, const std::string& name) {
  const JsonField field = parseCbor(bytes, name, "a packed line");
  if (field["format"].text() != "mouthpiece-line") field["format"].refuse("mouthpiece-line");
  if (field["version"].whole(1, 1) != 1) field["version"].refuse("1");
  LinePackage package;
  SynthesisRequest& request = package.request;
  request.text = field["text"].text(std::size_t{1} << 24);
  request.labels = labelsFrom(field["labels"]);
  request.options = optionsFrom(field["options"]);
  request.sound_lasts = soundLasts(field["sound"]);
  const Seconds lasts = std::max(request.labels.duration(), request.sound_lasts);
  if (lasts * request.options.frame_rate_hz > asReal(kMostFrames))
    field["labels"].fail(fmt::format("found a line of {} s at {} Hz; expected at most {} frames", lasts,
                                     request.options.frame_rate_hz, kMostFrames));
  if (const JsonField measures = field["sound"]["measures"]; measures.exists())
    request.measures = measuresFrom(measures);
  request.options.context.hear = request.options.context.hear && request.measures.has_value();
  package.corpus = corpusFrom(field["corpus"], name);
  package.plan = planFrom(field["plan"], request.labels, package.corpus);
  const std::span<const std::uint8_t> face = field["face"].bytes();
  package.face = parseFaceFile({reinterpret_cast<const char*>(face.data()), face.size()}, name);
  package.mesh = meshFrom(field["mesh"]);
  const JsonField actor = field["actor"];
  package.actor.neutral_mm = markersFrom(actor["neutral_mm"], package.corpus.layout.markers.size());
  package.actor.closed_lips_mm = actor["closed_lips_mm"].number(-kLargest, kLargest);
  package.actor.unseen = {actor["narrowing"].number(-kLargest, kLargest),
                          actor["protrusion"].number(-kLargest, kLargest)};
  package.sample = sampleFrom(field["sample"], vertexCountOf(*package.mesh));
  return package;
}

}  // namespace mouthpiece
