#include "synthesis/curve_options.h"

namespace mouthpiece {
namespace {

StyleSignal signalFor(const StyleWish& wish, bool automatic_by_default, const std::vector<double>& found,
                      const SpeechLabels& labels, double otherwise) {
  if (wish.given) return *wish.given;
  if (wish.automatic || automatic_by_default) return smoothedOverPhones(found, labels);
  return StyleSignal(otherwise);
}

}  // namespace

VocalStyle styleFor(const CurveOptions& options, const SpeechLabels& labels, const AudioTags& tags) {
  const bool sings = options.alone == CurveStyle::kSing;
  VocalStyle style;
  style.ma = signalFor(options.ma, sings, melodicAccents(labels, tags), labels, 0);
  style.ps = signalFor(options.ps, sings, pitchSensitivities(labels), labels, 0);
  if (options.ja.given) style.ja = *options.ja.given;
  if (options.li.given) style.li = *options.li.given;
  return style;
}

}  // namespace mouthpiece
