#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace mouthpiece::english_text {

bool areCapitals(std::string_view word);
std::string capitals(std::string_view word);
/// "FBI" -> "F B I". A last A has a point before it, "U S.A": standing alone before a word it would be the article.
std::string letterByLetter(std::string_view word);

/// The words of what is no word: initialisms, addresses, accounts, and what has letters and digits in it.
class Speller {
 public:
  /// `is_loud`: all of the text is capitals, so that they say nothing about a word.
  explicit Speller(bool is_loud) : is_loud_(is_loud) {}

  /// An address of mail or of the web without the punctuation after it; nullopt for none.
  [[nodiscard]] std::optional<std::string> address(std::string_view core) const;
  /// "ThrowbackThursday_2" -> "Throwback Thursday two".
  [[nodiscard]] std::string pieces(std::string_view name) const;
  /// "AT&T's" -> "A T&T's"; nullopt where nothing in it is said letter by letter, or digits are in it.
  [[nodiscard]] std::optional<std::string> capitalsWithin(std::string_view body) const;
  /// "MP3s" -> "M P threes"; nullopt where no digit is in it.
  [[nodiscard]] std::optional<std::string> mixed(std::string_view body) const;

 private:
  [[nodiscard]] std::optional<std::string> spelt(std::string_view part) const;
  /// Capitals as letters, where they are; else as it stands.
  [[nodiscard]] std::string capitalsIn(std::string_view part) const;
  /// Letters beside digits or in an address.
  [[nodiscard]] std::string lettersIn(std::string_view run) const;

  bool is_loud_;
};

}  // namespace mouthpiece::english_text
