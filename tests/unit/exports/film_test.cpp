// Films: what is painted, and that pictures and sound come out in step.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/zip.h"
#include "exports/film/face_painter.h"
#include "exports/film/film_file.h"
#include "exports/film/painting.h"
#include "support/run_program.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

TEST(TriangleFill, NeighboursCoverEachSampleOnce) {
  constexpr int kSize = 40;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-5, kSize + 5);
  for (int trial = 0; trial < 200; ++trial) {
    // A fan around a point tiles its outline: each sample belongs to one of its triangles, or to none.
    const RasterPoint<1> middle{20, 20, {1}};
    std::vector<RasterPoint<1>> rim;
    for (int i = 0; i < 7; ++i) {
      const float angle = 6.2831853F * static_cast<float>(i) / 7, far = 5 + std::abs(place(random)) / 3;
      rim.push_back({20 + far * std::cos(angle), 20 + far * std::sin(angle), {2}});
    }
    std::vector<int> visits(kSize * kSize);
    for (std::size_t i = 0; i < rim.size(); ++i) {
      fillTriangle<1>({middle, rim[i], rim[(i + 1) % rim.size()]}, kSize, 0, kSize,
                      [&](int row, int begin, int end, std::array<float, 1> at, std::array<float, 1> step) {
                        for (int x = begin; x < end; ++x, at[0] += step[0]) {
                          ++visits[static_cast<std::size_t>(row * kSize + x)];
                          EXPECT_GE(at[0], 0.99F);
                          EXPECT_LE(at[0], 2.01F);
                        }
                      });
    }
    EXPECT_EQ(visits[20 * kSize + 20], 1);
    for (const int count : visits) ASSERT_LE(count, 1);
  }
}

double meanDifference(const Picture& a, const Picture& b, std::size_t first_row, std::size_t end_row) {
  double sum = 0;
  for (std::size_t i = 3 * a.width * first_row; i < 3 * a.width * end_row; ++i) sum += std::abs(a.rgb[i] - b.rgb[i]);
  return sum / static_cast<double>(3 * a.width * (end_row - first_row));
}

TEST(FacePainter, TellsWhereAPlaceIsPainted) {
  FaceMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 3, 4, 1, 5, 4, 1, 4, 6, 1;  // a speck up and to the right of the middle
  mesh.triangles = {{0, 1, 2}};
  mesh.parts = {{.name = "speck", .kind = PartKind::kOther, .triangle_count = 1, .base_color = {1, 1, 1, 1}}};
  const Eigen::AlignedBox3f focus(Eigen::Vector3f(-10, -10, -10), Eigen::Vector3f(10, 10, 10));
  for (const Eigen::Vector3f& side : {Eigen::Vector3f(0, 0, 1), Eigen::Vector3f(0.3F, 0.06F, 1)}) {
    const FacePainter painter(mesh, focus, 200, 160, side);
    Picture with, without;
    painter.paint(mesh.vertices, with);
    const VertexPositions elsewhere = mesh.vertices.array() + 1e4F;
    painter.paint(elsewhere, without);
    double x = 0, y = 0, count = 0;
    for (std::size_t i = 0; i < with.width * with.height; ++i) {
      if (with.rgb[3 * i] == without.rgb[3 * i] && with.rgb[3 * i + 2] == without.rgb[3 * i + 2]) continue;
      x += static_cast<double>(i % with.width) + 0.5;
      y += static_cast<double>(i / with.width) + 0.5;
      ++count;
    }
    ASSERT_GT(count, 4);
    const Eigen::Vector3f middle = mesh.vertices.colwise().mean(), seen = painter.onPicture(middle);
    EXPECT_NEAR(x / count, seen.x(), 0.6);  // a pixel's half, and that what is near is larger
    EXPECT_NEAR(y / count, seen.y(), 0.6);
    EXPECT_LT((painter.fromPicture(seen) - middle).norm(), 1e-3F);
  }
}

