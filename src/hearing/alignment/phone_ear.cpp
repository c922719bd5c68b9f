#include "hearing/alignment/phone_ear.h"

#include <algorithm>
#include <filesystem>
#include <string>

#include "base/index.h"
#include "hearing/alignment/phone_decoder.h"
#include "hearing/alignment/phone_loop.h"

namespace mouthpiece {

struct PhoneEar::State {
  explicit State(const Language& language)
      : decoder({}, language),
        loop(decoder.scorer().sharedModel(), std::filesystem::path(MOUTHPIECE_SPHINX_MODELS) /
                                                 (std::string(language.acoustic_model) + "-phone.lm.bin")) {}
  PhoneDecoder decoder;
  PhoneLoop loop;
};

PhoneEar::PhoneEar(const Language& language) : state_(std::make_unique<State>(language)) {}
PhoneEar::~PhoneEar() = default;

Eigen::MatrixXf PhoneEar::posteriors(std::span<const std::int16_t> samples) {
  return state_->loop.posteriors(state_->decoder.scorer(), state_->decoder.featuresOf(samples));
}

namespace {

constexpr Eigen::Index kShortestFrames = 3;

}  // namespace

std::vector<HeardPhone> likeliestPhones(const Eigen::MatrixXf& posteriors, const Eigen::MatrixXf& likeness,
                                        double change) {
  const Eigen::Index frames = posteriors.cols(), phones = posteriors.rows();
  std::vector<HeardPhone> heard;
  if (frames < kShortestFrames) return heard;
  const Eigen::MatrixXf gain = likeness * posteriors;
  // best(p, t): of rows whose phone p began at least kShortestFrames before frame t's end.
  Eigen::MatrixXf best = Eigen::MatrixXf::Constant(phones, frames, -1e9F);
  std::vector<std::vector<bool>> begins(unsignedIndex(frames), std::vector<bool>(unsignedIndex(phones)));
  std::vector<Eigen::Index> champion(unsignedIndex(frames), 0);
  std::vector<float> champion_value(unsignedIndex(frames), 0);
  for (Eigen::Index t = 0; t < frames; ++t) {
    for (Eigen::Index phone = 0; phone < phones; ++phone) {
      const Eigen::Index start = t - kShortestFrames + 1;
      float stay = t > 0 ? best(phone, t - 1) + gain(phone, t) : -1e9F, begin = -1e9F;
      if (start == 0) begin = gain.row(phone).head(kShortestFrames).sum();
      if (start > 0)
        begin = champion_value[unsignedIndex(start - 1)] - asFloat(change) +
                gain.row(phone).segment(start, kShortestFrames).sum();
      begins[unsignedIndex(t)][unsignedIndex(phone)] = begin > stay;
      best(phone, t) = std::max(begin, stay);
    }
    champion_value[unsignedIndex(t)] = best.col(t).maxCoeff(&champion[unsignedIndex(t)]);
  }
  Eigen::Index t = frames - 1, end = frames;
  Eigen::Index phone = champion[unsignedIndex(t)];
  while (true) {
    while (!begins[unsignedIndex(t)][unsignedIndex(phone)]) --t;
    const Eigen::Index first = t - kShortestFrames + 1;
    heard.push_back({static_cast<Phone>(phone), unsignedIndex(first), unsignedIndex(end),
                     posteriors.row(phone).segment(first, end - first).mean()});
    if (first == 0) break;
    end = first;
    t = first - 1;
    phone = champion[unsignedIndex(t)];
  }
  std::reverse(heard.begin(), heard.end());
  return heard;
}

}  // namespace mouthpiece
