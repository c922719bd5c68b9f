#include "synthetic_takes.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "base/files.h"
#include "motion/formats/c3d_file.h"
#include "phonetics/labels/labels_builder.h"
#include "phonetics/labels/textgrid.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

constexpr double kOpenMm = 14;
constexpr double kDegree = std::numbers::pi / 180;

/// Height of a region, mm above the canthi.
double heightOf(const std::string& region) {
  static const std::map<std::string, double> heights = {{"forehead", 50}, {"temple", 10}, {"brow", 20},   {"lid", 2},
                                                        {"canthus", 0},   {"nose", -25},  {"cheek", -40}, {"lip", -68},
                                                        {"chin", -95},    {"jaw", -80}};
  return heights.at(region);
}

double openingOf(const std::string& phone) {
  if (phone == "sil" || phone == "B" || phone == "P" || phone == "M") return 0;
  return isVowel(*phoneFromName(phone)) ? kOpenMm : 0.4 * kOpenMm;
}

/// Straight between the middles of the phones, a smooth step on top.
double openingAt(const SpeechLabels& labels, Seconds time) {
  const auto opening = [&](std::size_t i) { return openingOf(std::string(phoneName(labels.phones[i].phone))); };
  for (std::size_t i = 0; i + 1 < labels.phones.size(); ++i) {
    const Seconds from = labels.phones[i].span.middle(), to = labels.phones[i + 1].span.middle();
    if (time < from || time > to) continue;
    const double u = (time - from) / (to - from);
    const double smooth = u * u * (3 - 2 * u);
    return (1 - smooth) * opening(i) + smooth * opening(i + 1);
  }
  return 0;
}

/// Share of the opening that a marker goes down by; the upper lip rises a little.
double followsOpening(const LayoutMarker& marker) {
  if (marker.region == "chin" || marker.region == "jaw") return 0.9;
  if (marker.name.starts_with("LIP_LO")) return 0.85;
  if (marker.name.starts_with("LIP_UP")) return -0.15;
  if (marker.name.starts_with("LIP_CORNER")) return 0.3;
  return 0;
}

MarkerPositions jigShape() {
  MarkerPositions jig(7, 3);
  jig << -60, 90, 20, 60, 90, 20, 0, 120, 40, -30, 100, 70, 35, 105, 65, -80, 95, -30, 75, 100, -25;
  return jig;
}

}  // namespace

MarkerPositions syntheticNeutral() {
  const MarkerLayout& layout = defaultLayout();
  MarkerPositions pose(static_cast<Eigen::Index>(layout.markers.size()), 3);
  std::map<std::string, int> met;
  for (std::size_t i = 0; i < layout.markers.size(); ++i) {
    const LayoutMarker& marker = layout.markers[i];
    // Of a mirrored pair the right one sets the place; the left one, met later, mirrors it.
    if (marker.side == Side::kLeft && marker.mirror.value < i) {
      pose.row(static_cast<Eigen::Index>(i)) = pose.row(static_cast<Eigen::Index>(marker.mirror.value));
      pose(static_cast<Eigen::Index>(i), 0) *= -1;
      continue;
    }
    const int number = met[marker.region + (marker.side == Side::kMiddle ? "M" : "")]++;
    const double x = marker.side == Side::kMiddle ? 0 : -(15 + 9.0 * number);
    const double y =
        heightOf(marker.region) + 6.0 * number * (number % 2 == 0 ? 1 : -1) * (marker.region == "lip" ? 0.4 : 1);
    const double z = 90 * std::sqrt(std::max(0.05, 1 - x * x / 8000 - y * y / 22000));
    pose.row(static_cast<Eigen::Index>(i)) << x, y, z;
  }
  const auto place = [&](const char* name, double x, double y, double z) {
    pose.row(static_cast<Eigen::Index>(layout.indexOf(name).value)) << x, y, z;
  };
  place("CANTHUS_OUT_R", -45, 0, 0);
  place("CANTHUS_OUT_L", 45, 0, 0);
  place("LIP_CORNER_R", -25, -68, 20);
  place("LIP_CORNER_L", 25, -68, 20);
  place("LIP_UP_MID", 0, -62, 32);
  place("LIP_LO_MID", 0, -75, 30);
  return pose;
}

SpeechLabels SyntheticTake::labels() const {
  std::vector<PhoneSegment> segments;
  Seconds time = 0;
  for (const std::string& phone : phones) {
    const Seconds length = phone == "sil" ? 0.4 : 0.1;
    PhoneSegment segment{*phoneFromName(phone), {time, time + length}};
    if (phone != "sil") segment.word = 0;
    segments.push_back(segment);
    time += length;
  }
  return buildSpeechLabels(std::move(segments), words, time);
}

MotionClip SyntheticTake::truth() const {
  const MarkerLayout& layout = defaultLayout();
  const MarkerPositions neutral = syntheticNeutral();
  const SpeechLabels spoken = labels();
  MotionClip clip{frame_rate_hz, layout.markerNames(), {}};
  const auto frames = static_cast<Eigen::Index>(std::lround(spoken.duration() * frame_rate_hz));
  clip.positions_mm.resize(frames, 3 * neutral.rows());
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    const double opening = openingAt(spoken, static_cast<double>(frame) / frame_rate_hz);
    for (Eigen::Index marker = 0; marker < neutral.rows(); ++marker) {
      Eigen::RowVector3d place = neutral.row(marker);
      place[1] -= opening * followsOpening(layout.markers[static_cast<std::size_t>(marker)]);
      clip.positions_mm.block<1, 3>(frame, 3 * marker) = place;
    }
  }
  return clip;
}

