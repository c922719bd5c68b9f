#include "hearing/alignment/phone_decoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/acoustic_model.h"
#include "hearing/alignment/noise_adaptation.h"
#include "hearing/alignment/phone_row.h"
#include "hearing/alignment/phone_search.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/alignment/speaker_adaptation.h"
#include "hearing/alignment/sphinx_functions.h"

namespace mouthpiece {
namespace {

/// Frames are not independent of each other, as the model takes them to be: the likelihoods of speech count by this
/// power. Chosen on TTS voices and GRID s1 (docs/theory/hearing/alignment.md).
constexpr double kTimesScale = 0.3;
/// A frame's window is longer than its step: borders come out early, of the likeliest path by the first, of a row that
/// is heard again by the second. Chosen on takes 4n + 1 of GRID s1 and three voices (docs/theory/hearing/alignment.md).
constexpr Seconds kPathShift = 0.008, kRowShift = 0.002;
/// A phone that was found once is heard again no further from there: 0.5 s; within 0.3 s borders change.
constexpr Eigen::Index kNearFrames = 50;
/// Of a song this many frames a phone are heard: 120 ms, about as long as spoken phones are.
constexpr std::size_t kSungFramesAPhone = 12;
/// What a silence between two words of spoken text costs in noise (noisinessOf), in nats: quiet sounds pass for silence
/// there.
constexpr double kInnerSilencePrice = 45.0;
/// The same, and what each frame of it costs, where silence is heard as what lies before and after the words.
constexpr double kPauseInMusicPrice = 70.0, kPauseInMusicFramePrice = 2.0;
/// What a silence costs in a language whose sounds the model never learnt: what fits badly would rather be silence.
/// Chosen on eSpeak NG's voices, other lines than the guide's table tells of.
constexpr double kForeignPause = 140.0;  // nats

using Decoder = SphinxPointer<ps_decoder_t>;

std::filesystem::path modelOr(const std::filesystem::path& model, const Language& language) {
  const std::filesystem::path folder =
      model.empty() ? std::filesystem::path(MOUTHPIECE_SPHINX_MODELS) / language.acoustic_model : model;
  if (!std::filesystem::exists(folder / "mdef")) {
    throw InputError(folder.string(), "",
                     "holds no acoustic model; get it with: sudo apt-get install pocketsphinx-en-us");
  }
  return folder;
}

/// The model's phones that a phone of the language is heard as, with blanks between them.
std::string_view heardAs(const LanguagePhone& phone) {
  return phone.heard_as.empty() ? phoneName(phone.phone) : phone.heard_as;
}

/// For its front end alone: this model's cepstra and what is made of them.
Decoder makeDecoder(const std::filesystem::path& model) {
  // No noise removal: it moves edges.
  Decoder decoder =
      makeSphinxDecoder({"-hmm", model.string(), "-remove_noise", "no", "-remove_silence", "no", "-dither", "no"});
  if (!decoder) throw InputError(model.string(), "", "is no acoustic model that PocketSphinx can read");
  return decoder;
}

/// Throws InputError for a phone that the model lacks.
HeardAs heardIn(const TiedModel& model, const Language& language, const std::filesystem::path& folder) {
  HeardAs places;
  const auto add = [&](Phone phone, std::string_view heard) {
    std::istringstream names{std::string(heard)};
    for (std::string name; names >> name;) {
      const auto found = std::find_if(model.codebooks.begin(), model.codebooks.end(),
                                      [&](const TiedModel::Codebook& codebook) { return codebook.phone == name; });
      if (found == model.codebooks.end())
        throw InputError(folder.string(), "",
                         fmt::format("lacks the phone {}; expected a model of {}", name, language.name));
      places[phone].push_back(unsignedIndex(found - model.codebooks.begin()));
    }
  };
  add(Phone::kSil, "SIL");
  for (const LanguagePhone& phone : language.inventory) add(phone.phone, heardAs(phone));
  return places;
}

using Cepstra = std::vector<std::vector<float>>;

/// What the decoder's own front end hears, a row every 10 ms; of a sound that it hears a part of, the frames that are
/// whole.
Cepstra cepstraOf(ps_decoder_t* decoder, std::span<const std::int16_t> samples, bool begins = true, bool ends = true) {
  constexpr std::size_t kBlock = 256;
  fe_t* front_end = ps_get_fe(decoder);
  const std::size_t size = unsignedIndex(fe_get_output_size(front_end));
  std::vector<float> values(kBlock * size);
  std::array<mfcc_t*, kBlock> rows{};
  for (std::size_t i = 0; i < kBlock; ++i) rows[i] = values.data() + i * size;
  Cepstra cepstra;
  const auto take = [&](std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) cepstra.emplace_back(rows[i], rows[i] + size);
  };
  if (begins && fe_start_utt(front_end) < 0) throw InputError("pocketsphinx", "", "could not hear the sound");
  const int16* data = samples.data();
  for (std::size_t left = samples.size(); left > 0;) {
    const std::size_t before = left;
    int taken = kBlock, first = 0;
    if (fe_process_frames(front_end, &data, &left, rows.data(), &taken, &first) < 0)
      throw InputError("pocketsphinx", "", "could not hear the sound");
    take(unsignedIndex(taken));
    if (taken == 0 && left == before) break;
  }
  if (!ends) return cepstra;
  int rest = 0;
  fe_end_utt(front_end, rows[0], &rest);
  take(rest > 0 ? 1 : 0);
  return cepstra;
}

/// What the model weighs: cepstra less their mean, with their first and second differences. A column a frame.
Eigen::MatrixXf featuresOf(ps_decoder_t* decoder, Cepstra& cepstra) {
  feat_t* maker = ps_get_feat(decoder);
  std::vector<mfcc_t*> rows;
  for (std::vector<float>& row : cepstra) rows.push_back(row.data());
  auto frames = static_cast<int32>(rows.size());
  const SphinxPointer<mfcc_t**> made(feat_array_alloc(maker, frames));
  frames = feat_s2mfc2feat_live(maker, rows.data(), &frames, TRUE, TRUE, made.get());
  Eigen::MatrixXf features(feat_dimension(maker), std::max(frames, 0));
  for (Eigen::Index frame = 0; frame < features.cols(); ++frame)
    std::memcpy(features.col(frame).data(), made.get()[frame][0], sizeof(float) * unsignedIndex(features.rows()));
  return features;
}

/// Which of the model's phones are heard where the language's `phones` or silence are.
std::vector<bool> codebooksOf(const std::set<Phone>& phones, const TiedModel& model, const HeardAs& places) {
  std::vector<bool> wanted(model.codebooks.size(), false);
  for (const auto& [phone, codebooks] : places) {
    if (phone != Phone::kSil && !phones.contains(phone)) continue;
    for (const std::size_t codebook : codebooks) wanted[codebook] = true;
  }
  return wanted;
}

/// What another ear hears of the phones, beside a model's scores; these as they are where it heard nothing.
class BesideScores {
 public:
  /// All have to outlive this.
  BesideScores(const HeardPhones& heard, const TiedModel& model, const HeardAs& places)
      : heard_(heard), model_(model), places_(places) {}

