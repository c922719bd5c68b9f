// Events of a C3D file: the EVENT group, or the header's old-style list of at most 18.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/c3d_parameters.h"
#include "motion/position_limits.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxFileBytes = std::uint64_t{1} << 32U;
constexpr std::size_t kHeaderBytes = 512;
/// Bytes of the header: word 150 tells that there are events with labels of four letters.
constexpr std::size_t kHeaderEventKey = 298, kHeaderEventTimes = 304, kHeaderEventLabels = 396;
constexpr std::size_t kMostHeaderEvents = 18;
constexpr std::uint16_t kHasHeaderEvents = 12345;
constexpr std::size_t kLabelBytes = 4;

std::string withoutPadding(std::string_view text) {
  std::string label(text.substr(0, text.find('\0')));
  label.erase(label.find_last_not_of(" \t") + 1);
  return label;
}

void expectUsableTime(double time, std::string_view file, std::string_view place) {
  if (std::abs(time) <= kMaxEventTime) return;  // false for NaN
  throw InputError(file, place, fmt::format("found an event at {} s; expected a usable time", time));
}

/// Minutes and seconds in pairs, over TIMES, TIMES2, ...
std::vector<double> eventTimes(const C3dParameters& parameters) {
  std::vector<double> numbers = parameters.numbers("EVENT", "TIMES");
  for (int i = 2; parameters.find("EVENT", fmt::format("TIMES{}", i)) != nullptr; ++i) {
    const std::vector<double> more = parameters.numbers("EVENT", fmt::format("TIMES{}", i));
    numbers.insert(numbers.end(), more.begin(), more.end());
  }
  std::vector<double> times;
  for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) times.push_back(60 * numbers[i] + numbers[i + 1]);
  return times;
}

std::vector<MotionEvent> eventsOfGroup(const C3dParameters& parameters, std::string_view file) {
  std::vector<double> times = eventTimes(parameters);
  const double used = parameters.number("EVENT", "USED").value_or(static_cast<double>(times.size()));
  if (used < static_cast<double>(times.size())) times.resize(static_cast<std::size_t>(std::max(used, 0.0)));
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
  if (reader.size() < kHeaderBytes) return events;
  reader.seek(kHeaderEventKey);
  if (reader.readU16() != kHasHeaderEvents) return events;
  const std::size_t count = reader.readU16();
  if (count > kMostHeaderEvents) {
    reader.fail(fmt::format("found {} events; expected at most {}", count, kMostHeaderEvents));
  }
  reader.seek(kHeaderEventTimes);
  for (std::size_t i = 0; i < count; ++i) {
    const double time = static_cast<double>(readC3dFloat(reader, processor));
    expectUsableTime(time, reader.fileName(), fmt::format("byte {}", kHeaderEventTimes + 4 * i));
    events.push_back({{}, {}, time});
  }
  reader.seek(kHeaderEventLabels);
  for (MotionEvent& event : events) event.label = withoutPadding(reader.readBytes(kLabelBytes));
  return events;
}

/// Times count from frame 1 of the whole trial; a clip that was cut out of it begins later.
Seconds startOfClip(ByteReader& reader, const C3dParameters& parameters, double frame_rate_hz) {
  reader.seek(6);
  const auto first_frame = static_cast<double>(reader.readU16());
  const double trial_start = parameters.wideCount("TRIAL", "ACTUAL_START_FIELD");
  // The 16 bits of the header are the low ones of a later start; else TRIAL is stale.
  const bool is_the_same = std::fmod(trial_start, 65536.0) == first_frame;
  const double first = is_the_same ? trial_start : first_frame;
  return std::max(0.0, first - 1) / frame_rate_hz;
}

}  // namespace

std::vector<MotionEvent> readC3dEventsBytes(std::string_view bytes, std::string_view name) {
  ByteReader reader(bytes, name);
  const std::size_t parameter_block = reader.readU8();
  const C3dParameters parameters = C3dParameters::read(bytes, name, parameter_block);
  reader.setOrder(parameters.byteOrder());
  std::vector<MotionEvent> events = parameters.find("EVENT", "TIMES") != nullptr
                                        ? eventsOfGroup(parameters, name)
                                        : eventsOfHeader(reader, parameters.processor());
  if (events.empty()) return events;
  reader.seek(20);
  double frame_rate_hz = static_cast<double>(readC3dFloat(reader, parameters.processor()));
  const double rate = parameters.number("POINT", "RATE").value_or(0.0);
  if (rate != 0.0) frame_rate_hz = rate;
  expectFrameRate(frame_rate_hz, name, "POINT:RATE");
  const Seconds start = startOfClip(reader, parameters, frame_rate_hz);
  for (MotionEvent& event : events) event.time -= start;
  return events;
}

std::vector<MotionEvent> readC3dEvents(const std::filesystem::path& path) {
  return readC3dEventsBytes(readFile(path, kMaxFileBytes), path.string());
}

}  // namespace mouthpiece
