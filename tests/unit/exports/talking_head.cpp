#include "talking_head.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mouthpiece::samples {
namespace {

using Eigen::Vector3f;

constexpr float kUpperLipHeight = -30;  // mm; between the lips the egg is cut
constexpr float kLowerLipHeight = -31;
const Vector3f kEggRadii{68, 95, 78};
const Vector3f kHinge{0, -15, -10};

Vector3f onEgg(float height, float turn) {
  const float around = std::sqrt(std::max(0.0F, 1 - (height / kEggRadii.y()) * (height / kEggRadii.y())));
  return {kEggRadii.x() * around * std::sin(turn), height, kEggRadii.z() * around * std::cos(turn)};
}

/// A band of the egg between two heights, closed at the pole end by a vanishing ring.
void addBand(FaceMesh& mesh, std::vector<Vector3f>& vertices, float from, float to, const TalkingHeadOptions& options) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  const auto segments = static_cast<std::uint32_t>(options.segments);
  for (std::size_t ring = 0; ring <= options.rings; ++ring) {
    const float share = static_cast<float>(ring) / static_cast<float>(options.rings);
    const float height = from + (to - from) * std::sin(share * std::numbers::pi_v<float> / 2);
    for (std::uint32_t s = 0; s < segments; ++s) {
      vertices.push_back(onEgg(0.9999F * height,
                               2 * std::numbers::pi_v<float> * static_cast<float>(s) / static_cast<float>(segments)));
    }
  }
  for (std::uint32_t ring = 0; ring < options.rings; ++ring) {
    for (std::uint32_t s = 0; s < segments; ++s) {
      const std::uint32_t a = first + ring * segments + s;
      const std::uint32_t b = first + ring * segments + (s + 1) % segments;
      const std::uint32_t c = a + segments;
      const std::uint32_t d = b + segments;
      if (to > from) {
        mesh.triangles.insert(mesh.triangles.end(), {Triangle{a, b, c}, Triangle{b, d, c}});
      } else {
        mesh.triangles.insert(mesh.triangles.end(), {Triangle{a, c, b}, Triangle{b, c, d}});
      }
    }
  }
}

void addPart(FaceMesh& mesh, const char* name, PartKind kind, std::array<float, 4> color) {
  const std::size_t first =
      mesh.parts.empty() ? 0 : mesh.parts.back().first_triangle + mesh.parts.back().triangle_count;
  mesh.parts.push_back({name, kind, first, mesh.triangles.size() - first, color, 0.5F});
}

/// Two squares in front of the face: a part that never moves.
void addEyes(FaceMesh& mesh, std::vector<Vector3f>& vertices) {
  for (const float x : {-25.0F, 25.0F}) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const auto& [dx, dy] : {std::pair{-6, -6}, {6, -6}, {6, 6}, {-6, 6}}) {
      vertices.emplace_back(x + static_cast<float>(dx), 20 + static_cast<float>(dy), 76.0F);
    }
    mesh.triangles.insert(mesh.triangles.end(),
                          {Triangle{first, first + 1, first + 2}, Triangle{first, first + 2, first + 3}});
  }
}

/// 0 shut, 1 wide: two syllables, closed before, between and after.
float opening(double time, double duration) {
  const double beat = std::sin(2 * std::numbers::pi * time / duration);
  return static_cast<float>(beat * beat);
}

Vector3f moved(const Vector3f& rest, bool is_lower, float open, double time, const TalkingHeadOptions& options) {
  Vector3f position = rest;
  if (is_lower) {
    const float angle = 0.35F * open;
    const Vector3f arm = rest - kHinge;
    position = kHinge + Vector3f(arm.x() * (1 - 0.1F * open), std::cos(angle) * arm.y() - std::sin(angle) * arm.z(),
                                 std::sin(angle) * arm.y() + std::cos(angle) * arm.z());
  }
  const double phase = 0.12 * rest.x() + (0.2 + 0.1 * std::sin(9 * time)) * rest.y() + 25 * time;
  position.z() += static_cast<float>(options.ripple_mm * std::sin(phase));
  return position;
}

