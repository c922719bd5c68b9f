/* Preloaded into a program (LD_PRELOAD), lets the n-th call of a kind fail, counted from the entry of main():
 *   FAULT_KIND    write (what makes, fills, flushes and renames files), read (what takes bytes from files),
 *                 allocation, child (processes, threads, pipes)
 *   FAULT_AT      n; 0: none fails
 *   FAULT_ALWAYS  set: every call from the n-th on fails, as on a disk that stays full
 *   FAULT_ERROR   the errno to fail with, a number
 *   FAULT_COUNT   a file that is told at the end how many calls there were
 *   FAULT_TRACE   a file that is told where the failing call came from
 * What glibc calls inside itself (fwrite's write, fopen's open) does not pass here; fopen itself does. */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <pthread.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *old, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);

enum kind { kNone, kWrite, kRead, kAllocation, kChild };

static enum kind watched = kNone;
static long fail_at = 0;
static int fail_always = 0;
static int error_number = EIO;
static atomic_int armed = 0;
static atomic_long calls = 0;

static void *real(const char *name) { return dlsym(RTLD_NEXT, name); }
#define REAL(name) ((__typeof__(&name))real(#name))

static void trace(void) {
  const char *path = getenv("FAULT_TRACE");
  if (path == NULL) return;
  armed = 0;
  void *frames[64];
  const int depth = backtrace(frames, 64);
  const int file = REAL(open)(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (file >= 0) {
    backtrace_symbols_fd(frames, depth, file);
    close(file);
  }
  armed = 1;
}

/* Whether this call is to fail; errno is set then. */
static int fails(enum kind kind) {
  if (kind != watched || !armed) return 0;
  const long number = ++calls;
  if (fail_at == 0 || number < fail_at || (number > fail_at && !fail_always)) return 0;
  if (number == fail_at) trace();
  errno = error_number;
  return 1;
}

/* Terminals, pipes and sockets are no files whose bytes could be lost. */
static int isFile(int descriptor) {
  struct stat facts;
  return fstat(descriptor, &facts) == 0 && S_ISREG(facts.st_mode);
}

static enum kind opens(int flags) { return (flags & O_ACCMODE) == O_RDONLY ? kRead : kWrite; }

/* What the system and its libraries read is as it is. */
static int isOfTheSystem(const char *path) {
  return strncmp(path, "/proc", 5) == 0 || strncmp(path, "/sys", 4) == 0 || strncmp(path, "/dev", 4) == 0 ||
         strncmp(path, "/etc", 4) == 0 || strncmp(path, "/usr", 4) == 0 || strncmp(path, "/lib", 4) == 0;
}

static int (*program_main)(int, char **, char **);

static int armedMain(int argc, char **argv, char **environment) {
  void *warm[4];
  backtrace(warm, 4); /* loads what it needs before anything may fail */
  armed = 1;
  return program_main(argc, argv, environment);
}

int __libc_start_main(int (*main)(int, char **, char **), int argc, char **argv, void (*init)(void),
                      void (*fini)(void), void (*rtld_fini)(void), void *stack_end) {
  const char *kind = getenv("FAULT_KIND");
  if (kind != NULL) {
    if (strcmp(kind, "write") == 0) watched = kWrite;
    if (strcmp(kind, "read") == 0) watched = kRead;
    if (strcmp(kind, "allocation") == 0) watched = kAllocation;
    if (strcmp(kind, "child") == 0) watched = kChild;
  }
  if (getenv("FAULT_AT") != NULL) fail_at = atol(getenv("FAULT_AT"));
  if (getenv("FAULT_ERROR") != NULL) error_number = atoi(getenv("FAULT_ERROR"));
  fail_always = getenv("FAULT_ALWAYS") != NULL;
  if (watched == kAllocation) error_number = ENOMEM;
  program_main = main;
  return ((int (*)(int (*)(int, char **, char **), int, char **, void (*)(void), void (*)(void), void (*)(void),
                   void *))real("__libc_start_main"))(armedMain, argc, argv, init, fini, rtld_fini, stack_end);
}

__attribute__((destructor)) static void tell(void) {
  const char *path = getenv("FAULT_COUNT");
  const long count = calls;
  armed = 0;
  if (path == NULL) return;
  FILE *file = REAL(fopen)(path, "w");
  if (file == NULL) return;
  fprintf(file, "%ld\n", count);
  fclose(file);
}

/* Allocations. */
void *malloc(size_t size) { return fails(kAllocation) ? NULL : __libc_malloc(size); }
void *calloc(size_t count, size_t size) { return fails(kAllocation) ? NULL : __libc_calloc(count, size); }
void *realloc(void *old, size_t size) { return fails(kAllocation) ? NULL : __libc_realloc(old, size); }
void *memalign(size_t alignment, size_t size) {
  return fails(kAllocation) ? NULL : __libc_memalign(alignment, size);
}
void *aligned_alloc(size_t alignment, size_t size) {
  return fails(kAllocation) ? NULL : __libc_memalign(alignment, size);
}
int posix_memalign(void **place, size_t alignment, size_t size) {
  if (fails(kAllocation)) return ENOMEM;
  *place = __libc_memalign(alignment, size);
  return *place == NULL ? ENOMEM : 0;
}

/* Files. */
#define OPEN(name)                                                           \
  int name(const char *path, int flags, ...) {                               \
    va_list rest;                                                            \
    va_start(rest, flags);                                                   \
    const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) ? va_arg(rest, mode_t) : 0; \
    va_end(rest);                                                            \
    if (!isOfTheSystem(path) && fails(opens(flags))) return -1;              \
    return REAL(name)(path, flags, mode);                                    \
  }