  /// `scores`: of the frames from `first` on; a logarithm of what is heard counts `scale` times. Valid until the next
  /// call.
  const SenoneScorer::Scores& operator()(const SenoneScorer::Scores& scores, Eigen::Index first, double scale) {
    if (heard_.cols() == 0) return scores;
    both_ = scores;
    for (Eigen::Index i = 0; i < both_.cols(); ++i) {
      for (const auto& [phone, codebooks] : places_) {
        const int cost = costOf(phone, first + i, scale);
        // A phone of English is one of the model's.
        for (const int senone : model_.codebooks[codebooks.front()].senones)
          both_(senone, i) = static_cast<std::int16_t>(std::min(both_(senone, i) + cost, INT16_MAX));
      }
    }
    return both_;
  }
  /// What all frames of a phone cost by this, at a scale of 1.
  [[nodiscard]] double costOf(const DecodedPhone& phone) const {
    double cost = 0;
    for (int i = 0; i < phone.frames && heard_.cols() > 0; ++i)
      cost += costOf(phone.phone, signedIndex(phone.first_frame) + i, 1);
    return cost;
  }

 private:
  [[nodiscard]] int costOf(Phone phone, Eigen::Index frame, double scale) const {
    constexpr float kLeastHeard = 1e-3F;
    const float heard = heard_(static_cast<Eigen::Index>(phone), std::min(frame, heard_.cols() - 1));
    return static_cast<int>(std::lround(-scale * std::log(double{std::max(heard, kLeastHeard)}) / kScoreUnit));
  }

