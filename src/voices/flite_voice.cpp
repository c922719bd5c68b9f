#include <fmt/format.h>

#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "phonetics/language/flite_functions.h"
#include "phonetics/language/flite_library.h"
#include "phonetics/text/speakable_text.h"
#include "voices/engines.h"
#include "voices/spoken_line_builder.h"

namespace mouthpiece {
namespace {

using Utterance = std::unique_ptr<cst_utterance, FliteDeleter>;

AudioClip soundOf(const cst_wave* wave, int start, int count) {
  AudioClip audio{.sample_rate_hz = wave->sample_rate, .samples = {}};
  for (int i = start; i < start + count; ++i) audio.samples.push_back(static_cast<float>(wave->samples[i]) / 32768.0F);
  return audio;
}

/// Walks Flite's segments; equal parents in its syllable structure are one syllable, one word.
class SegmentReader {
 public:
  void read(const cst_utterance* utterance) {
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

/// Pieces on their way from the thread that makes them to the one that takes them.
class PieceQueue {
 public:
  void give(SpokenPiece piece) {
    const std::scoped_lock lock(mutex_);
    pieces_.push_back(std::move(piece));
    changed_.notify_one();
  }
  void end(std::exception_ptr failed) {
    const std::scoped_lock lock(mutex_);
    failed_ = std::move(failed);
    is_ended_ = true;
    changed_.notify_one();
  }
  /// The next one, waited for; nullopt after the last. Throws what ended them.
  std::optional<SpokenPiece> take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return is_ended_ || !pieces_.empty(); });
    if (pieces_.empty()) {
      if (failed_) std::rethrow_exception(failed_);
      return std::nullopt;
    }
    SpokenPiece piece = std::move(pieces_.front());
    pieces_.pop_front();
    return piece;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<SpokenPiece> pieces_;
  std::exception_ptr failed_;
  bool is_ended_ = false;
};

/// One utterance while Flite makes its sound: its labels are known before.
class UtteranceInPieces {
 public:
  UtteranceInPieces(SpokenLineBuilder labels, std::string sentence, PieceQueue& pieces, std::stop_token stop)
      : labels_(std::move(labels)), sentence_(std::move(sentence)), pieces_(pieces), stop_(std::move(stop)) {}

  /// Flite's way to ask for it: an utterance's own feature.
  void listenTo(cst_utterance* utterance) {
    constexpr int kSamplesAtOnce = 1600;
    cst_audio_streaming_info* info = new_audio_streaming_info();
    info->min_buffsize = kSamplesAtOnce;
    info->userdata = this;
    info->asc = [](const cst_wave* wave, int start, int count, int, cst_audio_streaming_info* of) {
      return static_cast<UtteranceInPieces*>(of->userdata)->hear(of->utt, wave, start, count);
    };
    feat_set(utterance->features, "streaming_info", audio_streaming_info_val(info));
  }
  /// What has not come of its sound, and silence up to the labels' end. Throws what went wrong meanwhile. False: there
  /// was nothing to say.
  bool finish(const cst_utterance* utterance, const cst_wave* wave) {
    if (failed_) std::rethrow_exception(failed_);
    if (stop_.stop_requested()) return true;
    if (given_ < wave->num_samples || given_ == 0) give(utterance, wave, given_, wave->num_samples - given_);
    if (given_ < said_) pieces_.give({{}, {wave->sample_rate, std::vector<float>(unsignedIndex(said_ - given_))}});
    return is_said_;
  }

 private:
  /// Called by C: nothing is thrown.
  int hear(const cst_utterance* utterance, const cst_wave* wave, int start, int count) noexcept {
    try {
      give(utterance, wave, start, count);
    } catch (...) {
      failed_ = std::current_exception();
    }
    return failed_ || stop_.stop_requested() ? CST_AUDIO_STREAM_STOP : CST_AUDIO_STREAM_CONT;
  }

