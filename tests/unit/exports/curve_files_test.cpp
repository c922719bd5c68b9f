// Mouths and weights in other programs' words, against what these programs write and read.
#include "exports/curves/curve_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "base/files.h"
#include "base/text_encoding.h"
#include "exports/curves/weight_tracks.h"
#include "exports/curves/written_words.h"
#include "motion/arkit_shapes.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

SpeechLabels labelsOf(const std::vector<std::pair<Phone, Seconds>>& ends) {
  SpeechLabels labels;
  Seconds start = 0;
  for (const auto& [phone, end] : ends) {
    labels.phones.push_back({phone, {start, end}, {}, {}});
    start = end;
  }
  return labels;
}

/// "hi, Pam" with a breath between.
SpeechLabels line() {
  SpeechLabels labels = labelsOf({{Phone::kSil, 0.2},
                                  {Phone::kHH, 0.3},
                                  {Phone::kAY, 0.6},
                                  {Phone::kSil, 0.65},
                                  {Phone::kP, 0.75},
                                  {Phone::kAE, 0.95},
                                  {Phone::kM, 1.1},
                                  {Phone::kSil, 1.5}});
  labels.words = {{"hi,", {PhoneIndex(1), PhoneIndex(2)}}, {"Pam", {PhoneIndex(4), PhoneIndex(6)}}};
  return labels;
}

WeightTracks ramp() {
  WeightTracks tracks{30, {"jawOpen", "mouthClose"}, RowMajorMatrixF::Zero(31, 2)};
  for (Eigen::Index t = 0; t < 31; ++t)
    tracks.weights(t, 0) = static_cast<float>(std::min<Eigen::Index>(t, 30 - t)) / 15;
  return tracks;
}

