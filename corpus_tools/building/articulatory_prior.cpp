#include "corpus_tools/building/prediction_parts.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string_view>
#include <utility>

#include "base/index.h"
#include "base/matrix_solvers.h"
#include "phonetics/language/phone.h"
#include "units/prediction/context_network.h"
#include "units/prediction/speech_segments.h"

namespace mouthpiece {
namespace {

/// How much of what a feature brings it shares with those made alike, and how far apart sounds are that share little.
constexpr double kShared = 0.7, kReach = 1.5;

/// A feature's name taken apart: features of one kind are compared by their sounds.
struct Feature {
  std::string kind, own, neighbour;
};

Feature featureOf(const std::string& name) {
  std::istringstream words(name);
  std::vector<std::string> all;
  for (std::string word; words >> word;) all.push_back(std::move(word));
  const std::size_t kinds = all[0] == "length" ? 2 : all[0] == "silence" ? std::min<std::size_t>(all.size(), 3) : 1;
  Feature feature;
  for (std::size_t i = 0; i < kinds; ++i) feature.kind += all[i] + " ";
  const bool is_half = feature.kind.find("phone") != std::string::npos && all.size() > kinds + 1;
  if (all.size() > kinds) feature.own = all[kinds] + (is_half ? " " + all[kinds + 1] : "");
  if (!is_half && all.size() > kinds + 1) feature.neighbour = all[kinds + 1];
  return feature;
}

/// By what follows "phone" and "viseme" in a feature's name; silence and the line's ends ("-") have none.
class Articulations {
 public:
  Articulations() {
    std::map<Viseme, std::pair<Eigen::VectorXd, double>> visemes;
    for (std::size_t i = 0; i < kPhoneCount; ++i) {
      const auto phone = static_cast<Phone>(i);
      if (phone == Phone::kSil) continue;
      const std::string name(phoneName(phone));
      for (const bool second : {false, true}) {
        const Eigen::VectorXd own = articulationOf(phone, second).cast<double>();
        if (isDiphthong(phone)) {
          known_[name + (second ? " 2" : " 1")] = own;
        } else {
          known_[name] = own;
        }
        auto& [sum, count] =
            visemes.try_emplace(second ? lastViseme(phone) : firstViseme(phone), Eigen::VectorXd::Zero(own.size()), 0.0)
                .first->second;
        sum += own;
        count += 1;
      }
    }
    for (const auto& [viseme, sum] : visemes) of_visemes_[std::string(visemeName(viseme))] = sum.first / sum.second;
  }

  /// 0 to 1: how alike two of the same kind are made.
  [[nodiscard]] double alike(const std::string& a, const std::string& b, bool are_phones) const {
    if (a == b) return 1;
    const auto& known = are_phones ? known_ : of_visemes_;
    const auto one = known.find(a), other = known.find(b);
    if (one == known.end() || other == known.end()) return 0;
    return std::exp(-0.5 * (one->second - other->second).squaredNorm() / (kReach * kReach));
  }
  [[nodiscard]] const std::map<std::string, Eigen::VectorXd>& phones() const { return known_; }
  [[nodiscard]] const std::map<std::string, Eigen::VectorXd>& visemes() const { return of_visemes_; }

 private:
  std::map<std::string, Eigen::VectorXd> known_, of_visemes_;
};

const Articulations& articulations() {
  static const Articulations all;
  return all;
}

/// Between two different features.
double covariance(const Feature& a, const Feature& b) {
  if (a.kind != b.kind) return 0;
  const bool are_phones = a.kind.find("phone") != std::string::npos;
  const Articulations& all = articulations();
  return kShared * all.alike(a.own, b.own, are_phones) *
         (a.neighbour == b.neighbour ? 1 : all.alike(a.neighbour, b.neighbour, false));
}

std::vector<std::string> allFeatures() {
  std::vector<std::string> names;
  for (const auto& [phone, own] : articulations().phones()) {
    names.push_back("phone " + phone);
    names.push_back("length phone " + phone);
  }
  std::vector<std::string> neighbours{"sil", "-"};
  for (const auto& [viseme, own] : articulations().visemes()) neighbours.push_back(viseme);
  for (const auto& [viseme, own] : articulations().visemes()) {
    names.push_back("viseme " + viseme);
    names.push_back("length viseme " + viseme);
    for (const std::string& neighbour : neighbours) {
      for (const std::string_view side : {"left ", "right ", "left2 ", "right2 "}) {
        names.push_back(std::string(side) + viseme + " " + neighbour);
      }
    }
  }
  return names;
}

}  // namespace

ArticulatoryPrior::ArticulatoryPrior(std::vector<std::string> names) : names_(std::move(names)) {
  const auto count = signedIndex(names_.size());
  std::map<std::string, std::vector<Eigen::Index>> kinds;
  std::vector<Feature> features;
  for (Eigen::Index i = 0; i < count; ++i) {
    features.push_back(featureOf(names_[unsignedIndex(i)]));
    kinds[features.back().kind].push_back(i);
  }
  for (auto& [kind, places] : kinds) {
    const auto size = std::ssize(places);
    Eigen::MatrixXd own = Eigen::MatrixXd::Identity(size, size);
    for (Eigen::Index i = 0; i < size; ++i) {
      for (Eigen::Index j = 0; j < i; ++j)
        own(i, j) = own(j, i) = covariance(features[unsignedIndex(places[unsignedIndex(i)])],
                                           features[unsignedIndex(places[unsignedIndex(j)])]);
    }
    kinds_.push_back({std::move(places), solveSymmetric(std::move(own), Eigen::MatrixXd::Identity(size, size))});
  }
}

Eigen::MatrixXd ArticulatoryPrior::precision() const {
  const auto count = std::ssize(names_);
  Eigen::MatrixXd precision = Eigen::MatrixXd::Zero(count, count);
  for (const Kind& kind : kinds_) precision(kind.places, kind.places) = kind.precision;
  return precision;
}

std::map<std::string, Eigen::VectorXd> ArticulatoryPrior::unsaid(const Eigen::MatrixXd& targets) const {
  Eigen::MatrixXd weighed(targets.rows(), targets.cols());
  for (const Kind& kind : kinds_) weighed(kind.places, Eigen::all) = kind.precision * targets(kind.places, Eigen::all);
  std::vector<Feature> features;
  for (const std::string& name : names_) features.push_back(featureOf(name));
  std::map<std::string, Eigen::VectorXd> expected;
  for (const std::string& name : allFeatures()) {
    if (std::find(names_.begin(), names_.end(), name) != names_.end()) continue;
    const Feature own = featureOf(name);
    Eigen::VectorXd target = Eigen::VectorXd::Zero(targets.cols());
    for (std::size_t i = 0; i < features.size(); ++i) {
      const double share = covariance(own, features[i]);
      if (share > 0) target += share * weighed.row(signedIndex(i)).transpose();
    }
    if (target.squaredNorm() > 0) expected[name] = target;
  }
  return expected;
}

}  // namespace mouthpiece
