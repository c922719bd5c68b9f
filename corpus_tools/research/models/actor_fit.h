#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "corpus_tools/sample/actor_model.h"
#include "corpus_tools/sample/actor_performance.h"
#include "corpus_tools/takes/lip_measures.h"
#include "motion/marker_layout.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// A capture ready to learn from: heads still, in the face's axes, the neutral pose at its place.
struct ActorCapture {
  MarkerLayout layout;
  MarkerPositions neutral_mm;
  std::vector<CorpusTake> takes;
};

/// Reads every `stride`-th take of a folder and takes the head motion off. Throws InputError.
ActorCapture readActorCapture(const std::filesystem::path& folder, std::size_t stride = 1);

struct ActorFitOptions {
  Eigen::Index components = 10;
  double ridge = 3;  ///< shrinks contributions of rare features; in frames
  double largest_gain = 1.8;
  std::string credit;
};

/// Learns an actor by least squares (docs/theory/actor_model.md). Throws InputError for a capture with too little in
/// it.
ActorModel fitActor(const ActorCapture& capture, const ActorFitOptions& options);

/// `model` performs the labels of `takes`, compared with what was captured, in one sum.
LipMeasures scoreActor(const ActorModel& model, const ActorCapture& capture, ActorOptions options);

/// The takes whose index modulo `fold_count` is (or is not) `fold`.
ActorCapture withoutFold(const ActorCapture& capture, std::size_t fold_count, std::size_t fold);
ActorCapture onlyFold(const ActorCapture& capture, std::size_t fold_count, std::size_t fold);

}  // namespace mouthpiece
