// Any bytes as a `.face` file: what is read can be written and read again, or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "base/errors.h"
#include "retarget/face_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mouthpiece;
  try {
    const FaceFile face = parseFaceFile({reinterpret_cast<const char*>(data), size}, "fuzz.face");
    const std::string once = faceFileToBytes(face);
    if (faceFileToBytes(parseFaceFile(once, "once.face")) != once) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}
