#include "hearing/alignment/phone_loop.h"

#include <sphinxbase/err.h>
#include <sphinxbase/logmath.h>
#include <sphinxbase/ngram_model.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

/// A state keeps its sound for some frames: of the next frame's probability, half.
constexpr float kStays = 0.5F;
constexpr Eigen::Index kWeighedAtOnce = 64;

struct LanguageModelDeleter {
  void operator()(ngram_model_t* model) const { ngram_model_free(model); }
};
struct LogMathDeleter {
  void operator()(logmath_t* math) const { logmath_free(math); }
};

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
  addOrder(order);
}

void PhoneLoop::addStates() {
  const std::size_t n = model_->codebooks.size();
  states_.resize(3 * n * n);
  const auto add = [&](std::size_t left, std::size_t phone, std::size_t right, const std::vector<int>& senones) {
    if (senones.size() < 3) throw InputError("acoustic model", "", "has phones of fewer than 3 states; expected 3");
    states_[left * n + phone].senones.push_back(senones[0]);
    states_[n * n + left * n + phone].senones.push_back(senones[1]);
    states_[2 * n * n + phone * n + right].senones.push_back(senones[2]);
  };
  for (const TiedModel::Triphone& triphone : model_->triphones)
    add(triphone.left, triphone.base, triphone.right, triphone.senones);
  for (std::size_t phone = 0; phone < n; ++phone) {
    for (std::size_t other = 0; other < n; ++other) {
      if (states_[other * n + phone].senones.empty()) {
        states_[other * n + phone].senones = {model_->alone[phone][0]};
        states_[n * n + other * n + phone].senones = {model_->alone[phone][1]};
      }
      auto& last = states_[2 * n * n + phone * n + other].senones;
      if (last.empty()) last = {model_->alone[phone][2]};
    }
  }
  for (State& state : states_) keepEachOnce(state.senones);
}

void PhoneLoop::addOrder(const std::filesystem::path& file) {
  const auto n = unsignedIndex(size_);
  order_.assign(n, Eigen::MatrixXf::Constant(size_, size_, 1.0F / asFloat(asReal(n))));
  if (file.empty() || !std::filesystem::exists(file)) return;
  const std::unique_ptr<logmath_t, LogMathDeleter> math(logmath_init(1.0001, 0, 0));
  const std::unique_ptr<ngram_model_t, LanguageModelDeleter> model(
      ngram_model_read(nullptr, file.c_str(), NGRAM_AUTO, math.get()));
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
  for (std::size_t i = 0; i < states_.size(); ++i) {
    std::int16_t best = std::numeric_limits<std::int16_t>::max();
    for (const int senone : states_[i].senones) best = std::min(best, column[senone]);
    likelihoods[signedIndex(i)] = static_cast<float>(best);
  }
  const auto unit = asFloat(-kScoreUnit * settings_.acoustic_scale);
  likelihoods = (likelihoods * unit).exp().max(1e-20F);
}

Eigen::MatrixXf PhoneLoop::posteriors(SenoneScorer& scorer, const Eigen::MatrixXf& features) {
  const Eigen::Index n = size_, pairs = n * n, frames = features.cols();
  Eigen::MatrixXf phones = Eigen::MatrixXf::Zero(kPhoneCount, frames);
  if (frames == 0) return phones;
  using Square = Eigen::Map<Eigen::MatrixXf>;
  // likelihoods and forward probabilities: 3 * pairs x frames. (i, j) of a square is entry j * n + i of its column, so
  // a square of first or middle states is phone x left, one of last states right x phone.
  Eigen::MatrixXf likelihood(3 * pairs, frames), forward(3 * pairs, frames);
  const Weighing all{std::vector<bool>(model_->codebooks.size(), true)};
  for (Eigen::Index at = 0; at < frames; at += kWeighedAtOnce) {
    const Eigen::Index count = std::min(kWeighedAtOnce, frames - at);
    const SenoneScorer::Scores& scores = scorer.score(features.middleCols(at, count), all);
    for (Eigen::Index i = 0; i < count; ++i) {
      Eigen::ArrayXf column(3 * pairs);
      weigh(scores, i, column);
      likelihood.col(at + i) = column;
    }
  }
  const auto squares = [&](Eigen::MatrixXf& matrix, Eigen::Index frame) {
    float* data = matrix.col(frame).data();
    return std::array<Square, 3>{Square(data, n, n), Square(data + pairs, n, n), Square(data + 2 * pairs, n, n)};
  };
  forward.col(0) = likelihood.col(0);
  forward.col(0).tail(2 * pairs).setZero();
  forward.col(0) /= forward.col(0).sum();
  for (Eigen::Index t = 1; t < frames; ++t) {
    auto before = squares(forward, t - 1), now = squares(forward, t);
    now[0] = kStays * before[0] + (1 - kStays) * before[2];
    now[1] = kStays * before[1] + (1 - kStays) * before[0];
    now[2] = kStays * before[2];
    for (Eigen::Index phone = 0; phone < n; ++phone)
      now[2].col(phone).noalias() += (1 - kStays) * (order_[unsignedIndex(phone)] * before[1].row(phone).transpose());
    forward.col(t).array() *= likelihood.col(t).array();
    forward.col(t) /= std::max(forward.col(t).sum(), 1e-30F);
  }
  Eigen::MatrixXf backward = Eigen::MatrixXf::Ones(3 * pairs, 2);
  std::vector<Eigen::Index> rows;
  for (const TiedModel::Codebook& codebook : model_->codebooks)
    rows.push_back(static_cast<Eigen::Index>(phoneFromName(codebook.phone).value_or(Phone::kSil)));
  for (Eigen::Index t = frames; t-- > 0;) {
    auto now = squares(backward, t % 2);
    if (t + 1 < frames) {
      auto after = squares(backward, (t + 1) % 2);
      backward.col((t + 1) % 2).array() *= likelihood.col(t + 1).array();
      now[0] = kStays * after[0] + (1 - kStays) * after[1];
      now[1] = kStays * after[1];
      for (Eigen::Index phone = 0; phone < n; ++phone)
        now[1].row(phone) += (1 - kStays) * (after[2].col(phone).transpose() * order_[unsignedIndex(phone)]);
      now[2] = kStays * after[2] + (1 - kStays) * after[0];
      backward.col(t % 2) /= std::max(backward.col(t % 2).maxCoeff(), 1e-30F);
    }
    Eigen::VectorXf both = forward.col(t).cwiseProduct(backward.col(t % 2));
    both /= std::max(both.sum(), 1e-30F);
    const Square first(both.data(), n, n), middle(both.data() + pairs, n, n), last(both.data() + 2 * pairs, n, n);
    for (Eigen::Index phone = 0; phone < n; ++phone)
      phones(rows[unsignedIndex(phone)], t) += first.row(phone).sum() + middle.row(phone).sum() + last.col(phone).sum();
  }
  return phones;
}

}  // namespace mouthpiece
