#include "base/memory.h"

#include <malloc.h>

namespace mouthpiece {

void giveBackMemory() {
#if defined(__GLIBC__)
  malloc_trim(0);
#endif
}

}  // namespace mouthpiece
