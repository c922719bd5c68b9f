#include "hearing/alignment/phone_search.h"

#include <fmt/format.h>
#include <pocketsphinx.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

/// A frame's window is longer than its step: boundaries come out early by this (measured on TTS voices).
constexpr Seconds kBoundaryShift = 0.008;
constexpr std::size_t kMostPhones = 100'000;
constexpr const char* kSilenceWord = "<sil>";
/// The first phone of a word goes by a name of its own, so that the result tells where words begin.
constexpr std::string_view kFirstSuffix = "_first";

constexpr Eigen::Index kStretch = 3000, kLookAhead = 600, kPause = 20;  // frames

/// As PocketSphinx counts.
int count(const auto& list) { return static_cast<int>(list.size()); }

DecodedPhone readSegment(ps_seg_t* segment, const std::vector<std::size_t>& kept, const FleetingSounds& fleeting) {
  DecodedPhone phone;
  std::string_view name = ps_seg_word(segment);
  int first = 0, last = 0, score = 0;
  ps_seg_frames(segment, &first, &last);
  ps_seg_prob(segment, &score, nullptr, nullptr);
  const std::size_t from = unsignedIndex(first), to = unsignedIndex(last);
  phone.span = {edgeBefore(kept, from), edgeBefore(kept, to + 1)};
  phone.first_frame = from;
  phone.frames = last + 1 - first;
  phone.score = score;
  if (name == kSilenceWord) return phone;
  phone.opens_word = name.ends_with(kFirstSuffix);
  if (phone.opens_word) name.remove_suffix(kFirstSuffix.size());
  phone.phone = phoneFromName(name).value_or(Phone::kSil);
  phone.score /= fleeting.timesWeighed(phone.phone, from, to);
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

/// Hears a long text stretch by stretch. PocketSphinx looks at all states of a graph in every frame, so that the time
/// of a whole text grows with the square of its length.
class StretchHearing {
 public:
  StretchHearing(ps_decoder_t* decoder, SenoneScorer& scorer, const Eigen::MatrixXf& features, const WordWays& words,
                 const std::vector<bool>& codebooks, const Pauses& pauses)
      : decoder_(decoder),
        scorer_(scorer),
        features_(features),
        words_(words),
        codebooks_(codebooks),
        pauses_(pauses) {}

  std::vector<DecodedPhone> hear() {
    std::vector<DecodedPhone> all, before;
    Eigen::Index begin = 0;
    std::size_t word = 0;
    while (true) {
      const bool is_last = features_.cols() - begin <= kStretch + kStretch / 2;
      std::vector<DecodedPhone> stretch = hearFrom(begin, is_last ? features_.cols() - begin : kStretch, word, is_last);
      if (stretch.empty() || !agree(before, stretch)) return {};
      if (is_last) {
        append(stretch, all);
        return all;
      }
      const std::size_t pause = lastPause(stretch, begin + kStretch - kLookAhead);
      if (pause == 0) return {};
      DecodedPhone& silence = stretch[pause];
      const int half = silence.frames / 2;
      before.assign(stretch.begin() + signedIndex(pause) + 1, stretch.end());
      stretch.resize(pause + 1);
      silence.score *= asReal(half) / silence.frames;
      silence.frames = half;
      begin = signedIndex(silence.first_frame) + half;
      word += wordsIn(stretch);
      append(stretch, all);
    }
  }

 private:
  static constexpr std::size_t kAgreed = 3;  // words

  /// The words from `word` on, not all unless `to_end`, in `count` frames from `begin` on.
  std::vector<DecodedPhone> hearFrom(Eigen::Index begin, Eigen::Index count, std::size_t word, bool to_end) {
    const std::size_t left = words_.size() - word;
    // As many as there would be if all were spoken at one pace, and half as many again.
    std::size_t offered =
        to_end ? left : left * unsignedIndex(3 * count) / unsignedIndex(2 * (features_.cols() - begin));
    const Eigen::MatrixXf heard = features_.middleCols(begin, count);
    for (;; offered *= 2) {
      offered = std::clamp<std::size_t>(offered, 1, left);
      const Graph graph = makeGraph(decoder_, std::span(words_).subspan(word, offered), pauses_, !to_end);
      const auto weighing = [&](Eigen::Index, Eigen::Index) { return Weighing{codebooks_}; };
      std::vector<DecodedPhone> phones = search(decoder_, scorer_, graph.get(), heard, {}, weighing);
      const std::size_t found = wordsIn(phones);
      if (to_end && found != left) return {};
      if (!to_end && found + kAgreed > offered && offered < left) continue;
      for (DecodedPhone& phone : phones) {
        phone.first_frame += unsignedIndex(begin);
        phone.span = {edgeBefore({}, phone.first_frame),
                      edgeBefore({}, phone.first_frame + unsignedIndex(phone.frames))};
      }
      return phones;
    }
  }

  /// The last silence that is long enough to be parted and ends by `frame`; 0: there is none.
  static std::size_t lastPause(std::span<const DecodedPhone> phones, Eigen::Index frame) {
    for (std::size_t i = phones.size(); i-- > 1;) {
      if (phones[i].phone == Phone::kSil && phones[i].frames >= kPause &&
          signedIndex(phones[i].first_frame) + phones[i].frames <= frame)
        return i;
    }
    return 0;
  }

  /// Whether the first words of `after` are heard where `before`, the last of another stretch, has them.
  static bool agree(std::span<const DecodedPhone> before, std::span<const DecodedPhone> after) {
    std::size_t agreed = 0;
    auto other = after.begin();
    for (const DecodedPhone& phone : before) {
      if (!phone.opens_word) continue;
      other = std::find_if(other, after.end(), [](const DecodedPhone& later) { return later.opens_word; });
      if (other == after.end() || other->phone != phone.phone || other->first_frame != phone.first_frame) return false;
      ++other;
      if (++agreed == kAgreed) return true;
    }
    return before.empty();
  }

  /// A silence that was parted is one again.
  static void append(std::span<const DecodedPhone> stretch, std::vector<DecodedPhone>& all) {
    const bool goes_on = !all.empty() && stretch.front().phone == Phone::kSil;
    if (goes_on) {
      all.back().span.end = stretch.front().span.end;
      all.back().frames += stretch.front().frames;
      all.back().score += stretch.front().score;
    }
    all.insert(all.end(), stretch.begin() + (goes_on ? 1 : 0), stretch.end());
  }

  ps_decoder_t* decoder_;
  SenoneScorer& scorer_;
  const Eigen::MatrixXf& features_;
  const WordWays& words_;
  const std::vector<bool>& codebooks_;
  Pauses pauses_;
};

}  // namespace

