#include "mapping/worker_pool.hpp"

namespace stairwell::mapping {

namespace {

constexpr std::uint32_t kOver = 1U << 31;
constexpr int kSpins = 4000;  // some ten microseconds: the next task of a scan comes soon, and waking up takes longer

/// Until the value is another one than `old`.
template <typename T>
void spin_while(const std::atomic<T>& value, T old) {
  for (int i = 0; i < kSpins && value.load(std::memory_order_acquire) == old; ++i) {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }
}

}  // namespace

WorkerPool::WorkerPool(int threads) {
  for (int number = 1; number < threads; ++number) {
    workers_.emplace_back([this, number] { work(number); });
  }
}

WorkerPool::~WorkerPool() {
  round_.fetch_or(kOver, std::memory_order_release);
  round_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::run_erased(Call call, void* context) {
  if (!workers_.empty()) {
    call_ = call;
    context_ = context;
    busy_.store(static_cast<int>(workers_.size()), std::memory_order_relaxed);
    round_.store((round_.load(std::memory_order_relaxed) + 1) & ~kOver, std::memory_order_release);
    round_.notify_all();
  }
  call(context, 0);
  for (int left = busy_.load(std::memory_order_acquire); left > 0; left = busy_.load(std::memory_order_acquire)) {
    spin_while(busy_, left);
    busy_.wait(left, std::memory_order_acquire);
  }
}

void WorkerPool::work(int number) {
  std::uint32_t seen = 0;
  for (;;) {
    spin_while(round_, seen);
    round_.wait(seen, std::memory_order_acquire);
    const std::uint32_t now = round_.load(std::memory_order_acquire);
    if ((now & kOver) != 0) return;
    if (now == seen) continue;
    seen = now;
    call_(context_, number);
    if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_one();
  }
}

}  // namespace stairwell::mapping