/// A place that is much further away than the picture is wide, a focus without extent, a colour beyond all numbers.
TEST(FacePainter, HoldsOnToItsPictureWhateverItIsGiven) {
  FaceMesh mesh;
  mesh.vertices.resize(6, 3);
  mesh.vertices << 0, 0, 0, 1e-3F, 0, 0, 0, 1e-3F, 0, 1e7F, 1e7F, -1e7F, -1e7F, 1e7F, 1e7F, 1e7F, -1e7F, 1e7F;
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}, {0, 4, 1}, {2, 2, 3}};
  for (const PartKind kind : {PartKind::kSkin, PartKind::kHair, PartKind::kOther}) {
    for (const float color : {0.5F, std::numeric_limits<float>::infinity()}) {
      mesh.parts = {{.name = "all", .kind = kind, .triangle_count = 4, .base_color = {color, color, color, 1}}};
      for (const float reach : {0.0F, 1e-6F, 1e-3F, 1e7F}) {
        const Eigen::AlignedBox3f focus(Eigen::Vector3f(-reach, -reach, -reach), Eigen::Vector3f(reach, reach, reach));
        Picture picture;
        FacePainter(mesh, focus, 48, 40).paint(mesh.vertices, picture);
        ASSERT_EQ(picture.rgb.size(), 3U * 48 * 40);
        const VertexPositions lost = VertexPositions::Constant(6, 3, std::numeric_limits<float>::quiet_NaN());
        FacePainter(mesh, focus, 48, 40).paint(lost, picture);
        ASSERT_EQ(picture.rgb.size(), 3U * 48 * 40);
      }
    }
  }
  EXPECT_EQ(screenByte(std::numeric_limits<float>::quiet_NaN()), screenByte(0));
  EXPECT_EQ(screenByte(std::numeric_limits<float>::infinity()), screenByte(4));
}

TEST(FacePainter, ShowsTheHeadAndWhatMoves) {
  const samples::TalkingHead head = samples::makeTalkingHead();
  Eigen::AlignedBox3f all;
  for (Eigen::Index v = 0; v < head.mesh.vertices.rows(); ++v) all.extend(head.mesh.vertices.row(v).transpose());
  const FacePainter painter(head.mesh, all, 320, 180);
  Picture rest, again, open;
  painter.paint(head.mesh.vertices, rest);
  painter.paint(head.mesh.vertices, again);
  ASSERT_EQ(rest.rgb.size(), 3U * 320 * 180);
  EXPECT_EQ(rest.rgb, again.rgb);
  const auto at = [&](std::size_t x, std::size_t y) { return &rest.rgb[3 * (y * 320 + x)]; };
  EXPECT_GT(at(160, 90)[0], at(2, 90)[0] + 30) << "skin before the background";
  EXPECT_GT(at(160, 90)[0], at(160, 90)[2]) << "which is redder than blue";
  VertexPositions lower = head.mesh.vertices;
  for (Eigen::Index v = 0; v < lower.rows(); ++v) {
    if (lower(v, 1) < all.center().y()) lower(v, 1) -= 0.1F * all.sizes().y();
  }
  painter.paint(lower, open);
  EXPECT_GT(meanDifference(rest, open, 90, 180), 1);
  EXPECT_LT(meanDifference(rest, open, 0, 70), 0.5) << "the upper half stays, but for shadows";
}

