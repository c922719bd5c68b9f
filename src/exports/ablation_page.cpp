#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json_text.h"
#include "base/page_data.h"
#include "exports/format_bytes.h"
#include "exports/report_fields.h"

namespace mouthpiece {

extern const std::string_view kAblationPage;

namespace {

using nlohmann::ordered_json;

constexpr std::string_view kDataMark = "/*DATA*/";

ordered_json roundedList(const std::vector<double>& values) {
  ordered_json list = ordered_json::array();
  for (const double value : values) list.push_back(rounded(value));
  return list;
}

ordered_json variantJson(const CurveVariant& variant) {
  ordered_json curves = ordered_json::object();
  for (const AnimationCurve& curve : variant.curves) {
    ordered_json keys = ordered_json::array();
    for (const CurveKey& key : curve.keys)
      keys.push_back({rounded(key.time), rounded(key.value), rounded(key.in), rounded(key.out)});
    if (!keys.empty()) curves[curve.name] = std::move(keys);
  }
  return {{"name", variant.name},
          {"curves", std::move(curves)},
          {"lip_opening_mm", roundedList(variant.lip_opening_mm)},
          {"chin_drop_mm", roundedList(variant.chin_drop_mm)}};
}

}  // namespace

std::string ablationPage(std::string_view title, const SpeechLabels& labels, const std::vector<CurveVariant>& variants,
                         double frame_rate_hz) {
  ordered_json phones = ordered_json::array();
  for (const LabelledPhone& phone : labels.phones)
    phones.push_back({phone.name(), rounded(phone.span.start), rounded(phone.span.end)});
  ordered_json all = ordered_json::array();
  for (const CurveVariant& variant : variants) all.push_back(variantJson(variant));
  const ordered_json data = {
      {"title", title}, {"rate_hz", frame_rate_hz}, {"phones", std::move(phones)}, {"variants", std::move(all)}};
  std::string page(kAblationPage);
  const std::size_t mark = page.find(kDataMark);
  MOUTHPIECE_EXPECT(mark != std::string::npos);
  return closedPage(page.replace(mark, kDataMark.size(), scriptJson(data)));
}

}  // namespace mouthpiece
