#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "mouthpiece/labels.h"
#include "mouthpiece/motion.h"
#include "mouthpiece/sound.h"
#include "mouthpiece/version.h"

namespace mouthpiece {

/// What a LiveStream is told, and how far ahead.
struct MOUTHPIECE_API LiveOptions {
  /// A frame is made when so much of what follows it is known: 0.05 to 5. English in sound is heard by a program of its
  /// own, too, which takes half a second to start: its phones, and its words where SpeakerOptions::hear is kWords.
  Seconds look_ahead = 0.2;
  int sample_rate_hz = 16000;  ///< of the sound that is pushed: 16,000 to 48,000
  /// What is pushed: what it takes to hear or to say it is made ready at once, not when the first of it comes.
  enum class Source { kSound, kLabels, kText };
  Source source = Source::kSound;
  /// The sound is of the person whose takes the corpus holds: they tell how he says his phones. The stream takes a few
  /// seconds longer to begin.
  bool own_voice = false;
  bool arkit = true;  ///< frames have ARKit's weights; who wants markers or vertices alone saves their time
};

/// A phone of the line as another program knows it.
struct MOUTHPIECE_API LivePhone {
  std::string_view phone;             ///< ARPAbet ("AH", with stress or without), IPA, or "sil"
  TimeSpan span;                      ///< from the stream's start
  std::optional<std::size_t> word{};  ///< counted from the stream's start: which phones make a word
};

/// What came, and what did not. Sound is counted in chunks as they were pushed.
struct MOUTHPIECE_API LiveCounts {
  std::size_t frames = 0;            ///< that were pulled
  std::size_t frames_at_rest = 0;    ///< of these, by nextNow() with nothing to show: the mouth comes to rest
  std::size_t chunks = 0;            ///< of sound, phones and words that were pushed
  std::size_t dropped = 0;           ///< gaps between chunks: silence is heard in their stead
  std::size_t late = 0;              ///< chunks for times that were shown without them: passed over
  std::size_t doubled = 0;           ///< chunks that were there already: passed over
  std::size_t restarts = 0;          ///< chunks were late for so long that their clock was taken anew
  std::size_t unusable_samples = 0;  ///< not numbers, or beyond [-1, 1]: heard as silence, or clipped
  Seconds missing = 0;               ///< how long the gaps were
  std::size_t words_missed = 0;  ///< hearings of words that failed or took too long: phones are heard in their stead
};

/// Frames of a line while it is being said: sound, or phones or words with their times, are pushed as they come, and
/// frames at a fixed rate are pulled `look_ahead` behind them.
///   mouthpiece::LiveStream stream = speaker.live({.look_ahead = 0.2, .sample_rate_hz = 48000});
///   stream.push(chunk);                                       // whenever there is some
///   while (const mouthpiece::Frame* frame = stream.next()) draw(*frame);
/// What comes out does not depend on the size of the chunks, nor on when they come unless words are heard and nextNow()
/// pulls or sound comes no faster than it is said: then words count as soon as they are found, and nothing waits for
/// them. Memory does not grow with the line; next() and nextNow() allocate nothing after their first frame. One thread
/// may push while another pulls. Shares the speaker's corpus and face, and may outlive it.
class MOUTHPIECE_API LiveStream {
 public:
  LiveStream(LiveStream&&) noexcept;
  LiveStream& operator=(LiveStream&&) noexcept;
  ~LiveStream();

  /// Sound that follows what was pushed before; 16-bit or in [-1, 1]. All push() throw InputError after finish(), or
  /// when nobody pulls for ten minutes.
  void push(std::span<const float> samples);
  void push(std::span<const std::int16_t> samples);
  /// Sound that begins `at` samples after the stream's start: what was sent twice or comes too late is passed over,
  /// and what is missing is heard as silence (LiveCounts). Throws InputError where that is over ten seconds.
  void push(std::span<const float> samples, std::uint64_t at);
  void push(std::span<const std::int16_t> samples, std::uint64_t at);

  /// The next phone; silence is between it and the one before. Not together with sound. Throws InputError for a phone
  /// that no one knows, and times that are none.
  void push(const LivePhone& phone);
  /// The next word, said as the voice's language says it; its phones share its time as its sound tells
  /// (pushSoundOfWords()), or by how long they usually are.
  void push(std::string_view word, const TimeSpan& span);
  /// Sound beside words, from the stream's start on, in [-1, 1], LiveOptions::sample_rate_hz: of a word that is pushed
  /// when its sound has come it tells when each phone is said. Sound alone says nothing, and a word whose sound has
  /// not come is said as without it. The last half a minute is kept. Throws InputError as push() does, and after sound
  /// to be heard.
  void pushSoundOfWords(std::span<const float> samples);
  /// Nothing is said until then.
  void silence(Seconds until);
  /// Lets the speaker's voice say a text after all that was pushed, and returns its sound, which begins at saidUntil()
  /// as it was before. Throws InputError as Speaker::perform() does.
  Sound say(std::string_view text);
  /// The same, with its sound in pieces as the voice makes them: `take` gets when each begins, seconds from the
  /// stream's start, and the frames of what it belongs to can be pulled before. It may pull them itself, but pushes and
  /// says nothing; what it throws ends the text. Flite's voices know what they say in half the time that their sound
  /// takes; others give it whole.
  void say(std::string_view text, const std::function<void(Seconds begin, const Sound& piece)>& take);
  /// Nothing follows: the frames up to the end can be pulled.
  void finish();
  /// Until when it is known what is said.
  [[nodiscard]] Seconds saidUntil() const;

  /// The next frame, nullptr while it is not known or after the last. It stays until the next call.
  const Frame* next();
  /// The next frame, and where it is not known one in which the mouth comes to rest. What should have been said in it
  /// is said later, unless it comes with its place.
  const Frame* nextNow();
  /// Whether next() has given the last frame after finish().
  [[nodiscard]] bool isFinished() const;
  [[nodiscard]] double frameRateHz() const;
  [[nodiscard]] LiveCounts counts() const;

  struct Data;
  explicit LiveStream(std::unique_ptr<Data> data);  ///< for the library itself

 private:
  std::unique_ptr<Data> data_;
};

/// A frame's weights as the datagram that the app Live Link Face sends, for Unreal Engine and all that listens to it
/// (docs/formats/live_link_packet.md). `subject`: the face's name there; of more than 64 bytes the first.
MOUTHPIECE_API std::string liveLinkPacket(const Frame& frame, double frame_rate_hz, std::string_view subject);

}  // namespace mouthpiece