/// A film of a bar that goes from left to right, with noise as its sound.
class FilmFile : public ::testing::Test {
 protected:
  void SetUp() override {
    ffmpeg_ = findProgram("ffmpeg");
    if (!ffmpeg_) GTEST_SKIP() << "no ffmpeg; get it with: sudo apt-get install ffmpeg";
    std::mt19937 random(3);
    std::uniform_real_distribution<float> noise(-0.5F, 0.5F);
    sound_.sample_rate_hz = 16'000;
    float low = 0;  // what codecs keep
    for (int i = 0; i < 32'000; ++i) sound_.samples.push_back(low += 0.2F * (noise(random) - low));
  }
  [[nodiscard]] Film film() const {
    return {25,
            50,
            160,
            96,
            [](std::size_t frame, Picture& picture) {
              picture.width = 160;
              picture.height = 96;
              picture.rgb.assign(3U * 160 * 96, 40);
              for (std::size_t y = 0; y < 96; ++y)
                std::fill_n(picture.rgb.begin() + static_cast<std::ptrdiff_t>(3 * (160 * y + 3 * frame)), 3 * 8, 220);
            },
            sound_};
  }
  [[nodiscard]] std::string decoded(const fs::path& file, const std::vector<std::string>& options) const {
    std::vector<std::string> words{"-v", "error", "-i", file.string()};
    words.insert(words.end(), options.begin(), options.end());
    words.emplace_back("out.raw");
    const PrivateFolder folder;
    const ChildResult result = runChild(*ffmpeg_, words, folder.path(), 60);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return result.exit_code == 0 ? readFile(folder.path() / "out.raw") : "";
  }
  /// Where the bar stands in each picture, as the frame that it belongs to.
  [[nodiscard]] std::vector<double> framesSeen(const fs::path& file, std::size_t width) const {
    const std::string raw = decoded(file, {"-f", "rawvideo", "-pix_fmt", "gray", "-fps_mode", "passthrough"});
    const std::size_t height = 96 * width / 160;
    std::vector<double> seen;
    for (std::size_t start = 0; start + width * height <= raw.size(); start += width * height) {
      double sum = 0, weight = 0;
      for (std::size_t x = 0; x < width; ++x) {
        const double light = static_cast<unsigned char>(raw[start + width * (height / 2) + x]) - 90.0;
        if (light > 0) sum += light * static_cast<double>(x);
        if (light > 0) weight += light;
      }
      seen.push_back((sum / weight * 160 / static_cast<double>(width) - 3.5) / 3);
    }
    return seen;
  }

  std::optional<fs::path> ffmpeg_;
  AudioClip sound_;
  test::ScratchFolder folder_;
};

TEST_F(FilmFile, PicturesAndSoundAreInStep) {
  for (const char* name : {"film.mp4", "film.webm"}) {
    const fs::path path = folder_.path() / name;
    std::size_t told = 0;
    writeFilm(path, film(), [&](std::size_t done) { told = done; });
    EXPECT_EQ(told, 50U);
    const std::vector<double> seen = framesSeen(path, 160);
    ASSERT_EQ(seen.size(), 50U) << name;
    for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_NEAR(seen[i], static_cast<double>(i), 0.4) << name;
    const std::string raw = decoded(path, {"-f", "f32le", "-ac", "1", "-ar", "16000"});
    std::vector<float> heard(raw.size() / sizeof(float));
    std::memcpy(heard.data(), raw.data(), heard.size() * sizeof(float));
    ASSERT_GT(heard.size(), 30'000U) << name;
    // The lag at which what is decoded is most like what went in.
    int best_lag = 0;
    double best = -1;
    for (int lag = -1600; lag <= 1600; lag += 4) {
      double sum = 0;
      for (int i = 4000; i < 24'000; ++i)
        sum += static_cast<double>(heard[static_cast<std::size_t>(i + lag)]) *
               static_cast<double>(sound_.samples[static_cast<std::size_t>(i)]);
      if (sum > best) {
        best = sum;
        best_lag = lag;
      }
    }
    EXPECT_LT(std::abs(best_lag), 16'000 / 25 / 2) << name << ": half a frame";
  }
}

TEST_F(FilmFile, GifsAndSinglePictures) {
  const fs::path gif = folder_.path() / "film.gif", zip = folder_.path() / "film.png.zip";
  writeFilm(gif, film());
  EXPECT_EQ(framesSeen(gif, 80).size(), 50U);
  writeFilm(zip, film());
  const std::string bytes = readFile(zip);
  const std::string first = unzipped(bytes, "000001.png", "film.zip");
  EXPECT_TRUE(first.starts_with("\x89PNG"));
  EXPECT_FALSE(unzipped(bytes, "000050.png", "film.zip").empty());
  EXPECT_TRUE(unzipped(bytes, "000051.png", "film.zip").empty());
  EXPECT_TRUE(unzipped(bytes, "sound.wav", "film.zip").starts_with("RIFF"));
}

TEST_F(FilmFile, WhatPaintingThrowsComesOutAndNothingIsLeft) {
  Film broken = film();
  broken.paint = [](std::size_t frame, Picture& picture) {
    if (frame > 20) throw InputError("no paint left");
    picture.rgb.assign(3U * 160 * 96, 0);
  };
  EXPECT_THROW(writeFilm(folder_.path() / "broken.mp4", broken), InputError);
  Film empty = film();
  empty.frame_count = 0;
  EXPECT_THROW(writeFilm(folder_.path() / "empty.mp4", empty), InputError);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

}  // namespace
}  // namespace mouthpiece
