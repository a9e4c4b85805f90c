/* How many threads the system gives this process. */
#ifndef VSHI_THREADS_H
#define VSHI_THREADS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* That liblog4cplus begins when OpenVDB is loaded; where the system refuses one, it ends the process. */
enum { VSHI_OPENVDB_THREADS = 4 };

/* How many threads of `wanted`, with stacks of so many bytes (0: the system's), can live beside this one: 0 …
 * wanted. They and those of OpenVDB and two more are begun, all at a time, and ended; once a process and
 * number, and never again after the first that was refused. Any thread. */
int32_t vshi_threads_given(int32_t wanted, size_t stack);

/* Whether so many can be begun now, beside those that there are. */
bool vshi_threads_left(int32_t wanted);

#ifdef __cplusplus
}
#endif
#endif