std::size_t countOf(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(Visemes, AddUpAndShutTheLips) {
  const WeightTracks tracks = oculusVisemes(line(), 90, 60);
  ASSERT_EQ(tracks.names.size(), 15U);
  const auto numberOf = [&](const std::string& name) {
    return std::find(tracks.names.begin(), tracks.names.end(), name) - tracks.names.begin();
  };
  for (Eigen::Index t = 0; t < 90; ++t) {
    EXPECT_NEAR(tracks.weights.row(t).sum(), 1, 1e-5) << t;
    EXPECT_GE(tracks.weights.row(t).minCoeff(), 0) << t;
  }
  EXPECT_GT(tracks.weights(42, numberOf("PP")), 0.99) << "the P's middle, 0.70 s";
  EXPECT_GT(tracks.weights(51, numberOf("aa")), 0.99) << "the AE's middle";
  EXPECT_GT(tracks.weights(18, numberOf("aa")), 0.9) << "HH has the mouth of what follows";
  EXPECT_FLOAT_EQ(tracks.weights(0, numberOf("sil")), 1);
  const WeightTracks mouth = vrmMouth(tracks);
  EXPECT_LT(mouth.weights.row(42).maxCoeff(), 0.01F) << "nothing opens in P";
  EXPECT_LE(mouth.weights.maxCoeff(), 1.0F);
}

TEST(Visemes, OfNothingIsSilence) {
  const WeightTracks tracks = oculusVisemes({}, 3, 60);
  EXPECT_TRUE((tracks.weights.col(0).array() == 1).all());
  EXPECT_TRUE(mouthCues({}).empty());
  EXPECT_EQ(rhubarbTsv({}), "");
}

// The three formats as the README of Rhubarb Lip Sync 1.13 shows them.
TEST(MouthCues, AreRhubarbs) {
  const std::vector<MouthCue> cues = mouthCues(line());
  EXPECT_EQ(rhubarbTsv(cues), "0.00\tX\n0.20\tD\n0.44\tB\n0.65\tA\n0.75\tC\n0.95\tA\n1.10\tX\n1.50\tX\n");
  EXPECT_EQ(
      rhubarbXml({{{0, 0.05}, 'X'}, {{0.05, 0.27}, 'D'}}, "a&b.wav"),
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<rhubarbResult>\n  <metadata>\n    "
      "<soundFile>a&amp;b.wav</soundFile>\n    <duration>0.27</duration>\n  </metadata>\n  <mouthCues>\n    <mouthCue "
      "start=\"0.00\" end=\"0.05\">X</mouthCue>\n    <mouthCue start=\"0.05\" end=\"0.27\">D</mouthCue>\n  "
      "</mouthCues>\n</rhubarbResult>\n");
  const json root = json::parse(rhubarbJson(cues, "hi.wav"));
  EXPECT_EQ(root["metadata"]["soundFile"], "hi.wav");
  EXPECT_EQ(root["metadata"]["duration"], 1.5);
  EXPECT_EQ(root["mouthCues"][1], json({{"start", 0.2}, {"end", 0.44}, {"value", "D"}}));
}

// Rhubarb's DatExporter: frames from 1, cut off; no frame twice; rest at the end. OpenToonz reads these names.
TEST(MouthCues, AreMohosSwitch) {
  EXPECT_EQ(mohoDat(mouthCues(line()), 24),
            "MohoSwitch1\n1 rest\n5 AI\n11 etc\n16 MBP\n19 E\n23 MBP\n27 rest\n37 rest\n");
  EXPECT_EQ(mohoDat({{{0, 0.01}, 'A'}, {{0.01, 0.02}, 'B'}}, 24), "MohoSwitch1\n1 MBP\n2 rest\n");
  EXPECT_EQ(mohoDat({{{0, 0.03}, 'G'}, {{0.03, 0.19}, 'D'}}, 24), "MohoSwitch1\n1 AI\n5 rest\n");
}

TEST(Subtitles, AreRead) {
  EXPECT_EQ(srtText(line()), "1\n00:00:00,200 --> 00:00:01,100\nhi, Pam\n\n");
  EXPECT_EQ(vttText(line()), "WEBVTT\n\n00:00:00.200 --> 00:00:01.100\nhi, Pam\n\n");
}

/// One phone a word, 0.3 s each.
SpeechLabels wordsOf(const std::vector<std::string>& words) {
  std::vector<std::pair<Phone, Seconds>> ends;
  for (std::size_t i = 0; i < words.size(); ++i) ends.emplace_back(Phone::kAA, 0.3 * static_cast<double>(i + 1));
  SpeechLabels labels = labelsOf(ends);
  for (std::size_t i = 0; i < words.size(); ++i) labels.words.push_back({words[i], {PhoneIndex(i), PhoneIndex(i)}});
  return labels;
}

std::vector<std::string> cuesOf(const SpeechLabels& labels, std::string_view text = {}) {
  std::vector<std::string> cues;
  std::istringstream srt(srtText(labels, text));
  for (std::string number, times, cue, blank; std::getline(srt, number) && std::getline(srt, times);) {
    std::getline(srt, cue);
    std::getline(srt, blank);
    cues.push_back(cue);
  }
  return cues;
}

TEST(Subtitles, AreEvenAndCountLetters) {
  // 43 columns: two cues, none of them a word left over.
  EXPECT_EQ(cuesOf(wordsOf({"almost", "every", "morning", "she", "sells", "sea", "shells", "again"})),
            (std::vector<std::string>{"almost every morning she", "sells sea shells again"}));
  // 42 letters of two bytes each are one cue.
  EXPECT_EQ(cuesOf(wordsOf({"добрые", "старые", "друзья", "сидели", "вечером", "вместе"})).size(), 1U);
}

TEST(Subtitles, HaveNoBlanksBetweenIdeographs) {
  EXPECT_EQ(cuesOf(wordsOf({"你", "好", "Bob", "今", "天"})), (std::vector<std::string>{"你好 Bob 今天"}));
  EXPECT_EQ(cuesOf(wordsOf(std::vector<std::string>(24, "好"))).size(), 2U);  // 48 columns
}

TEST(Subtitles, AreWrittenAsTheTextIs) {
  EXPECT_EQ(cuesOf(wordsOf({"it", "costs", "five", "dollars", "isn't", "it"}), " It costs $5,\n\x1b isn\u2019t it? "),
            (std::vector<std::string>{"It costs $5, isn\u2019t it?"}));
  EXPECT_EQ(cuesOf(wordsOf({"doctor", "tom", "and", "jerry"}), "Dr. Tom & Jerry"),
            (std::vector<std::string>{"Dr. Tom & Jerry"}));
  EXPECT_EQ(cuesOf(wordsOf({"well", "no"}), "\u2013 Well \u2014 (laughs) no! \U0001F642"),
            (std::vector<std::string>{"\u2013 Well \u2014 no! \U0001F642"}));
  // What stands for several words is short.
  EXPECT_EQ(cuesOf(wordsOf({"a", "b"}), std::string(50, 'x')), (std::vector<std::string>{"a b"}));
}

/// What several words are read from stands for all of their time.
TEST(WrittenWords, HaveTheTimesOfTheirSpokenOnes) {
  const std::vector<WrittenWord> words = writtenWords(wordsOf({"on", "may", "the", "fifth", "we"}), "On 5/5 we");
  ASSERT_EQ(words.size(), 3U);
  EXPECT_EQ(words[1].text, "5/5");
  EXPECT_NEAR(words[1].span.start, 0.3, 1e-9);
  EXPECT_NEAR(words[1].span.end, 1.2, 1e-9);
}

TEST(WrittenWords, FollowLongTexts) {
  std::vector<std::string> spoken;
  std::string text;
  for (int i = 0; i < 3000; ++i) {
    const std::string word = "word" + std::to_string(i % 997);
    spoken.push_back(word);
    text += "W" + word.substr(1) + (i % 10 == 9 ? ". " : " ");
    if (i % 50 == 0) spoken.insert(spoken.end(), {"twenty", "five"}), text += "25 ";
  }
  const std::vector<WrittenWord> words = writtenWords(wordsOf(spoken), text);
  ASSERT_EQ(words.size(), 3060U);
  EXPECT_EQ(words[1].text, "25");
  for (std::size_t i = 0; i < words.size(); ++i) EXPECT_TRUE(words[i].text[0] == 'W' || words[i].text == "25") << i;
  // Where a long text is another one's, words stand as they are spoken.
  const std::vector<WrittenWord> others = writtenWords(wordsOf(spoken), std::string(4000, 'x') + " Word0");
  EXPECT_EQ(others.size(), writtenWords(wordsOf(spoken), {}).size());
}

TEST(Weights, AreJsonAndCsv) {
  const json own = json::parse(weightsJson(ramp()));
  EXPECT_EQ(own["names"], json({"jawOpen", "mouthClose"}));
  EXPECT_EQ(own["frames"].size(), 31U);
  EXPECT_NEAR(own["frames"][15][0].get<double>(), 1, 1e-6);
  // The fields that NVIDIA's samples of Audio2Face exports have.
  const json a2f = json::parse(audio2FaceJson(ramp()));
  EXPECT_EQ(a2f["exportFps"], 30.0);
  EXPECT_EQ(a2f["numPoses"], a2f["facsNames"].size());
  EXPECT_EQ(a2f["numFrames"], a2f["weightMat"].size());
  EXPECT_TRUE(
      weightsCsv(ramp()).starts_with("time_s,jawOpen,mouthClose\n0.000000,0.000000,0.000000\n0.033333,0.066667"));
}

TEST(Metahuman, EveryShapeMovesItsControls) {
  WeightTracks arkit{60, {}, RowMajorMatrixF::Zero(4, 52)};
  for (const std::string_view name : kArkitNames)
    arkit.names.push_back(lowerCase(name.substr(0, 1)) + std::string(name.substr(1)));
  const auto column = [](const WeightTracks& tracks, const std::string& name) {
    const auto found = std::find(tracks.names.begin(), tracks.names.end(), name);
    EXPECT_NE(found, tracks.names.end()) << name;
    return tracks.weights.col(found - tracks.names.begin()).eval();
  };
  const auto jaw = arkitIndex("jawOpen"), close = arkitIndex("mouthClose"), in = arkitIndex("eyeLookInLeft");
  arkit.weights.col(jaw) << 0, 0.5F, 0.5F, 1;
  arkit.weights.col(close) << 0.2F, 0.5F, 0.25F, 0;
  arkit.weights.col(in) << 0, 0, 1, 0;
  const WeightTracks controls = metahumanTracks(arkit);
  EXPECT_EQ(controls.names.size(), metahumanControls().size());
  EXPECT_EQ(column(controls, "CTRL_expressions_jawOpen"), arkit.weights.col(jaw));
  EXPECT_EQ(column(controls, "CTRL_expressions_eyeLookRightL"), arkit.weights.col(in)) << "to the nose";
  // Lips that are shut over an open jaw are wholly together, half of it half, and where the jaw is shut nothing is.
  const Eigen::Vector4f together = column(controls, "CTRL_expressions_mouthLipsTogetherUL");
  EXPECT_TRUE(together.isApprox(Eigen::Vector4f(0, 1, 0.5F / 0.8044F, 0), 1e-3F)) << together.transpose();
  std::set<std::string_view> shapes, names;
  for (const MetahumanControl& row : metahumanControls()) {
    EXPECT_TRUE(names.insert(row.control).second) << row.control;
    shapes.insert(row.arkit);
    EXPECT_NE(std::find(arkit.names.begin(), arkit.names.end(), row.arkit), arkit.names.end()) << row.arkit;
  }
  EXPECT_EQ(shapes.size(), 52U);
}

TEST(Metahuman, TheDocsHaveTheSameTable) {
  std::string table;
  std::string_view last;
  for (const MetahumanControl& row : metahumanControls()) {
    if (row.arkit != last) table += std::string(last.empty() ? "" : " |\n") + "| `" + std::string(row.arkit) + "` |";
    table += " `" + std::string(row.control) + "`";
    last = row.arkit;
  }
  const std::string page = readFile(std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "docs/formats/metahuman.md");
  EXPECT_NE(page.find(table + " |\n"), std::string::npos) << table;
}

TEST(Animations, KeepCornersAlone) {
  // A ramp up and down has three keys, a curve that rests two.
  const std::string maya = mayaAnim(ramp(), "blendShape1");
  EXPECT_NE(maya.find("anim jawOpen jawOpen blendShape1 0 0 0;"), std::string::npos);
  EXPECT_NE(maya.find("    0.000000 0.000000 linear linear 1 1 0;\n    0.500000 1.000000 linear linear 1 1 0;\n    "
                      "1.000000 0.000000"),
            std::string::npos)
      << maya;
  EXPECT_NE(maya.find("\ntimeUnit sec;\n"), std::string::npos);  // animImportExport has names of few rates
  EXPECT_NE(maya.find("\nstartTime 0;\nendTime 1.000000;\n"), std::string::npos);
  const std::string unity = unityAnim(ramp(), "hi");
  EXPECT_TRUE(unity.starts_with("%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n--- !u!74 &7400000\nAnimationClip:\n"));
  EXPECT_EQ(countOf(unity, "attribute: blendShape."), 2U);
  EXPECT_EQ(countOf(unity, "        time: "), 5U);
  EXPECT_NE(unity.find("value: 100.0000\n        inSlope: 200.0000\n        outSlope: -200.0000"), std::string::npos);
  const std::string godot = godotAnimation(ramp(), "hi", "Face");
  EXPECT_NE(godot.find("tracks/0/path = NodePath(\"Face:jawOpen\")"), std::string::npos);
  EXPECT_NE(godot.find("PackedFloat32Array(0.000000, 1, 0.000000, 0.500000, 1, 1.000000, 1.000000, 1, 0.000000)"),
            std::string::npos);
}

TEST(Animations, FollowSlowCurves) {
  WeightTracks slow{60, {"jawOpen"}, RowMajorMatrixF::Zero(601, 1)};
  for (Eigen::Index t = 0; t <= 600; ++t)
    slow.weights(t, 0) = 0.5F - 0.5F * std::cos(static_cast<float>(t) * 3.14159265F / 300);
  const std::string maya = mayaAnim(slow, "blendShape1");
  double worst = 0, last_frame = 0, last = 0;
  std::istringstream lines(maya.substr(maya.find("keys {") + 7));
  for (std::string key; std::getline(lines, key) && key.find(';') != std::string::npos;) {
    double frame = 0, value = 0;
    std::istringstream(key) >> frame >> value;
    frame = std::round(60 * frame);
    for (double t = last_frame; t < frame; t += 1) {
      const double shown = last + (value - last) * (t - last_frame) / (frame - last_frame);
      worst = std::max(worst, std::abs(shown - static_cast<double>(slow.weights(static_cast<Eigen::Index>(t), 0))));
    }
    last_frame = frame;
    last = value;
  }
  EXPECT_EQ(last_frame, 600);
  EXPECT_LT(worst, 2e-3);
}

TEST(Vrma, IsAGlb) {
  const std::string glb = vrmaBytes(ramp());
  EXPECT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_EQ(glb.size() % 4, 0U);
  const json root = json::parse(glb.substr(20, glb.find("BIN") - 24));
  EXPECT_EQ(root["extensions"]["VRMC_vrm_animation"]["expressions"]["preset"]["mouthClose"]["node"], 2);
}

}  // namespace
}  // namespace mouthpiece
