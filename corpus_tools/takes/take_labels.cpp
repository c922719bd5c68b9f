#include <algorithm>
#include <cctype>
#include <set>
#include <string>
#include <vector>

#include "corpus_tools/takes/take_files.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/pronouncer.h"
#include "hearing/network/network_doubt.h"
#include "hearing/network/network_phones.h"
#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

std::vector<std::string> wordsOf(std::string_view text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    // Punctuation divides words, an apostrophe or hyphen does not; bytes beyond ASCII belong to letters.
    const bool in_word = std::isalnum(byte) != 0 || c == '\'' || c == '-' || byte >= 0x80;
    if (in_word) {
      words.back() += c;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

class WordMatcher {
 public:
  WordMatcher(std::vector<Phone> phones, const std::vector<std::string>& words, const Lexicon& lexicon)
      : phones_(std::move(phones)), words_(words), lexicon_(lexicon) {}

  /// How many phones each word takes; empty when they do not fit.
  std::vector<std::size_t> match() {
    lengths_.clear();
    return matchFrom(0, 0) ? lengths_ : std::vector<std::size_t>{};
  }

 private:
  /// Depth first; a (word, phone) that failed once is not tried again, so the work is bounded by their product.
  bool matchFrom(std::size_t word, std::size_t phone) {
    if (word == words_.size()) return phone == phones_.size();
    if (failed_.contains({word, phone})) return false;
    for (const Pronunciation& said : lexicon_.find(words_[word])) {
      if (!spells(said, phone)) continue;
      lengths_.push_back(said.phones.size());
      if (matchFrom(word + 1, phone + said.phones.size())) return true;
      lengths_.pop_back();
    }
    failed_.insert({word, phone});
    return false;
  }

  [[nodiscard]] bool spells(const Pronunciation& said, std::size_t phone) const {
    if (said.phones.empty() || said.phones.size() > phones_.size() - phone) return false;
    return std::equal(said.phones.begin(), said.phones.end(), phones_.begin() + signedIndex(phone));
  }

  std::vector<Phone> phones_;
  const std::vector<std::string>& words_;
  const Lexicon& lexicon_;
  std::vector<std::size_t> lengths_;
  std::set<std::pair<std::size_t, std::size_t>> failed_;
};

constexpr std::size_t kMostWords = 2000;  ///< of one take: the matching is recursive

}  // namespace

std::optional<SpeechLabels> withWords(const SpeechLabels& labels, std::string_view text, const Lexicon& lexicon) {
  const std::vector<std::string> words = wordsOf(text);
  if (words.empty() || words.size() > kMostWords) return std::nullopt;
  std::vector<Phone> spoken;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone != Phone::kSil) spoken.push_back(phone.phone);
  }
  const std::vector<std::size_t> lengths = WordMatcher(spoken, words, lexicon).match();
  if (lengths.empty()) return std::nullopt;
  std::vector<PhoneSegment> segments;
  std::size_t word = 0, left = lengths[0];
  for (const LabelledPhone& phone : labels.phones) {
    PhoneSegment segment{phone.phone, phone.span};
    if (phone.phone != Phone::kSil) {
      if (left == 0) left = lengths[++word];
      segment.word = word;
      --left;
    }
    segments.push_back(segment);
  }
  return buildSpeechLabels(std::move(segments), words, labels.duration());
}

TakeLabeller::TakeLabeller(const Lexicon& lexicon, std::shared_ptr<WordNetwork> network, const Language& language)
    : lexicon_(lexicon), network_(std::move(network)), language_(language) {}
TakeLabeller::~TakeLabeller() = default;

std::unique_ptr<ForcedAligner> TakeLabeller::takeAligner() {
  const std::scoped_lock lock(mutex_);
  if (!pronouncer_) pronouncer_ = std::make_unique<Pronouncer>(&lexicon_, language_);
  if (idle_.empty()) return std::make_unique<ForcedAligner>(std::filesystem::path(), language_);
  std::unique_ptr<ForcedAligner> aligner = std::move(idle_.back());
  idle_.pop_back();
  return aligner;
}

TakeLabeller::Labels TakeLabeller::label(const AudioClip& audio, const std::string& text, const std::string& name) {
  std::unique_ptr<ForcedAligner> aligner = takeAligner();
  const SamplesToHear to_hear(audio);
  std::string fault;
  const HeardPhones heard = network_ ? phonesBesideText(*network_, to_hear.all(), language_, fault) : HeardPhones();
  ForcedAlignment found = aligner->align(to_hear, audio.duration(), pronouncer_->wordsOf(text), name,
                                         SpeechKind::kSpoken, BorderTimes::kFine, heard);
  if (network_ && fault.empty()) fault = judgeByNetwork(*network_, *pronouncer_, to_hear, found);
  Labels labels{std::move(found.labels), {}};
  for (const std::size_t i : found.doubtfulWords()) {
    const LabelledWord& word = labels.labels.words[i];
    labels.doubtful.push_back({word.text, labels.labels.spanOf(word.phones), found.confidence[i]});
  }
  const std::scoped_lock lock(mutex_);
  idle_.push_back(std::move(aligner));
  if (network_fault_.empty()) network_fault_ = fault;
  return labels;
}

std::string TakeLabeller::networkFault() const {
  const std::scoped_lock lock(mutex_);
  return network_fault_;
}

}  // namespace mouthpiece
