#include "corpus_tools/research/evaluation/hearing_trials.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "hearing/recognition/recogniser.h"
#include "phonetics/labels/labels_builder.h"
#include "phonetics/labels/likely_words.h"

namespace mouthpiece {
namespace {

std::vector<std::string> phonesOf(const SpeechLabels& labels, bool as_visemes) {
  std::vector<std::string> names;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil) continue;
    names.emplace_back(as_visemes ? visemeName(firstViseme(phone.phone)) : phoneName(phone.phone));
  }
  return names;
}

std::vector<std::string> wordsOf(const SpeechLabels& labels) {
  std::vector<std::string> words;
  for (const LabelledWord& word : labels.words) {
    std::string text = lowerCase(word.text);
    // A letter's name is written "a." by the recogniser.
    std::erase_if(text, [](char c) { return c == '.' || c == ','; });
    if (!text.empty()) words.push_back(std::move(text));
  }
  return words;
}

/// As a person's recording is animated.
SynthesisOptions guidedOptions() {
  SynthesisOptions options;
  options.selection.method = SelectionMethod::kViterbi;
  options.context.hear = true;
  return options;
}

/// One way of hearing and what it makes of takes.
class Listener {
 public:
  Listener(const RecogniserOptions& options, std::vector<HearingScore>& scores, std::string way)
      : recogniser_(makeRecogniser(options)), scores_(scores) {
    const auto known =
        std::find_if(scores.begin(), scores.end(), [&](const HearingScore& row) { return row.way == way; });
    index_ = static_cast<std::size_t>(known - scores.begin());
    if (known == scores.end()) scores.push_back(HearingScore{std::move(way), {}, {}, {}, 0, 0, 0, 0});
  }

  /// The take with the labels that are heard in its sound.
  CorpusTake hear(const CorpusTake& take) {
    CorpusTake heard = take;
    HearingScore& score = scores_[index_];
    const auto started = std::chrono::steady_clock::now();
    try {
      heard.labels = recogniser_->hear(take.audio, take.name).labels;
    } catch (const InputError&) {
      ++score.unheard;
      heard.labels = buildSpeechLabels({}, std::vector<std::string>{}, take.labels.duration());
    }
    score.time_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    score.sound_s += take.audio.duration();
    ++score.takes;
    score.phones += hearingErrors(phonesOf(take.labels, false), phonesOf(heard.labels, false));
    score.visemes += hearingErrors(phonesOf(take.labels, true), phonesOf(heard.labels, true));
    score.words += hearingErrors(wordsOf(take.labels), wordsOf(heard.labels));
    return heard;
  }

 private:
  std::unique_ptr<Recogniser> recogniser_;
  std::vector<HearingScore>& scores_;
  std::size_t index_ = 0;
};

}  // namespace

double HearingErrors::rate() const {
  return right > 0 ? static_cast<double>(exchanged + left_out + put_in) / static_cast<double>(right) : std::nan("");
}

HearingErrors& HearingErrors::operator+=(const HearingErrors& other) {
  right += other.right;
  exchanged += other.exchanged;
  left_out += other.left_out;
  put_in += other.put_in;
  return *this;
}

HearingErrors hearingErrors(const std::vector<std::string>& right, const std::vector<std::string>& heard) {
  struct Cell {
    HearingErrors errors;
    [[nodiscard]] std::size_t count() const { return errors.exchanged + errors.left_out + errors.put_in; }
  };
  std::vector<Cell> row(heard.size() + 1), next(heard.size() + 1);
  for (std::size_t j = 0; j <= heard.size(); ++j) row[j].errors.put_in = j;
  for (std::size_t i = 0; i < right.size(); ++i) {
    next[0] = row[0];
    ++next[0].errors.left_out;
    for (std::size_t j = 0; j < heard.size(); ++j) {
      Cell exchanged = row[j], left_out = row[j + 1], put_in = next[j];
      exchanged.errors.exchanged += right[i] == heard[j] ? 0U : 1U;
      ++left_out.errors.left_out;
      ++put_in.errors.put_in;
      next[j + 1] = exchanged.count() <= left_out.count() ? exchanged : left_out;
      if (put_in.count() < next[j + 1].count()) next[j + 1] = put_in;
    }
    std::swap(row, next);
  }
  HearingErrors errors = row[heard.size()].errors;
  errors.right = right.size();
  return errors;
}

