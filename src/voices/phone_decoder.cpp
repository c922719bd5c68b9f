#include "voices/phone_decoder.h"

#include <fmt/format.h>
#include <pocketsphinx.h>
#include <sphinxbase/err.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <mutex>
#include <string>

#include "base/errors.h"
#include "voices/frame_thinning.h"

namespace mouthpiece {
namespace {

/// A frame's window is longer than its step: boundaries come out early by this (measured on TTS voices).
constexpr Seconds kBoundaryShift = 0.008;
constexpr Seconds kFrameStep = 0.010;
constexpr std::size_t kMostPhones = 100'000;
/// Of a song this many frames a phone are heard: 120 ms, about as long as spoken phones are.
constexpr std::size_t kSungFramesAPhone = 12;
constexpr const char* kSilenceWord = "<sil>";
/// The first phone of a word goes by a name of its own, so that the result tells where words begin.
constexpr std::string_view kFirstSuffix = "_first";

std::string wordFor(Phone phone, bool opens_word) {
  // The model has no schwa of its own.
  std::string name(phoneName(phone == Phone::kAX ? Phone::kAH : phone));
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
/// The same for DecoderScores::kOwn, whose words are known to fit.
constexpr const char* kNarrowBeam = "1e-30";
/// No path is given up.
constexpr const char* kNoBeam = "0";
/// Without a beam every phone is kept in mind in every frame: about 100 bytes each.
constexpr std::size_t kMostWithoutBeam = 10'000'000;

Decoder makeDecoder(const std::filesystem::path& model, const char* beam, DecoderScores scores) {
  static std::once_flag silenced;
  std::call_once(silenced, [] { err_set_logfp(nullptr); });
  // No noise removal: it moves edges.
  const Config config(cmd_ln_init(nullptr, ps_args(), TRUE, "-hmm", model.c_str(), "-remove_noise", "no",
                                  "-remove_silence", "no", "-dither", "no", "-bestpath", "no", "-fsgusefiller", "no",
                                  "-fsgusealtpron", "no", "-lw", "1", "-wip", "1", "-pip", "1", "-beam", beam, "-pbeam",
                                  beam, "-wbeam", beam, "-maxhmmpf", "-1", "-compallsen",
                                  scores == DecoderScores::kAgainstBest ? "yes" : "no", nullptr));
  Decoder decoder(config ? ps_init(config.get()) : nullptr);
  if (!decoder) throw InputError(model.string(), "", "is no acoustic model that PocketSphinx can read");
  for (std::size_t i = 1; i < kPhoneCount; ++i) {
    const auto phone = static_cast<Phone>(i);
    if (phone == Phone::kAX) continue;
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

DecodedPhone readSegment(ps_seg_t* segment, const std::vector<std::size_t>& kept) {
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
  return phone;
}

/// `kept`: the frames that the decoder heard; empty for all.
std::vector<DecodedPhone> readResult(ps_decoder_t* decoder, const std::vector<std::size_t>& kept) {
  std::vector<DecodedPhone> phones;
  if (ps_get_hyp(decoder, nullptr) == nullptr) return phones;
  for (ps_seg_t* segment = ps_seg_iter(decoder); segment != nullptr; segment = ps_seg_next(segment)) {
    if (std::string_view(ps_seg_word(segment)) == "(NULL)") continue;
    phones.push_back(readSegment(segment, kept));
  }
  return phones;
}

}  // namespace

struct PhoneDecoder::State {
  std::filesystem::path model;
  Decoder decoder;
  Decoder patient;  ///< without a beam; made when first needed
  DecoderScores scores = DecoderScores::kAgainstBest;
};

PhoneDecoder::PhoneDecoder(const std::filesystem::path& model, DecoderScores scores)
    : state_(std::make_unique<State>(State{
          modelOr(model), makeDecoder(modelOr(model), scores == DecoderScores::kOwn ? kNarrowBeam : kWideBeam, scores),
          nullptr, scores})) {}
PhoneDecoder::~PhoneDecoder() = default;
PhoneDecoder::PhoneDecoder(PhoneDecoder&&) noexcept = default;
PhoneDecoder& PhoneDecoder::operator=(PhoneDecoder&&) noexcept = default;

namespace {

void expectDone(int result, const char* what) {
  if (result < 0) throw InputError("pocketsphinx", "", fmt::format("could not {}", what));
}

/// Empty where no path through all words was kept.
std::vector<DecodedPhone> decodeWith(ps_decoder_t* decoder, std::span<const std::int16_t> samples,
                                     const WordWays& words, SpeechKind kind) {
  const Graph graph = makeGraph(decoder, words);
  expectDone(ps_set_fsg(decoder, "words", graph.get()), "take the words");
  expectDone(ps_set_search(decoder, "words"), "take the words");
  Cepstra cepstra;
  std::vector<std::size_t> kept;
  std::vector<mfcc_t*> rows;
  if (kind == SpeechKind::kSung) {
    cepstra = cepstraOf(decoder, samples);
    if (cepstra.empty()) return {};
    kept = thinFrames(cepstra, kSungFramesAPhone * fewestPhones(words));
    for (const std::size_t frame : kept) rows.push_back(cepstra[frame].data());
  }
  expectDone(ps_start_utt(decoder), "start");
  const int fed = kind == SpeechKind::kSung
                      ? ps_process_cep(decoder, rows.data(), static_cast<int>(rows.size()), FALSE, TRUE)
                      : ps_process_raw(decoder, samples.data(), samples.size(), FALSE, TRUE);
  const int ended = ps_end_utt(decoder);
  expectDone(fed, "hear the sound");
  expectDone(ended, "end");
  std::vector<DecodedPhone> phones = readResult(decoder, kept);
  std::size_t found = 0;
  for (const DecodedPhone& phone : phones) found += phone.opens_word ? 1 : 0;
  if (found != words.size()) phones.clear();
  return phones;
}

}  // namespace

std::vector<DecodedPhone> PhoneDecoder::decode(std::span<const std::int16_t> samples, const WordWays& words,
                                               SpeechKind kind) {
  MOUTHPIECE_EXPECT(!words.empty());
  std::vector<DecodedPhone> phones = decodeWith(state_->decoder.get(), samples, words, kind);
  if (!phones.empty()) return phones;
  if (state_->scores == DecoderScores::kOwn) return phones;  // it only refines
  // Words that hardly fit fall behind any beam.
  const auto frames = static_cast<std::size_t>(static_cast<double>(samples.size()) / kDecoderSampleRateHz / kFrameStep);
  const std::size_t phone_count = fewestPhones(words);
  if (frames < phone_count || frames > kMostWithoutBeam / std::max<std::size_t>(1, phone_count)) return phones;
  if (!state_->patient) state_->patient = makeDecoder(state_->model, kNoBeam, state_->scores);
  return decodeWith(state_->patient.get(), samples, words, kind);
}

}  // namespace mouthpiece
