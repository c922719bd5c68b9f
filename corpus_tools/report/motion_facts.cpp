#include "corpus_tools/report/corpus_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/errors.h"

namespace mouthpiece {
namespace {

double seenShare(const MotionClip& clip, std::size_t marker) {
  std::size_t seen = 0;
  for (std::size_t frame = 0; frame < clip.frameCount(); ++frame)
    seen += clip.isSeen(FrameIndex(frame), MarkerIndex(marker)) ? 1U : 0U;
  return asReal(seen) / asReal(clip.frameCount());
}

}  // namespace

std::string motionFactsText(const MotionClip& clip, const std::vector<MotionEvent>& events) {
  std::string text = fmt::format("{} frames at {:g} Hz, {:.3f} s, {} markers, {} events\n", clip.frameCount(),
                                 clip.frame_rate_hz, clip.duration(), clip.markerCount(), events.size());
  for (std::size_t marker = 0; marker < clip.markerCount(); ++marker) {
    const double seen = seenShare(clip, marker);
    if (seen < 1) text += fmt::format("  {:<24} seen in {:.1f} %\n", printable(clip.marker_names[marker]), 100 * seen);
  }
  for (const MotionEvent& event : events) {
    text += fmt::format("  event at {:9.3f} s   {}{}{}\n", event.time, printable(event.label),
                        event.context.empty() ? "" : ", ", printable(event.context));
  }
  return text;
}

std::string motionFactsJson(const MotionClip& clip, const std::vector<MotionEvent>& events) {
  nlohmann::ordered_json facts{
      {"frame_rate_hz", clip.frame_rate_hz}, {"frames", clip.frameCount()}, {"duration_s", clip.duration()}};
  facts["markers"] = nlohmann::ordered_json::array();
  for (std::size_t marker = 0; marker < clip.markerCount(); ++marker)
    facts["markers"].push_back({{"name", printable(clip.marker_names[marker])}, {"seen", seenShare(clip, marker)}});
  facts["events"] = nlohmann::ordered_json::array();
  for (const MotionEvent& event : events) {
    facts["events"].push_back(
        {{"label", printable(event.label)}, {"context", printable(event.context)}, {"time_s", event.time}});
  }
  return facts.dump(1) + "\n";
}

}  // namespace mouthpiece
