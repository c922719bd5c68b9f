// Not a benchmark: how far the lips of a stream of sound lie from those of the same recording by file, and what makes
// the difference, part by part (docs/theory/units/live.md#how-near-it-is-to-the-whole-line).
//   stream_parts CORPUS LOOK_AHEAD_S SOUND.wav...         OWN_VOICE=1: the corpus' speaker speaks, too
//   AFTER=4 stream_parts CORPUS LOOK_AHEAD_S SOUND.wav... the four sounds before it in the list come before each
//   stream_parts --told CORPUS LOOK_AHEAD_S SOUND.wav...  phones, words or text are told, of a transcript beside each
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "corpus_tools/takes/lip_measures.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/live/live_ear.h"
#include "mouthpiece/mouthpiece.h"
#include "mouthpiece/speaker.h"
#include "speaker/speaker_data.h"
#include "streamed_labels.h"

namespace mouthpiece {
namespace {

/// A look-ahead in which all of a line is known.
constexpr Seconds kWhole = 5;

/// What `stream` gives from `begin` on once everything was pushed.
MotionClip pulledFrom(LiveStream& stream, const std::vector<std::string>& markers, Seconds begin = 0) {
  std::vector<double> rows;
  std::size_t frames = 0;
  for (stream.finish(); const Frame* frame = stream.next();) {
    if (frame->time < begin - 1e-6) continue;
    rows.insert(rows.end(), frame->markers_mm.begin(), frame->markers_mm.end());
    ++frames;
  }
  const Eigen::Index columns = std::ssize(rows) / signedIndex(std::max<std::size_t>(1, frames));
  return {stream.frameRateHz(), markers, Eigen::Map<PositionMatrix>(rows.data(), signedIndex(frames), columns)};
}

/// The motion of phones that are known `look_ahead` before they are said.
MotionClip followed(const Speaker& speaker, const SpeechLabels& labels, Seconds look_ahead,
                    const std::vector<std::string>& markers) {
  LiveStream stream = speaker.live({.look_ahead = look_ahead, .source = LiveOptions::Source::kLabels});
  pushLabels(stream, labels);
  return pulledFrom(stream, markers);
}

/// What the stream of a sound shows, which `before` comes before without a pause.
MotionClip heardOn(const Speaker& speaker, std::span<const float> before, const AudioClip& audio, Seconds look_ahead,
                   bool own_voice, const std::vector<std::string>& markers) {
  LiveStream stream = speaker.live({.look_ahead = look_ahead, .sample_rate_hz = 16000, .own_voice = own_voice});
  stream.push(before);
  stream.push(audio.samples);
  return pulledFrom(stream, markers, asReal(before.size()) / 16000);
}

/// The `count` sounds before number `sound`, or the last ones, one after the other, to whole 0.2 s: a frame and a hop
/// of the ear begin where they end.
std::vector<float> soundsBefore(std::size_t sound, std::size_t count, const std::vector<std::string>& sounds) {
  constexpr std::size_t kEven = 3200;
  std::vector<float> all;
  for (std::size_t i = std::min(count, sounds.size() - 1); i > 0; --i) {
    const AudioClip audio = resampleAudio(readAudio(sounds[(sound + sounds.size() - i) % sounds.size()]), 16000);
    all.insert(all.end(), audio.samples.begin(), audio.samples.end());
  }
  all.resize(all.size() / kEven * kEven);
  return all;
}

/// What LiveEar settles after `before`, to the end of the sound.
SpeechLabels settledBy(LiveEar& ear, std::span<const float> before, const AudioClip& audio) {
  constexpr std::size_t kMore = 50;  // hops: two seconds more settle all
  AudioClip whole{audio.sample_rate_hz, {before.begin(), before.end()}};
  const Seconds begin = whole.duration();
  whole.samples.insert(whole.samples.end(), audio.samples.begin(), audio.samples.end());
  std::vector<std::int16_t> samples = samplesToHear(whole);
  samples.resize((samples.size() / LiveEar::kHop + kMore) * LiveEar::kHop);
  std::vector<PhoneSegment> heard;
  for (std::size_t at = 0; at < samples.size(); at += LiveEar::kHop) {
    for (PhoneSegment& phone : ear.hear(std::span(samples).subspan(at, LiveEar::kHop))) {
      phone.span = {std::max(phone.span.start - begin, 0.0), std::min(phone.span.end - begin, audio.duration())};
      if (phone.phone != Phone::kSil && phone.span.duration() > 0) heard.push_back(phone);
    }
  }
  return buildSpeechLabels(heard, std::vector<std::string>{}, audio.duration(), english());
}

/// Sums over lines of one part.
struct Part {
  std::string name;
  double squared = 0, said_squared = 0, count = 0, said_count = 0, worst = 0;
  LipMeasures lips{};

