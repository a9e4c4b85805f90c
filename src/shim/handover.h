// Telling ThreadSanitizer of a handover that it cannot see, as TBB's library is not built with it. Nothing
// otherwise.
#ifndef VSHI_HANDOVER_H
#define VSHI_HANDOVER_H

#if defined(__SANITIZE_THREAD__)
#define VSHI_TSAN 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define VSHI_TSAN 1
#endif
#endif

#ifdef VSHI_TSAN
#include <sanitizer/tsan_interface.h>
#endif

namespace vshi {

// What this thread did before give(at) is seen by a thread after its take(at).
inline void give([[maybe_unused]] const void *at) {
#ifdef VSHI_TSAN
    __tsan_release(const_cast<void *>(at));
#endif
}

inline void take([[maybe_unused]] const void *at) {
#ifdef VSHI_TSAN
    __tsan_acquire(const_cast<void *>(at));
#endif
}

} // namespace vshi

#endif
