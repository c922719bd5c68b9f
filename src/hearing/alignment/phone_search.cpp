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

// Frames of 10 ms. What the longest stretch hears is believed: a time that grows with the square allows no longer ones.
constexpr Eigen::Index kStretch = 3000, kLongestStretch = 8 * kStretch, kLookAhead = 600, kPause = 20;

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
  StretchHearing(ps_decoder_t* decoder, const PatientDecoder& patient, SenoneScorer& scorer,
                 const Eigen::MatrixXf& features, const WordWays& words, const std::vector<bool>& codebooks,
                 const Pauses& pauses)
      : decoder_(decoder),
        patient_(patient),
        scorer_(scorer),
        features_(features),
        words_(words),
        codebooks_(codebooks),
        pauses_(pauses) {}

  /// Where a stretch ends in no pause, it is heard anew twice as long; where the next one does not go on as it did,
  /// too.
  std::vector<DecodedPhone> hear() {
    std::vector<Stretch> heard;
    Stretch next;
    while (true) {
      const bool is_last = hearOut(next);
      const bool was_longest = !heard.empty() && heard.back().frames >= kLongestStretch;
      const bool is_believed =
          !next.phones.empty() && (heard.empty() || was_longest || agree(heard.back().beyond, next.phones));
      const std::size_t pause = is_believed && !is_last ? lastPause(next) : 0;
      if (is_believed && is_last) {
        heard.push_back(std::move(next));
        return joined(heard);
      }
      if (pause > 0) {
        Stretch after = partAt(pause, next);
        heard.push_back(std::exchange(next, std::move(after)));
        continue;
      }
      if (!is_believed && !heard.empty() && !was_longest) {
        next = std::move(heard.back());
        heard.pop_back();
      } else if (is_last || next.frames >= kLongestStretch) {
        return {};
      }
      next.frames *= 2;
    }
  }

 private:
  struct Stretch {
    Eigen::Index begin = 0, frames = kStretch;
    std::size_t word = 0;                      ///< its first
    std::vector<DecodedPhone> phones, beyond;  ///< and those that lie behind the pause in which it ends
  };

  static constexpr std::size_t kAgreed = 3;  // words

  /// Whether `stretch` reaches to the end of the sound.
  bool hearOut(Stretch& stretch) {
    const Eigen::Index left = features_.cols() - stretch.begin;
    const bool is_last = left <= stretch.frames + stretch.frames / 2;
    if (is_last) stretch.frames = left;
    stretch.phones = hearFrom(stretch.begin, stretch.frames, stretch.word, is_last);
    return is_last;
  }

  /// What follows `stretch`, which ends in the middle of `pause` from now on.
  static Stretch partAt(std::size_t pause, Stretch& stretch) {
    DecodedPhone& silence = stretch.phones[pause];
    const int half = silence.frames / 2;
    stretch.beyond.assign(stretch.phones.begin() + signedIndex(pause) + 1, stretch.phones.end());
    silence.score *= asReal(half) / silence.frames;
    silence.frames = half;
    const Eigen::Index end = signedIndex(silence.first_frame) + half;
    stretch.phones.resize(pause + 1);
    return {.begin = end, .word = stretch.word + wordsIn(stretch.phones), .phones = {}, .beyond = {}};
  }

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
      std::size_t found = wordsIn(phones);
      if ((to_end ? found != left : found == 0) && isHeardWithoutBeam(count, graph->n_state)) {
        phones = search(patient_(), scorer_, graph.get(), heard, {}, weighing);
        found = wordsIn(phones);
      }
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

  /// The last silence before a word that is long enough to be parted, in the longest stretch the last of all, and that
  /// ends before words which might be heard otherwise if more followed; 0: there is none.
  static std::size_t lastPause(const Stretch& stretch) {
    const Eigen::Index shortest = stretch.frames < kLongestStretch ? kPause : 2;
    bool leads_to_word = false;
    for (std::size_t i = stretch.phones.size(); i-- > 1;) {
      const DecodedPhone& phone = stretch.phones[i];
      leads_to_word = leads_to_word || phone.opens_word;
      if (leads_to_word && phone.phone == Phone::kSil && phone.frames >= shortest &&
          signedIndex(phone.first_frame) + phone.frames <= stretch.begin + stretch.frames - kLookAhead)
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

  /// Silences that were parted are one again.
  static std::vector<DecodedPhone> joined(std::span<const Stretch> heard) {
    std::vector<DecodedPhone> all;
    for (const auto& [begin, frames, word, phones, beyond] : heard) {
      const bool goes_on = !all.empty() && phones.front().phone == Phone::kSil;
      if (goes_on) {
        all.back().span.end = phones.front().span.end;
        all.back().frames += phones.front().frames;
        all.back().score += phones.front().score;
      }
      all.insert(all.end(), phones.begin() + (goes_on ? 1 : 0), phones.end());
    }
    return all;
  }

  ps_decoder_t* decoder_;
  const PatientDecoder& patient_;
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

bool isHeardWithoutBeam(Eigen::Index frames, std::int64_t phones) {
  constexpr std::int64_t kMost = 10'000'000;
  return frames <= kMost / std::max<std::int64_t>(1, phones);
}

std::vector<DecodedPhone> hearInStretches(ps_decoder_t* decoder, const PatientDecoder& patient, SenoneScorer& scorer,
                                          const Eigen::MatrixXf& features, const WordWays& words,
                                          const std::vector<bool>& codebooks, const Pauses& pauses) {
  if (features.cols() <= 2 * kStretch) return {};
  return StretchHearing(decoder, patient, scorer, features, words, codebooks, pauses).hear();
}

}  // namespace mouthpiece
