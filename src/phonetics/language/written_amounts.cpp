#include "phonetics/language/written_amounts.h"

#include <unicode/measunit.h>
#include <unicode/numberformatter.h>
#include <unicode/numfmt.h>
#include <unicode/rbnf.h>
#include <unicode/regex.h>
#include <unicode/smpdtfmt.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace mouthpiece {
namespace {

using icu::UnicodeString;

struct UnitSign {
  std::u16string_view sign;
  const char* unit;  ///< CLDR's
};
/// Longer ones before those that they begin with.
constexpr UnitSign kUnits[] = {{u"km/h", "kilometer-per-hour"},
                               {u"km²", "square-kilometer"},
                               {u"km", "kilometer"},
                               {u"kWh", "kilowatt-hour"},
                               {u"kW", "kilowatt"},
                               {u"kHz", "kilohertz"},
                               {u"kcal", "kilocalorie"},
                               {u"kg", "kilogram"},
                               {u"kB", "kilobyte"},
                               {u"m/s", "meter-per-second"},
                               {u"mg", "milligram"},
                               {u"ml", "milliliter"},
                               {u"mm", "millimeter"},
                               {u"ms", "millisecond"},
                               {u"min", "minute"},
                               {u"m²", "square-meter"},
                               {u"m³", "cubic-meter"},
                               {u"m", "meter"},
                               {u"cm²", "square-centimeter"},
                               {u"cm³", "cubic-centimeter"},
                               {u"cm", "centimeter"},
                               {u"cl", "centiliter"},
                               {u"dl", "deciliter"},
                               {u"dm", "decimeter"},
                               {u"°C", "celsius"},
                               {u"°F", "fahrenheit"},
                               {u"°", "degree"},
                               {u"MHz", "megahertz"},
                               {u"MB", "megabyte"},
                               {u"MW", "megawatt"},
                               {u"GHz", "gigahertz"},
                               {u"GB", "gigabyte"},
                               {u"GW", "gigawatt"},
                               {u"TB", "terabyte"},
                               {u"Hz", "hertz"},
                               {u"hPa", "hectopascal"},
                               {u"ha", "hectare"},
                               {u"h", "hour"},
                               {u"g", "gram"},
                               {u"l", "liter"},
                               {u"L", "liter"},
                               {u"s", "second"},
                               {u"V", "volt"},
                               {u"W", "watt"}};

/// What CLDR has no words for.
struct Fractions {
  std::string_view language;
  const char16_t* to;  ///< between the ends of a range
  const char16_t *half, *third, *two_thirds, *quarter, *three_quarters;
  const char16_t *and_half, *with;  ///< after a whole number: a half, and what comes before another part
};
constexpr Fractions kFractions[] = {
    {"de", u"bis", u"ein halb", u"ein Drittel", u"zwei Drittel", u"ein Viertel", u"drei Viertel", u"einhalb", u""},
    {"es", u"a", u"medio", u"un tercio", u"dos tercios", u"un cuarto", u"tres cuartos", u"y medio", u"y "},
    {"fr", u"à", u"un demi", u"un tiers", u"deux tiers", u"un quart", u"trois quarts", u"et demi", u"et "},
    {"it", u"a", u"mezzo", u"un terzo", u"due terzi", u"un quarto", u"tre quarti", u"e mezzo", u"e "},
    {"pt", u"a", u"meio", u"um terço", u"dois terços", u"um quarto", u"três quartos", u"e meio", u"e "},
    {"pl", u"do", u"pół", u"jedna trzecia", u"dwie trzecie", u"jedna czwarta", u"trzy czwarte", u"i pół", u"i "},
    {"nl", u"tot", u"een half", u"een derde", u"twee derde", u"een kwart", u"drie kwart", u"en een half", u"en "}};

class Amounts {
 public:
  Amounts(UnicodeString text, std::string_view locale) : text_(std::move(text)), locale_(std::string(locale).c_str()) {
    const auto row = std::find_if(std::begin(kFractions), std::end(kFractions),
                                  [&](const Fractions& known) { return known.language == locale_.getLanguage(); });
    fractions_ = row == std::end(kFractions) ? nullptr : row;
  }

