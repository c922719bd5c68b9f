#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/c3d_parameters.h"
#include "motion/position_limits.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxFileBytes = std::uint64_t{1} << 32U;
/// A 16-bit frame count stops here; longer files say so elsewhere.
constexpr double kMaxShortCount = 65535;

/// Bytes of the header: word 150 tells that there are events with labels of four letters.
constexpr std::size_t kHeaderEventKey = 298, kHeaderEventTimes = 304, kHeaderEventLabels = 396;
constexpr std::size_t kMostHeaderEvents = 18;
constexpr std::uint16_t kHasHeaderEvents = 12345;
constexpr std::size_t kLabelBytes = 4;

/// The words of the 512-byte header that matter for points.
struct Header {
  std::size_t point_count = 0;
  std::size_t analog_values_per_frame = 0;
  std::size_t first_frame = 0;
  std::size_t last_frame = 0;
  double scale = 0;
  std::size_t data_block = 0;
  double frame_rate_hz = 0;
};

/// Where the points lie and how they are stored.
struct PointFormat {
  C3dProcessor processor = C3dProcessor::kIntel;
  std::size_t point_count = 0;
  std::size_t frame_count = 0;
  std::size_t analog_values_per_frame = 0;
  std::size_t data_start = 0;  ///< byte of the first frame
  double frame_rate_hz = 0;
  bool is_float = true;
  double mm_per_unit = 1;  ///< millimetres of a stored 1

  [[nodiscard]] std::size_t bytesPerValue() const { return is_float ? 4 : 2; }
};

Header readHeader(ByteReader& reader, C3dProcessor processor) {
  Header header;
  reader.seek(2);
  header.point_count = reader.readU16();
  header.analog_values_per_frame = reader.readU16();
  header.first_frame = reader.readU16();
  header.last_frame = reader.readU16();
  reader.skip(2);
  header.scale = readC3dFloat(reader, processor);
  header.data_block = reader.readU16();
  reader.skip(2);
  header.frame_rate_hz = readC3dFloat(reader, processor);
  return header;
}

/// The number of frames. 16-bit counts stop at 65535 (or wrap); TRIAL or POINT:LONG_FRAMES then tells the real one. A
/// TRIAL range that contradicts a short count that fits is stale: editors that cut a file often leave it.
double claimedFrameCount(const C3dParameters& parameters, const Header& header) {
  const double in_header = asReal(header.last_frame) - asReal(header.first_frame) + 1.0;
  const double short_count = parameters.number("POINT", "FRAMES").value_or(in_header);
  double long_count = parameters.wideCount("POINT", "LONG_FRAMES");
  const double trial_end = parameters.wideCount("TRIAL", "ACTUAL_END_FIELD");
  if (trial_end > 0) {
    const double trial_start = parameters.wideCount("TRIAL", "ACTUAL_START_FIELD");
    long_count = std::max(long_count, trial_end - trial_start + 1.0);
  }
  const bool short_is_wrapped = short_count >= kMaxShortCount || std::fmod(long_count, 65536.0) == short_count;
  return long_count > kMaxShortCount && short_is_wrapped ? long_count : short_count;
}

double unitInMillimetres(const C3dParameters& parameters, std::string_view file) {
  const std::vector<std::string> units = parameters.allTexts("POINT", "UNITS", 1);
  if (units.empty() || units.front().empty() || units.front() == "mm" || units.front() == "MM") return 1.0;
  if (units.front() == "m" || units.front() == "M") return 1000.0;
  if (units.front() == "cm" || units.front() == "CM") return 10.0;
  throw InputError(file, "POINT:UNITS", fmt::format("found \"{}\"; expected mm, cm or m", printable(units.front())));
}

/// The header's number and the parameter may be written by different programs; the parameter counts.
double frameRate(const C3dParameters& parameters, const Header& header, std::string_view file) {
  const double rate = parameters.number("POINT", "RATE").value_or(0.0);
  expectFrameRate(rate != 0.0 ? rate : header.frame_rate_hz, file, "POINT:RATE");
  return rate != 0.0 ? rate : header.frame_rate_hz;
}

void takePointCount(PointFormat& format, const C3dParameters& parameters, const Header& header, std::string_view file) {
  const double used = parameters.number("POINT", "USED").value_or(asReal(header.point_count));
  if (used != asReal(header.point_count)) {
    throw InputError(file, "POINT:USED",
                     fmt::format("found {} points; expected {} as in the header", used, header.point_count));
  }
  if (header.point_count == 0) throw InputError(file, "POINT:USED", "found no points; expected markers");
  format.point_count = header.point_count;
}

