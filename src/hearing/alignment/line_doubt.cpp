// Lines in languages whose sounds the acoustic model never learnt (docs/theory/hearing/doubt.md#other-languages).
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "base/index.h"
#include "base/statistics.h"
#include "hearing/alignment/line_doubt_weights.h"
#include "hearing/alignment/phone_edits.h"
#include "hearing/alignment/text_doubt.h"

namespace mouthpiece {
namespace {

/// A phone that is never heard where another one is said tells no more than this.
constexpr float kLeastMatch = 0.01F;
constexpr int kBrief = 3;  // frames
constexpr Seconds kHeardStep = 0.010, kLongestUntold = 1.0;

/// What tells of a line, summed up phone by phone.
class LineEvidence {
 public:
  /// Of what is heard, which has to outlive this: posteriors of all phones, a column a frame. `by_network`: not by an
  /// acoustic model's ear.
  LineEvidence(const Eigen::MatrixXf& heard, bool by_network) : heard_(heard), by_network_(by_network) {}

  void add(const DecodedPhone& phone) {
    const Eigen::Index first = std::min(signedIndex(phone.first_frame), heard_.cols() - 1);
    const Eigen::Index count = std::clamp<Eigen::Index>(phone.frames, 1, heard_.cols() - first);
    const Eigen::VectorXf heard = heard_.middleCols(first, count).rowwise().mean();
    if (end_ == 0) begin_ = first;
    end_ = first + count;
    if (phone.phone == Phone::kSil) {
      untold_ += kHeardStep * phone.frames * (1 - double{heard[0]});
      return;
    }
    const double length = std::log(std::max(1, phone.frames));
    matches_.push_back(std::log(std::max(kLeastMatch, ratioOf(phone.phone, heard))));
    phones_.push_back(phone.phone);
    score_ += phone.score;
    frames_ += phone.frames;
    lengths_ += length;
    squares_ += length * length;
    brief_ += phone.frames <= kBrief ? 1 : 0;
  }
  [[nodiscard]] double odds(double noise) const { return by_network_ ? oddsByNetwork(noise) : oddsByEar(noise); }

 private:
  [[nodiscard]] double oddsByEar(double noise) const {
    const OtherLineFacts facts{.match = match(),
                               .few = few(),
                               .score = score(),
                               .uneven = uneven(),
                               .untold = std::min(untold_, kLongestUntold),
                               .brief = brief_ / count(),
                               .noise = noise};
    return std::min(oddsAgainstAnother(facts), oddsAgainstMore(facts));
  }
  [[nodiscard]] double oddsByNetwork(double noise) const {
    constexpr std::size_t kShort = 5, kLong = 6;  // phones
    const std::vector<Phone> heard = phonesHeard();
    const PhoneEdits edits = cheapestEdits(phones_, heard);
    const auto greatestMean = [&](std::vector<double> prices) {
      for (double& price : prices) price = -price;
      return -leastMean(prices, kShort);
    };
    const HeardLineFacts facts{.match = match(),
                               .least = leastMean(matches_, kLong),
                               .few = few(),
                               .score = score(),
                               .uneven = uneven(),
                               .untold = std::min(untold_, kLongestUntold),
                               .edits = edits.price / asReal(std::max(phones_.size(), heard.size())),
                               .unheard = greatestMean(edits.of_first),
                               .unsaid = heard.empty() ? PhoneEdits::kOther : greatestMean(edits.of_second),
                               .longer = std::log(asReal(phones_.size() + 1) / asReal(heard.size() + 1)),
                               .noise = noise};
    return std::min({oddsAgainstAnother(facts), oddsAgainstMore(facts), oddsAgainstChanged(facts)});
  }