RigidMotion SyntheticTake::worldFromHead(Seconds time) const {
  const double phase = seed;
  const Eigen::Matrix3d rotation =
      (Eigen::AngleAxisd(head_swing * 12 * kDegree * std::sin(3.1 * time + phase), Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(head_swing * 8 * kDegree * std::sin(4.7 * time + 2 * phase), Eigen::Vector3d::UnitX()) *
       Eigen::AngleAxisd(head_swing * 5 * kDegree * std::cos(2.3 * time + phase), Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  const Eigen::Vector3d moved(20 * std::sin(2 * time), 10 * std::cos(3 * time + phase), 15 * std::sin(time + phase));
  return {rotation, Eigen::Vector3d(400, 1200, -300) + head_swing * moved};
}

RawTake SyntheticTake::raw() const {
  RawTake take{name, words.empty() ? "" : words[0], labels(), truth(), {}, audio(), false, {}};
  take.jig = MotionClip{frame_rate_hz, defaultLayout().jig_names, {}};
  const MarkerPositions jig = jigShape();
  take.jig.positions_mm.resize(take.face.positions_mm.rows(), 3 * jig.rows());
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, noise_mm > 0 ? noise_mm : 1e-300);
  const auto shaken = [&](const Eigen::Vector3d& point) {
    return Eigen::RowVector3d(point[0] + noise(random), point[1] + noise(random), point[2] + noise(random));
  };
  for (Eigen::Index frame = 0; frame < take.face.positions_mm.rows(); ++frame) {
    const RigidMotion world_from_head = worldFromHead(static_cast<double>(frame) / frame_rate_hz);
    for (Eigen::Index column = 0; column < take.face.positions_mm.cols(); column += 3) {
      const Eigen::Vector3d head = take.face.positions_mm.block<1, 3>(frame, column).transpose();
      take.face.positions_mm.block<1, 3>(frame, column) = scale * shaken(world_from_head.apply(head));
    }
    for (Eigen::Index marker = 0; marker < jig.rows(); ++marker) {
      const Eigen::RowVector3d place = scale * shaken(world_from_head.apply(jig.row(marker).transpose()));
      take.jig.positions_mm.block<1, 3>(frame, 3 * marker) =
          has_jig ? place : Eigen::RowVector3d::Constant(std::nan(""));
    }
  }
  return take;
}

AudioClip SyntheticTake::audio() const {
  return {8000, std::vector<float>(static_cast<std::size_t>(std::lround(labels().duration() * 8000)), 0.01F)};
}

CorpusTake SyntheticTake::clean() const { return {name, words.empty() ? "" : words[0], labels(), truth(), audio()}; }

void SyntheticTake::write(const std::filesystem::path& folder) const {
  const RawTake take = raw();
  MotionClip all = take.face;
  if (has_jig) {
    all.marker_names.insert(all.marker_names.end(), take.jig.marker_names.begin(), take.jig.marker_names.end());
    all.positions_mm.conservativeResize(Eigen::NoChange, take.face.positions_mm.cols() + take.jig.positions_mm.cols());
    all.positions_mm.rightCols(take.jig.positions_mm.cols()) = take.jig.positions_mm;
  }
  writeC3d(folder / (name + ".c3d"), all);
  writeWav(folder / (name + ".wav"), take.audio);
  writeTextGrid(folder / (name + ".TextGrid"), take.labels);
  writeFileAtomically(folder / (name + ".txt"), std::string_view(take.text));
}

CorpusTake saidTake(const std::string& name, const std::vector<std::string>& phones) {
  SyntheticTake take;
  take.name = name;
  take.phones = {"sil"};
  take.phones.insert(take.phones.end(), phones.begin(), phones.end());
  take.phones.emplace_back("sil");
  take.words = {name};
  return take.clean();
}

Corpus corpusOf(const std::string& name, std::vector<CorpusTake> takes) {
  Corpus corpus;
  corpus.name = name;
  corpus.layout = defaultLayout();
  corpus.neutral_pose_mm = syntheticNeutral();
  corpus.takes = std::move(takes);
  return corpus;
}

Corpus speakingCorpus() {
  const std::vector<std::vector<std::string>> lines = {{"B", "IH", "M", "IH", "N", "IY"},
                                                       {"M", "AA", "M", "AA"},
                                                       {"P", "AA", "P", "AA", "N"},
                                                       {"AA", "N", "IY"},
                                                       {"B", "IY", "N"},
                                                       {"N", "AA", "M", "IY"},
                                                       {"M", "IY", "N", "AA"},
                                                       {"P", "IY", "AA", "N"},
                                                       {"IY", "M", "AA", "N", "AA"},
                                                       {"B", "AA", "N", "IY"}};
  std::vector<CorpusTake> takes;
  for (std::size_t i = 0; i < lines.size(); ++i) takes.push_back(saidTake("take" + std::to_string(i), lines[i]));
  return corpusOf("speaking", std::move(takes));
}

BuildResult buildCorpus(const std::filesystem::path& folder, const BuildOptions& options) {
  const test::ScratchFolder scratch;
  BuildResult result = buildCorpusFile(folder, scratch.path() / "built.corpus", options);
  result.corpus = readCorpus(scratch.path() / "built.corpus", CorpusAudio::kLoad);
  return result;
}

double angleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.transpose() * b)).angle() / kDegree;
}

}  // namespace mouthpiece