void takeScale(PointFormat& format, const C3dParameters& parameters, const Header& header, std::string_view file) {
  const double scale = parameters.number("POINT", "SCALE").value_or(header.scale);
  if (!std::isfinite(scale) || scale == 0.0) {
    throw InputError(file, "POINT:SCALE", fmt::format("found {}; expected a number that is not zero", scale));
  }
  // A negative scale says that the points are floats in real units.
  format.is_float = scale < 0.0;
  format.mm_per_unit = unitInMillimetres(parameters, file) * (format.is_float ? 1.0 : scale);
}

/// Checks that the file holds all the frames it claims, before anything is allocated for them.
void takeFrames(PointFormat& format, const C3dParameters& parameters, const Header& header, const ByteReader& reader) {
  const std::size_t data_block = header.data_block != 0
                                     ? header.data_block
                                     : static_cast<std::size_t>(parameters.number("POINT", "DATA_START").value_or(0.0));
  if (data_block == 0) throw InputError(reader.fileName(), "byte 16", "found no data block; expected 2 or more");
  format.data_start = (data_block - 1) * kBlockBytes;
  format.analog_values_per_frame = header.analog_values_per_frame;
  const double claimed = claimedFrameCount(parameters, header);
  if (!(claimed >= 1.0)) throw InputError(reader.fileName(), "POINT:FRAMES", "found no frames; expected at least one");

  const std::size_t frame_bytes = (4 * format.point_count + format.analog_values_per_frame) * format.bytesPerValue();
  const std::size_t held = format.data_start < reader.size() ? (reader.size() - format.data_start) / frame_bytes : 0;
  if (claimed > asReal(held)) {
    throw InputError(reader.fileName(), fmt::format("byte {}", reader.size()),
                     fmt::format("the file ends after {} frames of points; expected {:.0f}", held, claimed));
  }
  format.frame_count = static_cast<std::size_t>(claimed);
}

/// Labels of POINT:LABELS, LABELS2, ...; each point gets a name of its own.
std::vector<std::string> pointNames(const C3dParameters& parameters, std::size_t point_count) {
  std::vector<std::string> names = parameters.allTexts("POINT", "LABELS", point_count);
  names.resize(point_count);
  std::set<std::string> used;
  for (std::size_t i = 0; i < point_count; ++i) {
    if (!names[i].empty() && used.insert(names[i]).second) continue;
    for (std::size_t number = i + 1;; number += point_count) {
      names[i] = fmt::format("unlabelled_{}", number);
      if (used.insert(names[i]).second) break;
    }
  }
  return names;
}

/// One point: three coordinates and the word with the residual, whose sign tells whether the point was seen.
Eigen::RowVector3d readPoint(ByteReader& reader, const PointFormat& format) {
  Eigen::RowVector3d position;
  bool is_seen = false;
  if (format.is_float) {
    for (int axis = 0; axis < 3; ++axis) position[axis] = readC3dFloat(reader, format.processor);
    is_seen = readC3dFloat(reader, format.processor) >= 0.0F && !position.hasNaN();
  } else {
    for (int axis = 0; axis < 3; ++axis) position[axis] = reader.readI16();
    is_seen = reader.readI16() >= 0;
  }
  if (!is_seen) return Eigen::RowVector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  position *= format.mm_per_unit;
  if (!(position.cwiseAbs().maxCoeff() <= kMaxPositionMm)) {
    reader.fail(fmt::format("found a position of {:g} mm; expected at most {:g}", position.cwiseAbs().maxCoeff(),
                            kMaxPositionMm));
  }
  return position;
}

PositionMatrix readPositions(ByteReader& reader, const PointFormat& format) {
  PositionMatrix positions(signedIndex(format.frame_count), signedIndex(3 * format.point_count));
  reader.seek(format.data_start);
  for (Eigen::Index frame = 0; frame < positions.rows(); ++frame) {
    for (Eigen::Index column = 0; column < positions.cols(); column += 3) {
      positions.block<1, 3>(frame, column) = readPoint(reader, format);
    }
    reader.skip(format.analog_values_per_frame * format.bytesPerValue());
  }
  return positions;
}

void expectUsableTime(double time, std::string_view file, std::string_view place) {
  if (std::abs(time) <= kMaxEventTime) return;  // false for NaN
  throw InputError(file, place, fmt::format("found an event at {} s; expected a usable time", time));
}

/// Minutes and seconds in pairs, over TIMES, TIMES2, ...
std::vector<double> eventTimes(const C3dParameters& parameters) {
  const std::vector<double> numbers = parameters.allNumbers("EVENT", "TIMES");
  std::vector<double> times;
  for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) times.push_back(60 * numbers[i] + numbers[i + 1]);
  return times;
}

