#include "phonetics/language/english_tables.h"

#include <algorithm>

#include "base/text_encoding.h"
#include "phonetics/language/phone.h"

namespace mouthpiece::english_text {
namespace {

constexpr Unit kUnits[] = {{"%", "percent", "percent"},
                           {"‰", "per mille", "per mille"},
                           {"°C", "degree Celsius", "degrees Celsius"},
                           {"°F", "degree Fahrenheit", "degrees Fahrenheit"},
                           {"°", "degree", "degrees"},
                           {"℃", "degree Celsius", "degrees Celsius"},
                           {"km/h", "kilometer per hour", "kilometers per hour"},
                           {"kph", "kilometer per hour", "kilometers per hour"},
                           {"mph", "mile per hour", "miles per hour"},
                           {"m/s", "meter per second", "meters per second"},
                           {"m/s²", "meter per second squared", "meters per second squared"},
                           {"km²", "square kilometer", "square kilometers"},
                           {"km2", "square kilometer", "square kilometers"},
                           {"m²", "square meter", "square meters"},
                           {"m2", "square meter", "square meters", false},
                           {"m³", "cubic meter", "cubic meters"},
                           {"m3", "cubic meter", "cubic meters", false},
                           {"cm²", "square centimeter", "square centimeters"},
                           {"cm³", "cubic centimeter", "cubic centimeters"},
                           {"ft²", "square foot", "square feet"},
                           {"km", "kilometer", "kilometers"},
                           {"m", "meter", "meters"},
                           {"cm", "centimeter", "centimeters"},
                           {"mm", "millimeter", "millimeters"},
                           {"µm", "micrometer", "micrometers"},
                           {"nm", "nanometer", "nanometers"},
                           {"mi", "mile", "miles"},
                           {"yd", "yard", "yards"},
                           {"ft", "foot", "feet"},
                           {"in", "inch", "inches", false},
                           {"kg", "kilogram", "kilograms"},
                           {"g", "gram", "grams"},
                           {"mg", "milligram", "milligrams"},
                           {"µg", "microgram", "micrograms"},
                           {"lb", "pound", "pounds"},
                           {"lbs", "pound", "pounds"},
                           {"oz", "ounce", "ounces"},
                           {"t", "ton", "tons"},
                           {"l", "liter", "liters"},
                           {"L", "liter", "liters"},
                           {"ml", "milliliter", "milliliters"},
                           {"mL", "milliliter", "milliliters"},
                           {"cl", "centiliter", "centiliters"},
                           {"gal", "gallon", "gallons"},
                           {"s", "second", "seconds"},
                           {"sec", "second", "seconds"},
                           {"secs", "second", "seconds"},
                           {"ms", "millisecond", "milliseconds"},
                           {"µs", "microsecond", "microseconds"},
                           {"ns", "nanosecond", "nanoseconds"},
                           {"min", "minute", "minutes"},
                           {"mins", "minute", "minutes"},
                           {"h", "hour", "hours"},
                           {"hr", "hour", "hours"},
                           {"hrs", "hour", "hours"},
                           {"mo", "month", "months", false},
                           {"yr", "year", "years"},
                           {"tsp", "teaspoon", "teaspoons"},
                           {"tbsp", "tablespoon", "tablespoons"},
                           {"yrs", "year", "years"},
                           {"Hz", "hertz", "hertz"},
                           {"kHz", "kilohertz", "kilohertz"},
                           {"MHz", "megahertz", "megahertz"},
                           {"GHz", "gigahertz", "gigahertz"},
                           {"W", "watt", "watts"},
                           {"kW", "kilowatt", "kilowatts"},
                           {"MW", "megawatt", "megawatts"},
                           {"kWh", "kilowatt hour", "kilowatt hours"},
                           {"V", "volt", "volts"},
                           {"mV", "millivolt", "millivolts"},
                           {"kV", "kilovolt", "kilovolts"},
                           {"mA", "milliamp", "milliamps"},
                           {"mAh", "milliamp hour", "milliamp hours"},
                           {"J", "joule", "joules"},
                           {"kJ", "kilojoule", "kilojoules"},
                           {"kcal", "kilocalorie", "kilocalories"},
                           {"Pa", "pascal", "pascals"},
                           {"hPa", "hectopascal", "hectopascals"},
                           {"kPa", "kilopascal", "kilopascals"},
                           {"dB", "decibel", "decibels"},
                           {"KB", "kilobyte", "kilobytes"},
                           {"kB", "kilobyte", "kilobytes"},
                           {"MB", "megabyte", "megabytes"},
                           {"GB", "gigabyte", "gigabytes"},
                           {"TB", "terabyte", "terabytes"},
                           {"Mbps", "megabit per second", "megabits per second"},
                           {"Gbps", "gigabit per second", "gigabits per second"},
                           {"Mbit/s", "megabit per second", "megabits per second"},
                           {"MB/s", "megabyte per second", "megabytes per second"},
                           {"px", "pixel", "pixels"},
                           {"fps", "frame per second", "frames per second"},
                           {"rpm", "revolution per minute", "revolutions per minute"},
                           {"bpm", "beat per minute", "beats per minute"},
                           {"ha", "hectare", "hectares"},
                           {"Ω", "ohm", "ohms"},
                           {"kΩ", "kilohm", "kilohms"},
                           {"MΩ", "megohm", "megohms"},
                           {"¢", "cent", "cents"},
                           {"p", "penny", "pence", false},
                           {"M", "million", "million", false},
                           {"bn", "billion", "billion"},
                           {"x", "time", "times", false}};

constexpr Currency kCurrencies[] = {{"US$", "U S dollar", "U S dollars", "cent", "cents"},
                                    {"A$", "Australian dollar", "Australian dollars", "cent", "cents"},
                                    {"R$", "real", "reais", "centavo", "centavos"},
                                    {"HK$", "Hong Kong dollar", "Hong Kong dollars", "cent", "cents"},
                                    {"NZ$", "New Zealand dollar", "New Zealand dollars", "cent", "cents"},
                                    {"C$", "Canadian dollar", "Canadian dollars", "cent", "cents"},
                                    {"$", "dollar", "dollars", "cent", "cents"},
                                    {"£", "pound", "pounds", "penny", "pence"},
                                    {"€", "euro", "euros", "cent", "cents"},
                                    {"¥", "yen", "yen", "", ""},
                                    {"₹", "rupee", "rupees", "paisa", "paise"},
                                    {"Rs.", "rupee", "rupees", "paisa", "paise"},
                                    {"Rs", "rupee", "rupees", "paisa", "paise"},
                                    {"฿", "baht", "baht", "satang", "satang"},
                                    {"₽", "rouble", "roubles", "kopeck", "kopecks"},
                                    {"₩", "won", "won", "", ""},
                                    {"₿", "bitcoin", "bitcoins", "", ""},
                                    {"USD", "U S dollar", "U S dollars", "cent", "cents"},
                                    {"EUR", "euro", "euros", "cent", "cents"},
                                    {"GBP", "pound", "pounds", "penny", "pence"},
                                    {"JPY", "yen", "yen", "", ""},
                                    {"CHF", "Swiss franc", "Swiss francs", "centime", "centimes"}};

using enum AbbreviationPlace;
constexpr Abbreviation kAbbreviations[] = {{"Mr.", "Mister"},
                                           {"Mrs.", "Missus"},
                                           {"Ms.", "Miz"},
                                           {"Mr", "Mister", kBeforeName},
                                           {"Mrs", "Missus", kBeforeName},
                                           {"Ms", "Miz", kBeforeName},
                                           {"Messrs.", "Messieurs"},
                                           {"Profs.", "professors"},
                                           {"Prof.", "Professor"},
                                           {"Rev.", "Reverend"},
                                           {"Gen.", "General", kBeforeName},
                                           {"Col.", "Colonel", kBeforeName},
                                           {"Capt.", "Captain"},
                                           {"Cmdr.", "Commander"},
                                           {"Lt.", "Lieutenant"},
                                           {"Sgt.", "Sergeant"},
                                           {"Maj.", "Major", kBeforeName},
                                           {"Sen.", "Senator", kBeforeName},
                                           {"Rep.", "Representative", kBeforeName},
                                           {"Gov.", "Governor", kBeforeName},
                                           {"Pres.", "President", kBeforeName},
                                           {"Hon.", "Honorable", kBeforeName},
                                           {"Mt.", "Mount", kBeforeName},
                                           {"Ft.", "Fort", kBeforeName},
                                           {"Jr.", "Junior"},
                                           {"Sr.", "Senior"},
                                           {"Ph.D.", "P H D"},
                                           {"PhD", "P H D"},
                                           {"Esq.", "Esquire"},
                                           {"Ave.", "Avenue"},
                                           {"Blvd.", "Boulevard"},
                                           {"Rd.", "Road", kAfterName},
                                           {"Ln.", "Lane", kAfterName},
                                           {"Sq.", "Square", kAfterName},
                                           {"Hwy.", "Highway"},
                                           {"Apt.", "apartment"},
                                           {"Bldg.", "building"},
                                           {"Inc.", "Incorporated"},
                                           {"Corp.", "Corporation"},
                                           {"Ltd.", "Limited"},
                                           {"Co.", "Company", kAfterName},
                                           {"Bros.", "Brothers", kAfterName},
                                           {"Dept.", "Department"},
                                           {"dept.", "department"},
                                           {"Univ.", "University"},
                                           {"Assn.", "Association"},
                                           {"govt.", "government"},
                                           {"Govt.", "Government"},
                                           {"Jan.", "January", kNearNumber},
                                           {"Feb.", "February"},
                                           {"Mar.", "March", kNearNumber},
                                           {"Apr.", "April"},
                                           {"Jun.", "June", kNearNumber},
                                           {"Jul.", "July", kNearNumber},
                                           {"Aug.", "August"},
                                           {"Sept.", "September"},
                                           {"Sep.", "September"},
                                           {"Oct.", "October"},
                                           {"Nov.", "November"},
                                           {"Dec.", "December"},
                                           {"Mon.", "Monday"},
                                           {"Tues.", "Tuesday"},
                                           {"Tue.", "Tuesday"},
                                           {"Weds.", "Wednesday"},
                                           {"Wed.", "Wednesday", kNearNumber},
                                           {"Thurs.", "Thursday"},
                                           {"Thu.", "Thursday"},
                                           {"Fri.", "Friday"},
                                           {"Sat.", "Saturday", kNearNumber},
                                           {"Sun.", "Sunday", kNearNumber},
                                           {"&c.", "et cetera"},
                                           {"etc.", "et cetera"},
                                           {"etc", "et cetera"},
                                           {"e.g.", "for example"},
                                           {"eg.", "for example"},
                                           {"i.e.", "that is"},
                                           {"ie.", "that is"},
                                           {"vs.", "versus"},
                                           {"vs", "versus"},
                                           {"approx.", "approximately"},
                                           {"Approx.", "approximately"},
                                           {"est.", "established", kBeforeNumber},
                                           {"Est.", "established", kBeforeNumber},
                                           {"a.k.a.", "also known as"},
                                           {"aka", "also known as"},
                                           {"cf.", "compare"},
                                           {"viz.", "namely"},
                                           {"ca.", "circa"},
                                           {"c.", "circa", kBeforeNumber},
                                           {"al.", "al"},
                                           {"tel.", "telephone"},
                                           {"Tel.", "telephone"},
                                           {"ext.", "extension"},
                                           {"misc.", "miscellaneous"},
                                           {"max.", "maximum"},
                                           {"min.", "minimum"},
                                           {"incl.", "including"},
                                           {"excl.", "excluding"},
                                           {"WWII", "World War Two"},
                                           {"WWI", "World War One"},
                                           {"C#", "C sharp"},
                                           {"F#", "F sharp"},
                                           {"G#", "G sharp"},
                                           {"D#", "D sharp"},
                                           {"A#", "A. sharp"},
                                           {"Mon-Fri", "Monday to Friday"},
                                           {"Sat-Sun", "Saturday to Sunday"},
                                           {"tsp.", "teaspoons"},
                                           {"tbsp.", "tablespoons"},
                                           {"w/o", "without"},
                                           {"w/", "with"},
                                           {"No.", "number", kBeforeNumber},
                                           {"no.", "number", kBeforeNumber},
                                           {"Nos.", "numbers", kBeforeNumber},
                                           {"nos.", "numbers", kBeforeNumber},
                                           {"№", "number", kBeforeNumber},
                                           {"pp.", "pages", kBeforeNumber},
                                           {"p.", "page", kBeforeNumber},
                                           {"pg.", "page", kBeforeNumber},
                                           {"vol.", "volume", kBeforeNumber},
                                           {"Vol.", "volume", kBeforeNumber},
                                           {"ch.", "chapter", kBeforeNumber},
                                           {"Ch.", "chapter", kBeforeNumber},
                                           {"sec.", "section", kBeforeNumber},
                                           {"Sec.", "section", kBeforeNumber},
                                           {"fig.", "figure", kBeforeNumber},
                                           {"Fig.", "figure", kBeforeNumber},
                                           {"figs.", "figures", kBeforeNumber},
                                           {"eq.", "equation", kBeforeNumber},
                                           {"ed.", "edition", kNearNumber},
                                           {"sq.", "square"},
                                           {"hrs.", "hours"},
                                           {"mins.", "minutes"},
                                           {"secs.", "seconds"},
                                           {"lbs.", "pounds"},
                                           {"oz.", "ounces"},
                                           {"ft.", "feet"}};

constexpr Emoji kEmojis[] = {{0x1F600, "grinning face"},
                             {0x1F601, "beaming face with smiling eyes"},
                             {0x1F602, "face with tears of joy"},
                             {0x1F603, "grinning face with big eyes"},
                             {0x1F604, "grinning face with smiling eyes"},
                             {0x1F605, "grinning face with sweat"},
                             {0x1F606, "grinning squinting face"},
                             {0x1F609, "winking face"},
                             {0x1F60A, "smiling face with smiling eyes"},
                             {0x1F60B, "face savoring food"},
                             {0x1F60D, "smiling face with heart-eyes"},
                             {0x1F60E, "smiling face with sunglasses"},
                             {0x1F60F, "smirking face"},
                             {0x1F612, "unamused face"},
                             {0x1F614, "pensive face"},
                             {0x1F618, "face blowing a kiss"},
                             {0x1F61C, "winking face with tongue"},
                             {0x1F621, "enraged face"},
                             {0x1F622, "crying face"},
                             {0x1F62D, "loudly crying face"},
                             {0x1F631, "face screaming in fear"},
                             {0x1F633, "flushed face"},
                             {0x1F634, "sleeping face"},
                             {0x1F642, "slightly smiling face"},
                             {0x1F643, "upside-down face"},
                             {0x1F644, "face with rolling eyes"},
                             {0x1F64F, "folded hands"},
                             {0x1F64C, "raising hands"},
                             {0x1F64B, "person raising hand"},
                             {0x1F914, "thinking face"},
                             {0x1F917, "smiling face with open hands"},
                             {0x1F923, "rolling on the floor laughing"},
                             {0x1F937, "person shrugging"},
                             {0x1F926, "person facepalming"},
                             {0x1F929, "star-struck"},
                             {0x1F970, "smiling face with hearts"},
                             {0x1F973, "partying face"},
                             {0x1F97A, "pleading face"},
                             {0x1F44D, "thumbs up"},
                             {0x1F44E, "thumbs down"},
                             {0x1F44F, "clapping hands"},
                             {0x1F44B, "waving hand"},
                             {0x1F44C, "OK hand"},
                             {0x1F4AA, "flexed biceps"},
                             {0x1F440, "eyes"},
                             {0x1F525, "fire"},
                             {0x1F389, "party popper"},
                             {0x1F38A, "confetti ball"},
                             {0x1F382, "birthday cake"},
                             {0x1F4AF, "hundred points"},
                             {0x1F480, "skull"},
                             {0x1F680, "rocket"},
                             {0x1F339, "rose"},
                             {0x1F495, "two hearts"},
                             {0x1F494, "broken heart"},
                             {0x1F499, "blue heart"},
                             {0x1F49A, "green heart"},
                             {0x1F49C, "purple heart"},
                             {0x2764, "red heart"},
                             {0x263A, "smiling face"},
                             {0x2600, "sun"},
                             {0x2728, "sparkles"},
                             {0x2B50, "star"},
                             {0x2705, "check mark button"},
                             {0x274C, "cross mark"}};

constexpr std::pair<std::string_view, std::string_view> kCries[] = {
    {"hm", "hum"},   {"m", "um"},     {"mhm", "um hum"}, {"m-hm", "um hum"}, {"sh", "shush"}, {"psht", "pished"},
    {"pst", "pist"}, {"pft", "pift"}, {"br", "burr"},    {"gr", "gurr"},     {"tsk", "tisk"}, {"z", "buzz"}};

constexpr std::string_view kStretched[] = {"ah", "aw",   "eh",   "go",    "god", "ha",   "help", "hey", "hi",   "ho",
                                           "no", "nope", "oh",   "okay",  "ow",  "so",   "stop", "ugh", "uh",   "um",
                                           "wa", "what", "whoa", "woah",  "wow", "yeah", "yes",  "yo",  "nah",  "yay",
                                           "er", "why",  "now",  "sorry", "oi",  "you",  "me",   "be",  "come", "very"};

constexpr std::array<std::string_view, 12> kMonths = {"January",   "February", "March",    "April",
                                                      "May",       "June",     "July",     "August",
                                                      "September", "October",  "November", "December"};

}  // namespace

std::span<const Unit> units() { return kUnits; }
std::span<const Currency> currencies() { return kCurrencies; }
std::span<const Abbreviation> abbreviations() { return kAbbreviations; }
std::span<const Emoji> emojis() { return kEmojis; }

std::string_view wordOfCry(std::string_view plain) {
  for (const auto& [cry, word] : kCries) {
    if (cry == plain) return word;
  }
  return {};
}

bool isStretched(std::string_view plain) {
  return std::find(std::begin(kStretched), std::end(kStretched), plain) != std::end(kStretched);
}

std::string_view monthOf(std::string_view name) {
  for (const std::string_view month : kMonths) {
    if (name == month || name == month.substr(0, 3) || (name == "Sept" && month == "September")) return month;
  }
  return {};
}

std::string_view monthOf(int number) {
  return number < 1 || number > 12 ? std::string_view() : kMonths[static_cast<std::size_t>(number - 1)];
}

bool isAcronym(std::string_view capitals) {
  return isWordOf(
      "NASA NATO UNESCO UNICEF OPEC AIDS LASER RADAR SONAR SCUBA PIN RAM ROM GIF FIFA UEFA NASDAQ SIM LAN WAN DOS"
      " ASCII NAFTA SWAT YOLO FOMO COVID SARS FEMA POTUS ZIP CAD",
      capitals);
}

bool isInitialism(std::string_view capitals) {
  return isWordOf(
      "FBI CIA USA UK UN EU US BBC CNN NBC ABC CBS IBM HIV DNA RNA CEO CFO CTO GPS USB URL API CPU GPU PDF TV PC DVD "
      "CD ID"
      " IQ ATM VIP FAQ DIY NYC LA DC UFO MRI IRS NBA NFL NHL NCAA NAACP IEEE UCLA USSR UNHCR ESPN AFAIK ASAP IBAN UAE"
      " IOC HTML HTTP HTTPS ISO ISBN IMHO",
      capitals);
}

bool isLoudWord(std::string_view capitals) {
  return isWordOf(
      "A AM AN AS AT BE BY DO GO HE IF IN IS IT ME MY NO OF OH OK ON OR SO TO UP WE ALL AND ANY ARE BAD BIG BUT BUY CAN"
      " DAY DID END FAR FOR FUN GET GOD GOT HAD HAS HER HEY HIM HIS HOT HOW ITS LET LOL LOT MAD MAN MAY NEW NOT NOW OFF"
      " OLD ONE OUR OUT OWN PUT RED RUN SAD SAW SAY SEE SHE SIT TEN THE TOO TOP TRY TWO USE WAS WAY WHO WHY WIN WOW YES"
      " YET YOU BYE AHA AHH OOH UGH HUH HMM SHH MMM BRR BOO NAH YEP AGO",
      capitals);
}

bool isRulerName(std::string_view name) {
  return isWordOf(
      "henry edward george charles james william richard elizabeth mary louis philip frederick francis napoleon "
      "nicholas"
      " alexander catherine peter paul pius john benedict gregory leo clement innocent urban boniface victor ferdinand"
      " wilhelm otto rudolf albert leopold christian gustav oscar haakon olav harald margrethe juan carlos felipe "
      "alfonso"
      " ivan ramses ramesses ptolemy darius stephen malcolm robert david umberto emmanuel amadeus maximilian joseph"
      " julius sixtus adrian martin constantine theodosius",
      lowerCase(name));
}

bool isNumberedThing(std::string_view name) {
  return isWordOf(
      "chapter part act scene section volume book phase type level appendix article title figure table war bowl class"
      " stage unit step episode season game",
      lowerCase(name));
}

bool isTopDomain(std::string_view name) {
  return isWordOf("com org net edu gov io co uk de eu fr info biz tv ai app dev", name);
}

}  // namespace mouthpiece::english_text
