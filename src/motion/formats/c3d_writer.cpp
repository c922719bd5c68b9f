#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/file_parts.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/c3d_parameters.h"
#include "motion/position_limits.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kParameterBlock = 2;  // right behind the header
constexpr std::size_t kMaxParameterBlocks = 255;
constexpr std::size_t kPointBytes = 16;
constexpr std::size_t kMaxPoints = 65535;
constexpr std::size_t kMaxFrames = 0x7FFFFFFF;
constexpr std::size_t kMaxLabelBytes = 127;  // some readers take the dimension byte as signed
constexpr std::size_t kLabelsPerParameter = 255;
constexpr std::size_t kMaxEvents = 65535;
constexpr std::size_t kMaxEventTextBytes = 127;
constexpr double kFloatScale = -1;  // negative: the points are floats in real units

enum GroupId { kPointGroup = 1, kAnalogGroup = 2, kTrialGroup = 3, kEventGroup = 4 };

/// Writes groups and parameters one behind the other and keeps their "next" offsets.
class ParameterWriter {
 public:
  explicit ParameterWriter(ByteWriter& bytes) : bytes_(bytes) {}

  void group(GroupId id, std::string_view name) {
    begin(-id, name);
    end();
  }
  void integers(GroupId id, std::string_view name, const std::vector<std::size_t>& values) {
    begin(id, name);
    values.size() == 1 ? type(C3dParameterType::kInteger, {}) : type(C3dParameterType::kInteger, {values.size()});
    for (const std::size_t value : values) bytes_.writeU16(value);
    end();
  }
  /// The first dimension runs fastest; no dimension: one number.
  void numbers(GroupId id, std::string_view name, std::initializer_list<std::size_t> dimensions,
               const std::vector<double>& values) {
    begin(id, name);
    type(C3dParameterType::kFloat, dimensions);
    for (const double value : values) bytes_.writeF32(value);
    end();
  }
  void text(GroupId id, std::string_view name, std::string_view value) {
    begin(id, name);
    type(C3dParameterType::kText, {value.size()});
    bytes_.writeBytes(value);
    end();
  }
  /// Rows padded with blanks to the longest.
  void texts(GroupId id, std::string_view name, std::span<const std::string> rows) {
    std::size_t length = 0;
    for (const std::string& row : rows) length = std::max(length, row.size());
    begin(id, name);
    type(C3dParameterType::kText, {length, rows.size()});
    for (const std::string& row : rows) bytes_.writeBytes(row + std::string(length - row.size(), ' '));
    end();
  }

 private:
  void begin(int group_id, std::string_view name) {
    bytes_.writeU8(name.size());
    bytes_.writeU8(group_id);
    bytes_.writeBytes(name);
    offset_place_ = bytes_.size();
    bytes_.writeU16(0);
  }
  void type(C3dParameterType type, std::initializer_list<std::size_t> dimensions) {
    bytes_.writeU8(static_cast<int>(type));
    bytes_.writeU8(dimensions.size());
    for (const std::size_t dimension : dimensions) bytes_.writeU8(dimension);
  }
  void end() {
    bytes_.writeU8(0);  // no description
    bytes_.patchU16(offset_place_, bytes_.size() - offset_place_);
  }

  ByteWriter& bytes_;
  std::size_t offset_place_ = 0;
};

std::size_t saturated(std::size_t count) { return std::min<std::size_t>(count, 65535); }

std::vector<std::size_t> halves(std::size_t count) { return {count & 0xFFFFU, count >> 16U}; }

void refuseWhatDoesNotFit(const MotionInPieces& clip) {
  expectFrameRate(clip.frame_rate_hz, "C3D", "POINT:RATE");
  if (clip.markerCount() == 0 || clip.markerCount() > kMaxPoints) {
    throw InputError("C3D", "POINT:USED",
                     fmt::format("found {} markers; expected 1 to {}", clip.markerCount(), kMaxPoints));
  }
  if (clip.frame_count == 0 || clip.frame_count > kMaxFrames) {
    throw InputError("C3D", "POINT:FRAMES",
                     fmt::format("found {} frames; expected 1 to {}", clip.frame_count, kMaxFrames));
  }
  for (const std::string& name : clip.marker_names) {
    if (name.empty() || name.size() > kMaxLabelBytes) {
      throw InputError(
          "C3D", "POINT:LABELS",
          fmt::format("found marker name \"{}\"; expected 1 to {} bytes", printable(name), kMaxLabelBytes));
    }
  }
}

