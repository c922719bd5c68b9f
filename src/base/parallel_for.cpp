#include "base/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace mouthpiece {
namespace {

/// Whether this thread works for a parallelFor() beside others.
thread_local bool is_within = false;

/// Hands out indices in rising order. Once a body has thrown no new index is given out; all lower ones were given out
/// before and finish, so the lowest failing index does not depend on the timing.
class IndexQueue {
 public:
  IndexQueue(std::size_t count, const std::function<void(std::size_t)>& body) : count_(count), body_(body) {}

  /// `among_others`: not by one thread alone.
  void work(bool among_others) {
    const bool was_within = std::exchange(is_within, is_within || among_others);
    while (!failed_.load(std::memory_order_relaxed)) {
      const std::size_t index = next_.fetch_add(1, std::memory_order_relaxed);
      if (index >= count_) break;
      try {
        body_(index);
      } catch (...) {
        recordFailure(index);
      }
    }
    is_within = was_within;
  }

  void rethrowFirstFailure() const {
    if (first_failure_) std::rethrow_exception(first_failure_);
  }

 private:
  void recordFailure(std::size_t index) {
    const std::lock_guard lock(mutex_);
    if (!first_failure_ || index < failed_index_) {
      first_failure_ = std::current_exception();
      failed_index_ = index;
    }
    failed_.store(true, std::memory_order_relaxed);
  }

  std::size_t count_;
  const std::function<void(std::size_t)>& body_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> failed_{false};
  std::mutex mutex_;
  std::size_t failed_index_ = 0;
  std::exception_ptr first_failure_;
};

}  // namespace

std::size_t defaultThreadCount() { return std::max(1U, std::thread::hardware_concurrency()); }

void parallelFor(std::size_t count, std::size_t thread_count, const std::function<void(std::size_t)>& body) {
  IndexQueue queue(count, body);
  std::vector<std::thread> helpers;  // no std::jthread: clang's libc++ 14 has none
  const std::size_t wanted = is_within ? 1 : std::min(count, std::max<std::size_t>(thread_count, 1));
  helpers.reserve(wanted);
  try {
    while (helpers.size() + 1 < wanted) helpers.emplace_back([&queue] { queue.work(true); });
  } catch (const std::exception&) {
    // The machine gives no more threads, or no memory for one; those that run do the work.
  }
  queue.work(!helpers.empty());
  for (std::thread& helper : helpers) helper.join();
  queue.rethrowFirstFailure();
}

}  // namespace mouthpiece
