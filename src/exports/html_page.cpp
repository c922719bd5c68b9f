#include <algorithm>
#include <bit>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"
#include "base/page_data.h"
#include "exports/format_bytes.h"
#include "exports/report_fields.h"
#include "motion/lip_gauge.h"

namespace mouthpiece {
namespace {

using nlohmann::ordered_json;

std::string_view kindName(PartKind kind) {
  switch (kind) {
    case PartKind::kSkin:
      return "skin";
    case PartKind::kLips:
      return "lips";
    case PartKind::kUpperTeeth:
    case PartKind::kLowerTeeth:
      return "teeth";
    case PartKind::kTongue:
      return "tongue";
    case PartKind::kMouthInside:
      return "mouth";
    case PartKind::kEye:
      return "eye";
    case PartKind::kHair:
      return "hair";
    case PartKind::kOther:
      break;
  }
  return "other";
}

/// In the order of the GLB's materials: parts without triangles have none.
ordered_json partsOf(const FaceMesh& mesh) {
  ordered_json parts = ordered_json::array();
  for (const MeshPart& part : mesh.parts) {
    if (part.triangle_count > 0) parts.push_back({{"name", part.name}, {"kind", kindName(part.kind)}});
  }
  return parts;
}

/// The markers on the face in metres as little-endian floats, base64.
ordered_json controlOf(const ViewPage& page) {
  static_assert(std::endian::native == std::endian::little);
  using Floats = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  MOUTHPIECE_EXPECT(page.markers.cols() == 3 * signedIndex(page.marker_names.size()));
  const Floats metres = (page.markers * page.mesh.metres_per_unit).cast<float>();
  std::string encoded;
  appendBase64(encoded, {reinterpret_cast<const char*>(metres.data()), unsignedIndex(metres.size()) * 4});
  return {{"names", std::vector<std::string>(page.marker_names.begin(), page.marker_names.end())},
          {"count", metres.cols() / 3},
          {"frames", metres.rows()},
          {"positions_m", std::move(encoded)}};
}

void appendLittleEndian(std::string& bytes, std::uint32_t value, int byte_count) {
  for (int i = 0; i < byte_count; ++i) bytes.push_back(static_cast<char>(value >> (8 * i)));
}

/// 16-bit PCM, the header's 44 bytes first; with silence at the end when the motion lasts longer, since the page's
/// clock is the sound.
std::string wavBytes(const AudioClip& clip, Seconds least_duration) {
  const auto least_samples = static_cast<std::size_t>(std::max(0.0, std::round(least_duration * clip.sample_rate_hz)));
  const std::size_t sample_count = std::max(clip.samples.size(), least_samples);
  const auto data_bytes = static_cast<std::uint32_t>(2 * sample_count);
  const auto rate = static_cast<std::uint32_t>(clip.sample_rate_hz);
  std::string bytes;
  bytes.reserve(44 + data_bytes);
  bytes.append("RIFF");
  appendLittleEndian(bytes, 36 + data_bytes, 4);
  bytes.append("WAVEfmt ");
  appendLittleEndian(bytes, 16, 4);
  appendLittleEndian(bytes, 1, 2);  // PCM
  appendLittleEndian(bytes, 1, 2);  // channels
  appendLittleEndian(bytes, rate, 4);
  appendLittleEndian(bytes, 2 * rate, 4);
  appendLittleEndian(bytes, 2, 2);
  appendLittleEndian(bytes, 16, 2);
  bytes.append("data");
  appendLittleEndian(bytes, data_bytes, 4);
  for (const float sample : clip.samples) {
    const float clipped = std::clamp(sample, -1.0F, 1.0F);
    appendLittleEndian(bytes, static_cast<std::uint32_t>(std::lrint(clipped * 32767.0F)), 2);
  }
  bytes.resize(44 + data_bytes, '\0');
  return bytes;
}

/// Of the outer lips, rounded for display; empty without markers on them.
std::vector<double> openingsOf(const MotionClip& clip) {
  const LipGauge lips(clip.marker_names);
  if (!lips.hasLips()) return {};
  std::vector<double> values = lips.overFrames(&LipGauge::opening, clip.positions_mm);
  for (double& value : values) value = std::round(value * 1000) / 1000;
  return values;
}

}  // namespace

std::string viewHtml(std::string_view page_template, const ViewPage& page) {
  const std::size_t place = page_template.find(kViewPagePlaceholder);
  if (place == std::string_view::npos) {
    throw InputError("viewer.html", "",
                     "found no line \"<!-- mouthpiece:data -->\"; expected the template that the build makes");
  }
  ordered_json data{{"report", reportFields(page.animation)},
                    {"face", page.face_name},
                    {"parts", partsOf(page.mesh)},
                    {"control", controlOf(page)},
                    {"lip_opening_mm", openingsOf(page.animation.motion)}};

  const std::string wav = wavBytes(page.animation.audio, page.animation.motion.duration());
  std::string html;
  html.reserve(page_template.size() + (page.glb.size() + wav.size()) / 3 * 4 + 1'000'000);
  html.append(page_template.substr(0, place));
  html.append("<script type=\"application/json\" id=\"mouthpiece-data\">").append(
      scriptSafe(data.dump(-1, ' ', true, ordered_json::error_handler_t::replace)));
  html.append("</script>\n<script type=\"text/plain\" id=\"mouthpiece-sound\">");
  appendBase64(html, wav);
  html.append("</script>\n<script type=\"text/plain\" id=\"mouthpiece-face\">");
  appendBase64(html, page.glb);
  html.append("</script>");
  html.append(page_template.substr(place + kViewPagePlaceholder.size()));
  return html;
}

}  // namespace mouthpiece
