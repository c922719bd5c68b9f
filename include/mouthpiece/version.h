#pragma once

/// Marks what the shared library exports; everything else in it is hidden.
#if defined(__GNUC__)
#define MOUTHPIECE_API __attribute__((visibility("default")))
#else
#define MOUTHPIECE_API
#endif

#define MOUTHPIECE_VERSION "0.2.0"

#ifdef __cplusplus
namespace mouthpiece {
/// The version of the library at hand, which may be newer than the headers a program was built with.
MOUTHPIECE_API const char* version();
}  // namespace mouthpiece
#endif
