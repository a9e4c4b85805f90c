// Loops over TBB's pool, and refused memory in a reader.
#include "base/tbb.h"
#include "base/guard.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/threads.h"

#include <algorithm>
#include <optional>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <unistd.h>

namespace {

struct Loop {
    vshi_job *job;
    size_t count;
    size_t grain;
    size_t units;
    vshi_range_fn *fn;
    void *user;

    void operator()(size_t index) const {
        vshi::acquire(this); // before this loop reads anything
        if (!vshi_job_cancelled(job)) {
            const size_t begin = index * grain;
            const size_t end = std::min(count, begin + grain);
            fn(user, begin, end);
            vshi_job_advance(job, units * (end - begin));
        }
        vshi::release(this);
    }
};

// An arena for one loop. Allows more threads than cores while it exists, but no more than the host allows:
// otherwise TBB complains on standard error.
class Arena {
  public:
    explicit Arena(int threads) {
        using control = tbb::global_control;
        if (threads > tbb::info::default_concurrency()) {
            more.emplace(control::max_allowed_parallelism, static_cast<size_t>(threads));
        }
        const size_t allowed = control::active_value(control::max_allowed_parallelism);
        const int wanted = threads > 0 ? threads : tbb::info::default_concurrency();
        arena.emplace(static_cast<int>(std::min(static_cast<size_t>(wanted), allowed)));
    }
    template <typename Fn> void run(const Fn &fn) { arena->execute(fn); }

  private:
    std::optional<tbb::global_control> more;
    std::optional<vshi::LentArena> arena;
};

// Only TBB throws here, if the system refuses a thread: loops throw nothing.
template <typename Body> vsh_result with_threads(vsh_error *error, Body &&body) {
    return vshi::guard(error, VSH_ERROR_INTERNAL, "threads", [&]() -> vsh_result {
        try {
            return body();
        } catch (const std::bad_alloc &) {
            throw;
        } catch (const std::exception &exception) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "threads: the system refused one (%s); ask for fewer",
                             exception.what());
        }
    });
}

} // namespace

int32_t vshi_parallel_threads(int32_t wanted) {
    if (wanted == 1) {
        return wanted;
    }
    using control = tbb::global_control;
    const int32_t all = wanted > 0 ? wanted : tbb::info::default_concurrency();
    const int32_t given = 1 + vshi_threads_given(all - 1, control::active_value(control::thread_stack_size));
    if (given == all) {
        return wanted;
    }
    // TBB would end the process. The limit also holds for arenas of others, because OpenVDB frees its trees
    // in TBB's own, and for the whole life of the process.
    static const auto *const limit =
        new control(control::max_allowed_parallelism, static_cast<size_t>(given));
    (void)limit;
    return given;
}

int32_t vshi_parallel_most(int32_t threads) {
    return threads > 0 ? threads : tbb::info::default_concurrency();
}

vsh_result vshi_parallel_for(vshi_job *job, size_t count, size_t grain, size_t units, vshi_range_fn *fn,
                             void *user, vsh_error *error) {
    return with_threads(error, [&]() -> vsh_result {
        const size_t pieces = (count + grain - 1) / grain;
        const Loop loop = {job, count, grain, units, fn, user};
        const int threads = vshi_job_threads(job);
        if (threads == 1) {
            for (size_t i = 0; i < pieces; ++i) {
                loop(i);
            }
        } else {
            Arena arena(threads);
            vshi::release(&loop);
            arena.run([&] { tbb::parallel_for(size_t{0}, pieces, loop); });
            vshi::acquire(&loop);
        }
        return vshi_job_check(job, error);
    });
}

vsh_result vshi_parallel_call(const vshi_job *job, void (*fn)(void *user), void *user, vsh_error *error) {
    return with_threads(error, [&]() -> vsh_result {
        Arena(vshi_job_threads(job)).run([&] { fn(user); });
        return VSH_OK;
    });
}

void vshi_exit_if_new_fails(int code) {
    static int exit_code;
    exit_code = code;
    std::set_new_handler([] { _exit(exit_code); });
}