  /// How much more often what is heard then is heard in the phone than at any time.
  [[nodiscard]] float ratioOf(Phone phone, const Eigen::VectorXf& heard) const {
    const auto row = static_cast<Eigen::Index>(phone);
    if (by_network_) return heard[row] / kHeardShares[unsignedIndex(row)];
    using Ratios = Eigen::Matrix<float, kPhoneCount, kPhoneCount, Eigen::RowMajor>;
    return Eigen::Map<const Ratios>(kHeardElsewhere.data()).row(row).dot(heard);
  }
  [[nodiscard]] double count() const { return asReal(phones_.size()); }
  [[nodiscard]] double match() const {
    double sum = 0;
    for (const double value : matches_) sum += value;
    return sum / count();
  }
  [[nodiscard]] double few() const { return 1 / std::sqrt(count()); }
  [[nodiscard]] double score() const { return score_ / std::max(frames_, 1.0); }
  [[nodiscard]] double uneven() const {
    const double usual = lengths_ / count();
    return std::sqrt(std::max(0.0, squares_ / count() - usual * usual));
  }
  /// The likeliest row of phones in the line's time, whatever is said, where another phone has a price (Viterbi).
  [[nodiscard]] std::vector<Phone> phonesHeard() const {
    constexpr float kAnother = 3.0F, kLeastLikely = 1e-4F;
    constexpr int kShortestHeard = 2;  // frames
    const Eigen::Index frames = end_ - begin_;
    const Eigen::ArrayXXf likely = (heard_.middleCols(begin_, frames).array() + kLeastLikely).log();
    Eigen::ArrayXXi before(likely.rows(), frames);
    Eigen::ArrayXf path = likely.col(0);
    Eigen::Index best = 0;
    for (Eigen::Index t = 1; t < frames; ++t) {
      const float change = path.maxCoeff(&best) - kAnother;
      for (Eigen::Index phone = 0; phone < path.size(); ++phone) {
        before(phone, t) = static_cast<int>(path[phone] >= change ? phone : best);
        path[phone] = std::max(path[phone], change) + likely(phone, t);
      }
    }
    path.maxCoeff(&best);
    std::vector<Phone> phones;  // the last first
    int lasts = 0;
    for (Eigen::Index t = frames; t-- > 0;) {
      ++lasts;
      const Eigen::Index next = t > 0 ? before(best, t) : -1;
      if (next == best) continue;
      if (best != static_cast<Eigen::Index>(Phone::kSil) && lasts >= kShortestHeard)
        phones.push_back(static_cast<Phone>(best));
      best = next;
      lasts = 0;
    }
    std::reverse(phones.begin(), phones.end());
    return phones;
  }

  const Eigen::MatrixXf& heard_;
  bool by_network_;
  std::vector<double> matches_;
  std::vector<Phone> phones_;
  double score_ = 0, frames_ = 0, lengths_ = 0, squares_ = 0, brief_ = 0;
  Seconds untold_ = 0;
  Eigen::Index begin_ = 0, end_ = 0;  ///< frames
};

}  // namespace

Believed TextDoubt::judgeLines(std::span<const DecodedPhone> decoded, std::span<const std::int16_t> samples,
                               const HeardPhones& heard) {
  const bool by_network = heard.cols() > 0;
  const Eigen::MatrixXf by_ear = by_network ? Eigen::MatrixXf() : posteriorsOf(samples);
  const Eigen::MatrixXf& posteriors = by_network ? heard : by_ear;
  Believed believed;
  if (posteriors.cols() == 0) return believed;
  const double noise = noiseOf(samples);
  const auto words = unsignedIndex(
      std::count_if(decoded.begin(), decoded.end(), [](const DecodedPhone& phone) { return phone.opens_word; }));
  const std::vector<std::size_t> ends = lineEnds(words);
  std::optional<LineEvidence> line;
  std::size_t word = 0, next_line = 0;
  const auto judge = [&] {
    believed.lines.resize(word, 1 / (1 + std::exp(-line->odds(noise))));
    line.reset();
  };
  for (const DecodedPhone& phone : decoded) {
    const bool opens_word = phone.phone != Phone::kSil && phone.opens_word;
    if (opens_word && word == ends[next_line]) {
      judge();
      ++next_line;
    }
    word += opens_word ? 1U : 0U;
    if (!line) line.emplace(posteriors, by_network);
    line->add(phone);
  }
  if (word > 0) judge();
  believed.words = believed.lines;
  return believed;
}

}  // namespace mouthpiece
