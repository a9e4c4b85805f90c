// Arenas of TBB, lent for a loop or a stage and kept: TBB 2021.8 gives an arena's memory back only where no
// thread of the pool was in it when it was let go (oneTBB's issue 967), and each loop cost 7 KB for good.
// There are as many as were lent at once, of each number of threads.
#ifndef VSHI_ARENAS_H
#define VSHI_ARENAS_H

#include <memory>
#include <mutex>
#include <tbb/task_arena.h>
#include <utility>
#include <vector>

namespace vshi {

class LentArena {
  public:
    explicit LentArena(int threads_) : threads(threads_) {
        Kept &kept = all();
        const std::lock_guard<std::mutex> lock(kept.mutex);
        for (auto &[size, waiting] : kept.arenas) {
            if (size == threads && waiting != nullptr) {
                arena = std::move(waiting);
                return;
            }
        }
        arena = std::make_unique<tbb::task_arena>(threads);
        kept.arenas.emplace_back(threads, nullptr); // a place to come back to
    }
    ~LentArena() {
        Kept &kept = all();
        const std::lock_guard<std::mutex> lock(kept.mutex);
        for (auto &[size, place] : kept.arenas) {
            if (size == threads && place == nullptr) {
                place = std::move(arena);
                return;
            }
        }
    }
    LentArena(const LentArena &) = delete;
    LentArena &operator=(const LentArena &) = delete;

    template <typename Fn> void execute(const Fn &fn) { arena->execute(fn); }

  private:
    struct Kept {
        std::mutex mutex;
        std::vector<std::pair<int, std::unique_ptr<tbb::task_arena>>> arenas;
    };
    static Kept &all() {
        static auto *const kept = new Kept; // outlives what ends after main
        return *kept;
    }

    int threads;
    std::unique_ptr<tbb::task_arena> arena;
};

} // namespace vshi

#endif
