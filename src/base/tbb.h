// Arenas of TBB that loops share, and handovers that ThreadSanitizer cannot see.
#pragma once

#include <memory>
#include <mutex>
#include <tbb/task_arena.h>
#include <utility>
#include <vector>

// ThreadSanitizer's runtime, null in other programs.
extern "C" {
__attribute__((weak)) void __tsan_acquire(void *);
__attribute__((weak)) void __tsan_release(void *);
}

namespace vshi {

// Tell ThreadSanitizer of a handover inside TBB, which is built without it: a thread after acquire(at) sees
// the work of a thread before release(at).
inline void release(const void *at) {
    if (__tsan_release != nullptr) {
        __tsan_release(const_cast<void *>(at));
    }
}

inline void acquire(const void *at) {
    if (__tsan_acquire != nullptr) {
        __tsan_acquire(const_cast<void *>(at));
    }
}

// An arena for a loop or a stage, kept for the next one. TBB 2021.8 frees an arena's memory only if no thread
// of the pool is in it at its end (oneTBB's issue 967): otherwise each loop leaked 7 KB.
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
        kept.arenas.emplace_back(threads, nullptr); // the place of this arena
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
        static auto *const kept = new Kept; // never destroyed: statics of others may run loops after main
        return *kept;
    }

    int threads;
    std::unique_ptr<tbb::task_arena> arena;
};

} // namespace vshi
