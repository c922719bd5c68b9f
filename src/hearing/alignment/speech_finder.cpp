#include "hearing/alignment/speech_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "audio/spectral_frames.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kLevelFrame = 160;  // 10 ms at 16 kHz
constexpr double kLevelStep = 0.010;
constexpr double kSilenceDb = -10;  ///< of 16-bit samples: digital silence
/// Speech stands above its background by this, or by a share of what the loudest does.
constexpr double kLeastRiseDb = 5, kRiseShare = 0.30;
constexpr std::size_t kWindowFrames = 3000;  ///< backgrounds are looked for in half a minute
constexpr std::size_t kPauseFrames = 35, kMarginFrames = 15, kShortestRun = 6;
/// Speech rises and falls in some band, whatever noise is in the others; what stays within this (standard deviation)
/// in all of them for a second is none.
constexpr std::array<double, 6> kBandsHz{200, 600, 1200, 2400, 4000, 7000};
constexpr double kSteadyBandDb = 3.8;
/// The same in the least steady second: white and pink noise reach 2.4, a word in noise as loud as itself 2.5 and more.
constexpr double kSurelySteadyBandDb = 2.45;
/// What stays within this as a whole, and is purer than speech in noise that does, are tones.
constexpr double kSteadyLevelDb = 3.2, kPureFlatness = 0.002;
constexpr Seconds kShortestJudged = 1.0;
/// Geometric over arithmetic mean of the spectrum: steady tones are under it, noise over it.
constexpr double kTonalFlatness = 0.15;

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return kSilenceDb;
  const auto at = values.begin() + signedIndex(static_cast<std::size_t>(share * asReal(values.size() - 1)));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Frames {
  std::size_t first = 0, end = 0;
};

/// Half a minute of frames, and the minute around it that tells their background.
struct Window {
  Frames own, around;
};

std::vector<Window> windowsOf(std::size_t count) {
  std::vector<Window> windows;
  for (std::size_t at = 0; at < count; at += kWindowFrames) {
    windows.push_back({{at, std::min(count, at + kWindowFrames)},
                       {at - std::min(at, kWindowFrames / 2), std::min(count, at + kWindowFrames * 3 / 2)}});
  }
  return windows;
}

/// Over its background, frame by frame; the background is the window's quietest twentieth.
std::vector<bool> loudFrames(const std::vector<double>& db) {
  std::vector<bool> loud(db.size());
  for (const auto& [own, around] : windowsOf(db.size())) {
    const std::vector<double> window(db.begin() + signedIndex(around.first), db.begin() + signedIndex(around.end));
    const double floor = quantile(window, 0.05), top = quantile(window, 0.95);
    const bool is_steady = top - floor < kLeastRiseDb;
    const double threshold =
        is_steady ? std::max(floor - 1, kSilenceDb + 20) : floor + std::max(kLeastRiseDb, kRiseShare * (top - floor));
    for (std::size_t i = own.first; i < own.end; ++i) loud[i] = db[i] > threshold;
  }
  return loud;
}

std::vector<Frames> runsOf(const std::vector<bool>& loud) {
  std::vector<Frames> runs;
  for (std::size_t i = 0; i < loud.size(); ++i) {
    if (!loud[i]) continue;
    std::size_t end = i;
    while (end < loud.size() && loud[end]) ++end;
    if (!runs.empty() && i - runs.back().end < kPauseFrames) {
      runs.back().end = end;
    } else {
      runs.push_back({i, end});
    }
    i = end;
  }
  std::erase_if(runs, [](const Frames& run) { return run.end - run.first < kShortestRun; });
  return runs;
}

/// At the quietest tenth of a second of its second half, as long as it is too long.
void addInParts(std::vector<Frames>& parts, Frames run, const std::vector<double>& db) {
  constexpr std::size_t kMost = static_cast<std::size_t>(kLongestStretch / kLevelStep), kQuiet = 10;
  while (run.end - run.first > kMost) {
    std::size_t best = run.first + kMost / 2;
    double best_sum = 1e9;
    for (std::size_t i = run.first + kMost / 2; i + kQuiet < run.first + kMost; ++i) {
      double sum = 0;
      for (std::size_t k = 0; k < kQuiet; ++k) sum += db[i + k];
      if (sum < best_sum) {
        best_sum = sum;
        best = i + kQuiet / 2;
      }
    }
    parts.push_back({run.first, best});
    run.first = best;
  }
  parts.push_back(run);
}

