#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_numbers.h"
#include "exports/arkit.h"

namespace mouthpiece {
namespace {

using Eigen::Index;

constexpr float kNoFace = std::numeric_limits<float>::quiet_NaN();
/// ARKit's weights end at 1; apps that scale them go a little further.
constexpr double kLargestWeight = 2;
constexpr double kSecondsOfDay = 86400;
/// A time code that jumps further than this share of the recording belongs to two recordings.
constexpr std::size_t kMostFramesPerRow = 2;
constexpr std::size_t kFramesGiven = 600;
/// Frame numbers that tell no rate by themselves, because the recording is shorter than a second.
constexpr double kUsualRateHz = 60;

/// hh:mm:ss:ff.fff, whole seconds and frames apart.
struct TimeCode {
  double seconds = 0;
  double frames = 0;
};

struct Row {
  TimeCode time;
  std::size_t line = 0;
  bool has_face = false;
  std::array<float, kArkitNames.size()> weights{};
};

bool equalInAnyCase(std::string_view found, std::string_view lower) {
  return std::equal(found.begin(), found.end(), lower.begin(), lower.end(),
                    [](char a, char b) { return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b; });
}

bool isHeadColumn(std::string_view name) {
  return equalInAnyCase(name, "headyaw") || equalInAnyCase(name, "headpitch") || equalInAnyCase(name, "headroll");
}

class LiveLinkReader {
 public:
  LiveLinkReader(std::string_view text, std::string_view file) : file_(file), lines_(text) {}

  ArkitTrack read(double frame_rate_hz) {
    readHeader();
    std::string_view line;
    while (lines_.next(line)) {
      if (!trimmed(line).empty()) rows_.push_back(readRow(line));
    }
    if (rows_.size() < 2) fail("", fmt::format("holds {} frames; expected at least two", rows_.size()));
    const double rate_hz = frame_rate_hz > 0 ? frame_rate_hz : rateOfFrameNumbers();
    return onEvenFrames(rate_hz);
  }

 private:
  [[noreturn]] void fail(std::string_view place, std::string_view what) const { throw InputError(file_, place, what); }
  [[noreturn]] void failHere(std::string_view what) const { fail(fmt::format("{}", lines_.lineNumber()), what); }

  void readHeader() {
    std::string_view line;
    if (!lines_.next(line)) fail("", "is empty; expected Live Link Face's header Timecode,BlendShapeCount,...");
    std::vector<std::string_view> names;
    splitFields(line, ',', names);
    if (!isLiveLinkCsv(line)) {
      fail("1", fmt::format("found first column \"{}\"; expected Timecode", printable(trimmed(names[0]))));
    }
    std::vector<bool> has_shape(kArkitNames.size(), false);
    for (const std::string_view name : names) {
      // Halves of a shape have no place here: Live Link's names are Apple's.
      const int shape = arkitIndex(trimmed(name));
      if (shape >= 0 && has_shape[unsignedIndex(shape)]) {
        fail("1", fmt::format("found the shape {} twice; expected it once", printable(trimmed(name))));
      }
      if (shape >= 0) has_shape[unsignedIndex(shape)] = true;
      shape_of_column_.push_back(shape);
      turns_head_.push_back(isHeadColumn(trimmed(name)));
    }
    track_.has_shape = std::move(has_shape);
    if (std::none_of(track_.has_shape.begin(), track_.has_shape.end(), [](bool has) { return has; })) {
      fail("1", "names no shape of ARKit; expected columns such as JawOpen");
    }
  }

  Row readRow(std::string_view line) {
    splitFields(line, ',', cells_);
    Row row{.time = readTimeCode(trimmed(cells_[0])), .line = lines_.lineNumber()};
    // Without a face the app writes the time code and a count of 0.
    row.has_face = std::any_of(cells_.begin() + signedIndex(std::min<std::size_t>(2, cells_.size())), cells_.end(),
                               [](std::string_view cell) { return !trimmed(cell).empty(); });
    if (!row.has_face) return row;
    if (cells_.size() != shape_of_column_.size()) {
      failHere(fmt::format("found {} cells; expected {} as in the header", cells_.size(), shape_of_column_.size()));
    }
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (turns_head_[i]) track_.turns_head = track_.turns_head || parseNumber(cells_[i]).value_or(0) != 0;
      if (shape_of_column_[i] < 0) continue;
      const std::optional<double> value = parseNumber(cells_[i]);
      if (!value || !(*value >= 0 && *value <= kLargestWeight)) {
        failHere(fmt::format("found \"{}\" for {}; expected a weight of 0 to {}", printable(trimmed(cells_[i])),
                             kArkitNames[unsignedIndex(shape_of_column_[i])], kLargestWeight));
      }
      row.weights[unsignedIndex(shape_of_column_[i])] = asFloat(*value);
    }
    return row;
  }