std::string numberedName(const std::string& parameter, std::size_t first_row) {
  const std::size_t number = first_row / kLabelsPerParameter + 1;
  return number == 1 ? parameter : fmt::format("{}{}", parameter, number);
}

/// One row for each marker or event, in LABELS, LABELS2, ...: a parameter holds 255 rows.
void writeRows(ParameterWriter& parameters, GroupId group, const std::string& parameter,
               const std::vector<std::string>& rows) {
  for (std::size_t first = 0; first < rows.size(); first += kLabelsPerParameter) {
    const std::size_t count = std::min(kLabelsPerParameter, rows.size() - first);
    parameters.texts(group, numberedName(parameter, first), std::span(rows).subspan(first, count));
  }
}

/// Whole minutes and seconds under 60, as floats.
std::array<double, 2> minutesAndSeconds(Seconds time) {
  const double minutes = std::floor(time / 60);
  const float seconds = asFloat(time - 60 * minutes);
  return seconds < 60.0F ? std::array{minutes, double{seconds}} : std::array{minutes + 1, 0.0};
}

void refuseEventsThatDoNotFit(const std::vector<MotionEvent>& events) {
  if (events.size() > kMaxEvents) {
    throw InputError("C3D", "EVENT:USED",
                     fmt::format("found {} events; expected at most {}", events.size(), kMaxEvents));
  }
  for (const MotionEvent& event : events) {
    if (event.label.size() > kMaxEventTextBytes || event.context.size() > kMaxEventTextBytes) {
      throw InputError("C3D", "EVENT:LABELS",
                       fmt::format("found event \"{}\"; expected at most {} bytes of label and of context",
                                   printable(event.label), kMaxEventTextBytes));
    }
    if (!(std::abs(event.time) <= kMaxEventTime)) {
      throw InputError("C3D", "EVENT:TIMES", fmt::format("found an event at {} s", event.time));
    }
  }
}

void writeEvents(ParameterWriter& parameters, const std::vector<MotionEvent>& events) {
  parameters.group(kEventGroup, "EVENT");
  parameters.integers(kEventGroup, "USED", {events.size()});
  std::vector<std::string> labels, contexts;
  for (const MotionEvent& event : events) {
    labels.push_back(event.label);
    contexts.push_back(event.context);
  }
  writeRows(parameters, kEventGroup, "CONTEXTS", contexts);
  writeRows(parameters, kEventGroup, "LABELS", labels);
  for (std::size_t first = 0; first < events.size(); first += kLabelsPerParameter) {
    std::vector<double> times;
    for (std::size_t i = first; i < std::min(first + kLabelsPerParameter, events.size()); ++i) {
      const auto [minutes, seconds] = minutesAndSeconds(events[i].time);
      times.insert(times.end(), {minutes, seconds});
    }
    parameters.numbers(kEventGroup, numberedName("TIMES", first), {2, times.size() / 2}, times);
  }
}

void writeHeader(ByteWriter& bytes, const MotionInPieces& clip) {
  bytes.writeU8(kParameterBlock);
  bytes.writeU8(0x50);
  bytes.writeU16(clip.markerCount());
  bytes.writeU16(0);  // analog values per frame
  bytes.writeU16(1);  // first frame
  bytes.writeU16(saturated(clip.frame_count));
  bytes.writeU16(0);  // longest gap interpolated
  bytes.writeF32(kFloatScale);
  bytes.writeU16(0);  // data block, patched below
  bytes.writeU16(0);  // analog samples per frame
  bytes.writeF32(clip.frame_rate_hz);
  bytes.padTo(kBlockBytes);
}

