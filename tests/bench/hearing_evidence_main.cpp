// Not a benchmark: writes what is heard alone in sounds whose words are known, and its warnings, of GRID s1's takes and
// of voices, in silence and in noise (docs/theory/hearing/recognition.md#how-sure).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "audio/audio_clip.h"
#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/index.h"
#include "corpus_tools/research/evaluation/noises.h"
#include "hearing/recognition/recogniser.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr int kRateHz = 16000;
constexpr std::size_t kGridEvery = 12, kLinesAVoice = 25, kBabble = 10;

struct SaidLine {
  std::string name, set, text;
  AudioClip audio;
};

std::vector<std::string> linesOf(const fs::path& path) {
  std::vector<std::string> lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line.front() != '#') lines.push_back(line);
  }
  return lines;
}

/// Of every twelve takes (counted from 0) the second to fit, the first to judge.
void addTakes(std::vector<SaidLine>& lines, const fs::path& folder) {
  std::vector<fs::path> takes;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".wav") takes.push_back(entry.path());
  }
  std::sort(takes.begin(), takes.end());
  for (std::size_t i = 0; i < takes.size(); ++i) {
    if (i % kGridEvery > 1) continue;
    const std::vector<std::string> text = linesOf(fs::path(takes[i]).replace_extension(".txt"));
    lines.push_back({takes[i].stem().string(), i % kGridEvery == 1 ? "grid_fit" : "grid_judge",
                     text.empty() ? "" : text[0], resampleAudio(readAudio(takes[i]), kRateHz)});
  }
}

/// Voices and the sentences that they say: even ones to fit, odd ones to judge.
void addVoices(std::vector<SaidLine>& lines, const std::vector<std::string>& sentences) {
  const std::vector<std::pair<std::string, bool>> voices{
      {"festival:cmu_us_slt_arctic_hts", true}, {"flite:slt", true},    {"flite:awb", true},  {"espeak:en-us", true},
      {"festival:kal_diphone", false},          {"flite:kal16", false}, {"flite:rms", false}, {"espeak:en-gb", false}};
  for (std::size_t v = 0; v < voices.size(); ++v) {
    const auto& [name, fits] = voices[v];
    const auto voice = makeVoice(name);
    for (std::size_t k = 0; k < kLinesAVoice; ++k) {
      const std::size_t at = (2 * (7 * k + 3 * v) + (fits ? 0 : 1)) % sentences.size();
      AudioClip audio = resampleAudio(voice->speak(sentences[at]).audio, kRateHz);
      if (k % 2 == 0) {
        audio.samples.insert(audio.samples.begin(), kRateHz / 2, 0.0F);
        audio.samples.insert(audio.samples.end(), kRateHz / 2, 0.0F);
      }
      lines.push_back({fmt::format("{}/{}", name, at), fits ? "voices_fit" : "voices_judge", sentences[at], audio});
    }
  }
}

/// White noise or pink, `snr_db` under the speech's own power.
AudioClip withHiss(AudioClip clip, bool is_pink, double snr_db, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  std::vector<double> hiss;
  // Paul Kellet's filter.
  double a = 0, b = 0, c = 0;
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    const double white = normal(engine);
    a = 0.99765 * a + white * 0.0990460;
    b = 0.96300 * b + white * 0.2965164;
    c = 0.57000 * c + white * 1.0526913;
    hiss.push_back(is_pink ? a + b + c + white * 0.1848 : white);
  }
  double speech = 0, noise = 0;
  for (std::size_t i = 0; i < hiss.size(); ++i) {
    speech += double{clip.samples[i]} * double{clip.samples[i]};
    noise += hiss[i] * hiss[i];
  }
  const double gain = std::sqrt(speech / noise) * std::pow(10, -snr_db / 20);
  for (std::size_t i = 0; i < hiss.size(); ++i) clip.samples[i] += static_cast<float>(gain * hiss[i]);
  return clip;
}

/// A sound as it is and in two noises or a room, others from line to line.
std::vector<std::pair<std::string, AudioClip>> soundsOf(const SaidLine& line, std::size_t index,
                                                        const std::vector<AudioClip>& voices) {
  constexpr Seconds kReverberation = 0.4;
  constexpr std::array<double, 4> kLevelsDb{30, 20, 15, 10};
  std::vector<std::pair<std::string, AudioClip>> sounds{{"clean", line.audio}};
  const std::size_t kinds = kNoises.size() + 2, count = kinds * kLevelsDb.size() + 1;
  for (const std::size_t which : {(5 * index + 1) % count, (5 * index + 11) % count}) {
    const double level = kLevelsDb[which % kLevelsDb.size()];
    const std::size_t kind = which / kLevelsDb.size();
    if (which + 1 == count)
      sounds.emplace_back("room", inRoom(line.audio, kReverberation, index + 1));
    else if (kind < kNoises.size())
      sounds.emplace_back(fmt::format("{}{:.0f}", noiseName(kNoises[kind]), level),
                          inNoise(line.audio, kNoises[kind], level, voices, index + 1));
    else
      sounds.emplace_back(fmt::format("{}{:.0f}", kind == kNoises.size() ? "white" : "pink", level),
                          withHiss(line.audio, kind != kNoises.size(), level, index + 1));
  }
  return sounds;
}

/// For each sound S NAME SET WHAT-IS-UNDER-IT TEXT, then T WHAT-WAS-HEARD and W of each warning, or E why nothing was;
/// tabs between. Of every `parts` lines one, from line `part` on.
void writeEvidence(const fs::path& takes, const std::vector<std::string>& sentences,
                   const std::vector<std::string>& known, std::size_t part, std::size_t parts) {
  std::vector<SaidLine> lines;
  addTakes(lines, takes);
  addVoices(lines, sentences);
  std::vector<AudioClip> babble;
  for (std::size_t i = 0; i < kBabble; ++i) babble.push_back(lines[i * lines.size() / kBabble].audio);
  const auto recogniser = makeRecogniser({.as = HearAs::kAuto, .hint = {}, .known = known});
  constexpr std::size_t kStride = 101;  // what is there when it is stopped is of all voices
  for (std::size_t k = part; k < lines.size(); k += parts) {
    const std::size_t i = k * kStride % lines.size();
    for (const auto& [under, sound] : soundsOf(lines[i], i, babble)) {
      fmt::print("S\t{}\t{}\t{}\t{}\n", lines[i].name, lines[i].set, under, lines[i].text);
      try {
        const HeardSpeech heard = recogniser->hear(sound, lines[i].name);
        fmt::print("T\t{}\n", heard.text);
        for (const std::string& warning : heard.warnings) fmt::print("W\t{}\n", warning);
      } catch (const InputError& error) {
        fmt::print("E\t{}\n", error.what());
      }
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fputs("usage: hearing_evidence GRID_TAKES SENTENCES KNOWN PART PARTS\n", stderr);
    return 2;
  }
  try {
    mouthpiece::writeEvidence(argv[1], mouthpiece::linesOf(argv[2]), mouthpiece::linesOf(argv[3]), std::stoul(argv[4]),
                              std::stoul(argv[5]));
  } catch (const mouthpiece::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
