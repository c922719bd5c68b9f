// synth --stream: sound, labels or text from standard input as they come; frames out.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <exception>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/counted.h"
#include "base/text_numbers.h"
#include "programs/outputs.h"
#include "programs/synth/commands.h"
#include "programs/synth/stream_ends.h"
#include "programs/synth/stream_words.h"

namespace mouthpiece {
namespace {

enum class StreamFormat { kJson, kRows, kLiveLink };
enum class StreamLabels { kNone, kPhones, kWords };

struct StreamOptions : SharedOptions {
  LiveOptions live;
  double look_ahead_ms = 200;
  bool is_float = false, is_stamped = false;
  StreamLabels labels = StreamLabels::kNone;
  std::string text_file, words_file;
  StreamFormat format = StreamFormat::kJson;
  StreamRows rows = StreamRows::kArkit;
  std::string to = "127.0.0.1:11111", subject = "Mouthpiece", sound_file;
  bool real_time = false;
  std::optional<double> delay_ms;
};

void addOptions(CLI::App& app, StreamOptions& options) {
  app.add_option("--pcm-rate", options.live.sample_rate_hz, "Sound on standard input: raw mono samples a second")
      ->check(CLI::Range(16000, 48000))
      ->capture_default_str();
  addChoice(app, "--pcm-format", options.is_float, {{"s16", false}, {"f32", true}},
            "Its samples, little-endian (default: s16)");
  auto* own_voice =
      app.add_flag("--own-voice", options.live.own_voice,
                   "Who speaks is the person whose takes the corpus holds: they tell how he says his phones");
  auto* stamped =
      app.add_flag("--stamped", options.is_stamped,
                   "Before each chunk of it stand its first sample's number (8 bytes) and its samples' count "
                   "(4 bytes), little-endian: what is lost, doubled or late is counted");
  auto* labels = app.add_option_function<std::string>(
      "--labels",
      [&options](const std::string& name) {
        if (name != "phones" && name != "words")
          throw CLI::ValidationError("--labels", "found '" + name + "'; expected phones|words");
        options.labels = name == "phones" ? StreamLabels::kPhones : StreamLabels::kWords;
      },
      "In place of sound: lines of START END PHONE [NUMBER OF ITS WORD], or START END WORD, in seconds");
  labels->type_name("phones|words")->excludes(stamped)->excludes(own_voice);
  auto* text =
      app.add_option("--text-file", options.text_file,
                     "In place of sound: text that the voice speaks sentence by sentence; - is standard input");
  text->excludes(labels)->excludes(stamped)->excludes(own_voice);
  app.add_option_function<std::string>(
         "--times",
         [&options](const std::string& file) {
           if (file == "-")
             throw CLI::ValidationError("--times", "found '-', where the sound is read; expected a file or a pipe");
           options.words_file = file;
         },
         "Beside the sound: the words that are said in it, lines of START END WORD in seconds as they come, a file or "
         "a named pipe")
      ->type_name("FILE")
      ->excludes(labels)
      ->excludes(stamped)
      ->excludes(own_voice)
      ->excludes(text);
  app.add_option("--look-ahead", options.look_ahead_ms, "Milliseconds that a frame knows of what follows, 50 to 5000")
      ->check(CLI::Range(50.0, 5000.0))
      ->capture_default_str();
  addChoice(app, "--as", options.format,
            {{"json", StreamFormat::kJson}, {"rows", StreamFormat::kRows}, {"livelink", StreamFormat::kLiveLink}},
            "json: a line a frame; rows: little-endian floats, the time before the values; livelink: Live Link Face's "
            "datagrams (default: json)");
  addChoice(app, "--rows", options.rows,
            {{"arkit", StreamRows::kArkit}, {"markers", StreamRows::kMarkers}, {"vertices", StreamRows::kVertices}},
            "What the rows hold (default: arkit)");
  app.add_option("--to", options.to, "Where the datagrams go")->capture_default_str();
  app.add_option("--subject", options.subject, "The face's name in them")->capture_default_str();
  app.add_option("--sound", options.sound_file, "The voice's sound, a WAV that grows")->needs(text);
  app.add_flag("--real-time", options.real_time,
               "A frame when its time comes, and one in which the mouth comes to rest where it is not known");
  app.add_option(
         "--delay", options.delay_ms,
         "With it: milliseconds that the first frame waits once it is known, so that what is told late is still "
         "in time (default: 0; with --labels as long as --look-ahead, with --times 700)")
      ->check(CLI::Range(0.0, 60000.0));
  addSharedOptions(app, options);
  checkOutputs(app, {{"--sound"}});
  for (const char* refused :
       {"--method", "--select", "--units", "--style", "--ma", "--ps", "--ja", "--li", "--strength", "--jaw", "--lips",
        "--hold", "--lead-ms", "--smooth", "--head-motion", "--mood", "--edits"})
    app.get_option(refused)->group("");  // a stream says why
}

std::unique_ptr<StreamOutput> outputFor(const StreamOptions& options) {
  switch (options.format) {
    case StreamFormat::kRows:
      return floatRows(options.rows);
    case StreamFormat::kLiveLink:
      return liveLinkPackets(options.to, options.speaker.manner.frame_rate_hz, options.subject);
    default:
      return jsonLines();
  }
}

std::vector<float> asFloats(const std::vector<std::int16_t>& samples) {
  std::vector<float> real(samples.size());
  std::transform(samples.begin(), samples.end(), real.begin(),
                 [](std::int16_t sample) { return static_cast<float>(sample) / 32768.0F; });
  return real;
}

/// Feeds a stream until the input ends. So much is made ahead of what is pulled, at most.
class StreamFeeder {
 public:
  StreamFeeder(const StreamOptions& options, LiveStream& stream) : options_(options), stream_(stream) {}