EvaluationMethods hearingMethods(std::vector<HearingScore>& scores, const std::string& hint,
                                 const std::shared_ptr<WordNetwork>& word_network) {
  return [&scores, hint, word_network](const Corpus& corpus, const UnitDatabase& database) {
    std::vector<EvaluationMethod> methods{unitMethod("guided (labels)", database, guidedOptions())};
    std::vector<std::string> lines;
    std::vector<LabelledSound> sounds;
    const auto likely = std::make_shared<LikelyWords>();
    for (const CorpusTake& take : corpus.takes) {
      lines.push_back(take.text);
      sounds.push_back({take.audio, take.labels});
      likely->add(take.labels);
    }
    const SpeakerSounds speaker = soundsAmong(std::move(sounds));
    const auto add = [&](const std::string& way, RecogniserOptions options) {
      options.word_network = word_network;
      const auto listener = std::make_shared<Listener>(options, scores, way);
      const EvaluationMethod from_labels = unitMethod(way, database, guidedOptions());
      methods.push_back({way, [listener, from_labels, likely](const CorpusTake& take, EvaluationRow& row) {
                           CorpusTake heard = listener->hear(take);
                           heard.labels = likely->complete(heard.labels);
                           return from_labels.animate(heard, row);
                         }});
    };
    add("heard (corpus' lines)", {.as = HearAs::kAuto, .hint = {}, .known = lines, .speaker = speaker});
    if (!hint.empty()) add("heard (hint)", {.as = HearAs::kAuto, .hint = hint, .speaker = speaker});
    add("heard (no line known)", {.as = HearAs::kAuto, .hint = {}, .speaker = speaker});
    add("heard (phones)", {.as = HearAs::kPhones, .hint = {}, .speaker = speaker});
    add("heard (nothing known)", {.as = HearAs::kAuto, .hint = {}});
    return methods;
  };
}

std::string hearingTable(const std::vector<HearingScore>& scores) {
  std::string table = fmt::format("\n{:34} {:>8} {:>8} {:>8} {:>8} {:>12}\n", "heard", "phones", "visemes", "words",
                                  "unheard", "x real time");
  for (const HearingScore& score : scores) {
    if (score.takes == 0) continue;  // a way that was not asked for
    table +=
        fmt::format("{:34} {:>7.1f}% {:>7.1f}% {:>7.1f}% {:>8} {:>12.3f}\n", score.way, 100 * score.phones.rate(),
                    100 * score.visemes.rate(), 100 * score.words.rate(), score.unheard, score.time_s / score.sound_s);
  }
  return table + "errors: exchanged, left out and put in, over the right ones\n";
}

std::string hearingJson(const std::vector<HearingScore>& scores) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  const auto fields = [](const HearingErrors& errors) -> nlohmann::ordered_json {
    return {{"right", errors.right},
            {"exchanged", errors.exchanged},
            {"left_out", errors.left_out},
            {"put_in", errors.put_in},
            {"rate", errors.rate()}};
  };
  for (const HearingScore& score : scores) {
    if (score.takes == 0) continue;
    rows.push_back({{"way", score.way},
                    {"takes", score.takes},
                    {"unheard", score.unheard},
                    {"phones", fields(score.phones)},
                    {"visemes", fields(score.visemes)},
                    {"words", fields(score.words)},
                    {"real_time_factor", score.time_s / score.sound_s}});
  }
  return rows.dump(1) + "\n";
}

}  // namespace mouthpiece
