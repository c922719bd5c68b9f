#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace mouthpiece {

/// Puts C3D files together byte by byte, without any code of the library, for all three processors.
struct C3dByHand {
  struct Event {
    std::string context, label;
    int minutes = 0;
    float seconds = 0;
  };
  int processor = 84;  // 84 Intel, 85 DEC, 86 MIPS
  bool is_float = true;
  float scale = -1.0F;
  std::string units = "mm";
  std::vector<std::string> labels{"A", "B"};
  std::size_t labels_per_parameter = 255;
  int first_frame = 1;
  int last_frame = 3;
  int analog_values_per_frame = 0;
  float rate_hz = 50.0F;
  bool groups_last = false;            ///< parameters before the groups they belong to
  bool with_frames = true;             ///< POINT:FRAMES
  int trial_start = 0, trial_end = 0;  ///< TRIAL fields when the end is not 0
  std::size_t frames_in_data = 3;
  std::vector<Event> group_events;   ///< of the EVENT group
  int events_used = -1;              ///< EVENT:USED; -1: as many as there are
  std::vector<Event> header_events;  ///< old style: seconds, four letters, no context
  /// x y z residual of each point; every frame is this plus the frame number on x.
  std::vector<std::vector<double>> points{{1.5, -2.25, 300.0, 0.0}, {-0.5, 40.0, 7.0, 0.0}};

  [[nodiscard]] std::string word(std::uint32_t value) const {
    const char low = static_cast<char>(value & 0xFFU);
    const char high = static_cast<char>((value >> 8U) & 0xFFU);
    return processor == 86 ? std::string{high, low} : std::string{low, high};
  }
  [[nodiscard]] std::string real(float value) const {
    if (processor == 85) {
      // VAX F: value = (0.5 + fraction / 2^24) 2^(exponent - 128); high word first, each word little-endian.
      if (value == 0.0F) return std::string(4, '\0');
      int exponent = 0;
      const double half_to_one = std::frexp(std::abs(static_cast<double>(value)), &exponent);
      const auto fraction = static_cast<std::uint32_t>(std::lround((half_to_one - 0.5) * 16777216.0));
      const std::uint32_t bits =
          (value < 0.0F ? 0x80000000U : 0U) | (static_cast<std::uint32_t>(exponent + 128) << 23U) | fraction;
      return word(bits >> 16U) + word(bits & 0xFFFFU);
    }
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return processor == 86 ? word(bits >> 16U) + word(bits & 0xFFFFU) : word(bits & 0xFFFFU) + word(bits >> 16U);
  }
  [[nodiscard]] std::string entry(int group, const std::string& name, const std::string& body) const {
    const std::string described = body + std::string("\x04note", 5);
    return std::string{static_cast<char>(name.size()), static_cast<char>(group)} + name +
           word(static_cast<std::uint32_t>(described.size() + 2)) + described;
  }
  [[nodiscard]] std::string textParameter(int group, const std::string& name, const std::string& text) const {
    return entry(group, name, std::string{'\xFF', 1, static_cast<char>(text.size())} + text);
  }
  [[nodiscard]] std::string integerParameter(int group, const std::string& name, std::vector<int> values) const {
    std::string body{2, static_cast<char>(values.size() > 1 ? 1 : 0)};
    if (values.size() > 1) body += static_cast<char>(values.size());
    for (const int value : values) body += word(static_cast<std::uint32_t>(value));
    return entry(group, name, body);
  }
  [[nodiscard]] std::string realParameter(int group, const std::string& name, float value) const {
    return entry(group, name, std::string{4, 0} + real(value));
  }
  [[nodiscard]] std::string labelParameters(int group) const {
    std::string all;
    for (std::size_t first = 0; first < labels.size(); first += labels_per_parameter) {
      const std::size_t count = std::min(labels_per_parameter, labels.size() - first);
      std::string body{'\xFF', 2, 12, static_cast<char>(count)};
      for (std::size_t i = first; i < first + count; ++i) body += (labels[i] + std::string(12, ' ')).substr(0, 12);
      const std::size_t number = first / labels_per_parameter + 1;
      std::string name = "LABELS";
      if (number > 1) name += std::to_string(number);
      all += entry(group, name, body);
    }
    return all;
  }

