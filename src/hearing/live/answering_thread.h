#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

namespace mouthpiece {

/// A thread that answers one question at a time, for who goes on meanwhile. Its owner alone asks.
template <typename Question, typename Answer>
class AnsweringThread {
 public:
  /// `answer` may throw: there is no answer then.
  using Answering = std::function<Answer(const Question&, const std::stop_token&)>;

  /// Begins with `first`.
  AnsweringThread(Answering answer, Question first)
      : answering_(std::move(answer)),
        asked_(std::move(first)),
        worker_([this](const std::stop_token& stop) { work(stop); }) {}

  /// Whether it was asked: nothing is while another question is not answered.
  bool ask(Question question) {
    const std::scoped_lock lock(mutex_);
    if (is_busy_) return false;
    asked_ = std::move(question);
    is_busy_ = true;
    changed_.notify_all();
    return true;
  }

  /// Whether it has done what it was asked for, `within` a time while `waits`, asked every now and then, says so.
  bool isDone(std::chrono::milliseconds within, const std::function<bool()>& waits) {
    constexpr std::chrono::milliseconds kAsksAgain{10};
    std::unique_lock lock(mutex_);
    for (std::chrono::milliseconds waited{0}; is_busy_ && waited < within && (!waits || waits()); waited += kAsksAgain)
      changed_.wait_for(lock, kAsksAgain, [this] { return !is_busy_; });
    return !is_busy_;
  }

  /// The answer, once; nothing where there is none, or not yet.
  std::optional<Answer> take() {
    const std::scoped_lock lock(mutex_);
    return is_busy_ ? std::nullopt : std::exchange(answer_, std::nullopt);
  }

 private:
  void work(const std::stop_token& stop) {
    while (true) {
      std::optional<Question> question;
      {
        std::unique_lock lock(mutex_);
        if (!changed_.wait(lock, stop, [this] { return asked_.has_value(); })) return;
        question = std::exchange(asked_, std::nullopt);
      }
      std::optional<Answer> made;
      try {
        made = answering_(*question, stop);
      } catch (const std::exception&) {  // who waits for it counts it
      }
      const std::scoped_lock lock(mutex_);
      answer_ = std::move(made);
      is_busy_ = false;
      changed_.notify_all();
    }
  }

  Answering answering_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool is_busy_ = true;
  std::optional<Question> asked_;
  std::optional<Answer> answer_;
  std::jthread worker_;
};

}  // namespace mouthpiece
