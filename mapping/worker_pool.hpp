#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <thread>
#include <vector>

namespace stairwell::mapping {

/// A few threads that do one thing together and then wait for the next.
class WorkerPool {
 public:
  /// @param threads the calling one included; 1 makes no thread at all
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls `task(i)` for i in [0, threads()), 0 on the calling thread; returns when all are done.
  /// @pre `task` does not throw
  template <typename Task>
  void run(Task task) {
    run_erased([](void* context, int i) { (*static_cast<Task*>(context))(i); }, &task);
  }

 private:
  using Call = void (*)(void*, int);
  void run_erased(Call call, void* context);
  void work(int number);

  Call call_ = nullptr;
  void* context_ = nullptr;
  std::atomic<std::uint32_t> round_{0};  ///< counts up with every task; the highest bit says that it is over
  std::atomic<int> busy_{0};
  std::vector<std::thread> workers_;
};

/// Calls `each(i, thread)` for i in [0, count), every thread taking the next one that is left; returns when all are
/// done. The calls must not get in each other's way. @param pool  null: all on the calling thread, which is 0
/// @throws what one of the calls threw, after the others
template <typename Each>
void share_among_threads(WorkerPool* pool, std::size_t count, const Each& each) {
  if (pool == nullptr || pool->threads() == 1 || count < 2) {
    for (std::size_t i = 0; i < count; ++i) each(i, 0);
    return;
  }
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::exception_ptr thrown;
  pool->run([&](int thread) {
    for (std::size_t i = next.fetch_add(1); i < count; i = next.fetch_add(1)) {
      try {
        each(i, thread);
      } catch (...) {
        if (!failed.exchange(true)) thrown = std::current_exception();
      }
    }
  });
  if (thrown) std::rethrow_exception(thrown);
}

/// The same for calls that do not ask which thread they are on.
template <typename Each>
void for_each_index(WorkerPool* pool, std::size_t count, const Each& each) {
  share_among_threads(pool, count, [&each](std::size_t i, int) { each(i); });
}

/// The same for calls so short that a thread takes some at a time.
template <typename Each>
void for_each_index_in_parts(WorkerPool* pool, std::size_t count, const Each& each) {
  constexpr std::size_t kPart = 32;
  for_each_index(pool, (count + kPart - 1) / kPart, [&each, count](std::size_t part) {
    const std::size_t end = std::min(count, (part + 1) * kPart);
    for (std::size_t i = part * kPart; i < end; ++i) each(i);
  });
}

}  // namespace stairwell::mapping
