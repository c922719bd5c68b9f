#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "mouthpiece/curves.h"
#include "mouthpiece/labels.h"
#include "mouthpiece/motion.h"
#include "mouthpiece/sound.h"
#include "mouthpiece/version.h"

namespace mouthpiece {

/// A stretch of the line and the captured fragment that it is made of; neighbours share one phone.
struct PerformedUnit {
  std::size_t first = 0, last = 0;  ///< phones of Labels, both included
  std::string take;                 ///< of the corpus; "" where curves move the face
  TimeSpan source;                  ///< of the fragment in its take
  TimeSpan span;                    ///< in the line
  bool is_backoff = false;          ///< the capture lacks the pair: curves or a stand-in
};

/// A word that no dictionary has, and what was said for it.
struct GuessedWord {
  std::string text;
  std::vector<std::string> phones;  ///< ARPAbet, or IPA
  TimeSpan span;
};

/// A line performed: sound, labels, motion, and with a face its moving mesh. Immutable; copies share it, and any number
/// of threads may read it. What takes long (the face) is made when it is first asked for.
class MOUTHPIECE_API Performance {
 public:
  /// What is said, as it was given or, of a recording alone, heard.
  [[nodiscard]] const std::string& text() const;
  [[nodiscard]] const std::string& voice() const;  ///< that really spoke: "festival:...", "recorded:line.wav"
  [[nodiscard]] double frameRateHz() const;
  [[nodiscard]] std::size_t frameCount() const;
  [[nodiscard]] Seconds duration() const;

  [[nodiscard]] const Sound& sound() const;
  [[nodiscard]] const Labels& labels() const;
  [[nodiscard]] const Motion& motion() const;
  [[nodiscard]] const std::vector<Curve>& curves() const;
  [[nodiscard]] const std::vector<PerformedUnit>& units() const;
  /// What makes the line doubtful, for the user.
  [[nodiscard]] const std::vector<std::string>& warnings() const;
  /// What is no doubt, but worth telling: what of subtitles is not said, which words were guessed.
  [[nodiscard]] const std::vector<std::string>& notices() const;
  /// Words whose sounds were guessed: give them with a lexicon if they are wrong.
  [[nodiscard]] const std::vector<GuessedWord>& guesses() const;
  /// report.json (docs/formats/report.md).
  [[nodiscard]] std::string report() const;
  /// Wall time of all work so far but speech synthesis, over the line's duration.
  [[nodiscard]] double realTimeFactor() const;

  [[nodiscard]] bool hasFace() const;
  /// The face in one frame: x y z of each vertex, the mesh's unit, upright as the face stands (Y up, looking along +Z),
  /// however its file lies. Throws InputError without a face, and for a frame that there is not.
  [[nodiscard]] std::vector<float> vertices(std::size_t frame) const;
  /// Weights of ARKit's 52 shapes in one frame, 0 to 1, fitted to the markers; no face is needed. Throws
  /// InputError for a frame that there is not.
  [[nodiscard]] std::array<float, kArkitShapes> arkitWeights(std::size_t frame) const;

  struct Data;
  explicit Performance(std::shared_ptr<const Data> data);
  [[nodiscard]] const Data& data() const { return *data_; }  ///< for the library itself

 private:
  std::shared_ptr<const Data> data_;
};

/// Apple's name of an ARKit shape, in the order of Live Link Face: "EyeBlinkLeft" is 0. `shape` < kArkitShapes.
MOUTHPIECE_API std::string_view arkitName(std::size_t shape);

}  // namespace mouthpiece
