#include "hearing/alignment/phone_loop.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/sphinx_functions.h"

namespace mouthpiece {
namespace {

/// A state keeps its sound for some frames: of the next frame's probability, half.
constexpr float kStays = 0.5F;
constexpr Eigen::Index kWeighedAtOnce = 64;

bool isNoise(const TiedModel::Codebook& codebook) { return codebook.phone.starts_with('+'); }

void keepEachOnce(std::vector<int>& senones) {
  std::sort(senones.begin(), senones.end());
  senones.erase(std::unique(senones.begin(), senones.end()), senones.end());
}

}  // namespace

PhoneLoop::PhoneLoop(std::shared_ptr<const TiedModel> model, const std::filesystem::path& order)
    : PhoneLoop(std::move(model), order, Settings{}) {}

PhoneLoop::PhoneLoop(std::shared_ptr<const TiedModel> model, const std::filesystem::path& order,
                     const Settings& settings)
    : model_(std::move(model)), settings_(settings), size_(signedIndex(model_->codebooks.size())) {
  addStates();
  addLikelihoods();
  addOrder(order);
  for (const TiedModel::Codebook& codebook : model_->codebooks)
    rows_.push_back(static_cast<Eigen::Index>(phoneFromName(codebook.phone).value_or(Phone::kSil)));
}

void PhoneLoop::addStates() {
  const std::size_t n = model_->codebooks.size();
  std::vector<std::vector<int>> states(3 * n * n);
  const auto add = [&](std::size_t left, std::size_t phone, std::size_t right, std::span<const int> senones) {
    if (senones.size() < 3) throw InputError("acoustic model", "", "has phones of fewer than 3 states; expected 3");
    states[left * n + phone].push_back(senones[0]);
    states[n * n + left * n + phone].push_back(senones[1]);
    states[2 * n * n + phone * n + right].push_back(senones[2]);
  };
  for (const TiedModel::Triphone& triphone : model_->triphones)
    add(triphone.left, triphone.base, triphone.right, model_->senonesOf(triphone));
  for (std::size_t phone = 0; phone < n; ++phone) {
    for (std::size_t other = 0; other < n; ++other) {
      if (states[other * n + phone].empty()) {
        states[other * n + phone] = {model_->alone[phone][0]};
        states[n * n + other * n + phone] = {model_->alone[phone][1]};
      }
      auto& last = states[2 * n * n + phone * n + other];
      if (last.empty()) last = {model_->alone[phone][2]};
    }
  }
  for (std::vector<int>& state : states) {
    keepEachOnce(state);
    senones_.insert(senones_.end(), state.begin(), state.end());
    ends_.push_back(senones_.size());
  }
}

void PhoneLoop::addLikelihoods() {
  constexpr int kScores = 1 << 16;
  const auto unit = asFloat(-kScoreUnit * settings_.acoustic_scale);
  likelihoods_ = Eigen::ArrayXf::NullaryExpr(
      kScores, [](Eigen::Index i) { return static_cast<float>(static_cast<std::int16_t>(i)); });
  likelihoods_ = (likelihoods_ * unit).exp().max(1e-20F);
}

void PhoneLoop::addOrder(const std::filesystem::path& file) {
  const auto n = unsignedIndex(size_);
  order_.assign(n, Eigen::MatrixXf::Constant(size_, size_, 1.0F / asFloat(asReal(n))));
  if (file.empty() || !std::filesystem::exists(file)) return;
  const SphinxPointer<logmath_t> math(logmath_init(1.0001, 0, 0));
  const SphinxPointer<ngram_model_t> model(ngram_model_read(nullptr, file.c_str(), NGRAM_AUTO, math.get()));
  if (!model) throw InputError(file.string(), "", "is no language model that PocketSphinx can read");
  std::vector<std::string> names;
  for (const TiedModel::Codebook& codebook : model_->codebooks)
    names.push_back(isNoise(codebook) ? "SIL" : codebook.phone);
  for (std::size_t phone = 0; phone < n; ++phone) {
    for (std::size_t left = 0; left < n; ++left) {
      for (std::size_t right = 0; right < n; ++right) {
        int used = 0;
        const int score = ngram_tg_score(model.get(), ngram_wid(model.get(), names[right].c_str()),
                                         ngram_wid(model.get(), names[phone].c_str()),
                                         ngram_wid(model.get(), names[left].c_str()), &used);
        const double log = settings_.order_weight * logmath_log_to_ln(math.get(), score) + settings_.insertion;
        order_[phone](signedIndex(right), signedIndex(left)) = asFloat(std::exp(std::max(log, -60.0)));
      }
    }
  }
}

void PhoneLoop::weigh(const SenoneScorer::Scores& scores, Eigen::Index frame,
                      Eigen::Ref<Eigen::ArrayXf> likelihoods) const {
  const std::int16_t* column = scores.col(frame).data();
  std::size_t at = 0;
  for (std::size_t i = 0; i < ends_.size(); ++i) {
    std::int16_t best = column[senones_[at]];
    for (++at; at < ends_[i]; ++at) best = std::min(best, column[senones_[at]]);
    likelihoods[signedIndex(i)] = likelihoods_[static_cast<std::uint16_t>(best)];
  }
}

// (i, j) of a square is entry j * n + i of its column, so a square of first or middle states is phone x left, one of
// last states right x phone.
void PhoneLoop::passOn(const float* before, float* now) const {
  using Square = Eigen::Map<Eigen::MatrixXf>;
  using Known = Eigen::Map<const Eigen::MatrixXf>;
  const Eigen::Index n = size_, pairs = n * n;
  const Known first(before, n, n), middle(before + pairs, n, n), last(before + 2 * pairs, n, n);
  Square(now, n, n) = kStays * first + (1 - kStays) * last;
  Square(now + pairs, n, n) = kStays * middle + (1 - kStays) * first;
  Square ends(now + 2 * pairs, n, n);
  ends = kStays * last;
  for (Eigen::Index phone = 0; phone < n; ++phone)
    ends.col(phone).noalias() += (1 - kStays) * (order_[unsignedIndex(phone)] * middle.row(phone).transpose());
}

void PhoneLoop::passBack(const float* after, float* now) const {
  using Square = Eigen::Map<Eigen::MatrixXf>;
  using Known = Eigen::Map<const Eigen::MatrixXf>;
  const Eigen::Index n = size_, pairs = n * n;
  const Known first(after, n, n), middle(after + pairs, n, n), last(after + 2 * pairs, n, n);
  Square(now, n, n) = kStays * first + (1 - kStays) * middle;
  Square begins(now + pairs, n, n);
  begins = kStays * middle;
  for (Eigen::Index phone = 0; phone < n; ++phone)
    begins.row(phone) += (1 - kStays) * (last.col(phone).transpose() * order_[unsignedIndex(phone)]);
  Square(now + 2 * pairs, n, n) = kStays * last + (1 - kStays) * first;
}

void PhoneLoop::addPhones(const Eigen::Ref<const Eigen::VectorXf>& states, Eigen::Ref<Eigen::VectorXf> phones) const {
  using Known = Eigen::Map<const Eigen::MatrixXf>;
  const Eigen::Index n = size_, pairs = n * n;
  const Known first(states.data(), n, n), middle(states.data() + pairs, n, n), last(states.data() + 2 * pairs, n, n);
  const Eigen::VectorXf sums = (first + middle).rowwise().sum() + last.colwise().sum().transpose();
  for (Eigen::Index phone = 0; phone < n; ++phone) phones(rows_[unsignedIndex(phone)]) += sums(phone);
}

void PhoneLoop::weighBy(const Eigen::Ref<const Eigen::ArrayXf>& known, Eigen::Ref<Eigen::ArrayXf> likelihoods) const {
  const Eigen::Index n = size_, pairs = n * n;
  const Eigen::ArrayXf ratios = known.exp();
  // Entries of first and middle states: left * n + phone; of last ones: phone * n + right.
  for (Eigen::Index other = 0; other < n; ++other) {
    likelihoods.segment(other * n, n) *= ratios.segment(0, n);
    likelihoods.segment(pairs + other * n, n) *= ratios.segment(n, n);
    likelihoods.segment(2 * pairs + other * n, n) *= ratios(2 * n + other);
  }
  likelihoods = likelihoods.max(1e-20F);
}

void PhoneLoop::hearOn(SenoneScorer& scorer, const Eigen::Ref<const Eigen::MatrixXf>& features, Passage& passage,
                       const Eigen::MatrixXf& known) const {
  const Eigen::Index pairs = size_ * size_;
  if (passage.likelihood.size() == 0) {
    passage.likelihood.resize(3 * pairs, passage.kept);
    passage.forward.resize(3 * pairs, passage.kept);
  }
  const Weighing all{std::vector<bool>(model_->codebooks.size(), true)};
  Eigen::ArrayXf column(3 * pairs);
  for (Eigen::Index at = 0; at < features.cols(); at += kWeighedAtOnce) {
    const Eigen::Index count = std::min(kWeighedAtOnce, features.cols() - at);
    const SenoneScorer::Scores& scores = scorer.score(features.middleCols(at, count), all);
    for (Eigen::Index i = 0; i < count; ++i, ++passage.frames) {
      weigh(scores, i, column);
      if (known.size() > 0) weighBy(known.col(at + i).array(), column);
      const Eigen::Index own = passage.frames % passage.kept;
      passage.likelihood.col(own) = column;
      auto now = passage.forward.col(own);
      if (passage.frames == 0) {
        now = column;
        now.tail(2 * pairs).setZero();
      } else {
        passOn(passage.forward.col((passage.frames - 1) % passage.kept).data(), now.data());
        now.array() *= column;
      }
      now /= std::max(now.sum(), 1e-30F);
    }
  }
}

Eigen::MatrixXf PhoneLoop::posteriorsOfLast(Eigen::Index count, const Passage& passage) const {
  MOUTHPIECE_EXPECT(count <= std::min(passage.kept, passage.frames));
  const Eigen::Index states = 3 * size_ * size_;
  Eigen::MatrixXf phones = Eigen::MatrixXf::Zero(kPhoneCount, count);
  Eigen::VectorXf after = Eigen::VectorXf::Ones(states), now = after, both(states);
  for (Eigen::Index back = 0; back < count; ++back) {
    const Eigen::Index frame = passage.frames - 1 - back;
    if (back > 0) {
      after.array() *= passage.likelihood.col((frame + 1) % passage.kept).array();
      passBack(after.data(), now.data());
      now /= std::max(now.maxCoeff(), 1e-30F);
    }
    both = passage.forward.col(frame % passage.kept).cwiseProduct(now);
    auto column = phones.col(count - 1 - back);
    addPhones(both, column);
    column /= std::max(column.sum(), 1e-30F);
    after.swap(now);
  }
  return phones;
}

Eigen::MatrixXf PhoneLoop::posteriors(SenoneScorer& scorer, const Eigen::MatrixXf& features,
                                      const Eigen::MatrixXf& known) {
  if (features.cols() == 0) return Eigen::MatrixXf::Zero(kPhoneCount, 0);
  Passage passage(features.cols());
  hearOn(scorer, features, passage, known);
  return posteriorsOfLast(features.cols(), passage);
}

PhoneLoop loopOf(std::shared_ptr<const TiedModel> model, const Language& language) {
  return {std::move(model),
          std::filesystem::path(MOUTHPIECE_SPHINX_MODELS) / (std::string(language.acoustic_model) + "-phone.lm.bin")};
}

std::vector<bool> phonesIn(const TiedModel& model) {
  std::vector<bool> phones;
  for (const TiedModel::Codebook& codebook : model.codebooks) phones.push_back(!isNoise(codebook));
  return phones;
}

}  // namespace mouthpiece
