#include "phonetics/language/flite_library.h"

#include <flite/flite.h>

#include <map>
#include <memory>

// Flite's voices have no header.
extern "C" {
cst_voice* register_cmu_us_slt(const char* folder);
cst_voice* register_cmu_us_rms(const char* folder);
cst_voice* register_cmu_us_awb(const char* folder);
cst_voice* register_cmu_us_kal16(const char* folder);
}

namespace mouthpiece {
namespace {

constexpr std::string_view kReader = "slt";

struct ListDeleter {
  void operator()(cst_val* list) const { delete_val(list); }
};

}  // namespace

std::mutex& fliteLock() {
  static std::mutex lock;
  return lock;
}

cst_voice* fliteVoice(std::string_view name) {
  struct Row {
    cst_voice* (*load)(const char* folder);
    cst_voice* voice = nullptr;
  };
  static std::map<std::string_view, Row> rows = {{"slt", {register_cmu_us_slt}},
                                                 {"rms", {register_cmu_us_rms}},
                                                 {"awb", {register_cmu_us_awb}},
                                                 {"kal16", {register_cmu_us_kal16}}};
  static std::once_flag started;
  std::call_once(started, [] { flite_init(); });
  const auto found = rows.find(name);
  if (found == rows.end()) return nullptr;
  if (found->second.voice == nullptr) found->second.voice = found->second.load(nullptr);
  return found->second.voice;
}

std::vector<std::string> flitePhones(const std::string& word) {
  const std::scoped_lock lock(fliteLock());
  const cst_features* features = fliteVoice(kReader)->features;
  const std::unique_ptr<cst_val, ListDeleter> phones(
      lex_lookup(val_lexicon(feat_val(features, "lexicon")), word.c_str(), nullptr, features));
  std::vector<std::string> names;
  for (const cst_val* phone = phones.get(); phone != nullptr; phone = val_cdr(phone))
    names.emplace_back(val_string(val_car(phone)));
  return names;
}

std::vector<std::string> fliteWords(std::string_view token) {
  const std::scoped_lock lock(fliteLock());
  const std::unique_ptr<cst_utterance, decltype(&delete_utterance)> utterance(new_utterance(), &delete_utterance);
  utt_set_input_text(utterance.get(), std::string(token).c_str());
  utt_init(utterance.get(), fliteVoice(kReader));
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
