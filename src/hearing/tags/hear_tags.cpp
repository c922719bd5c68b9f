#include "hearing/tags/hear_tags.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "audio/pitch_track.h"
#include "audio/spectral_frames.h"
#include "base/index.h"
#include "base/statistics.h"
#include "hearing/tags/pitch_contour.h"
#include "hearing/tags/unlabelled_notes.h"
#include "hearing/tags/vowel_network.h"

namespace mouthpiece {
namespace {

constexpr double kLowestSungHz = 60;
constexpr double kHighestSungHz = 1100;  // a soprano's C6 is 1047 Hz
/// Shorter holes in the pitch of a vowel are bridged, longer ones part it.
constexpr std::size_t kLongestHole = 3;
constexpr std::size_t kShortestRun = 4;
constexpr Seconds kShortestNote = 0.05;
/// VOCAL 4.2: "localized high frequency (HF=8-20kHz) energy".
constexpr double kConsonantLowHz = 8000, kConsonantHighHz = 20000;
/// Sound whose band ends lower is judged by the highest octave that it has.
constexpr double kLeastBandTopHz = 10000;
/// Of a sound that was sampled faster than it was heard: under this share of its energy there is nothing.
constexpr double kNothingShare = 1e-7;

std::vector<PitchSample> pitchOf(const AudioClip& clip) {
  const PitchTrack track = trackPitch(clip, {.step = 0.005, .lowest_hz = kLowestSungHz, .highest_hz = kHighestSungHz});
  std::vector<PitchSample> samples;
  for (std::size_t i = 0; i < track.frames.size(); i += 2) {
    const double hz = track.frames[i].hz;
    samples.push_back({.time = asReal(samples.size()) / kPitchRateHz, .hz = hz, .voiced = hz > 0});
  }
  return samples;
}

/// Around a sample, for its median.
constexpr std::size_t kMedianReach = 12;
constexpr double kMostFromMedianSemitones = 8;
constexpr double kNearMedianSemitones = 2;

double medianAround(const std::vector<PitchSample>& f0, std::size_t at) {
  std::vector<double> values;
  const std::size_t last = std::min(f0.size() - 1, at + kMedianReach);
  for (std::size_t i = at > kMedianReach ? at - kMedianReach : 0; i <= last; ++i) {
    if (f0[i].voiced) values.push_back(f0[i].hz);
  }
  return median(std::move(values));
}

/// The tracker at times takes a harmonic, or half the pitch, for the pitch: such a sample is set right by its
/// surroundings, or is no pitch.
void setOctavesRight(std::vector<PitchSample>& f0) {
  const std::vector<PitchSample> heard = f0;
  for (std::size_t i = 0; i < f0.size(); ++i) {
    if (!heard[i].voiced) continue;
    const double usual = medianAround(heard, i);
    const auto semitonesOff = [&](double hz) { return std::abs(12 * std::log2(hz / usual)); };
    if (semitonesOff(heard[i].hz) <= kMostFromMedianSemitones) continue;
    f0[i] = {.time = heard[i].time};
    for (const double factor : {1. / 2, 1. / 3, 1. / 4, 2., 3.}) {
      if (semitonesOff(heard[i].hz * factor) > kNearMedianSemitones) continue;
      f0[i] = {.time = heard[i].time, .hz = heard[i].hz * factor, .voiced = true};
      break;
    }
  }
}

void silenceOutside(std::vector<PitchSample>& f0, const std::vector<TimeSpan>& vowels) {
  auto vowel = vowels.begin();
  for (PitchSample& sample : f0) {
    while (vowel != vowels.end() && vowel->end <= sample.time) ++vowel;
    if (vowel == vowels.end() || !vowel->contains(sample.time)) sample = {.time = sample.time};
  }
}

/// The pitch of samples [first, first + hz.size()), all voiced.
struct VoicedRun {
  std::size_t first = 0;
  std::vector<double> hz;
};

void closeHole(VoicedRun& run, std::size_t until, double hz) {
  const std::size_t from = run.first + run.hz.size() - 1;
  const double before = run.hz.back();
  for (std::size_t i = from + 1; i < until; ++i) {
    run.hz.push_back(std::lerp(before, hz, asReal(i - from) / asReal(until - from)));
  }
}

std::vector<VoicedRun> voicedRuns(const std::vector<PitchSample>& f0, const TimeSpan& span) {
  std::vector<VoicedRun> runs;
  const std::size_t first = unsignedIndex(std::lround(std::max(0.0, std::ceil(span.start * kPitchRateHz - 1e-6))));
  for (std::size_t i = first; i < f0.size() && f0[i].time < span.end; ++i) {
    if (!f0[i].voiced) continue;
    const bool goes_on = !runs.empty() && i - (runs.back().first + runs.back().hz.size()) <= kLongestHole;
    if (goes_on) {
      closeHole(runs.back(), i, f0[i].hz);
    } else {
      runs.push_back({i, {}});
    }
    runs.back().hz.push_back(f0[i].hz);
  }
  std::erase_if(runs, [](const VoicedRun& run) { return run.hz.size() < kShortestRun; });
  return runs;
}

TimeSpan spanOfSamples(std::size_t first, std::size_t last) {
  return {asReal(first) / kPitchRateHz, asReal(last) / kPitchRateHz};
}

/// Where the vowels are not known: of vibrato in them, ups and downs are alike.
constexpr double kMostSwingRatio = 2;

void tagVibrato(const VoicedRun& run, const std::vector<VibratoRun>& found, AudioTags& tags) {
  for (const VibratoRun& vibrato : found) {
    tags.vibrato.push_back(
        {spanOfSamples(run.first + vibrato.first, run.first + vibrato.last), vibrato.rate_hz, vibrato.depth_semitones});
  }
}

/// Notes and vibrato of the pitch of one vowel.
void tagVowel(const VoicedRun& run, AudioTags& tags) {
  for (const PitchPiece& piece : fitPitchPieces(run.hz, {.rate_hz = kPitchRateHz})) {
    const TimeSpan span = spanOfSamples(run.first + piece.first, run.first + piece.last);
    if (isNote(piece) && span.duration() >= kShortestNote) tags.notes.push_back({span, piece.median_hz, false});
  }
  tagVibrato(run, findVibrato(run.hz, {.rate_hz = kPitchRateHz}), tags);
}

/// The same where nobody knows the vowels: voiced consonants part them.
void tagUnlabelled(const AudioClip& clip, AudioTags& tags) {
  constexpr double kSonorousLowHz = 600, kSonorousHighHz = 4000;
  std::vector<double> level_db = bandLevelsDb(clip, kSonorousLowHz, kSonorousHighHz, 1 / kPitchRateHz);
  if (level_db.empty()) return;
  level_db.resize(std::max(level_db.size(), tags.f0.size()), level_db.back());
  for (const VoicedRun& run : voicedRuns(tags.f0, {0, clip.duration() + 1})) {
    const std::vector<VibratoRun> vibrato =
        findVibrato(run.hz, {.rate_hz = kPitchRateHz, .most_swing_ratio = kMostSwingRatio});
    for (const Note& note :
         unlabelledNotes(run.hz, std::span(level_db).subspan(run.first, run.hz.size()), run.first, vibrato))
      tags.notes.push_back(note);
    tagVibrato(run, vibrato, tags);
  }
}

/// The band that consonants are judged by: VOCAL's, or the highest octave that the sound has.
std::pair<double, double> consonantBand(const AudioClip& clip) {
  const double nyquist = 0.5 * clip.sample_rate_hz;
  const TimeSpan all{0, clip.duration()};
  const double sound = bandEnergy(clip, all, 0, nyquist);
  const double top = std::min(kConsonantHighHz, nyquist);
  const bool is_heard = top >= kLeastBandTopHz && bandEnergy(clip, all, kConsonantLowHz, top) > kNothingShare * sound;
  if (is_heard) return {kConsonantLowHz, top};
  double highest = std::min(kConsonantLowHz, nyquist);
  constexpr double kLowestTopHz = 3000;
  while (highest > kLowestTopHz && !(bandEnergy(clip, all, 0.8 * highest, highest) > kNothingShare * sound))
    highest *= 0.8;
  return {0.5 * highest, highest};
}

std::vector<ConsonantEnergy> consonantsOf(const AudioClip& clip, const SpeechLabels& labels,
                                          const std::pair<double, double>& band) {
  std::vector<ConsonantEnergy> consonants;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    const LabelledPhone& phone = labels.phones[i];
    if (phone.phone == Phone::kSil || isVowel(phone.phone)) continue;
    consonants.push_back({PhoneIndex(i), phone.span, bandEnergy(clip, phone.span, band.first, band.second)});
  }
  return consonants;
}

}  // namespace

std::vector<TimeSpan> vowelSpans(const SpeechLabels& labels) {
  std::vector<TimeSpan> spans;
  for (const LabelledPhone& phone : labels.phones) {
    if (isVowel(phone.phone)) spans.push_back(phone.span);
  }
  return spans;
}

AudioTags hearTags(const AudioClip& clip, const SpeechLabels* labels) {
  AudioTags tags;
  tags.f0 = pitchOf(clip);
  setOctavesRight(tags.f0);
  if (labels == nullptr) {
    tagUnlabelled(clip, tags);
  } else {
    const std::vector<TimeSpan> vowels = vowelSpans(*labels);
    silenceOutside(tags.f0, vowels);
    const std::pair<double, double> band = consonantBand(clip);
    tags.consonants = consonantsOf(clip, *labels, band);
    tags.consonant_low_hz = band.first;
    for (const TimeSpan& vowel : vowels) {
      for (const VoicedRun& run : voicedRuns(tags.f0, vowel)) tagVowel(run, tags);
    }
  }
  tags.vowels = hearVowels(clip);
  return tags;
}

}  // namespace mouthpiece
