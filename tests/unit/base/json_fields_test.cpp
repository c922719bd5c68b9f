#include "base/json_fields.h"

#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>
#include <random>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/json_text.h"

namespace mouthpiece {
namespace {

/// What an InputError from `action` says; "" without one.
std::string complaint(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

JsonField song() {
  return parseJson(R"({"title": "Twinkle", "tempo": 90, "loud": true, "nothing": null, "side": "L",
                       "words": [{"word": "a", "notes": [{"beats": 1}, {"beats": -2}]}], "place": [1, 2.5, -3]})",
                   "song.json", "a song");
}

TEST(JsonFields, ReadsWhatIsThere) {
  const JsonField root = song();
  EXPECT_EQ(root["title"].text(), "Twinkle");
  EXPECT_EQ(root["tempo"].number(20, 300), 90);
  EXPECT_EQ(root["tempo"].whole(90, 90), 90);
  EXPECT_TRUE(root["loud"].flag());
  EXPECT_TRUE(root["nothing"].isNull());
  EXPECT_EQ(root["side"].choice(std::array<std::string_view, 3>{"R", "M", "L"}), 2U);
  EXPECT_EQ(root["place"].numbers(3, 3), Eigen::Vector3d(1, 2.5, -3));
  EXPECT_EQ(root["words"].list(1, 1)[0]["notes"].list().size(), 2U);
  EXPECT_EQ(root.members().front().first, "loud");
  EXPECT_FALSE(root["lyrics"].exists());
}

TEST(JsonFields, NamesThePlaceWhatItFoundAndWhatItExpected) {
  const JsonField root = song();
  const JsonField notes = root["words"].list()[0]["notes"];
  EXPECT_EQ(complaint([&] { (void)notes.list()[1]["beats"].number(0, 64); }),
            "song.json:words[0].notes[1].beats: found -2; expected a number from 0 to 64");
  EXPECT_EQ(complaint([&] { (void)notes.list()[0]["pitch"].name(); }),
            "song.json:words[0].notes[0].pitch: is missing; expected a name of 1 to 4096 printable bytes");
  EXPECT_EQ(complaint([&] { (void)root["tempo"]["x"]; }), "song.json:tempo: found 90; expected an object");
  EXPECT_EQ(complaint([&] { (void)root["words"].list(2, 9); }),
            "song.json:words: found a list of 1; expected a list of 2 to 9");
  EXPECT_EQ(complaint([&] { (void)root["title"].flag(); }),
            "song.json:title: found \"Twinkle\"; expected true or false");
  EXPECT_EQ(complaint([&] { (void)root["place"].numbers(3, 2.5); }),
            "song.json:place[2]: found -3; expected a number from -2.5 to 2.5");
  EXPECT_EQ(complaint([&] { (void)root["place"].list()[1].whole(0, 9); }),
            "song.json:place[1]: found 2.5; expected a whole number from 0 to 9");
  EXPECT_EQ(complaint([&] {
              (void)root["side"].choice(std::array<std::string_view, 2>{"R", "M"});
            }),
            "song.json:side: found \"L\"; expected one of R, M");
  EXPECT_EQ(complaint([&] { root.fail("has no end"); }), "song.json: has no end");
}

TEST(JsonFields, AFieldOutlivesTheRoot) {
  const JsonField beats = song()["words"].list()[0]["notes"].list()[0]["beats"];
  EXPECT_EQ(beats.number(), 1);
  EXPECT_EQ(beats.path(), "words[0].notes[0].beats");
}

TEST(JsonFields, RefusesWhatIsNoDocument) {
  EXPECT_EQ(complaint([] { (void)parseJson("{\"a\": ]", "x.json", "a song"); }),
            "x.json:1:7: is no valid JSON; expected a song");
  EXPECT_EQ(complaint([] { (void)parseJson("[1e999]", "x.json", "a song"); }),
            "x.json:1:6: holds a number out of range; expected a song");
  EXPECT_EQ(complaint([] { (void)parseJson(std::string(100000, '['), "x.json", "a song"); }),
            "x.json: is nested deeper than 32 levels; expected a song");
  EXPECT_NE(complaint([] { (void)parseJson("", "x.json", "a song"); }), "");
  EXPECT_NE(complaint([] { (void)parseCbor("\xFF", "x.face", "a face"); }), "");
  EXPECT_NE(complaint([] { (void)parseCbor("\x9B\x7F\xFF\xFF\xFF\xFF\xFF\xFF\xFF", "x.face", "a face"); }), "");
}

TEST(JsonFields, ReadsBlobsOfCbor) {
  const std::vector<double> numbers{1.5, -2, 1e300};
  ByteWriter raw(ByteOrder::kLittle);
  for (const double number : numbers) raw.writeF64(number);
  const nlohmann::json tree{
      {"blob", nlohmann::json::binary(std::vector<std::uint8_t>(raw.bytes().begin(), raw.bytes().end()))}};
  std::string bytes;
  nlohmann::json::to_cbor(tree, bytes);
  const JsonField root = parseCbor(bytes, "x.face", "a face");
  EXPECT_EQ(root["blob"].blob<double>(), numbers);
  EXPECT_EQ(root["blob"].blob<float>().size(), 6U);
  struct Odd {
    char bytes[7];
  };
  EXPECT_EQ(complaint([&] { (void)root["blob"].blob<Odd>(); }),
            "x.face:blob: found 24 bytes; expected a multiple of 7 bytes");
}

TEST(JsonFields, ReadsLongBlobsWhereTheyLie) {
  const std::vector<std::int32_t> counted{1, -2, 3}, long_one(500, 7);
  nlohmann::json tree{{"short", blobOf(counted)}, {"in", {{"long", blobOf(long_one)}, {"other", blobOf(long_one)}}}};
  const std::string bytes = cborBytes(tree);
  const JsonField root = parseCbor(bytes, "x.face", "a face");
  EXPECT_EQ(root["short"].blob<std::int32_t>(), counted);
  EXPECT_EQ(root["in"]["long"].blob<std::int32_t>(), long_one);
  const auto place = [&](const JsonField& field) { return reinterpret_cast<const char*>(field.bytes().data()); };
  EXPECT_EQ(place(root["in"]["long"]), bytes.data() + 9);
  EXPECT_EQ(place(root["in"]["other"]), bytes.data() + 9 + 2000);
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 10)
    EXPECT_NE(complaint([&] { (void)parseCbor(bytes.substr(0, size), "x.face", "a face"); }), "") << size;