void writeParameters(ByteWriter& bytes, const MotionInPieces& clip, const std::vector<MotionEvent>& events,
                     std::size_t data_block) {
  ParameterWriter parameters(bytes);
  parameters.group(kPointGroup, "POINT");
  parameters.integers(kPointGroup, "USED", {clip.markerCount()});
  parameters.integers(kPointGroup, "FRAMES", {saturated(clip.frame_count)});
  parameters.integers(kPointGroup, "DATA_START", {data_block});
  parameters.numbers(kPointGroup, "SCALE", {}, {kFloatScale});
  parameters.numbers(kPointGroup, "RATE", {}, {clip.frame_rate_hz});
  parameters.text(kPointGroup, "UNITS", "mm");
  parameters.text(kPointGroup, "X_SCREEN", "+X");
  parameters.text(kPointGroup, "Y_SCREEN", "+Y");
  writeRows(parameters, kPointGroup, "LABELS", clip.marker_names);
  writeRows(parameters, kPointGroup, "DESCRIPTIONS", std::vector<std::string>(clip.markerCount(), " "));
  parameters.group(kAnalogGroup, "ANALOG");
  // No analog channel; readers look for these all the same, and compare the rate with the header's 0 samples a frame.
  parameters.integers(kAnalogGroup, "USED", {0});
  parameters.numbers(kAnalogGroup, "RATE", {}, {0.0});
  parameters.numbers(kAnalogGroup, "GEN_SCALE", {}, {1.0});
  parameters.texts(kAnalogGroup, "LABELS", {});
  parameters.texts(kAnalogGroup, "DESCRIPTIONS", {});
  parameters.texts(kAnalogGroup, "UNITS", {});
  parameters.integers(kAnalogGroup, "OFFSET", {});
  parameters.numbers(kAnalogGroup, "SCALE", {0}, {});
  parameters.group(kTrialGroup, "TRIAL");
  parameters.integers(kTrialGroup, "ACTUAL_START_FIELD", halves(1));
  parameters.integers(kTrialGroup, "ACTUAL_END_FIELD", halves(clip.frame_count));
  if (!events.empty()) writeEvents(parameters, events);
  bytes.writeU16(0);  // no further entry
}

std::string positionBytes(const PositionMatrix& positions_mm) {
  ByteWriter bytes;
  bytes.reserve(unsignedIndex(positions_mm.size() / 3) * kPointBytes);
  for (Eigen::Index frame = 0; frame < positions_mm.rows(); ++frame) {
    for (Eigen::Index column = 0; column < positions_mm.cols(); column += 3) {
      const Eigen::RowVector3d position = positions_mm.block<1, 3>(frame, column);
      const bool is_seen = position.allFinite();
      for (int axis = 0; axis < 3; ++axis) bytes.writeF32(is_seen ? position[axis] : 0.0);
      bytes.writeF32(is_seen ? 0.0 : -1.0);
    }
  }
  return bytes.takeBytes();
}

std::size_t roundUpToBlock(std::size_t size) { return (size + kBlockBytes - 1) / kBlockBytes * kBlockBytes; }

void appendC3d(const MotionInPieces& motion, const std::vector<MotionEvent>& events, const AppendBytes& append) {
  refuseWhatDoesNotFit(motion);
  refuseEventsThatDoNotFit(events);
  // Written once to learn how many blocks the parameters take.
  ByteWriter rehearsal;
  writeParameters(rehearsal, motion, events, 0);
  const std::size_t parameter_blocks = roundUpToBlock(4 + rehearsal.size()) / kBlockBytes;
  if (parameter_blocks > kMaxParameterBlocks) {
    throw InputError("C3D", "POINT:LABELS",
                     fmt::format("found {} bytes of marker names; expected at most {} with all parameters",
                                 rehearsal.size(), kMaxParameterBlocks * kBlockBytes));
  }
  const std::size_t data_block = kParameterBlock + parameter_blocks;

  ByteWriter bytes;
  writeHeader(bytes, motion);
  bytes.patchU16(16, data_block);
  bytes.writeU8(1);
  bytes.writeU8(0x50);
  bytes.writeU8(parameter_blocks);
  bytes.writeU8(84);  // Intel
  writeParameters(bytes, motion, events, data_block);
  bytes.padTo((data_block - 1) * kBlockBytes);
  append(bytes.takeBytes());
  motion.forEach([&](std::size_t, const PositionMatrix& positions_mm) {
    MOUTHPIECE_EXPECT(unsignedIndex(positions_mm.cols()) == 3 * motion.markerCount());
    append(positionBytes(positions_mm));
  });
  const std::size_t data_bytes = motion.frame_count * motion.markerCount() * kPointBytes;
  append(std::string(roundUpToBlock(data_bytes) - data_bytes, '\0'));
}

}  // namespace

std::string writeC3dBytes(const MotionClip& clip, const std::vector<MotionEvent>& events) {
  std::string bytes;
  appendC3d(inOnePiece(clip), events, [&bytes](std::string_view more) { bytes += more; });
  return bytes;
}

void writeC3d(const std::filesystem::path& path, const MotionClip& clip, const std::vector<MotionEvent>& events) {
  writeC3d(path, inOnePiece(clip), events);
}

void writeC3d(const std::filesystem::path& path, const MotionInPieces& motion, const std::vector<MotionEvent>& events) {
  writeFileInParts(path, [&](const AppendBytes& append) { appendC3d(motion, events, append); });
}

}  // namespace mouthpiece