  const HeardPhones& heard_;
  const TiedModel& model_;
  const HeardAs& places_;
  SenoneScorer::Scores both_;
};

/// `model` with `silence` as it sounds before and after all words of a `path`, where music may play.
TiedModel knowingItsSilence(const TiedModel& model, const Eigen::MatrixXf& features,
                            const std::vector<DecodedPhone>& path, std::size_t silence) {
  const auto framesOf = [](const DecodedPhone& outer) { return outer.phone == Phone::kSil ? outer.frames : 0; };
  const int before = framesOf(path.front()), after = framesOf(path.back());
  SpeakerFrames heard{Eigen::MatrixXf(features.rows(), before + after), {}};
  heard.features.leftCols(before) = features.leftCols(before);
  heard.features.rightCols(after) = features.rightCols(after);
  heard.codebook.assign(unsignedIndex(heard.features.cols()), silence);
  return adaptedToSpeaker(model, std::span(&heard, 1));
}

/// Throws InputError for one that the language lacks.
std::set<Phone> phonesOf(const WordWays& words, const Language& language) {
  std::set<Phone> used;
  for (const auto& ways : words) {
    for (const auto& phones : ways) used.insert(phones.begin(), phones.end());
  }
  for (const Phone phone : used) {
    if (language.find(phone) == nullptr)
      throw InputError("transcript", "",
                       fmt::format("has the phone {}; expected phones of {}", phoneName(phone), language.name));
  }
  return used;
}

std::size_t fewestPhones(const WordWays& words) {
  std::size_t phones = 0;
  for (const auto& ways : words) {
    phones += std::min_element(ways.begin(), ways.end(), [](const auto& a, const auto& b) {
                return a.size() < b.size();
              })->size();
  }
  return phones;
}

}  // namespace

struct PhoneDecoder::State {
  State(const std::filesystem::path& folder, const Language& spoken)
      : language(spoken),
        scorer(std::make_shared<TiedModel>(readTiedModel(folder))),
        places(heardIn(scorer.model(), spoken, folder)),
        decoder(makeDecoder(folder)) {}

  const Language& language;
  SenoneScorer scorer;
  HeardAs places;
  std::optional<SenoneScorer> in_noise = std::nullopt;  ///< of the sound that decode() heard last, where it is noisy
  Decoder decoder;

  SenoneScorer& fittest() { return in_noise ? *in_noise : scorer; }
};

PhoneDecoder::PhoneDecoder(const std::filesystem::path& model, const Language& language)
    : state_(std::make_unique<State>(modelOr(model, language), language)) {}
PhoneDecoder::~PhoneDecoder() = default;
PhoneDecoder::PhoneDecoder(PhoneDecoder&&) noexcept = default;
SenoneScorer& PhoneDecoder::scorer() { return state_->scorer; }
Eigen::MatrixXf PhoneDecoder::featuresOf(std::span<const std::int16_t> samples) {
  Cepstra cepstra = mouthpiece::cepstraOf(state_->decoder.get(), samples);
  return cepstra.empty() ? Eigen::MatrixXf() : mouthpiece::featuresOf(state_->decoder.get(), cepstra);
}
std::vector<std::vector<float>> PhoneDecoder::cepstraOn(std::span<const std::int16_t> samples, bool begins) {
  return mouthpiece::cepstraOf(state_->decoder.get(), samples, begins, false);
}
PhoneDecoder& PhoneDecoder::operator=(PhoneDecoder&&) noexcept = default;

namespace {

Eigen::MatrixXd asColumns(const Cepstra& cepstra) {
  Eigen::MatrixXd columns(std::ssize(cepstra.front()), std::ssize(cepstra));
  for (std::size_t i = 0; i < cepstra.size(); ++i)
    columns.col(signedIndex(i)) = Eigen::Map<const Eigen::VectorXf>(cepstra[i].data(), columns.rows()).cast<double>();
  return columns;
}

/// Where a phone begins that is first heard in frame `at` of those that were kept (all if empty): midway to the frame
/// before.
Seconds edgeBefore(const std::vector<std::size_t>& kept, std::size_t at) {
  if (kept.empty()) return asReal(at) * kFrameStep + (at > 0 ? kPathShift : 0);
  if (at == 0) return 0;
  const std::size_t before = kept[at - 1] + 1;
  const std::size_t after = at < kept.size() ? kept[at] : before;
  return 0.5 * asReal(before + after) * kFrameStep + kPathShift;
}

}  // namespace

Eigen::MatrixXd PhoneDecoder::cepstraOf(std::span<const std::int16_t> samples) {
  const Cepstra cepstra = mouthpiece::cepstraOf(state_->decoder.get(), samples);
  return cepstra.empty() ? Eigen::MatrixXd() : asColumns(cepstra);
}