OPEN(open)
OPEN(open64)

int openat(int folder, const char *path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  if (!isOfTheSystem(path) && fails(opens(flags))) return -1;
  return REAL(openat)(folder, path, flags, mode);
}

#define FOPEN(name)                                                                                    \
  FILE *name(const char *path, const char *mode) {                                                     \
    if (!isOfTheSystem(path) && fails(mode[0] == 'r' && strchr(mode, '+') == NULL ? kRead : kWrite)) return NULL; \
    return REAL(name)(path, mode);                                                                     \
  }
FOPEN(fopen)
FOPEN(fopen64)

#define ON_A_FILE(kind, result, name, parameters, ...)                \
  result name parameters {                                            \
    if (isFile(descriptor) && fails(kind)) return -1;                 \
    return REAL(name)(__VA_ARGS__);                                   \
  }
ON_A_FILE(kWrite, ssize_t, write, (int descriptor, const void *bytes, size_t size), descriptor, bytes, size)
ON_A_FILE(kWrite, ssize_t, pwrite, (int descriptor, const void *bytes, size_t size, off_t at), descriptor, bytes, size, at)
ON_A_FILE(kWrite, ssize_t, pwrite64, (int descriptor, const void *bytes, size_t size, off64_t at), descriptor, bytes, size, at)
ON_A_FILE(kWrite, ssize_t, writev, (int descriptor, const struct iovec *parts, int count), descriptor, parts, count)
ON_A_FILE(kWrite, int, fsync, (int descriptor), descriptor)
ON_A_FILE(kWrite, int, fdatasync, (int descriptor), descriptor)
ON_A_FILE(kWrite, int, ftruncate, (int descriptor, off_t size), descriptor, size)
ON_A_FILE(kWrite, int, ftruncate64, (int descriptor, off64_t size), descriptor, size)
ON_A_FILE(kRead, ssize_t, read, (int descriptor, void *bytes, size_t size), descriptor, bytes, size)
ON_A_FILE(kRead, ssize_t, pread, (int descriptor, void *bytes, size_t size, off_t at), descriptor, bytes, size, at)
ON_A_FILE(kRead, ssize_t, pread64, (int descriptor, void *bytes, size_t size, off64_t at), descriptor, bytes, size, at)
ON_A_FILE(kRead, ssize_t, readv, (int descriptor, const struct iovec *parts, int count), descriptor, parts, count)

/* Renaming needs no room: on a full disk those after the n-th call succeed. */
int rename(const char *from, const char *to) {
  if (fails(kWrite) && calls == fail_at) return -1;
  return REAL(rename)(from, to);
}

#define FAILS_WITH(kind, failure, result, name, parameters, ...) \
  result name parameters {                                       \
    if (fails(kind)) return failure;                             \
    return REAL(name)(__VA_ARGS__);                              \
  }
FAILS_WITH(kWrite, -1, int, mkdir, (const char *path, mode_t mode), path, mode)
FAILS_WITH(kWrite, NULL, char *, mkdtemp, (char *pattern), pattern)
FAILS_WITH(kRead, NULL, DIR *, opendir, (const char *path), path)

/* Processes, threads and what joins them; the functions that return their error do so. */
FAILS_WITH(kChild, -1, pid_t, fork, (void))
FAILS_WITH(kChild, -1, int, pipe, (int ends[2]), ends)
FAILS_WITH(kChild, -1, int, pipe2, (int ends[2], int flags), ends, flags)
FAILS_WITH(kChild, -1, int, socketpair, (int domain, int type, int protocol, int ends[2]), domain, type, protocol, ends)
FAILS_WITH(kChild, error_number, int, posix_spawn,
           (pid_t *child, const char *path, const posix_spawn_file_actions_t *actions,
            const posix_spawnattr_t *attributes, char *const argv[], char *const environment[]),
           child, path, actions, attributes, argv, environment)
FAILS_WITH(kChild, error_number, int, pthread_create,
           (pthread_t *thread, const pthread_attr_t *attributes, void *(*start)(void *), void *argument), thread,
           attributes, start, argument)
