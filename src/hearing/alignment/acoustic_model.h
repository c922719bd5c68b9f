#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hearing/alignment/senone_kernels.h"
#include "phonetics/language/phone.h"

namespace mouthpiece {

/// PocketSphinx' phonetically tied acoustic model as its files hold it (means, variances, sendump, mdef): the states of
/// all triphones of a phone ("senones") share the phone's Gaussians and differ by their weights
/// (docs/theory/hearing/alignment.md).
struct TiedModel {
  struct Codebook {
    std::string phone;                       ///< "AA", "SIL"
    std::vector<int> senones;                ///< whose states this phone's sounds are, rising
    std::vector<Eigen::MatrixXf> gaussians;  ///< by stream: log density = gaussians * (x^2, x, 1); densities x (2n + 1)
    std::vector<Eigen::MatrixXf> weights;    ///< by stream: senones x densities, linear
  };
  /// As the model's files count them.
  enum class WordPlace : std::uint8_t { kInside, kBegins, kEnds, kAlone };
  /// A phone between two others, by the places of their codebooks.
  struct Triphone {
    std::uint16_t base = 0, left = 0, right = 0;
    WordPlace place = WordPlace::kInside;
    std::uint32_t sequence = 0;  ///< states are sequences[sequence] and what follows
  };
  std::vector<Codebook> codebooks;
  std::vector<std::vector<int>> alone;  ///< by codebook: the senones of its phone's states whatever is beside it
  std::vector<Triphone> triphones;      ///< by base, left and right
  std::vector<int> sequences;           ///< senones of phones' states, `states` each
  std::size_t states = 0;
  std::size_t senone_count = 0;
  std::vector<Eigen::Index> stream_sizes;  ///< how the features are cut

  [[nodiscard]] Eigen::Index featureCount() const;
  /// Of its states, the first one first.
  [[nodiscard]] std::span<const int> senonesOf(const Triphone& triphone) const {
    return std::span(sequences).subspan(triphone.sequence, states);
  }
  /// Of a phone between two others; as it is elsewhere in a word, or alone, where the model has it not there.
  [[nodiscard]] std::span<const int> senonesOf(std::size_t base, std::size_t left, std::size_t right,
                                               WordPlace place) const;
};

/// A row of TiedModel::Codebook::gaussians, of a diagonal Gaussian.
Eigen::RowVectorXf densityRow(const Eigen::VectorXd& mean, const Eigen::VectorXd& variance);

/// Diagonal Gaussians, a density a column.
struct Densities {
  Eigen::MatrixXd means, variances;
};
/// Those of one stream of TiedModel::Codebook::gaussians.
Densities densitiesOf(const Eigen::MatrixXf& rows);

/// The bytes of a model's files.
struct TiedModelFiles {
  std::filesystem::path folder;  ///< for errors
  std::string mdef, means, variances, sendump;
};

/// Throws InputError when a file is damaged, or of another kind of model.
TiedModel parseTiedModel(const TiedModelFiles& files);
/// The files of a folder. Throws InputError also when one is missing.
TiedModel readTiedModel(const std::filesystem::path& folder);

/// PocketSphinx counts logarithms of likelihoods in this many nats: 1024 log(1.0001).
inline constexpr double kScoreUnit = 0.10239488;

/// What of a model is weighed, and how.
struct Weighing {
  std::vector<bool> wanted;  ///< codebooks
  bool against_all = true;   ///< 0 is the best of all the model's senones, not of the wanted ones
  double scale = 1;          ///< this times the logarithm of a likelihood counts
};

/// How little each state of a model ("senone") sounds like each of some frames. The same scores as PocketSphinx' own
/// for tied models, in a fraction of its time (docs/theory/hearing/alignment.md). Not thread-safe: it keeps room to
/// work in.
class SenoneScorer {
 public:
  /// So many densities of each codebook and stream count, the likeliest.
  static constexpr std::size_t kKept = std::tuple_size_v<decltype(LikeliestDensities::density)>;
  /// senones x frames, in units of kScoreUnit / scale; 0 is the best of a frame.
  using Scores = Eigen::Matrix<std::int16_t, Eigen::Dynamic, Eigen::Dynamic>;

  /// `portable_loops`: not those of the processor at hand; the scores are the same.
  explicit SenoneScorer(std::shared_ptr<const TiedModel> model, bool portable_loops = false);

  [[nodiscard]] const TiedModel& model() const { return *model_; }
  [[nodiscard]] std::shared_ptr<const TiedModel> sharedModel() const { return model_; }

  /// features: a column a frame. Senones of codebooks that are not wanted get the worst score. Valid until the next
  /// call.
  const Scores& score(const Eigen::Ref<const Eigen::MatrixXf>& features, const Weighing& weighing);

 private:
  LikeliestDensities& likeliest(std::size_t codebook, std::size_t stream, Eigen::Index frame);
  void findLikeliest(std::size_t stream, const Eigen::Ref<const Eigen::MatrixXf>& features);
  void toLikelihoods(std::size_t stream, Eigen::Index frame);
  void scoreFrame(Eigen::Index frame, const Weighing& weighing);

  std::shared_ptr<const TiedModel> model_;
  std::vector<std::size_t> looked_at_;  ///< codebooks
  const SenoneKernels* kernels_;        ///< none: portable loops
  std::vector<LikeliestDensities> likeliest_;
  std::vector<MixedStream> mixed_;
  std::vector<std::int16_t> own_scores_;  ///< of one codebook
  Eigen::MatrixXf log_densities_;
  std::vector<Eigen::ArrayXf> likelihoods_;  ///< by codebook, of its senones in one frame
  Scores scores_;
};

/// Sounds that are movements, in singing too: nobody holds them (Y W R L HH). Where a song's frames are left out, such
/// a sound is weighed as if they were heard: it must not take a held vowel that is like it, as the Y of "you" its UW.
class FleetingSounds {
 public:
  /// None: nothing is weighed.
  FleetingSounds() = default;
  /// `kept`: the frames that are heard (thinFrames).
  FleetingSounds(const TiedModel& model, const std::vector<std::size_t>& kept);

  /// `scores`: of the frames from `first` on, of those that are kept.
  void weigh(SenoneScorer::Scores& scores, Eigen::Index first) const;

  /// How often a phone that was heard in the kept frames [first, last] was weighed, a frame in the mean: 1 for most.
  [[nodiscard]] double timesWeighed(Phone phone, std::size_t first, std::size_t last) const;

 private:
  std::vector<int> senones_;
  std::vector<double> frame_counts_;  ///< how many frames each kept one stands for
};

}  // namespace mouthpiece
