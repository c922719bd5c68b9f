// Not a benchmark: writes what tools/fit_doubt.py learns from, how right and wrong texts fit the sounds of GRID s1's
// takes and of voices, in silence and in noise.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

#include "audio/audio_clip.h"
#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/index.h"
#include "base/parallel_for.h"
#include "corpus_tools/research/evaluation/noises.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/phone_decoder.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/text_doubt.h"
#include "phonetics/labels/label_files.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<TranscriptWord>;

constexpr std::size_t kGridEvery = 4, kLinesAVoice = 14, kBabble = 10, kThreads = 2;

/// A sound and the ways to write its words.
struct SaidLine {
  std::string name, set;
  AudioClip audio;
  std::vector<Words> writings;
};

/// A text, and of each word whether it is said (1), is not (0), is another line's that this line has, too (2), or
/// stands where others were cut off (3).
struct TriedText {
  std::string kind;
  Words words;
  std::vector<int> truth;
};

/// Said as the labels have them.
Words asLabelled(const SpeechLabels& labels) {
  Words words;
  for (const LabelledWord& word : labels.words) {
    Pronunciation way;
    for (std::size_t i = word.phones.first.value; i <= word.phones.last.value; ++i) {
      if (labels.phones[i].phone != Phone::kSil) way.phones.push_back(labels.phones[i].phone);
    }
    way.stress.assign(way.phones.size(), -1);
    if (!way.phones.empty()) words.push_back({word.text, {way}});
  }
  return words;
}

/// Of every four takes (counted from 0) the second and the last to fit, the first to judge.
std::vector<SaidLine> linesOfGrid(const fs::path& folder, const Pronouncer& pronouncer) {
  std::vector<fs::path> takes;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".wav") takes.push_back(entry.path());
  }
  std::sort(takes.begin(), takes.end());
  std::vector<SaidLine> lines;
  for (std::size_t i = 0; i < takes.size(); ++i) {
    if (i % kGridEvery == 2) continue;
    std::string text;
    std::ifstream file(fs::path(takes[i]).replace_extension(".txt"));
    std::getline(file, text);
    lines.push_back(
        {takes[i].stem().string(),
         i % kGridEvery != 0 ? "grid_fit" : "grid_judge",
         readAudio(takes[i]),
         {pronouncer.wordsOf(text), asLabelled(readLabels(fs::path(takes[i]).replace_extension(".TextGrid"), {}))}});
  }
  return lines;
}

/// Voices and the sentences that they say: even ones of `prompts` to fit, odd ones to judge.
void addVoices(std::vector<SaidLine>& lines, const fs::path& prompts, const Pronouncer& pronouncer) {
  const std::vector<std::pair<std::string, bool>> voices{
      {"festival:cmu_us_slt_arctic_hts", true}, {"flite:slt", true},    {"flite:awb", true},  {"espeak:en-us", true},
      {"festival:kal_diphone", false},          {"flite:kal16", false}, {"flite:rms", false}, {"espeak:en-gb", false}};
  std::vector<std::string> sentences;
  std::ifstream file(prompts);
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line.front() != '#') sentences.push_back(line);
  }
  if (sentences.empty()) throw InputError(prompts.string(), "", "holds no sentences");
  for (std::size_t v = 0; v < voices.size(); ++v) {
    const auto& [name, fits] = voices[v];
    const auto voice = makeVoice(name);
    for (std::size_t k = 0; k < kLinesAVoice; ++k) {
      const std::size_t at = (2 * (7 * k + 3 * v) + (fits ? 0 : 1)) % sentences.size();
      lines.push_back({fmt::format("{}/{}", name, at),
                       fits ? "voices_fit" : "voices_judge",
                       voice->speak(sentences[at]).audio,
                       {pronouncer.wordsOf(sentences[at])}});
    }
  }
}

/// The right text of line `index` and four wrong ones.
std::vector<TriedText> textsFor(const std::vector<SaidLine>& lines, std::size_t index, std::size_t writing) {
  const Words& own = lines[index].writings[writing];
  std::vector<const Words*> others;  // of the same set, from this line on
  for (std::size_t away = 1; away < lines.size(); ++away) {
    const SaidLine& line = lines[(index + away) % lines.size()];
    if (line.set == lines[index].set) others.push_back(&line.writings[writing]);
  }
  const auto isSaid = [&](const TranscriptWord& word) {
    return std::any_of(own.begin(), own.end(), [&](const TranscriptWord& said) {
      return said.ways.front().phones == word.ways.front().phones;
    });
  };
  std::vector<TriedText> texts{{"right", own, std::vector<int>(own.size(), 1)}};
  TriedText other{"other", *others[others.size() / 2], {}};
  for (const TranscriptWord& word : other.words) other.truth.push_back(isSaid(word) ? 2 : 0);
  const std::size_t third = std::max<std::size_t>(1, own.size() / 3);
  TriedText cut{"cut", {own.begin(), own.end() - signedIndex(third)}, std::vector<int>(own.size() - third, 1)};
  cut.truth.back() = 3;
  TriedText late{"cutfront", {own.begin() + signedIndex(third), own.end()}, std::vector<int>(own.size() - third, 1)};
  late.truth.front() = 3;
  for (std::size_t variant = 0; variant < 2; ++variant) {
    TriedText changed{"changed", own, std::vector<int>(own.size(), 1)};
    const std::size_t count = std::max<std::size_t>(1, own.size() / 5);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t at = (index + 3 * variant + k * own.size() / count) % own.size();
      for (std::size_t away = 0; away < others.size(); ++away) {
        const Words& line = *others[(7 * away + k) % others.size()];
        const TranscriptWord& word = line[(index + away + 3 * variant) % line.size()];
        if (word.ways.front().phones == own[at].ways.front().phones) continue;
        changed.words[at] = word;
        changed.truth[at] = 0;
        break;
      }
    }
    texts.push_back(changed);
  }
  texts.insert(texts.end(), {other, cut, late});
  return texts;
}