void GraphDeleter::operator()(fsg_model_t* graph) const { fsg_model_free(graph); }

std::string wordFor(Phone phone, bool opens_word) {
  std::string name(phoneName(phone));
  if (opens_word) name += kFirstSuffix;
  return name;
}

/// States 0 to words.size() stand between words; each further one inside a way. `may_stop`: behind any word.
Graph makeGraph(ps_decoder_t* decoder, std::span<const WordWays::value_type> words, const Pauses& pauses,
                bool may_stop) {
  std::size_t inner_states = 0;
  for (const auto& ways : words) {
    for (const auto& phones : ways) inner_states += phones.size();
  }
  if (inner_states > kMostPhones) {
    throw InputError("transcript", "",
                     fmt::format("has {} phones; expected at most {} in one sound", inner_states, kMostPhones));
  }
  const int boundary_count = count(words) + 1;
  Graph graph(fsg_model_init("words", ps_get_logmath(decoder), 1.0F, boundary_count + static_cast<int>(inner_states)));
  int boundary = 0, next_state = boundary_count;
  for (const auto& ways : words) {
    for (const auto& phones : ways) {
      int from = boundary;
      for (std::size_t i = 0; i < phones.size(); ++i) {
        const int to = i + 1 == phones.size() ? boundary + 1 : next_state++;
        const int word = fsg_model_word_add(graph.get(), wordFor(phones[i], i == 0).c_str());
        fsg_model_trans_add(graph.get(), from, to, 0, word);
        from = to;
      }
    }
    ++boundary;
  }
  for (int state = 0; state < boundary_count; ++state) {
    const bool is_inner = state > 0 && state + 1 < boundary_count;
    fsg_model_add_silence(graph.get(), kSilenceWord, state,
                          pauses.likelihood * asFloat(is_inner ? std::exp(-pauses.inner_price) : 1.0));
    if (may_stop && is_inner) fsg_model_null_trans_add(graph.get(), state, boundary_count - 1, 0);
  }
  graph->start_state = 0;
  graph->final_state = boundary_count - 1;
  return graph;
}

Graph makeGraph(ps_decoder_t* decoder, std::span<const DecodedPhone> phones) {
  Graph graph(fsg_model_init("row", ps_get_logmath(decoder), 1.0F, count(phones) + 1));
  int state = 0;
  for (const DecodedPhone& phone : phones) {
    const std::string name = phone.phone == Phone::kSil ? kSilenceWord : wordFor(phone.phone, phone.opens_word);
    const int word = fsg_model_word_add(graph.get(), name.c_str());
    fsg_model_trans_add(graph.get(), state, state + 1, 0, word);
    ++state;
  }
  graph->start_state = 0;
  graph->final_state = state;
  return graph;
}

Seconds edgeBefore(const std::vector<std::size_t>& kept, std::size_t at) {
  if (kept.empty()) return asReal(at) * kFrameStep + (at > 0 ? kBoundaryShift : 0);
  if (at == 0) return 0;
  const std::size_t before = kept[at - 1] + 1;
  const std::size_t after = at < kept.size() ? kept[at] : before;
  return 0.5 * asReal(before + after) * kFrameStep + kBoundaryShift;
}

std::vector<DecodedPhone> search(ps_decoder_t* decoder, SenoneScorer& scorer, fsg_model_t* graph,
                                 const Eigen::MatrixXf& features, const std::vector<std::size_t>& kept,
                                 ScoreStream::WeighingOf weighing, const FleetingSounds& fleeting) {
  expectDone(ps_set_fsg(decoder, "words", graph), "take the words");
  expectDone(ps_set_search(decoder, "words"), "take the words");
  ScoreStream scores(scorer, features, std::move(weighing), fleeting);
  expectDone(searchThrough(decoder, scores) ? 0 : -1, "hear the sound");
  return readResult(decoder, kept, fleeting);
}

std::size_t wordsIn(std::span<const DecodedPhone> phones) {
  return unsignedIndex(
      std::count_if(phones.begin(), phones.end(), [](const DecodedPhone& phone) { return phone.opens_word; }));
}

std::vector<DecodedPhone> hearInStretches(ps_decoder_t* decoder, SenoneScorer& scorer, const Eigen::MatrixXf& features,
                                          const WordWays& words, const std::vector<bool>& codebooks,
                                          const Pauses& pauses) {
  if (features.cols() <= 2 * kStretch) return {};
  return StretchHearing(decoder, scorer, features, words, codebooks, pauses).hear();
}

}  // namespace mouthpiece
