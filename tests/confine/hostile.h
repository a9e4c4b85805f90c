/* What hostile code in a reader tries; tests only, and harmless where it succeeds: it touches marker files of
 * the test's folder, and sends SIGUSR1 to a process of the test's own. */
#pragma once

#include <stddef.h>

/* Of the environment (VSH_TEST_…): whom it acts on. */
typedef struct hostile_aim {
    const char *folder; /* for marker files; `kept` is a file there that is to stay as it is */
    int victim;         /* a process that is to get no signal */
    int parent;
    const char *outside; /* a file beyond what the reader needs; may be NULL */
} hostile_aim;

/* Tries each call in the calling thread. The names of those that were let through go to `done`, a blank
 * before each. Returns how many were tried. */
int hostile_calls(const hostile_aim *aim, char *done, size_t room);

/* Tries to read the parent, its memory and environment, and other files than the reader needs. As
 * hostile_calls(). */
int hostile_reads(const hostile_aim *aim, char *done, size_t room);