  [[nodiscard]] TimeCode readTimeCode(std::string_view text) const {
    std::vector<std::string_view> parts;
    splitFields(text, ':', parts);
    std::array<double, 4> values{};
    bool is_good = parts.size() == 4;
    for (std::size_t i = 0; is_good && i < 4; ++i) {
      const std::optional<double> value = parseNumber(parts[i]);
      constexpr std::array kLimits{24.0, 60.0, 60.0, 1000.0};
      is_good = value && *value >= 0 && *value < kLimits[i] && (i == 3 || *value == std::floor(*value));
      if (is_good) values[i] = *value;
    }
    if (!is_good) failHere(fmt::format("found time code \"{}\"; expected hh:mm:ss:ff.fff", printable(text)));
    return {3600 * values[0] + 60 * values[1] + values[2], values[3]};
  }

  /// The frame number that a second ends with tells how many there are.
  [[nodiscard]] double rateOfFrameNumbers() const {
    double most = 0;
    for (const Row& row : rows_) most = std::max(most, std::floor(row.time.frames));
    if (rows_.front().time.seconds == rows_.back().time.seconds) return std::max(kUsualRateHz, most + 1);
    constexpr std::array kUsual{24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0};
    // The last frame of every second may have been dropped.
    for (const double rate : kUsual) {
      if (most < rate && most + 1 + kLongestDrop >= rate) return rate;
    }
    return most + 1;
  }

  [[nodiscard]] std::vector<double> timesInFrames(double rate_hz) const {
    const double frames_a_second = std::round(rate_hz);
    std::vector<double> times;
    double day = 0;
    for (const Row& row : rows_) {
      if (row.time.frames >= frames_a_second) {
        fail(fmt::format("{}", row.line),
             fmt::format("found frame {:g} of a second; expected under {:g}", row.time.frames, frames_a_second));
      }
      double time = frames_a_second * (day + row.time.seconds) + row.time.frames;
      if (!times.empty() && time < times.back() - frames_a_second * kSecondsOfDay / 2) {
        day += kSecondsOfDay;  // midnight
        time += frames_a_second * kSecondsOfDay;
      }
      if (!times.empty() && !(time > times.back())) {
        fail(fmt::format("{}", row.line), "found a time code that is not behind the one before; expected it to rise");
      }
      times.push_back(time);
    }
    return times;
  }

  /// Rows lie where their time codes say; a frame takes its share of the two around it.
  ArkitTrack onEvenFrames(double rate_hz) {
    const std::vector<double> times = timesInFrames(rate_hz);
    const auto frames = unsignedIndex(std::llround(times.back() - times.front())) + 1;
    if (frames > kMostFramesPerRow * rows_.size() + kFramesGiven) {
      fail("", fmt::format("spans {} frames but holds {} rows; expected one recording without long breaks", frames,
                           rows_.size()));
    }
    track_.frame_rate_hz = rate_hz;
    track_.weights.setConstant(signedIndex(frames), signedIndex(kArkitNames.size()), kNoFace);
    std::size_t after = 1;
    for (std::size_t frame = 0; frame < frames; ++frame) {
      const double time = std::clamp(times.front() + asReal(frame), times.front(), times.back());
      while (after + 1 < rows_.size() && times[after] < time) ++after;
      const double gap = times[after] - times[after - 1];
      const Row &first = rows_[after - 1], &second = rows_[after];
      const auto share = asFloat((time - times[after - 1]) / gap);
      // A row at the frame itself needs no neighbour.
      if (share > 0 && share < 1 && gap > kLongestDrop + 1.5) continue;
      if ((share < 1 && !first.has_face) || (share > 0 && !second.has_face)) continue;
      for (std::size_t k = 0; k < kArkitNames.size(); ++k) {
        track_.weights(signedIndex(frame), signedIndex(k)) =
            first.weights[k] + share * (second.weights[k] - first.weights[k]);
      }
    }
    return std::move(track_);
  }

  std::string file_;
  LineReader lines_;
  std::vector<int> shape_of_column_;
  std::vector<bool> turns_head_;  ///< by column
  std::vector<std::string_view> cells_;
  std::vector<Row> rows_;
  ArkitTrack track_;
};

}  // namespace

bool isLiveLinkCsv(std::string_view text) {
  LineReader lines(text);
  std::string_view line;
  if (!lines.next(line)) return false;
  const std::string_view first = trimmed(line.substr(0, line.find(',')));
  return equalInAnyCase(first, "timecode");
}

ArkitTrack parseLiveLinkCsv(std::string_view text, std::string_view file, double frame_rate_hz) {
  return LiveLinkReader(text, file).read(frame_rate_hz);
}

}  // namespace mouthpiece
