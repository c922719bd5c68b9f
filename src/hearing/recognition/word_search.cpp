#include "hearing/recognition/sound_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/sphinx_functions.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// How much the language model counts against the sound; PocketSphinx' usual 6.5 finds fewer words
/// (docs/theory/hearing/network_words.md#the-search-for-words).
constexpr const char* kLanguageWeight = "5";
/// A path of a book that is this much less likely than the best of its frame is given up: with PocketSphinx' own beams
/// none of a short book's may come to its end.
constexpr double kBookBeam = 1e-80, kBookWordBeam = 1e-60;
/// Another order than the lines' at a word's end, and the end of all.
constexpr double kOtherOrder = 0.05, kEnds = 0.1;
constexpr std::size_t kMostBookWords = 5000;
/// What the graph keeps at less is nothing; natural logarithm.
constexpr double kLeastKept = -30;

fs::path modelFolder() { return MOUTHPIECE_SPHINX_MODELS; }
/// The packages name a language model as the acoustic one beside it: en-us/en-us and en-us/en-us.lm.bin.
fs::path wordModel(const Language& language) {
  return modelFolder() / (std::string(language.acoustic_model) + ".lm.bin");
}

/// Other beams for the searches that a decoder makes while this lives: each keeps those it is made with.
class SearchBeams {
 public:
  SearchBeams(cmd_ln_t* config, double beam, double word_beam) : config_(config) {
    for (std::size_t i = 0; i < kNames.size(); ++i) {
      usual_[i] = cmd_ln_float_r(config, kNames[i]);
      cmd_ln_set_float_r(config, kNames[i], i == 0 ? word_beam : beam);
    }
  }
  ~SearchBeams() {
    for (std::size_t i = 0; i < kNames.size(); ++i) cmd_ln_set_float_r(config_, kNames[i], usual_[i]);
  }
  SearchBeams(const SearchBeams&) = delete;
  SearchBeams& operator=(const SearchBeams&) = delete;

 private:
  static constexpr std::array<const char*, 3> kNames{"-wbeam", "-beam", "-pbeam"};
  cmd_ln_t* config_;
  std::array<double, 3> usual_{};
};

}  // namespace

struct WordSearch::State {
  SphinxPointer<ps_decoder_t> decoder;
  bool has_model = false;
  std::set<std::string> books;
  std::string model;
};

bool WordSearch::isAvailable(const Language& language) {
  return !language.acoustic_model.empty() && !language.dictionary.empty() && fs::exists(wordModel(language)) &&
         fs::exists(modelFolder() / language.dictionary) && fs::exists(modelFolder() / language.acoustic_model);
}

WordSearch::WordSearch(const Language& language) : state_(std::make_unique<State>()) {
  if (!isAvailable(language)) {
    throw InputError(
        fmt::format("no words of {} can be recognised: expected US English and PocketSphinx' models (sudo "
                    "apt-get install pocketsphinx-en-us), or to hear phones",
                    language.name));
  }
  const fs::path acoustic = modelFolder() / language.acoustic_model, words = modelFolder() / language.dictionary;
  // Every frame is kept, so that times stay.
  state_->decoder = makeSphinxDecoder({"-hmm", acoustic.string(), "-dict", words.string(), "-remove_silence", "no",
                                       "-dither", "no", "-lw", kLanguageWeight, "-maxhmmpf", "3000", "-maxwpf", "10"});
  state_->model = wordModel(language).string();
  if (!state_->decoder) throw InputError(acoustic.string(), "", "is no acoustic model that PocketSphinx can read");
  ps_get_feat(state_->decoder.get())->cmn = CMN_NONE;  // cepstraOf() takes the mean off
}

WordSearch::~WordSearch() = default;

