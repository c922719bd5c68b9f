#pragma once

#include <string>
#include <vector>

#include "audio/audio_clip.h"
#include "motion/head_pose.h"
#include "motion/lip_pose.h"
#include "motion/motion_clip.h"
#include "motion/tongue_pose.h"
#include "phonetics/labels/speech_labels.h"
#include "vocal/viseme_curves.h"

namespace mouthpiece {

/// A stretch of the utterance and the captured fragment it is made of. `phones` index the utterance's labels;
/// neighbours share one phone.
struct PlacedUnit {
  PhoneRange phones;
  std::string take;                     ///< name of the corpus take
  std::optional<TakeIndex> take_index;  ///< in the corpus; none of curves
  PhoneIndex source_first;              ///< first phone of the fragment in that take
  TimeSpan source_span;                 ///< of the fragment in its take
  TimeSpan span;                        ///< in the utterance
  std::string scale;  ///< "sentence" "phrase" "word" "syllable" "diphone" "span"; "curves": no capture
  double cost = 0;
  bool is_backoff = false;  ///< the capture lacks the pair: curves, or a stand-in by viseme class
  TimeSpan sound = {};      ///< in the utterance: where its recording is heard; empty when another voice speaks
};

struct Join {
  Seconds time = 0;               ///< middle of the blend
  double position_jump_mm = 0;    ///< largest marker step between the frames around the join in the result
  double velocity_jump_mm_s = 0;  ///< largest marker velocity change there
};

/// What moved the lips and the chin in one second of a line: the variance of each part's movement over the sum of all
/// four; all 0 where nothing moves.
struct MovementShares {
  Seconds start = 0;
  double capture = 0;      ///< movements of fragments as they were captured
  double prediction = 0;   ///< learnt from the corpus
  double curves = 0;       ///< VOCAL's, and an animator's edits
  double contact = 0;      ///< closing lips, and lip to teeth
  double movement_mm = 0;  ///< root of that sum, a marker
};

/// What the lips do in a line, counted in its motion.
struct MouthFacts {
  std::size_t bilabials = 0;  ///< B P M that are said
  std::size_t closures = 0;  ///< of these the lips close in, to within half a millimetre of the speaker's usual closure
  double jitter_mm = 0;      ///< root mean square of what a lip or chin marker lies off its neighbouring frames' middle
};

/// A setting that mattered: a number, or a word.
struct SettingUsed {
  std::string name, value;
};

struct StageTimings {  ///< milliseconds of wall time; load: opening the corpus and the face
  double load = 0, speech = 0, selection = 0, motion = 0, retarget = 0, deform = 0, write = 0;
};

/// What `synth` makes of a line before any face is involved.
struct UtteranceAnimation {
  std::string text;  ///< as it was given or heard, not as it is said
  std::string voice;
  std::string corpus;
  SpeechLabels labels;
  std::vector<std::size_t> guessed_words;  ///< of `labels`, rising: no dictionary has them
  AudioClip audio;
  MotionClip motion;               ///< head still, actor's space, no NaN, at the requested frame rate
  std::vector<TonguePose> tongue;  ///< one a frame of `motion`
  std::vector<LipPose> lips;       ///< one a frame of `motion`
  std::vector<GazeTurn> gaze;      ///< one a frame of `motion`, or none: straight ahead
  std::vector<HeadTurn> head;      ///< the same: the head still
  std::vector<PlacedUnit> units;
  std::vector<Join> joins;
  CurveSet curves;     ///< VOCAL's curves of the whole line, edited
  std::string method;  ///< "edge" "greedy" "guided" "cheapest" "curves"
  std::vector<SettingUsed> settings;
  std::vector<MovementShares> shares;  ///< one a second
  MouthFacts mouth;
  std::string style;                  ///< "speech" "sing": made of curves alone; "" of units
  std::vector<std::string> warnings;  ///< what makes the line doubtful, for the user
  std::vector<std::string> notices;   ///< what is no doubt, but worth telling
  StageTimings timing_ms;
};

}  // namespace mouthpiece
