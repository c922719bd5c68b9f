#include "phonetics/language/flite_library.h"

#include <map>
#include <memory>

#include "phonetics/language/flite_functions.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kReader = "slt";

/// A voice is a library of its own, and has no header.
struct VoiceLibrary {
  LateLibrary library;
  const char* load;  ///< the name of the function that makes the voice
  cst_voice* voice = nullptr;
};

}  // namespace

std::mutex& fliteLock() {
  static std::mutex lock;
  return lock;
}

cst_voice* fliteVoice(std::string_view name) {
  static std::map<std::string_view, VoiceLibrary> voices = {
      {"slt", {{"libflite_cmu_us_slt.so.1", kFlitePackage}, "register_cmu_us_slt"}},
      {"rms", {{"libflite_cmu_us_rms.so.1", kFlitePackage}, "register_cmu_us_rms"}},
      {"awb", {{"libflite_cmu_us_awb.so.1", kFlitePackage}, "register_cmu_us_awb"}},
      {"kal16", {{"libflite_cmu_us_kal16.so.1", kFlitePackage}, "register_cmu_us_kal16"}}};
  static std::once_flag started;
  std::call_once(started, [] { flite_init(); });
  const auto found = voices.find(name);
  if (found == voices.end()) return nullptr;
  auto& [library, load, voice] = found->second;
  if (voice == nullptr) voice = LateFunction<cst_voice*(const char*)>(library, load)(nullptr);
  return voice;
}

std::vector<std::string> flitePhones(const std::string& word) {
  const std::scoped_lock lock(fliteLock());
  const cst_features* features = fliteVoice(kReader)->features;
  const std::unique_ptr<cst_val, FliteDeleter> phones(
      lex_lookup(val_lexicon(feat_val(features, "lexicon")), word.c_str(), nullptr, features));
  std::vector<std::string> names;
  for (const cst_val* phone = phones.get(); phone != nullptr; phone = val_cdr(phone))
    names.emplace_back(val_string(val_car(phone)));
  return names;
}

std::vector<std::string> fliteWords(std::string_view token) {
  const std::scoped_lock lock(fliteLock());
  const std::unique_ptr<cst_utterance, FliteDeleter> utterance(new_utterance());
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
