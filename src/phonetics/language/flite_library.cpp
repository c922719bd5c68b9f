#include "hearing/alignment/flite_lexicon.h"

#include <flite/flite.h>

#include <algorithm>
#include <memory>
#include <mutex>

#include "base/errors.h"
#include "phonetics/labels/labels_builder.h"

extern "C" {
cst_voice* register_cmu_us_slt(const char* folder);
}

namespace mouthpiece {
namespace {

/// Flite keeps its voices in global variables.
std::mutex flite_mutex;

cst_voice* fliteVoice() {
  static cst_voice* const kVoice = [] {
    flite_init();
    return register_cmu_us_slt(nullptr);
  }();
  return kVoice;
}

std::string lowerCase(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return lower;
}

struct ListDeleter {
  void operator()(cst_val* list) const { delete_val(list); }
};

}  // namespace

Pronunciation flitePronunciation(std::string_view word) {
  const std::scoped_lock lock(flite_mutex);
  const cst_lexicon* lexicon = val_lexicon(feat_val(fliteVoice()->features, "lexicon"));
  const std::unique_ptr<cst_val, ListDeleter> names(
      lex_lookup(lexicon, lowerCase(word).c_str(), nullptr, fliteVoice()->features));
  Pronunciation pronunciation;
  for (const cst_val* name = names.get(); name != nullptr; name = val_cdr(name)) {
    const std::string_view text = val_string(val_car(name));
    const auto phone = phoneFromName(text);
    MOUTHPIECE_EXPECT(phone.has_value());
    pronunciation.phones.push_back(*phone);
    pronunciation.stress.push_back(stressOfName(text).value_or(-1));
  }
  return pronunciation;
}

std::vector<std::string> fliteWords(std::string_view token) {
  const std::scoped_lock lock(flite_mutex);
  const std::unique_ptr<cst_utterance, decltype(&delete_utterance)> utterance(new_utterance(), &delete_utterance);
  utt_set_input_text(utterance.get(), std::string(token).c_str());
  utt_init(utterance.get(), fliteVoice());
  default_tokenization(utterance.get());
  default_textanalysis(utterance.get());
  std::vector<std::string> words;
  for (const cst_item* word = relation_head(utt_relation(utterance.get(), "Word")); word != nullptr;
       word = item_next(word)) {
    words.emplace_back(item_feat_string(word, "name"));
  }
  return words;
}

}  // namespace mouthpiece