  UnicodeString read() {
    sayDates();
    sayTimes();
    sayMoney();
    saySignedOrdinals();
    sayUnits();
    if (fractions_ != nullptr) sayFractions();
    if (isIn("de")) sayOrdinals();
    if (isIn("de") || isIn("nl")) sayYears();
    return std::move(text_);
  }

 private:
  using Match = icu::RegexMatcher;
  /// No letter and no number goes on before or behind.
  static constexpr const char16_t *kBegins = u"(?<![\\p{L}\\p{N}.,/-])", *kNumber = u"\\p{Nd}(?:[\\p{Nd}.,]*\\p{Nd})?",
                                  *kEnds = u"(?![\\p{L}\\p{N}²³/'’]|[.,]\\p{N})";

  [[nodiscard]] bool isIn(std::string_view language) const { return locale_.getLanguage() == language; }

  static UnicodeString part(Match& match, int group) {
    UErrorCode error = U_ZERO_ERROR;
    return match.group(group, error);
  }
  static int valueOf(const UnicodeString& digits) {
    int value = 0;
    for (int i = 0; i < std::min(digits.length(), 4); ++i) value = 10 * value + u_charDigitValue(digits.char32At(i));
    return value;
  }

  /// Puts what `say` makes of each place that `pattern` finds in its stead; nullopt leaves it.
  void replace(const UnicodeString& pattern, const std::function<std::optional<UnicodeString>(Match&)>& say) {
    UErrorCode error = U_ZERO_ERROR;
    thread_local std::map<UnicodeString, std::unique_ptr<icu::RegexPattern>> compiled;
    std::unique_ptr<icu::RegexPattern>& found = compiled[pattern];
    if (!found) found.reset(icu::RegexPattern::compile(pattern, 0, error));
    const std::unique_ptr<Match> matcher(U_SUCCESS(error) ? found->matcher(text_, error) : nullptr);
    if (!matcher) return;
    Match& match = *matcher;
    match.setTimeLimit(kLongest, error);
    UnicodeString out;
    int done = 0;
    while (U_SUCCESS(error) && match.find(error)) {
      const std::optional<UnicodeString> said = say(match);
      const int begin = match.start(error), end = match.end(error);
      out.append(text_, done, begin - done);
      out += said ? *said : text_.tempSubStringBetween(begin, end);
      done = end;
    }
    out.append(text_, done, text_.length() - done);
    text_ = std::move(out);
  }

  /// 12.05.1960, 12/05/1960, 1960-05-12: day, month's name and year in the language's order.
  void sayDates() {
    const UnicodeString begins(kBegins), ends(kEnds);
    replace(begins + u"(?:(\\p{Nd}{1,2})([./-])(\\p{Nd}{1,2})\\2(\\p{Nd}{4})|(\\p{Nd}{4})-(\\p{Nd}{2})-(\\p{Nd}{2}))" +
                ends,
            [&](Match& match) -> std::optional<UnicodeString> {
              const bool is_iso = part(match, 1).isEmpty();
              const int day = valueOf(part(match, is_iso ? 7 : 1)), month = valueOf(part(match, is_iso ? 6 : 3));
              if (day < 1 || day > 31 || month < 1 || month > 12) return std::nullopt;
              UErrorCode error = U_ZERO_ERROR;
              icu::Locale gregorian = locale_;
              gregorian.setKeywordValue("calendar", "gregorian", error);
              gregorian.setKeywordValue("numbers", "latn", error);
              const std::unique_ptr<icu::DateFormat> format(
                  icu::DateFormat::createDateInstance(icu::DateFormat::kLong, gregorian));
              const std::unique_ptr<icu::Calendar> calendar(
                  icu::Calendar::createInstance(*icu::TimeZone::getGMT(), gregorian, error));
              if (!format || U_FAILURE(error)) return std::nullopt;
              calendar->setLenient(false);  // the 31st of February stays digits
              calendar->clear();
              calendar->set(valueOf(part(match, is_iso ? 5 : 4)), month - 1, day);
              format->setTimeZone(*icu::TimeZone::getGMT());
              UnicodeString said;
              format->format(calendar->getTime(error), said);
              return U_SUCCESS(error) ? std::optional(said) : std::nullopt;
            });
  }

