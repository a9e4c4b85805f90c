/* The threads that the system gives this process. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vdbshade/base.h>

VSH_BEGIN_C

/* Threads that liblog4cplus begins when OpenVDB is loaded. It ends the process if the system refuses one. */
enum { VSHI_OPENVDB_THREADS = 4 };

/* Returns how many of `wanted` more threads this process can have, with stacks of `stack` bytes (0: the
 * system's): 0 … wanted. Tries it by beginning that many threads at once, with OpenVDB's and two more, and
 * ending them. Tries each number once, and none after a refusal. Thread safe. */
int32_t vshi_threads_given(int32_t wanted, size_t stack);

/* Returns whether the system lets this process begin that many more threads now. */
bool vshi_threads_left(int32_t wanted);

VSH_END_C
