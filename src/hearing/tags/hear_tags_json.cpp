#include <fmt/format.h>

#include <string>
#include <string_view>

#include "hearing/tags/hear_tags.h"

namespace mouthpiece {
namespace {

/// A list with a line for each entry: several times faster than a tree of values, for there are 100 a second.
template <typename List, typename Fields>
std::string listJson(std::string_view name, const List& list, Fields fields_of) {
  std::string text = fmt::format("\"{}\":[", name);
  std::string_view before = "\n{";
  for (const auto& entry : list) {
    text.append(before).append(fields_of(entry)).append("}");
    before = ",\n{";
  }
  return text + "]";
}

std::string spanFields(const TimeSpan& span) {
  return fmt::format(R"("start_s":{:.4f},"end_s":{:.4f})", span.start, span.end);
}

}  // namespace

std::string formatTagsJson(const AudioTags& tags) {
  std::string text = "{";
  text += listJson("f0", tags.f0, [](const PitchSample& sample) {
    return fmt::format(R"("time_s":{:.2f},"hz":{:.2f},"voiced":{})", sample.time, sample.hz, sample.voiced);
  });
  text += ",\n" + listJson("notes", tags.notes, [](const Note& note) {
            return fmt::format(R"({},"hz":{:.2f})", spanFields(note.span), note.hz);
          });
  text += ",\n" + listJson("vibrato", tags.vibrato, [](const VibratoSpan& vibrato) {
            return fmt::format(R"({},"rate_hz":{:.3f},"depth_semitones":{:.3f})", spanFields(vibrato.span),
                               vibrato.rate_hz, vibrato.depth_semitones);
          });
  text +=
      ",\n" + listJson("vowels", tags.vowels, [](const VowelLikelihood& vowel) {
        return fmt::format(R"("time_s":{:.2f},"A":{:.4f},"E":{:.4f},"I":{:.4f},"O":{:.4f},"U":{:.4f},"silence":{:.4f})",
                           vowel.time, vowel.a, vowel.e, vowel.i, vowel.o, vowel.u, vowel.silence);
      });
  text += ",\n" + listJson("consonants", tags.consonants, [](const ConsonantEnergy& consonant) {
            return fmt::format(R"("phone":{},{},"energy":{:.9f})", consonant.phone.value, spanFields(consonant.span),
                               consonant.energy);
          });
  return text + "}\n";
}

}  // namespace mouthpiece