void addLabels(TalkingHead& head, const TalkingHeadOptions& options, double duration) {
  UtteranceAnimation& line = head.utterance;
  constexpr Phone kPhones[] = {Phone::kSil, Phone::kM, Phone::kAA, Phone::kM, Phone::kAA, Phone::kSil};
  constexpr double kEnds[] = {0.06, 0.12, 0.44, 0.56, 0.94, 1.0};
  double start = 0;
  for (std::size_t i = 0; i < std::size(kPhones); ++i) {
    const bool speaks = kPhones[i] != Phone::kSil;
    line.labels.phones.push_back(
        {kPhones[i], {start, kEnds[i] * duration}, speaks ? std::optional<std::size_t>(0) : std::nullopt, {}});
    start = kEnds[i] * duration;
  }
  line.labels.words.push_back({options.word, {PhoneIndex(1), PhoneIndex(4)}});
  const auto addUnit = [&](std::size_t first, std::size_t last, std::string take, bool is_backoff) {
    const PhoneRange range{PhoneIndex(first), PhoneIndex(last)};
    PlacedUnit unit;
    unit.phones = range;
    unit.take = std::move(take);
    unit.source_first = PhoneIndex(3);
    unit.source_span = {0.5, 0.9};
    unit.span = line.labels.spanOf(range);
    unit.scale = "diphone";
    unit.cost = 0.25;
    unit.is_backoff = is_backoff;
    line.units.push_back(std::move(unit));
  };
  addUnit(0, 2, "take_a", false);
  addUnit(2, 3, "take_b " + options.word, true);
  addUnit(3, 5, "take_a", false);
  line.joins = {{line.labels.phones[2].span.middle(), 0.2, 11}, {line.labels.phones[3].span.middle(), 0.1, 7}};
}

void addSound(AudioClip& audio, double duration) {
  audio.sample_rate_hz = 16000;
  audio.samples.resize(static_cast<std::size_t>(duration * audio.sample_rate_hz));
  for (std::size_t i = 0; i < audio.samples.size(); ++i) {
    const double time = static_cast<double>(i) / audio.sample_rate_hz;
    audio.samples[i] = 0.6F * opening(time, duration) * static_cast<float>(std::sin(2 * std::numbers::pi * 160 * time));
  }
}

}  // namespace

TalkingHead makeTalkingHead(const TalkingHeadOptions& options) {
  TalkingHead head;
  std::vector<Vector3f> vertices;
  addBand(head.mesh, vertices, kUpperLipHeight, kEggRadii.y(), options);
  addPart(head.mesh, "upper head", PartKind::kSkin, {0.82F, 0.56F, 0.45F, 1});
  const std::size_t first_lower = vertices.size();
  addBand(head.mesh, vertices, kLowerLipHeight, -kEggRadii.y(), options);
  addPart(head.mesh, "lower head", PartKind::kLips, {0.72F, 0.4F, 0.36F, 1});
  const std::size_t first_eye = vertices.size();
  addEyes(head.mesh, vertices);
  addPart(head.mesh, "eyes", PartKind::kEye, {0.05F, 0.06F, 0.08F, 1});

  const auto count = static_cast<Eigen::Index>(vertices.size());
  head.mesh.vertices.resize(count, 3);
  for (Eigen::Index v = 0; v < count; ++v)
    head.mesh.vertices.row(v) = vertices[static_cast<std::size_t>(v)].transpose();

  const double duration = static_cast<double>(options.frames) / options.frame_rate_hz;
  const std::size_t control[] = {0, first_lower, first_lower + options.segments * (options.rings / 2)};
  head.marker_names = {"LIP_UP_MID", "LIP_LO_MID", "CHIN"};
  head.animation.frame_rate_hz = options.frame_rate_hz;
  head.animation.positions.resize(static_cast<Eigen::Index>(options.frames), 3 * count);
  MotionClip& motion = head.utterance.motion;
  motion = {options.frame_rate_hz, head.marker_names, PositionMatrix(static_cast<Eigen::Index>(options.frames), 9)};
  for (std::size_t f = 0; f < options.frames; ++f) {
    const auto row = static_cast<Eigen::Index>(f);
    const double time = static_cast<double>(f) / options.frame_rate_hz;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      const bool is_eye = v >= first_eye;
      const Vector3f position =
          is_eye ? vertices[v] : moved(vertices[v], v >= first_lower, opening(time, duration), time, options);
      head.animation.positions.block<1, 3>(row, static_cast<Eigen::Index>(3 * v)) = position.transpose();
    }
    for (std::size_t c = 0; c < 3; ++c) {
      motion.positions_mm.block<1, 3>(row, static_cast<Eigen::Index>(3 * c)) =
          head.animation.positions.block<1, 3>(row, static_cast<Eigen::Index>(3 * control[c])).cast<double>();
    }
  }
  head.utterance.text = options.word;
  head.utterance.voice = "test:hum";
  head.utterance.corpus = "made_up";
  StageTimings& timing = head.utterance.timing_ms;
  timing.load = 0.5;
  timing.speech = 100;
  timing.selection = 1;
  timing.motion = 2;
  timing.retarget = 3;
  timing.deform = 4;
  timing.write = 5;
  addLabels(head, options, duration);
  addSound(head.utterance.audio, duration);
  return head;
}

}  // namespace mouthpiece::samples
