#include "hearing/tags/unlabelled_notes.h"

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"
#include "base/statistics.h"

namespace mouthpiece {
namespace {

constexpr double kDipDb = 5;
/// Of a dip a nucleus keeps the half beside it, and no more than this.
constexpr double kMostBelowPeakDb = 8, kShareOfDip = 0.5;
constexpr std::size_t kShortestNucleus = 5;
/// A nucleus that only glides is a note by itself if it is no shorter.
constexpr std::size_t kShortestGlide = 8;
/// What lies nearer in pitch is one note that wavers.
constexpr double kOneNoteSemitones = 0.5;
constexpr std::size_t kLongestGlide = 15;
/// Without words a fifth of the paper's cost and half as much slope again: a melisma's notes of a sixth of a second
/// would else be joined (docs/theory/hearing/notes_and_vibrato.md has the figures).
constexpr NoteFitOptions kFit{.rate_hz = kPitchRateHz, .note_slope_hz_s = 75, .piece_cost_share = 0.2};

/// A mean over three samples.
std::vector<double> smoothed(std::span<const double> values) {
  std::vector<double> smooth;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double before = values[i > 0 ? i - 1 : 0], after = values[std::min(i + 1, values.size() - 1)];
    smooth.push_back((before + values[i] + after) / 3);
  }
  return smooth;
}

struct Peaks {
  std::vector<std::size_t> tops;
  std::vector<std::size_t> bottoms;  ///< around them: one more than tops
};

Peaks findPeaks(const std::vector<double>& level) {
  Peaks peaks{.tops = {}, .bottoms = {0}};
  std::size_t extreme = 0;
  bool rises = true;
  for (std::size_t i = 1; i < level.size(); ++i) {
    const double on = rises ? level[i] - level[extreme] : level[extreme] - level[i];
    if (on > 0) {
      extreme = i;
    } else if (-on >= kDipDb) {
      (rises ? peaks.tops : peaks.bottoms).push_back(extreme);
      rises = !rises;
      extreme = i;
    }
  }
  if (rises) peaks.tops.push_back(extreme);
  peaks.bottoms.push_back(level.size() - 1);
  return peaks;
}

/// The pitch without its vibrato: there the geometric mean over a period.
std::vector<double> steadied(std::span<const double> pitch_hz, std::span<const VibratoRun> vibrato) {
  std::vector<double> steady(pitch_hz.begin(), pitch_hz.end());
  constexpr std::size_t kBeyond = 2;
  for (const VibratoRun& run : vibrato) {
    const std::size_t half = unsignedIndex(std::lround(kPitchRateHz / run.rate_hz)) / 2;
    const std::size_t least = run.first - std::min(run.first, kBeyond);
    const std::size_t most = std::min(pitch_hz.size() - 1, run.last + kBeyond);
    for (std::size_t i = run.first; i <= run.last; ++i) {
      const std::size_t from = std::max(least, i - std::min(i, half)), to = std::min(most, i + half);
      double sum = 0;
      for (std::size_t k = from; k <= to; ++k) sum += std::log(pitch_hz[k]);
      steady[i] = std::exp(sum / asReal(to - from + 1));
    }
  }
  return steady;
}

struct HeldPitch {
  std::size_t first = 0, last = 0;
  double hz = 0;
};

/// What is held in a nucleus; what lies close in pitch and time is one.
std::vector<HeldPitch> heldPitches(std::span<const double> pitch_hz) {
  std::vector<HeldPitch> held;
  for (const PitchPiece& piece : fitPitchPieces(pitch_hz, kFit)) {
    if (!isNote(piece, kFit) || piece.last - piece.first < kShortestNucleus) continue;
    const bool goes_on = !held.empty() && piece.first - held.back().last <= kLongestGlide &&
                         std::abs(12 * std::log2(piece.median_hz / held.back().hz)) < kOneNoteSemitones;
    if (!goes_on) {
      held.push_back({piece.first, piece.last, piece.median_hz});
      continue;
    }
    HeldPitch& before = held.back();
    const double old = asReal(before.last - before.first), more = asReal(piece.last - piece.first);
    before.hz = (before.hz * old + piece.median_hz * more) / (old + more);
    before.last = piece.last;
  }
  if (held.empty() && pitch_hz.size() > kShortestGlide)
    held.push_back({0, pitch_hz.size() - 1, median({pitch_hz.begin(), pitch_hz.end()})});
  return held;
}

}  // namespace

std::vector<SampleSpan> syllableNuclei(std::span<const double> level_db) {
  if (level_db.empty()) return {};
  const std::vector<double> level = smoothed(level_db);
  const Peaks peaks = findPeaks(level);
  std::vector<SampleSpan> nuclei;
  for (std::size_t i = 0; i < peaks.tops.size(); ++i) {
    const std::size_t top = peaks.tops[i];
    const auto leastBeside = [&](std::size_t bottom) {
      const double dip = std::max(kDipDb, level[top] - level[bottom]);
      return level[top] - std::min(kMostBelowPeakDb, kShareOfDip * dip);
    };
    SampleSpan nucleus{peaks.bottoms[i], peaks.bottoms[i + 1]};
    const double before = leastBeside(nucleus.first), after = leastBeside(nucleus.last);
    while (nucleus.first < top && level[nucleus.first] < before) ++nucleus.first;
    while (nucleus.last > top && level[nucleus.last] < after) --nucleus.last;
    if (nucleus.last - nucleus.first + 1 >= kShortestNucleus) nuclei.push_back(nucleus);
  }
  return nuclei;
}

std::vector<Note> unlabelledNotes(std::span<const double> pitch_hz, std::span<const double> level_db, std::size_t first,
                                  std::span<const VibratoRun> vibrato) {
  MOUTHPIECE_EXPECT(pitch_hz.size() == level_db.size());
  const std::vector<double> steady = steadied(pitch_hz, vibrato);
  const auto timeOf = [&](double sample) { return (asReal(first) + sample) / kPitchRateHz; };
  std::vector<Note> notes;
  for (const SampleSpan& nucleus : syllableNuclei(level_db)) {
    const std::vector<HeldPitch> held =
        heldPitches(std::span(steady).subspan(nucleus.first, nucleus.last - nucleus.first + 1));
    const double start = asReal(nucleus.first);
    for (std::size_t i = 0; i < held.size(); ++i) {
      const bool is_first = i == 0, is_last = i + 1 == held.size();
      const double from = is_first ? start : start + 0.5 * asReal(held[i - 1].last + held[i].first);
      const double to = is_last ? asReal(nucleus.last) : start + 0.5 * asReal(held[i].last + held[i + 1].first);
      notes.push_back({{timeOf(from), timeOf(to)}, held[i].hz, false});
    }
  }
  return notes;
}

}  // namespace mouthpiece
