#include "audio/sound_joiner.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr Seconds kLevelWindow = 0.03;

/// 1 at distance 0, smoothly to 0 at `reach` and beyond.
double taper(double distance, double reach) {
  if (distance >= reach) return 0;
  return 0.5 + 0.5 * std::cos(std::numbers::pi * std::max(distance, 0.0) / reach);
}

double levelDb(const AudioClip& clip, Seconds middle) {
  const double rate = clip.sample_rate_hz;
  const double last = asReal(clip.samples.size());
  const auto begin = static_cast<std::size_t>(std::clamp((middle - kLevelWindow / 2) * rate, 0.0, last));
  const auto end = static_cast<std::size_t>(std::clamp((middle + kLevelWindow / 2) * rate, 0.0, last));
  double energy = 1e-8;  // quieter than -80 dB is silence
  for (std::size_t i = begin; i < end; ++i) energy += double{clip.samples[i]} * clip.samples[i];
  return 10 * std::log10(energy / asReal(std::max<std::size_t>(end - begin, 1)));
}

/// The pitch within `reach` of `time` on the side that `direction` names; nullopt where it is unvoiced.
std::optional<double> pitchNear(const PitchTrack& pitch, Seconds time, double direction, Seconds reach) {
  for (Seconds away = 0; away <= reach; away += pitch.step) {
    const double hz = pitch.hzAt(time + direction * away);
    if (hz > 0) return hz;
  }
  return std::nullopt;
}

/// What a piece's grains are given at its two ends so that it meets its neighbours; nothing at the line's own ends.
struct Meeting {
  double level_db = 0;
  double log_pitch = 0;
};
struct PieceEnds {
  Meeting start, end;
};

std::vector<PieceEnds> meetHalfWay(const std::vector<SoundPiece>& pieces, const SoundJoinOptions& options) {
  std::vector<PieceEnds> ends(pieces.size());
  constexpr Seconds kPitchReach = 0.03;
  for (std::size_t i = 0; i + 1 < pieces.size(); ++i) {
    const SoundPiece &left = pieces[i], &right = pieces[i + 1];
    const double level_step =
        std::clamp(levelDb(right.sound->clip, right.source.start) - levelDb(left.sound->clip, left.source.end),
                   -options.most_level_db, options.most_level_db);
    ends[i].end.level_db = level_step / 2;
    ends[i + 1].start.level_db = -level_step / 2;
    const auto before = pitchNear(left.sound->pitch, left.source.end, -1, kPitchReach);
    const auto after = pitchNear(right.sound->pitch, right.source.start, +1, kPitchReach);
    if (!before || !after) continue;
    const double most = std::log(options.most_pitch_ratio);
    const double pitch_step = std::clamp(std::log(*after / *before), -most, most);
    ends[i].end.log_pitch = pitch_step / 2;
    ends[i + 1].start.log_pitch = -pitch_step / 2;
  }
  return ends;
}

/// Follows one piece's grains.
class GrainReader {
 public:
  GrainReader(const SoundPiece& piece, const PieceEnds& ends, const SoundJoinOptions& options)
      : piece_(&piece), ends_(&ends), options_(&options) {}

  /// The grain to set down at `time` of the line: the one after the last, unless time has run away from it.
  std::size_t grainAt(Seconds time) {
    const PitchMarks& marks = piece_->sound->marks;
    const double sample = sourceOf(time) * piece_->sound->clip.sample_rate_hz;
    if (last_ && *last_ + 1 < marks.marks.size()) {
      const std::size_t next = *last_ + 1;
      if (std::abs(asReal(marks.marks[next].sample) - sample) < 0.75 * gapAfter(next)) {
        return *(last_ = next);
      }
    }
    return *(last_ = marks.nearest(sample));
  }

  /// Samples from that grain's mark to the next, and to the one before.
  [[nodiscard]] double gapAfter(std::size_t mark) const {
    const auto& marks = piece_->sound->marks.marks;
    if (mark + 1 >= marks.size()) return mark > 0 ? gapAfter(mark - 1) : 1;
    return asReal(marks[mark + 1].sample - marks[mark].sample);
  }
  [[nodiscard]] double gapBefore(std::size_t mark) const { return gapAfter(mark > 0 ? mark - 1 : 0); }

  /// How far the line's next mark is, in samples.
  [[nodiscard]] double stepAfter(std::size_t mark, Seconds time) const {
    const auto& marks = piece_->sound->marks.marks;
    const bool voiced = marks[mark].voiced && mark + 1 < marks.size() && marks[mark + 1].voiced;
    return voiced ? gapAfter(mark) / std::exp(at(time, &Meeting::log_pitch, options_->pitch_reach)) : gapAfter(mark);
  }