  void run() {
    if (!options_.text_file.empty()) {
      feedText();
    } else if (options_.labels != StreamLabels::kNone) {
      feedLabels();
    } else {
      if (!options_.words_file.empty())
        words_.emplace(options_.words_file, stream_, options_.live, options_.real_time, is_stopped_, options_.quiet);
      feedSound();
      if (words_) words_->finish();
      if (samples_ == 0 && !is_stopped_) throw InputError("stdin", "", "is empty; expected raw samples");
    }
    stream_.finish();
  }
  /// Once run() has returned: of the words beside sound; words and sentences that cannot be said; samples that came.
  [[nodiscard]] std::size_t wordsWithoutSound() const { return words_ ? words_->withoutSound() : 0; }
  [[nodiscard]] std::size_t leftOut() const { return words_ ? words_->leftOut() : unsaid_.count(); }
  [[nodiscard]] std::size_t samples() const { return samples_; }
  /// The other thread has given up.
  void stop() { is_stopped_ = true; }

 private:
  /// Waits while the frames are behind; false when nobody wants more.
  bool mayGoOn() const {
    constexpr double kAhead = 2.0;
    while (!is_stopped_ && stream_.saidUntil() > static_cast<double>(stream_.counts().frames) / stream_.frameRateHz() +
                                                     kAhead + options_.live.look_ahead)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    return !is_stopped_;
  }

  void feedText() {
    std::optional<GrowingWav> wav;
    if (!options_.sound_file.empty()) wav.emplace(options_.sound_file);
    SentenceReader sentences(options_.text_file, is_stopped_);
    bool any = false;
    while (const std::optional<std::string> sentence = sentences.next()) {
      any = true;
      try {
        stream_.say(*sentence, [&](Seconds begin, const Sound& piece) {
          if (wav) wav->write(piece, begin);
        });
        unsaid_.said();
      } catch (const InputError& error) {
        unsaid_.add(options_.text_file == "-" ? "stdin" : options_.text_file, sentences.lineNumber(), error,
                    options_.quiet);
      }
      if (!mayGoOn()) return;
    }
    unsaid_.expectAnySaid();
    if (!any) throw InputError(options_.text_file, "", "holds nothing that can be said");
  }

