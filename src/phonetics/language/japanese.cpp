#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "phonetics/language/espeak_languages.h"
#include "phonetics/language/japanese_readings.h"
#include "phonetics/language/kana.h"
#include "phonetics/language/language.h"

namespace mouthpiece {
namespace {

/// Open JTalk's dictionary, and a reader of dictionaries of its kind.
constexpr const char* kDictionary = "/var/lib/mecab/dic/open-jtalk/naist-jdic";
constexpr const char* kPackages = "sudo apt-get install mecab open-jtalk-mecab-naist-jdic";
constexpr Seconds kTimeLimitMecab = 30;

/// What the dictionary's package leaves to its reader: a word, its pronunciation in katakana, its class.
constexpr std::string_view kDictionarySettings =
    "cost-factor = 700\nbos-feature = BOS/EOS,*,*,*,*,*,*,*,*\neval-size = 8\nunk-eval-size = 4\n"
    "config-charset = UTF-8\noutput-format-type = pron\nnode-format-pron = %m\\t%f[8]\\n\n"
    "unk-format-pron = %m\\t\\n\neos-format-pron = \\n\n";

/// A sign of katakana and its sounds; two signs where the second is small.
struct Kana {
  std::string_view kana, ipa;
};
constexpr Kana kKana[] = {
    {"キャ", "kʲ a"}, {"キュ", "kʲ ɯ"}, {"キョ", "kʲ o"}, {"ギャ", "ɡʲ a"},  {"ギュ", "ɡʲ ɯ"}, {"ギョ", "ɡʲ o"},
    {"シャ", "ɕ a"},  {"シュ", "ɕ ɯ"},  {"ショ", "ɕ o"},  {"シェ", "ɕ e"},   {"ジャ", "dʑ a"}, {"ジュ", "dʑ ɯ"},
    {"ジョ", "dʑ o"}, {"ジェ", "dʑ e"}, {"チャ", "tɕ a"}, {"チュ", "tɕ ɯ"},  {"チョ", "tɕ o"}, {"チェ", "tɕ e"},
    {"ニャ", "ɲ a"},  {"ニュ", "ɲ ɯ"},  {"ニョ", "ɲ o"},  {"ヒャ", "ç a"},   {"ヒュ", "ç ɯ"},  {"ヒョ", "ç o"},
    {"ビャ", "bʲ a"}, {"ビュ", "bʲ ɯ"}, {"ビョ", "bʲ o"}, {"ピャ", "pʲ a"},  {"ピュ", "pʲ ɯ"}, {"ピョ", "pʲ o"},
    {"ミャ", "mʲ a"}, {"ミュ", "mʲ ɯ"}, {"ミョ", "mʲ o"}, {"リャ", "ɾʲ a"},  {"リュ", "ɾʲ ɯ"}, {"リョ", "ɾʲ o"},
    {"ファ", "ɸ a"},  {"フィ", "ɸ i"},  {"フェ", "ɸ e"},  {"フォ", "ɸ o"},   {"フュ", "ɸ ɯ"},  {"ティ", "t i"},
    {"ディ", "d i"},  {"トゥ", "t ɯ"},  {"ドゥ", "d ɯ"},  {"デュ", "d j ɯ"}, {"ウィ", "w i"},  {"ウェ", "w e"},
    {"ウォ", "w o"},  {"ツァ", "ts a"}, {"ツィ", "ts i"}, {"ツェ", "ts e"},  {"ツォ", "ts o"}, {"ヴァ", "v a"},
    {"ヴィ", "v i"},  {"ヴェ", "v e"},  {"ヴォ", "v o"},  {"イェ", "j e"},   {"ア", "a"},      {"イ", "i"},
    {"ウ", "ɯ"},      {"エ", "e"},      {"オ", "o"},      {"カ", "k a"},     {"キ", "kʲ i"},   {"ク", "k ɯ"},
    {"ケ", "k e"},    {"コ", "k o"},    {"ガ", "ɡ a"},    {"ギ", "ɡʲ i"},    {"グ", "ɡ ɯ"},    {"ゲ", "ɡ e"},
    {"ゴ", "ɡ o"},    {"サ", "s a"},    {"シ", "ɕ i"},    {"ス", "s ɯ"},     {"セ", "s e"},    {"ソ", "s o"},
    {"ザ", "z a"},    {"ジ", "dʑ i"},   {"ズ", "z ɯ"},    {"ゼ", "z e"},     {"ゾ", "z o"},    {"タ", "t a"},
    {"チ", "tɕ i"},   {"ツ", "ts ɯ"},   {"テ", "t e"},    {"ト", "t o"},     {"ダ", "d a"},    {"ヂ", "dʑ i"},
    {"ヅ", "z ɯ"},    {"デ", "d e"},    {"ド", "d o"},    {"ナ", "n a"},     {"ニ", "ɲ i"},    {"ヌ", "n ɯ"},
    {"ネ", "n e"},    {"ノ", "n o"},    {"ハ", "h a"},    {"ヒ", "ç i"},     {"フ", "ɸ ɯ"},    {"ヘ", "h e"},
    {"ホ", "h o"},    {"バ", "b a"},    {"ビ", "bʲ i"},   {"ブ", "b ɯ"},     {"ベ", "b e"},    {"ボ", "b o"},
    {"パ", "p a"},    {"ピ", "pʲ i"},   {"プ", "p ɯ"},    {"ペ", "p e"},     {"ポ", "p o"},    {"マ", "m a"},
    {"ミ", "mʲ i"},   {"ム", "m ɯ"},    {"メ", "m e"},    {"モ", "m o"},     {"ヤ", "j a"},    {"ユ", "j ɯ"},
    {"ヨ", "j o"},    {"ラ", "ɾ a"},    {"リ", "ɾʲ i"},   {"ル", "ɾ ɯ"},     {"レ", "ɾ e"},    {"ロ", "ɾ o"},
    {"ワ", "w a"},    {"ヰ", "i"},      {"ヱ", "e"},      {"ヲ", "o"},       {"ヴ", "v ɯ"},    {"ァ", "a"},
    {"ィ", "i"},      {"ゥ", "ɯ"},      {"ェ", "e"},      {"ォ", "o"},       {"ャ", "j a"},    {"ュ", "j ɯ"},
    {"ョ", "j o"}};

bool isLabial(std::string_view ipa) { return ipa.starts_with('m') || ipa.starts_with('b') || ipa.starts_with('p'); }

/// The symbols of a reading in katakana; empty where it has other signs. ッ lengthens the next consonant, ー the vowel
/// before, ン is m before lips and n elsewhere.
std::vector<std::string> symbolsOfKana(std::string_view kana) {
  std::vector<std::string> symbols;
  bool doubles = false;
  while (!kana.empty()) {
    const auto take = [&](std::string_view sign) {
      if (!kana.starts_with(sign)) return false;
      kana.remove_prefix(sign.size());
      return true;
    };
    if (take("’") || take("'")) continue;  // a vowel without voice
    if (take("ー")) {
      if (!symbols.empty() && !symbols.back().ends_with("ː")) symbols.back() += "ː";
      continue;
    }
    if (take("ッ")) {
      doubles = true;
      continue;
    }
    const auto row = std::find_if(std::begin(kKana), std::end(kKana),
                                  [&](const Kana& known) { return kana.starts_with(known.kana); });
    if (take("ン")) {
      const auto next = std::find_if(std::begin(kKana), std::end(kKana),
                                     [&](const Kana& known) { return kana.starts_with(known.kana); });
      symbols.emplace_back(next != std::end(kKana) && isLabial(next->ipa) ? "m" : kana.empty() ? "ɴ" : "n");
      continue;
    }
    if (row == std::end(kKana)) return {};
    kana.remove_prefix(row->kana.size());
    for (std::string_view rest = row->ipa; !rest.empty();) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      symbols.emplace_back(rest.substr(0, end));
      if (std::exchange(doubles, false)) symbols.back() += "ː";
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
  return symbols;
}

/// The dictionary knows digits and Latin letters in their full width.
std::string fullWidth(std::string_view text) {
  std::string wide;
  for (const char c : text) {
    const bool is_word = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (is_word) {
      appendUtf8(wide, static_cast<char32_t>(0xFEE0 + c));
    } else {
      wide += c;
    }
  }
  return wide;
}

/// Lines of "word TAB reading".
std::string readingLines(std::string_view sentence) {
  const auto program = findProgram("mecab");
  if (!program || !std::filesystem::exists(std::filesystem::path(kDictionary) / "sys.dic"))
    throw InputError("Japanese", "", fmt::format("needs Open JTalk's dictionary ({})", kPackages));
  const PrivateFolder folder;
  for (const auto& file : std::filesystem::directory_iterator(kDictionary))
    std::filesystem::create_symlink(file.path(), folder.path() / file.path().filename());
  writeFileAtomically(folder.path() / "dicrc", std::string(kDictionarySettings));
  writeFileAtomically(folder.path() / "in.txt", fullWidth(sentence) + "\n");
  const ChildResult result =
      runChild(*program, {"-r", "dicrc", "-d", ".", "-o", "out.txt", "in.txt"}, folder.path(), kTimeLimitMecab);
  if (result.exit_code != 0 || !std::filesystem::exists(folder.path() / "out.txt"))
    throw InputError("mecab", "", fmt::format("failed: {}; expected readings", printable(result.output, 200)));
  return readFile(folder.path() / "out.txt");
}

std::vector<JapaneseReading> readingsOf(std::string_view sentence) {
  std::vector<JapaneseReading> words;
  const std::string lines = readingLines(sentence);
  for (std::string_view rest = lines; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    const std::size_t tab = line.find('\t');
    if (tab == std::string_view::npos) continue;
    const std::string_view kana = line.substr(tab + 1);
    // Unknown words in kana are read as they stand.
    words.push_back(
        {std::string(line.substr(0, tab)), kana.empty() ? katakanaOf(line.substr(0, tab)) : std::string(kana)});
  }
  return withCountedNumbers(words);
}

/// Its phones by the reading; none where it has other signs than katakana.
Pronunciation pronunciationOf(std::string_view kana, const Language& language) {
  Pronunciation said;
  std::vector<std::string> unknown;
  for (const std::string& symbol : symbolsOfKana(kana)) {
    for (SpelledPhone& phone : phonesOfSymbol(symbol, PhoneSet::kIpa, language, unknown)) {
      said.phones.push_back(phone.phone);
      said.heard.push_back(phone.heard);
      said.stress.push_back(-1);
      said.ipa.push_back(std::move(phone.ipa));
    }
  }
  return said;
}

std::vector<SaidWord> sayJapanese(std::string_view sentence, const Language& language) {
  std::vector<SaidWord> words;
  for (const auto& [text, kana] : readingsOf(sentence)) {
    SaidWord word{text, pronunciationOf(kana, language)};
    const std::string latin = word.said.phones.empty() ? latinWord(text) : "";
    if (!latin.empty()) word = {latin, english().pronounce(latin)};
    words.push_back(std::move(word));
  }
  return words;
}

}  // namespace

Pronunciation pronounceKana(std::string_view kana) { return pronunciationOf(katakanaOf(kana), japanese()); }

const Language& japanese() {
  static const Language kJapanese = [] {
    Language language = worldLanguage("ja", "Japanese");
    language.say = sayJapanese;
    language.is_tuned = false;
    return language;
  }();
  return kJapanese;
}

}  // namespace mouthpiece
