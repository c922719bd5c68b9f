#pragma once

#include <iterator>
#include <memory>
#include <optional>

#include "mouthpiece/performance.h"

namespace mouthpiece {

/// The frames of a performance one by one, each made when it is pulled:
///   for (const Frame& frame : speaker.stream("the time is now")) draw(frame);
/// Pulled by one thread.
class MOUTHPIECE_API FrameStream {
 public:
  explicit FrameStream(const Performance& performance);
  FrameStream(FrameStream&&) noexcept;
  FrameStream& operator=(FrameStream&&) noexcept;
  ~FrameStream();

  /// The next frame, nullptr after the last. It stays until the next call.
  const Frame* next();
  /// What is being performed, for its sound.
  [[nodiscard]] const Performance& performance() const;

  /// An input iterator over what next() gives.
  class Iterator {
   public:
    using difference_type = std::ptrdiff_t;
    using value_type = Frame;
    explicit Iterator(FrameStream* stream) : stream_(stream) { ++*this; }
    const Frame& operator*() const { return *frame_; }
    Iterator& operator++() {
      frame_ = stream_->next();
      return *this;
    }
    void operator++(int) { ++*this; }
    bool operator==(std::default_sentinel_t) const { return frame_ == nullptr; }

   private:
    FrameStream* stream_;
    const Frame* frame_ = nullptr;
  };
  Iterator begin() { return Iterator(this); }
  [[nodiscard]] std::default_sentinel_t end() const { return {}; }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mouthpiece