namespace {

/// "are(2)" is "are".
std::string withoutWay(const char* name) {
  std::string word = name == nullptr ? "" : name;
  word.resize(std::min(word.find('('), word.size()));
  return word;
}

/// A word between two of its borders, frames.
struct KeptWord {
  std::string text;
  int first = 0, end = 0;
};

std::vector<KeptWord> keptWords(ps_decoder_t* decoder) {
  std::vector<KeptWord> kept;
  ps_lattice_t* graph = ps_get_lattice(decoder);
  if (graph == nullptr) return kept;
  for (ps_latnode_iter_t* at = ps_latnode_iter(graph); at != nullptr; at = ps_latnode_iter_next(at)) {
    ps_latnode_t* node = ps_latnode_iter_node(at);
    const std::string word = withoutWay(ps_latnode_baseword(graph, node));
    for (ps_latlink_iter_t* exit = ps_latnode_exits(node); exit != nullptr; exit = ps_latlink_iter_next(exit)) {
      ps_latlink_t* link = ps_latlink_iter_link(exit);
      int16 first = 0;
      const int end = ps_latlink_times(link, &first) + 1;
      const double share = logmath_log_to_ln(ps_get_logmath(decoder), ps_latlink_prob(graph, link, nullptr));
      if (share >= kLeastKept) kept.push_back({word, first, end});
    }
  }
  return kept;
}

/// FoundWords::rivals of a word.
double wordsBeside(const KeptWord& word, std::span<const KeptWord> kept) {
  const int middle = (word.first + word.end) / 2;
  std::set<std::string_view> words;
  for (const KeptWord& other : kept) {
    if (other.first <= middle && other.end > middle) words.insert(other.text);
  }
  return std::log(std::max(1.0, asReal(words.size())));
}

/// Fillers are no words. Without rivals.
FoundWords wordsFound(ps_decoder_t* decoder, std::vector<KeptWord>& places) {
  FoundWords found;
  if (ps_get_hyp(decoder, nullptr) == nullptr) return found;
  for (ps_seg_t* segment = ps_seg_iter(decoder); segment != nullptr; segment = ps_seg_next(segment)) {
    std::string word = withoutWay(ps_seg_word(segment));
    if (word.empty() || word.front() == '<' || word.front() == '[' || word.front() == '+') continue;
    int first = 0, last = 0;
    ps_seg_frames(segment, &first, &last);
    places.push_back({word, first, last + 1});
    found.words.push_back(std::move(word));
  }
  return found;
}

/// The front end's cepstra, a column a frame, less their mean and in the voice's place.
Eigen::MatrixXf cepstraOf(ps_decoder_t* decoder, std::span<const std::int16_t> samples, const VoiceTransform& voice) {
  constexpr std::size_t kStep = 160;
  fe_t* front_end = ps_get_fe(decoder);
  Eigen::MatrixXf cepstra(fe_get_output_size(front_end), signedIndex(samples.size() / kStep + 2));
  std::vector<mfcc_t*> rows;
  for (Eigen::Index frame = 0; frame < cepstra.cols(); ++frame) rows.push_back(cepstra.col(frame).data());
  const int16* data = samples.data();
  std::size_t left = samples.size();
  int frames = static_cast<int>(rows.size()) - 1, rest = 0;
  const bool is_heard = fe_start_utt(front_end) >= 0 &&
                        fe_process_frames(front_end, &data, &left, rows.data(), &frames, nullptr) >= 0 &&
                        fe_end_utt(front_end, rows[unsignedIndex(frames)], &rest) >= 0;
  if (!is_heard) throw InputError("pocketsphinx", "", "could not hear the sound");
  const Eigen::Index heard = frames + std::max(0, rest);
  cmn(ps_get_feat(decoder)->cmn_struct, rows.data(), FALSE, static_cast<int>(heard));
  return voice(cepstra.leftCols(heard));
}

FoundWords searchWords(ps_decoder_t* decoder, const char* name, std::span<const std::int16_t> samples,
                       const VoiceTransform& voice, std::vector<KeptWord>& places) {
  Eigen::MatrixXf cepstra = cepstraOf(decoder, samples, voice);
  std::vector<mfcc_t*> rows;
  for (Eigen::Index frame = 0; frame < cepstra.cols(); ++frame) rows.push_back(cepstra.col(frame).data());
  const bool is_heard = ps_set_search(decoder, name) >= 0 && ps_start_utt(decoder) >= 0 &&
                        ps_process_cep(decoder, rows.data(), static_cast<int>(rows.size()), FALSE, TRUE) >= 0 &&
                        ps_end_utt(decoder) >= 0;
  if (!is_heard) throw InputError("pocketsphinx", "", "could not hear the sound");
  return wordsFound(decoder, places);
}

}  // namespace

