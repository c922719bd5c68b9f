#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <memory>
#include <vector>

#include "hearing/alignment/acoustic_model.h"
#include "phonetics/language/language.h"

namespace mouthpiece {

/// How likely each phone is at each time where any phone may follow any other: phones of the acoustic model side by
/// side (its triphones), weighed against each other by how often three of them follow in a language
/// (docs/theory/hearing/phone_ear.md). Not thread-safe.
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
  /// `known`: of PhoneDiscriminant::logRatios(), counts beside the scorer; empty: nothing is known.
  Eigen::MatrixXf posteriors(SenoneScorer& scorer, const Eigen::MatrixXf& features, const Eigen::MatrixXf& known = {});

  /// The last frames of a sound that goes on: rings, by a frame's number modulo their columns.
  struct Passage {
    explicit Passage(Eigen::Index frames_kept) : kept(frames_kept) {}
    Eigen::Index kept;                        ///< frames that may be looked back over
    Eigen::Index frames = 0;                  ///< heard so far
    Eigen::MatrixXf likelihood{}, forward{};  ///< states x kept
  };
  /// Hears `features` after all that `passage` has heard; `known` as for posteriors().
  void hearOn(SenoneScorer& scorer, const Eigen::Ref<const Eigen::MatrixXf>& features, Passage& passage,
              const Eigen::MatrixXf& known = {}) const;
  /// Of the last `count` frames, at most passage.kept, from all that was heard up to now.
  [[nodiscard]] Eigen::MatrixXf posteriorsOfLast(Eigen::Index count, const Passage& passage) const;

 private:
  void addStates();
  /// How much each score that there can be counts.
  void addLikelihoods();
  void addOrder(const std::filesystem::path& file);
  /// Forward probabilities of a frame from those of the one before; backward ones of a frame from those of the one
  /// after, these already times its likelihoods. Not scaled.
  void passOn(const float* before, float* now) const;
  void passBack(const float* after, float* now) const;
  void addPhones(const Eigen::Ref<const Eigen::VectorXf>& states, Eigen::Ref<Eigen::VectorXf> phones) const;
  /// The likelihood of each state in a frame against the best.
  void weigh(const SenoneScorer::Scores& scores, Eigen::Index frame, Eigen::Ref<Eigen::ArrayXf> likelihoods) const;
  /// Multiplies the likelihoods by what is known of the parts of the phones.
  void weighBy(const Eigen::Ref<const Eigen::ArrayXf>& known, Eigen::Ref<Eigen::ArrayXf> likelihoods) const;

  std::shared_ptr<const TiedModel> model_;
  Settings settings_;
  Eigen::Index size_ = 0;  ///< codebooks
  /// First, middle (left * size + phone) and last (phone * size + right) states, one after another: the senones of all
  /// triphones of each, each once, and where they end.
  std::vector<int> senones_;
  std::vector<std::size_t> ends_;
  Eigen::ArrayXf likelihoods_;          ///< by a score as std::uint16_t
  std::vector<Eigen::MatrixXf> order_;  ///< by phone: right x left, probabilities
  std::vector<Eigen::Index> rows_;      ///< by codebook: its phone's number
};

/// The loop of a language, by the order of its phones where that is installed.
PhoneLoop loopOf(std::shared_ptr<const TiedModel> model, const Language& language);

/// Which of a model's codebooks are phones or silence, not noises.
std::vector<bool> phonesIn(const TiedModel& model);

}  // namespace mouthpiece
