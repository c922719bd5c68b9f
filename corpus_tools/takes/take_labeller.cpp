#include "corpus_tools/takes/take_labeller.h"

#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/pronouncer.h"

namespace mouthpiece {

TakeLabeller::TakeLabeller(const Lexicon& lexicon) : lexicon_(lexicon) {}
TakeLabeller::~TakeLabeller() = default;

std::unique_ptr<ForcedAligner> TakeLabeller::takeAligner() {
  const std::scoped_lock lock(mutex_);
  if (!pronouncer_) pronouncer_ = std::make_unique<Pronouncer>(&lexicon_);
  if (idle_.empty()) return std::make_unique<ForcedAligner>();
  std::unique_ptr<ForcedAligner> aligner = std::move(idle_.back());
  idle_.pop_back();
  return aligner;
}

TakeLabeller::Labels TakeLabeller::label(const AudioClip& audio, const std::string& text, const std::string& name) {
  std::unique_ptr<ForcedAligner> aligner = takeAligner();
  ForcedAlignment found = aligner->align(audio, pronouncer_->wordsOf(text), name);
  Labels labels{std::move(found.labels), {}};
  for (const std::size_t i : found.doubtfulWords()) {
    const LabelledWord& word = labels.labels.words[i];
    labels.doubtful.push_back({word.text, labels.labels.spanOf(word.phones), found.confidence[i]});
  }
  const std::scoped_lock lock(mutex_);
  idle_.push_back(std::move(aligner));
  return labels;
}

}  // namespace mouthpiece