  void feedLabels() {
    InputLines lines("stdin", is_stopped_);
    std::vector<std::string> fields;
    while (const std::optional<std::string> line = lines.next()) {
      if (!splitLabel(*line, fields)) continue;
      const auto fail = [&](std::string_view what) {
        throw InputError("stdin", std::to_string(lines.lineNumber()), what);
      };
      const std::optional<double> start = parseNumber(fields[0]);
      const std::optional<double> end = fields.size() > 1 ? parseNumber(fields[1]) : std::nullopt;
      if (!start || !end || fields.size() < 3)
        fail("found '" + fields[0] + " ...'; expected START END NAME in seconds");
      const bool is_word = options_.labels == StreamLabels::kWords;
      try {
        if (is_word) {
          stream_.push(fields[2], TimeSpan{*start, *end});
          unsaid_.said();
        } else {
          LivePhone phone{fields[2], {*start, *end}};
          const std::optional<double> word = fields.size() > 3 ? parseNumber(fields[3]) : std::nullopt;
          if (word && *word >= 0 && *word < 1e9) phone.word = static_cast<std::size_t>(*word);
          stream_.push(phone);
        }
      } catch (const InputError& error) {
        if (!is_word || !isTime({*start, *end})) fail(error.what());
        unsaid_.add("stdin", lines.lineNumber(), error, options_.quiet);
      }
      if (!mayGoOn()) return;
    }
    unsaid_.expectAnySaid();
  }

  void feedSound() {
    InputBytes input("stdin", is_stopped_);
    const std::size_t sample_bytes = options_.is_float ? 4 : 2;
    constexpr std::size_t kAtOnce = 4096;
    std::string bytes = options_.is_stamped ? "" : input.exactly(kHeadBytes);
    expectRaw(bytes);
    bool is_over = bytes.empty();
    while (!is_over || options_.is_stamped) {
      std::optional<std::uint64_t> at;
      if (options_.is_stamped) {
        constexpr std::size_t kStamp = 12;
        constexpr std::uint64_t kMostSamples = 1 << 20;
        const std::string stamp = input.exactly(kStamp);
        if (stamp.empty()) return;
        const auto number = [&](std::size_t first, std::size_t count) {
          std::uint64_t value = 0;
          for (std::size_t i = count; i-- > 0;) value = value << 8U | static_cast<unsigned char>(stamp[first + i]);
          return value;
        };
        const std::uint64_t count = stamp.size() == kStamp ? number(8, 4) : kMostSamples + 1;
        if (count > kMostSamples)
          throw InputError("stdin", fmt::format("byte {}", input.offset() - stamp.size()),
                           "is no stamp of a chunk; expected its first sample's number and at most 1048576 samples");
        at = number(0, 8);
        bytes = input.exactly(count * sample_bytes);
        is_over = bytes.size() < count * sample_bytes;
      } else {
        const std::string more = input.some(kAtOnce - bytes.size());
        is_over = more.empty();
        bytes += more;
      }
      if (bytes.size() >= sample_bytes) push(bytes, at);
      bytes.erase(0, bytes.size() / sample_bytes * sample_bytes);
      if (!mayGoOn()) return;
      if (is_over && (options_.is_stamped || !bytes.empty()))
        throw InputError("stdin", fmt::format("byte {}", input.offset()),
                         options_.is_stamped ? "ends within a chunk" : "ends within a sample");
    }
  }

  /// Throws InputError for the head of a file that is no raw samples. MP3 without a tag looks like samples.
  static void expectRaw(std::string_view head) {
    constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kHeads{
        {{"RIFF", "a WAV"}, {"fLaC", "a FLAC"}, {"OggS", "an Ogg"}, {"ID3", "an MP3"}}};
    std::string_view kind = head.size() >= kHeadBytes && head.substr(4, 4) == "ftyp" ? "an M4A or MP4" : "";
    for (const auto& [begin, name] : kHeads) {
      if (head.starts_with(begin)) kind = name;
    }
    if (!kind.empty())
      throw InputError("stdin", "",
                       fmt::format("is {} file; expected raw samples, as `ffmpeg -i FILE -ac 1 -ar 16000 -f s16le -` "
                                   "writes them",
                                   kind));
  }