/// A sound as it is and in two noises or a room, others from line to line.
std::vector<std::pair<std::string, AudioClip>> soundsOf(const SaidLine& line, std::size_t index,
                                                        const std::vector<AudioClip>& voices) {
  constexpr Seconds kReverberation = 0.4;
  constexpr std::array<double, 3> kLevelsDb{20, 10, 5};
  std::vector<std::pair<std::string, AudioClip>> sounds{{"clean", line.audio}};
  const std::size_t count = kNoises.size() * kLevelsDb.size() + 1;
  for (const std::size_t which : {3 * (index / 2) % count, (3 * (index / 2) + 5) % count}) {
    if (which + 1 == count) {
      sounds.emplace_back("room", inRoom(line.audio, kReverberation, index + 1));
    } else {
      const Noise noise = kNoises[which / kLevelsDb.size()];
      const double level = kLevelsDb[which % kLevelsDb.size()];
      sounds.emplace_back(fmt::format("{}{:.0f}", noiseName(noise), level),
                          inNoise(line.audio, noise, level, voices, index + 1));
    }
  }
  return sounds;
}

std::string evidenceOf(PhoneDecoder& decoder, const TriedText& text, std::span<const std::int16_t> samples) {
  WordWays ways;
  for (const TranscriptWord& word : text.words) {
    auto& own = ways.emplace_back();
    for (const Pronunciation& way : word.ways) own.push_back(way.phones);
  }
  const std::vector<DecodedPhone> decoded = decoder.decode(samples, ways);
  std::string rows = fmt::format("U {}\n", text.kind);
  int word = -1;
  for (const DecodedPhone& phone : decoded) {
    const bool is_silence = phone.phone == Phone::kSil;
    if (!is_silence && phone.opens_word) ++word;
    rows += fmt::format("P {} {} {} {} {} {:.0f}\n", is_silence ? -1 : word,
                        is_silence ? 1 : text.truth[unsignedIndex(word)], static_cast<int>(phone.phone),
                        phone.first_frame, phone.frames, phone.score);
  }
  return rows;
}

/// -20 log of each posterior, a byte; a frame's phones side by side.
std::string asBytes(const Eigen::MatrixXf& posteriors) {
  std::string bytes;
  for (const float posterior : posteriors.reshaped()) {
    const long level = std::lround(-20 * std::log(std::max(posterior, 1e-9F)));
    bytes += static_cast<char>(static_cast<unsigned char>(std::clamp(level, 0L, 255L)));
  }
  return bytes;
}

/// For each sound S NAME SET WHAT-IS-UNDER-IT NOISE UNSTEADY FRAMES BYTES, the posteriors, and in so many bytes rows: U
/// KIND, then P WORD TRUTH PHONE FIRST-FRAME FRAMES SCORE of each phone (WORD -1: a silence).
void writeEvidence(const fs::path& takes, const fs::path& prompts, const fs::path& output) {
  const Pronouncer pronouncer;
  std::vector<SaidLine> lines = linesOfGrid(takes, pronouncer);
  addVoices(lines, prompts, pronouncer);
  std::vector<AudioClip> voices;
  for (std::size_t i = 0; i < kBabble; ++i)
    voices.push_back(resampleAudio(lines[i * lines.size() / kBabble].audio, kDecoderSampleRateHz));
  std::ofstream file(output, std::ios::binary);
  std::mutex writing_out;
  parallelFor(kThreads, kThreads, [&](std::size_t thread) {
    PhoneDecoder decoder({}, english());
    TextDoubt doubt(decoder, english());
    for (std::size_t i = thread; i < lines.size(); i += kThreads) {
      for (const auto& [under, sound] : soundsOf(lines[i], i, voices)) {
        const std::vector<std::int16_t> samples = samplesToHear(sound);
        const Background background = doubt.backgroundOf(samples);
        const Eigen::MatrixXf posteriors = doubt.posteriorsOf(samples);
        std::string rows;
        for (const TriedText& text : textsFor(lines, i, i / 2 % 2 % lines[i].writings.size()))
          rows += evidenceOf(decoder, text, samples);
        const std::scoped_lock lock(writing_out);
        file << fmt::format("S {} {} {} {:.4f} {:.4f} {} {}\n", lines[i].name, lines[i].set, under, background.noise,
                            background.unsteady, posteriors.cols(), rows.size())
             << asBytes(posteriors) << rows << std::flush;
      }
    }
  });
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("usage: doubt_evidence GRID_TAKES PROMPTS OUT\n", stderr);
    return 2;
  }
  try {
    mouthpiece::writeEvidence(argv[1], argv[2], argv[3]);
  } catch (const mouthpiece::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
