// Libraries that trust a size in a file allocate it. Beyond the targets' memory limit this operator new
// fails, as in the confined reader, and the target continues. The sanitizer's own operator new would end the
// process.
#include "fuzz.h"

#include <cstdlib>
#include <new>

namespace {

constexpr std::size_t MOST = std::size_t(FUZZ_MEMORY);

void *take(std::size_t size) {
    return size <= MOST ? std::malloc(size > 0 ? size : 1) : nullptr;
}

void *take_or_throw(std::size_t size) {
    void *memory = take(size);
    if (memory == nullptr) {
        throw std::bad_alloc();
    }
    return memory;
}

} // namespace

void *operator new(std::size_t size) {
    return take_or_throw(size);
}

void *operator new[](std::size_t size) {
    return take_or_throw(size);
}

void *operator new(std::size_t size, const std::nothrow_t &) noexcept {
    return take(size);
}

void *operator new[](std::size_t size, const std::nothrow_t &) noexcept {
    return take(size);
}

void operator delete(void *memory) noexcept {
    std::free(memory);
}

void operator delete[](void *memory) noexcept {
    std::free(memory);
}

void operator delete(void *memory, std::size_t) noexcept {
    std::free(memory);
}

void operator delete[](void *memory, std::size_t) noexcept {
    std::free(memory);
}