  /// 14:30 Uhr, 14h30.
  void sayTimes() {
    const auto say = [](const UnicodeString& hours, const UnicodeString& name, int minutes) {
      UnicodeString said = hours + u" " + name;
      if (minutes > 0) said += u" " + UnicodeString(std::to_string(minutes).c_str());
      return said;
    };
    if (isIn("de"))
      replace(UnicodeString(kBegins) + u"(\\p{Nd}{1,2})[:.](\\p{Nd}{2})\\s?Uhr" + kEnds,
              [&](Match& match) { return std::optional(say(part(match, 1), u"Uhr", valueOf(part(match, 2)))); });
    if (isIn("fr") || isIn("pt"))
      replace(UnicodeString(kBegins) + u"(\\p{Nd}{1,2})\\s?h\\s?(\\p{Nd}{2})" + kEnds,
              [&](Match& match) -> std::optional<UnicodeString> {
                const std::optional<UnicodeString> name = nameOf("hour", part(match, 1));
                if (!name) return std::nullopt;
                return say(part(match, 1), *name, valueOf(part(match, 2)));
              });
  }

  /// The signs that eSpeak does not name in the language, before an amount.
  void sayMoney() {
    const UnicodeString amount = UnicodeString(u"\\s?(") + kNumber + u")" + kEnds;
    if (isIn("pt"))
      replace(UnicodeString(u"(?<!\\p{L})R\\$") + amount, [&](Match& match) {
        return std::optional(part(match, 1) + (part(match, 1) == u"1" ? u" real" : u" reais"));
      });
    if (isIn("nl"))
      replace(UnicodeString(u"€") + amount, [&](Match& match) { return std::optional(part(match, 1) + u" euro"); });
  }

  /// 2.º, 3ª, and 1° before a month: with a degree's sign for want of the right one.
  void saySignedOrdinals() {
    if (!isIn("es") && !isIn("pt") && !isIn("it")) return;
    replace(UnicodeString(kBegins) + u"(\\p{Nd}{1,3})\\.?([ºª])(?![\\p{L}\\p{N}])", [&](Match& match) {
      return std::optional(spelledOut(valueOf(part(match, 1)), part(match, 2) == u"ª"
                                                                   ? u"%spellout-ordinal-feminine"
                                                                   : u"%spellout-ordinal-masculine"));
    });
    if (isIn("it"))
      replace(UnicodeString(kBegins) +
                  u"1°(?=\\s+(?i:gennaio|febbraio|marzo|aprile|maggio|giugno|luglio|agosto|"
                  u"settembre|ottobre|novembre|dicembre)(?!\\p{L}))",
              [](Match&) { return std::optional(UnicodeString(u"primo")); });
  }

