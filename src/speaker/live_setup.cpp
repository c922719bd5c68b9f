#include "speaker/live_setup.h"

#include "base/errors.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/live/live_ear.h"
#include "speaker/line_sounds.h"
#include "speaker/shared_files.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

/// Words, where they are wanted: phones of the network are heard better without them.
std::optional<LiveWords> wordsToHear(const LiveSetup& setup, const std::shared_ptr<WordNetwork>& network) {
  if (setup.hear != SpeakerOptions::Hear::kWords) return std::nullopt;
  if (setup.language == &english() && network->isThere())
    return LiveWords(network, setup.lexicon ? &*setup.lexicon : nullptr, *setup.language);
  throw InputError(
      "no words are heard while they are said; expected English, Node and the network of words, or phones");
}

}  // namespace

std::unique_ptr<LiveEar> makeLiveEar(const LiveSetup& setup, const LiveOptions& options) {
  const std::shared_ptr<WordNetwork> network = sharedWordNetwork();
  std::vector<LabelledSound> speaker;
  if (options.own_voice) speaker = soundsOf(setup.corpus.data().corpus, PhoneEar::kMostSounds);
  std::optional<LivePhones> phones;
  if (speaker.empty() && network->isThere()) phones.emplace(network, options.look_ahead, *setup.language);
  return std::make_unique<LiveEar>(*setup.language, speaker, options.look_ahead, wordsToHear(setup, network),
                                   std::move(phones));
}

}  // namespace mouthpiece
