#include <algorithm>
#include <bit>
#include <cmath>

#include "audio/audio_clip.h"
#include "base/deflate.h"
#include "base/errors.h"
#include "base/index.h"
#include "base/json_text.h"
#include "base/page_data.h"
#include "exports/format_bytes.h"
#include "exports/report_fields.h"
#include "motion/lip_gauge.h"

namespace mouthpiece {
namespace {

using nlohmann::ordered_json;

/// Of packing, for a page's DecompressionStream("deflate"): what it holds of a face is packed already, and 4 takes
/// half as long again for one hundredth.
constexpr int kEffort = 1;

ordered_json partsOf(const PageMesh& mesh) {
  ordered_json parts = ordered_json::array();
  for (const PageMesh::Part& part : mesh.parts)
    parts.push_back({{"name", part.name}, {"kind", part.kind}, {"material", part.material}});
  return parts;
}

/// The markers on the face in metres as little-endian floats, base64.
ordered_json controlOf(const ViewPage& page, double metres_per_unit) {
  static_assert(std::endian::native == std::endian::little);
  using Floats = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  MOUTHPIECE_EXPECT(page.markers.cols() == 3 * signedIndex(page.marker_names.size()));
  const Floats metres = (page.markers * metres_per_unit).cast<float>();
  std::string encoded;
  appendBase64(encoded, {reinterpret_cast<const char*>(metres.data()), unsignedIndex(metres.size()) * 4});
  return {{"names", std::vector<std::string>(page.marker_names.begin(), page.marker_names.end())},
          {"count", metres.cols() / 3},
          {"frames", metres.rows()},
          {"positions_m", std::move(encoded)}};
}

/// The page's clock is the sound, so silence follows where the motion lasts longer.
AudioClip soundOf(const UtteranceAnimation& animation) {
  AudioClip sound = animation.audio;
  if (sound.sample_rate_hz == 0) sound.sample_rate_hz = 16'000;
  const double least = std::max(0.0, std::round(animation.motion.duration() * sound.sample_rate_hz));
  sound.samples.resize(std::max(sound.samples.size(), static_cast<std::size_t>(least)));
  return sound;
}

std::vector<double> roundedOver(const LipGauge& lips, LipGauge::Measure measure, const MotionClip& clip) {
  std::vector<double> values = lips.overFrames(measure, clip.positions_mm);
  for (double& value : values) value = std::round(value * 1000) / 1000;
  return values;
}

/// Of the outer lips, rounded for display; empty without markers on them.
std::vector<double> openingsOf(const MotionClip& clip) {
  const LipGauge lips(clip.marker_names);
  return lips.hasLips() ? roundedOver(lips, &LipGauge::opening, clip) : std::vector<double>();
}

/// Of the mouth, from corner to corner, likewise.
std::vector<double> widthsOf(const MotionClip& clip) {
  const LipGauge lips(clip.marker_names);
  const bool has_corners = lips.has(MarkerRole::kRightLipCorner) && lips.has(MarkerRole::kLeftLipCorner);
  return has_corners ? roundedOver(lips, &LipGauge::width, clip) : std::vector<double>();
}

ordered_json curvesOf(const CurveSet& curves) {
  ordered_json list = ordered_json::array();
  for (const AnimationCurve& curve : curves) {
    ordered_json keys = ordered_json::array();
    for (const CurveKey& key : curve.keys) keys.push_back({key.time, key.value, key.in, key.out});
    list.push_back({{"name", curve.name}, {"keys", std::move(keys)}});
  }
  return list;
}

std::vector<double> shortened(const Eigen::RowVectorXf& values) {
  std::vector<double> list;
  for (const float value : values) list.push_back(std::round(static_cast<double>(value) * 1e5) / 1e5);
  return list;
}

ordered_json editsOf(const ViewEdits& edits) {
  ordered_json offers = ordered_json::array();
  for (const std::vector<UnitOffer>& of_unit : edits.offers) {
    ordered_json list = ordered_json::array();
    for (const UnitOffer& offer : of_unit)
      list.push_back({{"first", offer.phones.first.value},
                      {"last", offer.phones.last.value},
                      {"take", offer.take},
                      {"source_start_s", std::round(offer.source_start * 1e6) / 1e6},
                      {"cost", std::round(offer.cost * 1e3) / 1e3}});
    offers.push_back(std::move(list));
  }
  ordered_json lips = ordered_json::array();
  for (Eigen::Index row = 0; row < edits.poses.lips.rows(); ++row) lips.push_back(shortened(edits.poses.lips.row(row)));
  return {{"edits", looseOrderedJson(edits.edits)},
          {"offers", std::move(offers)},
          {"poses",
           {{"names", edits.poses.names},
            {"lips", std::move(lips)},
            {"jaw_drop", edits.poses.jaw_drop},
            {"jaw", shortened(edits.poses.jaw)}}}};
}

}  // namespace

std::string viewHtml(std::string_view page_template, const ViewPage& page) {
  const std::size_t place = page_template.find(kViewPagePlaceholder);
  if (place == std::string_view::npos) {
    throw InputError("viewer.html", "",
                     "found no line \"<!-- mouthpiece:data -->\"; expected the template that the build makes");
  }
  const PageMesh mesh = pageMeshOf(page.mesh);
  ordered_json data{{"report", reportFields(page.animation, page.animation.timing_ms)},
                    {"face", page.face_name},
                    {"parts", partsOf(mesh)},
                    {"control", controlOf(page, mesh.metres_per_unit)},
                    {"shown_from_glb", std::span(page.shown_from_glb.data(), 9)},
                    {"lip_opening_mm", openingsOf(page.animation.motion)},
                    {"lip_width_mm", widthsOf(page.animation.motion)},
                    {"curves", curvesOf(page.animation.curves)}};
  if (page.edits != nullptr) data["editing"] = editsOf(*page.edits);

  const std::string wav = wavBytes(soundOf(page.animation));
  std::string html;
  html.reserve(page_template.size() + (page.glb.size() + wav.size()) / 3 * 4 + 1'000'000);
  html.append(page_template.substr(0, place));
  html.append("<script type=\"application/json\" id=\"mouthpiece-data\">").append(scriptJson(data));
  html.append("</script>\n<script type=\"text/plain\" id=\"mouthpiece-sound\">");
  appendBase64(html, deflated(wav, kEffort));
  html.append("</script>\n<script type=\"text/plain\" id=\"mouthpiece-face\">");
  appendBase64(html, deflated(page.glb, kEffort));
  html.append("</script>");
  const auto add = [&](std::string_view id, std::string_view bytes) {
    html.append("\n<script type=\"text/plain\" id=\"").append(id).append("\">");
    appendBase64(html, deflated(std::string(bytes), kEffort));
    html.append("</script>");
  };
  if (!page.engine.empty()) {
    add("mouthpiece-engine", page.engine);
    add("mouthpiece-line", page.packed_line);
  }
  html.append(page_template.substr(place + kViewPagePlaceholder.size()));
  return html;
}

}  // namespace mouthpiece