  void sayFractions() {
    const auto say = [&](const UnicodeString& whole, const UnicodeString& written) -> std::optional<UnicodeString> {
      const Fractions& words = *fractions_;
      const bool is_half = written == u"½" || written == u"1/2";
      const char16_t* said = is_half                                ? words.half
                             : written == u"⅓" || written == u"1/3" ? words.third
                             : written == u"⅔" || written == u"2/3" ? words.two_thirds
                             : written == u"¼" || written == u"1/4" ? words.quarter
                             : written == u"¾" || written == u"3/4" ? words.three_quarters
                                                                    : nullptr;
      if (said == nullptr) return std::nullopt;
      if (whole.isEmpty()) return UnicodeString(said);
      if (is_half && isIn("de") && whole == u"1") return UnicodeString(u"eineinhalb");
      return whole + u" " + (is_half ? UnicodeString(words.and_half) : UnicodeString(words.with) + said);
    };
    replace(UnicodeString(kBegins) + u"(?:(\\p{Nd}+)\\s)?([123]/[234])" + kEnds,
            [&](Match& match) { return say(part(match, 1), part(match, 2)); });
    replace(UnicodeString(kBegins) + u"(?:(\\p{Nd}+)\\s?)?([½⅓⅔¼¾])(?![\\p{N}])",
            [&](Match& match) { return say(part(match, 1), part(match, 2)); });
  }

  /// 5 kg, 5-10 kg.
  void sayUnits() {
    UnicodeString signs;
    for (const UnitSign& row : kUnits) {
      if (!signs.isEmpty()) signs += u"|";
      signs.append(row.sign.data(), static_cast<int>(row.sign.size()));
    }
    const UnicodeString number = UnicodeString(u"(?:(?:\\p{Nd}+\\s)?[123]/[234]|\\p{Nd}*\\s?[½⅓⅔¼¾]|") + kNumber + u")";
    replace(UnicodeString(u"(?<![\\p{L}\\p{N}.,/])(?:(") + number + u")\\s?[-–]\\s?)?(" + number + u")\\s?(" + signs +
                u")" + kEnds,
            [&](Match& match) -> std::optional<UnicodeString> {
              const UnicodeString sign = part(match, 3);
              const auto row = std::find_if(std::begin(kUnits), std::end(kUnits), [&](const UnitSign& known) {
                return sign == UnicodeString(known.sign.data(), static_cast<int>(known.sign.size()));
              });
              const UnicodeString from = part(match, 1), count = part(match, 2);
              const std::optional<UnicodeString> name = nameOf(row->unit, count);
              if (!name) return std::nullopt;
              const UnicodeString to(fractions_ == nullptr ? u" - " : fractions_->to);
              return (from.isEmpty() ? UnicodeString() : from + u" " + to + u" ") + count + u" " + *name;
            });
  }

  /// Of as many as `count` says.
  [[nodiscard]] std::optional<UnicodeString> nameOf(const char* unit, const UnicodeString& count) const {
    UErrorCode error = U_ZERO_ERROR;
    const std::unique_ptr<icu::NumberFormat> reader(icu::NumberFormat::createInstance(locale_, error));
    icu::Formattable value(1.0);  // of a fraction: half a litre
    const bool is_fraction =
        count.indexOf(u'/') >= 0 || UnicodeString(u"½⅓⅔¼¾").indexOf(count.charAt(count.length() - 1)) >= 0;
    if (U_SUCCESS(error) && !is_fraction) reader->parse(count, value, error);
    const icu::number::FormattedNumber said = icu::number::NumberFormatter::withLocale(locale_)
                                                  .unit(icu::MeasureUnit::forIdentifier(unit, error))
                                                  .unitWidth(UNUM_UNIT_WIDTH_FULL_NAME)
                                                  .formatDouble(value.getDouble(error), error);
    icu::ConstrainedFieldPosition place;
    place.constrainField(UFIELD_CATEGORY_NUMBER, UNUM_MEASURE_UNIT_FIELD);
    const UnicodeString whole = said.toString(error);
    if (U_FAILURE(error) || !said.nextPosition(place, error)) return std::nullopt;
    return UnicodeString(whole, place.getStart(), place.getLimit() - place.getStart());
  }