/// Geometric over arithmetic mean of the power between 100 Hz and 5 kHz, all of it added up.
double flatness(std::span<const std::int16_t> samples) {
  constexpr std::size_t kTransform = 2048, kFirstBin = 13, kEndBin = 640;
  Eigen::FFT<double> transform;
  std::vector<double> frame(kTransform);
  std::vector<std::complex<double>> spectrum;
  double flat = 0, count = 0;
  for (std::size_t at = 0; at + kTransform <= samples.size(); at += kTransform) {
    for (std::size_t i = 0; i < kTransform; ++i)
      frame[i] = samples[at + i] * (0.5 - 0.5 * std::cos(2 * std::numbers::pi * asReal(i) / kTransform));
    transform.fwd(spectrum, frame);
    double log_sum = 0, sum = 0;
    for (std::size_t bin = kFirstBin; bin < kEndBin; ++bin) {
      const double power = std::norm(spectrum[bin]) + 1e-3;
      log_sum += std::log(power);
      sum += power;
    }
    constexpr double kBins = kEndBin - kFirstBin;
    flat += std::exp(log_sum / kBins) / (sum / kBins);
    count += 1;
  }
  return count > 0 ? flat / count : 1;
}

/// Standard deviation of levels within a second, or what there is: of the seconds' the one that is over `share` of
/// them.
double spreadOf(std::span<const double> db, double share) {
  std::vector<double> spreads;
  const std::size_t length = std::min<std::size_t>(100, db.size());
  for (std::size_t at = 0; at + length <= db.size() && length > 0; at += length / 2 + 1) {
    const Eigen::Map<const Eigen::ArrayXd> second(db.data() + at, signedIndex(length));
    spreads.push_back(std::sqrt((second - second.mean()).square().mean()));
  }
  return spreads.empty() ? 0 : quantile(std::move(spreads), share);
}
/// The median, since a chord sets in once.
double usualSpread(std::span<const double> db) { return spreadOf(db, 0.5); }

/// Levels of the bands every 10 ms, in dB, as long as there are samples for their window.
using BandLevels = std::array<std::vector<double>, kBandsHz.size() - 1>;

BandLevels bandLevels(std::span<const std::int16_t> samples) {
  constexpr std::size_t kWindow = 400, kTransform = 512;
  constexpr double kBinHz = 16000.0 / kTransform, kLeastPower = 0.1;
  Eigen::FFT<double> transform;
  std::vector<double> frame(kTransform, 0.0);
  std::vector<std::complex<double>> spectrum;
  BandLevels db;
  for (std::size_t at = 0; at + kWindow <= samples.size(); at += kLevelFrame) {
    for (std::size_t i = 0; i < kWindow; ++i)
      frame[i] = samples[at + i] * (0.5 - 0.5 * std::cos(2 * std::numbers::pi * asReal(i) / kWindow));
    transform.fwd(spectrum, frame);
    for (std::size_t band = 0; band < db.size(); ++band) {
      const auto first = static_cast<std::size_t>(std::ceil(kBandsHz[band] / kBinHz));
      const auto end = static_cast<std::size_t>(std::ceil(kBandsHz[band + 1] / kBinHz));
      double power = 0;
      for (std::size_t bin = first; bin < end; ++bin) power += std::norm(spectrum[bin]);
      db[band].push_back(10 * std::log10(power / (asReal(end - first) * kWindow) + kLeastPower));
    }
  }
  return db;
}

/// Of the band that changes the most: its usualSpread(), and that of its least steady second.
struct BandSpread {
  double usual = 0, most = 0;
};

BandSpread spreadOfBands(std::span<const std::int16_t> samples) {
  BandSpread largest;
  for (const std::vector<double>& levels : bandLevels(samples)) {
    largest.usual = std::max(largest.usual, usualSpread(levels));
    largest.most = std::max(largest.most, spreadOf(levels, 1));
  }
  return largest;
}

/// How many frames follow `end` (`step` 1) or come before it (-1) that still are `over`, none farther from the last one
/// than kNearby, kMost at most.
std::size_t goesOn(const std::vector<bool>& over, std::size_t end, int step) {
  constexpr std::size_t kNearby = 20, kMost = 150;
  std::size_t frames = 0;
  for (std::size_t i = 1; i <= std::min(frames + kNearby, kMost); ++i) {
    const std::size_t at = step > 0 ? end + i - 1 : end - i;
    if (at >= over.size()) break;  // an end of the sound
    if (over[at]) frames = i;
  }
  return frames;
}

/// The mean of each level and of the kMean on either side of it.
std::vector<double> smoothed(const std::vector<double>& levels) {
  constexpr std::size_t kMean = 5;
  std::vector<double> means(levels.size());
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const std::size_t from = i - std::min(i, kMean), to = std::min(levels.size(), i + kMean + 1);
    for (std::size_t at = from; at < to; ++at) means[i] += levels[at] / asReal(to - from);
  }
  return means;
}

