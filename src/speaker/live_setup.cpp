#include "speaker/live_setup.h"

#include "base/errors.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/recognition/live_ear.h"
#include "speaker/shared_files.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

/// Words, where they help, unless phones alone are wanted. An ear that knows the speaker hears phones better.
std::optional<LiveWords> wordsToHear(const LiveSetup& setup, const LiveOptions& options) {
  using Hear = SpeakerOptions::Hear;
  const bool is_english = setup.language == &english();
  const bool would_help = is_english && !options.own_voice && options.look_ahead >= LiveEar::kWordsHelpFrom;
  if (setup.hear == Hear::kPhones || (setup.hear == Hear::kAuto && !would_help)) return std::nullopt;
  const std::shared_ptr<WordNetwork> network = sharedWordNetwork();
  if (is_english && network->isThere())
    return LiveWords(network, setup.lexicon ? &*setup.lexicon : nullptr, *setup.language);
  if (setup.hear == Hear::kAuto) return std::nullopt;
  throw InputError(
      "no words are heard while they are said; expected English, Node and the network of words, or phones");
}

}  // namespace

std::unique_ptr<LiveEar> makeLiveEar(const LiveSetup& setup, const LiveOptions& options) {
  std::vector<LabelledSound> speaker;
  if (options.own_voice) speaker = soundsOf(setup.corpus.data().corpus);
  return std::make_unique<LiveEar>(*setup.language, speaker, options.look_ahead, wordsToHear(setup, options));
}

}  // namespace mouthpiece
