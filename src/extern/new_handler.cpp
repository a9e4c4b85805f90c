// A reader that is refused memory ends.
#include "sandbox/confine.h"
#include "sandbox/reader.h"

#include <new>
#include <unistd.h>

void vshi_confine_memory(void) {
    std::set_new_handler([] { _exit(VSHI_READER_OUT_OF_MEMORY); });
}