/// Where a noisy window has a band that stays over its background by kOver times what the background changes by.
std::vector<bool> framesOverNoise(const std::vector<Frames>& runs, const std::vector<double>& db,
                                  std::span<const std::int16_t> samples) {
  constexpr double kNoisyDb = 25, kOver = 4, kLeastChangeDb = 0.4;
  constexpr std::size_t kLeastFrames = 30;  // of background
  std::vector<bool> is_background(db.size(), true), over(db.size(), false);
  for (const Frames& run : runs) {
    for (std::size_t i = run.first - std::min(run.first, kMarginFrames);
         i < std::min(db.size(), run.end + kMarginFrames); ++i)
      is_background[i] = false;
  }
  std::vector<Window> noisy = windowsOf(db.size());
  std::erase_if(noisy, [&](const Window& window) {
    const std::vector<double> around(db.begin() + signedIndex(window.around.first),
                                     db.begin() + signedIndex(window.around.end));
    return quantile(around, 0.95) - quantile(around, 0.05) > kNoisyDb;
  });
  if (noisy.empty()) return over;
  for (const std::vector<double>& levels : bandLevels(samples)) {
    const std::vector<double> means = smoothed(levels);
    for (const auto& [own, around] : noisy) {
      std::vector<double> background;
      for (std::size_t i = around.first; i < std::min(means.size(), around.end); ++i) {
        if (is_background[i]) background.push_back(means[i]);
      }
      if (background.size() < kLeastFrames) continue;
      const double usual = quantile(background, 0.5);
      const double change = std::max(kLeastChangeDb, usual - quantile(background, 0.16));
      for (std::size_t i = own.first; i < std::min(means.size(), own.end); ++i)
        over[i] = over[i] || means[i] > usual + kOver * change;
    }
  }
  return over;
}

/// Speech that begins or ends quietly in a steady noise is less than that as a whole, but more in some band: a run goes
/// on there.
void widenInNoise(std::vector<Frames>& runs, const std::vector<double>& db, std::span<const std::int16_t> samples) {
  if (runs.empty()) return;
  const std::vector<bool> over = framesOverNoise(runs, db, samples);
  std::vector<Frames> wider;
  for (const Frames& run : runs) {
    const Frames all{run.first - goesOn(over, run.first, -1), run.end + goesOn(over, run.end, 1)};
    if (!wider.empty() && all.first < wider.back().end + kPauseFrames) {
      wider.back().end = std::max(wider.back().end, all.end);
    } else {
      wider.push_back(all);
    }
  }
  runs = std::move(wider);
}

/// What a run is; its span is left open.
SoundStretch judged(const Frames& run, const std::vector<double>& db, std::span<const std::int16_t> samples) {
  const std::size_t count = run.end - run.first;
  if (asReal(count) * kLevelStep < kShortestJudged) return {};
  const std::span<const std::int16_t> sound = samples.subspan(run.first * kLevelFrame, count * kLevelFrame);
  const BandSpread spread = spreadOfBands(sound);
  if (spread.usual < kSteadyBandDb)
    return {.kind = flatness(sound) < kTonalFlatness ? SoundKind::kMusic : SoundKind::kNoise,
            .is_steady = spread.most < kSurelySteadyBandDb};
  const bool is_tones =
      usualSpread(std::span(db).subspan(run.first, count)) < kSteadyLevelDb && flatness(sound) < kPureFlatness;
  return {.kind = is_tones ? SoundKind::kMusic : SoundKind::kSpeech};
}

}  // namespace

std::vector<SoundStretch> findSpeech(std::span<const std::int16_t> samples) {
  const std::vector<double> db = speechLevelsDb(samples);
  std::vector<Frames> parts;
  std::vector<Frames> runs = runsOf(loudFrames(db));
  widenInNoise(runs, db, samples);
  for (const Frames& run : runs) addInParts(parts, run, db);
  std::vector<SoundStretch> stretches;
  const Seconds duration = asReal(samples.size()) / 16000;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    SoundStretch stretch = judged(parts[i], db, samples);
    // Sounds begin and end quietly: half of the pause at most.
    const Seconds before = i > 0 ? asReal(parts[i - 1].end) * kLevelStep : 0;
    const Seconds after = i + 1 < parts.size() ? asReal(parts[i + 1].first) * kLevelStep : duration;
    const Seconds first = asReal(parts[i].first) * kLevelStep, end = asReal(parts[i].end) * kLevelStep;
    constexpr Seconds kMargin = kMarginFrames * kLevelStep;
    stretch.span = {std::max(first - kMargin, 0.5 * (first + before)), std::min(end + kMargin, 0.5 * (end + after))};
    stretches.push_back(stretch);
  }
  return stretches;
}

Seconds speechIn(const TimeSpan& span, std::span<const SoundStretch> stretches) {
  Seconds sum = 0;
  for (const SoundStretch& stretch : stretches) {
    if (stretch.kind == SoundKind::kSpeech)
      sum += std::max(0.0, std::min(stretch.span.end, span.end) - std::max(stretch.span.start, span.start));
  }
  return sum;
}

}  // namespace mouthpiece