std::vector<DecodedPhone> PhoneDecoder::decode(std::span<const std::int16_t> samples, const WordWays& words,
                                               SpeechKind kind, const HeardPhones& heard) {
  MOUTHPIECE_EXPECT(!words.empty());
  const auto codebooks = codebooksOf(phonesOf(words, state_->language), state_->scorer.model(), state_->places);
  Cepstra cepstra = mouthpiece::cepstraOf(state_->decoder.get(), samples);
  if (cepstra.empty()) return {};
  const bool is_sung = kind == SpeechKind::kSung;
  const double noisiness = is_sung ? 0.0 : noisinessOf(samples);
  const bool is_in_music = noisiness >= 1 && !isSteady(asColumns(cepstra));
  state_->in_noise.reset();
  if (noisiness > 0)
    state_->in_noise.emplace(
        std::make_shared<TiedModel>(adaptedToNoise(state_->scorer.model(), asColumns(cepstra), codebooks)));
  std::vector<std::size_t> kept;
  if (is_sung) {
    useSpectralEnvelope(samples, cepstra);
    kept = thinFrames(cepstra, kSungFramesAPhone * fewestPhones(words));
    Cepstra thinned;
    for (const std::size_t frame : kept) thinned.push_back(std::move(cepstra[frame]));
    cepstra = std::move(thinned);
  }
  const Eigen::MatrixXf features = mouthpiece::featuresOf(state_->decoder.get(), cepstra);
  const FleetingSounds fleeting(state_->scorer.model(), kept);
  const HeardPhones unheard;
  BesideScores beside(is_sung ? unheard : heard, state_->scorer.model(), state_->places);
  SenoneScorer::Scores weighed;
  const auto pathBy = [&](SenoneScorer& scorer, const Pauses& pauses) {
    const auto scores = [&](Eigen::Index first, Eigen::Index count) -> const SenoneScorer::Scores& {
      const SenoneScorer::Scores& all = scorer.score(features.middleCols(first, count), Weighing{codebooks});
      if (!is_sung) return beside(all, first, 1);
      weighed = all;
      fleeting.weigh(weighed, first);
      return weighed;
    };
    return likeliestPath(words, state_->places, scorer.model(), pauses, features.cols(), scores);
  };
  Pauses pauses{state_->language.say != nullptr ? kForeignPause : 0.0, kInnerSilencePrice * noisiness};
  std::vector<DecodedPhone> phones = pathBy(state_->fittest(), pauses);
  if (is_in_music && !phones.empty()) {
    SenoneScorer scorer(std::make_shared<TiedModel>(
        knowingItsSilence(state_->scorer.model(), features, phones, state_->places.at(Phone::kSil).front())));
    pauses.inner = kPauseInMusicPrice;
    pauses.inner_frame = kPauseInMusicFramePrice;
    phones = pathBy(scorer, pauses);
  }
  for (DecodedPhone& phone : phones) {
    const std::size_t end = phone.first_frame + unsignedIndex(phone.frames);
    phone.span = {edgeBefore(kept, phone.first_frame), edgeBefore(kept, end)};
    phone.score += beside.costOf(phone);  // how far words are believed was learnt from the model alone
    phone.score /= fleeting.timesWeighed(phone.phone, phone.first_frame, end - 1);
  }
  return phones;
}

namespace {

/// Phones that are heard by themselves, with the frames that they lie in. A pause belongs to what is before and after.
struct Piece {
  std::size_t first = 0, end = 0;  ///< phones
  Eigen::Index begin = 0, stop = 0;
};

/// What is known of a long sound's frames takes room: such a one is cut in the middle of pauses, each piece 30 s or
/// longer.
std::vector<Piece> piecesOf(const std::vector<DecodedPhone>& phones, Eigen::Index frames) {
  constexpr Eigen::Index kShortest = 3000, kPause = 20;  // frames of 10 ms
  std::vector<Piece> pieces{{}};
  for (std::size_t i = 1; i + 1 < phones.size(); ++i) {
    const Eigen::Index from = signedIndex(phones[i].first_frame), to = signedIndex(phones[i + 1].first_frame);
    const Eigen::Index middle = (from + to) / 2;
    if (phones[i].phone != Phone::kSil || to - from < kPause || middle - pieces.back().begin < kShortest ||
        frames - middle < kPause)
      continue;
    pieces.back().end = i + 1;
    pieces.back().stop = middle;
    pieces.push_back({i, 0, middle, 0});
  }
  pieces.back().end = phones.size();
  pieces.back().stop = frames;
  return pieces;
}

/// Weighs, of phones that were found once, those alone that were found near the frames.
class NearPhones {
 public:
  /// `phones` has to outlive this.
  NearPhones(std::span<const DecodedPhone> phones, const TiedModel& model, const HeardAs& places) : phones_(phones) {
    for (const DecodedPhone& phone : phones) codebooks_[phone.phone] = {};
    for (auto& [phone, codebooks] : codebooks_) codebooks = codebooksOf({phone}, model, places);
  }