  void push(const std::string& bytes, std::optional<std::uint64_t> at) {
    samples_ += bytes.size() / (options_.is_float ? 4 : 2);
    const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
    if (options_.is_float) {
      std::vector<float> samples(bytes.size() / 4);
      for (std::size_t i = 0; i < samples.size(); ++i) {
        std::uint32_t bits = 0;
        for (std::size_t k = 4; k-- > 0;) bits = bits << 8U | data[4 * i + k];
        samples[i] = std::bit_cast<float>(bits);
      }
      if (words_) return words_->pushSound(samples);
      at ? stream_.push(std::span<const float>(samples), *at) : stream_.push(std::span<const float>(samples));
    } else {
      std::vector<std::int16_t> samples(bytes.size() / 2);
      for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(data[2 * i] | data[2 * i + 1] << 8));
      if (words_) return words_->pushSound(asFloats(samples));
      at ? stream_.push(std::span<const std::int16_t>(samples), *at)
         : stream_.push(std::span<const std::int16_t>(samples));
    }
  }

  const StreamOptions& options_;
  LiveStream& stream_;
  static constexpr std::size_t kHeadBytes = 8;

  std::optional<WordsBesideSound> words_;
  UnsaidWords unsaid_;
  std::size_t samples_ = 0;
  std::atomic<bool> is_stopped_ = false;
};

/// So long after the first frame is known it is shown. A frame is known once what is said a look-ahead after it is: a
/// label that comes as it begins comes that much after the frame. Words beside sound are told when they end, a long one
/// later than those before it.
double usualDelayMs(const StreamOptions& options) {
  constexpr double kDelayOfWordsMs = 700;
  if (!options.words_file.empty()) return kDelayOfWordsMs;
  return options.labels != StreamLabels::kNone ? options.look_ahead_ms : 0;
}

/// Frames as they are known, or each at its time.
void writeFrames(LiveStream& stream, StreamOutput& output, const StreamOptions& options) {
  const bool real_time = options.real_time;
  const std::chrono::duration<double, std::milli> delay(options.delay_ms.value_or(usualDelayMs(options)));
  using Clock = std::chrono::steady_clock;
  std::optional<Clock::time_point> begun;
  std::size_t written = 0;
  while (!stream.isFinished()) {
    if (begun) {
      const double seconds = static_cast<double>(written) / stream.frameRateHz();
      std::this_thread::sleep_until(
          *begun + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)));
    }
    const Frame* frame = begun ? stream.nextNow() : stream.next();
    if (frame == nullptr) {
      std::fflush(stdout);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      continue;
    }
    if (real_time && !begun) {
      std::this_thread::sleep_for(delay);
      begun = Clock::now();
    }
    output.write(*frame);
    ++written;
    if (real_time) std::fflush(stdout);
  }
}

