#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "corpus_tools/building/corpus_builder.h"
#include "corpus_tools/takes/take_files.h"
#include "motion/cleaning/rigid.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// A face of the default layout that talks: lips and chin follow an opening that its phones ask for, everything else
/// rests. The truth is known, so what cleaning leaves can be measured.
struct SyntheticTake {
  std::string name = "one";
  std::vector<std::string> phones = {"sil", "B", "IH", "N", "sil"};  ///< 0.1 s each, silences 0.4 s
  std::vector<std::string> words = {"bin"};                          ///< a single word holds all phones
  double frame_rate_hz = 100;
  double noise_mm = 0;
  double head_swing = 1;  ///< 1: turns by up to 12 degrees and moves by up to 20 mm
  double scale = 1;       ///< size of the world
  bool has_jig = true;
  unsigned seed = 1;

  [[nodiscard]] SpeechLabels labels() const;
  /// Head still, no noise, in the face's own axes.
  [[nodiscard]] MotionClip truth() const;
  [[nodiscard]] RigidMotion worldFromHead(Seconds time) const;
  [[nodiscard]] RawTake raw() const;
  [[nodiscard]] AudioClip audio() const;
  [[nodiscard]] CorpusTake clean() const;
  /// NAME.c3d NAME.wav NAME.txt NAME.TextGrid.
  void write(const std::filesystem::path& folder) const;
};

/// A clean take of one word, called as the take, of these phones between silences.
CorpusTake saidTake(const std::string& name, const std::vector<std::string>& phones);

/// A corpus of the default layout, without a trajectory model.
Corpus corpusOf(const std::string& name, std::vector<CorpusTake> takes);

/// Ten takes over the same few phones: enough to fit a trajectory model to, and to hold some out.
Corpus speakingCorpus();

/// buildCorpusFile() into a file that goes away: the corpus has motion and sound.
BuildResult buildCorpus(const std::filesystem::path& folder, const BuildOptions& options);

/// Positions of the default layout's markers on an ellipsoid, in the face's own axes.
MarkerPositions syntheticNeutral();

/// Angle between two rotations, degrees.
double angleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b);

}  // namespace mouthpiece
