#include "support/allocations.h"

#include <new>

namespace {

thread_local std::size_t count = 0;

}  // namespace

// The linker's --wrap sends calls of `f` to `__wrap_f` and those of `__real_f` to `f`.
extern "C" {

void* __real_malloc(std::size_t size);
void* __real_calloc(std::size_t items, std::size_t size);
void* __real_realloc(void* block, std::size_t size);
void* __real__Znwm(std::size_t size);  // operator new
void* __real__ZnwmSt11align_val_t(std::size_t size, std::align_val_t alignment);

void* __wrap_malloc(std::size_t size) {
  ++count;
  return __real_malloc(size);
}

void* __wrap_calloc(std::size_t items, std::size_t size) {
  ++count;
  return __real_calloc(items, size);
}

void* __wrap_realloc(void* block, std::size_t size) {
  ++count;
  return __real_realloc(block, size);
}

void* __wrap__Znwm(std::size_t size) {
  ++count;
  return __real__Znwm(size);
}

void* __wrap__ZnwmSt11align_val_t(std::size_t size, std::align_val_t alignment) {
  ++count;
  return __real__ZnwmSt11align_val_t(size, alignment);
}
}

namespace mouthpiece::test {

std::size_t allocationsIn(const std::function<void()>& work) {
  const std::size_t before = count;
  work();
  return count - before;
}

}  // namespace mouthpiece::test