  [[nodiscard]] UnicodeString spelledOut(int number, const char16_t* rules) const {
    UErrorCode error = U_ZERO_ERROR;
    thread_local std::map<std::string, std::unique_ptr<icu::RuleBasedNumberFormat>> made;
    std::unique_ptr<icu::RuleBasedNumberFormat>& format = made[locale_.getName()];
    if (!format) format = std::make_unique<icu::RuleBasedNumberFormat>(icu::URBNF_SPELLOUT, locale_, error);
    UnicodeString words;
    icu::FieldPosition place;
    if (U_FAILURE(error))
      format.reset();
    else
      format->format(number, UnicodeString(rules), words, place, error);
    return words.findAndReplace(UnicodeString(u'\u00ad'), UnicodeString());
  }

  /// "der 2. Weltkrieg", "am 3. Oktober", "die 5., 6. und 7. Klasse" only their last.
  void sayOrdinals() {
    constexpr const char16_t* kMonths =
        u"Jan(?:uar|\\.)|Feb(?:ruar|\\.)|März|Apr(?:il|\\.)|Mai|Juni?|Juli?|Aug(?:ust|\\.)|Sept?(?:ember|\\.)|"
        u"Okt(?:ober|\\.)|Nov(?:ember|\\.)|Dez(?:ember|\\.)";
    constexpr const char16_t* kBefore =
        u"(?i:am|vom|zum|zur|beim|im|dem|den|des|einem|einen|einer|jedem|jeden|jeder|diesem|diesen|dieser|seinem|"
        u"seinen|"
        u"seiner|ihrem|ihren|ihrer|bis|ab|seit)";
    constexpr const char16_t* kOf =
        u"(?i:in|an|auf|mit|nach|bei|von|zu|aus|vor|während|wegen|seit|trotz|unter|über|neben|zwischen) der";
    const UnicodeString number(u"(\\p{Nd}{1,3})\\.");
    const auto with = [&](const char16_t* rules) {
      return [this, rules](Match& match) {
        return std::optional(part(match, 1) + spelledOut(valueOf(part(match, 2)), rules));
      };
    };
    const UnicodeString noun(u"(?=\\s+\\p{Lu}\\p{L})"),
        month = UnicodeString(u"(?=\\s+(?:") + kMonths + u")(?!\\p{L}))";
    replace(UnicodeString(u"((?<!\\p{L})(?:") + kBefore + u"|" + kOf + u")\\s+)" + number + noun,
            with(u"%spellout-ordinal-n"));
    replace(UnicodeString(u"((?<!\\p{L})(?i:der|die|das|diese|jede|eine|seine|ihre|unsere)\\s+)") + number + noun,
            with(u"%spellout-ordinal"));
    replace(UnicodeString(u"((?<!\\p{L})(?i:ein|kein|sein|ihr|unser)\\s+)") + number + noun,
            with(u"%spellout-ordinal-r"));
    replace(UnicodeString(u"((?<![\\p{N}\\p{L}.,]))") + number + month, with(u"%spellout-ordinal-r"));
  }

  /// 1100 to 1999, without a separator: by hundreds.
  void sayYears() {
    replace(
        UnicodeString(u"(?<![\\p{L}\\p{N}.,/-])(1[1-9]\\p{Nd}{2})(?![\\p{L}\\p{N}/²³]|[.,]\\p{N})"),
        [&](Match& match) { return std::optional(spelledOut(valueOf(part(match, 1)), u"%spellout-numbering-year")); });
  }

  static constexpr int kLongest = 50;  ///< some milliseconds each, for a pattern

  UnicodeString text_;
  icu::Locale locale_;
  const Fractions* fractions_ = nullptr;
};

}  // namespace

std::string amountsInWords(std::string_view text, std::string_view locale) {
  const auto isDigit = [](char c) { return c >= '0' && c <= '9'; };
  // What has neither a digit nor a fraction's sign (C2 or E2 begins it) has no amount.
  if (std::none_of(text.begin(), text.end(), [&](char c) { return isDigit(c) || c == '\xC2' || c == '\xE2'; }))
    return std::string(text);
  std::string out;
  Amounts(UnicodeString::fromUTF8({text.data(), static_cast<int>(text.size())}), locale).read().toUTF8String(out);
  return out;
}

}  // namespace mouthpiece
