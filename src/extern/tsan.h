// Telling ThreadSanitizer of a handover that it cannot see, as TBB's library is not built with it. Nothing in
// a program without that sanitizer.
#ifndef VSHI_EXTERN_TSAN_H
#define VSHI_EXTERN_TSAN_H

// Of the sanitizer's runtime, whatever this file was compiled with; null where the program has none.
extern "C" {
__attribute__((weak)) void __tsan_acquire(void *);
__attribute__((weak)) void __tsan_release(void *);
}

namespace vshi {

// What this thread did before give(at) is seen by a thread after its take(at).
inline void give(const void *at) {
    if (__tsan_release != nullptr) {
        __tsan_release(const_cast<void *>(at));
    }
}

inline void take(const void *at) {
    if (__tsan_acquire != nullptr) {
        __tsan_acquire(const_cast<void *>(at));
    }
}

} // namespace vshi

#endif
