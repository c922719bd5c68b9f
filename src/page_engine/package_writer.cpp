#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/errors.h"
#include "base/index.h"
#include "base/json_text.h"
#include "page_engine/line_package.h"
#include "page_engine/package_options.h"
#include "page_engine/packed_mesh.h"
#include "retarget/rig/stored_mesh.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

json doublesOf(const PositionMatrix& matrix) {
  return blobOf(std::vector<double>(matrix.data(), matrix.data() + matrix.size()));
}

json labelsToJson(const SpeechLabels& labels) {
  std::vector<std::uint8_t> phones;
  std::vector<double> times;
  std::vector<std::int32_t> words_of, syllables_of, syllables;
  json ipa = json::array(), words = json::array();
  const auto indexOr = [](const std::optional<std::size_t>& index) {
    return index ? static_cast<std::int32_t>(*index) : -1;
  };
  for (const LabelledPhone& phone : labels.phones) {
    phones.push_back(static_cast<std::uint8_t>(phone.phone));
    times.insert(times.end(), {phone.span.start, phone.span.end});
    words_of.push_back(indexOr(phone.word));
    syllables_of.push_back(indexOr(phone.syllable));
    ipa.push_back(phone.ipa);
  }
  for (const LabelledSyllable& syllable : labels.syllables)
    syllables.insert(syllables.end(), {static_cast<std::int32_t>(syllable.phones.first.value),
                                       static_cast<std::int32_t>(syllable.phones.last.value), syllable.stress});
  for (const LabelledWord& word : labels.words)
    words.push_back({word.text, word.phones.first.value, word.phones.last.value});
  return {{"phones", blobOf(phones)},         {"times_s", blobOf(times)}, {"word", blobOf(words_of)},
          {"syllable", blobOf(syllables_of)}, {"ipa", std::move(ipa)},    {"syllables", blobOf(syllables)},
          {"words", std::move(words)}};
}

/// What contextMean() may ask for: the phones of the line's pairs.
struct PairShapes {
  std::vector<std::uint32_t> phones;
  std::vector<float> captured, predicted, tightest;

  void add(const UnitDatabase& database, const PhonePlace& place) {
    const PhoneShape shape = database.shapeOf(place);
    phones.push_back(static_cast<std::uint32_t>(place.phone.value));
    captured.insert(captured.end(), shape.captured().begin(), shape.captured().end());
    predicted.insert(predicted.end(), shape.predicted().begin(), shape.predicted().end());
    tightest.push_back(database.tightestMm(place));
  }
  [[nodiscard]] json toJson() const {
    return {{"phones", blobOf(phones)},
            {"captured", blobOf(captured)},
            {"predicted", blobOf(predicted)},
            {"tightest_mm", blobOf(tightest)}};
  }
};

/// The phones of each take that the line's pairs are made of.
std::map<std::size_t, std::set<std::size_t>> pairsOf(const SpeechLabels& line, const UnitDatabase& database) {
  std::map<std::size_t, std::set<std::size_t>> found;
  for (std::size_t i = 0; i + 1 < line.phones.size(); ++i) {
    for (const PhonePlace& place : database.diphones(line.phones[i].phone, line.phones[i + 1].phone)) {
      found[place.take.value].insert(place.phone.value);
      found[place.take.value].insert(place.phone.value + 1);
    }
  }
  return found;
}

struct TakesToPack {
  json takes = json::array();
  std::map<std::size_t, std::size_t> number_of;  ///< by the take's own
};