  /// Of the frames [first, first + count).
  [[nodiscard]] Weighing operator()(Eigen::Index first, Eigen::Index count) const {
    const std::size_t from = unsignedIndex(std::max<Eigen::Index>(0, first - kNearFrames)),
                      to = unsignedIndex(first + count + kNearFrames);
    auto phone = std::partition_point(phones_.begin() + 1, phones_.end(),
                                      [&](const DecodedPhone& later) { return later.first_frame <= from; }) -
                 1;
    Weighing weighing{std::vector<bool>(codebooks_.begin()->second.size(), false), false, kTimesScale};
    for (; phone != phones_.end() && phone->first_frame < to; ++phone)
      std::transform(weighing.wanted.begin(), weighing.wanted.end(), codebooks_.at(phone->phone).begin(),
                     weighing.wanted.begin(), std::logical_or<>());
    return weighing;
  }

 private:
  std::span<const DecodedPhone> phones_;
  std::map<Phone, std::vector<bool>> codebooks_;
};

/// The model's phones in a row, and how many of them there are up to the end of each of the language's.
struct Row {
  std::vector<RowPhone> phones;
  std::vector<std::size_t> ends;
};

/// `phones` in the frames [begin, begin + frames) of a sound.
Row rowOf(std::span<const DecodedPhone> phones, Eigen::Index begin, Eigen::Index frames, const TiedModel& model,
          const HeardAs& places) {
  using enum TiedModel::WordPlace;
  const std::size_t silence = places.at(Phone::kSil).front();
  std::vector<std::size_t> codebooks{silence};  // and one more at the end
  std::vector<bool> opens{true};
  Row row;
  for (const DecodedPhone& phone : phones) {
    const Eigen::Index first = signedIndex(phone.first_frame) - begin;
    bool is_first = phone.opens_word || phone.phone == Phone::kSil;
    for (const std::size_t codebook : places.at(phone.phone)) {
      codebooks.push_back(codebook);
      opens.push_back(std::exchange(is_first, false));
      row.phones.push_back({.first = first - kNearFrames, .end = first + phone.frames + kNearFrames});
    }
    row.ends.push_back(row.phones.size());
  }
  codebooks.push_back(silence);
  opens.push_back(true);
  for (std::size_t i = 1; i <= row.phones.size(); ++i) {
    const auto place = opens[i] ? (opens[i + 1] ? kAlone : kBegins) : (opens[i + 1] ? kEnds : kInside);
    row.phones[i - 1].senones = codebooks[i] == silence
                                    ? model.alone[silence]
                                    : model.senonesOf(codebooks[i], codebooks[i - 1], codebooks[i + 1], place);
  }
  row.phones.front().first = 0;
  row.phones.back().end = frames;
  return row;
}

}  // namespace

std::vector<Seconds> PhoneDecoder::hearAgain(std::span<const std::int16_t> samples,
                                             const std::vector<DecodedPhone>& phones, const HeardPhones& heard) {
  SenoneScorer& scorer = state_->fittest();
  const Eigen::MatrixXf features = featuresOf(samples);
  const NearPhones near(phones, scorer.model(), state_->places);
  BesideScores beside(heard, scorer.model(), state_->places);
  std::vector<Seconds> borders;
  for (const Piece& piece : piecesOf(phones, features.cols())) {
    const Row row = rowOf(std::span(phones).subspan(piece.first, piece.end - piece.first), piece.begin,
                          piece.stop - piece.begin, scorer.model(), state_->places);
    const auto scores = [&](Eigen::Index first, Eigen::Index count) -> const SenoneScorer::Scores& {
      const Eigen::Index from = piece.begin + first;
      return beside(scorer.score(features.middleCols(from, count), near(from, count)), from, kTimesScale);
    };
    const std::vector<double> lasts = expectedBorders(row.phones, piece.stop - piece.begin, scores);
    if (lasts.size() + 1 != row.phones.size()) return {};
    for (std::size_t i = 0; i + 1 < row.ends.size(); ++i)
      borders.push_back((asReal(piece.begin) + lasts[row.ends[i] - 1]) * kFrameStep + kRowShift);
  }
  return borders;
}

}  // namespace mouthpiece
