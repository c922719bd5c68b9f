#include "hearing/tags/pitch_contour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/index.h"
#include "base/statistics.h"

namespace mouthpiece {
namespace {

/// E_fit of longer pieces is measured at this many places, so that a piece costs O(1) and a vowel O(N^2).
constexpr std::size_t kMostPlaces = 64;
/// Places between two looks at whether a piece can still be the best.
constexpr std::size_t kStride = 8;

/// Lines by least squares through any samples [a, b], from running sums.
class LineFits {
 public:
  explicit LineFits(std::span<const double> values) : values_(values), sum_(values.size() + 1), moment_(sum_.size()) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      sum_[i + 1] = sum_[i] + values[i];
      moment_[i + 1] = moment_[i] + values[i] * asReal(i);
    }
    for (std::size_t k = 0; k < kMostPlaces; ++k) {
      // Spread without a period (an even spacing could fall into step with a vibrato), and from the first few on all
      // over the piece, so that most bad ones are seen early.
      places_[k] = std::fmod((asReal(k) + 0.5) * 0.6180339887498949, 1.0);
    }
  }

  struct Line {
    double slope = 0;  ///< a sample
    double middle = 0;
    double middle_value = 0;
  };

  [[nodiscard]] Line line(std::size_t a, std::size_t b) const {
    const double n = asReal(b - a + 1);
    const double middle = 0.5 * asReal(a + b);
    const double sum = sum_[b + 1] - sum_[a];
    const double spread = n * (n * n - 1) / 12;
    const double moment = moment_[b + 1] - moment_[a] - middle * sum;
    return {spread > 0 ? moment / spread : 0, middle, sum / n};
  }

  /// Eq. (2); what is over `limit` may be less than the whole error.
  [[nodiscard]] double error(std::size_t a, std::size_t b, double limit) const {
    const Line fit = line(a, b);
    const double at_zero = fit.middle_value - fit.slope * fit.middle;
    const std::size_t n = b - a + 1;
    const auto off = [&](std::size_t i) { return std::abs(values_[i] - at_zero - fit.slope * asReal(i)); };
    const bool is_whole = n <= kMostPlaces;
    const std::size_t places = is_whole ? n : kMostPlaces;
    const double share = is_whole ? 1 : asReal(n) / kMostPlaces;
    double error = 0;
    for (std::size_t first = 0; first < places && share * error <= limit; first += kStride) {
      for (std::size_t k = first; k < std::min(places, first + kStride); ++k) {
        error += off(is_whole ? a + k : a + static_cast<std::size_t>(places_[k] * asReal(n)));
      }
    }
    return share * error;
  }

 private:
  std::span<const double> values_;
  std::vector<double> sum_, moment_;
  std::array<double, kMostPlaces> places_{};
};

}  // namespace

std::vector<PitchPiece> fitPitchPieces(std::span<const double> pitch_hz, const NoteFitOptions& options) {
  const std::size_t count = pitch_hz.size();
  if (count < 2) return {};
  const LineFits fits(pitch_hz);
  const auto [lowest, highest] = std::minmax_element(pitch_hz.begin(), pitch_hz.end());
  const double piece_cost = options.piece_cost_share * 0.5 * (*lowest + *highest);
  // M(0, b) of eq. (1): splitting [a, b] at every x and joining at best is the same as taking the last piece of [0, b]
  // off at every x, for costs only add.
  std::vector<double> cost(count, std::numeric_limits<double>::infinity());
  std::vector<std::size_t> from(count, 0);
  cost[0] = 0;
  for (std::size_t b = 1; b < count; ++b) {
    const auto tryLastPiece = [&](std::size_t a) {
      const double least = cost[a] + piece_cost;
      if (least >= cost[b]) return;  // no error can make it better
      const double total = least + fits.error(a, b, cost[b] - least);
      if (total < cost[b]) {
        cost[b] = total;
        from[b] = a;
      }
    };
    tryLastPiece(from[b - 1]);  // mostly the best: the others are given up sooner
    for (std::size_t a = b; a-- > 0;) tryLastPiece(a);
  }
  std::vector<PitchPiece> pieces;
  for (std::size_t b = count - 1; b > 0; b = from[b]) {
    const std::size_t a = from[b];
    const auto piece = pitch_hz.subspan(a, b - a + 1);
    pieces.push_back({.first = a,
                      .last = b,
                      .slope_hz_s = fits.line(a, b).slope * options.rate_hz,
                      .median_hz = median({piece.begin(), piece.end()})});
  }
  std::reverse(pieces.begin(), pieces.end());
  return pieces;
}

bool isNote(const PitchPiece& piece, const NoteFitOptions& options) {
  return std::abs(piece.slope_hz_s) < options.note_slope_hz_s;
}

}  // namespace mouthpiece
