#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace mouthpiece {

/// PocketSphinx' phonetically tied acoustic model as its files hold it (means, variances, sendump, mdef): the states of
/// all triphones of a phone ("senones") share the phone's Gaussians and differ by their weights
/// (docs/theory/alignment.md).
struct TiedModel {
  struct Codebook {
    std::string phone;                       ///< "AA", "SIL"
    std::vector<int> senones;                ///< whose states this phone's sounds are, rising
    std::vector<Eigen::MatrixXf> gaussians;  ///< by stream: log density = gaussians * (x^2, x, 1); densities x (2n + 1)
    std::vector<Eigen::MatrixXf> weights;    ///< by stream: senones x densities, linear
  };
  std::vector<Codebook> codebooks;
  std::size_t senone_count = 0;
  std::vector<Eigen::Index> stream_sizes;  ///< how the features are cut

  [[nodiscard]] Eigen::Index featureCount() const;
};

/// The bytes of a model's files.
struct TiedModelFiles {
  std::filesystem::path folder;  ///< for errors
  std::string mdef, means, variances, sendump;
};

/// Throws InputError when a file is damaged, or of another kind of model.
TiedModel parseTiedModel(const TiedModelFiles& files);
/// The files of a folder. Throws InputError also when one is missing.
TiedModel readTiedModel(const std::filesystem::path& folder);

}  // namespace mouthpiece
