#include <fmt/format.h>

#include <cstdlib>
#include <memory>
#include <mutex>
#include <utility>

#include "base/errors.h"
#include "phonetics/language/flite_functions.h"
#include "phonetics/language/flite_library.h"
#include "phonetics/text/speakable_text.h"
#include "voices/engines.h"
#include "voices/spoken_line_builder.h"

namespace mouthpiece {
namespace {

using Utterance = std::unique_ptr<cst_utterance, FliteDeleter>;

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

class FliteVoice : public Voice {
 public:
  FliteVoice(std::string name, const Language& language) : name_(std::move(name)), language_(language) {
    const std::scoped_lock lock(fliteLock());
    voice_ = fliteVoice(name_);
    MOUTHPIECE_EXPECT(voice_ != nullptr);
  }

  SpokenLine speak(std::string_view text) override {
    const std::string speakable = speakableText(text, language_);
    const std::scoped_lock lock(fliteLock());
    // Flite draws its noise from rand(): a line shall sound the same whatever was said before it.
    std::srand(1);
    SpokenLineBuilder builder(language_);
    for (const std::string& sentence : splitSentences(speakable, kLongestUtterance)) {
      const Utterance utterance(flite_synth_text(sentence.c_str(), voice_));
      if (!utterance || utt_relation_present(utterance.get(), "Segment") == 0)
        throw InputError("flite", "", fmt::format("could not say '{}'", printable(sentence)));
      SegmentReader segments;
      segments.read(utterance.get());
      builder.add(soundOf(utterance.get()), std::move(segments.phones), segments.words);
    }
    return builder.build(speakable, "flite:" + name_);
  }

 private:
  std::string name_;
  const Language& language_;
  cst_voice* voice_ = nullptr;  ///< lives as long as the program, as Flite wants it
};

}  // namespace

std::unique_ptr<Voice> makeFliteVoice(std::string_view name, const Language& language, const VoiceOptions&) {
  return std::make_unique<FliteVoice>(std::string(name), language);
}

}  // namespace mouthpiece