void tellCounts(const LiveCounts& counts, const StreamFeeder& feeder, const StreamOptions& options) {
  const auto warn = [&](const std::string& what) { printNotice("warning: " + what, options.quiet); };
  if (counts.words_missed > 0)
    warn(
        fmt::format("words were not heard {} times in which the network failed or took too long; phones were heard "
                    "there",
                    counts.words_missed));
  if (feeder.wordsWithoutSound() > 0)
    warn(
        fmt::format("words that were said before all their sound had come: {}; their phones are as long as they "
                    "usually are",
                    feeder.wordsWithoutSound()));
  constexpr double kManyUnusable = 0.01;
  if (static_cast<double>(counts.unusable_samples) > kManyUnusable * static_cast<double>(feeder.samples()))
    warn(fmt::format("{} of {} samples are no numbers from -1 to 1; expected the samples that --pcm-format says",
                     counts.unusable_samples, feeder.samples()));
  if (options.json) {
    const nlohmann::json facts{{"frames", counts.frames},
                               {"frames_at_rest", counts.frames_at_rest},
                               {"chunks", counts.chunks},
                               {"dropped", counts.dropped},
                               {"late", counts.late},
                               {"doubled", counts.doubled},
                               {"restarts", counts.restarts},
                               {"unusable_samples", counts.unusable_samples},
                               {"missing_s", counts.missing},
                               {"words_missed", counts.words_missed},
                               {"words_without_sound", feeder.wordsWithoutSound()},
                               {"left_out", feeder.leftOut()}};
    std::fputs((facts.dump() + "\n").c_str(), stderr);
    return;
  }
  std::string told =
      fmt::format("{}, {} at rest for want of input; {}, {} lost, {} late, {} doubled", counted(counts.frames, "frame"),
                  counts.frames_at_rest, counted(counts.chunks, "chunk"), counts.dropped, counts.late, counts.doubled);
  if (counts.missing > 0) told += fmt::format(", {:.2f} s missing", counts.missing);
  if (counts.restarts > 0) told += fmt::format(", {} of the sender's clock", counted(counts.restarts, "restart"));
  if (counts.unusable_samples > 0) told += fmt::format(", {}", counted(counts.unusable_samples, "unusable sample"));
  if (feeder.leftOut() > 0)
    told +=
        fmt::format("; {} left out", feeder.leftOut() == 1 ? "1 word or sentence"
                                                           : fmt::format("{} words or sentences", feeder.leftOut()));
  printNotice(told, options.quiet);
}

int runStream(const StreamOptions& given) {
  StreamOptions options = given;
  options.speaker = speakerOf(given);
  options.live.look_ahead = options.look_ahead_ms / 1000;
  if (options.labels != StreamLabels::kNone || !options.words_file.empty())
    options.live.source = LiveOptions::Source::kLabels;
  if (!options.text_file.empty()) options.live.source = LiveOptions::Source::kText;
  options.speaker.with_face = options.format == StreamFormat::kRows && options.rows == StreamRows::kVertices;
  options.live.arkit = options.format != StreamFormat::kRows || options.rows == StreamRows::kArkit;
  if (options.delay_ms && !options.real_time)
    throw InputError("--delay", "", "has nothing to delay; expected --real-time beside it");
  if (options.text_file != "-" && options.text_file.empty() && isatty(STDIN_FILENO) != 0)
    throw InputError("stdin", "", "is a terminal; expected sound, or labels with --labels");
  const Speaker speaker(options.speaker);
  LiveStream stream = speaker.live(options.live);
  const std::unique_ptr<StreamOutput> output = outputFor(options);
  StreamFeeder feeder(options, stream);
  std::exception_ptr failed;
  std::thread feeding([&] {
    try {
      feeder.run();
    } catch (...) {
      failed = std::current_exception();
      try {
        stream.finish();  // what came before is shown
      } catch (...) {
        std::terminate();
      }
    }
  });
  try {
    writeFrames(stream, *output, options);
  } catch (...) {
    feeder.stop();
    feeding.join();
    throw;
  }
  feeding.join();
  std::fflush(stdout);
  if (failed) std::rethrow_exception(failed);
  tellCounts(stream.counts(), feeder, options);
  return kExitDone;
}

}  // namespace

Command streamCommand() {
  return makeCommand<StreamOptions>("stream", "Moves a face while the line is being said (also: synth --stream).",
                                    "arecord -f S16_LE -r 16000 -t raw | synth --stream --as livelink --real-time\n"
                                    "synth --stream --text-file - --voice flite:slt --sound talk.wav < book.txt\n"
                                    "synth --stream --labels phones < phones.txt\n"
                                    "synth --stream --times words.txt < talk.raw",
                                    addOptions, runStream);
}

}  // namespace mouthpiece