  /// Adds the grain, its mark on `sample` of `line`, times `weight`.
  void add(std::size_t mark, std::ptrdiff_t sample, Seconds time, double weight, std::vector<double>& line) const {
    const AudioClip& clip = piece_->sound->clip;
    const std::ptrdiff_t middle = signedIndex(piece_->sound->marks.marks[mark].sample);
    const double gain = weight * std::pow(10, at(time, &Meeting::level_db, options_->level_reach) / 20);
    const std::ptrdiff_t before = std::lround(gapBefore(mark)), after = std::lround(gapAfter(mark));
    for (std::ptrdiff_t i = -before + 1; i < after; ++i) {
      const std::ptrdiff_t from = middle + i, to = sample + i;
      if (from < 0 || from >= std::ssize(clip.samples) || to < 0 || to >= std::ssize(line)) continue;
      const double width = asReal(i < 0 ? before : after);
      line[unsignedIndex(to)] += gain * taper(asReal(std::abs(i)), width) * clip.samples[unsignedIndex(from)];
    }
  }

 private:
  [[nodiscard]] Seconds sourceOf(Seconds time) const {
    const TimeSpan &from = piece_->source, &to = piece_->target;
    const double speed = to.duration() > 1e-9 ? from.duration() / to.duration() : 1.0;
    // Beyond the ends, in the fade, at the recording's own speed.
    if (time < to.start) return from.start + (time - to.start);
    if (time > to.end) return from.end + (time - to.end);
    return from.start + (time - to.start) * speed;
  }

  [[nodiscard]] double at(Seconds time, double Meeting::*what, Seconds reach) const {
    return ends_->start.*what * taper(time - piece_->target.start, reach) +
           ends_->end.*what * taper(piece_->target.end - time, reach);
  }

  const SoundPiece* piece_;
  const PieceEnds* ends_;
  const SoundJoinOptions* options_;
  std::optional<std::size_t> last_;
};

}  // namespace

MarkedSound markSound(AudioClip clip) {
  MarkedSound sound;
  sound.pitch = trackPitch(clip);
  sound.marks = findPitchMarks(clip, sound.pitch);
  sound.clip = std::move(clip);
  return sound;
}

AudioClip joinSounds(const std::vector<SoundPiece>& pieces, int sample_rate_hz, const SoundJoinOptions& options) {
  AudioClip joined{sample_rate_hz, {}};
  if (pieces.empty()) return joined;
  const double rate = sample_rate_hz;
  const Seconds start = pieces.front().target.start, end = pieces.back().target.end;
  std::vector<double> line(unsignedIndex(std::lround(std::max(0.0, end - start) * rate)), 0.0);
  const std::vector<PieceEnds> ends = meetHalfWay(pieces, options);
  std::vector<GrainReader> readers;
  for (std::size_t i = 0; i < pieces.size(); ++i) readers.emplace_back(pieces[i], ends[i], options);

  std::size_t current = 0;
  double place = 0;  // of the next mark, samples
  while (place < asReal(line.size())) {
    const Seconds time = start + place / rate;
    while (current + 1 < pieces.size() && time >= pieces[current].target.end) ++current;
    // Around a join the neighbour on that side is mixed in, half and half at the join itself.
    double neighbour_share = 0;
    std::size_t neighbour = current;
    const Seconds into = time - pieces[current].target.start, left = pieces[current].target.end - time;
    if (current > 0 && into < options.fade / 2 && into <= left) {
      neighbour = current - 1;
      neighbour_share = 0.5 - into / options.fade;
    } else if (current + 1 < pieces.size() && left < options.fade / 2) {
      neighbour = current + 1;
      neighbour_share = 0.5 - left / options.fade;
    }
    const std::ptrdiff_t sample = std::lround(place);
    const std::size_t mark = readers[current].grainAt(time);
    readers[current].add(mark, sample, time, 1 - neighbour_share, line);
    double step = readers[current].stepAfter(mark, time);
    if (neighbour != current) {
      const std::size_t other = readers[neighbour].grainAt(time);
      readers[neighbour].add(other, sample, time, neighbour_share, line);
      step = (1 - neighbour_share) * step + neighbour_share * readers[neighbour].stepAfter(other, time);
    }
    place += std::max(step, 1.0);
  }
  joined.samples.assign(line.begin(), line.end());
  for (float& sample : joined.samples) sample = std::clamp(sample, -1.0F, 1.0F);
  return joined;
}

}  // namespace mouthpiece
