#include "voices/flite_voice.h"

#include <flite/flite.h>
#include <fmt/format.h>

#include <memory>
#include <mutex>

#include "base/errors.h"
#include "phonetics/text/speakable_text.h"
#include "voices/spoken_line_builder.h"

// Flite's voices have no header.
extern "C" {
cst_voice* register_cmu_us_slt(const char* folder);
cst_voice* register_cmu_us_rms(const char* folder);
cst_voice* register_cmu_us_awb(const char* folder);
cst_voice* register_cmu_us_kal16(const char* folder);
}

namespace mouthpiece {
namespace {

/// Flite takes a line as one utterance; its memory and time grow with the longest.
constexpr std::size_t kLongestUtterance = 400;

using Utterance = std::unique_ptr<cst_utterance, decltype(&delete_utterance)>;

cst_voice* registerVoice(std::string_view name) {
  static std::once_flag started;
  std::call_once(started, [] { flite_init(); });
  if (name == "slt") return register_cmu_us_slt(nullptr);
  if (name == "rms") return register_cmu_us_rms(nullptr);
  if (name == "awb") return register_cmu_us_awb(nullptr);
  if (name == "kal16") return register_cmu_us_kal16(nullptr);
  throw InputError(fmt::format("found Flite voice '{}'; expected slt, rms, awb or kal16", printable(name)));
}

AudioClip soundOf(cst_utterance* utterance) {
  const cst_wave* wave = utt_wave(utterance);
  AudioClip audio{.sample_rate_hz = wave->sample_rate, .samples = {}};
  for (int i = 0; i < wave->num_samples; ++i) audio.samples.push_back(static_cast<float>(wave->samples[i]) / 32768.0F);
  return audio;
}

/// Walks Flite's segments; equal parents in its syllable structure are one syllable, one word.
class SegmentReader {
 public:
  void read(cst_utterance* utterance) {
    const cst_item* segment = relation_head(utt_relation(utterance, "Segment"));
    Seconds end = 0;
    for (; segment != nullptr; segment = item_next(segment)) {
      const Seconds start = end;
      end = std::max<Seconds>(start, item_feat_float(segment, "end"));
      if (end - start >= 1e-4) {
        addPhone(segment, {start, end});
      } else {
        end = start;
      }
    }
  }

  std::vector<PhoneSegment> phones;
  std::vector<std::string> words;

 private:
  void addPhone(const cst_item* item, TimeSpan span) {
    const auto phone = phoneFromName(item_feat_string(item, "name"));
    if (!phone)
      throw InputError("flite", "",
                       fmt::format("spoke the unknown phone '{}'", printable(item_feat_string(item, "name"))));
    PhoneSegment segment{.phone = *phone, .span = span};
    const cst_item* in_structure = item_as(item, "SylStructure");
    const cst_item* syllable = in_structure == nullptr ? nullptr : item_parent(in_structure);
    if (syllable != nullptr && *phone != Phone::kSil) {
      if (syllable != last_syllable_) ++syllable_number_;
      segment.syllable = syllable_number_;
      segment.stress = std::string_view(item_feat_string(syllable, "stress")) == "1" ? 1 : 0;
      addToWord(segment, item_parent(syllable));
    }
    last_syllable_ = syllable;
    phones.push_back(segment);
  }

  void addToWord(PhoneSegment& segment, const cst_item* word) {
    if (word == nullptr) return;
    if (word != last_word_) words.emplace_back(item_feat_string(word, "name"));
    last_word_ = word;
    segment.word = words.size() - 1;
  }

  const cst_item* last_syllable_ = nullptr;
  const cst_item* last_word_ = nullptr;
  std::size_t syllable_number_ = 0;
};

}  // namespace

FliteVoice::FliteVoice(std::string name) : name_(std::move(name)), voice_(registerVoice(name_)) {}

SpokenLine FliteVoice::speak(std::string_view text) {
  const std::string speakable = speakableText(text);
  SpokenLineBuilder builder;
  for (const std::string& sentence : splitSentences(speakable, kLongestUtterance)) {
    const Utterance utterance(flite_synth_text(sentence.c_str(), voice_), &delete_utterance);
    if (!utterance || utt_relation_present(utterance.get(), "Segment") == 0) {
      throw InputError("flite", "", fmt::format("could not say '{}'", printable(sentence)));
    }
    SegmentReader segments;
    segments.read(utterance.get());
    builder.add(soundOf(utterance.get()), std::move(segments.phones), segments.words);
  }
  return builder.build(speakable, "flite:" + name_);
}

}  // namespace mouthpiece