TakesToPack takesOf(const LineToPack& line) {
  const Corpus& corpus = line.database.corpus();
  std::set<std::size_t> moving;
  for (const Segment& segment : line.plan.segments) {
    if (segment.unit) moving.insert(segment.unit->source.take.value);
  }
  for (const TakeIndex take : line.takes) moving.insert(take.value);
  std::map<std::size_t, std::set<std::size_t>> pairs = pairsOf(line.request.labels, line.database);
  for (const std::size_t take : moving) pairs[take];
  TakesToPack packed;
  for (const auto& [number, phones] : pairs) {
    const CorpusTake& take = line.database.takeOf(TakeIndex(number));
    json entry{{"name", take.name}, {"labels", labelsToJson(take.labels)}};
    if (moving.contains(number)) {
      const std::shared_ptr<const MotionClip> kept = line.database.motionOf(TakeIndex(number));
      const MotionClip& motion = *kept;
      entry["frame_rate_hz"] = motion.frame_rate_hz;
      entry["motion_mm"] = floatsOf(motion.positions_mm);
    }
    if (corpus.trajectory_model != nullptr) {
      PairShapes shapes;
      for (const std::size_t phone : phones) shapes.add(line.database, {TakeIndex(number), PhoneIndex(phone)});
      entry["shapes"] = shapes.toJson();
    }
    packed.number_of[number] = packed.takes.size();
    packed.takes.push_back(std::move(entry));
  }
  return packed;
}

json planToJson(const SynthesisPlan& plan, const std::map<std::size_t, std::size_t>& number_of) {
  json segments = json::array();
  for (const Segment& segment : plan.segments) {
    json entry{{"first", segment.phones.first.value}, {"last", segment.phones.last.value}};
    if (segment.unit) {
      entry["take"] = number_of.at(segment.unit->source.take.value);
      entry["phone"] = segment.unit->source.phone.value;
      entry["stands_in"] = segment.unit->is_backoff;
    }
    segments.push_back(std::move(entry));
  }
  return segments;
}

json modelToJson(const TrajectoryModel& model) {
  std::vector<double> dynamics;
  for (const ComponentDynamics& one : model.dynamics) dynamics.insert(dynamics.end(), {one.time_constant, one.lead});
  json targets = json::object(), networks = json::array();
  for (const auto& [feature, target] : model.targets) targets[feature] = floatsOf(target);
  for (const ContextNetwork& network : model.networks)
    networks.push_back({{"hidden", network.hiddenCount()},
                        {"input", floatsOf(network.input)},
                        {"bias", floatsOf(network.bias)},
                        {"output", floatsOf(network.output)}});
  json made{{"components", model.componentCount()},
            {"analysis", floatsOf(model.analysis)},
            {"shapes", floatsOf(model.shapes)},
            {"dynamics", blobOf(dynamics)},
            {"level", floatsOf(model.level)},
            {"targets", std::move(targets)},
            {"networks", std::move(networks)},
            {"network_share", floatsOf(model.network_share)},
            {"gain", model.gain},
            {"closing", floatsOf(model.closing)},
            {"silence",
             {model.silence.breath_at_half_second, model.silence.breath_share, model.silence.least_breath,
              model.silence.most_breath}},
            {"pauses_settle", model.silence.pauses_settle},
            {"closed_opening_mm", model.closed_opening_mm}};
  if (!model.sound.isEmpty())
    made["sound"] = {{"expected", floatsOf(model.sound.expected)},
                     {"spread", floatsOf(model.sound.spread)},
                     {"widest_spread", floatsOf(model.sound.widest_spread)},
                     {"weights", floatsOf(model.sound.weights)}};
  return made;
}

json corpusToJson(const LineToPack& line, json takes) {
  const Corpus& corpus = line.database.corpus();
  std::vector<double> settings;
  for (const MotionSetting& setting : kMotionSettings) settings.push_back(corpus.motion_settings.*setting.value);
  const CurveModel& curves = *line.request.options.curves.model;
  json made{{"name", corpus.name},
            {"layout", layoutToJson(corpus.layout)},
            {"neutral_mm", doublesOf(Eigen::Map<const PositionMatrix>(corpus.neutral_pose_mm.data(), 1,
                                                                      corpus.neutral_pose_mm.size()))},
            {"settings", settings},
            {"takes", std::move(takes)}};
  if (corpus.trajectory_model != nullptr) made["model"] = modelToJson(*corpus.trajectory_model);
  if (curves.isPossible())
    made["poses"] = corpus.viseme_poses.empty() ? posesToJson(curves.poses()) : corpus.viseme_poses;
  return made;
}

