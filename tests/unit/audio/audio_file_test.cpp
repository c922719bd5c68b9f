#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sndfile.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <numbers>

#include "audio/audio_clip.h"
#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

class AudioFileTest : public ::testing::Test {
 protected:
  AudioFileTest() : folder_(fs::path(::testing::TempDir()) / ("mouthpiece_audio_test_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~AudioFileTest() override { fs::remove_all(folder_); }
  [[nodiscard]] fs::path file(const char* name) const { return folder_ / name; }

 private:
  fs::path folder_;
};

AudioClip sine(int sample_rate_hz, double frequency_hz, std::size_t size) {
  AudioClip clip{.sample_rate_hz = sample_rate_hz, .samples = {}};
  for (std::size_t i = 0; i < size; ++i) {
    const double phase = 2 * std::numbers::pi * frequency_hz * static_cast<double>(i) / sample_rate_hz;
    clip.samples.push_back(static_cast<float>(0.5 * std::sin(phase)));
  }
  return clip;
}

void writeWithSndfile(const fs::path& path, int format, int channels, const std::vector<float>& samples) {
  SF_INFO info{};
  info.samplerate = 16000;
  info.channels = channels;
  info.format = format;
  SNDFILE* file = sf_open(path.c_str(), SFM_WRITE, &info);
  ASSERT_NE(file, nullptr) << sf_strerror(nullptr);
  sf_writef_float(file, samples.data(), static_cast<sf_count_t>(samples.size()) / channels);
  sf_close(file);
}

TEST_F(AudioFileTest, WavSurvivesWritingAndReading) {
  AudioClip clip = sine(16000, 440, 1000);
  clip.samples[3] = 2.0F;
  clip.samples[4] = -2.0F;
  writeWav(file("a.wav"), clip);
  const AudioClip read = readAudio(file("a.wav"));
  EXPECT_EQ(read.sample_rate_hz, 16000);
  ASSERT_EQ(read.samples.size(), clip.samples.size());
  constexpr float kQuantum = 1.0F / 32768.0F;
  for (std::size_t i = 5; i < read.samples.size(); ++i) EXPECT_NEAR(read.samples[i], clip.samples[i], 0.51F * kQuantum);
  EXPECT_FLOAT_EQ(read.samples[3], 1 - kQuantum);
  EXPECT_FLOAT_EQ(read.samples[4], -1);
  writeWav(file("b.wav"), read);
  EXPECT_EQ(readFile(file("a.wav")), readFile(file("b.wav")));
}

TEST_F(AudioFileTest, ReadsFlacVorbisAiffAndFloatAndAveragesChannels) {
  std::vector<float> stereo;
  for (std::size_t i = 0; i < 4000; ++i) stereo.insert(stereo.end(), {0.5F, -0.25F});
  const std::pair<const char*, int> kinds[] = {
      {"a.flac", SF_FORMAT_FLAC | SF_FORMAT_PCM_16},     {"a.ogg", SF_FORMAT_OGG | SF_FORMAT_VORBIS},
      {"a.aiff", SF_FORMAT_AIFF | SF_FORMAT_PCM_16},     {"f.wav", SF_FORMAT_WAV | SF_FORMAT_FLOAT},
      {"d.wav", SF_FORMAT_WAV | SF_FORMAT_DOUBLE},       {"p.wav", SF_FORMAT_WAV | SF_FORMAT_PCM_24},
      {"telephone.wav", SF_FORMAT_WAV | SF_FORMAT_ULAW}, {"a_law.wav", SF_FORMAT_WAV | SF_FORMAT_ALAW},
      {"sun.au", SF_FORMAT_AU | SF_FORMAT_PCM_16},       {"long.wav", SF_FORMAT_RF64 | SF_FORMAT_PCM_16}};
  for (const auto& [name, format] : kinds) {
    writeWithSndfile(file(name), format, 2, stereo);
    const AudioClip clip = readAudio(file(name));
    EXPECT_EQ(clip.samples.size(), 4000U) << name;
    EXPECT_NEAR(clip.samples[2000], 0.125F, 0.02F) << name;
    EXPECT_EQ(clip.sample_rate_hz, 16000) << name;
  }
}

/// As a cable whose poles are swapped gives them: together the two channels are silence.
TEST_F(AudioFileTest, TurnsOverASecondChannelThatMirrorsTheFirst) {
  std::vector<float> mirrored, apart;
  for (const float sample : sine(16000, 440, 4000).samples) {
    mirrored.insert(mirrored.end(), {sample, -0.9F * sample});
    apart.insert(apart.end(), {sample, 0});
  }
  writeWithSndfile(file("m.flac"), SF_FORMAT_FLAC | SF_FORMAT_PCM_16, 2, mirrored);
  writeWithSndfile(file("a.flac"), SF_FORMAT_FLAC | SF_FORMAT_PCM_16, 2, apart);
  const AudioClip clip = readAudio(file("m.flac")), half = readAudio(file("a.flac"));
  ASSERT_EQ(clip.samples.size(), 4000U);
  for (std::size_t i = 0; i < 4000; ++i) {
    ASSERT_NEAR(clip.samples[i], 0.95F * mirrored[2 * i], 1e-4F) << i;
    ASSERT_NEAR(half.samples[i], 0.5F * mirrored[2 * i], 1e-4F) << i;
  }
}

/// A foreign file keeps both channels on its way through ffmpeg.
TEST_F(AudioFileTest, TurnsOverAMirroredChannelOfAForeignFile) {
  const auto ffmpeg = findProgram("ffmpeg");
  if (!ffmpeg) GTEST_SKIP() << "no ffmpeg; get it with: sudo apt-get install ffmpeg";
  std::vector<float> mirrored;
  for (const float sample : sine(16000, 440, 4000).samples) mirrored.insert(mirrored.end(), {sample, -sample});
  writeWithSndfile(file("m.wav"), SF_FORMAT_WAV | SF_FORMAT_PCM_16, 2, mirrored);
  const ChildResult made = runChild(*ffmpeg, {"-nostdin", "-v", "error", "-i", "m.wav", "-c:a", "pcm_s16le", "m.caf"},
                                    file("m.wav").parent_path(), 60);
  ASSERT_EQ(made.exit_code, 0) << made.output;
  const AudioClip clip = readAudio(file("m.caf"));
  ASSERT_EQ(clip.samples.size(), 4000U);
  for (std::size_t i = 0; i < 4000; ++i) ASSERT_NEAR(clip.samples[i], mirrored[2 * i], 1e-4F) << i;
}

/// None keeps the number of samples.
TEST_F(AudioFileTest, ReadsOpusMp3AndAdpcm) {
  const std::pair<const char*, int> kinds[] = {{"i.wav", SF_FORMAT_WAV | SF_FORMAT_IMA_ADPCM},
                                               {"m.wav", SF_FORMAT_WAV | SF_FORMAT_MS_ADPCM},
                                               {"a.opus", SF_FORMAT_OGG | SF_FORMAT_OPUS},
                                               {"a.mp3", SF_FORMAT_MPEG | SF_FORMAT_MPEG_LAYER_III}};
  for (const auto& [name, format] : kinds) {
    writeWithSndfile(file(name), format, 1, sine(16000, 440, 16000).samples);
    EXPECT_NEAR(readAudio(file(name)).duration(), 1.0, 0.1) << name;
  }
}

/// libsndfile would open all of these.
TEST_F(AudioFileTest, RefusesACodecThatIsNotOnTheList) {
  const std::vector<float> second(16000, 0.25F);
  const std::pair<const char*, int> kinds[] = {{"g.wav", SF_FORMAT_WAV | SF_FORMAT_GSM610},
                                               {"g.au", SF_FORMAT_AU | SF_FORMAT_G721_32}};
  for (const auto& [name, format] : kinds) {
    writeWithSndfile(file(name), format, 1, second);
    const std::string error = errorOf([&, path = file(name)] { readAudio(path); });
    EXPECT_NE(error.find(": holds sound as "), std::string::npos) << name << ": " << error;
    EXPECT_NE(error.find("; expected PCM, floats, mu-law, A-law, ADPCM, FLAC, Vorbis, Opus or MP3"), std::string::npos)
        << name;
  }
}

TEST_F(AudioFileTest, NamesFoundAndExpectedWhenAWavLiesAboutItsLength) {
  writeWav(file("a.wav"), sine(16000, 440, 1000));
  std::string bytes = readFile(file("a.wav"));
  EXPECT_EQ(errorOf([&] { parseAudio(bytes.substr(0, 1044), "a.wav"); }),
            "a.wav:byte 36: claims 2000 bytes of sound, found 1000; expected a whole file");
  bytes[43] = '\x7F';  // the size of the data, over 2 GB
  EXPECT_EQ(errorOf([&] { parseAudio(bytes, "a.wav"); }),
            "a.wav:byte 36: claims 2130708432 bytes of sound, found 2000; expected a whole file");
}

TEST_F(AudioFileTest, NamesFoundAndExpectedWhenOthersLieAboutTheirLength) {
  const std::vector<float> samples(1000, 0.25F);
  const auto cut = [&](const char* name, int format, std::size_t bytes) {
    writeWithSndfile(file(name), format, 1, samples);
    const std::string whole = readFile(file(name));
    return errorOf([&] { parseAudio(whole.substr(0, whole.size() - bytes), name); });
  };
  EXPECT_EQ(cut("a.au", SF_FORMAT_AU | SF_FORMAT_PCM_16, 600),
            "a.au:byte 8: claims 2000 bytes of sound, found 1400; expected a whole file");
  EXPECT_NE(cut("a.wav", SF_FORMAT_RF64 | SF_FORMAT_PCM_16, 600).find("claims 2000 bytes of sound, found 1400"),
            std::string::npos);
}

/// libmpg123 prints what it finds missing: one line is enough.
TEST_F(AudioFileTest, AnMp3CutShortIsToldOnce) {
  writeWithSndfile(file("a.mp3"), SF_FORMAT_MPEG | SF_FORMAT_MPEG_LAYER_III, 1, sine(16000, 440, 32000).samples);
  const std::string whole = readFile(file("a.mp3"));
  for (const std::string& begins : {std::string(), std::string("ID3\4\0\0\0\0\1\2", 10) + std::string(130, '\0')}) {
    testing::internal::CaptureStderr();
    const std::string error = errorOf([&] { parseAudio(begins + whole.substr(0, whole.size() / 2), "a.mp3"); });
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_NE(error.find(fmt::format("a.mp3:byte {}: claims {} bytes", begins.size(), whole.size())), std::string::npos)
        << error;
    EXPECT_NEAR(parseAudio(begins + whole, "a.mp3").duration(), 2.0, 0.1);
  }
}

/// What ffmpeg, arecord and sox write into a pipe.
TEST_F(AudioFileTest, AWavThatWasPipedReachesToItsEnd) {
  writeWav(file("a.wav"), sine(16000, 440, 1000));
  for (const char* claimed : {"\xFF\xFF\xFF\xFF", "\x00\x00\x00\x80", "\x00\xF0\xFF\x7F"}) {
    const std::string bytes = readFile(file("a.wav")).replace(40, 4, claimed, 4);
    EXPECT_EQ(parseAudio(bytes, "a.wav").samples.size(), 1000U) << +static_cast<unsigned char>(claimed[3]);
  }
}

TEST_F(AudioFileTest, NamesFoundAndExpectedWhenAFlacIsCutShort) {
  std::vector<float> noise;
  for (int i = 0; i < 50000; ++i) noise.push_back(static_cast<float>((i * 7919) % 1000) / 1000.0F - 0.5F);
  writeWithSndfile(file("a.flac"), SF_FORMAT_FLAC | SF_FORMAT_PCM_16, 1, noise);
  const std::string bytes = readFile(file("a.flac"));
  const std::string error = errorOf([&] { parseAudio(std::string_view(bytes).substr(0, bytes.size() / 2), "a.flac"); });
  EXPECT_NE(error.find("a.flac: claims 50000 samples, found "), std::string::npos) << error;
}

TEST_F(AudioFileTest, SamplesSurviveFlacAndNothingElseIsTakenForThem) {
  std::vector<std::int16_t> samples = {-32768, 32767, 0, -1};
  for (int i = 0; i < 50000; ++i) samples.push_back(static_cast<std::int16_t>(i * 7919 % 65536 - 32768));
  const std::string bytes = flacBytes(samples);
  EXPECT_EQ(flacSamples(bytes, samples.size()), samples);
  EXPECT_EQ(parseAudio(bytes, "a.flac").samples.size(), samples.size()) << "as libsndfile reads it";
  for (const std::size_t count : {std::size_t{0}, samples.size() - 1, samples.size() + 1})
    EXPECT_EQ(flacSamples(bytes, count), std::nullopt) << count;
  EXPECT_EQ(flacSamples(bytes.substr(0, bytes.size() / 2), samples.size()), std::nullopt);
  EXPECT_EQ(flacSamples("fLaC", 4), std::nullopt);
  writeWithSndfile(file("a.flac"), SF_FORMAT_FLAC | SF_FORMAT_PCM_16, 2, std::vector<float>(2000, 0.5F));
  EXPECT_EQ(flacSamples(readFile(file("a.flac")), 1000), std::nullopt) << "two channels";
  writeWithSndfile(file("b.flac"), SF_FORMAT_FLAC | SF_FORMAT_PCM_16, 1, std::vector<float>(1000, 0.5F));
  EXPECT_EQ(flacSamples(readFile(file("b.flac")), 1000), std::vector<std::int16_t>(1000, 16384));
}

TEST_F(AudioFileTest, RefusesWhatIsNoSound) {
  EXPECT_EQ(errorOf([] { parseAudio("", "e.wav"); }),
            "e.wav: is empty; expected a WAV, AIFF, AU, FLAC, Ogg (Vorbis, Opus), MP3, M4A or AAC file");
  EXPECT_NE(errorOf([] { parseAudio("hello there, this is text", "t.wav"); }).find("starts with 'hello there,'"),
            std::string::npos);
  EXPECT_NE(errorOf([&] { readAudio(file("missing.wav")); }).find("no such file"), std::string::npos);
  writeWav(file("none.wav"), {.sample_rate_hz = 16000, .samples = {}});
  EXPECT_NE(errorOf([&] { readAudio(file("none.wav")); }).find("has no samples"), std::string::npos);
}

TEST_F(AudioFileTest, RefusesTooLongSoundAndSamplesThatAreNoNumbers) {
  writeWav(file("long.wav"), sine(8000, 100, 16000));
  EXPECT_NE(
      errorOf([&] { readAudio(file("long.wav"), {.most = 1.5}); }).find("claims 2 s of sound; expected at most 2 s"),
      std::string::npos);
  EXPECT_EQ(readAudio(file("long.wav"), {.most = 2.0}).samples.size(), 16000U);
  writeWithSndfile(file("nan.wav"), SF_FORMAT_WAV | SF_FORMAT_FLOAT, 1,
                   {0, std::numeric_limits<float>::quiet_NaN(), 0});
  EXPECT_NE(errorOf([&] { readAudio(file("nan.wav")); }).find("nan.wav:sample 1: is not a finite number"),
            std::string::npos);
}

TEST_F(AudioFileTest, RefusesForeignSoundByTheLengthThatItTells) {
  const auto ffmpeg = findProgram("ffmpeg");
  if (!ffmpeg || !findProgram("ffprobe")) GTEST_SKIP() << "no ffmpeg";
  const ChildResult made = runChild(
      *ffmpeg,
      {"-v", "error", "-f", "lavfi", "-i", "sine=440:duration=10", "-movflags", "+faststart", "-y", "long.m4a"},
      file(""), 60);
  ASSERT_EQ(made.exit_code, 0) << made.output;
  EXPECT_EQ(readAudio(file("long.m4a")).duration() > 9, true);
  // Of its sound nothing is there to be decoded: what is refused is what the beginning tells.
  const std::string bytes = readFile(file("long.m4a"));
  writeFileAtomically(file("head.m4a"), std::string_view(bytes).substr(0, bytes.find("mdat") + 4));
  EXPECT_NE(errorOf([&] { readAudio(file("head.m4a"), {.most = 5}); }).find("claims 10 s of sound; expected at most 5"),
            std::string::npos);
}

TEST_F(AudioFileTest, ALongOneComesAtTheRateThatIsHeard) {
  writeWav(file("long.wav"), sine(44100, 440, 2 * 44100));
  const AudioClip own = readAudio(file("long.wav"), {.own_rate_until = 2}),
                  heard = readAudio(file("long.wav"), {.own_rate_until = 1.9});
  EXPECT_EQ(own.sample_rate_hz, 44100);
  EXPECT_EQ(heard.sample_rate_hz, kLongSoundRateHz);
  EXPECT_EQ(heard.samples, resampleAudio(own, kLongSoundRateHz).samples);
  writeWav(file("low.wav"), sine(8000, 440, 16000));
  EXPECT_EQ(readAudio(file("low.wav"), {.own_rate_until = 1}).sample_rate_hz, 8000);
}

TEST_F(AudioFileTest, KeepsTheOldFileWhenItCannotWrite) {
  const AudioClip clip = sine(16000, 440, 100);
  fs::create_directories(file("folder.wav"));
  EXPECT_NE(errorOf([&] { writeWav(file("folder.wav"), clip); }).find("is a folder"), std::string::npos);
}

TEST_F(AudioFileTest, ReadsEveryTakeOfTheRealCapture) {
  const fs::path takes = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/takes";
  if (!fs::exists(takes)) GTEST_SKIP() << "needs the capture in ../shared/capture/grid_s1, which is not here";
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(takes)) {
    if (entry.path().extension() != ".wav") continue;
    const AudioClip clip = readAudio(entry.path());
    EXPECT_EQ(clip.sample_rate_hz, 16000);
    EXPECT_NEAR(clip.duration(), 3.0, 0.05);  // its README: up to 22 ms shorter than 3 s
    ++count;
  }
  EXPECT_EQ(count, 296U);
}

}  // namespace
}  // namespace mouthpiece
