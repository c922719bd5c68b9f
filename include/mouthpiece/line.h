#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "mouthpiece/version.h"

namespace mouthpiece {

/// What is to be performed. Made by one of the functions below.
struct MOUTHPIECE_API Line {
  std::string text;              ///< to be spoken; for a recording what is said in it, if known
  std::filesystem::path audio;   ///< a recording; empty: a voice speaks or sings
  std::filesystem::path phones;  ///< the recording's labels: TextGrid, .lab or .phn
  std::filesystem::path song;    ///< a written song (docs/formats/song.md)
  bool is_sung = false;
  std::filesystem::path
      times{};         ///< words and times of another program that heard the recording (docs/formats/times.md)
  std::string hint{};  ///< of a recording with nothing else: words and phrases that are likely in it
  std::optional<double> song_offset{};  ///< where in the recording a song's clock stands at 0, s; none: it is found

  static Line typed(std::string text);
  /// A recording whose labels are found from what it says.
  static Line recorded(std::filesystem::path audio, std::string transcript);
  /// A recording with its labels.
  static Line labelled(std::filesystem::path audio, std::filesystem::path phones);
  /// A recording alone: what it says is recognised. `hint`: words and phrases that are likely in it.
  static Line heard(std::filesystem::path audio, std::string hint = {});
  /// A recording that another program has heard: its file of words and times.
  static Line timed(std::filesystem::path audio, std::filesystem::path times);
  /// A song to be sung by Festival; with `audio`, its sound as a person or another program sings it.
  static Line singing(std::filesystem::path song, std::filesystem::path audio = {});
  /// A recorded song; `lyrics` is a file with its words. Throws InputError.
  static Line sung(std::filesystem::path audio, const std::filesystem::path& lyrics);
  /// The same with the words themselves; what stands in square brackets is not sung. Throws InputError.
  static Line sungWords(std::filesystem::path audio, std::string_view lyrics);
};

/// One of Ma, Ps, Ja and Li of VOCAL: left to the style, heard from the sound, constant, or from a file of
/// `time_s,value` rows.
struct MOUTHPIECE_API StyleParameter {
  std::optional<double> constant;
  bool automatic = false;
  std::filesystem::path file;

  [[nodiscard]] bool isGiven() const { return automatic || constant || !file.empty(); }
};

/// How lines are performed. The defaults are those of the program `synth`.
struct MOUTHPIECE_API Manner {
  /// What moves the face.
  enum class Method {
    kEdge,    ///< EDGE (2004) as published: captured fragments, the longest each time, and nothing else
    kGreedy,  ///< the same, with units of any length, joined where the lips agree best
    kGuided,  ///< a movement predicted from what the corpus taught, with the fast detail of captured fragments on it
    kCurves,  ///< VOCAL's curves alone, as Style::kSpeech
    kViterbi = kGuided  ///< an earlier name
  };
  enum class Units { kAny, kPaper };
  enum class Blend { kSmooth, kLinear, kCosine, kExponential };
  /// What stands for a phone pair that the corpus lacks: VOCAL's curves under a prediction, the nearest pair by viseme
  /// class as it is, or nothing (InputError).
  enum class Backoff { kVocal, kViseme, kNone };
  /// What the motion is made of: what the method says (for a song curves with captured consonants), or curves alone.
  enum class Style { kCaptured, kSpeech, kSing };

  double frame_rate_hz = 60;  ///< 23.976 to 240
  Method method = Method::kGuided;
  Units units = Units::kAny;
  Blend blend = Blend::kSmooth;
  double overlap_ms = 60;  ///< of two fragments, 0 to 1000
  Backoff backoff = Backoff::kVocal;
  Style style = Style::kCaptured;
  StyleParameter ma, ps;  ///< 0 to 1: melodic accent, pitch sensitivity
  StyleParameter ja, li;  ///< 0 to 2: jaw, lips; 1 as the actor
  /// Of whatever moves the mouth, captured motion too; numbers or files, never automatic.
  StyleParameter strength, jaw, lips;  ///< 0 to 2: of all movement, of what goes with the jaw, of the rest; 1 as it is
  StyleParameter hold;                 ///< 0 to 1: how long a phone's pose is held
  StyleParameter lead_ms;              ///< -200 to 200: how much earlier than the sound the mouth moves
  StyleParameter smooth_ms;            ///< 0 to 200: smoothing in time, a Gaussian's standard deviation
  /// What moves lids, brows and forehead: what moves the mouth, but the lids rest; stretches of the capture chosen for
  /// them; blinks and brows by rules; or captured where the corpus' lids move, else rules.
  enum class UpperFace { kMouth, kCaptured, kRules, kBest };
  UpperFace upper_face = UpperFace::kMouth;
  bool gaze = false;            ///< the eyes move, by rules
  bool head_motion = false;     ///< the head sways and nods, by rules
  std::string mood;             ///< NAME[:STRENGTH], "joy:0.5", or a file of ARKit's weights (.json); empty: none
  std::uint32_t seed = 1;       ///< of what is drawn at random: the same seed, the same face
  std::filesystem::path edits;  ///< an animator's changes (docs/formats/edits.md); empty: none
};

}  // namespace mouthpiece
