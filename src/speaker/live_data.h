#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "exports/shapes/principal_shapes.h"
#include "expression/live_face.h"
#include "hearing/alignment/pronouncer.h"
#include "hearing/live/live_ear.h"
#include "mouthpiece/live.h"
#include "phonetics/labels/phone_lengths.h"
#include "speaker/live_parts.h"
#include "speaker/live_setup.h"
#include "speaker/sound_clock.h"
#include "speaker/told_words.h"
#include "synthesis/live_motion.h"
#include "voices/voice.h"

namespace mouthpiece {

/// A stream from what is pushed (live_stream.cpp) to the frames that are pulled (live_frames.cpp).
struct LiveStream::Data {
  Data(LiveSetup made_of, const LiveOptions& wanted);

  void heard(std::span<const float> samples);
  void hearSilence(std::size_t samples);
  void hearWhole();
  void pushSound(std::span<const float> samples, std::optional<std::uint64_t> at);
  void takeSound(std::span<const float> samples, std::optional<std::uint64_t> at);
  /// Takes the chunks that wait: those that follow what came, and in any case those up to `before`, a sample's number.
  void takeWaiting(std::uint64_t before);
  void pushPhones(const std::vector<PhoneSegment>& phones);
  Seconds sayLabels(const SpeechLabels& labels);
  void makeOwnVoice();
  void makePronouncer();
  std::vector<PhoneSegment> phonesOfWord(std::string_view word, const TimeSpan& span);
  void expectOpen(bool is_sound);
  void catchUp();
  void makeFrames(Seconds known_until, std::span<const PhoneSegment> guess);
  void show(LiveFrames frames);
  RowMajorMatrixF arkitWeights(const LiveFrames& frames, const std::vector<GazeTurn>& gaze);
  std::vector<GazeTurn> moveUpperFace(PositionMatrix& positions_mm);
  void poseMesh();
  [[nodiscard]] ShownFrame restingFrame() const;
  [[nodiscard]] bool waitsForWords() const;
  [[nodiscard]] Seconds now() const { return asReal(motion.frameCount()) / rate_hz; }
  const Frame* pulled();

  LiveSetup setup;
  LiveOptions options;
  double rate_hz;
  LiveMotion motion;
  LiveFace upper_face;
  std::vector<bool> upper_columns;
  std::unique_ptr<Voice> voice;
  std::unique_ptr<Pronouncer> pronouncer;
  PhoneLengths lengths;                   ///< of the corpus, once there is a pronouncer
  std::unique_ptr<ToldWords> told_words;  ///< once their sound comes
  // Of sound:
  SoundClock clock{SoundClock::Clock::now()};
  Seconds sound_come = 0;  ///< with the chunk that is heard
  std::unique_ptr<LiveEar> ear;
  LiveResampler resampler;
  ChunkOrder order;
  std::map<std::uint64_t, std::vector<float>>
      ahead;                   ///< chunks that wait for what is missing before them, by their places
  std::vector<float> waiting;  ///< at the ear's rate
  std::size_t hops = 0;
  std::uint64_t sound_samples = 0;  ///< that were taken, with silences in their stead
  bool is_sound = false, is_labels = false;
  bool is_ending = false;  ///< all sound has come
  std::size_t words = 0;
  bool has_small_letters = false;  ///< a word that was told has some: capitals are letters from then on
  std::size_t frames_at_most = std::numeric_limits<std::size_t>::max();  ///< the line's, once it is finished
  MotionClip weights_clip;                                               ///< the last frames, and those that are made
  std::vector<LipPose> weights_lips;                                     ///< of the same frames
  RowMajorMatrixF weights_behind;                                        ///< what they were found to be

  // Between the threads, under the mutex:
  mutable std::mutex mutex;
  FrameRing ring;
  ShownFrame current;
  std::size_t unshown = 0;  ///< frames that nextNow() gave and the motion does not know of yet
  std::size_t at_rest = 0;  ///< of these, in a row
  bool is_finished = false;
  std::atomic<bool> is_in_time = false;  ///< nextNow() wants frames when their time comes: hearing words does not wait
  Seconds said_until = 0;
  LiveCounts counts;
  // Of the thread that pulls:
  ShownFrame resting, stalled_from;
  VertexPositions vertices;
  Frame frame;
};

}  // namespace mouthpiece
