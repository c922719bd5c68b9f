// The reader of networks takes the package's two, and nothing that is cut or changed.
#include "tracking/tflite_model.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "base/errors.h"
#include "base/files.h"

namespace mouthpiece {
namespace {

std::string networkBytes(const char* name) {
  const std::filesystem::path file = std::filesystem::path(MOUTHPIECE_BUILD_SHARE_DIR) / "face_tracker" / name;
  return std::filesystem::exists(file) ? readFile(file) : std::string();
}

TEST(TfliteModel, ReadsBothNetworks) {
  const std::string landmarks = networkBytes("face_landmarks.tflite"),
                    detection = networkBytes("face_detection.tflite");
  if (landmarks.empty()) GTEST_SKIP() << "no face_tracker in the build's share folder; build viewer_page";
  const TfliteModel mesh = parseTfliteModel(landmarks, "landmarks");
  EXPECT_EQ(mesh.outputs.size(), 7u);
  EXPECT_EQ(mesh.tensors[mesh.input].shape, (std::vector<std::size_t>{1, 192, 192, 3}));
  EXPECT_EQ(mesh.tensors[mesh.outputs[0]].shape.back(), 3u * 468);
  EXPECT_EQ(parseTfliteModel(detection, "detection").outputs.size(), 2u);
}

TEST(TfliteModel, RefusesWhatIsNone) {
  EXPECT_THROW(parseTfliteModel("", "empty"), InputError);
  EXPECT_THROW(parseTfliteModel("hello, this is no network at all", "text"), InputError);
  std::string noise("\x10\0\0\0TFL3", 8);
  noise.append(64, '\xff');
  EXPECT_THROW(parseTfliteModel(noise, "noise"), InputError);
}

/// Never a crash: an InputError, or a model.
TEST(TfliteModel, StandsDamage) {
  const std::string whole = networkBytes("face_detection.tflite");
  if (whole.empty()) GTEST_SKIP() << "no face_tracker in the build's share folder; build viewer_page";
  for (std::size_t size = 0; size < whole.size(); size += whole.size() / 60) {
    EXPECT_THROW(parseTfliteModel(whole.substr(0, size), "cut"), InputError) << size;
  }
  std::mt19937 random(5);
  for (int i = 0; i < 60; ++i) {
    std::string changed = whole;
    for (int k = 0; k < 20; ++k) changed[random() % (k < 10 ? 4096 : changed.size())] = static_cast<char>(random());
    try {
      parseTfliteModel(changed, "changed");
    } catch (const InputError&) {
    }
  }
}

}  // namespace
}  // namespace mouthpiece