FoundWords WordSearch::hear(std::span<const std::int16_t> samples, const VoiceTransform& voice) {
  ps_decoder_t* decoder = state_->decoder.get();
  if (!state_->has_model) {
    if (ps_set_lm_file(decoder, "language", state_->model.c_str()) < 0)
      throw InputError(state_->model, "", "is no language model that PocketSphinx can read");
    state_->has_model = true;
  }
  std::vector<KeptWord> places;
  FoundWords found = searchWords(decoder, "language", samples, voice, places);
  const std::vector<KeptWord> kept = keptWords(decoder);
  for (const KeptWord& place : places) found.rivals.push_back(wordsBeside(place, kept));
  return found;
}

void WordSearch::setBook(const std::string& name, const PhraseBook& book) {
  ps_decoder_t* decoder = state_->decoder.get();
  for (const auto& [word, phones] : book.more) {
    const std::unique_ptr<char, decltype(&free)> known(ps_lookup_word(decoder, word.c_str()), free);
    std::string names;
    for (const Phone phone : phones) {
      if (!names.empty()) names += ' ';
      names += phoneName(phone);
    }
    if (!known && ps_add_word(decoder, word.c_str(), names.c_str(), FALSE) < 0) return;
  }
  std::map<std::string, int> states;
  std::map<int, std::map<std::string, double>> follows;  // by state: what comes next, how often
  constexpr int kHub = 1;
  constexpr int kStart = 0;
  for (const auto& line : book.lines) {
    int at = kStart;
    for (const std::string& word : line) {
      if (states.size() >= kMostBookWords && !states.contains(word)) break;
      const int to = states.emplace(word, static_cast<int>(states.size()) + 2).first->second;
      follows[at][word] += 1;
      at = to;
    }
  }
  state_->books.erase(name);
  if (states.empty()) return;
  const int final_state = static_cast<int>(states.size()) + 2;
  constexpr double kWeight = 6.5;  // PocketSphinx' usual one
  const SphinxPointer<fsg_model_t> graph(
      fsg_model_init(name.c_str(), ps_get_logmath(decoder), static_cast<float>(kWeight), final_state + 1));
  const auto cost = [&](double probability) {
    return static_cast<int>(kWeight * logmath_log(ps_get_logmath(decoder), probability));
  };
  const auto add = [&](int from, const std::string& word, double probability) {
    const int id = fsg_model_word_add(graph.get(), word.c_str());
    fsg_model_trans_add(graph.get(), from, states.at(word), cost(probability), id);
  };
  for (const auto& [from, next] : follows) {
    double total = 0;
    for (const auto& [word, times] : next) total += times;
    for (const auto& [word, times] : next) add(from, word, (1 - kOtherOrder - kEnds) * times / total);
  }
  for (const auto& [word, state] : states) {
    add(kHub, word, 1.0 / asReal(states.size()));
    fsg_model_null_trans_add(graph.get(), state, kHub, cost(kOtherOrder));
    fsg_model_null_trans_add(graph.get(), state, final_state, cost(kEnds));
  }
  fsg_model_null_trans_add(graph.get(), kStart, kHub, cost(kOtherOrder));
  glist_free(fsg_model_null_trans_closure(graph.get(), nullptr));
  graph->start_state = kStart;
  graph->final_state = final_state;
  const SearchBeams beams(ps_get_config(decoder), kBookBeam, kBookWordBeam);
  if (ps_set_fsg(decoder, name.c_str(), graph.get()) >= 0) state_->books.insert(name);
}

std::vector<std::string> WordSearch::hearBook(const std::string& name, std::span<const std::int16_t> samples,
                                              const VoiceTransform& voice) {
  if (!state_->books.contains(name)) return {};
  std::vector<KeptWord> places;
  return searchWords(state_->decoder.get(), name.c_str(), samples, voice, places).words;
}

}  // namespace mouthpiece
