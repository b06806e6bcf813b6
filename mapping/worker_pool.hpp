#pragma once

#include <atomic>
#include <cstdint>
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

}  // namespace stairwell::mapping