/// Evenly spread among the vertices that the shapes move.
json sampleToJson(const PrincipalShapes& shapes) {
  constexpr std::size_t kVerticesAShape = 12, kLeast = 400;
  const std::vector<std::uint32_t> moving = shapes.columnVertices();
  const std::size_t wanted = std::max(kLeast, kVerticesAShape * unsignedIndex(shapes.shapeCount()));
  const std::size_t every = std::max<std::size_t>(1, moving.size() / wanted);
  std::vector<std::uint32_t> vertices;
  std::vector<Eigen::Index> columns;
  for (std::size_t i = 0; i < moving.size(); i += every) {
    vertices.push_back(moving[i]);
    for (Eigen::Index axis = 0; axis < 3; ++axis) columns.push_back(3 * signedIndex(i) + axis);
  }
  return {{"vertices", blobOf(vertices)},
          {"shapes", floatsOf(RowMajorMatrixF(shapes.shapes(Eigen::all, columns)))},
          {"count", shapes.shapeCount()}};
}

json soundToJson(const SynthesisRequest& request, const Corpus& corpus) {
  json made{{"rate_hz", request.audio.sample_rate_hz}, {"count", request.audio.samples.size()}};
  if (hearsSound(request.options, corpus) && !request.audio.samples.empty())
    made["measures"] = doublesOf(soundMeasures(request.audio).rows);
  return made;
}

}  // namespace

std::string_view whyNotPacked(const SynthesisRequest& request) {
  const SynthesisOptions& options = request.options;
  if (options.curves.alone) return "curves alone move this line";
  if (options.curves.ma.automatic || options.curves.ps.automatic) return "its style is heard in the sound";
  const auto& phones = request.labels.phones;
  if (std::any_of(phones.begin(), phones.end(), [](const LabelledPhone& phone) { return !phone.ipa.empty(); }))
    return "its phones are told by IPA";
  if (!request.units.empty()) return "its fragments are heard, too: they stay as they are";
  const UpperFaceSource upper = options.expression.upper_face;
  if (upper == UpperFaceSource::kCaptured || upper == UpperFaceSource::kBest)
    return "its upper face is taken from all of the corpus";
  return "";
}

std::string packLine(const LineToPack& line) {
  MOUTHPIECE_EXPECT(whyNotPacked(line.request).empty() && line.request.options.curves.model != nullptr);
  TakesToPack packed = takesOf(line);
  const json package{{"format", "mouthpiece-line"},
                     {"version", 1},
                     {"text", line.request.text},
                     {"labels", labelsToJson(line.request.labels)},
                     {"sound", soundToJson(line.request, line.database.corpus())},
                     {"options", optionsToJson(line.request.options)},
                     {"plan", planToJson(line.plan, packed.number_of)},
                     {"corpus", corpusToJson(line, std::move(packed.takes))},
                     {"face",
                      [&] {
                        FaceFile face = line.face;
                        face.guard.clear();  // a page is sent further than it is opened
                        face.mesh = nullptr;
                        const std::string bytes = faceFileToBytes(face);
                        return json::binary({bytes.begin(), bytes.end()});
                      }()},
                     {"mesh", meshToJson(line.mesh, false)},
                     {"actor",
                      {{"neutral_mm", doublesOf(Eigen::Map<const PositionMatrix>(line.actor.neutral_mm.data(), 1,
                                                                                 line.actor.neutral_mm.size()))},
                       {"closed_lips_mm", line.actor.closed_lips_mm},
                       {"narrowing", line.actor.unseen.narrowing},
                       {"protrusion", line.actor.unseen.protrusion}}},
                     {"sample", sampleToJson(line.shapes)}};
  return cborBytes(package);
}

}  // namespace mouthpiece
