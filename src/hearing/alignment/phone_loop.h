#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <memory>
#include <vector>

#include "hearing/alignment/acoustic_model.h"
#include "phonetics/language/phone.h"

namespace mouthpiece {

/// How likely each phone is at each time where any phone may follow any other: phones of the acoustic model side by
/// side (its triphones), weighed against each other by how often three of them follow in a language
/// (docs/theory/hearing/recognition.md). Not thread-safe.
class PhoneLoop {
 public:
  struct Settings {
    double acoustic_scale = 0.20;  ///< this power of the likelihood of a frame counts: frames are alike
    double order_weight = 1.0;     ///< this power of the probability of a phone after two others
    double insertion = -2.0;       ///< natural logarithm: a phone more
  };

  /// `order`: PocketSphinx' language model of phones; empty, or not there: all orders are alike.
  PhoneLoop(std::shared_ptr<const TiedModel> model, const std::filesystem::path& order);
  PhoneLoop(std::shared_ptr<const TiedModel> model, const std::filesystem::path& order, const Settings& settings);

  /// Rows: phones by their number (kSil: silence, breath and noise); a column a frame of `features`; columns add up to
  /// 1, or less by what the model has besides speech. Memory: 20 KB a frame.
  Eigen::MatrixXf posteriors(SenoneScorer& scorer, const Eigen::MatrixXf& features);

 private:
  struct State {
    std::vector<int> senones;  ///< of all its triphones, each once
  };
  void addStates();
  void addOrder(const std::filesystem::path& file);
  /// The likelihood of each state in a frame against the best.
  void weigh(const SenoneScorer::Scores& scores, Eigen::Index frame, Eigen::Ref<Eigen::ArrayXf> likelihoods) const;

  std::shared_ptr<const TiedModel> model_;
  Settings settings_;
  Eigen::Index size_ = 0;  ///< codebooks
  /// First, middle (left * size + phone) and last (phone * size + right) states, one after another.
  std::vector<State> states_;
  std::vector<Eigen::MatrixXf> order_;  ///< by phone: right x left, probabilities
};

}  // namespace mouthpiece