  [[nodiscard]] std::string eventParameters(int group) const {
    const auto count = static_cast<char>(group_events.size());
    std::string contexts{'\xFF', 2, 16, count}, event_labels{'\xFF', 2, 32, count}, times{4, 2, 2, count};
    for (const Event& event : group_events) {
      contexts += (event.context + std::string(16, ' ')).substr(0, 16);
      event_labels += (event.label + std::string(32, '\0')).substr(0, 32);
      times += real(static_cast<float>(event.minutes)) + real(event.seconds);
    }
    const int used = events_used < 0 ? static_cast<int>(group_events.size()) : events_used;
    return integerParameter(group, "USED", {used}) + entry(group, "CONTEXTS", contexts) +
           entry(group, "LABELS", event_labels) + entry(group, "TIMES", times);
  }
  /// Words 150 to 234.
  [[nodiscard]] std::string headerEvents() const {
    std::string part = word(12345) + word(static_cast<std::uint32_t>(header_events.size())) + word(0);
    for (const Event& event : header_events) part += real(event.seconds);
    part.resize(396 - 298, '\0');
    for (const Event& event : header_events) part += (event.label + std::string(4, ' ')).substr(0, 4);
    return part;
  }

  [[nodiscard]] std::string parameterSection() const {
    std::string groups = entry(-9, "POINT", "") + entry(-4, "TRIAL", "");
    std::string parameters = labelParameters(9) + realParameter(9, "SCALE", scale) + textParameter(9, "UNITS", units) +
                             realParameter(9, "RATE", rate_hz) +
                             integerParameter(9, "USED", {static_cast<int>(points.size())});
    if (with_frames) parameters += integerParameter(9, "FRAMES", {last_frame - first_frame + 1});
    if (trial_end != 0) {
      parameters += integerParameter(4, "ACTUAL_START_FIELD", {trial_start & 0xFFFF, trial_start >> 16});
      parameters += integerParameter(4, "ACTUAL_END_FIELD", {trial_end & 0xFFFF, trial_end >> 16});
    }
    if (!group_events.empty()) {
      groups += entry(-6, "EVENT", "");
      parameters += eventParameters(6);
    }
    std::string section = (groups_last ? parameters + groups : groups + parameters) + std::string(2, '\0');
    const std::size_t blocks = (section.size() + 4 + 511) / 512;
    section = std::string{1, 0x50, static_cast<char>(blocks), static_cast<char>(processor)} + section;
    section.resize(blocks * 512, '\0');
    return section;
  }

  [[nodiscard]] std::string bytes() const {
    const std::string parameters = parameterSection();
    std::string file{2, 0x50};
    file += word(static_cast<std::uint32_t>(points.size())) +
            word(static_cast<std::uint32_t>(analog_values_per_frame)) + word(static_cast<std::uint32_t>(first_frame)) +
            word(static_cast<std::uint32_t>(last_frame)) + word(10) + real(scale) +
            word(static_cast<std::uint32_t>(2 + parameters.size() / 512)) + word(1) + real(rate_hz);
    if (!header_events.empty()) {
      file.resize(298, '\0');
      file += headerEvents();
    }
    file.resize(512, '\0');
    file += parameters;
    for (std::size_t frame = 0; frame < frames_in_data; ++frame) {
      for (const std::vector<double>& point : points) {
        for (std::size_t i = 0; i < 4; ++i) {
          const double value = point[i] + (i == 0 ? static_cast<double>(frame) : 0.0);
          if (is_float) {
            file += real(static_cast<float>(value));
          } else {
            file += word(static_cast<std::uint32_t>(
                static_cast<std::int32_t>(i < 3 ? std::lround(value / scale) : std::lround(value))));
          }
        }
      }
      for (int i = 0; i < analog_values_per_frame; ++i) file += is_float ? real(1234.5F) : word(777);
    }
    return file;
  }
};

}  // namespace mouthpiece
