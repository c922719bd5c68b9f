#include "hearing/alignment/phone_decoder.h"

#include <fmt/format.h>
#include <pocketsphinx.h>
#include <sphinxbase/err.h>
#include <sphinxbase/feat.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>

#include "base/errors.h"
#include "hearing/alignment/fleeting_sounds.h"
#include "hearing/alignment/frame_thinning.h"
#include "hearing/alignment/harmonic_smoothing.h"
#include "hearing/alignment/score_stream.h"
#include "hearing/alignment/senone_scores.h"

namespace mouthpiece {
namespace {

/// A frame's window is longer than its step: boundaries come out early by this (measured on TTS voices).
constexpr Seconds kBoundaryShift = 0.008;
constexpr Seconds kFrameStep = 0.010;
constexpr std::size_t kMostPhones = 100'000;
/// Frames are not independent of each other, as the model takes them to be: the likelihoods of speech count by this
/// power. Chosen on TTS voices and GRID s1 (docs/theory/alignment.md).
constexpr double kTimesScale = 0.15;
/// Of a song this many frames a phone are heard: 120 ms, about as long as spoken phones are.
constexpr std::size_t kSungFramesAPhone = 12;
constexpr const char* kSilenceWord = "<sil>";
/// The first phone of a word goes by a name of its own, so that the result tells where words begin.
constexpr std::string_view kFirstSuffix = "_first";

std::string wordFor(Phone phone, bool opens_word) {
  std::string name(phoneName(phone));
  if (opens_word) name += kFirstSuffix;
  return name;
}

struct ConfigDeleter {
  void operator()(cmd_ln_t* config) const { cmd_ln_free_r(config); }
};
struct DecoderDeleter {
  void operator()(ps_decoder_t* decoder) const { ps_free(decoder); }
};
struct GraphDeleter {
  void operator()(fsg_model_t* graph) const { fsg_model_free(graph); }
};
using Config = std::unique_ptr<cmd_ln_t, ConfigDeleter>;
using Decoder = std::unique_ptr<ps_decoder_t, DecoderDeleter>;
using Graph = std::unique_ptr<fsg_model_t, GraphDeleter>;

std::filesystem::path modelOr(const std::filesystem::path& model) {
  const std::filesystem::path folder =
      model.empty() ? std::filesystem::path(MOUTHPIECE_SPHINX_MODELS) / "en-us" / "en-us" : model;
  if (!std::filesystem::exists(folder / "mdef")) {
    throw InputError(folder.string(), "",
                     "holds no acoustic model; get it with: sudo apt-get install pocketsphinx-en-us");
  }
  return folder;
}

/// A path this much less likely than the best of its frame is given up.
constexpr const char* kWideBeam = "1e-300";
/// No path is given up.
constexpr const char* kNoBeam = "0";
/// Without a beam every phone is kept in mind in every frame: about 100 bytes each.
constexpr std::size_t kMostWithoutBeam = 10'000'000;

Decoder makeDecoder(const std::filesystem::path& model, const char* beam) {
  static std::once_flag silenced;
  std::call_once(silenced, [] { err_set_logfp(nullptr); });
  // No noise removal: it moves edges. No look ahead: scores come frame by frame.
  const Config config(cmd_ln_init(nullptr, ps_args(), TRUE, "-hmm", model.c_str(), "-remove_noise", "no",
                                  "-remove_silence", "no", "-dither", "no", "-bestpath", "no", "-fsgusefiller", "no",
                                  "-fsgusealtpron", "no", "-lw", "1", "-wip", "1", "-pip", "1", "-beam", beam, "-pbeam",
                                  beam, "-wbeam", beam, "-maxhmmpf", "-1", "-pl_window", "0", nullptr));
  Decoder decoder(config ? ps_init(config.get()) : nullptr);
  if (!decoder) throw InputError(model.string(), "", "is no acoustic model that PocketSphinx can read");
  for (std::size_t i = 1; i < kPhoneCount; ++i) {
    const auto phone = static_cast<Phone>(i);
    const std::string name(phoneName(phone));
    for (const bool opens_word : {false, true}) {
      if (ps_add_word(decoder.get(), wordFor(phone, opens_word).c_str(), name.c_str(), FALSE) < 0) {
        throw InputError(model.string(), "", fmt::format("lacks the phone {}; expected a model of US English", name));
      }
    }
  }
  return decoder;
}

/// States 0 to words.size() stand between words; each further one inside a way.
Graph makeGraph(ps_decoder_t* decoder, const WordWays& words) {
  std::size_t inner_states = 0;
  for (const auto& ways : words) {
    for (const auto& phones : ways) inner_states += phones.size();
  }
  if (inner_states > kMostPhones) {
    throw InputError("transcript", "",
                     fmt::format("has {} phones; expected at most {} in one sound", inner_states, kMostPhones));
  }
  const auto boundary_count = static_cast<int>(words.size()) + 1;
  Graph graph(fsg_model_init("words", ps_get_logmath(decoder), 1.0F, boundary_count + static_cast<int>(inner_states)));
  int next_state = boundary_count;
  for (int w = 0; w + 1 < boundary_count; ++w) {
    for (const auto& phones : words[static_cast<std::size_t>(w)]) {
      int from = w;
      for (std::size_t i = 0; i < phones.size(); ++i) {
        const int to = i + 1 == phones.size() ? w + 1 : next_state++;
        const int word = fsg_model_word_add(graph.get(), wordFor(phones[i], i == 0).c_str());
        fsg_model_trans_add(graph.get(), from, to, 0, word);
        from = to;
      }
    }
  }
  for (int state = 0; state < boundary_count; ++state) fsg_model_add_silence(graph.get(), kSilenceWord, state, 1.0F);
  graph->start_state = 0;
  graph->final_state = boundary_count - 1;
  return graph;
}

/// Just this row of phones and silences.
Graph makeGraph(ps_decoder_t* decoder, const std::vector<DecodedPhone>& phones) {
  const auto count = static_cast<int>(phones.size());
  Graph graph(fsg_model_init("row", ps_get_logmath(decoder), 1.0F, count + 1));
  for (int i = 0; i < count; ++i) {
    const DecodedPhone& phone = phones[static_cast<std::size_t>(i)];
    const std::string name = phone.phone == Phone::kSil ? kSilenceWord : wordFor(phone.phone, phone.opens_word);
    fsg_model_trans_add(graph.get(), i, i + 1, 0, fsg_model_word_add(graph.get(), name.c_str()));
  }
  graph->start_state = 0;
  graph->final_state = count;
  return graph;
}

using Cepstra = std::vector<std::vector<float>>;

/// What the decoder's own front end hears, a row every 10 ms.
Cepstra cepstraOf(ps_decoder_t* decoder, std::span<const std::int16_t> samples) {
  constexpr int kBlock = 256;
  fe_t* front_end = ps_get_fe(decoder);
  const int size = fe_get_output_size(front_end);
  std::vector<float> values(static_cast<std::size_t>(kBlock) * static_cast<std::size_t>(size));
  std::array<mfcc_t*, kBlock> rows{};
  for (int i = 0; i < kBlock; ++i) rows[static_cast<std::size_t>(i)] = values.data() + std::ptrdiff_t{i} * size;
  Cepstra cepstra;
  const auto take = [&](int count) {
    for (int i = 0; i < count; ++i) {
      const mfcc_t* row = rows[static_cast<std::size_t>(i)];
      cepstra.emplace_back(row, row + size);
    }
  };
  if (fe_start_utt(front_end) < 0) throw InputError("pocketsphinx", "", "could not hear the sound");
  const int16* data = samples.data();
  for (std::size_t left = samples.size(); left > 0;) {
    const std::size_t before = left;
    int count = kBlock, first = 0;
    if (fe_process_frames(front_end, &data, &left, rows.data(), &count, &first) < 0)
      throw InputError("pocketsphinx", "", "could not hear the sound");
    take(count);
    if (count == 0 && left == before) break;
  }
  int rest = 0;
  fe_end_utt(front_end, rows[0], &rest);
  take(std::min(rest, 1));
  return cepstra;
}

/// What the model weighs: cepstra less their mean, with their first and second differences. A column a frame.
Eigen::MatrixXf featuresOf(ps_decoder_t* decoder, Cepstra& cepstra) {
  feat_t* maker = ps_get_feat(decoder);
  std::vector<mfcc_t*> rows;
  for (std::vector<float>& row : cepstra) rows.push_back(row.data());
  auto count = static_cast<int32>(rows.size());
  const std::unique_ptr<mfcc_t**, decltype(&feat_array_free)> made(feat_array_alloc(maker, count), feat_array_free);
  count = feat_s2mfc2feat_live(maker, rows.data(), &count, TRUE, TRUE, made.get());
  Eigen::MatrixXf features(feat_dimension(maker), std::max(count, 0));
  for (Eigen::Index frame = 0; frame < features.cols(); ++frame)
    std::memcpy(features.col(frame).data(), made.get()[frame][0], sizeof(float) * features.col(frame).size());
  return features;
}

using PhoneSet = std::array<bool, kPhoneCount>;

PhoneSet phonesOf(const WordWays& words) {
  PhoneSet used{};
  for (const auto& ways : words) {
    for (const auto& phones : ways) {
      for (const Phone phone : phones) used[static_cast<std::size_t>(phone)] = true;
    }
  }
  return used;
}

/// Which of the model's phones stand for these and silence.
std::vector<bool> codebooksOf(const PhoneSet& phones, const TiedModel& model) {
  std::vector<bool> wanted;
  for (const TiedModel::Codebook& codebook : model.codebooks) {
    bool is_used = codebook.phone == "SIL";
    for (std::size_t i = 0; i < phones.size(); ++i)
      is_used = is_used || (phones[i] && codebook.phone == wordFor(static_cast<Phone>(i), false));
    wanted.push_back(is_used);
  }
  return wanted;
}

std::size_t fewestPhones(const WordWays& words) {
  std::size_t phones = 0;
  for (const auto& ways : words) {
    phones += std::min_element(ways.begin(), ways.end(), [](const auto& a, const auto& b) {
                return a.size() < b.size();
              })->size();
  }
  return phones;
}

/// Where a phone begins that is first heard in frame `at` of those that were kept: midway to the frame before.
Seconds edgeBefore(const std::vector<std::size_t>& kept, std::size_t at) {
  if (kept.empty()) return static_cast<double>(at) * kFrameStep + (at > 0 ? kBoundaryShift : 0);
  if (at == 0) return 0;
  const std::size_t before = kept[at - 1] + 1;
  const std::size_t after = at < kept.size() ? kept[at] : before;
  return 0.5 * static_cast<double>(before + after) * kFrameStep + kBoundaryShift;
}

DecodedPhone readSegment(ps_seg_t* segment, const std::vector<std::size_t>& kept, const FleetingSounds& fleeting) {
  DecodedPhone phone;
  std::string_view name = ps_seg_word(segment);
  int first = 0, last = 0, score = 0;
  ps_seg_frames(segment, &first, &last);
  ps_seg_prob(segment, &score, nullptr, nullptr);
  phone.span = {edgeBefore(kept, static_cast<std::size_t>(first)),
                edgeBefore(kept, static_cast<std::size_t>(last) + 1)};
  phone.frames = last + 1 - first;
  phone.score = score;
  if (name == kSilenceWord) return phone;
  phone.opens_word = name.ends_with(kFirstSuffix);
  if (phone.opens_word) name.remove_suffix(kFirstSuffix.size());
  phone.phone = phoneFromName(name).value_or(Phone::kSil);
  phone.score /= fleeting.timesWeighed(phone.phone, static_cast<std::size_t>(first), static_cast<std::size_t>(last));
  return phone;
}

/// `kept`: the frames that the decoder heard; empty for all.
std::vector<DecodedPhone> readResult(ps_decoder_t* decoder, const std::vector<std::size_t>& kept,
                                     const FleetingSounds& fleeting) {
  std::vector<DecodedPhone> phones;
  if (ps_get_hyp(decoder, nullptr) == nullptr) return phones;
  for (ps_seg_t* segment = ps_seg_iter(decoder); segment != nullptr; segment = ps_seg_next(segment)) {
    if (std::string_view(ps_seg_word(segment)) == "(NULL)") continue;
    phones.push_back(readSegment(segment, kept, fleeting));
  }
  return phones;
}

}  // namespace

struct PhoneDecoder::State {
  std::filesystem::path model;
  SenoneScorer scorer;
  Decoder decoder;
  Decoder patient;  ///< without a beam; made when first needed
};

PhoneDecoder::PhoneDecoder(const std::filesystem::path& model)
    : state_(std::make_unique<State>(State{modelOr(model),
                                           SenoneScorer(std::make_shared<TiedModel>(readTiedModel(modelOr(model)))),
                                           makeDecoder(modelOr(model), kWideBeam), nullptr})) {}
PhoneDecoder::~PhoneDecoder() = default;
PhoneDecoder::PhoneDecoder(PhoneDecoder&&) noexcept = default;
PhoneDecoder& PhoneDecoder::operator=(PhoneDecoder&&) noexcept = default;

namespace {

void expectDone(int result, const char* what) {
  if (result < 0) throw InputError("pocketsphinx", "", fmt::format("could not {}", what));
}

/// Whether the whole was heard.
bool searchThrough(ps_decoder_t* decoder, ScoreStream& scores) {
  const auto read = [](void* stream, char* buffer, std::size_t size) {
    return static_cast<ssize_t>(static_cast<ScoreStream*>(stream)->take(buffer, size));
  };
  const cookie_io_functions_t functions{.read = read, .write = nullptr, .seek = nullptr, .close = nullptr};
  const std::unique_ptr<FILE, decltype(&fclose)> file(fopencookie(&scores, "r", functions), fclose);
  return file && ps_decode_senscr(decoder, file.get()) >= 0;
}

std::vector<DecodedPhone> search(ps_decoder_t* decoder, SenoneScorer& scorer, fsg_model_t* graph, Cepstra& cepstra,
                                 const std::vector<std::size_t>& kept, Weighing weighing,
                                 const FleetingSounds& fleeting = {}) {
  expectDone(ps_set_fsg(decoder, "words", graph), "take the words");
  expectDone(ps_set_search(decoder, "words"), "take the words");
  const Eigen::MatrixXf features = featuresOf(decoder, cepstra);
  ScoreStream scores(scorer, features, std::move(weighing), fleeting);
  expectDone(searchThrough(decoder, scores) ? 0 : -1, "hear the sound");
  return readResult(decoder, kept, fleeting);
}

/// Empty where no path through all words was kept.
std::vector<DecodedPhone> decodeWith(ps_decoder_t* decoder, SenoneScorer& scorer, std::span<const std::int16_t> samples,
                                     const WordWays& words, SpeechKind kind) {
  const Graph graph = makeGraph(decoder, words);
  Cepstra cepstra = cepstraOf(decoder, samples);
  if (cepstra.empty()) return {};
  std::vector<std::size_t> kept;
  if (kind == SpeechKind::kSung) {
    takeHarmonicsOut(samples, cepstra);
    kept = thinFrames(cepstra, kSungFramesAPhone * fewestPhones(words));
    Cepstra thinned;
    for (const std::size_t frame : kept) thinned.push_back(std::move(cepstra[frame]));
    cepstra = std::move(thinned);
  }
  std::vector<DecodedPhone> phones =
      search(decoder, scorer, graph.get(), cepstra, kept, {codebooksOf(phonesOf(words), scorer.model())},
             FleetingSounds(scorer.model(), kept));
  std::size_t found = 0;
  for (const DecodedPhone& phone : phones) found += phone.opens_word ? 1 : 0;
  if (found != words.size()) phones.clear();
  return phones;
}

}  // namespace

std::vector<DecodedPhone> PhoneDecoder::decode(std::span<const std::int16_t> samples, const WordWays& words,
                                               SpeechKind kind) {
  MOUTHPIECE_EXPECT(!words.empty());
  std::vector<DecodedPhone> phones = decodeWith(state_->decoder.get(), state_->scorer, samples, words, kind);
  if (!phones.empty()) return phones;
  // Words that hardly fit fall behind any beam.
  const auto frames = static_cast<std::size_t>(static_cast<double>(samples.size()) / kDecoderSampleRateHz / kFrameStep);
  const std::size_t phone_count = fewestPhones(words);
  if (frames < phone_count || frames > kMostWithoutBeam / std::max<std::size_t>(1, phone_count)) return phones;
  if (!state_->patient) state_->patient = makeDecoder(state_->model, kNoBeam);
  return decodeWith(state_->patient.get(), state_->scorer, samples, words, kind);
}

std::vector<TimeSpan> PhoneDecoder::hearAgain(std::span<const std::int16_t> samples,
                                              const std::vector<DecodedPhone>& phones) {
  ps_decoder_t* decoder = state_->decoder.get();
  const Graph graph = makeGraph(decoder, phones);
  Cepstra cepstra = cepstraOf(decoder, samples);
  if (cepstra.empty()) return {};
  PhoneSet used{};
  for (const DecodedPhone& phone : phones) used[static_cast<std::size_t>(phone.phone)] = true;
  const auto again = search(decoder, state_->scorer, graph.get(), cepstra, {},
                            {codebooksOf(used, state_->scorer.model()), false, kTimesScale}, {});
  if (again.size() != phones.size()) return {};
  std::vector<TimeSpan> spans;
  for (const DecodedPhone& phone : again) spans.push_back(phone.span);
  return spans;
}

}  // namespace mouthpiece
