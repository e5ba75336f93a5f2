// Work on many items by several threads, with results that do not depend on how many.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <memory>
#include <system_error>
#include <thread>
#include <vector>

namespace fieldalign {

// Calls body(begin, end) for consecutive blocks of `block` items that cover [0, n). The blocks are the same for every
// number of threads, so a sum kept per block and added in order is the same too.
//
// Nothing global, safe after a fork and for many callers at once; starting a thread costs about 15 microseconds. The call
// waits for blocks that were begun, not for threads: one that a busy machine starts late finds nothing left, and ends.
template <class Body>
void parallel_blocks(std::size_t n, std::size_t block, int threads, Body body) {
  if (n == 0) return;  // and `block` may be 0, too
  const std::size_t blocks = (n + block - 1) / block;
  struct Progress {
    std::atomic<std::size_t> next{0}, done{0};
    std::atomic<bool> has_failed{false};
    std::exception_ptr failure;  // of the block that set has_failed
  };
  const auto progress = std::make_shared<Progress>();
  // `body` and the sizes are only looked at by who has a block, and the call does not return before that is done.
  const auto work = [n, block, blocks, &body](Progress& shared) {
    for (std::size_t b; (b = shared.next.fetch_add(1, std::memory_order_relaxed)) < blocks;) {
      try {
        if (!shared.has_failed) body(b * block, std::min(n, (b + 1) * block));
      } catch (...) {
        if (!shared.has_failed.exchange(true)) shared.failure = std::current_exception();
      }
      if (shared.done.fetch_add(1, std::memory_order_acq_rel) + 1 == blocks) shared.done.notify_all();
    }
  };
  const std::size_t team = std::min<std::size_t>(std::max(threads, 1), blocks);
  try {
    for (std::size_t i = 1; i < team; ++i) std::thread([work, progress] { work(*progress); }).detach();
  } catch (const std::system_error&) {
    // The system gives no more threads: those that started do the work.
  }
  work(*progress);
  for (std::size_t done; (done = progress->done.load(std::memory_order_acquire)) < blocks;) progress->done.wait(done);
  if (progress->failure) std::rethrow_exception(progress->failure);
}

}  // namespace fieldalign
