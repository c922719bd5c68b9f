#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace mouthpiece {

/// A word as a network wrote it, and the natural logarithm of its probability after those before it.
struct NetworkWord {
  std::string text;
  double log_probability = 0;
};

/// What word_network.cpp needs: `folder`/hear_words.mjs with its models, and Node to run it.
bool hasWordNetwork(const std::filesystem::path& folder);

/// The words of each of `sounds`, 16 kHz, a minute each at most; none for one of which the network makes no words.
/// English. A program of its own hears them all: docs/theory/hearing/recognition.md#a-network. Throws InputError where
/// it cannot.
std::vector<std::vector<NetworkWord>> hearWords(const std::filesystem::path& folder,
                                                std::span<const std::span<const std::int16_t>> sounds);

/// How likely a network finds a word of a text where it stands, natural logarithms: of its probability, and of that
/// over the likeliest's in its place.
struct WordScore {
  double log_probability = 0, behind = 0;
};

/// Of each of `sounds`, as above, the words of its text, none of them empty or with a blank in it, and last, that
/// nothing follows them; none where the sound is too short. Throws the same.
std::vector<std::vector<WordScore>> scoreWords(const std::filesystem::path& folder,
                                               std::span<const std::span<const std::int16_t>> sounds,
                                               std::span<const std::vector<std::string>> texts);

}  // namespace mouthpiece