  void give(const cst_utterance* utterance, const cst_wave* wave, int start, int count) {
    if (given_ == 0 && !is_said_) tellLabels(utterance, wave->sample_rate);
    if (is_said_ && count > 0) pieces_.give({{}, soundOf(wave, start, count)});
    given_ = start + count;
  }

  void tellLabels(const cst_utterance* utterance, int sample_rate_hz) {
    SegmentReader segments;
    segments.read(utterance);
    labels_.add({sample_rate_hz, {0.0F}}, std::move(segments.phones), segments.words);
    is_said_ = !labels_.isEmpty();
    if (!is_said_) return;
    SpokenLine line = labels_.build(sentence_, "");
    said_ = static_cast<int>(line.audio.samples.size());
    pieces_.give({std::move(line.labels), {}});
  }

  SpokenLineBuilder labels_;
  std::string sentence_;
  PieceQueue& pieces_;
  std::stop_token stop_;
  std::exception_ptr failed_;
  bool is_said_ = false;
  int given_ = 0, said_ = 0;  ///< samples of the sound, and those that the labels take
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
    SpokenLineBuilder builder(language_);
    forSentences(speakable, [&](const std::string& sentence, const Utterance& utterance) {
      synthesise(sentence, utterance);
      SegmentReader segments;
      segments.read(utterance.get());
      const cst_wave* wave = utt_wave(utterance.get());
      builder.add(soundOf(wave, 0, wave->num_samples), std::move(segments.phones), segments.words);
    });
    return builder.build(speakable, "flite:" + name_);
  }

  /// A thread of its own holds Flite's lock, so that what `take` calls may speak as well.
  void speakInPieces(std::string_view text, const std::function<void(const SpokenPiece&)>& take) override {
    const std::string speakable = speakableText(text, language_);
    PieceQueue pieces;
    const std::jthread maker([&](const std::stop_token& stop) {
      try {
        makePieces(speakable, pieces, stop);
        pieces.end(nullptr);
      } catch (...) {
        pieces.end(std::current_exception());
      }
    });
    while (const std::optional<SpokenPiece> piece = pieces.take()) take(*piece);
  }

 private:
  void makePieces(const std::string& speakable, PieceQueue& pieces, const std::stop_token& stop) const {
    const std::scoped_lock lock(fliteLock());
    bool is_said = false;
    forSentences(speakable, [&](const std::string& sentence, const Utterance& utterance) {
      if (stop.stop_requested()) return;
      UtteranceInPieces given(SpokenLineBuilder(language_), sentence, pieces, stop);
      given.listenTo(utterance.get());
      synthesise(sentence, utterance);
      is_said = given.finish(utterance.get(), utt_wave(utterance.get())) || is_said;
    });
    if (!is_said) SpokenLineBuilder(language_).build(speakable, "");  // throws: there was nothing to say
  }

  /// Calls `act` with each sentence and its utterance, which is to be synthesised.
  void forSentences(const std::string& speakable,
                    const std::function<void(const std::string&, const Utterance&)>& act) const {
    // Flite draws its noise from rand(): a line shall sound the same whatever was said before it.
    std::srand(1);
    for (const std::string& sentence : splitSentences(speakable, kLongestUtterance)) {
      const Utterance utterance(new_utterance());
      utt_set_input_text(utterance.get(), withoutLoudWords(sentence).c_str());
      utt_init(utterance.get(), voice_);
      act(sentence, utterance);
    }
  }

  static void synthesise(const std::string& sentence, const Utterance& utterance) {
    if (utt_synth(utterance.get()) == nullptr || utt_relation_present(utterance.get(), "Segment") == 0)
      throw InputError("flite", "", fmt::format("could not say '{}'", printable(sentence)));
  }

  std::string name_;
  const Language& language_;
  cst_voice* voice_ = nullptr;  ///< lives as long as the program, as Flite wants it
};

}  // namespace

std::unique_ptr<Voice> makeFliteVoice(std::string_view name, const Language& language, const VoiceOptions&) {
  return std::make_unique<FliteVoice>(std::string(name), language);
}

}  // namespace mouthpiece
