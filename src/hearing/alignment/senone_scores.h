#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "hearing/alignment/tied_model.h"

namespace mouthpiece {

/// PocketSphinx counts logarithms of likelihoods in this many nats: 1024 log(1.0001).
inline constexpr double kScoreUnit = 0.10239488;

/// What of a model is weighed, and how.
struct Weighing {
  std::vector<bool> wanted;  ///< codebooks
  bool against_all = true;   ///< 0 is the best of all the model's senones, not of the wanted ones
  double scale = 1;          ///< this times the logarithm of a likelihood counts
};

/// How little each state of a model ("senone") sounds like each of some frames. The same scores as PocketSphinx' own
/// for tied models, in a fraction of its time (docs/theory/alignment.md). Not thread-safe: it keeps room to work in.
class SenoneScorer {
 public:
  /// So many densities of each codebook and stream count, the likeliest.
  static constexpr std::size_t kKept = 4;
  /// senones x frames, in units of kScoreUnit / scale; 0 is the best of a frame.
  using Scores = Eigen::Matrix<std::int16_t, Eigen::Dynamic, Eigen::Dynamic>;

  explicit SenoneScorer(std::shared_ptr<const TiedModel> model);

  [[nodiscard]] const TiedModel& model() const { return *model_; }

  /// features: a column a frame. Senones of codebooks that are not wanted get the worst score. Valid until the next
  /// call.
  const Scores& score(const Eigen::Ref<const Eigen::MatrixXf>& features, const Weighing& weighing);

 private:
  /// Of one codebook in one stream of a frame, the best first.
  struct Likeliest {
    std::array<float, kKept> log_density{};
    std::array<Eigen::Index, kKept> density{};
  };

  Likeliest& likeliest(std::size_t codebook, std::size_t stream, Eigen::Index frame);
  void findLikeliest(std::size_t stream, const Eigen::Ref<const Eigen::MatrixXf>& features);
  void toLikelihoods(std::size_t stream, Eigen::Index frame);
  void scoreFrame(Eigen::Index frame, const Weighing& weighing);

  std::shared_ptr<const TiedModel> model_;
  std::vector<std::size_t> looked_at_;  ///< codebooks
  std::vector<Likeliest> likeliest_;
  Eigen::MatrixXf log_densities_;
  std::vector<Eigen::ArrayXf> likelihoods_;  ///< by codebook, of its senones in one frame
  Scores scores_;
};

}  // namespace mouthpiece
