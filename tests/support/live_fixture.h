// A line followed while it is being said, with the sample corpus.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "mouthpiece/speaker.h"

namespace mouthpiece {

namespace fs = std::filesystem;
inline const fs::path kLiveShare = MOUTHPIECE_BUILD_SHARE_DIR;

/// Frames as they came, copied.
struct Pulled {
  std::vector<double> markers_mm;
  std::vector<float> arkit;
  std::size_t frames = 0;

  void add(const Frame& frame) {
    EXPECT_EQ(frame.index, frames++);
    markers_mm.insert(markers_mm.end(), frame.markers_mm.begin(), frame.markers_mm.end());
    arkit.insert(arkit.end(), frame.arkit.begin(), frame.arkit.end());
  }
  void addAll(LiveStream& stream) {
    while (const Frame* frame = stream.next()) add(*frame);
  }
  bool operator==(const Pulled&) const = default;
};

class Live : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kLiveShare / "default.face"))
      GTEST_SKIP() << "no sample corpus in " << kLiveShare << ": run `make data`";
  }
  static Speaker& speaker() {
    static Speaker shared(optionsOf(false));
    return shared;
  }
  static SpeakerOptions optionsOf(bool with_face) {
    SpeakerOptions options;
    options.corpus = kLiveShare / "sample.corpus";
    options.face = kLiveShare / "default.face";
    options.with_face = with_face;
    options.voice = "flite:slt";
    return options;
  }
  static const Performance& line() {
    static const Performance said = speaker().perform("my mother bought a very big blue boat from bob");
    return said;
  }
  static const std::vector<float>& sound() {
    EXPECT_EQ(line().sound().sample_rate_hz, 16000);
    return line().sound().samples;
  }
  static Pulled heardInChunks(const std::function<std::size_t()>& size) {
    LiveStream stream = speaker().live();
    Pulled pulled;
    for (std::size_t at = 0; at < sound().size();) {
      const std::size_t count = std::min(size(), sound().size() - at);
      stream.push(std::span(sound()).subspan(at, count));
      pulled.addAll(stream);
      at += count;
    }
    stream.finish();
    pulled.addAll(stream);
    EXPECT_TRUE(stream.isFinished());
    return pulled;
  }
  static void pushLabels(LiveStream& stream, Pulled& pulled) {
    for (const PhoneLabel& phone : line().labels().phones) {
      stream.push(LivePhone{phone.phone, phone.span, phone.word});
      pulled.addAll(stream);
    }
    stream.finish();
    pulled.addAll(stream);
  }
  /// LIP_UP_MID to LIP_LO_MID.
  static std::vector<double> openings(const std::vector<double>& markers_mm) {
    const std::vector<std::string>& names = line().motion().marker_names;
    const auto at = [&](const char* name) {
      return 3 * static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    const std::size_t upper = at("LIP_UP_MID"), lower = at("LIP_LO_MID");
    std::vector<double> opening;
    for (std::size_t row = 0; row < markers_mm.size(); row += 3 * names.size()) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) sum += std::pow(markers_mm[row + upper + k] - markers_mm[row + lower + k], 2);
      opening.push_back(std::sqrt(sum));
    }
    return opening;
  }
  static double correlation(const std::vector<double>& a, const std::vector<double>& b) {
    const std::size_t n = std::min(a.size(), b.size());
    double mean_a = 0, mean_b = 0, ab = 0, aa = 0, bb = 0;
    for (std::size_t i = 0; i < n; ++i) {
      mean_a += a[i] / static_cast<double>(n);
      mean_b += b[i] / static_cast<double>(n);
    }
    for (std::size_t i = 0; i < n; ++i) {
      ab += (a[i] - mean_a) * (b[i] - mean_b);
      aa += (a[i] - mean_a) * (a[i] - mean_a);
      bb += (b[i] - mean_b) * (b[i] - mean_b);
    }
    return ab / std::sqrt(aa * bb);
  }
};

}  // namespace mouthpiece
