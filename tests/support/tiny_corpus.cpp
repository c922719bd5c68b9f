#include "support/tiny_corpus.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "phonetics/labels/labels_builder.h"

namespace mouthpiece::samples {
namespace {

constexpr double kSilence = 0.2;

MarkerLayout tinyLayout() {
  MarkerLayout layout;
  layout.name = "tiny";
  const auto add = [&](const char* name, const char* region) {
    LayoutMarker marker;
    marker.name = name;
    marker.region = region;
    marker.mirror = MarkerIndex(layout.markers.size());
    layout.markers.push_back(marker);
  };
  add("LIP_UP_MID", "lip");
  add("LIP_LO_MID", "lip");
  add("CHIN", "chin");
  add("BROW", "brow");
  return layout;
}

double openingOf(Phone phone) {
  if (phone == Phone::kSil) return 1;
  if (isBilabial(phone)) return 0;
  return isVowel(phone) ? 12 + static_cast<double>(static_cast<int>(phone) % 5) : 5;
}

/// Each phone pulls the lips towards its opening; closures pull hardest. Smooth, since the weights are.
double openingAt(const SpeechLabels& labels, Seconds time) {
  double sum = 0;
  double weights = 0;
  for (const LabelledPhone& phone : labels.phones) {
    const double nearest =
        std::clamp(time, phone.span.start + 0.015, std::max(phone.span.start + 0.015, phone.span.end - 0.015));
    const double weight =
        (isBilabial(phone.phone) ? 30.0 : 1.0) * std::exp(-0.5 * std::pow((time - nearest) / 0.03, 2)) + 1e-12;
    sum += weight * openingOf(phone.phone);
    weights += weight;
  }
  return sum / weights;
}

}  // namespace

SpeechLabels tinyLabels(std::string_view words, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<PhoneSegment> segments;
  std::vector<std::string> texts;
  double time = kSilence;
  std::string text;
  std::string symbol;
  const auto endPhone = [&] {
    if (symbol.empty()) return;
    const double duration = seed == 0 ? 0.1 : 0.06 + 0.08 * static_cast<double>(random() % 1000) / 1000;
    segments.push_back({.phone = phoneFromName(symbol).value(), .span = {time, time + duration}, .word = texts.size()});
    time += duration;
    text += symbol;
    symbol.clear();
  };
  const auto endWord = [&] {
    endPhone();
    if (!text.empty()) texts.push_back(text);
    text.clear();
  };
  for (const char c : words) {
    if (c == '-') {
      endPhone();
    } else if (c == ' ') {
      endWord();
    } else if (c == '|') {
      time += kSilence;
    } else {
      symbol += c;
    }
  }
  endWord();
  return buildSpeechLabels(std::move(segments), texts, time + kSilence);
}

CorpusTake tinyTake(const std::string& name, std::string_view words, std::uint64_t seed, double frame_rate_hz) {
  CorpusTake take;
  take.name = name;
  take.text = words;
  take.labels = tinyLabels(words, seed);
  take.motion.frame_rate_hz = frame_rate_hz;
  take.motion.marker_names = tinyLayout().markerNames();
  const auto frames = static_cast<Eigen::Index>(std::ceil(take.labels.duration() * frame_rate_hz)) + 1;
  take.motion.positions_mm.resize(frames, 12);
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    const double open = openingAt(take.labels, static_cast<double>(frame) / frame_rate_hz);
    take.motion.positions_mm.row(frame) << 0, 0.2 * open, 10, 0, -0.8 * open, 10, 0, -20 - 0.9 * open, 5, 0,
        50 + std::sin(0.05 * static_cast<double>(frame)), 5;
  }
  // As a corpus file holds it.
  take.motion.positions_mm = take.motion.positions_mm.cast<float>().cast<double>();
  take.audio.sample_rate_hz = 8000;
  take.audio.samples.resize(static_cast<std::size_t>(take.labels.duration() * 8000));
  for (std::size_t i = 0; i < take.audio.samples.size(); ++i) {
    take.audio.samples[i] = static_cast<float>((i * 37 + seed * 11) % 256) / 512.0F - 0.25F;
  }
  return take;
}

Corpus tinyCorpus(const std::vector<std::string>& lines, double frame_rate_hz) {
  Corpus corpus;
  corpus.name = "tiny";
  corpus.layout = tinyLayout();
  corpus.neutral_pose_mm.resize(4, 3);
  corpus.neutral_pose_mm << 0, 0.2, 10, 0, -0.8, 10, 0, -20.9, 5, 0, 50, 5;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    corpus.takes.push_back(tinyTake("take" + std::to_string(i), lines[i], i + 1, frame_rate_hz));
  }
  corpus.build_log = {{"built_with", "tiny_corpus"}};
  return corpus;
}

Corpus tinyCorpus() {
  return tinyCorpus({"DH-AH T-AY-M IH-Z N-AW", "IH-T IH-Z T-EH-N", "AH M-AE-N AE-T N-UW-N", "T-EH-N M-EH-N | AH-P N-AW",
                     "N-AW AY M-AE-P DH-AH M-UW-N", "B-EH-D T-AY-M | M-AO-R T-IY"});
}

std::vector<double> lipOpening(const MotionClip& motion) {
  std::vector<double> opening;
  for (Eigen::Index frame = 0; frame < motion.positions_mm.rows(); ++frame) {
    const auto row = motion.positions_mm.row(frame);
    opening.push_back((row.segment<3>(0) - row.segment<3>(3)).norm());
  }
  return opening;
}

}  // namespace mouthpiece::samples
