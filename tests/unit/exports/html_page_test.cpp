#include "exports/format_bytes.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "exports/gltf/glb.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

using nlohmann::json;
using samples::makeTalkingHead;
using samples::TalkingHead;

constexpr std::string_view kTemplate = "<body>\n<!-- mouthpiece:data -->\n<script>run()</script></body>";

std::string pageOf(const TalkingHead& head, std::string_view page_template = kTemplate) {
  return viewHtml(page_template, {head.utterance, "glTF bytes", head.mesh, "egg", head.marker_names,
                                  head.utterance.motion.positions_mm});
}

/// The text of the element with that id.
std::string elementText(const std::string& html, const std::string& id) {
  const std::size_t tag = html.find("id=\"" + id + "\">");
  if (tag == std::string::npos) return "";
  const std::size_t start = html.find('>', tag) + 1;
  return html.substr(start, html.find("</script>", start) - start);
}

/// The bytes that an element holds deflated.
std::string unpacked(const std::string& html, const std::string& id) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned value = 0, bits = 0;
  for (const char c : elementText(html, id)) {
    const std::size_t digit = kDigits.find(c);
    if (digit == std::string_view::npos) break;
    value = (value << 6U) | static_cast<unsigned>(digit);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>((value >> bits) & 0xFFU);
  }
  std::string out(1 << 20, '\0');
  uLongf size = out.size();
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                       bytes.size()),
            Z_OK);
  out.resize(size);
  return out;
}

std::size_t count(const std::string& text, std::string_view part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

TEST(ViewHtml, HoldsTheReportTheFaceAndTheSound) {
  const TalkingHead head = makeTalkingHead();
  const std::string html = pageOf(head);
  EXPECT_EQ(html.find(kViewPagePlaceholder), std::string::npos);
  EXPECT_EQ(unpacked(html, "mouthpiece-face"), "glTF bytes");
  EXPECT_TRUE(unpacked(html, "mouthpiece-sound").starts_with("RIFF"));
  const json data = json::parse(elementText(html, "mouthpiece-data"));
  EXPECT_EQ(data["report"]["text"], "mama");
  EXPECT_EQ(data["face"], "egg");
  EXPECT_EQ(
      data["parts"],
      json::parse(
          R"([{"name": "upper head", "kind": "skin", "material": -1}, {"name": "lower head", "kind": "lips", "material": -1},
              {"name": "eyes", "kind": "eye", "material": -1}])"));
  EXPECT_EQ(data["control"]["count"], 3);
  EXPECT_EQ(data["control"]["frames"], 120);
  EXPECT_EQ(data["control"]["positions_m"].get<std::string>().size(), 120U * 9 * 4 / 3 * 4);
  EXPECT_EQ(data["lip_opening_mm"].size(), 120U);
}

// Words come from the command line, names of takes from files: neither may end the script element or start another.
TEST(ViewHtml, HostileTextStaysData) {
  for (const std::string word : {"</script><img src=x onerror=alert(1)>", "<!--<script>", "]]>\"'&lt;",
                                 "\xE2\x80\xA8 \xE2\x80\xA9", "\xC0\xAF broken \xFF", "<!-- mouthpiece:data -->"}) {
    const std::string html = pageOf(makeTalkingHead({.word = word}));
    EXPECT_EQ(count(html, "<script"), 4U) << word;
    EXPECT_EQ(count(html, "</script>"), 4U) << word;
    EXPECT_EQ(count(html, "<img"), 0U) << word;
    EXPECT_EQ(count(html, "<!--"), 0U) << word;
    const std::string text = elementText(html, "mouthpiece-data");
    EXPECT_EQ(text.find_first_of("<>&"), std::string::npos) << word;
    EXPECT_TRUE(std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c < 0x7F; })) << word;
    const json data = json::parse(text);
    if (word.find('\xFF') == std::string::npos) {
      EXPECT_EQ(data["report"]["phones"][1]["word"], word);
    }
  }
}

TEST(ViewHtml, TheSoundLastsAsLongAsTheMotion) {
  TalkingHead head = makeTalkingHead();
  head.utterance.audio.samples.resize(16000);
  EXPECT_EQ(unpacked(pageOf(head), "mouthpiece-sound").size(), 44 + 2 * 32000U);
}

TEST(ViewHtml, ATemplateWithoutThePlaceIsRefused) {
  EXPECT_THROW(pageOf(makeTalkingHead(), "<html></html>"), InputError);
}

TEST(ViewHtml, TellsTheDistanceOfTheLipMarkers) {
  const auto openingOf = [](const TalkingHead& head) {
    return json::parse(elementText(pageOf(head), "mouthpiece-data"))["lip_opening_mm"].get<std::vector<double>>();
  };
  TalkingHead head = makeTalkingHead();
  const std::vector<double> opening = openingOf(head);
  ASSERT_EQ(opening.size(), 120U);
  EXPECT_NEAR(opening[0], 1, 0.5);
  EXPECT_GT(opening[30], 20);
  for (std::string& name : head.utterance.motion.marker_names) name = "X" + name;
  EXPECT_TRUE(openingOf(head).empty());
}

}  // namespace
}  // namespace mouthpiece
