/* How many threads the system gives this process. */
#ifndef VSHI_THREADS_H
#define VSHI_THREADS_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* How many threads of `wanted`, with stacks of so many bytes (0: the system's), can live beside this one: 0 …
 * wanted. They and two more are begun, all at a time, and ended; once a process and number, and never again
 * after the first that was refused. Any thread. */
int32_t vshi_threads_given(int32_t wanted, size_t stack);

#ifdef __cplusplus
}
#endif
#endif