  void add(const MotionClip& whole, const MotionClip& other, const SpeechLabels& labels, const MarkerLayout& layout) {
    const Seconds first = labels.phones.size() > 1 ? labels.phones[1].span.start : 0;
    double own = 0, own_count = 0;
    for (std::size_t frame = 0; frame < std::min(whole.frameCount(), other.frameCount()); ++frame) {
      for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
        if (layout.markers[marker].region != "lip") continue;
        const auto row = signedIndex(frame), column = signedIndex(3 * marker);
        const double d =
            (whole.positions_mm.block<1, 3>(row, column) - other.positions_mm.block<1, 3>(row, column)).squaredNorm();
        own += d;
        own_count += 1;
        if (asReal(frame) / whole.frame_rate_hz < first) continue;
        said_squared += d;
        said_count += 1;
      }
    }
    squared += own;
    count += own_count;
    worst = std::max(worst, std::sqrt(own / std::max(own_count, 1.0)));
    lips += measureLips(whole, other, labels, layout);
  }
  void print() const {
    fmt::print("{:<46} {:5.2f} {:5.2f} {:5.2f} {:6.3f} {:4} of {:<4} {:5.1f} %\n", name, std::sqrt(squared / count),
               worst, std::sqrt(said_squared / said_count), lips.openingCorrelation(), lips.closures_kept,
               lips.closures, 100 * lips.falseClosureShare());
  }
};

void run(const std::string& corpus_file, Seconds look_ahead, const std::vector<std::string>& sounds) {
  SpeakerOptions options;
  options.corpus = corpus_file;
  options.with_face = false;
  Speaker speaker(options);
  options.hear = SpeakerOptions::Hear::kPhones;
  Speaker by_phones(options);
  const SharedCorpus corpus{std::filesystem::path(corpus_file)};
  const MarkerLayout& layout = corpus.data().corpus.layout;
  const std::vector<std::string> markers = layout.markerNames();
  std::vector<Part> parts{{"the stream, from the file"},
                          {"of it: the sound told the file's motion"},
                          {"the file's words (its own phones whole)"},
                          {"the ear (its phones whole, from the file's)"},
                          {"the motion's future (the file's labels)"},
                          {"the motion's future and guess (ear's whole)"},
                          {"the stream, from the file by phones"},
                          {"own voice, from the file"}};
  const bool own_voice = std::getenv("OWN_VOICE") != nullptr;
  const char* after = std::getenv("AFTER");
  for (std::size_t number = 0; number < sounds.size(); ++number) {
    const std::string& sound = sounds[number];
    const std::vector<float> before = soundsBefore(number, after != nullptr ? std::stoul(after) : 0, sounds);
    const AudioClip audio = resampleAudio(readAudio(sound), 16000);
    const Performance file = speaker.perform(Line::heard(sound));
    const SpeechLabels labels = file.data().animation.labels;
    const SpeechLabels phones = by_phones.perform(Line::heard(sound)).data().animation.labels;
    LiveEar ear(english(), {}, look_ahead);
    const SpeechLabels settled = settledBy(ear, before, audio);
    const MotionClip whole = file.data().clip();
    const MotionClip labelled = followed(speaker, labels, kWhole, markers);
    const MotionClip of_phones = followed(speaker, phones, kWhole, markers);
    const MotionClip of_ear = followed(speaker, settled, kWhole, markers);
    const MotionClip stream = heardOn(speaker, before, audio, look_ahead, false, markers);
    parts[0].add(whole, stream, labels, layout);
    parts[1].add(whole, labelled, labels, layout);
    parts[2].add(labelled, of_phones, labels, layout);
    parts[3].add(of_phones, of_ear, phones, layout);
    parts[4].add(labelled, followed(speaker, labels, look_ahead, markers), labels, layout);
    parts[5].add(of_ear, stream, settled, layout);
    parts[6].add(of_phones, stream, phones, layout);
    if (own_voice) parts[7].add(whole, heardOn(speaker, before, audio, look_ahead, true, markers), labels, layout);
  }
  fmt::print("{:<46}    mm worst  said      r closures false\n",
             fmt::format("{} sounds, {} s ahead", sounds.size(), look_ahead));
  for (const Part& part : parts) {
    if (part.count > 0) part.print();
  }
}

/// The motion of words that are known `look_ahead` before they are said; with their `sound`, where there is one.
MotionClip followedByWord(const Speaker& speaker, const SpeechLabels& labels, Seconds look_ahead,
                          const std::vector<std::string>& markers, const AudioClip* sound = nullptr) {
  LiveStream stream = speaker.live({.look_ahead = look_ahead, .source = LiveOptions::Source::kLabels});
  constexpr Seconds kBehind = 0.1;  // a word is known so long after its end
  std::size_t come = 0;
  for (const LabelledWord& word : labels.words) {
    const TimeSpan span = labels.spanOf(word.phones);
    if (sound != nullptr) {
      const auto until =
          std::min(sound->samples.size(), static_cast<std::size_t>((span.end + kBehind) * sound->sample_rate_hz));
      stream.pushSoundOfWords(std::span(sound->samples).subspan(come, until - come));
      come = until;
    }
    stream.push(word.text, span);
  }
  stream.silence(labels.duration());
  return pulledFrom(stream, markers);
}

/// What streams that are told phones, words or text lie from the same line by file. Each sound has its transcript in a
/// .txt beside it.
void runTold(const std::string& corpus_file, Seconds look_ahead, const std::vector<std::string>& sounds) {
  SpeakerOptions options;
  options.corpus = corpus_file;
  options.with_face = false;
  Speaker speaker(options);
  const SharedCorpus corpus{std::filesystem::path(corpus_file)};
  const MarkerLayout& layout = corpus.data().corpus.layout;
  const std::vector<std::string> markers = layout.markerNames();
  std::vector<Part> parts{{"phones and times, from the recording by file"},
                          {"words and times, from the recording by file"},
                          {"the same, all known"},
                          {"words, times and sound, from it by file"},
                          {"text that the voice says, from it by file"}};
  for (const std::string& sound : sounds) {
    const std::string text = readFile(std::filesystem::path(sound).replace_extension(".txt"));
    const Performance file = speaker.perform(Line::recorded(sound, text));
    const SpeechLabels labels = file.data().animation.labels;
    const MotionClip whole = file.data().clip();
    parts[0].add(whole, followed(speaker, labels, look_ahead, markers), labels, layout);
    parts[1].add(whole, followedByWord(speaker, labels, look_ahead, markers), labels, layout);
    parts[2].add(whole, followedByWord(speaker, labels, kWhole, markers), labels, layout);
    const AudioClip audio = resampleAudio(readAudio(sound), 16000);
    parts[3].add(whole, followedByWord(speaker, labels, look_ahead, markers, &audio), labels, layout);
    const Performance typed = speaker.perform(Line::typed(text));
    LiveStream stream = speaker.live({.look_ahead = look_ahead, .source = LiveOptions::Source::kText});
    static_cast<void>(stream.say(text));
    parts[4].add(typed.data().clip(), pulledFrom(stream, markers), typed.data().animation.labels, layout);
  }
  fmt::print("{:<46}    mm worst  said      r closures false\n",
             fmt::format("{} sounds, {} s ahead", sounds.size(), look_ahead));
  for (const Part& part : parts) part.print();
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) {
  const bool is_told = argc > 1 && std::string_view(argv[1]) == "--told";
  argv += is_told ? 1 : 0;
  argc -= is_told ? 1 : 0;
  if (argc < 4) {
    fmt::print(stderr, "usage: stream_parts [--told] CORPUS LOOK_AHEAD_S SOUND.wav...\n");
    return EXIT_FAILURE;
  }
  try {
    (is_told ? mouthpiece::runTold : mouthpiece::run)(argv[1], std::stod(argv[2]), {argv + 3, argv + argc});
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