  const auto told = [&](const nlohmann::json& where) {
    std::string hostile = bytes.substr(0, 9 + 4000);
    nlohmann::json::to_cbor(nlohmann::json{{"a", where}}, hostile);
    return complaint([&] { (void)parseCbor(hostile, "x.face", "a face")["a"].bytes(); });
  };
  EXPECT_EQ(told({{"at", 0}, {"bytes", 4000}}), "");
  EXPECT_EQ(told({{"at", 4001}, {"bytes", 0}}), "x.face:a.at: found 4001; expected a whole number from 0 to 4000");
  EXPECT_EQ(told({{"at", 1}, {"bytes", 4000}}), "x.face:a.bytes: found 4000; expected a whole number from 0 to 3999");
  EXPECT_EQ(told({{"at", -1}, {"bytes", 1}}), "x.face:a.at: found -1; expected a whole number from 0 to 4000");
  EXPECT_EQ(told({{"at", 1}}), "x.face:a.bytes: is missing; expected a whole number from 0 to 3999");
  EXPECT_EQ(told({0, 8}), "x.face:a: found a list of 2; expected a blob of bytes");
}

/// A random document; its leaves are numbers.
nlohmann::json randomTree(std::mt19937& random, int depth) {
  if (depth == 0 || random() % 4 == 0) return static_cast<double>(random() % 1000) / 8;
  nlohmann::json tree = random() % 2 == 0 ? nlohmann::json::array() : nlohmann::json::object();
  for (std::size_t i = 0, count = random() % 5; i < count; ++i) {
    if (tree.is_array()) {
      tree.push_back(randomTree(random, depth - 1));
    } else {
      tree["key" + std::to_string(i)] = randomTree(random, depth - 1);
    }
  }
  return tree;
}

/// Every place is reached by its own path, with the value the library itself finds there.
void expectSamePlaces(const JsonField& field, const nlohmann::json& tree, const std::string& path) {
  EXPECT_EQ(field.path(), path);
  if (tree.is_array()) {
    const std::vector<JsonField> entries = field.list();
    ASSERT_EQ(entries.size(), tree.size());
    for (std::size_t i = 0; i < entries.size(); ++i)
      expectSamePlaces(entries[i], tree[i], path + "[" + std::to_string(i) + "]");
  } else if (tree.is_object()) {
    for (const auto& [key, entry] : field.members())
      expectSamePlaces(entry, tree.at(key), path + (path.empty() ? "" : ".") + key);
  } else {
    EXPECT_EQ(field.number(), tree.get<double>());
  }
}

TEST(JsonFields, RandomDocumentsKeepTheirPlaces) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const nlohmann::json tree = randomTree(random, 5);
    expectSamePlaces(parseJson(tree.dump(), "x", "a tree"), tree, "");
  }
}

}  // namespace
}  // namespace mouthpiece
