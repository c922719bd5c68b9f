# Writes OUTPUT: INPUT's bytes as a string_view named SYMBOL in namespace mouthpiece.
file(READ ${INPUT} bytes HEX)
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
file(WRITE ${OUTPUT} "#include <string_view>
namespace mouthpiece {
static const unsigned char ${SYMBOL}Bytes[] = {\n${bytes}0x00};
extern const std::string_view ${SYMBOL};
const std::string_view ${SYMBOL}{reinterpret_cast<const char*>(${SYMBOL}Bytes), sizeof(${SYMBOL}Bytes) - 1};
}  // namespace mouthpiece
")