std::vector<MotionEvent> eventsOfGroup(const C3dParameters& parameters, std::string_view file) {
  std::vector<double> times = eventTimes(parameters);
  const double used = parameters.number("EVENT", "USED").value_or(asReal(times.size()));
  if (used < asReal(times.size())) times.resize(static_cast<std::size_t>(std::max(used, 0.0)));
  std::vector<std::string> labels = parameters.allTexts("EVENT", "LABELS", times.size());
  std::vector<std::string> contexts = parameters.allTexts("EVENT", "CONTEXTS", times.size());
  labels.resize(times.size());
  contexts.resize(times.size());
  std::vector<MotionEvent> events;
  for (std::size_t i = 0; i < times.size(); ++i) {
    expectUsableTime(times[i], file, "EVENT:TIMES");
    events.push_back({std::move(labels[i]), std::move(contexts[i]), times[i]});
  }
  return events;
}

std::vector<MotionEvent> eventsOfHeader(ByteReader& reader, C3dProcessor processor) {
  std::vector<MotionEvent> events;
  if (reader.size() < kBlockBytes) return events;
  reader.seek(kHeaderEventKey);
  if (reader.readU16() != kHasHeaderEvents) return events;
  const std::size_t count = reader.readU16();
  if (count > kMostHeaderEvents) {
    reader.fail(fmt::format("found {} events; expected at most {}", count, kMostHeaderEvents));
  }
  reader.seek(kHeaderEventTimes);
  for (std::size_t i = 0; i < count; ++i) {
    const double time = readC3dFloat(reader, processor);
    expectUsableTime(time, reader.fileName(), fmt::format("byte {}", kHeaderEventTimes + 4 * i));
    events.push_back({{}, {}, time});
  }
  reader.seek(kHeaderEventLabels);
  for (MotionEvent& event : events) event.label = c3dText(reader.readBytes(kLabelBytes));
  return events;
}

/// Times count from frame 1 of the whole trial; a clip that was cut out of it begins later.
Seconds startOfClip(const Header& header, const C3dParameters& parameters, double frame_rate_hz) {
  const double first_frame = asReal(header.first_frame);
  const double trial_start = parameters.wideCount("TRIAL", "ACTUAL_START_FIELD");
  // The 16 bits of the header are the low ones of a later start; else TRIAL is stale.
  const bool is_the_same = std::fmod(trial_start, 65536.0) == first_frame;
  return std::max(0.0, (is_the_same ? trial_start : first_frame) - 1) / frame_rate_hz;
}

/// A C3D file, open: `reader` in the file's byte order.
struct OpenFile {
  ByteReader reader;
  C3dParameters parameters;
};

OpenFile openFile(std::string_view bytes, std::string_view name) {
  if (bytes.empty()) throw InputError(name, "", "is empty; expected a C3D file");
  ByteReader reader(bytes, name);
  const std::size_t parameter_block = reader.readU8();
  if (const int key = reader.readU8(); key != 0x50) {
    throw InputError(name, "byte 1", fmt::format("is no C3D file: found key {:#04x}; expected 0x50", key));
  }
  C3dParameters parameters = C3dParameters::read(bytes, name, parameter_block);
  reader.setOrder(parameters.byteOrder());
  return {std::move(reader), std::move(parameters)};
}

}  // namespace

MotionClip readC3dBytes(std::string_view bytes, std::string_view name) {
  auto [reader, parameters] = openFile(bytes, name);
  const Header header = readHeader(reader, parameters.processor());
  PointFormat format;
  format.processor = parameters.processor();
  takePointCount(format, parameters, header, name);
  format.frame_rate_hz = frameRate(parameters, header, name);
  takeScale(format, parameters, header, name);
  takeFrames(format, parameters, header, reader);
  return {format.frame_rate_hz, pointNames(parameters, format.point_count), readPositions(reader, format)};
}

MotionClip readC3d(const std::filesystem::path& path) {
  return readC3dBytes(readFile(path, kMaxFileBytes), path.string());
}

std::vector<MotionEvent> readC3dEventsBytes(std::string_view bytes, std::string_view name) {
  auto [reader, parameters] = openFile(bytes, name);
  std::vector<MotionEvent> events = parameters.find("EVENT", "TIMES") != nullptr
                                        ? eventsOfGroup(parameters, name)
                                        : eventsOfHeader(reader, parameters.processor());
  if (events.empty()) return events;
  const Header header = readHeader(reader, parameters.processor());
  const Seconds start = startOfClip(header, parameters, frameRate(parameters, header, name));
  for (MotionEvent& event : events) event.time -= start;
  return events;
}

std::vector<MotionEvent> readC3dEvents(const std::filesystem::path& path) {
  return readC3dEventsBytes(readFile(path, kMaxFileBytes), path.string());
}

}  // namespace mouthpiece
