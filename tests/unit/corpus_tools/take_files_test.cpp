#include "corpus_tools/takes/take_files.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <memory>

#include "base/errors.h"
#include "base/files.h"
#include "corpus_tools/building/corpus_builder.h"
#include "corpus_tools/takes/pose_fit.h"
#include "hearing/network/word_network.h"
#include "motion/formats/motion_file.h"
#include "support/run_program.h"
#include "synthetic_takes.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

void touch(const std::filesystem::path& path) { std::ofstream(path) << "x"; }

/// What `act` complains about, "" when it does not.
template <typename Act>
std::string complaintOf(const Act& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(FindTakes, FindsEveryKindOfFileInAnyCase) {
  const test::ScratchFolder folder;
  for (const char* name : {"a.c3d", "a.wav", "a.txt", "a.TextGrid", "b.CSV", "b.FLAC", "b.lab", "c.trc", "c.wav",
                           "c.phn", "README.txt", ".hidden.c3d"}) {
    touch(folder.path() / name);
  }
  const FoundTakes found = findTakes(folder.path());
  ASSERT_EQ(found.takes.size(), 3U);
  EXPECT_TRUE(found.left_out.empty());
  EXPECT_EQ(found.takes[0].name, "a");
  EXPECT_EQ(found.takes[0].text, folder.path() / "a.txt");
  EXPECT_EQ(found.takes[1].motion, folder.path() / "b.CSV");
  EXPECT_FALSE(found.takes[1].text);
  EXPECT_EQ(found.takes[2].labels, folder.path() / "c.phn");
}

TEST(FindTakes, NamesWhatATakeLacks) {
  const test::ScratchFolder folder;
  for (const char* name : {"quiet.c3d", "quiet.TextGrid", "still.wav", "still.lab", "bare.c3d", "bare.wav"})
    touch(folder.path() / name);
  const FoundTakes found = findTakes(folder.path());
  EXPECT_TRUE(found.takes.empty());
  ASSERT_EQ(found.left_out.size(), 3U);
  EXPECT_TRUE(holds(found.left_out[0].reason, "neither labels (expected bare.TextGrid, .lab, .phn or .ctm) nor text"));
  EXPECT_TRUE(holds(found.left_out[1].reason, "no sound"));
  EXPECT_TRUE(holds(found.left_out[2].reason, "no motion"));
}

TEST(FindTakes, AFolderWithoutTakesIsRefused) {
  const test::ScratchFolder folder;
  EXPECT_TRUE(holds(complaintOf([&] { findTakes(folder.path()); }), "holds no take"));
  touch(folder.path() / "song.wav");
  EXPECT_TRUE(holds(complaintOf([&] { findTakes(folder.path()); }), "holds no take"));
  EXPECT_TRUE(holds(complaintOf([&] { findTakes(folder.path() / "nowhere"); }), "no such folder"));
}

TEST(SplitMarkers, SubjectsAreIgnoredAndJigsApart) {
  MotionClip clip = SyntheticTake{}.raw().face;
  for (std::string& name : clip.marker_names) name = "Anna:" + name;
  clip.marker_names.push_back("Anna:JIG_3");
  clip.positions_mm.conservativeResize(Eigen::NoChange, clip.positions_mm.cols() + 3);
  clip.positions_mm.rightCols(3).setConstant(7);
  const FaceAndJig split = splitMarkers(clip, defaultLayout(), "take.c3d");
  EXPECT_EQ(split.face.markerCount(), 66U);
  ASSERT_EQ(split.jig.markerCount(), 7U);
  EXPECT_TRUE(split.jig.isSeen(FrameIndex(0), MarkerIndex(2)));
  EXPECT_FALSE(split.jig.isSeen(FrameIndex(0), MarkerIndex(1)));
}

TEST(SplitMarkers, TwoPeopleAreNotOne) {
  MotionClip clip = SyntheticTake{}.raw().face;
  clip.marker_names.push_back("Bob:CHIN_MID");
  clip.positions_mm.conservativeResize(Eigen::NoChange, clip.positions_mm.cols() + 3);
  clip.positions_mm.rightCols(3).setConstant(900);
  const std::string two = complaintOf([&] { splitMarkers(clip, defaultLayout(), "take.c3d"); });
  EXPECT_TRUE(holds(two, "take.c3d: has two markers CHIN_MID ('CHIN_MID' and 'Bob:CHIN_MID')")) << two;
  clip.marker_names.back() = "Bob:KNEE";
  EXPECT_EQ(splitMarkers(clip, defaultLayout(), "take.c3d").face.markerCount(), 66U);
}

TEST(SplitMarkers, AMarkerAtZeroWasNotSeen) {
  MotionClip clip = SyntheticTake{}.raw().face;
  clip.positions_mm.block<1, 3>(2, 3).setZero();
  clip.positions_mm(3, 3) = 0;
  const FaceAndJig split = splitMarkers(clip, defaultLayout(), "take.trc");
  EXPECT_FALSE(split.face.isSeen(FrameIndex(2), MarkerIndex(1)));
  EXPECT_TRUE(split.face.isSeen(FrameIndex(3), MarkerIndex(1))) << "one axis at zero is a place";
}

TEST(SplitMarkers, AFaceInMetresIsNoFaceInMillimetres) {
  MotionClip clip = SyntheticTake{}.raw().face;
  clip.positions_mm /= 1000;
  const std::string small = complaintOf([&] { splitMarkers(clip, defaultLayout(), "take.csv"); });
  EXPECT_TRUE(holds(small, "take.csv: shows a face of 0.")) << small;
  clip.positions_mm *= 10'000;
  EXPECT_TRUE(holds(complaintOf([&] { splitMarkers(clip, defaultLayout(), "take.csv"); }), "expected 40 to 400"));
}

TEST(SplitMarkers, SaysWhatWasFoundAndExpected) {
  MotionClip clip = SyntheticTake{}.raw().face;
  for (std::string& name : clip.marker_names) name = "X_" + name;
  const std::string none = complaintOf([&] { splitMarkers(clip, defaultLayout(), "take.c3d"); });
  EXPECT_TRUE(holds(none, "take.c3d: has no known marker: found 66 (X_FOREHEAD_TOP")) << none;
  EXPECT_TRUE(holds(none, "expected the 66 of layout face66 (FOREHEAD_TOP")) << none;
  for (std::size_t i = 0; i < 40; ++i) clip.marker_names[i] = clip.marker_names[i].substr(2);
  const std::string few = complaintOf([&] { splitMarkers(clip, defaultLayout(), "take.c3d"); });
  EXPECT_TRUE(holds(few, "shows 40 of the 66 markers")) << few;
}

TEST(ReadTake, ReadsWhatWasWritten) {
  const test::ScratchFolder folder;
  const SyntheticTake take;
  take.write(folder.path());
  const RawTake read = readTake(findTakes(folder.path()).takes.at(0), defaultLayout(), {});
  EXPECT_EQ(read.text, "bin");
  EXPECT_EQ(read.labels.phones.size(), 5U);
  ASSERT_EQ(read.labels.words.size(), 1U);
  EXPECT_EQ(read.face.markerCount(), 66U);
  EXPECT_EQ(read.jig.markerCount(), 7U);
  EXPECT_LT((read.face.positions_mm - take.raw().face.positions_mm).array().abs().maxCoeff(), 1e-3);
}

TEST(ReadTake, WordsComeFromTextAndLexiconWhereLabelsHaveNone) {
  const test::ScratchFolder folder;
  SyntheticTake{}.write(folder.path());
  std::filesystem::remove(folder.path() / "one.TextGrid");
  writeFileAtomically(folder.path() / "one.lab",
                      std::string_view("0.0 0.4 sil\n0.4 0.5 b\n0.5 0.6 ih\n0.6 0.7 n\n0.7 1.1 sil\n"));
  const TakeFiles files = findTakes(folder.path()).takes.at(0);
  EXPECT_TRUE(readTake(files, defaultLayout(), {}).labels.words.empty());
  const RawTake take = readTake(files, defaultLayout(), Lexicon::parse("bin B IH N\n", "lexicon"));
  ASSERT_EQ(take.labels.words.size(), 1U);
  EXPECT_EQ(take.labels.words[0].text, "bin");
}

/// Words alone, and a word that the Montreal Forced Aligner's dictionary lacks.
TEST(ReadTake, PhonesThatATextGridLacksAreFound) {
  const test::ScratchFolder folder;
  SyntheticTake{}.write(folder.path());
  const std::string tier = "\"IntervalTier\"\n\"{}\"\n0\n1.1\n3\n0\n0.4\n\"\"\n0.4\n0.7\n\"{}\"\n0.7\n1.1\n\"\"\n";
  const std::string words = fmt::format(fmt::runtime(tier), "words", "bin");
  const std::string phones = fmt::format(fmt::runtime(tier), "phones", "spn");
  for (const std::string& tiers : {"1\n" + words, "2\n" + words + phones}) {
    writeFileAtomically(folder.path() / "one.TextGrid",
                        "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n0\n1.1\n<exists>\n" + tiers);
    const RawTake take =
        readTake(findTakes(folder.path()).takes.at(0), defaultLayout(), Lexicon::parse("bin B IH N\n", "lexicon"));
    EXPECT_TRUE(take.labels_found);
    ASSERT_EQ(take.labels.words.size(), 1U);
    EXPECT_EQ(take.labels.words[0].text, "bin");
    ASSERT_EQ(take.labels.phones.size(), 5U);
    EXPECT_EQ(take.labels.phones[2].phone, Phone::kIH);
    EXPECT_NEAR(take.labels.phones[1].span.start, 0.4, 0.001);
    EXPECT_NEAR(take.labels.phones[3].span.end, 0.7, 0.001);
  }
}

/// Words of takes in another language are said, and their phones written, as it does.
TEST(TakeLabeller, SaysTheWordsOfAnotherLanguage) {
  const SpokenLine said = makeVoice("espeak:de")->speak("Ich möchte heute schöne Bücher kaufen");
  const Lexicon lexicon;
  const auto broken = std::make_shared<WordNetwork>(std::filesystem::path("/nowhere"));
  TakeLabeller german(lexicon, broken, languageOf("de"));
  const SpeechLabels found = german.label(said.audio, "Ich möchte heute schöne Bücher kaufen", "one.wav").labels;
  EXPECT_EQ(german.networkFault(), "");
  ASSERT_EQ(found.phones.size(), said.labels.phones.size());
  for (std::size_t i = 0; i < found.phones.size(); ++i) EXPECT_EQ(found.phones[i].name(), said.labels.phones[i].name());
}

/// A line and a voice from which no weight of the doubt was learnt.
TEST(TakeLabeller, AsksTheNetworkAboutWordsInDoubt) {
  const auto network = std::make_shared<WordNetwork>(MOUTHPIECE_BUILD_SHARE_DIR "/word_network");
  if (!network->isThere()) GTEST_SKIP() << "the network is not packed for this processor";
  const AudioClip sound = makeVoice("flite:kal16")->speak("he usually walks the dog before breakfast").audio;
  const Lexicon lexicon;
  const auto doubted = [&](const std::shared_ptr<WordNetwork>& by, const std::string& text) {
    std::string words;
    for (const DoubtfulWord& word : TakeLabeller(lexicon, by).label(sound, text, "one.wav").doubtful)
      words += word.text + " ";
    return words;
  };
  const std::string changed = "he usually walks the cat before breakfast";
  EXPECT_EQ(doubted({}, changed), "");
  EXPECT_NE(doubted(network, changed).find("cat"), std::string::npos);
  EXPECT_EQ(doubted(network, "he usually walks the dog before breakfast"), "");
}

TEST(TakeLabeller, SaysWhyTheNetworkCouldNotBeAsked) {
  const test::ScratchFolder folder;
  writeFileAtomically(folder.path() / "hear_words.mjs", std::string_view("process.exit(3);"));
  const auto broken = std::make_shared<WordNetwork>(folder.path());
  if (!broken->isThere()) GTEST_SKIP() << "no Node";
  const AudioClip sound = makeVoice("flite:kal16")->speak("the birch canoe slid on the smooth planks").audio;
  const Lexicon lexicon;
  TakeLabeller labeller(lexicon, broken);
  EXPECT_EQ(labeller.networkFault(), "");
  EXPECT_FALSE(labeller.label(sound, "measure every garage before you buy", "one.wav").doubtful.empty());
  EXPECT_TRUE(holds(labeller.networkFault(), "hear_words.mjs: failed")) << labeller.networkFault();
}

TEST(ReadTake, SoundShorterThanTheLabelsIsRefused) {
  const test::ScratchFolder folder;
  const SyntheticTake take;
  take.write(folder.path());
  AudioClip half = take.audio();
  half.samples.resize(half.samples.size() / 2);
  writeWav(folder.path() / "one.wav", half);
  const std::string complaint =
      complaintOf([&] { readTake(findTakes(folder.path()).takes.at(0), defaultLayout(), {}); });
  EXPECT_TRUE(holds(complaint, "one.wav: ends at 0.55 s; expected to reach the end of its labels at 1.10 s"))
      << complaint;
}

TEST(BuildCorpus, LeavesOutWhatItCannotUseAndSaysWhy) {
  const test::ScratchFolder folder;
  SyntheticTake good;
  good.write(folder.path());
  SyntheticTake bad = good;
  bad.name = "two";
  bad.write(folder.path());
  writeFileAtomically(folder.path() / "two.c3d", std::string_view("no motion"));
  touch(folder.path() / "three.c3d");
  const BuildResult result = buildCorpus(folder.path(), {});
  ASSERT_EQ(result.corpus.takes.size(), 1U);
  ASSERT_EQ(result.left_out.size(), 2U);
  EXPECT_EQ(result.left_out[0].name, "three");
  EXPECT_TRUE(holds(result.left_out[1].reason, "two.c3d"));
  EXPECT_TRUE(holds(result.corpus.build_log.at("takes_left_out"), "two: "));
  BuildOptions strict;
  strict.strict = true;
  EXPECT_TRUE(holds(complaintOf([&] { buildCorpus(folder.path(), strict); }), "three"));
}

/// Smoothing off, so that a clear capture must come back as it was.
BuildOptions exact() {
  BuildOptions options;
  options.cleaning.head.jig_pose_smoothing = 0;
  options.cleaning.smoothed_from_hz = 1e6;
  return options;
}

TEST(BuildCorpus, TheCorpusIsTheTruthInTheFacesAxes) {
  const test::ScratchFolder folder;
  std::vector<SyntheticTake> takes(3);
  for (std::size_t i = 0; i < takes.size(); ++i) {
    takes[i].name = std::string(1, static_cast<char>('a' + i));
    takes[i].seed = static_cast<unsigned>(i + 1);
    takes[i].write(folder.path());
  }
  const BuildResult result = buildCorpus(folder.path(), exact());
  ASSERT_EQ(result.corpus.takes.size(), 3U);
  MotionClip expected = takes[0].truth();
  transform(expected, faceFromHead(syntheticNeutral(), defaultLayout()));
  for (const CorpusTake& take : result.corpus.takes) {
    // C3D holds 32-bit floats: about 1e-4 mm at 1.2 m from the world's origin.
    EXPECT_LT((take.motion.positions_mm - expected.positions_mm).array().abs().maxCoeff(), 0.01) << take.name;
  }
  MarkerPositions neutral = syntheticNeutral();
  transform(neutral, faceFromHead(neutral, defaultLayout()));
  EXPECT_LT((result.corpus.neutral_pose_mm - neutral).array().abs().maxCoeff(), 0.01);
}

TEST(BuildCorpus, DoesNotDependOnTheNumberOfJobs) {
  const test::ScratchFolder folder;
  for (unsigned i = 1; i <= 4; ++i) {
    SyntheticTake take;
    take.name = "take" + std::to_string(i);
    take.seed = i;
    take.noise_mm = 0.1;
    take.has_jig = false;
    take.write(folder.path());
  }
  BuildOptions one, many;
  one.jobs = 1;
  many.jobs = 4;
  const BuildResult a = buildCorpus(folder.path(), one), b = buildCorpus(folder.path(), many);
  ASSERT_EQ(a.corpus.takes.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(a.corpus.takes[i].name, b.corpus.takes[i].name);
    EXPECT_EQ((a.corpus.takes[i].motion.positions_mm - b.corpus.takes[i].motion.positions_mm).cwiseAbs().maxCoeff(),
              0.0);
  }
}

TEST(BuildCorpus, TakesFromOutsideLandInTheSameFrame) {
  const test::ScratchFolder inside, outside;
  for (unsigned i = 1; i <= 3; ++i) {
    SyntheticTake take;
    take.name = "take" + std::to_string(i);
    take.seed = i;
    take.write(inside.path());
  }
  SyntheticTake other;
  other.name = "other";
  other.seed = 9;
  other.write(outside.path());
  const Corpus corpus = buildCorpus(inside.path(), exact()).corpus;
  const CleanTakes clean = readTakesInto(corpus, outside.path(), exact());
  ASSERT_EQ(clean.takes.size(), 1U);
  EXPECT_LT((clean.takes[0].motion.positions_mm - corpus.takes[0].motion.positions_mm).array().abs().maxCoeff(), 0.01);
}

TEST(CleanClip, KeepsTheHeadStillWithoutLabels) {
  SyntheticTake take;
  const RawTake raw = take.raw();
  MotionClip all = raw.face;
  all.marker_names.insert(all.marker_names.end(), raw.jig.marker_names.begin(), raw.jig.marker_names.end());
  all.positions_mm.conservativeResize(Eigen::NoChange, raw.face.positions_mm.cols() + raw.jig.positions_mm.cols());
  all.positions_mm.rightCols(raw.jig.positions_mm.cols()) = raw.jig.positions_mm;
  all.positions_mm.block(30, 150, 4, 3).setConstant(std::nan(""));
  const CleanedFace clean = cleanClip(all, defaultLayout(), "take.c3d");
  EXPECT_EQ(clean.report.filled_samples, 4U);
  MotionClip expected = take.truth();
  transform(expected, faceFromHead(syntheticNeutral(), defaultLayout()));
  EXPECT_LT((clean.motion.positions_mm - expected.positions_mm).array().abs().maxCoeff(), 0.2);
}

}  // namespace
}  // namespace mouthpiece
