#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hearing/alignment/acoustic_model.h"
#include "hearing/alignment/phone_decoder.h"

// PocketSphinx' own, as it declares them.
typedef struct ps_decoder_s ps_decoder_t;  // NOLINT(modernize-use-using)
typedef struct fsg_model_s fsg_model_t;    // NOLINT(modernize-use-using)

namespace mouthpiece {

inline constexpr Seconds kFrameStep = 0.010;

struct GraphDeleter {
  void operator()(fsg_model_t* graph) const;
};
using Graph = std::unique_ptr<fsg_model_t, GraphDeleter>;

/// What pauses between words cost.
struct Pauses {
  float likelihood = 1;
  double inner_price = 0;  ///< more between two words, nats
};

/// What PocketSphinx calls a phone, the first of a word or another.
std::string wordFor(Phone phone, bool opens_word);

/// The words with optional silence around each. `may_stop`: the path may end behind any of them. Throws InputError when
/// they have too many phones.
Graph makeGraph(ps_decoder_t* decoder, std::span<const WordWays::value_type> words, const Pauses& pauses,
                bool may_stop = false);

/// Where a phone begins that is first heard in frame `at` of those that were kept (all if empty): midway to the frame
/// before.
Seconds edgeBefore(const std::vector<std::size_t>& kept, std::size_t at);

/// The likeliest path through `graph`. `features`: a column a frame; `kept`: which frames of the sound these are; empty
/// for all. Throws InputError where PocketSphinx refuses.
std::vector<DecodedPhone> search(ps_decoder_t* decoder, SenoneScorer& scorer, fsg_model_t* graph,
                                 const Eigen::MatrixXf& features, const std::vector<std::size_t>& kept,
                                 ScoreStream::WeighingOf weighing, const FleetingSounds& fleeting = {});

std::size_t wordsIn(std::span<const DecodedPhone> phones);

/// One that gives up no path, for words that hardly fit and fall behind any beam.
using PatientDecoder = std::function<ps_decoder_t*()>;
/// Whether there is room for that: without a beam every phone is kept in mind in every frame, about 100 bytes each.
bool isHeardWithoutBeam(Eigen::Index frames, std::int64_t phones);

/// The longest sound that is searched at once, in frames of 10 ms.
inline constexpr Eigen::Index kMostFramesAtOnce = 60'000;

/// The likeliest path through all `words`, stretch by stretch: PocketSphinx looks at all states of a graph in every
/// frame, so that the time of a whole text grows with the square of its length. Where a stretch and the next one do not
/// hear the words that both have at the same times, both are heard anew as one, up to four minutes. Empty where a sound
/// is no longer than a minute, or where the words do not fit it.
std::vector<DecodedPhone> hearInStretches(ps_decoder_t* decoder, const PatientDecoder& patient, SenoneScorer& scorer,
                                          const Eigen::MatrixXf& features, const WordWays& words,
                                          const std::vector<bool>& codebooks, const Pauses& pauses);

}  // namespace mouthpiece
