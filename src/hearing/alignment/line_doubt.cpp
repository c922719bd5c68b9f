// Lines in languages whose sounds the acoustic model never learnt (docs/theory/hearing/alignment.md#other-languages).
#include <algorithm>
#include <cmath>

#include "base/index.h"
#include "hearing/alignment/line_doubt_weights.h"
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
  /// `ratio`: of what is heard in it, how much more often that is heard in this phone than at any time.
  void add(const DecodedPhone& phone, float ratio) {
    const double length = std::log(std::max(1, phone.frames));
    match_ += double{std::log(std::max(kLeastMatch, ratio))};
    score_ += phone.score;
    frames_ += phone.frames;
    lengths_ += length;
    squares_ += length * length;
    brief_ += phone.frames <= kBrief ? 1 : 0;
    ++phones_;
  }
  /// Silence in the alignment that sounds like speech for so long.
  void addUntold(Seconds time) { untold_ += time; }
  [[nodiscard]] double odds(double noise) const {
    const double usual = lengths_ / phones_;
    const OtherLineFacts facts{.match = match_ / phones_,
                               .few = 1 / std::sqrt(phones_),
                               .score = score_ / std::max(frames_, 1.0),
                               .uneven = std::sqrt(std::max(0.0, squares_ / phones_ - usual * usual)),
                               .untold = std::min(untold_, kLongestUntold),
                               .brief = brief_ / phones_,
                               .noise = noise};
    return std::min(oddsAgainstAnother(facts), oddsAgainstMore(facts));
  }

 private:
  double match_ = 0, score_ = 0, frames_ = 0, lengths_ = 0, squares_ = 0, brief_ = 0, phones_ = 0;
  Seconds untold_ = 0;
};

}  // namespace

Believed TextDoubt::judgeLines(std::span<const DecodedPhone> decoded, std::span<const std::int16_t> samples) {
  const Eigen::MatrixXf posteriors = posteriorsOf(samples);
  Believed believed;
  if (posteriors.cols() == 0) return believed;
  const double noise = noiseOf(samples);
  const Eigen::Map<const Eigen::Matrix<float, kPhoneCount, kPhoneCount, Eigen::RowMajor>> ratios(
      kHeardElsewhere.data());
  const auto words = unsignedIndex(
      std::count_if(decoded.begin(), decoded.end(), [](const DecodedPhone& phone) { return phone.opens_word; }));
  const std::vector<std::size_t> ends = lineEnds(words);
  LineEvidence line;
  std::size_t word = 0, next_line = 0;
  const auto judge = [&] {
    const double odds = line.odds(noise);
    believed.lines.resize(word, 1 / (1 + std::exp(-odds)));
    line = {};
  };
  for (const DecodedPhone& phone : decoded) {
    const bool is_silence = phone.phone == Phone::kSil;
    if (!is_silence && phone.opens_word && word == ends[next_line]) {
      judge();
      ++next_line;
    }
    word += !is_silence && phone.opens_word ? 1U : 0U;
    const Eigen::Index first = std::min(signedIndex(phone.first_frame), posteriors.cols() - 1);
    const Eigen::Index count = std::clamp<Eigen::Index>(phone.frames, 1, posteriors.cols() - first);
    const Eigen::VectorXf heard = posteriors.middleCols(first, count).rowwise().mean();
    if (is_silence) {
      line.addUntold(kHeardStep * phone.frames * (1 - double{heard[0]}));
    } else {
      line.add(phone, ratios.row(static_cast<Eigen::Index>(phone.phone)).dot(heard));
    }
  }
  if (word > 0) judge();
  believed.words = believed.lines;
  return believed;
}

}  // namespace mouthpiece
