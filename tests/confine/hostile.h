/* Attacks by hostile code in a reader, for tests only. They are harmless if they succeed: they touch marker
 * files in the test's folder, and send SIGUSR1 to a process of the test. */
#pragma once

#include <stddef.h>

/* The targets of the attacks, from the environment (VSH_TEST_…). */
typedef struct hostile_aim {
    const char *folder; /* for marker files; the file `kept` in it must not change */
    int victim;         /* a process that must get no signal */
    int parent;
    const char *outside; /* a file beyond what the reader needs; may be NULL */
} hostile_aim;

/* Tries each call in the calling thread. Writes the names of successful ones to `done`, with a blank before
 * each. Returns how many it tried. */
int hostile_calls(const hostile_aim *aim, char *done, size_t room);

/* Tries to read the parent, its memory and environment, and other files than the reader needs. As
 * hostile_calls(). */
int hostile_reads(const hostile_aim *aim, char *done, size_t room);
