// SPDX-License-Identifier: MIT
// Linked into tests under the thread sanitizer: OpenCV's parallel loops on threads that the sanitizer knows.
// OpenCV's own pool is not built with it, so that it would report every loop as a race.
#include <algorithm>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <opencv2/core/parallel/parallel_backend.hpp>

namespace {

class OnThreads final : public cv::parallel::ParallelForAPI {
 public:
  void parallel_for(int tasks, FN_parallel_for_body_cb_t body, void* data) override {
    std::vector<std::jthread> threads;
    const int share = (tasks + threads_ - 1) / threads_;
    for (int begin = share; begin < tasks; begin += share) {
      threads.emplace_back([=] {
        id_ = begin / share;
        body(begin, std::min(tasks, begin + share), data);
      });
    }
    body(0, std::min(tasks, share), data);
  }
  [[nodiscard]] int getThreadNum() const override { return id_; }
  [[nodiscard]] int getNumThreads() const override { return threads_; }
  int setNumThreads(int threads) override { return std::exchange(threads_, std::max(1, threads)); }
  [[nodiscard]] const char* getName() const override { return "threads"; }

 private:
  static inline thread_local int id_ = 0;
  int threads_ = 2;
};

[[maybe_unused]] const bool kInstalled = [] {
  cv::parallel::setParallelForBackend(std::make_shared<OnThreads>());
  return true;
}();

}  // namespace
